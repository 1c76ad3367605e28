"""Poses of lanes at values of the driver: guesses between nodes, a Newton step, certificates."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from typing import Any

import casadi as ca
import numpy as np

from mechdae.design.studies.batches.march import Followed
from mechdae.kernels.graphs.closed_form import ClosedForm
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import Batch, without_repeats
from mechdae.motion.continuation.beyond_ends import HALF_TURN, HARDLY, TURN
from mechdae.motion.continuation.evaluate import CARRIED, H_LIMIT, ROUNDS, TINY
from mechdae.motion.continuation.interpolate import upper_coefficients
from mechdae.motion.setup.outputs import Outputs
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Graph, Integers, Matrices, Matrix, Unknowns

AT_ONCE = 16_384
"""Poses that are evaluated at once."""


@dataclass(frozen=True)
class Asked:
    """What is asked of a pose: by path the order of the derivative and the columns of y.

    With `bounds` those of the unknowns and the blocks' beta come before y.
    """

    paths: tuple[tuple[int, tuple[int, ...]], ...]
    bounds: bool = False

    @property
    def order(self) -> int:
        return max((order for order, _ in self.paths), default=0)

    @property
    def columns(self) -> list[int]:
        return sorted({i for _, columns in self.paths for i in columns})


@dataclass(frozen=True)
class Lanes:
    """Numbers of lanes as columns: consts (nc, k), kappa, rho, sign (nb, k), size (nx, k)."""

    consts: Floats
    kappa: Floats
    rho: Floats
    sign: Floats
    size: Matrix

    def take(self, rows: Integers) -> Lanes:
        return self._each(lambda part: part[:, rows])

    def repeated(self, times: int) -> Lanes:
        """Return each lane so many times."""
        return self._each(lambda part: np.repeat(part, times, axis=1))

    def _each(self, change: Callable[[Floats], Floats]) -> Lanes:
        parts = (self.consts, self.kappa, self.rho, self.sign, self.size)
        return Lanes(*map(change, parts))


class LaneNodes:
    """The nodes of lanes, sorted: places and quintic pieces between them."""

    def __init__(self, trace: Followed, count: int, nx: int) -> None:
        lanes, s = (np.concatenate([part[k] for part in trace.nodes]) for k in (0, 1))
        order = np.lexsort((s, lanes))
        place = np.empty_like(order)
        place[order] = np.arange(len(order))
        states, done = np.empty((len(order), 3 * nx)), 0
        for step_lanes, _, columns in trace.nodes:
            states[place[done : done + len(step_lanes)]] = columns.T
            done += len(step_lanes)
        trace.nodes.clear()
        self._enter(lanes[order], s[order], states.reshape(len(s), 3, nx), count)

    def _enter(self, lanes: Integers, s: Floats, states: Matrices, count: int) -> None:
        self.lanes: Integers = lanes
        self.s: Floats = s
        self.states: Matrices = states
        self.first: Integers = np.searchsorted(lanes, np.arange(count + 1))
        self.count: Integers = np.diff(self.first)
        h = np.diff(s, append=0.0)
        h[self.first[1:] - 1] = 0.0
        self.width: Floats = np.where(h == 0, 1.0, h)

    def take(self, rows: Integers) -> LaneNodes:
        """Return the nodes of some lanes, rising, which are numbered again."""
        if len(rows) == len(self.count):
            return self
        number = np.full(len(self.count), -1)
        number[rows] = np.arange(len(rows))
        lanes = number[self.lanes]
        remaining, other = lanes >= 0, copy(self)
        other._enter(lanes[remaining], self.s[remaining], self.states[remaining], len(rows))
        return other

    def before(self, grid: Floats, right: bool) -> Integers:
        """Return by lane and place of a rising grid the nodes that come before it (k, m)."""
        k, m = len(self.count), len(grid)
        at = np.searchsorted(grid, self.s, side="left" if right else "right")
        hits = np.bincount(self.lanes * (m + 1) + at, minlength=k * (m + 1))
        return np.cumsum(hits.reshape(k, m + 1), axis=1)[:, :m]

    def piece(self, lanes: Integers, places: Floats) -> Integers:
        """Return the pieces (n,) on which places (n,) of lanes lie, or the ones beside them."""
        apart = 2 * float(np.abs(self.s).max(initial=0.0) + np.abs(places).max(initial=0.0)) + 1
        found = np.searchsorted(self.lanes * apart + self.s, lanes * apart + places, "right") - 1
        first = self.first[lanes]
        return np.clip(found, first, np.maximum(first + self.count[lanes] - 2, first))

    def guess(self, lanes: Integers, piece: Integers, places: Floats) -> Any:
        """Return unknowns (nx, n) at places (n,) on pieces (n,) of lanes, given in their order."""
        window: Any = slice(self.first[lanes[0]], self.first[lanes[-1] + 1])
        here: Integers | slice = piece - window.start
        after: Integers | None = None
        if len(places) < window.stop - window.start:
            window, here, after = piece, slice(None), np.minimum(piece + 1, len(self.s) - 1)
        x, v, a = np.ascontiguousarray(self.states[window].T.swapaxes(0, 1))
        h = self.width[window]
        if after is None:
            x1, v1, a1 = (np.roll(part, -1, axis=1) for part in (x, v, a))
        else:
            x1, v1, a1 = np.ascontiguousarray(self.states[after].T.swapaxes(0, 1))
        with np.errstate(invalid="ignore", over="ignore"):
            v0, a0 = v * h, a * (h * h)
            upper = upper_coefficients(x1 - x, v0, v1 * h, a0, a1 * (h * h))
            t = (places - self.s[piece]) / self.width[piece]
            result: Any = 0.0
            for part in (*upper[::-1], 0.5 * a0, v0, x):
                result = result * t + part[:, here]
        return result


class LanePoses:
    """Evaluates the poses of lanes of one scene."""

    def __init__(self, graphs: Graphs, outputs: Outputs, form: ClosedForm, asked: Asked) -> None:
        self.graphs, self.form, self.asked = graphs, form, asked
        key = ("poses of lanes", asked.order, tuple(asked.columns), asked.bounds)
        self.pose: Batch = graphs.cache(key, lambda: Batch(_only(graphs, asked)))
        unknowns = graphs.scene.unknowns
        self.angles: Booleans = unknowns.turns[:, None]
        turning = [unknowns.turns[g.own].any() for g in graphs.blocks]
        self.most: Floats = np.where(turning, CARRIED, np.inf)[:, None]
        lengths = np.array([unknowns.lengths[g.own].all() for g in graphs.blocks], bool)
        self.tiny = TINY * np.where(lengths, 1.0, 0.0)[:, None], TINY * ~lengths[:, None]
        groups = [graph.block.group for graph in graphs.blocks]
        self.users: Booleans = np.zeros((len(asked.columns), graphs.nb), bool)
        """Which blocks a column depends on."""
        place = {column: k for k, column in enumerate(asked.columns)}
        for entry in outputs.entries:
            needed = outputs.groups_of(entry)
            for column in entry.columns:
                if column in place:
                    self.users[place[column]] = [group in needed for group in groups]

    def __call__(
        self, lanes: Lanes, nodes: LaneNodes, trace: Followed, origin: Floats, values: Floats,
        turns: bool, beta: Matrices | None = None,
    ) -> tuple[list[Any], Any]:  # fmt: skip
        """Return y, y', ... (columns, k, n) of the columns asked for, and which poses are whole.

        `values` (n,) are the driver's, `origin` (k,) where lanes began; `turns`: a whole turn of
        the driver leads to the same pose. Lanes that are not certified are marked in the trace.
        Into `beta` (nb, k, n), if given, go the norms of the blocks' inverse Jacobians.
        """
        k, n = len(origin), len(values)
        alive, places = _alive(trace, values, turns)
        grid = np.unique(places) if places.ndim == 2 else np.unique(values)
        index = np.searchsorted(grid, places)
        before = [nodes.before(grid, right) for right in (False, True)]
        results = [
            np.full((len(self.asked.columns), k, n), np.nan) for _ in range(self.asked.order + 1)
        ]
        rows = max(1, AT_ONCE // max(n, 1))
        for start in range(0, k, rows):
            some = np.arange(start, min(start + rows, k))
            some = some[~trace.left[some]]
            if not some.size:
                continue
            at = index[some] if index.ndim == 2 else np.broadcast_to(index, (len(some), n))
            where = grid[at]
            up = where > origin[some, None]
            counts = [np.take_along_axis(part[some], at, axis=1) for part in before]
            piece = np.where(up, counts[0], counts[1]) - 1
            piece = np.clip(piece, 0, np.maximum(nodes.count[some, None] - 2, 0))
            piece = (piece + nodes.first[some, None]).ravel()
            guess = nodes.guess(some, piece, where.ravel())
            living = None if alive is None else alive[:, some].reshape(len(alive), -1)
            numbers = lanes.take(some)
            y, good, norms = self._solve(numbers, guess, np.tile(values, len(some)), n, living)
            if beta is not None:
                beta[:, some] = norms.reshape(-1, len(some), n)
            good = good.reshape(len(some), n).all(axis=1)
            trace.left[some[~good]] = True
            for result, part in zip(results, y, strict=True):
                if living is not None:
                    dead = (self.users[:, :, None] & ~living[None]).any(axis=1)
                    part = np.where(dead, np.nan, part)
                result[:, some] = part.reshape(-1, len(some), n)
        whole = np.ones((k, n), bool) if alive is None else alive.all(axis=0)
        return results, whole

    def _solve(
        self, lanes: Lanes, guess: Unknowns, u: Floats, n: int, living: Booleans | None
    ) -> tuple[list[Any], Any, Any]:
        """Return y and its derivatives (columns, m), which poses (m,) are certified, beta."""
        lanes = lanes.repeated(n)
        tiny = self._tiny(lanes)
        results = self._evaluated(guess, u, lanes, tiny)
        good = self._good(results, guess, lanes)
        with np.errstate(invalid="ignore", over="ignore"):  # else Newton's method began far away
            good &= lanes.kappa * results[2] * results[3] <= tiny
        if living is not None:
            good |= ~living
        bad = np.flatnonzero(~good.all(axis=0))
        if bad.size:
            lanes = lanes.take(bad)
            x = self.form.poses(u[bad, None], lanes.sign.T, lanes.consts[: self.graphs.np].T)[0].T
            x = x + np.where(self.angles, TURN * np.round((guess[:, bad] - x) / TURN), 0.0)
            again = self._evaluated(x, u[bad], lanes, tiny[:, bad])
            for whole, part in zip(results, again, strict=True):
                whole[:, bad] = part
            better = self._good(again, x, lanes)
            good[:, bad] = better if living is None else better | ~living[:, bad]
        y = np.split(results[-1], self.asked.order + 1)
        return y, good.all(axis=0), results[2]

    def certified(self, lanes: Lanes, guess: Unknowns, u: Floats) -> tuple[Any, Any]:
        """Return y, y', ... below one another at one place of each lane, which are certified."""
        results = self._evaluated(guess, u, lanes, self._tiny(lanes))
        return results[-1], self._good(results, guess, lanes).all(axis=0)

    def _tiny(self, lanes: Lanes) -> Floats:
        """Return steps of Newton's method that are none (nb, m)."""
        tiny: Floats = self.tiny[0] * lanes.consts[self.graphs.np] + self.tiny[1]
        return tiny

    def _evaluated(self, guess: Unknowns, u: Floats, lanes: Lanes, tiny: Floats) -> list[Floats]:
        """Return x, det, beta, eta^2 and y after as many steps as are needed."""
        consts, kappa = lanes.consts, lanes.kappa
        results = [part.T for part in self.pose(guess.T, u[:, None], consts.T)]
        for _ in range(ROUNDS):
            with np.errstate(invalid="ignore", over="ignore"):
                left = (kappa * results[2] * results[3] > tiny) | (results[3] > self.most)
            again = np.flatnonzero(left.any(axis=0))
            if not again.size:
                break
            part = self.pose(results[0][:, again].T, u[again, None], consts[:, again].T)
            for whole, new in zip(results, part, strict=True):
                whole[:, again] = new.T
        return results

    def _good(self, results: list[Floats], guess: Unknowns, lanes: Lanes) -> Booleans:
        """Return which blocks (nb, m) are certified, on the branch of their lane."""
        x, det, beta, eta = results[:4]
        with np.errstate(invalid="ignore", over="ignore"):
            h = lanes.kappa * beta * (np.sqrt(eta) + beta * lanes.rho)
            good = (h <= H_LIMIT) & (det * lanes.sign > 0)
            far = (np.abs(x - guess) > HALF_TURN) & self.angles
            far |= ~(np.abs(x) <= lanes.size)
        if good.shape[0]:
            good &= ~np.logical_or.reduceat(far, self.graphs.first, axis=0)
        return good


def _only(graphs: Graphs, asked: Asked) -> Graph:
    """Return the pose kernel with what a study asks for: x, det, beta, eta^2, y, y', ..."""
    inputs = graphs.pose.sx_in()
    x, error, det, beta, eta, *y = graphs.pose(*inputs)
    chosen = [error, beta] if asked.bounds else []
    chosen += [part[asked.columns] for part in y[: asked.order + 1]]
    results = [x, det, beta, eta, ca.vertcat(*chosen)]
    return without_repeats("row", inputs, [ca.densify(part) for part in results])


def _alive(trace: Followed, values: Floats, turns: bool) -> tuple[Booleans | None, Floats]:
    """Return which blocks have a pose (nb, k, n), None: all, and where on the path poses lie."""
    low, high = trace.low[:, :, None], trace.high[:, :, None]
    if np.isinf(low).all() and np.isinf(high).all():
        return None, values
    alive = (values >= low) & (values <= high)
    places = np.broadcast_to(values, alive.shape[1:]).copy()
    direct = alive.all(axis=0)
    if not turns or direct.all():
        return alive, places
    whole = trace.whole
    first = np.maximum(trace.first, whole[0])[:, None]
    last = np.minimum(trace.last, whole[1])[:, None]
    way = np.where(values > last, -1.0, 1.0)
    nearest = np.where(way < 0, last - values, first - values) / TURN
    shift = way * np.ceil(np.abs(nearest) - HARDLY)
    for _ in range(2):
        there = values + TURN * shift
        inside = (there >= first) & (there <= last) & ~direct
        places = np.where(inside, there, places)
        alive |= inside
        direct |= inside
        shift = shift + way
    return alive, places
