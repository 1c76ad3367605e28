"""From optima of the NLP to designs: distinct ones, swept, ranked, with prices and census."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechdae.describe.tasks import Driver, Sweep
from mechdae.describe.writing import dumps
from mechdae.synthesis.goals.visits import Visits
from mechdae.synthesis.ipopt import Optimum
from mechdae.synthesis.nlp import Nlp
from mechdae.synthesis.search import Search
from mechdae.synthesis.verify import Design

FEASIBLE = 1e-7
"""Largest violation of a (dimensionless) constraint at an optimum that counts."""
SAME = 1e-5
"""Share by which objectives of one optimum may differ."""
MOST = 5
"""Designs that are reported."""
TRIES = 20
"""Distinct optima that are looked at for them, where not all solutions are sought."""
WORTH = 3.0
"""Designs whose objective is this many times the best one are not reported."""
ACTIVE = 1e-6
"""Share of its range by which a parameter at its bound may be away from it."""
ZERO = 1e-12
"""Objective of the NLP below which a design is exact."""
AGREES = 1e-6
"""Share by which the sweep's objective may differ from that of the NLP."""
FINER = 0.5
"""The same where the sweep looks between the nodes of the NLP: what it finds is reported."""
SILENT = ("closure", "target", "error", "deviation", "peak", "least", "stroke", "straight on",
          "swing", "end of the swing")  # fmt: skip
"""Constraints that state a goal, not a limit with a price."""


@dataclass(frozen=True)
class Candidate:
    """An optimum with the class and the start it was found from."""

    found: Optimum
    kind: int
    given: dict[str, Any]


def distinct(candidates: list[Candidate]) -> list[tuple[Candidate, int]]:
    """Return one candidate for each objective, best first, with its hits."""
    found: list[tuple[Candidate, int]] = []
    for candidate in sorted(candidates, key=lambda c: c.found.objective):
        value = candidate.found.objective
        if found:
            last = found[-1][0].found.objective
            near = abs(value) <= ZERO or value - last <= SAME * abs(last)
            if near and not _differs(found[-1][0], candidate, value):
                found[-1] = (found[-1][0], found[-1][1] + 1)
                continue
        found.append((candidate, 1))
    return found


def _differs(first: Candidate, second: Candidate, value: float) -> bool:
    """Return whether exact designs are others: many share the objective zero."""
    if abs(value) > ZERO:
        return False
    return not np.allclose(first.found.z[:4], second.found.z[:4], rtol=1e-3, atol=1e-6)


def designs(
    search: Search, problems: Sequence[Nlp], found: list[tuple[Candidate, int]]
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return the designs that hold in their sweeps, and those that do not with the reasons."""
    kept: list[dict[str, Any]] = []
    rejected: list[dict[str, Any]] = []
    most = MOST if search.all_solutions is None else len(found)
    for candidate, hits in found if search.all_solutions is not None else found[:TRIES]:
        worse = (
            search.all_solutions is None
            and kept
            and candidate.found.objective > WORTH * max(kept[0]["term"], ZERO)
        )
        if len(kept) == most or (worse and kept[0]["term"] > 0):
            break
        nlp = problems[candidate.kind]
        if not kept or len(kept) < 2:
            polished = nlp.polished(candidate.found, candidate.given)
        else:
            polished = candidate.found
        judged = _judged(search, nlp, polished, candidate, hits)
        (rejected if judged.get("reasons") else kept).append(judged)
    for design in kept:
        del design["term"]
    kept.sort(key=lambda design: (bool(design["defects"]), design["objective"] * search.sense))
    return kept, rejected


def defective(search: Search) -> list[dict[str, Any]]:
    """Return the solutions of an exact goal that do not move through their targets, and why."""
    lead = search.lead
    found = []
    for drawn, faults in (lead.defective or []) if isinstance(lead, Visits) else []:
        free = len(search.space.box)
        values = {"d": drawn.d[:free]}
        given = {"choice": drawn.d[free:]}
        design = Design(search.problem, search.space, values, given, drawn.u, drawn.x[0])
        task = Sweep(Driver(search.asked.driver, at=(float(drawn.u[0]),)))
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
                "problem": dumps(design.as_problem({**design.others, "path": task})),
            }
        )
    return found


def _judged(
    search: Search, nlp: Nlp, found: Optimum, candidate: Candidate, hits: int
) -> dict[str, Any]:
    """Return a design as it is reported, or why it is not."""
    given = {"choice": np.zeros(0), **candidate.given}
    values = nlp.read(found.z)
    u, x = search.lead.programme(values, given)
    design = Design(search.problem, search.space, values, given, np.asarray(u), x[0], search.around)
    worths = [goal.worth(design) for goal in search.goals]
    defects = [text for worth in worths for text in worth.defects]
    for limit in search.limits:
        defects += limit.worth(design).defects
    defects += design.turn[1]
    defects += _missed_limits(search, design)
    objective = search.objective([worth.value for worth in worths])
    claimed = search.claimed(found.objective)
    share, least = (FINER, 1e-5) if search.between_nodes else (AGREES, 1e-9)
    if not abs(objective - claimed) <= share * abs(claimed) + least * search.objective_unit:
        defects.append(f"the sweep gives {objective:.6g}, not {claimed:.6g}")
    defects = list(dict.fromkeys(defects))
    if defects and search.all_solutions is None:
        return {"objective": claimed, "reasons": defects}
    last = u[0] + 2 * np.pi if search.asked.full_turn else u[-1]
    task = Sweep(Driver(search.asked.driver, from_=float(u[0]), to=float(last)))
    lead = worths[search.goals.index(search.lead)]
    result = {
        "term": found.objective,
        "objective": objective if np.isfinite(objective) else claimed,
        "parameters": design.parameters,
        "errors": np.asarray(lead.errors).tolist(),
        "at": np.asarray(u).tolist(),
        "defects": defects,
        "transmission_angle_min": design.transmission,
        "active": active(search, nlp, found),
        "class": search.kinds[candidate.kind] or "any",
        "hits": hits,
        "problem": dumps(design.as_problem({**design.others, "path": task})),
    }
    if len(search.goals) > 1:
        result["goals"] = [float(worth.value) for worth in worths]
    return result


def _missed_limits(search: Search, design: Design) -> list[str]:
    """Return which limits the fine sweep over a turn finds missed."""
    found, _ = design.turn
    if found is None:
        return []
    defects = []
    turned = [asked.least for asked in search.asked.transmission if not asked.poses]
    turned = turned if search.asked.full_turn else []
    least = max(turned, default=0.0)
    angle = design.transmission
    if angle is not None and angle < least - 1e-6:
        defects.append(f"the transmission angle falls to {np.degrees(angle):.4g} deg")
    for box in search.asked.boxes:
        for point in box.points:
            places = found.points[point].position
            slack = 2e-3 * search.size
            for axis, (low, high) in enumerate((box.x, box.y)):
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
    for word in dict.fromkeys(nlp.words):
        rows = [i for i, name in enumerate(nlp.words) if name == word]
        most = float(np.abs(found.prices[rows]).max(initial=0.0))
        if word not in SILENT and most > ACTIVE:
            prices[word] = most * unit / nlp.unit(word)
    return prices
