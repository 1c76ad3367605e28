"""Deviations of a quantity of another task: of its mean, its root mean square, its extremes.

At a pose the quantity follows from the pose and the parameters; both deviate. A mean has the mean
of the deviations, with their signs; what deviates of an extreme is the quantity at each pose.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.tasks.goals import Extreme
from mechdae.describe.tasks.kinds import Sweep
from mechdae.describe.tasks.shaking import shaking_paths
from mechdae.errors import InputError
from mechdae.kernels.run.without_repeats import without_repeats
from mechdae.model.parameters import parameters_of
from mechdae.synthesis.nlp import SPREAD, Nlp
from mechdae.synthesis.quantity import MEANS, Quantity
from mechdae.synthesis.robust.deviations import Deviations
from mechdae.synthesis.robust.values import of_largest, variables
from mechdae.synthesis.verify import POSES, Design

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
    own = nlp.variable(variables(name), sums.numel(), -np.inf, np.inf)
    nlp.constrain(SPREAD, sums - own)
    return own


def mean_slopes(asked: Extreme, rows: Sequence[Any], weights: Any, unit: float, size: Any) -> Any:
    """Return sums over poses (nt,), or (2 nt,) of an efficiency, whose length is sigma.

    Parameters
    ----------
    rows
        Pairs of values (m,) and deviations (m, nt) at poses.
    size
        Values (m,) -> the (dimensionless) number that a mean is of.
    """
    total: Any = 0.0
    for weight, (row, A) in zip(weights, rows, strict=True):
        if asked.path in MEANS:
            own = {"summary/loss": A[0, :], "summary/input": A[1, :]}.get(asked.path)
            part = ca.horzcat(A[0, :], A[1, :]) if own is None else own
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

    Parameters
    ----------
    mean
        The root mean square itself, of which the sums are those of its square by two.
    powers
        Mean loss and mean power in the unit of the sums, for an efficiency.
    """
    if asked.path == "summary/efficiency":
        count = sums.numel() // 2
        loss, power = powers
        sums = (sums[:count] * power - sums[count:] * loss) / power**2
    elif asked.path not in MEANS and asked.reduce == "rms":
        sums = sums / mean
    return ca.norm_2(sums)


def of_task(design: Design, asked: Extreme, deviations: Deviations) -> tuple[float, dict[str, Any]]:
    """Return the robust value of a quantity by the derivatives of the task itself.

    Of an extreme it is that of the poses of the task, 721 where they are not named.
    """
    names, factor, sigmas = deviations.names, deviations.factor, deviations.sigmas
    paths = shaking_paths(asked.path, design.problem.mechanism.dimension)
    task = design.others[asked.task]
    assert isinstance(task, Sweep)
    found = design.slopes(asked.task if asked.path in MEANS else fine(task), paths, names)
    value = np.concatenate([found[path][0] for path in paths], axis=1)
    slopes = np.concatenate([found[path][1] for path in paths], axis=1) * sigmas
    if not np.isfinite(slopes).all():
        raise InputError(f"{asked.path} has no derivative by {', '.join(names)} at all poses")
    width = min(value.shape[1], design.problem.mechanism.dimension)
    value, slopes = value[:, :width], slopes[:, :width]
    sense = -asked.sense * factor
    if asked.path in MEANS or asked.reduce in ("mean", "rms"):
        weights = np.ones(len(value))
        if len(value) > 2:
            weights[[0, -1]] = 0.5
        weights /= weights.sum()
        nominal, sigma = _averaged(asked, value, slopes, weights)
        total = nominal - sense * sigma
        return total, {"nominal": nominal, "sigma": sigma, "value": total}
    if asked.reduce == "peak":
        sizes, along = _sizes(value, slopes)
        return of_largest(sizes, along[:, None], factor)
    total, parts = of_largest(-value[:, 0], slopes, factor)
    return -total, {"nominal": -parts["nominal"], "sigma": parts["sigma"], "value": -total}


def fine(task: Sweep) -> Sweep:
    """Return a task with enough poses for extremes."""
    if any(driver.at is not None or driver.times is not None for driver in task.all_drivers):
        return task
    return replace(task, poses=max(task.poses or 0, POSES))


def _sizes(value: Any, slopes: Any) -> tuple[Any, Any]:
    """Return lengths (n,) of vectors and their deviations (n, nt)."""
    sizes = np.linalg.norm(value, axis=1)
    unit = value / np.maximum(sizes, 1e-300)[:, None]
    return sizes, np.einsum("nw,nwt->nt", unit, slopes)


def _averaged(asked: Extreme, value: Any, slopes: Any, weights: Any) -> tuple[float, float]:
    """Return a mean or root mean square over poses and its standard deviation."""
    if asked.path not in MEANS and asked.reduce == "rms":
        nominal = float(np.sqrt(weights @ np.sum(value**2, axis=1)))
        along = np.einsum("n,nw,nwt->t", weights, value, slopes) / nominal
    else:
        if value.shape[1] > 1:
            value, slopes = (part[:, None] for part in _sizes(value, slopes))
        nominal = float(weights @ value[:, 0])
        along = weights @ slopes[:, 0]
    return nominal, float(np.linalg.norm(along))
