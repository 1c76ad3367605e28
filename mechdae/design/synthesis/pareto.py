"""Fronts: the best compromises between objectives, by the epsilon-constraint method.

First each objective alone, from many starts; then, at levels between what it is at best and what
the best of the others leave of it, each of the others as small as the levels allow (Haimes, Lasdon
and Wismer 1971), started from what is known on both sides of the level. Levels are parameters of
one NLP, so that derivatives, jobs, their logs and their workers are those of single goals. Each
point is swept and certified like any design; points that others dominate are left out.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise, product
from typing import Any

import numpy as np

from mechdae.describe.coordinates import unit_within
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.goals import objective_unit
from mechdae.describe.tasks.synthesis import Synthesis
from mechdae.design.synthesis.designs import FEASIBLE, Candidate, exchanged, judged_design, motions
from mechdae.design.synthesis.exact.complete import Follow
from mechdae.design.synthesis.exact.complete import here as followed_here
from mechdae.design.synthesis.fronts import (
    SAME,
    FrontGap,
    Level,
    Point,
    census,
    gap_words,
    holes,
    missing,
    objective_name,
    part_of,
    spread,
)
from mechdae.design.synthesis.goals.base import Seed
from mechdae.design.synthesis.ipopt import Optimum
from mechdae.design.synthesis.nlp import Nlp
from mechdae.design.synthesis.search import NO_LIMIT, PICK, Search
from mechdae.design.synthesis.synthesize import (
    Run,
    fault_of,
    finished,
    here,
    planned,
    solved_in_rounds,
    synthesize,
    units_of,
)
from mechdae.design.synthesis.verification.claims import AGREES, FINER
from mechdae.numerics.dominance import best_of, hypervolume, thinned, undominated
from mechdae.results import Summary, SynthesisResult
from mechdae.types import Floats, Json

SLACK = 1e-6
"""Share by which an end may give way while the other objectives are improved."""
PASSES = 1
"""Times that the levels are gone through again from what their neighbours found."""
SPREAD = 8
"""One of so many levels of two objectives is spread over the ends, the others go into gaps."""
MORE = 1.5
"""Levels by points of a front at most: some lead nowhere."""
AT_ONCE = 4
"""Levels that are put into gaps in one round."""
TURNS, FURTHER = 2, 3
"""Rounds in which holes get starts of their own, and how many of each class."""
PART = "part of a front"
"""Status of a front an end of which was not found."""
NO_NUMBER = "Invalid_Number_Detected"
"""IPOPT's word of a start that has no derivatives: nothing can be started from it."""
TRIES = 3
"""Optima of a level that are swept until one holds."""


class FrontSearch:
    """What is known of a front while it is sought."""

    def __init__(self, search: Search, problems: Sequence[Nlp], run: Run) -> None:
        self.search, self.problems, self._run = search, problems, run
        self.count: int = search.asked.objectives
        self.points: list[Point] = []
        self.runs: list[dict[str, Any]] = []
        self.terms: list[Any] = []
        self.further: int = 0
        self.optima: list[Optimum] = []
        self.jobs: list[tuple[int, Seed]] = []

    def enter(self, jobs: Sequence[tuple[int, Seed]], optima: Sequence[Optimum], word: str) -> None:
        """Take solved jobs."""
        self.jobs += jobs
        self.optima += optima
        for (kind, start), found in zip(jobs, optima, strict=True):
            met = found.violation <= FEASIBLE and np.isfinite(found.objective)
            value = terms = None
            if met:
                terms = np.array(self.problems[kind].terms_at(found.z, start.given))[: self.count]
                self.points.append(Point(kind, start.given, found, terms))
                value = float(self.search.goals[0].value(terms[0]))
            self.terms.append(terms)
            self.runs.append(
                {"class": self.search.kinds[kind] or "any", "status": found.status,
                 "objective": value, "iterations": found.iterations, "part": word,
                 "solved": found.solved}
            )  # fmt: skip

    def solve(self, jobs: Sequence[tuple[int, Seed]], word: str) -> None:
        """Solve jobs and take what they give."""
        if jobs:
            self.enter(jobs, self._run(self.search, self.problems, jobs), word)

    def best(self, k: int) -> Point:
        """Return the point with the least of an objective."""
        return min(self.points, key=lambda point: float(point.terms[k]))

    def job(self, point: Point, level: Level) -> tuple[int, Seed]:
        """Return a start from a known point at a level."""
        nlp = self.problems[point.kind]
        return point.kind, Seed(nlp.read(point.found.z), {**point.given, **level.given}, 0.0)

    # -- the ends ------------------------------------------------------------------------------

    def finish_ends(self) -> None:
        """Improve the other objectives where one is at its best."""
        jobs = []
        for k in range(self.count):
            end = self.best(k)
            most = np.full(self.count, NO_LIMIT)
            most[k] = end.terms[k] + SLACK * (abs(end.terms[k]) + 1e-6)
            kind, seed = self.job(end, Level(k, most))
            pick = np.ones(self.count)
            pick[k] = 0.0
            jobs.append((kind, replace(seed, given={**seed.given, PICK: pick})))
        self.solve(jobs, "end")

    def end(self, k: int) -> Point:
        """Return the point at the end of an objective whose others are best."""
        least = float(self.best(k).terms[k])
        near = least + 2 * SLACK * (abs(least) + 1e-6)
        near_end = [point for point in self.points if point.terms[k] <= near]
        return min(near_end, key=lambda point: float(np.delete(point.terms, k).sum()))

    # -- the levels ----------------------------------------------------------------------------

    def levels(self, keep: int) -> list[Level]:
        ends = [self.end(k) for k in range(self.count)]
        low = np.array([ends[k].terms[k] for k in range(self.count)])
        high = np.max([end.terms for end in ends], axis=0)
        found: list[Level] = []
        inner = max(keep - self.count, 0)
        inner = -(-inner // SPREAD) if self.count == 2 else inner
        primaries = range(self.count) if self.count == 2 else range(1)
        for k, primary in enumerate(primaries):
            each = inner // 2 + (k == 0) * (inner % 2) if self.count == 2 else round(inner**0.5)
            others = [j for j in range(self.count) if j != primary]
            for row in product(*(spread(low[j], high[j], each) for j in others)):
                most = np.full(self.count, NO_LIMIT)
                most[others] = row
                found.append(Level(primary, most))
        return found

    def gaps(self, levels: Sequence[Level]) -> list[FrontGap]:
        """Return the gaps between neighbours on the front of two objectives.

        One in which levels led nowhere is cut there; what is below one of them counts half: where
        the front jumps there is nothing, where the search failed there may be.
        """
        front = self.reported(levels)
        front = front[np.lexsort((front[:, 1], front[:, 0]))]
        known = np.sort([level.most[1] for level in levels if level.primary == 0])
        found = []
        for (x0, high), (x1, low) in pairwise(front.tolist()):
            edge = SAME * (high - low)  # points keep their levels to rounding
            within = known[(known > low + edge) & (known < high - edge)]
            cuts = [low, *within.tolist(), high]
            for start, end in pairwise(cuts):
                gap = FrontGap((x1 - x0) * (1.0 if end == high else 0.5), start, end)
                if gap.area > 0:
                    found.append(gap)
        return found

    def between(self, gaps: Sequence[FrontGap], most: int, several: bool) -> list[Level]:
        """Return levels in the widest of some gaps.

        The hypervolume that a front of points lacks is half the area of its gaps, and least
        where all of them are alike (Auger, Bader, Brockhoff and Zitzler 2009): a gap that is cut
        into k lacks a k-th of its own. Each level goes where it takes away most.
        """
        parts = [1] * len(gaps)
        for _ in range(most if gaps else 0):
            gains = [
                gap.area / (k * (k + 1)) if several or k == 1 else 0.0
                for gap, k in zip(gaps, parts, strict=True)
            ]
            widest = int(np.argmax(gains))
            if not gains[widest] > 0:
                break
            parts[widest] += 1
        found = []
        for gap, count in zip(gaps, parts, strict=True):
            for share in np.arange(1, count) / count:
                level = np.full(2, NO_LIMIT)
                level[1] = gap.high + (gap.low - gap.high) * share
                found.append(Level(0, level))
        return found

    def around(self, level: Level) -> Iterator[Point]:
        """Yield points to start a level from: the best that keeps it, and one that nearly does."""
        points = [point for point in self.points if point.found.status != NO_NUMBER]
        allowed = [point for point in points if level.allows(point.terms)]
        k = level.primary
        if allowed:
            yield min(allowed, key=lambda point: float(point.terms[k]))
        least = min((float(point.terms[k]) for point in allowed), default=np.inf)
        beyond = [
            point for point in points
            if not level.allows(point.terms) and point.terms[k] < least
        ]  # fmt: skip
        if beyond:
            yield min(beyond, key=lambda point: level.missed(point.terms))

    def pass_over(self, levels: Sequence[Level], used: set[tuple[int, int]]) -> None:
        """Solve all levels from what is known around them and was not used before."""
        jobs = []
        for number, level in enumerate(levels):
            for point in self.around(level):
                if (number, id(point)) not in used:
                    used.add((number, id(point)))
                    jobs.append(self.job(point, level))
        self.solve(jobs, "level")

    def fill(self, levels: list[Level], keep: int) -> None:
        """Add levels in gaps of two objectives until there are so many points."""
        while len(levels) < MORE * keep:
            every = [{"objectives": terms} for terms in self.reported(levels)]
            left = keep - len(best_of(every, np.ones(self.count), SAME))
            if left <= 0:
                return
            last = left <= (keep - self.count + 1) // 2
            gaps = self.gaps(levels)
            more = self.between(gaps, left if last else min(AT_ONCE, left), several=last)
            if not more:
                return
            levels += more
            self.pass_over(more, set())

    def close(self, levels: list[Level], keep: int, seed: int) -> None:
        """Seek points in the holes of a front, from starts of their own."""
        for turn in range(TURNS):
            found = holes(self.reported(levels), keep)[:AT_ONCE]
            if not found:
                return
            drawn = planned(self.search, self.problems, FURTHER + 1, seed + 1 + turn)
            more, jobs = [], []
            for hole in found:
                most = hole.middle.copy()
                most[hole.primary] = NO_LIMIT
                level = Level(hole.primary, most)
                for kind, starts in enumerate(drawn):
                    drawn_ones = [start for start in starts if np.isfinite(start.residual)]
                    for start in drawn_ones[:FURTHER]:  # that of the file was a start already
                        given = {**start.given, **level.given}
                        jobs.append((kind, replace(start, given=given)))
                more.append(level)
            self.further += len(jobs)
            self.solve(jobs, "hole")
            self.pass_over(more, set())
            levels += more

    def candidates(self, levels: Sequence[Level]) -> list[list[Point]]:
        """Return the points that keep each end and level, the best of each first."""
        free = np.full(self.count, np.inf)
        found = []
        for number, level in enumerate([*(Level(k, free) for k in range(self.count)), *levels]):
            best = sorted(
                (point for point in self.points if level.allows(point.terms)),
                key=lambda point: float(point.terms[level.primary]),
            )
            if number < self.count and best:
                best.insert(0, self.end(number))
            found.append(best)
        return found

    def reported(self, levels: Sequence[Level]) -> Floats:
        """Return the objectives (n, m) of the best points of the ends and levels."""
        terms = np.array([best[0].terms for best in self.candidates(levels) if best])
        return terms[undominated(terms, 10 * SLACK)]

    # -- what is verified ------------------------------------------------------------------------

    def verified(self, levels: Sequence[Level]) -> tuple[list[dict[str, Any]], list[Any]]:
        """Return the designs that hold in their sweeps, one for each end and level, and others."""
        distinct: list[dict[str, Any]] = []
        rejected: list[dict[str, Any]] = []
        judged: dict[int, dict[str, Any]] = {}
        for best in self.candidates(levels):
            for point in best[:TRIES]:
                known = judged.get(id(point))
                if known is None:
                    known = judged[id(point)] = self.judge(point)
                    (rejected if known.get("reasons") else distinct).append(known)
                if not known.get("reasons"):
                    break
        return distinct, rejected

    def known(self, points: list[list[float]], keep: int) -> dict[str, Any]:
        """Return how the ends of the front that is reported were found, and its holes."""
        terms = np.array([point.terms for point in self.points])
        span = np.ptp(terms[undominated(terms)], axis=0)
        units = [goal.value(1.0) for goal in self.search.goals[: self.count]]
        reported = np.array(points) / units
        ends = []
        for k in range(self.count):
            best = float(terms[:, k].min())
            end = census(self.runs, self.terms, k, best, float(span[k]))
            slack = SAME * (abs(best) + span[k])
            end["found"] &= bool(reported[:, k].min() <= best + slack)
            ends.append(end)
        left = [
            {"first": (hole.first * units).tolist(), "last": (hole.last * units).tolist(),
             "starts": self.further}
            for hole in holes(reported, keep)
        ]  # fmt: skip
        return {"ends": ends, "holes": left}

    def notes(self, front: Json) -> list[str]:
        """Return what is said of ends that were not found, and of holes."""
        sentences = [missing(k, end) for k, end in enumerate(front["ends"]) if not end["found"]]
        return sentences + [gap_words(hole) for hole in front["holes"]]

    def judge(self, point: Point) -> dict[str, Any]:
        """Return a point as a design, or why it is none."""
        search, nlp = self.search, self.problems[point.kind]
        found = nlp.polished(point.found, point.given)
        found, given = exchanged(search, nlp, found, point.given)
        judged = judged_design(search, nlp, found, Candidate(found, point.kind, given), 1)
        if judged.get("reasons"):
            return judged
        terms = nlp.terms_at(found.z, given)
        values = judged["goals"][: self.count]
        for k, (goal, value) in enumerate(zip(search.goals, values, strict=False)):
            claimed = goal.value(terms[k])
            share, least = (FINER, 1e-5) if search.between_nodes else (AGREES, 1e-9)
            # a bound that nothing draws tight may be better in the sweep, never worse
            if not goal.sense * (value - claimed) <= share * abs(claimed) + least * goal.unit:
                reason = f"the sweep gives {value:.6g} of objective {k + 1}, not {claimed:.6g}"
                return {"objective": claimed, "reasons": [reason]}
        del judged["term"], judged["branch"]
        return {**judged, "objective": values[0], "objectives": values}


def synthesized(
    problem: Problem,
    name: str,
    task: Synthesis,
    starts: int | None = None,
    seed: int | None = None,
    run: Run = here,
    follow: Follow = followed_here,
) -> SynthesisResult:
    """Return the designs of a task of synthesis, of several objectives their front."""
    if task.objectives is None:
        return synthesize(problem, name, task, starts, seed, run, follow)
    return front_of(Search(problem, task), name, starts, seed, run)


def front_of(
    search: Search, name: str, starts: int | None, seed: int | None, run: Run
) -> SynthesisResult:
    """Return the front of a task's objectives, each point swept and certified.

    `starts`, `seed`: in place of the task's own; the starts are shared among the objectives.
    """
    began = time.process_time()
    required, problem = search.asked, search.problem
    problems = [search.build(kind) for kind in search.kinds]
    seed = required.seed if seed is None else seed
    count = required.starts if starts is None else starts
    front = FrontSearch(search, problems, run)
    by_class = planned(search, problems, max(1, -(-count // front.count)), seed)
    for k, pick in enumerate(np.eye(front.count)):
        picked = [[_picked(start, pick) for start in starts] for starts in by_class]
        each = max(1, -(-count // front.count))
        jobs, optima = solved_in_rounds(search, problems, picked, each, run)
        finished(search, problems, jobs, optima)
        front.enter(jobs, optima, part_of(k))
    levels: list[Level] = []
    if front.points:
        front.finish_ends()
        levels = front.levels(required.keep)
        used: set[tuple[int, int]] = set()
        for _ in range(1 + PASSES):
            front.pass_over(levels, used)
        if front.count == 2:
            front.fill(levels, required.keep)
        front.close(levels, required.keep, seed)
        if front.count == 2:
            front.fill(levels, required.keep)
    designs, rejected = front.verified(levels) if front.points else ([], [])
    signs = np.array([goal.sense for goal in search.goals[: front.count]], float)
    kept = best_of(designs, signs, SAME)
    dominated = len(designs) - len(kept)
    if front.count == 2:
        values = [design["objectives"] for design in kept] * signs if kept else []
        kept = [kept[k] for k in thinned(values, required.keep)]
    fault: str | None = None
    conflicts: dict[str, float] = {}
    if not kept:
        candidates = [Candidate(point.found, point.kind, point.given) for point in front.points]
        fault, conflicts = fault_of(problems, front.jobs, front.optima, candidates, rejected)
    summary: dict[str, Any] = {
        "starts": len(front.jobs), "asked": count, "converged": len(front.points),
        "distinct": len(designs), "hits_of_best": 1 if kept else 0, "seed": seed,
        "status": "none found", "rejected": rejected, "units": units_of(search, problems),
        "iterations": sum(found.iterations for found in front.optima),
        "objectives": [run["objective"] for run in front.runs if run["objective"] is not None],
        "runs": front.runs, "seconds": {"whole": time.process_time() - began},
    }  # fmt: skip
    summary |= search.said_of_speeds
    if kept:
        described = _described(search, kept, dominated, signs)
        summary["front"] = described | front.known(described["points"], required.keep)
        whole = all(end["found"] for end in summary["front"]["ends"])
        summary["status"] = "found" if whole else PART
        notes = [*search.notes, *front.notes(summary["front"])]
        if len(kept) == 1:
            notes.append(
                "the objectives do not contradict each other: one design is best in all of them"
            )
        if notes:
            summary["notes"] = notes
    else:
        summary["conflicts"] = conflicts
    return SynthesisResult.of(
        problem, name, search.task,
        status=np.array(["ok"] * len(kept)), summary=Summary(summary), fault=fault,
        data={"designs": kept}, motions=motions(search, kept),
    )  # fmt: skip


def _picked(start: Seed, pick: Floats) -> Seed:
    return replace(start, given={**start.given, PICK: pick})


def _described(
    search: Search, kept: list[dict[str, Any]], dominated: int, signs: Floats
) -> dict[str, Any]:
    """Return the front as it is reported: points, reference, hypervolume."""
    count = search.asked.objectives
    values = np.array([design["objectives"] for design in kept])
    given = search.asked.reference
    worst = (values * signs).max(axis=0) * signs
    reference = np.array(given if given is not None else worst, float)
    goals = [goal for goal, _ in search.asked.goals[:count]]
    unit_of = partial(unit_within, search.problem.mechanism, None)
    return {
        "objectives": [
            {"name": objective_name(goal), "unit": objective_unit(goal, unit_of),
             "sense": "least" if sign > 0 else "largest"}
            for goal, sign in zip(goals, signs, strict=True)
        ],
        "points": values.tolist(),
        "dominated": dominated,
        "reference": reference.tolist(),
        "hypervolume": hypervolume(values * signs, reference * signs),
    }  # fmt: skip
