"""The true error of a pose: one Newton step whose residual is evaluated in 80-bit floats.

The residual's graph is walked instruction by instruction with ``numpy.longdouble``; the
step J^-1 F then is the distance to the exact solution up to terms of second order.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from mechdae.kernels.graphs import Graphs

LONG = np.longdouble
_OPERATIONS: dict[int, Callable[..., Any]] = {
    ca.OP_ADD: np.add,
    ca.OP_SUB: np.subtract,
    ca.OP_MUL: np.multiply,
    ca.OP_DIV: np.divide,
    ca.OP_NEG: np.negative,
    ca.OP_SIN: np.sin,
    ca.OP_COS: np.cos,
    ca.OP_TAN: np.tan,
    ca.OP_SQ: np.square,
    ca.OP_SQRT: np.sqrt,
    ca.OP_TWICE: lambda a: 2 * a,
    ca.OP_INV: lambda a: 1 / a,
    ca.OP_POW: np.power,
    ca.OP_CONSTPOW: np.power,
    ca.OP_EXP: np.exp,
    ca.OP_LOG: np.log,
    ca.OP_ASIN: np.arcsin,
    ca.OP_ACOS: np.arccos,
    ca.OP_ATAN: np.arctan,
    ca.OP_ATAN2: np.arctan2,
    ca.OP_FABS: np.abs,
    ca.OP_ASSIGN: np.positive,
}


def evaluate(function: Any, inputs: list[Any]) -> Any:
    """Return the first output (n, rows) for inputs (n, columns) of any float type."""
    work: dict[int, Any] = {}
    n = len(inputs[0])
    dtype = np.result_type(*inputs)
    result = np.zeros((n, function.size1_out(0)), dtype=dtype)
    for k in range(function.n_instructions()):
        code = function.instruction_id(k)
        into, out_of = function.instruction_output(k), function.instruction_input(k)
        if code == ca.OP_INPUT:
            work[into[0]] = inputs[out_of[0]][:, out_of[1]]
        elif code == ca.OP_CONST:
            work[into[0]] = dtype.type(function.instruction_constant(k))
        elif code == ca.OP_OUTPUT:
            result[:, into[1]] = work[out_of[0]]
        else:
            work[into[0]] = _OPERATIONS[code](*[work[i] for i in out_of])
    return result


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
