"""One sweep for many sets of parameters at once: all of them take each step together.

Every set is a lane with its own numbers in the same kernels. A lane is kept as long as each
of its steps and poses is proved by the tests that a single path uses; the others are left
to be followed one by one.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechdae.continuation.evaluate import H_LIMIT, Evaluator
from mechdae.kernels.run.batch import Batch
from mechdae.kinematics.prepared import Setting
from mechdae.numerics.hermite import upper_coefficients
from mechdae.setup.scales import Constants
from mechdae.studies.set_modes import Starts

ROUNDS = 8
PARTS = (1, 2, 4, 16)
"""Steps in which lanes that are not proved yet try to pass one largest step."""


@dataclass(frozen=True)
class Lanes:
    """Poses of all lanes: ``kept`` (k,) tells which are proved, the rows of others are nan.

    ``y`` holds outputs and their derivatives by the driver, each (k, n, ny); ``error`` is
    (k, n, nx), ``condition`` (k, n); ``steps`` counts steps of all lanes.
    """

    kept: Any
    y: list[Any]
    error: Any
    condition: Any
    steps: int


class Lockstep:
    """Follows the sweep of a prepared scene with one driver for many parameter vectors.

    Parameters
    ----------
    setting
        The prepared task.
    largest
        Largest step of a single path.
    """

    def __init__(self, setting: Setting, largest: float) -> None:
        self.setting, self.graphs, self.step = setting, setting.graphs, largest
        graphs = self.graphs
        self.advance: Batch = graphs.kept("lanes", lambda: Batch(graphs.advance))
        self.pose: Batch = graphs.kept("poses of lanes", lambda: Batch(graphs.pose))
        self.evaluator = Evaluator(self.graphs, setting.outputs)

    def run(self, numbers: list[Constants], starts: Starts, s: float, values: Any) -> Lanes:
        """Return the poses at the driver's `values` (n,) of all lanes.

        Parameters
        ----------
        numbers
            Parameter values and bounds of each lane; bounds must hold for |x| as in a path.
        starts, s
            A pose of each lane, solved at the driver's value s.
        """
        consts = np.array([number.vector() for number in numbers])
        state, sign, kept = self._start(consts, starts, s)
        self.steps, self.size = 0, np.min([number.size_x for number in numbers], axis=0)
        upper = self._march(state, consts, sign, kept, s, float(values.max()))
        lower = self._march(state, consts, sign, kept, s, float(values.min()))
        places = np.array([place for place, _ in (*lower[:0:-1], *upper)])
        states = np.stack([node for _, node in (*lower[:0:-1], *upper)], axis=1)
        return self._poses(numbers, consts, sign, kept, places, states, values)

    def begin(self, numbers: Sequence[Constants], x: Any, s: float) -> Starts:
        """Return what Newton's method gives for each lane from one pose of the first.

        ``sure`` (k, nb) tells which blocks come to a pose on the same side of each dyad.
        """
        consts = np.array([number.vector() for number in numbers])
        state, det, moved = self._settled(consts, x, s)
        sign = np.sign(det)
        with np.errstate(invalid="ignore"):
            sure = (sign == sign[0]) & (moved < 1e-9) & np.isfinite(moved)
        return Starts(state[:, : self.graphs.nx], sign, sure)

    def _settled(self, consts: Any, x: Any, s: float) -> tuple[Any, Any, Any]:
        """Return states, determinants and last steps of the blocks by Newton's method from x."""
        g, k = self.graphs, len(consts)
        state = np.zeros((k, 3 * g.nx + g.nb))
        state[:, : g.nx] = x
        moved = np.full((k, g.nb), np.inf)
        for _ in range(ROUNDS):
            before = state[:, : g.nx]
            state, _, det, _ = self._advanced(state, s, 0.0, consts)
            for b, graph in enumerate(g.blocks):
                moved[:, b] = np.abs(state[:, graph.own] - before[:, graph.own]).max(axis=1)
            with np.errstate(invalid="ignore"):
                if not np.any(moved > 1e-13 * (1 + np.nanmax(np.abs(state[:, : g.nx])))):
                    break
        return state, det, moved

    def _start(self, consts: Any, starts: Starts, s: float) -> tuple[Any, Any, Any]:
        state, det, moved = self._settled(consts, starts.x, s)
        with np.errstate(invalid="ignore"):
            kept = (np.sign(det) == starts.sign).all(axis=1) & np.isfinite(state).all(axis=1)
            kept &= (moved < 1e-9).all(axis=1) & starts.sure
        kept &= self.evaluator.sign_tells.all() | (np.arange(len(consts)) == 0)
        return state, starts.sign, kept

    def _advanced(self, state: Any, s: float, ds: float, consts: Any) -> list[Any]:
        rows = len(state)
        step = np.broadcast_to([s, ds], (rows, 2))
        tail = np.broadcast_to([0.0, 1.0], (rows, 2))  # u0 and d: the driver itself
        return self.advance(state, step, np.hstack([consts, tail]))

    def _march(
        self, state: Any, consts: Any, sign: Any, kept: Any, s: float, to: float
    ) -> list[tuple[float, Any]]:
        """Return nodes (s, states) up to `to`; `kept` loses the lanes that are not proved."""
        nodes = [(s, state)]
        count = int(np.ceil(abs(to - s) / self.step))
        for k in range(count):
            here = s + (to - s) * k / count
            ahead = s + (to - s) * (k + 1) / count
            rows = np.flatnonzero(kept)
            state = state.copy()
            for parts in PARTS:
                rows = self._step(state, consts, sign, rows, np.linspace(here, ahead, parts + 1))
            kept[rows] = False
            nodes.append((ahead, state))
        return nodes

    def _step(self, state: Any, consts: Any, sign: Any, rows: Any, places: Any) -> Any:
        """Take lanes through `places` in place; return the rows that are not proved."""
        ahead, held = state[rows], np.ones(len(rows), bool)
        for here, there in itertools.pairwise(places):
            going = np.flatnonzero(held)
            if not going.size:
                break
            after, test, det, miss = self._advanced(
                ahead[going], here, there - here, consts[rows[going]]
            )
            self.steps += len(going)
            with np.errstate(invalid="ignore"):
                good = ((test <= 1) & (miss <= 1) & (np.sign(det) == sign[rows[going]])).all(axis=1)
                good &= (np.abs(after[:, : self.graphs.nx]) <= self.size).all(axis=1)
            ahead[going] = after
            held[going[~good]] = False
        state[rows[held]] = ahead[held]
        return rows[~held]

    def _poses(
        self,
        numbers: list[Constants],
        consts: Any,
        sign: Any,
        kept: Any,
        places: Any,
        states: Any,
        values: Any,
    ) -> Lanes:
        g, n, lanes = self.graphs, len(values), np.flatnonzero(kept)
        nx = g.nx
        parts = [states[lanes][:, :, k * nx : (k + 1) * nx] for k in range(3)]
        guess = _quintic(places, parts, values).reshape(-1, nx)
        u = np.tile(values, len(lanes))[:, None]
        whole = np.repeat(consts[lanes], n, axis=0)
        results = self.pose(guess, u, whole)
        kappa = np.repeat(np.array([numbers[i].kappa for i in lanes]).reshape(-1, g.nb), n, axis=0)
        rho = np.repeat(np.array([numbers[i].rho for i in lanes]).reshape(-1, g.nb), n, axis=0)
        mu = np.repeat(np.array([numbers[i].mu for i in lanes]).reshape(-1, g.nb), n, axis=0)
        with np.errstate(invalid="ignore", over="ignore"):
            h = kappa * results[3] * (np.sqrt(results[4]) + results[3] * rho)
            sides = np.repeat(sign[lanes], n, axis=0)
            good = ((h <= H_LIMIT) & (np.sign(results[2]) == sides)).all(axis=1)
            good &= (np.abs(results[0]) <= self.size).all(axis=1)
            good &= (kappa * results[3] * results[4] <= 1e-15).all(axis=1)
        held = good.reshape(len(lanes), n).all(axis=1)
        kept[lanes[~held]] = False

        def spread(array: Any) -> Any:
            shaped = np.full((len(consts), n, array.shape[1]), np.nan)
            shaped[lanes[held]] = array.reshape(len(lanes), n, array.shape[1])[held]
            return shaped

        condition = np.max(mu * results[3], axis=1, initial=1.0)[:, None]
        return Lanes(
            kept,
            [spread(array) for array in results[5:]],
            spread(results[1]),
            spread(condition)[:, :, 0],
            self.steps,
        )


def _quintic(S: Any, parts: list[Any], s: Any) -> Any:
    """Return quintic Hermite values (k, n, nx) for nodes S (m,) and tables (k, m, nx)."""
    X, V, A = parts
    if len(S) == 1:
        return np.repeat(X, len(s), axis=1)
    i = np.clip(np.searchsorted(S, s, side="right") - 1, 0, len(S) - 2)
    h = np.diff(S)[i][:, None]
    t = (s - S[i])[:, None] / h
    x0, v0, a0 = X[:, i], V[:, i] * h, A[:, i] * h * h
    x1, v1, a1 = X[:, i + 1], V[:, i + 1] * h, A[:, i + 1] * h * h
    c3, c4, c5 = upper_coefficients(x1 - x0, v0, v1, a0, a1)
    return x0 + t * (v0 + t * (a0 / 2 + t * (c3 + t * (c4 + t * c5))))
