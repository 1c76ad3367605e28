"""A wedge on a floor that lifts a block along a wall, all faces rough: balance and motion.

Senses of motion and signs of the three normal forces are enumerated; each choice is linear.
"""

from __future__ import annotations

import itertools
from math import cos, sin, tan
from typing import Any

import numpy as np


def _equations(slope: float, mu: float, sense: int, signs: Any) -> Any:
    """Return what N floor, N face, N wall do in x and y of the wedge, then of the block (4, 3).

    The face is normal to (-sin, cos), friction on the block is along (cos, sin) there; `sense` is
    that of the wedge's speed along x.
    """
    floor, face, wall = (sense * mu * sign for sign in signs)
    n = np.array([-sin(slope), cos(slope)]) + face * np.array([cos(slope), sin(slope)])
    return np.array([[-floor, -n[0], 0.0], [1.0, -n[1], 0.0], [0.0, n[0], 1.0], [0.0, n[1], wall]])


def efforts(slope: float, mu: float, weight: float, sense: int) -> list[tuple[float, Any]]:
    """Return all pushes along x that keep the wedge moving slowly, with the normal forces."""
    found = []
    for signs in itertools.product((1, -1), repeat=3):
        A = np.column_stack([[1.0, 0.0, 0.0, 0.0], _equations(slope, mu, sense, signs)])
        if abs(np.linalg.det(A)) < 1e-12:
            continue
        push, *normals = np.linalg.solve(A, [0.0, 0.0, 0.0, weight])
        if (np.array(normals) * signs >= 0).all():
            found.append((float(push), np.array(normals)))
    return found


def starts(
    push: float, slope: float, mu: float, weight: float, masses: tuple[float, float], sense: int
) -> list[tuple[float, float, Any]]:
    """Return all x'' of the wedge, y'' of the block and normals with friction of a sense."""
    wedge, block = masses
    found = []
    for signs in itertools.product((1, -1), repeat=3):
        moved = [-wedge, 0.0, 0.0, block * tan(slope)]  # of x'', with y'' = -x'' tan(slope)
        A = np.column_stack([moved, _equations(slope, mu, sense, signs)])
        if abs(np.linalg.det(A)) < 1e-12:
            continue
        rate, *normals = np.linalg.solve(A, [-push, 0.0, 0.0, weight])
        if (np.array(normals) * signs >= 0).all():
            found.append((float(rate), float(-rate * tan(slope)), np.array(normals)))
    return found
