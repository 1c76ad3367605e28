"""Refined extremes of angles and slides along a path: swing and stroke."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from mechdae.motion.continuation.any_path import AnyPath, arc_of
from mechdae.motion.continuation.beyond_ends import before_limits
from mechdae.motion.continuation.evaluate import Evaluator, Poses
from mechdae.motion.continuation.interpolate import turning
from mechdae.motion.continuation.path import Path
from mechdae.motion.setup.outputs import Outputs
from mechdae.records import dataclass
from mechdae.results import LazyPart, Summary
from mechdae.types import Booleans, Floats, Integers

ITERATIONS = 6
NEAR = 1e-4
"""Share of a quantity's range by which a stationary value may miss the best one and is refined."""
SAME = 1e-6
"""Share of a bracket within which stationary places are one, and a place is good enough."""
CHUNK = 256


class Spans:
    """How far bodies turn and joints slide along a path, over [low, high].

    A stationary value is bracketed between nodes of the path by the sign of its first
    derivative and refined by Newton's method on it, so that it does not depend on the grid.
    `between` are further places to look at, for a path that needs no nodes. Computed when
    ``later`` is read, from the nodes that the path has now.
    """

    evaluations: int
    refined: int

    def __init__(
        self,
        evaluator: Evaluator,
        outputs: Outputs,
        path: Path,
        poses: Poses,
        low: float,
        high: float,
        between: Sequence[float] = (),
    ) -> None:
        self.entries: list[tuple[int, str, str]] = _spanned(outputs)
        self.evaluations = self.refined = 0  # beside those that the evaluator counts
        self.later: LazyPart = LazyPart(lambda: {})
        if not self.entries or len(poses.y) < 3:
            return
        ahead = before_limits(path) if path.ends else ()
        nodes, shifts = [*path.s, *between, *ahead], _shifts(path, low, high)

        def found() -> dict[str, dict[str, float]]:
            every = np.concatenate([np.array(nodes) + shift for shift in shifts])
            inner = every[(every > low) & (every < high)]
            places = sorted({*inner.tolist(), low, high})  # np.unique would import numpy.ma
            return self._found(evaluator, path, places, poses)

        self.later = LazyPart(found)

    def summary(self) -> Summary:
        """Return ``swing`` and ``stroke``, to be computed when they are read."""
        return Summary(swing=self.later, stroke=self.later)

    def _found(
        self, evaluator: Evaluator, path: Path, places: list[float], poses: Poses
    ) -> dict[str, dict[str, float]]:
        """Return ``swing`` [rad] by body and ``stroke`` [m] by joint, those that there are.

        In space swings are of joints; one that has several angles or lengths is told with each.
        Poses that are reached by turning the driver the other way round count where they are on
        the path: the driver swings as far as its arc is long.
        """
        before = evaluator.pose.evaluations, evaluator.refined
        at_nodes = evaluator.at(path, np.array(places))
        columns = np.array([column for column, _, _ in self.entries])
        known = [
            np.where(each.alive.all(axis=1)[:, None], each.y[0][:, columns], np.nan)
            - _whole_turns(each, columns)
            for each in (poses, at_nodes)
        ]  # no body goes further than the mechanism does
        least = np.fmin.reduce([np.fmin.reduce(values, axis=0) for values in known])
        most = np.fmax.reduce([np.fmax.reduce(values, axis=0) for values in known])
        for i, value in _stationary(evaluator, path, at_nodes, columns, least, most):
            least[i], most[i] = np.fmin(least[i], value), np.fmax(most[i], value)
        result: dict[str, dict[str, float]] = {"swing": {}, "stroke": {}}
        for (_, word, name), span in zip(self.entries, (most - least).tolist(), strict=True):
            if np.isfinite(span):
                result[word][name] = span
        self.evaluations = evaluator.pose.evaluations - before[0]
        self.refined = evaluator.refined - before[1]
        evaluator.pose.evaluations, evaluator.refined = before
        return {word: table for word, table in result.items() if table}


def _whole_turns(poses: Poses, columns: Integers) -> Any:
    """Return by how much angles that are the driver's (n, k) are off those on the path.

    Others keep their whole turns: gears tell them apart.
    """
    turned = poses.s - poses.places
    if not turned.any():
        return 0.0
    there = poses.alive.all(axis=1)
    apart = np.ptp(poses.y[0][there][:, columns] - poses.s[there, None], axis=0)
    return turned[:, None] * (apart < SAME)


def _spanned(outputs: Outputs) -> list[tuple[int, str, str]]:
    """Return column, word and name of what swings or slides; in space of all joint coordinates."""
    in_space = outputs.scene.model.joint_rates
    chosen = [
        entry
        for entry in outputs.entries
        if entry.is_output or (in_space and entry.kind == "joints" and entry.quantity)
    ]
    same = Counter((entry.part, entry.unit) for entry in chosen)
    return [
        (
            entry.columns[0],
            "swing" if entry.unit == "rad" else "stroke",
            entry.part if same[entry.part, entry.unit] == 1 else f"{entry.part}.{entry.name}",
        )
        for entry in chosen
    ]


def _shifts(path: AnyPath, low: float, high: float) -> list[float]:
    """Return by how much places of the path lie off those of [low, high] that they are."""
    arc = arc_of(path)
    if not path.graphs.turns or arc.ends == [None, None] or (arc.holds(low) and arc.holds(high)):
        return [0.0]
    least, most = (low - arc.last) / (2 * np.pi), (high - arc.first) / (2 * np.pi)
    return [2 * np.pi * k for k in {0, *range(int(np.ceil(least)), int(np.floor(most)) + 1)}]


@dataclass(frozen=True)
class Brackets:
    """Intervals [a, b] in which the rate of a quantity changes its sign, a guess `s` in each."""

    entry: Integers
    a: Floats
    b: Floats
    s: Floats

    def take(self, rows: Booleans, s: Floats | None = None) -> Brackets:
        """Return some of the brackets, with other guesses."""
        s = self.s if s is None else s
        return Brackets(self.entry[rows], self.a[rows], self.b[rows], s[rows])


def _stationary(
    evaluator: Evaluator,
    path: AnyPath,
    nodes: Poses,
    columns: Integers,
    least: Floats,
    most: Floats,
) -> list[tuple[int, float]]:
    """Return the stationary values that may be extreme, each with its quantity's number.

    All quantities are refined together; a place that many of them share is evaluated once.
    """
    left = _brackets(nodes, columns, least, most)
    found: list[tuple[int, float]] = []
    for _ in range(ITERATIONS):
        if not len(left.s):
            break
        s, y, rate, bend = _at(evaluator, path, columns, left)
        with np.errstate(invalid="ignore", divide="ignore"):
            step = np.nan_to_num(np.where(bend != 0, rate / bend, 0.0))
        done = np.abs(step) <= 2 * SAME * (left.b - left.a)
        value = y - rate * step / 2
        found += zip(left.entry[done].tolist(), value[done].tolist(), strict=True)
        left = left.take(~done, np.clip(s - step, left.a, left.b))
    if len(left.s):
        y = _at(evaluator, path, columns, left)[1]
        found += zip(left.entry.tolist(), y.tolist(), strict=True)
    return found


def _brackets(nodes: Poses, columns: Integers, least: Floats, most: Floats) -> Brackets:
    """Return the brackets of stationary values that may be the largest or the smallest."""
    y, rate, bend = (values[:, columns] for values in nodes.y[:3])
    rate = np.where(nodes.alive.all(axis=1)[:, None], rate, np.nan)
    with np.errstate(invalid="ignore"):
        k, entry = np.nonzero(rate[:-1] * rate[1:] < 0)
    a, b = nodes.s[k], nodes.s[k + 1]
    s, value = turning(b - a, *[v[i, entry] for i in (k, k + 1) for v in (y, rate, bend)])
    low, high = least.copy(), most.copy()
    np.fmin.at(low, entry, value)
    np.fmax.at(high, entry, value)
    slack = NEAR * (high - low)[entry]
    near = (value <= low[entry] + slack) | (value >= high[entry] - slack)
    return Brackets(entry, a, b, a + s).take(near)


def _at(
    evaluator: Evaluator, path: AnyPath, columns: Integers, wanted: Brackets
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the places evaluated, and there the quantities with two derivatives, (k,) each."""
    order = np.argsort(wanted.s)
    s = wanted.s[order]
    cell = np.floor(s / (SAME * np.min(wanted.b - wanted.a)))
    first = np.concatenate([[True], np.diff(cell) > 0])
    row = np.empty(len(s), int)
    row[order] = np.cumsum(first) - 1
    places = s[first]
    result = np.empty((3, len(s)))
    for start in range(0, len(places), CHUNK):
        poses = evaluator.at(path, places[start : start + CHUNK])
        mine = np.flatnonzero((row >= start) & (row < start + CHUNK))
        for values, y in zip(result, poses.y[:3], strict=True):
            values[mine] = y[row[mine] - start, columns[wanted.entry[mine]]]
    y, rate, bend = result
    return places[row], y, rate, bend
