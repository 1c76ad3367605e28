"""A study's sweep in closed form: every pose of every set at once, without a certificate.

Poses keep the signs of the determinants that the start has. Whether a motion leads from pose to
pose is not asked: what lies between poses is not seen.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from mechdae.design.studies.batches.batch import Rows, SeriesBatch
from mechdae.design.studies.batches.modes import Starts
from mechdae.design.studies.batches.numbers import Numbers
from mechdae.design.studies.batches.poses import AT_ONCE, Asked
from mechdae.kernels.graphs.closed_form import ClosedForm
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import Batch, without_repeats
from mechdae.motion.continuation.beyond_ends import TURN
from mechdae.motion.continuation.evaluate import in_time
from mechdae.types import Booleans, Floats, Integers, Matrices

SX = ca.SX
LEAD = 0.2
"""Way of the driver [rad, lengths] between the places at which turns are counted before poses."""


class Screening(SeriesBatch):
    """Computes series of a plain sweep for many sets in closed form; parameters as there."""

    def rows(self, sets: Floats) -> Rows:
        return self.started(sets, self._screened)

    def _screened(
        self,
        numbers: Numbers,
        lanes: Integers,
        starts: Starts,
        s: Floats,
        values: Floats,
        table: list[Matrices],
    ) -> tuple[Booleans, Booleans, int]:
        """Write series of lanes into the table; return which are left, which poses are there."""
        graphs, form = self.setting.graphs, self.modes.form
        key = ("screened", self.asked.order, tuple(self.asked.columns))
        kernel, unwound = graphs.cache(key, lambda: _kernel(graphs, form, self.asked))
        columns, n = len(self.asked.columns), len(values)
        place = {column: k for k, column in enumerate(self.asked.columns)}
        there = np.zeros((len(lanes), n), bool)
        size = max(1, AT_ONCE // max(n, 1))
        for first in range(0, len(lanes), size):
            some = lanes[first : first + size]
            p = np.repeat(numbers.p[some].T, n, axis=1)
            sign = np.repeat(starts.sign[some].T, n, axis=1)
            u = np.tile(values, len(some))
            turns = np.zeros((graphs.nx, len(u)))
            if unwound:
                turns = self._turns(u, sign, p, starts.x[some], numbers, some, s[some], starts)
            depth, y = kernel(u[:, None], sign.T, turns.T, p.T)
            with np.errstate(invalid="ignore"):
                open_ = ~(depth >= 0).all(axis=1)
            y = np.where(open_, np.nan, y.T).reshape(-1, columns, len(some), n)
            rates = (rate[some][:, None] for rate in numbers.rates)
            orders = in_time(list(y), *rates)
            there[first : first + size] = ~open_.reshape(len(some), n)
            for part, reading in zip(table, self.series, strict=True):
                chosen = [orders[reading.order][place[column]] for column in reading.columns]
                for k, column in enumerate([reading.made(chosen)] if reading.made else chosen):
                    part[some, :, k] = column
        return np.zeros(len(lanes), bool), there, 0

    def _turns(
        self, u: Any, sign: Any, p: Any, start: Any, numbers: Numbers, some: Any, s: Floats,
        starts: Starts,
    ) -> Any:  # fmt: skip
        """Return the whole turns (nx, m) of unknowns at poses, counted from the lanes' starts."""
        form, k = self.modes.form, len(some)
        x = form.poses(u[:, None], sign.T, p.T)[0].T.reshape(start.shape[1], k, -1)
        angles = self.setting.scene.unknowns.turns
        known = start.T
        first = u.reshape(k, -1)[:, 0]
        count = int(np.ceil(np.abs(first - s).max(initial=0.0) / LEAD))
        for share in np.arange(1, count) / max(count, 1):
            at = s + share * (first - s)
            here = form.poses(at[:, None], starts.sign[some], numbers.p[some])[0].T
            known = here + TURN * np.round((known - here) / TURN)
        whole = np.concatenate([known[:, :, None], x], axis=2)
        with np.errstate(invalid="ignore"):
            jumps = np.nan_to_num(-np.round(np.diff(whole, axis=2) / TURN))
        turns = np.cumsum(jumps, axis=2)
        return np.where(angles[:, None], turns.reshape(len(angles), -1), 0.0)


def _kernel(graphs: Graphs, form: ClosedForm, asked: Asked) -> tuple[Batch, bool]:
    """Return (u, sign, turns, p) -> D over A^2 + B^2 of the blocks, y, y', ..., all in closed form.

    The second value tells whether what is asked for changes with whole turns of the unknowns.
    """
    n = graphs.nx
    u, sign, turns = graphs.u, SX.sym("sign", graphs.nb), SX.sym("turns", n)
    s, c = SX.sym("s", n), SX.sym("c", n)
    parts = graphs.rates(graphs.x, u, graphs.driven, asked.order, (s, c))
    values = graphs.output_rates(graphs.x, (s, c), parts)[: asked.order + 1]
    chosen = [ca.vertcat(*[part[asked.columns] for part in values])]
    unwound = ca.depends_on(chosen[0], graphs.x)
    tail = ca.Function("tail", [graphs.x, s, c, u, graphs.p], chosen)
    x, sines, cosines, depth = form.symbolic(u, sign)
    result = tail(x + TURN * turns, sines, cosines, u, graphs.p)
    results = [ca.densify(depth), ca.densify(result)]
    inputs = [u, sign, turns, graphs.p]
    return Batch(without_repeats("screened", inputs, results)), bool(unwound)
