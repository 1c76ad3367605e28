"""Where whole numbers change along a way, and where functions are least, in many intervals.

They are compared between neighbours and then in ever shorter intervals, until these are as short
as rounding lets them be. Continuous numbers beside them only tell where to look next.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Integers

NEAR = 7
"""Places on either side of where a change is expected, each nearer by `CLOSER` than the last."""
CLOSER = 1 / 8
FEW, CUTS = 3, 30
"""Places inside an interval where looking is slow, and how often intervals are cut at most."""
GRAIN = 4e-16
"""Share of a place within which a change is known."""
COARSE, BESIDE = 1e3, 16
"""Grains from which on places inside an interval are not evenly spread, and by which they then
keep away from its ends."""
EACH = 4
"""Intervals followed of each one in which marks change; where there are more they are noise."""
APART = 1e-6
"""Share of the way; arcs nearer to each other are one."""
Guide = tuple[str, slice]
"""How continuous numbers tell where a whole number changes, and which they are: "sign" of one,
"largest" of several, "cell" of a number that begins at another one; "slow" where nothing tells it
and one looks at few places, "" where nothing does."""
Change = tuple[float, Any, Any]
"""A place with the whole numbers before and behind it."""


def changes(
    grid: Floats,
    marks: Integers,
    values: Floats,
    guides: list[Guide],
    look: Callable[[Any], tuple[Any, Any]],
) -> list[Change]:
    """Return the places at which marks change, in their order.

    `grid`, `marks`, `values`: rising places (n,), whole numbers (n, k) and continuous ones (n, m)
    there.
    """
    k = np.flatnonzero((marks[1:] != marks[:-1]).any(axis=1))
    most = max(len(grid) // 2, EACH * len(k), 1)
    rest = Intervals(grid[k], grid[k + 1], marks[k], marks[k + 1], values[k], values[k + 1])
    found: list[Change] = []
    for _ in range(CUTS):
        places = rest.places(guides)
        narrow = rest.high - rest.low <= GRAIN * np.maximum(abs(rest.low), abs(rest.high))
        narrow |= (places[:, 0] <= rest.low) | (places[:, -1] >= rest.high)
        found += rest.found(narrow)
        rest, places = rest.rows(~narrow), places[~narrow]
        if not len(places):
            break
        rest = rest.cut(places, *look(places.ravel())).rows(slice(most))
    found += rest.found(slice(None))
    return sorted(found, key=lambda change: change[0])


def arcs_of(column: int, marks: Integers, found: list[Change], grid: Floats) -> list[list[float]]:
    """Return the intervals in which one of the marks is not zero.

    `grid` and `marks` are what `changes` began with, `found` what it gave.
    """
    arcs: list[list[float]] = []
    low, high = float(grid[0]), float(grid[-1])
    start = low if marks[0, column] else None
    for place, left, right in found:
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


@dataclass
class Intervals:
    """Places (n,) between which marks change, with marks and values of guides at both."""

    low: Any
    high: Any
    before: Integers
    after: Integers
    at_low: Floats
    at_high: Floats

    def rows(self, chosen: Booleans | slice) -> Intervals:
        """Return some of them."""
        return Intervals(*(values[chosen] for values in vars(self).values()))

    def found(self, chosen: Booleans | slice) -> list[Change]:
        """Return the upper ends of some of them, and the marks on both sides."""
        rows = self.rows(chosen)
        return list(zip(rows.high.tolist(), rows.before, rows.after, strict=True))

    def places(self, guides: list[Guide]) -> Any:
        """Return places (n, m) inside, rising: even, or crowded where a change is expected."""
        slow = [k for k, (kind, _) in enumerate(guides) if kind == "slow"]
        few = self.before[:, slow].any() or self.after[:, slow].any()
        count = FEW if few else 2 * NEAR + 1
        shares = np.tile(np.arange(1, count + 1) / (count + 1), (len(self.low), 1))
        width = np.fmax(self.high - self.low, np.finfo(float).tiny)
        grain = GRAIN * np.maximum(abs(self.low), abs(self.high)) / width
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
            kind, guide = guides[column]
            a, b = self.at_low[k, guide], self.at_high[k, guide]
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

    def cut(self, places: Floats, marks: Any, values: Any) -> Intervals:
        """Return the intervals between places inside in which marks change."""
        n, m = places.shape
        ends = (
            (self.low, places, self.high),
            (self.before, marks.reshape(n, m, -1), self.after),
            (self.at_low, values.reshape(n, m, -1), self.at_high),
        )
        s, marks, values = (np.concatenate([a[:, None], b, c[:, None]], axis=1) for a, b, c in ends)
        i, k = np.nonzero((marks[:, 1:] != marks[:, :-1]).any(axis=2))
        pairs = [(array[i, k], array[i, k + 1]) for array in (s, marks, values)]
        return Intervals(*(end for pair in pairs for end in pair))


PLACES, ROUNDS = 15, 16
"""Places inside an interval, of which the neighbours of the least are kept, and how often."""


def narrowed(look: Callable[[Floats], Floats], a: Floats, b: Floats) -> Floats:
    """Return where functions (n,) are least in intervals [a, b] with one minimum each.

    `look`: from places (n, m), those of each function in its row, to its values there.
    """
    shares = np.arange(PLACES + 2) / (PLACES + 1)
    for _ in range(ROUNDS):
        places = a[:, None] + (b - a)[:, None] * shares
        values = look(places[:, 1:-1])
        k = np.argmin(np.where(np.isfinite(values), values, np.inf), axis=1)
        a, b = (np.take_along_axis(places, (k + off)[:, None], axis=1)[:, 0] for off in (0, 2))
    return (a + b) / 2
