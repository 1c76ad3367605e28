"""Robust values: what errors become with k standard deviations by tolerances added.

Residuals e_i are linear in the deviations, e_i + A_i s, with independent steps s_j that lie evenly
in -+ sqrt 3 (variance 1, fourth moment 9/5). Then the sum of squares F = sum w_i |e_i + A_i s|^2
= F_0 + 2 b.s + s.B s with b = sum w_i A_i' e_i, B = sum w_i A_i' A_i has exactly

    mean  F_0 + tr B,   variance  4 |b|^2 + 4/5 sum_j B_jj^2 + 4 sum_(j<k) B_jk^2

and its robust value is mean + k sigma. A largest error becomes the largest of |e_i| + k sigma_i,
with sigma_i = |A_i| (Frobenius), the root of the mean square deviation of that residual.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.tasks.goals import Extreme, FunctionTargets
from mechdae.describe.tasks.synthesis import Demand
from mechdae.design.synthesis.goals.base import Goal
from mechdae.design.synthesis.nlp import SPREAD, Nlp
from mechdae.design.synthesis.poses import FreePoses
from mechdae.design.synthesis.quantity import MEANS, Quantity
from mechdae.design.synthesis.robust.deviations import Deviations
from mechdae.equations.parameters import parameters_of
from mechdae.errors import InputError, UnavailableError
from mechdae.kernels.run.functions import without_repeats
from mechdae.types import Floats, Matrices, Points, Sym

SX = ca.SX
FOURTH = 4 / 5
"""Fourth moment of an even distribution with variance 1, less the square of the second."""
TINY = 1e-20
"""Added to a variance below a root, so that it has a derivative where nothing deviates."""
Row = tuple[float, Any, Any]
"""Weight, residual (m,) and its deviations (m, nt)."""


def variables(name: str) -> str:
    """Return the name of the variables b and B of a goal's sum of squares."""
    return f"{name}.spread"


def moments(rows: Sequence[Row]) -> Sym:
    """Return b and B of a sum of squares, stacked: nt numbers, then B by its lower triangle."""
    numbers = isinstance(rows[0][2], np.ndarray)
    b: Sym = 0.0
    B: Sym = 0.0
    for weight, gap, A in rows:
        b = b + weight * (A.T @ gap)
        B = B + weight * (A.T @ A)
    if numbers:
        return np.concatenate([np.ravel(b), *[B[j:, j] for j in range(len(B))]])
    return ca.vertcat(b, *[B[j:, j] for j in range(B.shape[0])])


def mean_and_sigma(stacked: Sym, count: int, roots: Any) -> tuple[Sym, Sym]:
    """Return tr B and sigma from stacked moments of `count` parameters."""
    b, rest, trace, variance = stacked[:count], stacked[count:], 0.0, 0.0
    for j in range(count):
        trace = trace + rest[0]
        variance = variance + 4 * b[j] ** 2 + FOURTH * rest[0] ** 2
        for k in range(1, count - j):
            variance = variance + 4 * rest[k] ** 2
        rest = rest[count - j :]
    return trace, roots(variance)


def summed(nlp: Nlp, name: str, rows: Sequence[Row], factor: float, size: float) -> Sym:
    """Add the moments of a sum of squares as variables; return its robust value."""
    count = rows[0][2].shape[1]
    scale = np.full(count + count * (count + 1) // 2, size)
    scale[:count] = np.sqrt(size)
    spreads = nlp.variable(variables(name), len(scale), -np.inf, np.inf, scale)
    nlp.constrain(SPREAD, (moments(rows) - spreads) / scale)
    trace, sigma = mean_and_sigma(spreads, count, lambda v: ca.sqrt(v + TINY * size**2))
    nominal = sum((weight * ca.sumsqr(gap) for weight, gap, _ in rows), SX(0))
    return nominal + trace + factor * sigma


def deviation(A: Sym) -> Sym:
    """Return the (dimensionless) standard deviation of a residual from its deviations (m, nt)."""
    return ca.sqrt(ca.sumsqr(A) + TINY)


def of_squares(
    errors: Points, slopes: Matrices, weights: Floats, factor: float
) -> tuple[float, dict[str, float]]:
    """Return the robust value of a sum of squares, and what it is made of.

    `errors`, `slopes`, `weights`: residuals (k, m), their deviations (k, m, nt), weights (k,).
    """
    stacked = moments([(float(w), e, A) for w, e, A in zip(weights, errors, slopes, strict=True)])
    trace, sigma = mean_and_sigma(stacked, slopes.shape[2], np.sqrt)
    nominal = float(weights @ np.sum(errors**2, axis=1))
    value = float(nominal + trace + factor * sigma)
    return value, {
        "nominal": nominal, "mean": float(nominal + trace), "sigma": float(sigma), "value": value,
    }  # fmt: skip


def of_largest(
    sizes: Any, slopes: Matrices, factor: float, unit: float = 1.0
) -> tuple[float, dict[str, float]]:
    """Return the robust value of a largest error, and what it is made of.

    `sizes`, `slopes`: magnitudes (k,) of residuals and their deviations (k, m, nt).
    """
    sigmas = np.sqrt(np.sum(slopes**2, axis=(1, 2)))
    most = int(np.argmax(sizes + factor * sigmas))
    value = float(sizes[most] + factor * sigmas[most]) / unit
    return value, {
        "nominal": float(np.max(sizes)) / unit, "sigma": float(sigmas[most]) / unit,
        "value": value,
    }  # fmt: skip


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


def robust_goals(asked: Demand, poses: FreePoses, goals: Sequence[Goal]) -> Deviations | None:
    """Give goals the deviations by the tolerances of a task; None where none are asked for."""
    if asked.robust is None:
        return None
    found = Deviations(poses, asked.tolerances, asked.robust)
    counted = [goal for goal in goals if not goal.exact]
    for goal, (term, _) in zip(goals, asked.goals, strict=True):
        if not any(goal.deviates for goal in counted):
            raise UnavailableError(
                f"deviations of {counted[0].words} by tolerances are not computed",
                where="robust",
                hint="robust is for paths, motions, functions, straight lines and quantities at "
                "the poses of sweeps and reactions",
            )  # fmt: skip
        if goal.exact or not goal.deviates:
            continue
        starts = (term.input_start, term.output_start) if isinstance(term, FunctionTargets) else ()
        for name in starts:
            if name in asked.tolerances:
                raise InputError(
                    f"'{name}' is where a scale starts: it is set, it does not deviate",
                    where=f"tolerances.{name}",
                )
        goal.deviations = found
    robust = [goal for goal in goals if goal.deviations is not None]
    for name in found.unmoved:
        if any(goal.moved_by(name) for goal in robust):
            continue
        raise InputError(
            f"no goal depends on '{name}'", where=f"tolerances.{name}",
            hint="leave it out, or give the tolerance of what the goal depends on",
        )  # fmt: skip
    return found


def nominal_notes(goals: Sequence[Goal]) -> list[str]:
    """Return notes on goals of a robust task to which nothing is added."""
    return [
        f"{goal.words}: the value of the dimensions as they are named, without their tolerances"
        for goal in goals if not goal.exact and goal.deviations is None
    ]  # fmt: skip
