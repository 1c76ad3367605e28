"""Deviations of a quantity of another task: of its mean, its root mean square, its extremes.

At a pose the quantity follows from the pose and the parameters; both deviate. A mean has the mean
of the deviations, with their signs; what deviates of an extreme is the quantity at each pose.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.tasks.goals import Extreme
from mechdae.design.synthesis.nlp import SPREAD, Nlp
from mechdae.design.synthesis.quantity import MEANS, Quantity
from mechdae.design.synthesis.robust.deviations import Deviations
from mechdae.design.synthesis.robust.values import variables
from mechdae.equations.parameters import parameters_of
from mechdae.kernels.run.functions import without_repeats

SX = ca.SX


def row_of(quantity: Quantity, deviations: Deviations) -> Any:
    """Return the function (x, u, d) -> the quantity's values (m,) at a pose, deviations (m, nt)."""
    poses = deviations.poses
    x, u, d = SX.sym("x", poses.nx), SX.sym("u"), SX.sym("d", len(poses.free))
    steps = SX.sym("steps", deviations.count)
    entries = deviations.deviated(d, steps)
    p = parameters_of(poses.model, [*poses.free, *deviations.others], entries)
    whole = poses.recovered(x, u, p)
    places = [poses.names.index(name) for name in quantity.x_names]
    row = quantity.function(whole[places] if places else SX(0, 1), u, entries)
    moved = ca.jacobian(row, steps)
    if poses.nx:
        moved += ca.jacobian(row, x) @ deviations.of_pose(x, u, d)
    results = ca.substitute([row, ca.densify(moved)], [steps], [SX.zeros(deviations.count)])
    return without_repeats("row", [x, u, d], results)


def lifted(nlp: Nlp, name: str, sums: Any) -> Any:
    """Return sums over poses as variables: exact second derivatives stay sparse."""
    if nlp.rough and not nlp.exact:
        return sums
    variables_of_sums = nlp.variable(variables(name), sums.numel(), -np.inf, np.inf)
    nlp.constrain(SPREAD, sums - variables_of_sums)
    return variables_of_sums


def mean_slopes(asked: Extreme, rows: Sequence[Any], weights: Any, unit: float, size: Any) -> Any:
    """Return sums over poses (nt,), or (2 nt,) of an efficiency, whose length is sigma.

    `rows`: pairs of values (m,) and deviations (m, nt) at poses. `size`: values (m,) -> the
    (dimensionless) number that a mean is of.
    """
    total: Any = 0.0
    for weight, (row, A) in zip(weights, rows, strict=True):
        if asked.path in MEANS:
            slopes = {"summary/loss": A[0, :], "summary/input": A[1, :]}.get(asked.path)
            part = ca.horzcat(A[0, :], A[1, :]) if slopes is None else slopes
            part = part / unit
        elif asked.reduce == "rms":
            part = row.T @ A / unit**2
        else:
            value = SX.sym("value", row.numel())
            slope = ca.Function("slope", [value], [ca.jacobian(size(value), value)])
            part = slope(row) @ A
        total = total + weight * part
    return total.T


def sigma_of_mean(asked: Extreme, sums: Any, mean: Any, powers: Any) -> Any:
    """Return sigma of a (dimensionless) mean from its sums.

    `mean`: the root mean square itself, of which the sums are those of its square by two. `powers`:
    mean loss and mean power in the unit of the sums, for an efficiency.
    """
    if asked.path == "summary/efficiency":
        count = sums.numel() // 2
        loss, power = powers
        sums = (sums[:count] * power - sums[count:] * loss) / power**2
    elif asked.path not in MEANS and asked.reduce == "rms":
        sums = sums / mean
    return ca.norm_2(sums)
