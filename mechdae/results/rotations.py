"""Rotation matrices of the unit quaternions by which results give orientations."""

from __future__ import annotations

import numpy as np

from mechdae.types import Floats, Matrices


def matrices(quaternions: Floats) -> Matrices:
    """Return the rotations (n, 3, 3) of unit quaternions (n, 4), real part first."""
    w, x, y, z = np.asarray(quaternions, float).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)
