"""How much more friction a mechanism bears before it jams: the critical factor."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.forces.inverse_dynamics import Motion, Statics, some

POSES = 2
"""Poses at which the critical factor is looked for: those where friction feeds itself most."""
MOST = 1000.0
"""Factors above are not looked for."""


def critical_factor(
    statics: Statics, motion: Motion, inputs: list[Any], sizes: Any, rows: Any, lead: int
) -> dict[str, Any]:
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
        found below `MOST`, nor while meshes lose less than all power.
    """
    worst: dict[str, Any] = {"factor": None, "at": None, "joint": None}
    if not len(rows):
        return worst
    feeds = statics.feeding(some(inputs, rows), sizes[rows])
    most = min(MOST, statics.most)
    for k in np.asarray(rows)[np.argsort(-feeds, kind="stable")[:POSES]]:
        factor, joint = statics.branches.limit(some(inputs, slice(k, k + 1)), most)
        if factor is not None and (worst["factor"] is None or factor < worst["factor"]):
            worst = {"factor": factor, "at": float(motion.u[k, lead]), "joint": joint}
    return worst
