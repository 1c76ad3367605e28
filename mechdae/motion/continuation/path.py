"""A certified path: one continuous solution along the drivers, with its limit positions.

Its nodes are solved poses with rates; from each to the next a step has been proved (`follower`):
over the whole step one solution exists near the tangent and no other one.
"""

from __future__ import annotations

from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.additions import of_cases
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import Call
from mechdae.motion.continuation.any_path import AnyPath, Counts, Reach
from mechdae.motion.continuation.interpolate import near_limit, quintic
from mechdae.motion.setup.scales import Constants
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Matrix, Unknowns

if TYPE_CHECKING:
    from mechdae.motion.cases.hard_steps.crossings.across_change_point import Zone
    from mechdae.motion.cases.hard_steps.finders import Finders
    from mechdae.motion.cases.hard_steps.quintic_steps import QuinticSteps

DEEP = 12
"""Blocks one behind the other above which steps that tangents do not prove are looked at again."""
APPROACH = 1e-6
"""Share of the largest step at which the path hands over to the limit's own expansion."""
SMALLEST = 1e-9
SHRUNK = 1 / 32
"""Share of the largest step below which a limit position is looked for."""
WINDOW, HOPE = 1000, 100.0
"""Small steps over which progress is measured, and times as far as they came that is left."""
WINDOWS, EVEN = 5, 1.25
"""As many times they come as far, but for that factor, before they are taken for even: next to
a narrow place steps shrink and grow again.
"""


@dataclass
class Tries:
    """Steps from which something is tried again, by block and sense; small steps in a row.

    ``marks`` are where each `WINDOW` of them ended; ``hopeless`` tells that they are even, and go a
    share of the way that is left which steps of their size cannot make up for.
    """

    stretch: dict[float, float] = field(default_factory=dict)
    fold: dict[tuple[int, float], float] = field(default_factory=dict)
    bridge: dict[tuple[int, float], float] = field(default_factory=dict)
    laboured: int = 0
    marks: list[float] = field(default_factory=list)
    hopeless: bool = False

    def labour(self, s: float, rest: float) -> None:
        """Count a small step that ends at `s`, and see whether they lead to what is left."""
        self.laboured += 1
        if self.laboured == 1:
            self.marks = [s]
        if self.laboured % WINDOW == 0:
            self.marks = [*self.marks, s][-WINDOWS - 1 :]
            far = np.abs(np.diff(self.marks))
            even = len(far) == WINDOWS and far.max() <= EVEN * far.min()
            self.hopeless = bool(even and HOPE * far[-1] < rest)


class Path(AnyPath):
    """The certified nodes of one scene along a line, or along the course of its drivers.

    Parameters
    ----------
    graphs, constants
        Functions and numbers of the scene.
    u0, d : (nd,) arrays
        u = u0 + s d; for one driver s is u itself. Not used along a course.
    largest
        Largest step in s.
    within
        Whether the way across a change point must end before the goal, which is a corner.

    Attributes
    ----------
    on_change_point
        "continue" on the branch with the continuous tangent, "switch" to the other one, or
        "stop" the group there.
    s, state : lists
        The nodes, s rising.
    front : dict
        Signs of the blocks' determinants at its two ends: upper (True), lower (False).
    """

    def __init__(
        self,
        graphs: Graphs,
        constants: Constants,
        u0: Floats,
        d: Floats,
        largest: float,
        counts: Counts | None = None,
        within: bool = False,
    ) -> None:
        whole = np.concatenate([constants.consts, u0, d])
        super().__init__(graphs, constants, whole, largest, counts or Counts())
        self.u0: Floats = u0
        self.d: Floats = d
        self.within: bool = within
        self.on_change_point: str = "continue"
        self._one, self._place = graphs.cache("step", lambda: Call(graphs.advance)), np.zeros(2)
        self.tries: Tries = Tries()
        self._arrays: tuple[Floats, Floats, Floats, Floats] | None = None
        self.s: list[float] = []
        self.state: list[Floats] = []
        self.flips: list[list[float]] = [[] for _ in graphs.blocks]

    @cached_property
    def finders(self) -> Finders:
        """What finds what lies ahead where steps shrink, and leads past it."""
        (make,) = of_cases("finders of obstacles")
        found: Finders = make(self, self.step)
        return found

    @cached_property
    def quintics(self) -> QuinticSteps | None:
        """What proves steps of long chains of blocks, None for other mechanisms."""
        if max(self.graphs.depths, default=0) <= DEEP:
            return None
        (make,) = of_cases("steps of long chains")
        steps: QuinticSteps = make(self.graphs, self.constants)
        return steps if steps.kinds else None

    def proved_between(
        self,
        s: Any,
        first: Floats,
        states: Floats,
        tests: tuple[Floats, Floats, Floats],
        sign: Floats,
    ) -> Any:
        """Return which blocks (m, nb) steps one after the other are proved for.

        Parameters
        ----------
        s : (m + 1,) array
            Places of the nodes.
        first, states : (.,), (m, .) arrays
            The first node and those behind the steps.
        tests
            Test, det and miss of each step, as `step` gives them.
        """
        proved = self.proved(states, *tests, sign)
        if self.quintics is None:
            return proved
        left = np.flatnonzero(~proved.all(axis=1))
        if left.size:
            ends, states = np.stack([left, left + 1], axis=1), np.vstack([first, states])
            nothing = np.zeros((len(left), len(sign)))
            found = self.quintics.proved(s[ends], states[ends], self.drivers(s)[ends])
            found &= self.proved(states[left + 1], nothing, tests[1][left], nothing, sign)
            proved[left] = found | self.quintics.with_all_before(proved[left])
        return proved

    def begin(self, x: Unknowns, s: float) -> None:
        """Put the first node: a solved pose `x` (nx,) at `s`."""
        g = self.graphs
        self.origin: tuple[float, Floats] = (s, x)
        self.began: float = s
        start = np.concatenate([x, np.zeros(2 * g.nx + g.nb)])
        state, _, det, _ = self.step(start, s, 0.0)
        state[: g.nx] = np.where(np.isfinite(state[: g.nx]), state[: g.nx], x)  # singular pose
        self.s, self.state, self._arrays = [s], [state], None
        redundant = np.array([graph.redundant for graph in g.blocks], bool)
        self.sign: Floats = np.where(redundant, 1.0, np.sign(det))  # those must stay closed
        self.front: dict[bool, Floats] = {True: self.sign.copy(), False: self.sign.copy()}

    def sign_at(self, s: Floats) -> Floats:
        """Return the signs of the blocks' determinants on the path, (n, nb)."""
        signs = np.repeat(self.sign[None, :], len(s), axis=0)
        for b, places in enumerate(self.flips):
            if places:
                count = np.searchsorted(places, s) - np.searchsorted(places, self.origin[0])
                signs[count % 2 != 0, b] *= -1
        return signs

    def redirect(self, u0: Floats, d: Floats, largest: float) -> None:
        """Use the path for another line u = u0 + s d; it then begins again."""
        self.u0, self.d = u0, d
        self.largest: float = largest
        self.whole[-2 * len(d) :] = np.concatenate([u0, d])
        self.reach: dict[int, Reach] = {index: Reach() for index in self.groups}
        self.__dict__.pop("finders", None)
        self.flips = [[] for _ in self.graphs.blocks]
        self.zones: list[Zone] = []
        if self.curves is not None:
            self.curves.restart()
        self.tries = Tries()

    def step(self, state: Floats, s: float, ds: float) -> tuple[Floats, Floats, Floats, Floats]:
        """Return state, test, det and miss after one step."""
        ds = (s + ds) - s  # as far as the places are apart, which are rounded
        self._place[0], self._place[1] = s, ds
        after, test, det, miss = self._one(state, self._place, self.whole)
        return after, test, det, miss

    def append(self, s: float, state: Floats, up: bool) -> None:
        """Put a node behind the last one, upwards or downwards."""
        place = len(self.s) if up else 0
        self.s.insert(place, s)
        self.state.insert(place, state)

    def append_all(self, s: list[float], states: list[Floats], up: bool) -> None:
        """Put nodes behind the last one, each beyond the one before."""
        place = slice(len(self.s), None) if up else slice(0, 0)
        self.s[place], self.state[place] = s[:: 1 if up else -1], states[:: 1 if up else -1]

    def pop(self, up: bool) -> tuple[float, Floats]:
        """Take the last node away, and return it."""
        self._arrays = None
        return self.s.pop(-1 if up else 0), self.state.pop(-1 if up else 0)

    def follows(self, s: Floats) -> Booleans:
        """Return which groups follow the path at `s`: followed, and before their ends, (n, ng)."""
        inside = np.stack([reach.contains(s) for reach in self.reach.values()], axis=1)
        slack = 2 * APPROACH * self.largest  # the last node before a limit stops short of it
        for j, (group, reach) in enumerate(self.reach.items()):
            if group in self.followed and reach.low is None:
                inside[:, j] &= s >= self.s[0] - slack
            if group in self.followed and reach.high is None:
                inside[:, j] &= s <= self.s[-1] + slack
        return inside

    @property
    def extent(self) -> tuple[float, float]:
        """The first and the last place that was followed."""
        return self.s[0], self.s[-1]

    def sizes(self) -> tuple[Floats, Floats]:
        """Return the largest |x| (nx,) of groups while they followed the path, and |u| (nd,)."""
        S, X, _, _ = self.arrays()
        size = np.abs(X).max(axis=0) if not self.ends else np.zeros(self.graphs.nx)
        for b, graph in enumerate(self.graphs.blocks if self.ends else ()):
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

    def drivers(self, s: Any) -> Matrix:
        """Return the drivers' values (n, nd) at `s` (n,)."""
        course = self.graphs.course
        return course.sampled(s)[0] if course else self.u0 + s[:, None] * self.d

    def motion(self, s: float) -> list[Floats]:
        """Return the drivers' values and three derivatives with respect to s, each (nd,)."""
        course = self.graphs.course
        if course:
            return course.jet(s)
        nothing = np.zeros(len(self.d))
        return [self.u0 + s * self.d, self.d, nothing, nothing]

    def rates(self, s: Floats, order: int) -> tuple[Floats, ...]:
        """Return the drivers' derivatives (n, nd) with respect to s, up to `order` <= 3."""
        course = self.graphs.course
        if course:
            return tuple(course.sampled(s, order)[1:])
        shape = (len(s), len(self.d))
        return (np.broadcast_to(self.d, shape), *[np.zeros(shape)] * (order - 1))

    def arrays(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Return s (m,), x, x', x'' (m, nx) of the nodes, s rising."""
        n = self.graphs.nx
        if self._arrays is None or len(self._arrays[0]) != len(self.s):
            state = np.array(self.state)
            parts = (state[:, :n], state[:, n : 2 * n], state[:, 2 * n : 3 * n])
            self._arrays = (np.array(self.s), *parts)
        return self._arrays

    def insert(self, places: Floats, most: int = 64) -> int:
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
            alive = self.alive(ended)
            after, *tests = self.step(self.state[k], s[k], float(place - s[k]))
            sign, ends = self.sign_at(np.array([place]))[0], np.array([s[k], place])
            det, miss = tests[1][None], tests[2][None]
            found = self.proved_between(
                ends, self.state[k], after[None], (tests[0][None], det, miss), sign
            )
            if found[0, alive].all():
                self.s.insert(k + 1, float(place))
                self.state.insert(k + 1, after)
                inserted += 1
        return inserted

    def on_curves(self) -> tuple[Floats, Floats, Floats]:
        """Return s (m,), x (m, nx), u (m, nd) of the nodes where all contacts follow the path."""
        S, X, _, _ = self.arrays()
        rows = np.ones(len(S), bool)
        for index in self.curves.groups if self.curves is not None else ():
            rows &= self.reach[index].contains(S)
        return S[rows], X[rows], self.drivers(S[rows])

    def at(self, s: float) -> Floats:
        """Return the unknowns (nx,) at a place between nodes, from the node before it."""
        k = min(max(int(np.searchsorted(self.s, s, side="right")) - 1, 0), len(self.s) - 1)
        return self.step(self.state[k], self.s[k], s - self.s[k])[0][: self.graphs.nx]

    def hanging(self, group: int) -> set[int]:
        """Return a group and those attached to it."""
        return self.graphs.scene.hanging(group) & set(self.groups)

    def guess(self, s: Floats) -> Unknowns:
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
