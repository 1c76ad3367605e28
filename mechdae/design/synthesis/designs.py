"""From optima of the NLP to designs: distinct ones, swept, ranked, with prices and census.

Nodes move onto the true extremes, and the NLP is solved again: a minimax over nodes, and a limit
that is looked at in nodes, are exceeded between them. As in Remez' algorithm the extremes between
the nodes are found, the nearest nodes are put there, and the optimum is sought again from where it
was, until nothing lies between that the nodes do not see. Where targets may be visited at any time
the same is done with the times.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import coordinate
from mechdae.describe.file.load import from_dict
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.describe.tasks.constraints import Box, TransmissionAngle
from mechdae.describe.tasks.goals import FunctionTargets
from mechdae.design.synthesis.fourbar.freudenstein import three_pairs
from mechdae.design.synthesis.fourbar.linkage import are_cognates
from mechdae.design.synthesis.fourbar.starts import FourBarStarts
from mechdae.design.synthesis.goals.function import Function
from mechdae.design.synthesis.goals.path_generation import VisitsGoal
from mechdae.design.synthesis.ipopt import Optimum
from mechdae.design.synthesis.nlp import STIFF, NewValues, Nlp
from mechdae.design.synthesis.poses import dimensions
from mechdae.design.synthesis.search import Search
from mechdae.design.synthesis.starts.spread import Spread
from mechdae.design.synthesis.trace import fallen
from mechdae.design.synthesis.verification.claims import disagreement
from mechdae.design.synthesis.verification.verify import measured
from mechdae.design.synthesis.verify import Design, DesignMotion
from mechdae.records import dataclass
from mechdae.types import Floats, Json, Matrix

ROUNDS = 8


def exchanged(
    search: Search, nlp: Nlp, found: Optimum, given: dict[str, Any]
) -> tuple[Optimum, dict[str, Any]]:
    """Return the optimum on the true extremes, with the parameters that belong to it."""
    spread = search.spread
    for _ in range(ROUNDS):
        values = nlp.read(found.z)
        change = _change(search, spread, values, given)
        if change is None:
            break
        after = {**given, **change[1]}
        new = nlp.again(nlp.point({**values, **change[0]}), after, found)
        if new.violation > FEASIBLE or not np.isfinite(new.objective):
            break
        count, seconds = found.iterations + new.iterations, found.seconds + new.seconds
        found = replace(new, status=found.status, iterations=count, seconds=seconds)
        given = after
    return found, given


def _change(
    search: Search,
    spread: Spread,
    values: Mapping[str, Floats],
    given: Mapping[str, Floats | float],
) -> NewValues | None:
    """Return what moves, None where the nodes see all extremes."""
    changes = [goal.refined(spread, values, given) for goal in [*search.goals, *search.limits]]
    changes.append(fallen(spread, values, given))
    unknowns: dict[str, Matrix | list[float]] = {}
    more: dict[str, Floats] = {}
    for change in changes:
        if change is not None:
            unknowns |= change[0]
            more |= change[1]
    return (unknowns, more) if unknowns or more else None


FEASIBLE = 1e-7
"""Largest violation of a (dimensionless) constraint at an optimum that counts."""
SAME = 1e-5
"""Share by which objectives of one optimum may differ."""
TRIES = 20
"""Distinct optima that are looked at for them, where not all solutions are sought."""
WORTH = 3.0
"""Designs whose objective is this many times the best one are not reported."""
ACTIVE = 1e-6
"""Share of its range by which a parameter at its bound may be away from it."""
ALIKE = 1e-3
"""Relative difference below which dimensions, and invariants of cognates, are the same."""
ZERO = 1e-12
"""Objective of the NLP below which a design is exact."""
LISTED = 24
"""Solutions that do not move through their targets, up to which each one is reported."""
ROUNDING = 1e-16
"""The same where rounding is all that is left of it, after the polish."""
MET = 1e-9
"""Share of the unit of the objective up to which exact solutions have met their targets."""
KEEPS = 1e-7
"""By how much a transmission angle may be below its limit in the sweep of a design [rad]."""
SMOOTH = "Solve_Succeeded"
"""IPOPT's word where a gradient vanishes."""
KINK = (
    "the search ended where the goal changes no more but its gradient does not vanish, as at "
    "critical damping: with several free parameters others on the same kink may be better"
)
SILENT = (
    *STIFF, "target", "error", "deviation", "peak", "least", "stroke", "straight on",
    "swing", "end of the swing", *(f"objective {k}" for k in (1, 2, 3)),
)  # fmt: skip
"""Constraints that state a goal, not a limit with a price."""


def lengths(mechanism: Mechanism) -> dict[str, str]:
    """Return the parameters that alone say where a pin is on the x axis of a link, and the link."""
    pins = {end for joint in mechanism.joints.values() for end in (joint.first, joint.second)}
    return {
        place[0]: name
        for name, body in mechanism.bodies.items()
        for point, place in body.points.items()
        if f"{name}.{point}" in pins and isinstance(place[0], str)
        and place[0] in mechanism.parameters and not any(place[1:])
    }  # fmt: skip


def drawn_backwards(mechanism: Mechanism, parameters: Mapping[str, float]) -> list[str]:
    """Return which links of a design have a negative length."""
    every = lengths(mechanism)
    return [
        f"{name} is negative: {every[name]} is drawn backwards, its pin on the other side"
        for name, value in parameters.items()
        if name in every and value < 0
    ]


def left_out(search: Search) -> str:
    """Return the lengths that meet three pairs of angles, where bounds leave them out."""
    space, loop, goal = search.space, search.space.loop, search.lead
    stated = goal.asked
    if not isinstance(stated, FunctionTargets) or loop is None or not space.single_loop:
        return ""
    starts = (stated.input_start, stated.output_start)
    if len(stated.targets or ()) != 3 or any(x is None or isinstance(x, str) for x in starts):
        return ""
    mechanism, free = space.poses.mechanism, search.asked.free
    c = coordinate(mechanism, stated.output)
    if not c.is_angle:
        return ""
    bodies = (GROUND, c.part) if c.kind == "body angle" else mechanism.joints[c.part].bodies
    if tuple(bodies) != (GROUND, loop.rocker):
        return ""
    by_body = {body: name for name, body in lengths(mechanism).items()}
    names = [by_body.get(link, "") for link in (loop.crank, loop.coupler, loop.rocker)]
    four = FourBarStarts(space, loop.pins["A"])
    sizes = four.described(space.middle).lengths
    values = np.array([mechanism.values().get(name, np.nan) for name in names])
    if not (set(names) <= set(free) and np.allclose(np.abs(values), sizes[1:])):
        return ""
    x, y = np.array(stated.targets, float).T
    found = three_pairs(
        four.absolute(stated.input_start + x - x[0]), four.output(stated.output_start + y - y[0])
    )
    if found is None:
        return ""
    found = np.sign(values) * found * sizes[0]
    out = [n for n, v in zip(names, found, strict=True) if not free[n][0] <= v <= free[n][1]]
    if not out:
        return ""
    shown = ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, found, strict=True))
    return (
        f"the bounds of {', '.join(out)} leave out the four-bar that meets the three pairs: "
        f"{shown} (a negative length is a link that points the other way)"
    )


@dataclass(frozen=True)
class Candidate:
    """An optimum with the class and the start it was found from; ``free`` parameters lead it."""

    found: Optimum
    kind: int
    given: dict[str, Floats | float]
    free: int | None = None


@dataclass
class EqualOptima:
    """Optima with one objective: the best of them, how many there are, and all of them."""

    best: Candidate
    hits: int
    others: list[Candidate]


def distinct(candidates: list[Candidate]) -> list[EqualOptima]:
    """Return one group for each objective, best first."""
    found: list[EqualOptima] = []
    for candidate in sorted(candidates, key=lambda c: c.found.objective):
        group = next((g for g in reversed(found) if _alike(g.best, candidate)), None)
        if group is None:
            found.append(EqualOptima(candidate, 1, []))
        else:
            group.hits += 1
            group.others.append(candidate)
    return found


def _alike(first: Candidate, second: Candidate) -> bool:
    """Return whether two optima are one: the same objective, and where it is zero dimensions."""
    best, value = first.found.objective, second.found.objective
    if abs(value) > ZERO:
        return value - best <= SAME * abs(best)
    free = len(second.found.z) if second.free is None else second.free
    one, other = first.found.z[:free], second.found.z[:free]
    return bool(np.allclose(one, other, rtol=ALIKE, atol=1e-6))


def designs(
    search: Search, problems: Sequence[Nlp], found: list[EqualOptima]
) -> tuple[list[dict[str, Any]], list[Json]]:
    """Return the designs that hold in their sweeps, and those that do not with the reasons."""
    kept: list[dict[str, Any]] = []
    rejected: list[Json] = []
    every = search.all_solutions is not None
    exact = [each for each in found if each.best.found.objective <= ZERO] if _zero(search) else []
    most, tries = search.asked.keep, max(TRIES, search.asked.keep)
    if every:
        most = tries = len(found)
    elif exact and search.space.single_loop and search.asked.full_turn:
        found = [*_by_angle(search, problems, exact), *found[len(exact) :]]
    elif exact:  # more than are reported, to choose among them
        most = max(most, min(len(exact), tries))
    for group in found[:tries]:
        candidate, hits = group.best, group.hits
        worse = (
            search.all_solutions is None
            and kept
            and candidate.found.objective > WORTH * max(kept[0]["term"], ZERO)
        )
        if len(kept) == most or (worse and kept[0]["term"] > 0):
            break
        nlp = problems[candidate.kind]
        found_, given = candidate.found, candidate.given
        if len(kept) < 2 or search.asked.of(TransmissionAngle) or len(kept) < len(exact):
            found_ = nlp.polished(found_, given)
        found_, given = exchanged(search, nlp, found_, given)
        judged = judged_design(search, nlp, found_, replace(candidate, given=given), hits)
        if not judged.get("reasons") and group.others:
            same = cognates_among(search, problems, group)
            if same:
                judged["cognates"] = same
        if judged.get("reasons"):
            rejected.append(judged)
            continue
        twin = None if every else next((d for d in kept if _one(search, d, judged)), None)
        if twin is None:
            kept.append(judged)
        else:
            twin["hits"] += judged["hits"]
    for design in kept:
        del design["term"], design["branch"]
    kept.sort(key=lambda design: _rank(search, design))
    return kept if every else kept[: search.asked.keep], rejected


def motions(search: Search, kept: Sequence[dict[str, Any]]) -> dict[str, DesignMotion]:
    """Return how designs move, by the text of their problems; takes their files out of them."""
    name, full = search.problem.name, search.asked.full_turn
    found = {}
    for design in kept:
        text, file = design["problem"], design.pop("file", None)
        problem = from_dict(tomllib.loads(text), name) if file is None else file.problem
        found[text] = DesignMotion(problem, design["at"], full)
    return found


def _one(search: Search, first: dict[str, Any], second: dict[str, Any]) -> bool:
    """Return whether two designs are one: optima that have become the same on the true extremes.

    Angles may differ by whole turns, everything by what an optimum leaves open.
    """
    best, value = first["objective"], second["objective"]
    if first["class"] != second["class"] or not np.array_equal(first["branch"], second["branch"]):
        return False
    if abs(value - best) > SAME * abs(best) + ZERO * search.objective_unit:
        return False
    space, count = search.space, len(search.space.box)
    one, other = (np.array(list(design["parameters"].values())) for design in (first, second))
    gaps = (other - one)[:count]
    gaps = np.where(space.periodic, np.mod(gaps + np.pi, 2 * np.pi) - np.pi, gaps)
    near = np.abs(gaps) <= ALIKE * np.maximum(np.abs(one[:count]), 1e-3 * space.scale)
    return bool(near.all() and np.array_equal(one[count:], other[count:]))


def _by_angle(
    search: Search, problems: Sequence[Nlp], exact: list[EqualOptima]
) -> list[EqualOptima]:
    """Return exact four-bars by their least transmission angle over the turn."""
    d = ca.SX.sym("d", len(search.space.names))
    cosines = ca.Function("cosines", [d], [search.space.cosines(d)])

    def largest(group: EqualOptima) -> float:
        best = group.best
        values = problems[best.kind].read(best.found.z)["d"]
        at = dimensions(values, best.given)
        return float(np.abs(np.array(cosines(at))).max())

    return sorted(exact, key=largest)


def _zero(search: Search) -> bool:
    """Whether nothing tells designs without an error apart but rounding."""
    approximate = [goal for goal in search.goals if not goal.exact]
    return all(isinstance(goal, VisitsGoal) for goal in approximate)


def _rank(search: Search, design: dict[str, Any]) -> tuple[bool, float, float]:
    """Return what designs are ranked by: exact ones by their least transmission angle."""
    value = design["objective"] * search.sense
    lead = search.lead
    exact = isinstance(lead, VisitsGoal | Function) and lead.exact
    least = MET if exact else ROUNDING if _zero(search) else 0.0
    if abs(value) <= least * search.objective_unit:
        value = 0.0
    return bool(design["defects"]), value, -(design["transmission_angle_min"] or 0.0)


def cognates_among(
    search: Search, problems: Sequence[Nlp], group: EqualOptima
) -> list[dict[str, float]]:
    """Return the dimensions of Roberts' cognates of a group's best four-bar, as they were found."""
    lead = search.lead
    if not isinstance(lead, VisitsGoal) or lead.asked.is_motion or not search.space.single_loop:
        return []
    starts = FourBarStarts(search.space, lead.asked.what)
    if not starts.fits:
        return []
    every = [group.best, *group.others]
    vectors = [dimensions(problems[c.kind].read(c.found.z)["d"], c.given) for c in every]
    lines = [starts.described(d) for d in vectors]
    chosen: list[int] = []
    for k in range(1, len(every)):
        differs = all(
            np.abs(lines[k].lengths / lines[j].lengths - 1).max() > ALIKE for j in [0, *chosen]
        )
        if differs and are_cognates(lines[0], lines[k], ALIKE):
            chosen.append(k)
    names = search.space.names
    return [dict(zip(names, vectors[k].tolist(), strict=True)) for k in chosen]


def defective(search: Search) -> list[dict[str, Any]]:
    """Return the solutions of an exact goal that do not move through their targets, and why."""
    lead = search.lead
    found: list[dict[str, Any]] = []
    every = (lead.defective or []) if isinstance(lead, VisitsGoal) else []
    if len(every) > LISTED:
        return found
    for drawn, faults in every:
        free = len(search.space.box)
        values = {"d": drawn.d[:free]}
        given = {"choice": drawn.d[free:]}
        design = Design(search.problem, search.space, values, given, drawn.u[:1], drawn.x[0])
        found.append(
            {
                "objective": 0.0,
                "parameters": design.parameters,
                "errors": [0.0] * len(drawn.u),
                "at": np.asarray(drawn.u).tolist(),
                "defects": list(faults),
                "transmission_angle_min": None,
                "active": {},
                "class": "any",
                "hits": 1,
                "problem": design.text,
            }
        )
    return found


def judged_design(
    search: Search, nlp: Nlp, found: Optimum, candidate: Candidate, hits: int
) -> dict[str, Any]:
    """Return a design as its own file is measured, or why it is not reported."""
    given = {"choice": np.zeros(0), **candidate.given}
    values = nlp.read(found.z)
    u, x = search.lead.programme(values, given)
    design = Design(search.problem, search.space, values, given, np.asarray(u), x[0], search.around)
    file = design.file
    claims = [goal.claim(values, given) for goal in search.goals]
    parts = [measured(g.stated, c, file) for g, c in zip(search.goals, claims, strict=True)]
    defects = [text for part in parts for text in part.defects]
    for limit in search.limits:
        defects += measured(limit.stated, limit.claim(values, given), file).defects
    defects += file.turn[1]
    defects += _missed_limits(search, design)
    objective = search.objective([part.value for part in parts])
    claimed = search.claimed(nlp.terms_at(found.z, given))
    if not search.asked.objectives:  # of a front each objective is compared, see `front`
        gap = disagreement(objective, claimed, search.objective_unit, search.between_nodes)
        defects += [gap] if gap else []
    defects = list(dict.fromkeys(defects))
    if defects and search.all_solutions is None:
        return {"objective": claimed, "reasons": defects}
    lead = parts[search.goals.index(search.lead)]
    senses = [int(claim.sense) for goal, claim in zip(search.goals, claims, strict=True)
              if isinstance(goal.asked, FunctionTargets)]  # fmt: skip
    result = {
        "term": found.objective,
        "branch": given["sigma"],
        "file": file,
        "objective": objective if np.isfinite(objective) else claimed,
        "parameters": design.parameters,
        "errors": np.asarray(lead.errors).tolist(),
        "at": np.asarray(u).tolist(),
        "defects": defects,
        "transmission_angle_min": file.transmission,
        "active": active(search, nlp, found),
        "class": search.kinds[candidate.kind] or "any",
        "hits": hits,
        "problem": design.text,
    }
    if senses:
        result["sense"] = senses[0] if len(senses) == 1 else senses
    notes = [KINK] if nlp.bent and found.status != SMOOTH else []
    notes += drawn_backwards(search.problem.mechanism, design.parameters)
    if notes:
        result["note"] = "; ".join(notes)
    if search.robust is not None:
        result["robust"] = [part.robust for part in parts]
    if len(search.goals) > 1:
        result["goals"] = [float(part.value) for part in parts]
    return result


def _missed_limits(search: Search, design: Design) -> list[str]:
    """Return which limits the fine sweep over a turn finds missed."""
    found, _ = design.file.turn
    if found is None:
        return []
    mechanism, defects = search.problem.mechanism, []
    measured = found.summary.get("transmission", {})
    for limit in search.space.held_over_turn:
        dyad = search.space.dyad(limit.between)
        least = measured[dyad.joint]["min"]
        if not least >= limit.min - KEEPS:
            word = f"the transmission angle in {dyad.joint} falls to {np.degrees(least):.4g} deg"
            defects.append(word)
    for limit in search.space.held_at_poses:
        joint = search.space.dyad(limit.between).joint
        for goal in search.goals:
            at, _ = goal.programme(design.values, design.given)
            least = float(np.min(design.file.transmissions(np.unique(at))[joint]))
            if not least >= limit.min - KEEPS:
                word = f"the transmission angle in {joint} is {np.degrees(least):.4g} deg"
                defects.append(f"{word} at a pose of the goal")
    for box in search.asked.of(Box):
        for point in box.points:
            places = found.points[point].position
            slack = 2e-3 * search.size
            for axis, (low, high) in enumerate(box.bounds(mechanism.axes)):
                if places[:, axis].min() < low - slack or places[:, axis].max() > high + slack:
                    defects.append(f"{point} leaves its box")
    return defects


def active(search: Search, nlp: Nlp, found: Optimum) -> dict[str, float]:
    """Return the parameters and limits that hold the design back, with their prices.

    A price is the change of the objective per unit by which a limit gives way: per metre of
    lengths and margins, per one of sines and cosines of transmission angles.
    """
    prices = {}
    unit = search.objective_unit
    place = nlp.place("d").start
    scaled = found.z * nlp.scale
    for k, (name, (low, high)) in enumerate(search.asked.free.items()):
        if min(scaled[place + k] - low, high - scaled[place + k]) <= ACTIVE * (high - low):
            price = found.bound_prices[place + k] / nlp.scale[place + k]
            prices[name] = float(abs(price) * unit)
    held: dict[str, list[float]] = {}
    for word, price in zip(nlp.words, found.prices.tolist(), strict=True):
        if word not in SILENT:
            each = abs(price) * unit / nlp.unit(word)
            held.setdefault(nlp.side(word, price), []).append(each if abs(price) > ACTIVE else 0.0)
    # of a limit that holds at several poses all give way
    return prices | {name: sum(each) for name, each in held.items() if any(each)}
