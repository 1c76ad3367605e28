"""Points of fronts, levels at which they are sought, and what is between two of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from mechdae.describe.coordinates import unit_of
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.goals import (
    Asked,
    Extreme,
    FunctionTargets,
    Rocker,
    StraightLine,
    Visits,
)
from mechdae.design.synthesis.ipopt import Optimum
from mechdae.design.synthesis.search import MOST, NO_LIMIT, PICK
from mechdae.numerics.dominance import undominated
from mechdae.types import Floats, Json

WIDE = 30.0
"""Ratio of the ends of a positive objective from which it is measured by logs."""
HOLE = 3.0
"""A gap between neighbours is a hole from so many even gaps of the levels that are asked for."""
SAME = 1e-3
"""Share of an objective and of its range by which the end of a front may be off its best."""


def objective_name(goal: Asked) -> str:
    if isinstance(goal, Extreme):
        single = goal.path.startswith("summary/")
        return goal.of if single else f"{goal.reduce} of {goal.of}"
    if isinstance(goal, Visits):
        return f"error of {goal.what}"
    if isinstance(goal, FunctionTargets):
        return f"error of {goal.output}"
    assert isinstance(goal, StraightLine | Rocker)
    return f"deviation of {goal.point}" if isinstance(goal, StraightLine) else goal.coordinate


def error_unit(problem: Problem, goal: Asked) -> str:
    """Return the unit of the errors that a goal's designs list."""
    if isinstance(goal, FunctionTargets):
        return unit_of(problem.mechanism, goal.output) or ""
    if isinstance(goal, Rocker):
        return "m" if goal.slides else "rad"
    return "" if isinstance(goal, Extreme) else "m"


@dataclass(frozen=True)
class FrontHole:
    """Two neighbours on a front that are far apart: no other point is in the ball between them.

    ``width``: share of the front's range, of the objective in which they are further apart.
    ``primary``: the objective in which they are nearest to each other.
    """

    first: Floats
    last: Floats
    width: float
    primary: int
    middle: Floats


def by_logs(low: float, high: float) -> bool:
    """Return whether an objective between two ends is measured by its logarithm."""
    return low > 0 and high > WIDE * low


def holes(terms: Floats, keep: int) -> list[FrontHole]:
    """Return the holes among objectives (n, m), of which less is better, the widest first."""
    values = np.asarray(terms, float)
    values = values[undominated(values)]
    values = values[np.lexsort(values.T[::-1])]
    count = values.shape[1]
    if len(values) < 2:
        return []
    logs = np.array([by_logs(objective.min(), objective.max()) for objective in values.T])
    scaled = np.where(logs, np.log(np.where(logs, values, 1.0)), values)
    span = np.ptp(scaled, axis=0)
    places = scaled / np.where(span > 0, span, np.inf)
    squares = np.sum((places[:, None] - places) ** 2, axis=2)
    even = round(max(keep - count, 0) ** (1 / (count - 1))) + 1
    found = []
    for i, j in combinations(range(len(values)), 2):
        share = np.abs(places[j] - places[i])
        between = squares[i] + squares[j] < squares[i, j]
        if share.max() * even > HOLE and not between.any():
            middle = (scaled[i] + scaled[j]) / 2
            middle = np.where(logs, np.exp(np.where(logs, middle, 0.0)), middle)
            primary = count - 1 - int(np.argmin(share[::-1]))
            found.append(FrontHole(values[i], values[j], float(share.max()), primary, middle))
    return sorted(found, key=lambda hole: -hole.width)


def part_of(k: int) -> str:
    """Return the word of the starts of an objective alone."""
    return f"objective {k + 1}"


def census(
    runs: Sequence[Mapping[str, float | str]],
    terms: Sequence[Floats],
    k: int,
    best: float,
    span: float,
) -> Json:
    """Return how the starts of an objective alone ended.

    `runs`, `terms`: all runs, and the objectives (m,) at the end of each, None where constraints
    are missed.
    """
    alone = [
        (run, values) for run, values in zip(runs, terms, strict=True) if run["part"] == part_of(k)
    ]
    near = best + SAME * (abs(best) + span)
    hits = [run for run, values in alone if values is not None and values[k] <= near]
    return {
        "starts": len(alone),
        "met": sum(values is not None for _, values in alone),
        "hits_of_best": len(hits),
        "ipopt": dict(Counter(run["status"] for run, _ in alone)),
        "solved": sum(bool(run["solved"]) for run in hits),
        "found": any(run["solved"] for run in hits),
    }


def missing(k: int, end: Mapping[str, Any]) -> str:
    """Return what is said of an end that was not found."""
    ends = ", ".join(
        f"{count} {status.replace('_', ' ').lower()}" for status, count in end["ipopt"].items()
    )
    why = (
        "its optimum was rejected by its sweep" if end["solved"]
        else "the best did not end at an optimum" if end["hits_of_best"]
        else "better values were found at other levels" if end["met"]
        else "none met all constraints"
    )  # fmt: skip
    return (
        f"the end of objective {k + 1} was not found, the front may go on there: of {end['starts']}"
        f" starts of it alone {end['met']} met all constraints ({ends}); {why}"
    )


def gap_words(gap: Mapping[str, Any]) -> str:
    """Return what is said of a hole that stayed."""
    first, last = (", ".join(f"{x:.6g}" for x in gap[word]) for word in ("first", "last"))
    return (
        f"no point was found between ({first}) and ({last}) from {gap['starts']} further starts: "
        f"the front jumps there, or the search failed"
    )


@dataclass(frozen=True, eq=False)
class Point:
    """A feasible optimum: class, parameters of its NLP, terms (m,) of the objectives."""

    kind: int
    given: dict[str, Any]
    found: Optimum
    terms: Floats


@dataclass(frozen=True, eq=False)
class Level:
    """An objective that is as small as possible, and the most that each of them may be, (m,)."""

    primary: int
    most: Floats

    def allows(self, terms: Floats) -> bool:
        """Return whether objectives keep the level."""
        return bool((terms <= self.most + 1e-9 * (np.abs(self.most) + 1e-3)).all())

    @property
    def given(self) -> dict[str, Any]:
        """Values of the NLP's parameters."""
        pick = np.zeros(len(self.most))
        pick[self.primary] = 1.0
        return {PICK: pick, MOST: np.minimum(self.most, NO_LIMIT)}

    def missed(self, terms: Floats) -> float:
        """Return by how much objectives are above the level, relative to it."""
        gaps = np.maximum(terms - self.most, 0.0) / (np.abs(self.most) + 1e-300)
        return float(np.where(np.isfinite(gaps), gaps, 0.0).max())


@dataclass(frozen=True)
class FrontGap:
    """What is between two neighbours on a front: how wide, and from which level to which."""

    width: float
    low: float
    high: float

    @property
    def area(self) -> float:
        """What a point in it may add to the hypervolume at most."""
        return self.width * (self.high - self.low)


def spread(low: float, high: float, count: int) -> Floats:
    """Return values between two ends."""
    share = np.arange(1, count + 1) / (count + 1)
    if by_logs(low, high):
        return low * (high / low) ** share
    return low + (high - low) * share
