"""Lanes follow their paths in certified steps, each with its own step size.

All lanes that go on take a step in one call of the kernel of a single path, each of the length that
it can prove; a lane that has come to its goal is left out of the next call. Where the steps of a
lane shrink, the closed form tells whether a dyad assembles at the poses ahead: if it does not, the
lane is followed to the last pose before, the dyad ends there with all that hangs on it, and the
others go on. What neither proves is left to be solved alone.
"""

from __future__ import annotations

from dataclasses import field
from typing import Any

import numpy as np

from mechdae.kernels.graphs.closed_form import ClosedForm
from mechdae.kernels.graphs.steps import STRIDE, Graphs
from mechdae.kernels.run.functions import Batch
from mechdae.motion.assembly.closed_start import MARGIN
from mechdae.motion.continuation.any_path import FAR
from mechdae.motion.continuation.follower import NEARLY
from mechdae.motion.continuation.path import SHRUNK, SMALLEST
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Integers, Matrix, Unknowns

GROWTH = 1.5
AGAIN = 1 / 64
"""Share of a step at which it is looked again why it shrank."""
WINDOW, SAMPLES, NEXT = 4.0, 33, 8
"""Largest steps ahead, places in them, and poses, at which it is looked whether dyads assemble."""
MOST = 30_000
"""Steps of a lane."""
FEW = 8
"""Lanes that are taken on one by one, many steps in a call."""
MANY = 128
"""Lanes from which the straight line of NumPy operations is faster."""
CLOSE = 1e-13
"""D over A^2 + B^2 at a pose that may be a limit position to the last bit."""
ROUNDS = 8


@dataclass
class Followed:
    """What lanes have followed: nodes in the order in which they were put, and ends.

    ``nodes`` list of (lanes, s, states): (k,), (k,) and (3 nx, k) of each step. ``low``, ``high``
    (nb, k): the first and the last place at which a block follows the path; infinite where it goes
    on. ``first``, ``last`` (k,): how far each lane was followed. ``left`` (k,): lanes that are not
    proved.
    """

    low: Matrix
    high: Matrix
    first: Floats
    last: Any
    left: Booleans
    nodes: list[tuple[Any, Any, Any]] = field(default_factory=list)
    steps: int = 0

    @property
    def whole(self) -> tuple[Any, Any]:
        """Between which places (k,) all blocks follow the path; infinite where they go on."""
        return self.low.max(axis=0, initial=-np.inf), self.high.min(axis=0, initial=np.inf)


@dataclass
class FrontStates:
    """The two ends of the lanes' paths: states (3 nx + nb, k) by sense; 1 upwards, -1 down."""

    up: Floats
    down: Floats

    def of(self, sense: float) -> Any:
        return self.up if sense > 0 else self.down


class LaneFollower:
    """Follows lanes of one scene with a single driver.

    `consts`, `size_x`, `scale`: numbers of the lanes (k, .), bounds of |x| (k, nx) that they hold
    for, lengths (k,). `largest`: largest step of a single path of each lane (k,).
    """

    def __init__(
        self,
        graphs: Graphs,
        form: ClosedForm,
        consts: Floats,
        size_x: Floats,
        scale: Floats,
        largest: Floats,
    ) -> None:
        self.graphs, self.form, self.largest = graphs, form, largest
        self.advance: Batch = graphs.cache("lanes", lambda: Batch(graphs.advance, many=MANY))
        tail = np.broadcast_to([0.0, 1.0], (len(consts), 2))  # u0 and d: the driver itself
        self.numbers: Floats = np.ascontiguousarray(np.hstack([consts, tail]).T)
        far = np.where(graphs.scene.unknowns.lengths, FAR * scale[:, None], np.inf)
        self.bound: Floats = np.ascontiguousarray(np.minimum(size_x, far).T)
        self.p: Floats = consts[:, : graphs.np]
        group = [graph.block.group for graph in graphs.blocks]
        hanging = {index: graphs.scene.hanging(index) for index in set(group)}
        self.hanging: Booleans = np.array([[b in hanging[a] for b in group] for a in group], bool)
        """Which blocks end with a block."""

    def begin(self, x: Unknowns, s: Floats) -> tuple[Followed, FrontStates]:
        """Return the traces of lanes that start at poses x (k, nx) and places s (k,)."""
        g, k = self.graphs, len(s)
        state = np.zeros((3 * g.nx + g.nb, k))
        state[: g.nx] = x.T
        lanes = np.arange(k)
        for _ in range(ROUNDS):
            before = state[: g.nx]
            state, _, det, _ = self.advanced(state, s, np.zeros(k), self.numbers)
            with np.errstate(invalid="ignore"):
                moved = np.abs(state[: g.nx] - before).max(axis=0, initial=0.0)
            if not np.any(moved > 1e-13 * (1 + np.abs(before).max(initial=0.0))):
                break
        self.sign: Floats = np.sign(det)
        with np.errstate(invalid="ignore"):
            left = ~(moved < 1e-9) | ~np.isfinite(state).all(axis=0)
            left |= (np.abs(state[: g.nx]) > self.bound).any(axis=0) | (self.sign == 0).any(axis=0)
        none = np.full((g.nb, k), np.inf)
        trace = Followed(-none, none, s.copy(), s.copy(), left)
        trace.nodes.append((lanes, s.copy(), state[: 3 * g.nx].copy()))
        return trace, FrontStates(state.copy(), state.copy())

    def advanced(
        self, state: Floats, s: Floats, ds: Floats, numbers: Floats
    ) -> tuple[Floats, Floats, Floats, Floats]:
        """Return state, test, det and miss after one step, columns are lanes."""
        after, test, det, miss = self.advance(state.T, np.array([s, ds]).T, numbers.T)
        return after.T, test.T, det.T, miss.T

    def go(
        self,
        trace: Followed,
        ends: FrontStates,
        lanes: Integers,
        goal: Floats,
        grid: Floats,
        first: bool = False,
    ) -> None:
        """Follow lanes (k,) to goals (k,), or with `first` until a block ends.

        `grid` (m,) are the places, rising, of all poses that may be asked for.
        """
        for sense, extent in ((1.0, trace.last), (-1.0, trace.first)):
            rows = np.flatnonzero((goal - extent[lanes]) * sense > 0)
            if rows.size:
                _OneWay(self, trace, ends, lanes[rows], goal[rows], grid, sense, first).run()


class _OneWay:
    """Lanes on their way in one sense."""

    def __init__(
        self, march: LaneFollower, trace: Followed, ends: FrontStates, lanes: Any, goal: Floats,
        grid: Floats,
        sense: float, first: bool,
    ) -> None:  # fmt: skip
        self.march, self.trace, self.sense, self.first = march, trace, sense, first
        self.ends, self.grid = ends.of(sense), grid
        self.reach = trace.high if sense > 0 else trace.low
        self.extent = trace.last if sense > 0 else trace.first
        remaining = ~trace.left[lanes]
        lanes = lanes[remaining]
        self.lanes, self.s, self.final = lanes, self.extent[lanes].copy(), goal[remaining]
        self.goal, self.largest = self.final.copy(), march.largest[lanes]
        self.step, self.look = self.largest.copy(), SHRUNK * self.largest
        self.taken = np.zeros(len(lanes), int)
        self.state, self.numbers = self.ends[:, lanes], march.numbers[:, lanes]
        self.bound, self.sign = march.bound[:, lanes], march.sign[:, lanes]
        self.alive = np.isinf(self.reach[:, lanes])
        self.ending = np.zeros(self.alive.shape, bool)
        """Blocks that end at the goal."""

    def run(self) -> None:
        """Take steps until every lane is at its goal, or left."""
        self._leave()
        while self.lanes.size:
            if len(self.lanes) <= FEW:
                for row in range(len(self.lanes)):
                    self._stride(row)
            self._take()
            there = np.flatnonzero(self.s == self.goal)
            if there.size:
                self._arrived(there)
                self._leave()
            elif self.trace.left[self.lanes].any():
                self._leave()

    def _stride(self, row: int) -> None:
        """Take one lane on in many equal steps: calls for a few lanes cost more than the steps."""
        g, step = self.march.graphs, self.step[row]
        rest = self.sense * (self.goal[row] - self.s[row])
        if rest < 4 * step or step == self.largest[row]:
            return
        count = int(min(STRIDE, rest / step - 0.5))
        ds = self.sense * step
        places = self.s[row] + ds * np.arange(STRIDE + 1)
        chain = g.strides
        states, test, det, miss = chain(self.state[:, row], places[:-1], ds, self.numbers[:, row])
        proved = self._proved(states.T, test.T, det.T, miss.T, np.full(STRIDE, row))
        good = (proved | ~self.alive[:, row, None]).all(axis=0)[:count]
        held = count if good.all() else int(np.argmin(good))
        self.trace.steps += held
        self.taken[row] += held
        if held:
            lane, nodes = np.full(held, self.lanes[row]), states[:held, : 3 * g.nx].T
            self.trace.nodes.append((lane, places[1 : held + 1], nodes))
            self.s[row], self.state[:, row] = places[held], states[held - 1]
            grown = min(2 * step, self.largest[row]) if held > STRIDE // 4 else step
            self.step[row] = grown

    @np.errstate(invalid="ignore")
    def _proved(
        self, after: Floats, test: Floats, det: Floats, miss: Floats, rows: Integers | slice
    ) -> Any:
        """Return which blocks (nb, k) of lanes a step is proved for."""
        proved = (test <= 1) & (miss <= 1) & (det * self.sign[:, rows] > 0)
        near = np.abs(after[: self.march.graphs.nx]) <= self.bound[:, rows]
        if not near.all():
            proved &= np.logical_and.reduceat(near, self.march.graphs.first, axis=0)
        return proved

    @np.errstate(invalid="ignore")
    def _take(self) -> None:
        """Take one step with all lanes."""
        march, g = self.march, self.march.graphs
        rest = self.sense * (self.goal - self.s)
        whole = rest < NEARLY * self.step
        ahead = np.where(whole, self.goal, self.s + self.sense * self.step)
        after, test, det, miss = march.advanced(self.state, self.s, ahead - self.s, self.numbers)
        proved = self._proved(after, test, det, miss, slice(None))
        good = (proved | ~self.alive).all(axis=0)
        self.trace.steps += len(good)
        self.taken += 1
        taken = np.where(whole, np.minimum(rest, self.step), self.step)
        if good.all():
            self.s, self.state = ahead, after
            self.trace.nodes.append((self.lanes, ahead, after[: 3 * g.nx]))
            self.step = np.minimum(GROWTH * self.step, self.largest)
            return
        self.s = np.where(good, ahead, self.s)
        self.state = np.where(good, after, self.state)
        if good.any():
            self.trace.nodes.append((self.lanes[good], ahead[good], after[: 3 * g.nx, good]))
        self.step = np.where(good, np.minimum(GROWTH * self.step, self.largest), taken / 2)
        lost = ~good & ((self.step < SMALLEST * self.largest) | (self.taken > MOST))
        self.trace.left[self.lanes[lost]] = True
        bad = ~good & ~lost & (self.step < self.look) & ~self.ending.any(axis=0)
        if bad.any():
            self._look(np.flatnonzero(bad))

    @np.errstate(invalid="ignore")
    def _look(self, rows: Any) -> None:
        """End blocks of lanes whose steps shrank that do not assemble ahead."""
        self.look[rows] = AGAIN * self.step[rows]
        places, steps = self._ahead(rows)
        depth = self._depths(rows, places)
        alive = self.alive[:, rows, None]
        beyond = np.isnan(places)
        open_ = ~(depth >= 0) & alive & ~beyond
        none = open_.any(axis=0)
        found = none.any(axis=1)
        first = np.argmax(none, axis=1)
        for k in np.flatnonzero(found):
            row, n = rows[k], int(first[k])
            clear = (depth[:, k, n] < -MARGIN) & self.alive[:, row]
            before = np.flatnonzero(steps[k, :n])
            last = int(before[-1]) if before.size else -1
            if last >= 0 and np.any((np.abs(depth[:, k, last]) < CLOSE) & self.alive[:, row]):
                self.trace.left[self.lanes[row]] = True  # it may be a limit position
            elif clear.any():
                hanging = self.march.hanging[clear].any(axis=0)
                self.ending[:, row] = (open_[:, k, n] | hanging) & self.alive[:, row]
                self.goal[row] = places[k, last] if last >= 0 else self.s[row]
            elif steps[k, n]:
                self.trace.left[self.lanes[row]] = True

    def _ahead(self, rows: Integers) -> tuple[Any, Any]:
        """Return places ahead of lanes (k, n), nearest first, and which of them are poses."""
        s, sense, count = self.s[rows, None], self.sense, len(self.grid)
        shares = np.linspace(0, WINDOW, SAMPLES)[1:]
        near = s + sense * self.largest[rows, None] * shares
        steps = np.arange(NEXT)
        if sense > 0:
            at = np.searchsorted(self.grid, s, side="right") + steps
        else:
            at = np.searchsorted(self.grid, s, side="left") - 1 - steps
        inside = (at >= 0) & (at < count)
        poses = np.where(inside, self.grid[np.clip(at, 0, count - 1)], np.nan)
        places = np.concatenate([poses, near], axis=1)
        places = np.where(sense * (self.final[rows, None] - places) >= 0, places, np.nan)
        order = np.argsort(sense * places, axis=1, kind="stable")
        places = np.take_along_axis(places, order, axis=1)
        return places, (order < NEXT) & ~np.isnan(places)

    def _depths(self, rows: Integers, places: Floats) -> Any:
        """Return D over A^2 + B^2 of the blocks of lanes at places (k, n), (nb, k, n)."""
        march, (k, n) = self.march, places.shape
        sign = np.repeat(self.sign[:, rows], n, axis=1)
        p = np.repeat(self.numbers[: march.graphs.np, rows], n, axis=1)
        depth = march.form.poses(places.reshape(-1, 1), sign.T, p.T)[1]
        return np.ascontiguousarray(depth.T).reshape(-1, k, n)

    def _arrived(self, rows: Integers) -> None:
        """End what ends at the goal of lanes, and let them go on."""
        lanes, ending = self.lanes[rows], self.ending[:, rows]
        self.reach[:, lanes] = np.where(ending, self.s[rows], self.reach[:, lanes])
        self.alive[:, rows] &= ~ending
        self.ending[:, rows] = False
        over = ending.any(axis=0) & (self.first | ~self.alive[:, rows].any(axis=0))
        self.final[rows[over]] = self.s[rows[over]]
        self.goal[rows] = self.final[rows]
        self.step[rows] = self.largest[rows]
        self.look[rows] = SHRUNK * self.largest[rows]

    def _leave(self) -> None:
        """Take lanes away that are at the end of their way or not proved."""
        gone = (self.s == self.final) | self.trace.left[self.lanes]
        if not gone.any():
            return
        lanes, remaining = self.lanes[gone], ~gone
        self.ends[:, lanes] = self.state[:, gone]
        self.extent[lanes] = self.s[gone]
        for name in ("lanes", "s", "final", "goal", "largest", "step", "look", "taken"):
            setattr(self, name, getattr(self, name)[remaining])
        for name in ("state", "numbers", "bound", "sign", "alive", "ending"):
            setattr(self, name, np.ascontiguousarray(getattr(self, name)[:, remaining]))
