"""Bounds of poses evaluated in ball arithmetic: the formula, without what is allowed for rounding.

Kernels are walked instruction by instruction with balls of `PRECISION` bits, so that nothing of
what is found is rounding. Inputs are the floats that the kernels had.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
from flint import arb, ctx

from mechdae.kernels.bounds.walk import FORMULAS, replay
from mechdae.kernels.graphs.bounds import ALLOWANCE
from mechdae.motion.kinematics.prepared import Run, Setting

PRECISION = 192
OPERATIONS = {
    **FORMULAS,
    ca.OP_SIN: arb.sin,
    ca.OP_COS: arb.cos,
    ca.OP_SQRT: lambda a: a.sqrt() if a.is_exact() or a.lower() > 0 else arb.max(a, arb(0)).sqrt(),
    ca.OP_FABS: abs,
    ca.OP_FMIN: arb.min,
    ca.OP_FMAX: arb.max,
}


def walked(function: Any, inputs: list[Any]) -> list[list[Any]]:
    """Return the outputs of a function in balls, for inputs that are lists of balls."""
    found = replay(function, inputs, lambda code, args: OPERATIONS[code](*args), arb)
    return [[arb(0) if v is None else v for v in part] for part in found]


def balls(values: Any) -> list[Any]:
    return [v if isinstance(v, arb) else arb(float(v)) for v in np.ravel(values)]


def bounds(setting: Setting, run: Run, rows: Any) -> dict[str, list[Any]]:
    """Return the bound of each pose of a run, by its word, in balls.

    Constants of the sweep, the pose's kernel and the slopes of its outputs are all evaluated anew;
    the allowance is divided out of the slopes.
    """
    ctx.prec = PRECISION
    graphs, constants = setting.graphs, run.path.constants
    sizes = [balls(v) for v in (constants.size_x, constants.size_u, constants.p)]
    rest = [balls(part) for part in (constants.floors, *constants.boxes)]
    kappa, rho, _ = walked(graphs.constants, [*sizes, balls(constants.scale), *rest])
    grain = [v * arb(2) ** -53 for v in sizes[0]]
    consts = [*sizes[2], *balls(constants.scale), *kappa, *rho, *grain, *rest[0]]
    slope, rounding = walked(graphs.output_bounds, [*sizes, *rest])
    entries = list(zip(*graphs.output_bounds.sparsity_out(0).get_triplet(), slope, strict=False))
    found: dict[str, list[Any]] = {word: [] for word in setting.outputs.bounded}
    for row in rows:
        u = balls(run.values[row])
        moving = [] if graphs.single else [[arb(0)] * graphs.nu for _ in graphs.driven]
        error = walked(graphs.pose, [balls(run.poses.x[row]), u, *moving, consts])[1]
        for word, columns in setting.outputs.bounded.items():
            each = [sum((v * error[j] for k, j, v in entries if k == i), arb(0)) for i in columns]
            largest = [
                max(part, key=lambda v: float(v.upper()), default=arb(0))
                for part in (each, [rounding[i] for i in columns])
            ]
            found[word].append(sum(largest, arb(0)) / arb(ALLOWANCE))
    return found
