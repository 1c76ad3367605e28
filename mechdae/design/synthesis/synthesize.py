"""The task of kind synthesis: starts, optima, distinct designs, each verified."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from mechdae.describe.coordinates import unit_within
from mechdae.describe.dimensions import parameter_units
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.goals import objective_unit
from mechdae.describe.tasks.synthesis import Synthesis
from mechdae.design.synthesis.designs import (
    FEASIBLE,
    Candidate,
    defective,
    designs,
    distinct,
    left_out,
    motions,
)
from mechdae.design.synthesis.exact.complete import Follow
from mechdae.design.synthesis.exact.complete import here as followed_here
from mechdae.design.synthesis.fourbar.reach import out_of_reach
from mechdae.design.synthesis.fronts import error_unit
from mechdae.design.synthesis.goals.base import Seed
from mechdae.design.synthesis.ipopt import Optimum
from mechdae.design.synthesis.nlp import Nlp
from mechdae.design.synthesis.poses import dimensions
from mechdae.design.synthesis.search import Search
from mechdae.results import Summary, SynthesisResult
from mechdae.types import Json

Job = tuple[int, Seed]
"""A start with its class."""
Run = Callable[[Search, Sequence[Nlp], Sequence[Job]], list[Optimum]]


def here(search: Search, problems: Sequence[Nlp], jobs: Sequence[Job]) -> list[Optimum]:
    """Return the optima of starts, one after the other in this process."""
    return [problems[k].solve(problems[k].point(s.values), s.given) for k, s in jobs]


def synthesize(
    problem: Problem,
    name: str,
    task: Synthesis,
    starts: int | None = None,
    seed: int | None = None,
    run: Run = here,
    follow: Follow = followed_here,
) -> SynthesisResult:
    """Return the designs of a task of synthesis, best first, each swept and certified."""
    began = time.process_time()
    search = Search(problem, task)
    search.followed_by(follow)
    problems = [search.build(kind) for kind in search.kinds]
    seed = search.asked.seed if seed is None else seed
    count = search.asked.starts if starts is None else starts
    built = time.process_time() - began
    by_class = planned(search, problems, count, seed)
    drawn = time.process_time() - began - built
    jobs, optima = solved_in_rounds(search, problems, by_class, count, run)
    again = finished(search, problems, jobs, optima)
    candidates = [
        Candidate(found, kind, start.given, len(search.space.box))
        for (kind, start), found in zip(jobs, optima, strict=True)
        if found.violation <= FEASIBLE and np.isfinite(found.objective)
    ]
    solved = time.process_time() - began - built - drawn
    several = distinct(candidates)
    remaining, rejected = designs(search, problems, several)
    remaining += defective(search)
    sound = sum(not each["defects"] for each in remaining)
    statuses = [found.status for found in optima]
    summary: dict[str, Any] = {
        "starts": len(jobs), "asked": count, "seed": seed,
        "exhausted": sum(found.exhausted for found in optima),
        "gone_on": again, "converged": len(candidates), "distinct": len(several),
        "hits_of_best": remaining[0]["hits"] if sound else 0,
        "status": "found" if sound else "none found", "units": units_of(search, problems),
        "rejected": rejected,
        "ipopt": {word: statuses.count(word) for word in dict.fromkeys(statuses)},
        "iterations": sum(found.iterations for found in optima),
        "objectives": [float(c.found.objective) * search.objective_unit for c in candidates],
        "runs": _runs(search, problems, jobs, optima),
        "seconds": {
            "build": built, "starts": drawn, "solve": solved,
            "whole": time.process_time() - began,
        },
    }  # fmt: skip
    summary |= {**_verdict(search), **search.said_of_speeds}
    fault, missing = None, left_out(search)
    notes = [*search.notes, *([missing] if missing and sound else [])]
    summary |= {"notes": notes} if notes else {}
    if not sound:
        fault, conflicts = fault_of(problems, jobs, optima, candidates, rejected)
        proof = out_of_reach(search) or _none_is_faultless(search)
        if proof:
            fault, summary["status"] = f"{proof}; {fault}", "none exists"
        fault = f"{fault}; {missing}" if missing else fault
        summary["conflicts"] = conflicts
    return SynthesisResult.of(
        problem, name, task,
        status=np.array(["rejected" if each["defects"] else "ok" for each in remaining]),
        summary=Summary(summary), fault=fault,
        data={"designs": remaining}, motions=motions(search, remaining),
    )  # fmt: skip


def units_of(search: Search, problems: Sequence[Nlp]) -> dict[str, str]:
    """Return the units of the objective and of the errors that designs list; "" if not known.

    Of free parameters and of limits too, as far as they are known.
    """
    goals = [goal for goal, _ in search.asked.goals]
    counted = [goal for goal, posed in zip(goals, search.goals, strict=True) if not posed.exact]
    lead = goals[search.goals.index(search.lead)]
    errors = error_unit(search.problem, lead)
    objective = errors if not counted else ""
    if len(counted) == 1:
        objective = objective_unit(counted[0], partial(unit_within, search.problem.mechanism, None))
    given = parameter_units(search.problem.mechanism, search.problem.tasks.values())
    found = {name: given[name] for name in search.asked.free if name in given}
    for nlp in problems:
        found |= nlp.in_si
    return {**found, "objective": objective, "errors": errors}


def _verdict(search: Search) -> dict[str, Any]:
    """Return how many solutions an exact goal has within the bounds, and how certain that is."""
    facts = search.exact_facts
    if not facts:
        return {}
    found = {"verdict": facts["verdict"], "exact": facts}
    return found if "freedoms" in facts else {"solutions": search.all_solutions, **found}


def _none_is_faultless(search: Search) -> str:
    """Return that all solutions of an exact goal have faults; empty where that is not certain."""
    facts = search.exact_facts
    if not facts or facts["verdict"] == "found" or facts["faultless"] or facts["infinite"]:
        return ""
    if not facts["within"]:
        return f"all {facts['count']} solutions are known, no real one is within the bounds"
    faults = "; ".join(facts["faults"])
    return (
        f"all {facts['count']} solutions are known, those within the bounds have faults: {faults}"
    )


def _runs(
    search: Search, problems: Sequence[Nlp], jobs: Sequence[Job], optima: Sequence[Optimum]
) -> list[Json]:
    """Return how each start ended."""
    return [
        {
            "class": search.kinds[kind] or "any", "status": found.status,
            "objective": _reported(search, problems[kind], found, start),
            "iterations": found.iterations,
        }
        for (kind, start), found in zip(jobs, optima, strict=True)
    ]  # fmt: skip


def finished(
    search: Search, problems: Sequence[Nlp], jobs: list[Job], optima: list[Optimum]
) -> int:
    """Go on with starts that ended short of what they could; returns how many had no end."""
    again = _gone_on(problems, jobs, optima)
    _followed(search, problems, jobs, optima)
    return again


def _gone_on(problems: Sequence[Nlp], jobs: Sequence[Job], optima: list[Optimum]) -> int:
    """Go on with starts where none met all constraints.

    With those that ran out of iterations; where second derivatives are approximate with all, from
    where the constraints are missed least. Returns how many; their optima are replaced where the
    constraints are missed by less.
    """
    if any(found.violation <= FEASIBLE for found in optima):
        return 0
    again = [i for i, (kind, _) in enumerate(jobs) if problems[kind].rough or optima[i].exhausted]
    for i in again:
        kind, start = jobs[i]
        nlp = problems[kind]
        points = [nlp.point(start.values), optima[i].z]
        if nlp.rough:
            nearest, missed = nlp.conflicts(points[0], start.given)
            points = [] if missed else [nearest.z]
        for z in points:
            new = nlp.gone_on(z, start.given)
            if new.violation < optima[i].violation:
                optima[i] = replace(new, iterations=new.iterations + optima[i].iterations)
    return len(again)


def _followed(
    search: Search, problems: Sequence[Nlp], jobs: list[Job], optima: list[Optimum]
) -> None:
    """Seek optima again whose poses do not follow from each other, where another is better.

    An optimum may have poses a whole turn from their neighbours, as far from their targets; and
    where no start meets all constraints, poses of a sound design beyond a branch. The poses that
    follow from one of them are the start then.
    """
    none = not any(found.violation <= FEASIBLE for found in optima)
    for i, (kind, start) in enumerate(jobs):
        nlp, found = problems[kind], optima[i]
        values = nlp.read(found.z)
        met = found.violation <= FEASIBLE
        if not (search.leaps(values, start.given) if met else none):
            continue
        d = dimensions(values["d"], start.given)
        at = float(np.atleast_1d(search.lead.programme(values, start.given)[0])[0])
        seed = search.of_design(d, search.kinds[kind], at)
        if seed is None:
            continue
        new = nlp.solve(nlp.point(seed.values), seed.given)
        if new.violation <= FEASIBLE and not (met and new.objective >= found.objective):
            jobs[i] = kind, seed
            optima[i] = replace(new, iterations=new.iterations + found.iterations)


def _reported(search: Search, nlp: Nlp, found: Optimum, start: Seed) -> float | None:
    """Return the objective of an optimum as it is reported, None where constraints are missed."""
    if found.violation > FEASIBLE or not np.isfinite(found.objective):
        return None
    if len(search.goals) == 1:
        return search.shown(found.objective)
    return search.claimed(nlp.terms_at(found.z, start.given))


def planned(search: Search, problems: Sequence[Nlp], count: int, seed: int) -> list[list[Seed]]:
    """Return up to `count` starts of each class, the most promising first."""
    found = []
    for k, kind in enumerate(search.kinds):
        generator = np.random.default_rng([seed, k])
        starts = list(search.seeds(kind, problems[k], generator, count))
        starts.sort(key=lambda start: start.residual)
        found.append(starts[:count] if search.all_solutions is None else starts)
    return found


def solved_in_rounds(
    search: Search, problems: Sequence[Nlp], by_class: list[list[Seed]], count: int, run: Run
) -> tuple[list[Job], list[Optimum]]:
    """Return starts and their optima: a share of each class, the rest of the best one."""
    share = count if len(by_class) == 1 else max(1, -(-count // SHARE))
    jobs = [(k, start) for k, starts in enumerate(by_class) for start in starts[:share]]
    optima = run(search, problems, jobs)
    left = count - len(jobs)
    if left <= 0:
        return jobs, optima
    best = [
        min(
            (o.objective for (k, _), o in zip(jobs, optima, strict=True)
             if k == kind and o.violation <= FEASIBLE),
            default=np.inf,
        )
        for kind in range(len(by_class))
    ]  # fmt: skip
    kind = int(np.argmin(best))
    more = [(kind, start) for start in by_class[kind][share : share + left]]
    return jobs + more, optima + run(search, problems, more)


SHARE = 5
"""The part of all starts that each class has first."""
NEAR = 1e-4
"""Left-over of a closure with which the nearest point still tells what is in conflict."""
ELASTIC = 5
"""Starts from which the limits in conflict are looked for."""


def fault_of(
    problems: Sequence[Nlp],
    jobs: Sequence[Job],
    optima: Sequence[Optimum],
    candidates: Sequence[Candidate],
    rejected: Sequence[Json],
) -> tuple[str, dict[str, float]]:
    """Return why there is no design, and the limits in conflict with their amounts."""
    if candidates:
        reasons = dict.fromkeys(text for each in rejected for text in each["reasons"])
        return (
            f"no design found from {len(jobs)} starts: {len(candidates)} met all constraints, "
            f"their sweeps rejected them: {'; '.join(list(reasons)[:3])}"
        ), {}
    if not jobs:
        return "no design found: no sample within the bounds assembles over the whole goal", {}
    best: dict[str, float] = {}
    least, exhausted = np.inf, False
    order = np.argsort([found.violation for found in optima], kind="stable")[:ELASTIC]
    for i in order:
        kind, start = jobs[i]
        nlp = problems[kind]
        for z in (optima[i].z, nlp.point(start.values)):
            found, amounts = nlp.conflicts(z, start.given)
            exhausted |= found.exhausted
            if amounts and found.violation <= NEAR and found.objective < least:
                best, least = amounts, found.objective
    stuck = sum(found.infeasible for found in optima)
    out = sum(found.exhausted for found in optima)
    ends = [f"{stuck} ended where no design near meets all limits"] if stuck else []
    ends += [f"{out} ran out of iterations, which says nothing about the task"] if out else []
    others = Counter(found.status for found in optima if not (found.infeasible or found.exhausted))
    ends += [
        f"{count} ended with IPOPT's {status.replace('_', ' ').lower()}"
        for status, count in others.most_common()
    ]
    text = f"no design found from {len(jobs)} starts ({', '.join(ends)})"
    if best:
        units = {word: si for nlp in problems for word, si in nlp.in_si.items()}
        shown = (
            f"{word} by {at:.3g} {units.get(word, '').strip('1')}" for word, at in best.items()
        )
        words = ", ".join(text.rstrip() for text in shown)
        return f"{text}; nearest to it, in conflict: {words}", best
    why = (
        "the search for them ran out of iterations too" if exhausted
        else "no design near keeps its links together"
    )  # fmt: skip
    return f"{text}; limits in conflict were not found: {why}", best
