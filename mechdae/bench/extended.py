"""The true error of a pose: one Newton step whose residual is evaluated in 80-bit floats.

The step J^-1 F is the distance to the exact solution up to terms of second order.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from mechdae.kernels.extended import LONG, evaluate
from mechdae.kernels.graphs import Graphs


def true_error(graphs: Graphs, x: Any, u: Any, p: Any) -> Any:
    """Return the distance of each unknown from the exact solution, (n, nx)."""
    scene = graphs.scene
    residual = ca.vertcat(*[graph.F for graph in graphs.blocks])
    F = ca.Function("F", [scene.x, scene.u, scene.model.p], [ca.densify(residual)])
    jacobian = ca.Function(
        "J", [scene.x, scene.u, scene.model.p], [ca.densify(ca.jacobian(residual, scene.x))]
    )
    wide = np.tile(np.asarray(p, LONG), (len(x), 1))
    values = evaluate(F, [np.asarray(x, LONG), np.asarray(u, LONG), wide])
    steps = np.empty((len(x), graphs.nx), LONG)
    for k in range(len(x)):
        J = np.array(jacobian(x[k], u[k], p))
        step = np.linalg.solve(J, values[k].astype(float))
        steps[k] = step
    return np.abs(steps).astype(float)
