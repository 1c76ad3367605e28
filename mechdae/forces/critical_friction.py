"""How much more friction a mechanism bears before it jams: the critical factor."""

from __future__ import annotations

import numpy as np

from mechdae.forces.friction_branches import some
from mechdae.forces.inverse_dynamics import InverseDynamics, LoadedPoses
from mechdae.types import Floats, Integers, Json

POSES = 2
"""Poses at which the critical factor is looked for: those where friction feeds itself most."""
MOST = 1000.0
"""Factors above are not looked for."""


def critical_factor(
    statics: InverseDynamics,
    motion: LoadedPoses,
    inputs: list[Floats],
    sizes: Floats,
    rows: Integers,
    lead: int,
) -> Json:
    """Return the least factor on all coefficients of friction at which a pose jams.

    Parameters
    ----------
    sizes
        Those of friction at all poses.
    rows
        Poses that have one solution.
    lead
        The driver whose value tells the pose.

    Returns
    -------
    dict
        ``factor``, ``at`` and ``joint``, at the poses of the task; ``factor`` None where none is
        found up to the factor ``up_to``: `MOST`, that with which meshes lose all power, or as far
        as the search came.
    """
    worst: Json = {"factor": None, "at": None, "joint": None, "up_to": None}
    if not len(rows):
        return worst
    feeds = _feeding(statics, some(inputs, rows), sizes[rows])
    most = min(MOST, _all_power(statics))
    chosen = np.asarray(rows)[np.argsort(-feeds, kind="stable")[:POSES]]
    limits = statics.branches.limits(some(inputs, chosen), most)
    for k, (factor, joint, _) in zip(chosen, limits, strict=True):
        if factor is not None and (worst["factor"] is None or factor < worst["factor"]):
            worst |= {"factor": factor, "at": float(motion.u[k, lead]), "joint": joint}
    if worst["factor"] is None:
        worst["up_to"] = min(far for _, _, far in limits)
    return worst


def _feeding(statics: InverseDynamics, inputs: list[Floats], sizes: Floats) -> Floats:
    """Return how much friction feeds itself at poses, (n,): at 1 it jams.

    It is the largest real eigenvalue of d size / d m; a feedback that reduces itself is
    negative, however strong.
    """
    found = np.full(len(sizes), -np.inf)
    for stage in statics.staged(inputs, sizes):
        slopes = stage.slopes(np.nan_to_num(sizes))
        slopes[~np.isfinite(slopes).all(axis=(1, 2))] = 0.0
        values = np.linalg.eigvals(slopes)
        real = np.abs(values.imag) <= 1e-9 * np.abs(values)
        found = np.fmax(found, np.where(real, values.real, -np.inf).max(axis=1))
    return found


def _all_power(statics: InverseDynamics) -> float:
    """Return the factor on friction at which a mesh would lose all of its power."""
    values = statics.scene.model.mechanism.values()
    losses = [values.get(f"{name}.mesh_loss", 0.0) for name in statics.balance.joints]
    largest = max(losses, default=0.0)
    return (1 + 1e-9) / largest if largest > 0 else np.inf
