"""The arc of a path that the whole mechanism can reach from its first pose.

Groups side by side end at limits of their own, and those that still follow the path keep their
values beyond the others' limits. The driver moves as far as all of them do at once: up to the
first end ahead and back to the first one behind. A pose beyond may be reached by turning the
driver the other way round only where all groups are on that way.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.motion.continuation.any_path import AnyPath
from mechdae.motion.continuation.path import Path
from mechdae.records import dataclass
from mechdae.types import Floats, Integers

if TYPE_CHECKING:
    from mechdae.motion.continuation.limit_positions import Limit

TURNING = ("limit", "pole")
"""Ends at which the mechanism can only turn back."""
INTO = 12
"""Places looked at between a limit position and the node from which it was proved."""
NEARER, TIMES = 1 / 8, 15
"""Share of the distance to a limit position at which it is looked at next, and how often."""
SAME = 8 * np.finfo(float).eps
"""Share of a place, or of the largest step, within which it is a limit position."""


@dataclass(frozen=True)
class Arc:
    """What the driver can reach: from `first` to `last`, ended by `low` and `high`.

    An end is None where the path was followed so far and goes on; `largest` is its largest step.
    """

    low: Limit | None
    high: Limit | None
    first: float
    last: float
    largest: float

    @property
    def limits(self) -> tuple[Limit | None, Limit | None]:
        return self.low, self.high

    @property
    def ends(self) -> list[float | None]:
        """The driver's values at its limits, None where none was met."""
        return [end.s if end is not None else None for end in self.limits]

    @property
    def turns_back(self) -> bool:
        """Whether what lies behind the ends may be the same motion, whole turns away.

        Where branches meet, or the path is not proved, turning back need not lead to the same one.
        """
        ends = [end for end in self.limits if end is not None]
        return all(end.kind in TURNING or end.regular for end in ends)

    def holds(self, s: Floats | float) -> Any:
        """Return which places the driver can reach, the ends themselves among them."""
        return (s >= self.first) & (s <= self.last)

    def met(self, s: Floats) -> Integers:
        """Return which places (n,) are limit positions: -1 the lower one, 1 the upper one, or 0."""
        found = np.zeros(np.shape(s), int)
        for way, end in zip((-1, 1), self.limits, strict=True):
            if end is not None and end.kind == "limit":
                size = np.maximum(np.abs(s), abs(end.s))
                found[np.abs(s - end.s) <= SAME * np.maximum(size, self.largest)] = way
        return found

    def snapped(self, s: Floats) -> Floats:
        """Return places (n,), those of limit positions to the last bit."""
        met = self.met(s)
        return np.where(met < 0, self.first, np.where(met > 0, self.last, s))


def arc_of(path: AnyPath) -> Arc:
    """Return the arc that all groups of a path reach together."""
    lows = [reach.low for reach in path.reach.values() if reach.low is not None]
    highs = [reach.high for reach in path.reach.values() if reach.high is not None]
    low = max(lows, key=lambda end: end.s) if lows else None
    high = min(highs, key=lambda end: end.s) if highs else None
    first, last = path.extent
    first = low.s if low is not None else first
    last = high.s if high is not None else last
    return Arc(low, high, first, last, path.largest)


def before_limits(path: Path) -> list[float]:
    """Return the ends of the arc, and places ever nearer to its limit positions.

    In front of a fold s = s* + c sigma^2 quantities are smooth in sigma: they may turn back within
    a hair of s, and steps of the path see nothing of it.
    """
    arc, found = arc_of(path), []
    nodes = [s for s in path.s if arc.first < s < arc.last]
    for way, end, last in zip((-1, 1), arc.ends, nodes and (nodes[0], nodes[-1]), strict=False):
        if end is not None:
            found += [end + (last - end) * (k / INTO) ** 2 for k in range(INTO)]
            found += [end - way * arc.largest * NEARER**k for k in range(1, TIMES)]
    return [s for s in found if arc.first <= s <= arc.last]
