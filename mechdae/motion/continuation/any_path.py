"""What all certified paths are, along a line, a curve or several legs, and what they reach."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.kernels.graphs.steps import Graphs
from mechdae.motion.continuation.step_sizes import NODES_PER_TURN
from mechdae.motion.setup.scales import Constants
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Integers, Unknowns

if TYPE_CHECKING:
    from mechdae.motion.cases.curves.curve_ends import CurveEnds
    from mechdae.motion.cases.hard_steps.crossings.across_change_point import Zone
    from mechdae.motion.continuation.limit_positions import Limit

FAR = 100.0
"""Lengths of the mechanism at which a slide is said to run away (parallel guides)."""


TURNING = ("limit", "pole")
"""Ends at which the mechanism can only turn back."""
SAME = 8 * np.finfo(float).eps
"""Share of a place, or of the largest step, within which it is a limit position."""


@dataclass
class Reach:
    """The interval of s over which a group follows the path; None where it goes on."""

    low: Limit | None = None
    high: Limit | None = None

    def contains(self, s: Floats | float) -> Booleans:
        inside = np.ones(np.shape(s), bool)
        if self.low is not None:
            inside &= s > self.low.s - self.low.belongs
        if self.high is not None:
            inside &= s < self.high.s + self.high.belongs
        return inside


@dataclass
class Counts:
    """Work done."""

    steps: int = 0
    rejected: int = 0
    folds: int = 0


class AnyPath(ABC):
    """A certified path of one scene: where its groups follow it, and where its poses are.

    Attributes
    ----------
    origin : (float, array)
        Where it begins, and the unknowns there.
    reach : dict
        By group how far it follows the path.
    followed : set of int
        Groups that have to be followed: others have no equations.
    zones : list of Zone
        Change points that it crosses.
    sign : array
        Of the blocks' determinants where it begins.
    """

    origin: tuple[float, Floats]
    sign: Floats

    def __init__(
        self, graphs: Graphs, constants: Constants, whole: Floats, largest: float, counts: Counts
    ) -> None:
        self.graphs: Graphs = graphs
        self.constants: Constants = constants
        self.whole: Floats = whole
        self.largest: float = largest
        self.counts: Counts = counts
        self.far: Floats = np.where(graphs.scene.unknowns.lengths, FAR * constants.scale, np.inf)
        self.groups: list[int] = [group.index for group in graphs.scene.groups]
        self.block_group: list[int] = [graph.block.group for graph in graphs.blocks]
        self.reach: dict[int, Reach] = {index: Reach() for index in self.groups}
        self.curves: CurveEnds | None = None
        """What watches contacts on curves, where there are any."""
        for watch in graphs.scene.cases("curve ends"):
            self.curves = watch(graphs, constants.p)
        self.followed: set[int] = {*self.block_group, *(self.curves.watched if self.curves else ())}
        self.zones: list[Zone] = []

    @property
    def unit(self) -> float:
        """A radian of the driver, or a length of the mechanism."""
        return self.largest * NODES_PER_TURN / (2 * np.pi)

    @property
    def ends(self) -> list[Limit]:
        """Where groups follow it no further, group by group."""
        both = (end for reach in self.reach.values() for end in (reach.low, reach.high))
        return [end for end in both if end is not None]

    def zone_at(self, s: Floats) -> Integers:
        """Return the index of the zone that each place lies in, -1 outside of all, (n,)."""
        if not self.zones:
            return np.full(len(s), -1)
        lows, highs = np.array([zone.given for zone in self.zones]).T
        order = np.argsort(lows)
        found = np.searchsorted(lows[order], s) - 1
        index = order[np.maximum(found, 0)]
        return np.where((found >= 0) & (s < highs[index]), index, -1)

    def alive(self, ended: set[int]) -> Booleans:
        """Return which blocks belong to groups that have not ended."""
        return np.array([group not in ended for group in self.block_group], bool)

    def good(
        self, state: Floats, test: Floats, det: Floats, miss: Floats, alive: Booleans, sign: Floats
    ) -> Any:
        """Return whether a step is proved for all blocks that are `alive`."""
        return np.all(self.proved(state, test, det, miss, sign)[..., alive], axis=-1)

    @np.errstate(invalid="ignore")
    def proved(self, state: Floats, test: Floats, det: Floats, miss: Floats, sign: Floats) -> Any:
        """Return which blocks (.., nb) a step is proved for; none runs away to a pole."""
        proved = (test <= 1) & (miss <= 1) & (np.sign(det) == sign)
        near = np.abs(state[..., : self.graphs.nx]) <= self.far
        if not near.all():
            proved &= np.logical_and.reduceat(near, self.graphs.first, axis=-1)
        return proved

    # -- what it leads along -----------------------------------------------------------------

    @property
    @abstractmethod
    def extent(self) -> tuple[float, float]:
        """The first and the last place that was followed."""

    @abstractmethod
    def drivers(self, s: Floats) -> Floats:
        """Return the drivers' values (n, nd) at `s` (n,)."""

    @abstractmethod
    def motion(self, s: float) -> list[Any]:
        """Return the drivers' values and three derivatives with respect to s, each (nd,)."""

    @abstractmethod
    def rates(self, s: Floats, order: int) -> tuple[Floats, ...]:
        """Return the drivers' derivatives (n, nd) with respect to s, up to `order` <= 3."""

    # -- poses -------------------------------------------------------------------------------

    @abstractmethod
    def follows(self, s: Floats) -> Booleans:
        """Return which groups follow the path at `s`: followed, and before their ends, (n, ng)."""

    @abstractmethod
    def sign_at(self, s: Floats) -> Floats:
        """Return the signs of the blocks' determinants on the path, (n, nb)."""

    @abstractmethod
    def guess(self, s: Floats) -> Unknowns:
        """Return unknowns (n, nx) near the path at `s` (n,)."""

    @abstractmethod
    def insert(self, places: Floats, most: int = 64) -> int:
        """Put further nodes where guesses were too poor; return how many were proved."""

    @abstractmethod
    def on_curves(self) -> tuple[Floats, Floats, Floats]:
        """Return s (m,), x (m, nx), u (m, nd) of poses where all contacts follow the path."""

    @abstractmethod
    def sizes(self) -> tuple[Floats, Floats]:
        """Return the largest |x| (nx,) of groups while they followed the path, and |u| (nd,)."""


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
    """Return the arc that the whole mechanism can reach from its first pose.

    Groups side by side end at limits of their own, and those that still follow the path keep their
    values beyond the others' limits. The driver moves as far as all of them do at once: up to the
    first end ahead and back to the first one behind. A pose beyond may be reached by turning the
    driver the other way round only where all groups are on that way.
    """
    lows = [reach.low for reach in path.reach.values() if reach.low is not None]
    highs = [reach.high for reach in path.reach.values() if reach.high is not None]
    low = max(lows, key=lambda end: end.s) if lows else None
    high = min(highs, key=lambda end: end.s) if highs else None
    first, last = path.extent
    first = low.s if low is not None else first
    last = high.s if high is not None else last
    return Arc(low, high, first, last, path.largest)
