"""Where a formula of forces changes along a path, and the arcs that jam or lock themselves.

Signs of sliding speeds, pieces of tables and of friction laws, numbers of solutions are whole
numbers that change at kinks. They are compared between neighbours on a grid and then in ever
shorter intervals; continuous numbers beside them only tell where to look next.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mechdae.forces.inverse_dynamics import Statics
from mechdae.forces.pose_forces import PoseForces, solved
from mechdae.forces.poses import Moving

SAMPLES = 512
"""Intervals in which kinks are looked for, at least."""
NEAR = 7
"""Places on either side of where a kink is expected, each nearer by `CLOSER` than the last."""
CLOSER = 1 / 8
FEW, CUTS = 3, 30
"""Places inside an interval next to poses that jam or have several solutions, which take longer;
and how often intervals are cut at most."""
GRAIN = 4e-16
"""Share of a place within which a kink is known."""
COARSE, BESIDE = 1e3, 16
"""Grains from which on places inside an interval are not evenly spread, and by which they then
keep away from its ends."""
ROUNDING = 1e-12
"""Share of the losses, or of what goes in and out, that a power has to reach to have a sign."""
APART = 1e-6
"""Share of the way; arcs nearer to each other are one, with a dead centre in it."""
FLAGS = ("jammed", "ambiguous", "locking")
Guide = tuple[str, slice]
"""How continuous numbers tell where a whole number changes: "sign" of one, "largest" of several,
"cell" that begins at one; and which they are."""


class State:
    """What decides which formula holds at a place of the path: signs, pieces, solutions."""

    def __init__(self, statics: Statics, moving: Moving) -> None:
        self.statics, self.moving = statics, moving

    def at(self, s: Any, coupled: bool = True) -> PoseForces:
        """Return the forces at places; all solutions if friction is `coupled`."""
        motion = self.moving.at(s)
        return solved(self.statics, motion, motion.there & coupled, critical=False)

    def powers(self, here: PoseForces, coupled: bool) -> Any:
        """Return powers: driver without friction, with it, losses of both."""
        free = here.free
        whole = here.whole if coupled else free
        driven = [own.driven(here.motion)[:, None] for own in (free, whole)]
        return np.hstack([*driven, free.losses, whole.losses])

    # -- what changes at kinks -------------------------------------------------------------

    def marks(self, here: PoseForces) -> tuple[Any, Any, list[Guide]]:
        """Return whole numbers (n, k) that change where a formula does, and what guides to it.

        The first tell whether a pose is jammed, has several solutions, locks itself; the next
        whether it is there at all. Others have a guide among continuous numbers (n, m).
        """
        statics, signs = self.statics, np.nan_to_num(here.inputs[5])
        jammed = here.jammed
        flags = [jammed, here.ambiguous, self._locking(here), ~here.motion.there]
        columns = [flag[:, None] for flag in flags]
        guides: list[Guide] = [("", slice(0))] * len(flags)
        values: list[Any] = []

        def add(kind: str, mark: Any, own: Any) -> None:
            start = sum(part.shape[1] for part in values)
            columns.append(mark[:, None])
            values.append(own)
            guides.append((kind, slice(start, start + own.shape[1])))

        for sign, speed in zip(signs.T, statics.speeds(here.motion).T, strict=True):
            add("sign", sign, speed[:, None])
        for cell, at_and_start in statics.cells(here.motion):
            add("cell", cell, at_and_start)
        for rivals in statics.rivals(here.inputs, here.sizes) if statics.coupled else ():
            add("largest", np.where(jammed, 0, np.argmax(rivals, axis=1)), rivals)
        return (
            np.hstack(columns).astype(int),
            np.hstack([np.zeros((len(jammed), 0)), *values]),
            guides,
        )

    def _locking(self, here: PoseForces) -> Any:
        """Return where loads push along the motion and friction holds it back nevertheless."""
        motion, locking = here.motion, np.zeros(len(here.counts), bool)
        if here.coupled:
            with np.errstate(invalid="ignore"):
                least = ROUNDING * here.whole.losses.sum(axis=1)
                locking = (here.free.driven(motion) < -least) & (here.whole.driven(motion) >= 0)
                locking &= ~here.jammed
                if locking.any():
                    locking &= self.statics.powers(*here.inputs)[0][:, 0] > least
        return locking


def on_grid(state: State, answer: PoseForces) -> tuple[Any, Any, Any, list[Guide], Any]:
    """Return places, their marks with guides, and powers without coupling and with it.

    The poses of the run are among the places where all of them are there.
    """
    ends = np.asarray(state.moving.run.places, float)
    parts = -(-SAMPLES // max(len(ends) - 1, 1))
    known = bool(answer.there.all()) and len(ends) > 1
    if known:
        parts = max(parts, 2)
        way = np.diff(ends)[:, None] * np.arange(1, parts) / parts
        inner = (ends[:-1, None] + way).ravel()
    else:
        inner = np.linspace(ends.min(), ends.max(), max(SAMPLES + 1, 2 * len(ends)))
    every = [state.at(inner), *([answer] if known else [])]
    places = np.concatenate([inner, *([ends] if known else [])])
    order = np.argsort(places, kind="stable")
    seen = [state.marks(here) for here in every]
    marks, values = (np.concatenate([own[k] for own in seen])[order] for k in (0, 1))
    powers = [np.concatenate([state.powers(here, c) for here in every]) for c in (False, True)]
    return places[order], marks, values, seen[0][2], powers


def kinks_of(state: State, answer: PoseForces) -> tuple[list[float], dict[str, Any], Any]:
    """Return the places where a formula changes, the arcs by flag, and powers on a grid."""
    grid, marks, values, guides, powers = on_grid(state, answer)
    k = np.flatnonzero((marks[1:] != marks[:-1]).any(axis=1))
    open_ = Intervals(grid[k], grid[k + 1], marks[k], marks[k + 1], values[k], values[k + 1])
    found: list[tuple[float, Any, Any]] = []
    for _ in range(CUTS):
        places = open_.places(guides)
        narrow = open_.high - open_.low <= GRAIN * np.maximum(abs(open_.low), abs(open_.high))
        narrow |= (places[:, 0] <= open_.low) | (places[:, -1] >= open_.high)
        found += open_.kinks(narrow)
        open_, places = open_.rows(~narrow), places[~narrow]
        if not len(places):
            break
        inner = state.marks(state.at(places.ravel()))
        open_ = open_.cut(places, *inner[:2]).rows(slice(len(grid) // 2))
    found += open_.kinks(slice(None))
    found.sort(key=lambda kink: kink[0])
    low, high = float(grid[0]), float(grid[-1])
    arcs = {name: _arcs(column, marks, found, low, high) for column, name in enumerate(FLAGS)}
    return _distinct([place for place, _, _ in found]), arcs, powers


@dataclass
class Intervals:
    """Places (n,) between which a formula changes, with marks and values of guides at both."""

    low: Any
    high: Any
    before: Any
    after: Any
    at_low: Any
    at_high: Any

    def rows(self, chosen: Any) -> Intervals:
        """Return some of them."""
        return Intervals(*(own[chosen] for own in vars(self).values()))

    def kinks(self, chosen: Any) -> list[tuple[float, Any, Any]]:
        """Return the upper ends of some of them, and the marks on both sides."""
        own = self.rows(chosen)
        return list(zip(own.high.tolist(), own.before, own.after, strict=True))

    def places(self, guides: list[Guide]) -> Any:
        """Return places (n, m) inside, rising: even, or crowded where a kink is expected."""
        flags = slice(2)
        few = self.before[:, flags].any() or self.after[:, flags].any()
        even = (
            np.arange(1, FEW + 1) / (FEW + 1)
            if few
            else np.arange(1, 2 * NEAR + 2) / (2 * NEAR + 2)
        )
        shares = np.tile(even, (len(self.low), 1))
        grain = GRAIN * np.maximum(abs(self.low), abs(self.high)) / (self.high - self.low)
        near = CLOSER ** np.arange(1, NEAR + 1)
        for k in () if few else np.flatnonzero(COARSE * grain < 1):
            there = self._expected(int(k), guides)
            if there is not None:
                there = min(max(there, BESIDE * grain[k]), 1 - BESIDE * grain[k])
                shares[k] = [*(there * (1 - near)), there, *(there + (1 - there) * near[::-1])]
        return self.low[:, None] + (self.high - self.low)[:, None] * shares

    def _expected(self, k: int, guides: list[Guide]) -> float | None:
        """Return the share of an interval at which a line through a guide vanishes, if any."""
        for column in np.flatnonzero(self.before[k] != self.after[k]):
            kind, own = guides[column]
            a, b = self.at_low[k, own], self.at_high[k, own]
            if kind == "largest":
                i, j = self.before[k, column], self.after[k, column]
                one, other = a[i] - a[j], b[i] - b[j]
            elif kind == "cell":
                start = max(a[1], b[1])
                one, other = a[0] - start, b[0] - start
            elif kind == "sign":
                one, other = a[0], b[0]
            else:
                continue
            if one * other < 0:
                return float(one / (one - other))
        return None

    def cut(self, places: Any, marks: Any, values: Any) -> Intervals:
        """Return the intervals between places inside in which marks change."""
        n, m = places.shape
        s = np.hstack([self.low[:, None], places, self.high[:, None]])
        marks = np.concatenate(
            [self.before[:, None], marks.reshape(n, m, -1), self.after[:, None]], axis=1
        )
        values = np.concatenate(
            [self.at_low[:, None], values.reshape(n, m, -1), self.at_high[:, None]], axis=1
        )
        i, k = np.nonzero((marks[:, 1:] != marks[:, :-1]).any(axis=2))
        ends = [(own[i, k], own[i, k + 1]) for own in (s, marks, values)]
        return Intervals(*(end for pair in ends for end in pair))


def _distinct(places: list[float]) -> list[float]:
    """Return sorted places without repetitions within rounding."""
    kept: list[float] = []
    for place in places:
        if not kept or place - kept[-1] > 1e-13 * max(abs(place), 1.0):
            kept.append(place)
    return kept


def _arcs(
    column: int, found: Any, kinks: list[tuple[float, Any, Any]], low: float, high: float
) -> list[list[float]]:
    """Return the intervals in which one flag of the signature is set."""
    arcs: list[list[float]] = []
    start = low if found[0, column] else None
    for place, left, right in kinks:
        if right[column] and not left[column] and start is None:
            start = low if place - low <= 1e-13 * (high - low) else float(place)
        elif left[column] and not right[column] and start is not None:
            arcs.append([start, float(place)])
            start = None
    if start is not None:
        arcs.append([start, high])
    joined: list[list[float]] = []
    for arc in arcs:
        if joined and arc[0] - joined[-1][1] <= APART * (high - low):
            joined[-1][1] = arc[1]
        elif arc[1] > arc[0]:
            joined.append(arc)
    return joined
