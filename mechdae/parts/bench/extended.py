"""The true error of a pose: one Newton step whose residual is evaluated in 80-bit floats.

The step J^-1 F is the distance to the exact solution up to terms of second order.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.high_precision import LONG, evaluate
from mechdae.types import Floats


def true_error(graphs: Graphs, x: Any, u: Floats, p: Any) -> Floats:
    """Return the distance of each unknown from the exact solution, (n, nx).

    Block after block: J step = F - F_z step of earlier blocks.
    """
    scene = graphs.scene
    residual = ca.vertcat(*[graph.F for graph in graphs.blocks])
    F = ca.Function("F", [scene.x, scene.u, scene.model.p], [ca.densify(residual)])
    wide = np.tile(np.asarray(p, LONG), (len(x), 1))
    values = evaluate(F, [np.asarray(x, LONG), np.asarray(u, LONG), wide])
    steps = np.zeros((len(x), graphs.nx))
    first = 0
    for graph in graphs.blocks:
        rows = slice(first, first + graph.F.numel())
        first = rows.stop
        for k in range(len(x)):
            _, J, Fz = graph.value_at(x[k], u[k], p)
            gap = values[k, rows].astype(float) - Fz @ steps[k, graph.uses]
            square = J.shape[0] == J.shape[1]
            steps[k, graph.own] = np.linalg.solve(J, gap) if square else np.linalg.lstsq(J, gap)[0]
    return np.abs(steps)
