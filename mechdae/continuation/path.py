"""A certified path: one continuous solution along the drivers, with its limit positions.

The path is followed in steps that are each proved by the test of `Graphs.advance`: over
the whole step one solution exists near the tangent and no other one. A step that fails is
halved. Where steps shrink, the limit position (fold) ahead is found by Newton's method on
{F = 0, J v = 0, v.v = 1}; the group ends there and the others go on.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from mechdae.continuation.across_change_point import ZONE, Bridge, Builder, Zone
from mechdae.continuation.change_points import Crossing, CrossingFinder
from mechdae.continuation.curve_ends import CurveEnds
from mechdae.continuation.cusps import CuspFinder, Touch
from mechdae.continuation.interpolate import near_limit, quintic
from mechdae.continuation.into_fold import Turning
from mechdae.continuation.limit_positions import Limit, LimitFinder
from mechdae.continuation.series_steps import Expansion, Stretch
from mechdae.errors import InputError, SolveError
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.call import Call
from mechdae.kernels.run.sequence import Sequence
from mechdae.setup.scales import Constants

NEARLY = 1 + 1e-9
"""How much longer a step may be in order to end at its goal."""
STRIDE = 64
"""Steps in one call of the sequential kernel."""
HAIR, MOVED = 1e-7, 1e3
"""Share of the largest step taken over the corner of a curve, and how far the pose may move
over that."""
SHRUNK = 1 / 32
"""Share of the largest step below which a limit position is looked for."""
WEAK = 1 / 128
"""Share of the largest step below which a step around the series is tried."""
BESIDE = 1e-3
"""Largest steps before a limit position within which its own expansion tells the poses."""
LONGER = 4.0
"""Times a step that is not proved around its tangent, that one around the series must have."""
PARTS = 4
"""Nodes that a step around the series leaves behind."""
SMALLEST = 1e-9
NEAREST = 1e-6
"""Share of the largest step that must be left for the way across a change point."""
NARROWER = 12
"""Times the neighbourhood of a change point is halved until its expansion holds."""
MOST_SMALL_STEPS = 20_000
"""Small steps in a row after which the path is given up as not provable."""
MOST_STEPS = 1_000_000
"""Steps of a path: some 8000 turns of a driver, or 1 GB of a four-bar's nodes."""
FAR = 100.0
"""Lengths of the mechanism at which a slide is said to run away (parallel guides)."""
APPROACH = 1e-6
"""Share of the largest step at which the path hands over to the limit's own expansion."""


def strides(graphs: Graphs) -> Sequence:
    """Return `STRIDE` steps of a scene in one call."""
    made: Sequence = graphs.kept("strides", lambda: Sequence(graphs.advance, STRIDE))
    return made


@dataclass
class Reach:
    """The interval of s over which a group follows the path; None where it goes on."""

    low: Limit | None = None
    high: Limit | None = None

    def contains(self, s: Any) -> Any:
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


@dataclass
class Path:
    """The certified nodes of one scene.

    Parameters
    ----------
    graphs, constants
        Functions and numbers of the scene.
    u0, d : (nd,) arrays
        u = u0 + s d; for one driver s is u itself. Not used along a course.
    largest
        Largest step in s.
    on_change_point
        "continue" on the branch with the continuous tangent, "switch" to the other one, or
        "stop" the group there.
    within
        Whether the way across a change point must end before the goal, which is a corner.
    """

    graphs: Graphs
    constants: Constants
    u0: Any
    d: Any
    largest: float
    counts: Counts = field(default_factory=Counts)
    on_change_point: str = "continue"
    within: bool = False

    def __post_init__(self) -> None:
        g = self.graphs
        self.whole = np.concatenate([self.constants.vector(), self.u0, self.d])
        self._one, self._place = g.kept("step", lambda: Call(g.advance)), np.zeros(2)
        self.far = np.where(g.scene.unknowns.lengths, FAR * self.constants.scale, np.inf)
        self.groups = [group.index for group in g.scene.groups]
        self.block_group = [graph.block.group for graph in g.blocks]
        self.reach = {index: Reach() for index in self.groups}
        crossings = CrossingFinder(g, self.constants, self.motion, self.largest)
        self.finder = LimitFinder(g, self.whole, self.constants, self.drivers, crossings.unit)
        self.turning = Turning(g, self.constants, self.finder, self.motion)
        self.bridges = Builder(crossings, self._step, self.constants, self.finder.weights)
        self.zones: list[Zone] = []
        self.curves = CurveEnds(self.graphs, self.constants.p)
        self.followed = {*self.block_group, *self.curves.watched}
        self.laboured = 0
        self._next_stretch: dict[float, float] = {}
        self._next_try: dict[tuple[int, float], float] = {}
        self._next_bridge: dict[tuple[int, float], float] = {}
        self._arrays: tuple[Any, Any, Any, Any] | None = None
        self.s: list[float] = []
        self.state: list[Any] = []
        self.flips: list[list[float]] = [[] for _ in g.blocks]

    @cached_property
    def expansion(self) -> Expansion:
        """What proves steps around power series."""
        sizes = self.graphs.scene.unknowns.sizes(self.constants.scale)
        return Expansion(self.graphs, self.constants, sizes)

    # -- nodes ---------------------------------------------------------------------------

    def begin(self, x: Any, s: float) -> None:
        """Put the first node: a solved pose `x` (nx,) at `s`."""
        g = self.graphs
        self.origin, self._began = (s, x), s
        start = np.concatenate([x, np.zeros(2 * g.nx + g.nb)])
        state, _, det, _ = self._step(start, s, 0.0)
        state[: g.nx] = np.where(np.isfinite(state[: g.nx]), state[: g.nx], x)  # singular pose
        self.s, self.state, self._arrays = [s], [state], None
        redundant = np.array([graph.redundant for graph in g.blocks], bool)
        self.sign = np.where(redundant, 1.0, np.sign(det))  # those must stay closed
        self._front = {True: self.sign.copy(), False: self.sign.copy()}

    def sign_at(self, s: Any) -> Any:
        """Return the signs of the blocks' determinants on the path, (n, nb)."""
        signs = np.repeat(self.sign[None, :], len(s), axis=0)
        for b, places in enumerate(self.flips):
            if places:
                count = np.searchsorted(places, s) - np.searchsorted(places, self.origin[0])
                signs[count % 2 != 0, b] *= -1
        return signs

    def redirect(self, u0: Any, d: Any, largest: float) -> None:
        """Use the path for another line u = u0 + s d; it then begins anew."""
        self.u0, self.d, self.largest = u0, d, largest
        self.whole[-2 * len(d) :] = np.concatenate([u0, d])
        self.reach = {index: Reach() for index in self.groups}
        self.bridges.finder.largest = largest
        self.finder.unit = self.bridges.finder.unit
        self.zones, self.flips = [], [[] for _ in self.graphs.blocks]
        self.curves.restart()
        self._next_stretch.clear()
        self._next_try.clear()
        self._next_bridge.clear()
        self.laboured = 0

    def _step(self, state: Any, s: float, ds: float) -> tuple[Any, Any, Any, Any]:
        """Return state, test, det and miss after one step."""
        ds = (s + ds) - s  # as far as the places are apart, which are rounded
        self._place[0], self._place[1] = s, ds
        after, test, det, miss = self._one(state, self._place, self.whole)
        return after, test, det, miss

    def follows(self, group: int, s: Any) -> Any:
        """Return at which places a group follows the path: followed, and before its ends."""
        reach = self.reach[group]
        inside = reach.contains(s)
        if group in self.followed:
            slack = 2 * APPROACH * self.largest  # the last node before a limit stops short of it
            if reach.low is None:
                inside &= s >= self.s[0] - slack
            if reach.high is None:
                inside &= s <= self.s[-1] + slack
        return inside

    @property
    def extent(self) -> tuple[float, float]:
        """The first and the last place that was followed."""
        return self.s[0], self.s[-1]

    def sizes(self) -> tuple[Any, Any]:
        """Return the largest |x| (nx,) of groups while they followed the path, and |u| (nd,)."""
        S, X, _, _ = self.arrays()
        size = np.zeros(self.graphs.nx)
        for b, graph in enumerate(self.graphs.blocks):
            reach = self.reach[self.block_group[b]]
            ends = [
                end.x[None, :] for end in (reach.low, reach.high) if end and end.kind == "limit"
            ]
            followed = np.vstack([X[reach.contains(S)], *ends])[:, graph.own]
            size[graph.own] = np.abs(followed).max(axis=0, initial=0.0)
        course = self.graphs.course
        if course:
            return size, course.reach(S, np.diff(S, append=S[-1])).max(axis=0)
        return size, np.abs(self.drivers(S)).max(axis=0)

    def drivers(self, s: Any) -> Any:
        """Return the drivers' values (n, nd) at `s` (n,)."""
        course = self.graphs.course
        return course.sampled(s)[0] if course else self.u0 + s[:, None] * self.d

    def motion(self, s: float) -> list[Any]:
        """Return the drivers' values and three derivatives with respect to s, each (nd,)."""
        course = self.graphs.course
        if course:
            return course.jet(s)
        nothing = np.zeros(len(self.d))
        return [self.u0 + s * self.d, self.d, nothing, nothing]

    def rates(self, s: Any, order: int) -> tuple[Any, ...]:
        """Return the drivers' derivatives (n, nd) with respect to s, up to `order` <= 3."""
        course = self.graphs.course
        if course:
            return tuple(course.sampled(s, order)[1:])
        shape = (len(s), len(self.d))
        return (np.broadcast_to(self.d, shape), *[np.zeros(shape)] * (order - 1))

    def arrays(self) -> tuple[Any, Any, Any, Any]:
        """Return s (m,), x, x', x'' (m, nx) of the nodes, s rising."""
        n = self.graphs.nx
        if self._arrays is None or len(self._arrays[0]) != len(self.s):
            state = np.array(self.state)
            parts = (state[:, :n], state[:, n : 2 * n], state[:, 2 * n : 3 * n])
            self._arrays = (np.array(self.s), *parts)
        return self._arrays

    def extend(self, to: float, needed: Iterable[int] | None = None, first: bool = False) -> None:
        """Follow the path until `to`, or until all `needed` groups have ended.

        With `first` it ends with the first of them. A limit position may be proved from afar;
        the other groups are then followed as far, and may end before.
        """
        if not self.s:
            raise SolveError("the path has no start")
        up = to > self.s[-1]
        if not up and to >= self.s[0]:
            return
        sense = 1.0 if up else -1.0
        self._began = self.s[-1] if up else self.s[0]
        steps = len(self.s) + sense * (to - self._began) / self.largest
        if steps > MOST_STEPS and self.followed:
            raise InputError(
                f"the motion takes {steps:.2g} steps, at most {MOST_STEPS} are followed",
                hint="a driver goes far: numbers without a suffix are radians, metres and seconds",
            )
        ended = {i for i in self.groups if (self.reach[i].high if up else self.reach[i].low)}
        wanted = set(self.followed if needed is None else needed)
        step = self.largest
        while self._on_curves(ended, up) and wanted - ended:
            s, state = (self.s[-1], self.state[-1]) if up else (self.s[0], self.state[0])
            goal, rest = to, sense * (to - s)
            if first and wanted & ended:
                rest = self._until_first(wanted & ended, s, sense)
                goal = s + sense * rest
            if rest <= 0:
                return
            if rest > 4 * step and step >= SHRUNK * self.largest:
                count = int(min(STRIDE, rest / step - 0.5))  # what is left is no rounding
                held = self._stride(s, state, sense * step, count, ended, up)
                if held:
                    step = min(2 * step, self.largest) if held > 4 else step / 2
                    continue
            step = self._careful(s, state, sense, min(step, rest), goal, ended, up)

    def _until_first(self, ended: set[int], s: float, sense: float) -> float:
        """Return how far ahead of s the first end of groups lies, 0 where the path meets it."""
        reach = [self.reach[index] for index in ended]
        found = [r.high if sense > 0 else r.low for r in reach]
        rest = min(sense * (end.s - s) for end in found if end is not None)
        return rest if rest > 2 * APPROACH * self.largest else 0.0

    def insert(self, places: Any, most: int = 64) -> int:
        """Put further nodes where guesses were too poor; return how many were proved."""
        wanted = np.array(sorted(set(places.tolist())))
        if len(wanted) > most:
            wanted = wanted[np.linspace(0, len(wanted) - 1, most).astype(int)]
        inserted = 0
        for place in wanted:
            s = self.arrays()[0]
            k = int(np.searchsorted(s, place)) - 1
            if k < 0 or k + 1 >= len(s) or place in (s[k], s[k + 1]):
                continue
            ended = {i for i in self.groups if not self.reach[i].contains(place)}
            alive = self._alive(ended)
            after, test, det, miss = self._step(self.state[k], s[k], float(place - s[k]))
            sign = self.sign_at(np.array([place]))[0]
            if self._good(after, test, det, miss, alive, sign):
                self.s.insert(k + 1, float(place))
                self.state.insert(k + 1, after)
                inserted += 1
        return inserted

    def _alive(self, ended: set[int]) -> Any:
        """Return which blocks belong to groups that have not ended."""
        return np.array([group not in ended for group in self.block_group], bool)

    def _stride(
        self, s: float, state: Any, ds: float, count: int, ended: set[int], up: bool
    ) -> int:
        """Take up to `count` equal steps in one call; return how many were proved."""
        places = s + ds * np.arange(STRIDE + 1)
        states, test, det, miss = strides(self.graphs)(state, places[:-1], ds, self.whole)
        alive = self._alive(ended)
        good = self._good(states, test, det, miss, alive, self._front[up])[:count]
        held = count if good.all() else int(np.argmin(good))
        self.counts.steps += held
        if held > 4:
            self._next_bridge.clear()
        self.counts.rejected += held < count
        for k in range(held):
            self._append(float(places[k + 1]), states[k], up)
        return held

    def _good(self, state: Any, test: Any, det: Any, miss: Any, alive: Any, sign: Any) -> Any:
        """Return whether a step is proved for all blocks that are `alive`."""
        with np.errstate(invalid="ignore"):
            return np.all(self._proved(state, test, det, miss, sign)[..., alive], axis=-1)

    def _proved(self, state: Any, test: Any, det: Any, miss: Any, sign: Any) -> Any:
        """Return which blocks (.., nb) a step is proved for; none runs away to a pole."""
        proved = (test <= 1) & (miss <= 1) & (np.sign(det) == sign)
        near = np.abs(state[..., : self.graphs.nx]) <= self.far
        if not near.all():
            proved &= np.logical_and.reduceat(near, self.graphs.first, axis=-1)
        return proved

    def _append(self, s: float, state: Any, up: bool) -> None:
        if up:
            self.s.append(s)
            self.state.append(state)
        else:
            self.s.insert(0, s)
            self.state.insert(0, state)

    @np.errstate(invalid="ignore")
    def _careful(
        self,
        s: float,
        state: Any,
        sense: float,
        step: float,
        goal: float,
        ended: set[int],
        up: bool,
    ) -> float:
        """Take one step, halved until it is proved; return the step to try next.

        Towards `goal`, which is met to the last bit: steps of a rounding cannot be proved.
        """
        alive = self._alive(ended)
        while True:
            rest = sense * (goal - s)
            if rest <= 0:
                return step
            step = rest if rest < NEARLY * step else step
            after, test, det, miss = self._step(state, s, sense * step)
            proved = self._proved(after, test, det, miss, self._front[up])
            bad = (alive & ~proved).nonzero()[0]
            if not bad.size:
                self.counts.steps += 1
                self._append(goal if step == rest else s + sense * step, after, up)
                self.laboured += step < SHRUNK * self.largest
                if 1.5 * step >= self.largest:
                    self._next_stretch.clear()
                    self._next_try.clear()
                    self._next_bridge.clear()
                    self.laboured = 0
                return min(1.5 * step, self.largest)
            self.counts.rejected += 1
            b = int(bad[0])
            step /= 2
            if step < self._next_bridge.get((b, sense), self.largest):
                self._next_bridge[(b, sense)] = step / 2
                if self._crosses(b, s, state, sense, rest, ended, up):
                    return self.largest * ZONE
                s, state = (self.s[-1], self.state[-1]) if up else (self.s[0], self.state[0])
            if step < self._next_try.get((b, sense), SHRUNK * self.largest):
                self._next_try[(b, sense)] = step / 4
                if self._ends_at_fold(b, s, state, sense, rest, ended, up):
                    return step
                s, state = (self.s[-1], self.state[-1]) if up else (self.s[0], self.state[0])
            if step < self._next_stretch.get(sense, WEAK * self.largest):
                least = LONGER * step
                taken = self._stretched(s, state, sense, least, rest, goal, alive, up)
                if taken:
                    self._next_try.clear()
                    return min(taken, self.largest)
                self._next_stretch[sense] = step / 4
            if step < SMALLEST * self.largest or self.laboured > MOST_SMALL_STEPS:
                x, own = state[: self.graphs.nx], self.graphs.blocks[b].own
                if np.any(np.abs(x[own]) > self.far[own] / 2):
                    kind = "pole"
                elif step >= SMALLEST * self.largest:
                    kind = "unproved"
                else:
                    kind = self.finder.kind(b, s, x)
                if kind == "unproved" and self._hops(b, s, state, sense, alive, up):
                    return SHRUNK * self.largest
                self._end(self._last(b, s, state, sense, kind), ended, up)
                self.laboured = 0
                return self.largest

    def _stretched(
        self,
        s: float,
        state: Any,
        sense: float,
        least: float,
        rest: float,
        goal: float | None,
        alive: Any,
        up: bool,
    ) -> float:
        """Take a step around the path's power series; return its length, 0 where none holds."""
        longest = min(rest, self.largest)
        found = self._expanded(s, state, sense * longest, min(least, longest), alive)
        if found is None:
            return 0.0
        whole = abs(found.step) == rest
        places = s + found.step * np.arange(1, PARTS + 1) / PARTS
        if whole and goal is not None:
            places[-1] = goal
        nodes = []
        for place in places.tolist():
            node = self._on(found, place, alive, self._front[up])
            if node is None:
                return 0.0
            nodes.append((place, node))
        for node in nodes:
            self._append(*node, up)
        self.counts.steps += 1
        return abs(found.step)

    def _expanded(
        self, s: float, state: Any, step: float, least: float, alive: Any
    ) -> Stretch | None:
        """Return a stretch of the path from a node, of at most `step`, None where none holds."""
        known, gone = state[3 * self.graphs.nx :], np.abs(state[: self.graphs.nx]) > self.far / 2
        if self.graphs.course is not None or gone.any() or not np.isfinite(known).all():
            return None  # a law, a pole, or a node that cannot be stepped from
        u, d, *_ = self.motion(s)
        blocks = np.flatnonzero(alive).tolist()
        return self.expansion.stretch(state, s, u, d, step, least, blocks)

    def _on(self, found: Stretch, place: float, alive: Any, sign: Any) -> Any:
        """Return the node at a place of a stretch, None where it is not certified."""
        n = self.graphs.nx
        guess = found.at((place - found.s) / found.step)
        start = np.concatenate([guess, np.zeros(2 * n + self.graphs.nb)])
        state, test, det, _ = self._step(start, place, 0.0)
        own = np.concatenate([self.graphs.blocks[b].own for b in np.flatnonzero(alive)])
        near = np.abs(state[:n] - guess) <= found.radius * (1 + 1e-6) + 1e-300
        proved = self._proved(state, test, det, np.zeros(len(test)), sign)
        return state if near[own].all() and proved[alive].all() else None

    def _hops(self, b: int, s: float, state: Any, sense: float, alive: Any, up: bool) -> bool:
        """Take a step of a hair over the corner of a curve in front of block `b`; return whether.

        There the equations are made of two smooth pieces. Next to the pose they have one
        solution for each driver's value if the determinants of both have one sign.
        """
        hair = HAIR * self.largest
        if self.block_group[b] not in self.curves.in_pieces:
            return False
        after = self._step(state, s, sense * hair)[0]
        place, n = s + sense * hair, self.graphs.nx
        near = (
            MOVED * HAIR * np.where(self.graphs.scene.unknowns.lengths, self.constants.scale, 1.0)
        )
        _, test, det, miss = self._step(after, place, sense * hair)
        proved = self._proved(after, test, det, miss, self._front[up])
        if not (np.all(np.abs(after[:n] - state[:n]) <= near) and proved[alive].all()):
            return False
        self.counts.steps += 1
        self._append(place, after, up)
        return True

    def _ends_at_fold(
        self, b: int, s: float, state: Any, sense: float, rest: float, ended: set[int], up: bool
    ) -> bool:
        """Follow the path to a fold just ahead of block `b` or of one it depends on."""
        for k in reversed(self.graphs.ancestors(b)):
            if not self._alive(ended)[k]:
                continue
            self.counts.folds += 1
            x = state[: self.graphs.nx]
            limit = self.finder.find(k, s, x, sense, self.largest)
            if limit is None:
                continue
            if self._approach(limit, s, state, sense, rest, ended, up):
                return True
            here, state = (self.s[-1], self.state[-1]) if up else (self.s[0], self.state[0])
            rest -= sense * (here - s)
            s = here
        return False

    def _last(self, b: int, s: float, state: Any, sense: float, kind: str) -> Limit:
        """Return the end of a path that cannot be proved any further."""
        x, group = state[: self.graphs.nx], self.block_group[b]
        if kind in ("pole", "locked"):
            return Limit(s, b, group, kind, x)
        near = self.bridges.finder.find(b, s, state, sense, {}, self.largest)
        if near is not None:
            return Limit(s, b, group, "ambiguous", x, gap=near.gap)
        for k in reversed(self.graphs.ancestors(b)):
            touch = CuspFinder(self.bridges.finder).find(k, s, state, sense)
            if touch is not None:
                return _touching(touch, s, k, self.block_group[k], x)
        # without a place and its range nothing is said to meet
        return Limit(s, b, group, "unproved" if kind == "change_point" else kind, x)

    # -- curves --------------------------------------------------------------------------

    def _on_curves(self, ended: set[int], up: bool) -> bool:
        """End groups whose contact left an open curve since the last call; return True."""
        for limit in self.curves.left(self, up):
            for index in self._hanging(limit.group):
                reach = self.reach[index]
                if up and (reach.high is None or reach.high.s > limit.s):
                    reach.high = limit
                elif not up and (reach.low is None or reach.low.s < limit.s):
                    reach.low = limit
                ended.add(index)
        return True

    def on_curves(self) -> tuple[Any, Any, Any]:
        """Return s (m,), x (m, nx), u (m, nd) of the nodes where all contacts follow the path."""
        S, X, _, _ = self.arrays()
        rows = np.ones(len(S), bool)
        for index in self.curves.groups:
            rows &= self.reach[index].contains(S)
        return S[rows], X[rows], self.drivers(S[rows])

    def at(self, s: float) -> Any:
        """Return the unknowns (nx,) at a place between nodes, from the node before it."""
        k = min(max(int(np.searchsorted(self.s, s, side="right")) - 1, 0), len(self.s) - 1)
        return self._step(self.state[k], self.s[k], s - self.s[k])[0][: self.graphs.nx]

    def _hanging(self, group: int) -> set[int]:
        """Return a group and those attached to it."""
        return self.graphs.scene.hanging(group) & set(self.groups)

    # -- limit positions -----------------------------------------------------------------

    def _end(self, limit: Limit, ended: set[int], up: bool) -> None:
        """Record that a group, and the groups attached to it, go no further."""
        for index in self._hanging(limit.group) - ended:
            ended.add(index)
            if up:
                self.reach[index].high = limit
            else:
                self.reach[index].low = limit

    @np.errstate(invalid="ignore")
    def _approach(
        self,
        limit: Limit,
        s: float,
        state: Any,
        sense: float,
        rest: float,
        ended: set[int],
        up: bool,
    ) -> bool:
        """Follow the path to a limit position in proved steps; return whether it ends there.

        Stops where the goal lies before the limit, and where the steps do not hold.
        """
        alive = self._alive(ended)
        share = 0.6  # of the distance; the steps that hold near a fold are a fixed share of it
        while True:
            distance = sense * (limit.s - s)
            x = state[: self.graphs.nx]
            if distance <= APPROACH * self.largest:
                return self._into(limit, s, x, ended, up)
            if distance > rest:
                return False
            step, taken, below = share * distance, 0.0, SHRUNK * distance
            while True:
                after, test, det, miss = self._step(state, s, sense * step)
                proved = self._proved(after, test, det, miss, self._front[up])
                bad = (alive & ~proved).nonzero()[0]
                if not bad.size:
                    self.counts.steps += 1
                    self._append(s + sense * step, after, up)
                    break
                self.counts.rejected += 1
                step /= 2
                if step < below and distance > BESIDE * self.largest:
                    below = step / 4
                    least, most = LONGER * step, share * distance
                    taken = self._stretched(s, state, sense, least, most, None, alive, up)
                    if taken:
                        break
                if step < 1e-3 * distance:
                    # the proof is too weak here, not of what the fold depends on
                    before = self.graphs.ancestors(limit.block)[:-1]
                    return not set(before) & set(bad) and self._into(limit, s, x, ended, up)
            share = 0.6 if taken else min(0.6, 1.5 * step / distance)
            passed = s
            s, state = (self.s[-1], self.state[-1]) if up else (self.s[0], self.state[0])
            rest -= sense * (s - passed)

    def _into(self, limit: Limit, s: float, x: Any, ended: set[int], up: bool) -> bool:
        """Record a fold to which all that hangs on it leads from a pose; return whether it does."""
        hanging = self._hanging(limit.group) - ended
        blocks = [b for b, group in enumerate(self.block_group) if group in hanging]
        led = self.turning.lead(limit, s, x, blocks)
        if led is not None:
            self._end(led, ended, up)
        return led is not None

    # -- change points -------------------------------------------------------------------

    def _crosses(
        self,
        b: int,
        s: float,
        state: Any,
        sense: float,
        rest: float,
        ended: set[int],
        up: bool,
    ) -> bool:
        """Follow the path across a change point of block `b` or of one it depends on."""
        for k in self.graphs.ancestors(b):
            if not self._alive(ended)[k]:
                continue
            found = self.bridges.finder.find(k, s, state, sense, {})
            if found is None or not found.meant:
                continue
            distance = sense * (found.s - s)
            zone = ZONE * self.largest
            if self.within:
                zone = min(zone, rest - distance - SMALLEST * self.largest)
            if distance - zone >= rest or zone < NEAREST * self.largest:
                return False
            taken = self._go_back(found.s - sense * zone, sense, up)
            crossed = self._bridged(found, zone, sense, ended, up)
            if not crossed:
                for node in taken:
                    if sense * (node[0] - (self.s[-1] if up else self.s[0])) > 0:
                        self._append(*node, up)
            return crossed
        return False

    def _go_back(self, place: float, sense: float, up: bool) -> list[tuple[float, Any]]:
        """Take away, and return in order, nodes beyond a place: too near to a change point.

        Kept are nodes where this motion began, of other change points, and before the ends of
        groups: those interpolate.
        """
        ends = [end.s for r in self.reach.values() for end in (r.low, r.high) if end is not None]
        marks = [self._began, self.origin[0], *ends, *[s for z in self.zones for s in z.nodes[0]]]
        front = self.s[-1] if up else self.s[0]
        last = max(sense * mark for mark in marks if sense * (front - mark) >= 0)
        taken: list[tuple[float, Any]] = []
        k = -1 if up else 0
        while sense * (self.s[k] - place) > 0 and sense * self.s[k] > last:
            taken.insert(0, (self.s.pop(k), self.state.pop(k)))
        self._arrays = None
        return taken

    def _bridged(
        self, found: Crossing, zone: float, sense: float, ended: set[int], up: bool
    ) -> bool:
        """Go from the last node to `zone` before a change point, or nearer, and across it."""
        alive, action = self._alive(ended), self.on_change_point
        for _ in range(NARROWER):
            s, state = (self.s[-1], self.state[-1]) if up else (self.s[0], self.state[0])
            zone = min(zone, sense * (found.s - s))
            if zone < NEAREST * self.largest:
                return False
            if not self._walk(found.s - sense * zone, s, state, sense, ended, up):
                return False
            s, state = (self.s[-1], self.state[-1]) if up else (self.s[0], self.state[0])
            bridge = self.bridges.build(found, s, state, self._front[up], alive, action)
            if bridge is not None:
                self._pass(bridge, ended, up)
                return True
            zone /= 2
        return False

    def _walk(
        self, to: float, s: float, state: Any, sense: float, ended: set[int], up: bool
    ) -> bool:
        """Follow the path to `to` in proved steps; return whether it was reached, nearly."""
        alive = self._alive(ended)
        step = sense * (to - s)
        while (rest := sense * (to - s)) > SMALLEST * self.largest:  # less would be rounding
            step = min(step, rest)
            after, test, det, miss = self._step(state, s, sense * step)
            if self._good(after, test, det, miss, alive, self._front[up]):
                self.counts.steps += 1
                s, state = (to if step == rest else s + sense * step), after
                self._append(s, state, up)
            else:
                self.counts.rejected += 1
                step /= 2
                if step < SHRUNK * rest and (
                    self._stretched(s, state, sense, LONGER * step, rest, to, alive, up)
                ):
                    s, state = (self.s[-1], self.state[-1]) if up else (self.s[0], self.state[0])
                    step = sense * (to - s)
                elif step < 1e-3 * rest or s + sense * step == s:
                    return False
        return True

    def _pass(self, bridge: Bridge, ended: set[int], up: bool) -> None:
        """Put the nodes of a bridge; a group that is to stop ends at the change point."""
        for s, state in bridge.nodes:
            self._append(s, state, up)
        self.zones.append(bridge.zone)
        self._next_bridge.clear()
        for b in bridge.flipped:
            self.flips[b].append(bridge.zone.s)
            self.flips[b].sort()
            self._front[up][b] *= -1
        if bridge.zone.action == "stop":
            x = bridge.nodes[0][1][: self.graphs.nx]
            for c in bridge.zone.crossings:
                limit = Limit(c.s, c.block, c.group, "change_point", x)
                self._end(limit, ended, up)

    # -- guesses ---------------------------------------------------------------------------

    def guess(self, s: Any) -> Any:
        """Return unknowns (n, nx) near the path at `s` (n,), by quintic Hermite pieces.

        Between the last node and a limit position the expansion in sigma is used instead.
        """
        S, X, V, A = self.arrays()
        if len(S) == 1:
            return np.repeat(X, len(s), axis=0)
        result = quintic(S, X, V, A, s)
        for group, reach in self.reach.items():
            if reach.low is None and reach.high is None:
                continue
            columns = [
                i
                for b, g in enumerate(self.graphs.blocks)
                for i in g.own
                if self.block_group[b] == group
            ]
            for limit, side in ((reach.low, -1), (reach.high, 1)):
                if limit is not None and limit.v is not None and columns:
                    rows, values = near_limit(s, S, X, V, limit, side)
                    result[np.ix_(np.flatnonzero(rows), np.array(columns))] = values[:, columns]
        return result


def _touching(touch: Touch, s: float, b: int, group: int, x: Any) -> Limit:
    """Return the end of a path at `s` just before a place at which branches touch, or nearly do."""
    if not touch.meet:
        return Limit(s, b, group, "ambiguous", x, gap=touch.gap, nearest=touch.s)
    kind = "cusp" if touch.cusp else "change_point"
    within = (touch.low, touch.high)
    limit = Limit(touch.s, b, group, kind, x, gap=touch.gap, reached=s)
    return replace(limit, order=touch.order, within=within)
