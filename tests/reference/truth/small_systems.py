"""Systems of one or three equations: determinants, Cramer's rule, Newton's method."""

from __future__ import annotations

import math

import numpy as np

from .series import LD


def determinant(J):
    if len(J) == 1:
        return J[0][0]
    (a, b, c), (d, e, f), (g, h, i) = J
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)


def cramer(J, r):
    """Return the solution of J x = r and the determinant, for numbers or arrays."""
    det = determinant(J)
    if len(J) == 1:
        return [r[0] / det], det
    (a, b, c), (d, e, f), (g, h, i) = J
    x = (r[0] * (e * i - f * h) - b * (r[1] * i - f * r[2]) + c * (r[1] * h - e * r[2])) / det
    y = (a * (r[1] * i - f * r[2]) - r[0] * (d * i - f * g) + c * (d * r[2] - r[1] * g)) / det
    z = (a * (e * r[2] - r[1] * h) - b * (d * r[2] - r[1] * g) + r[0] * (d * h - e * g)) / det
    return [x, y, z], det


def relative(J, det, scales, norm=None):
    """Return the determinant over `norm` or the product of the rows' lengths: a plain number."""
    if norm is not None:
        return det / norm
    size = 1.0
    for row in J:
        square = sum((v * s) ** 2 for v, s in zip(row, scales, strict=True))
        size = size * (math.sqrt(square) if isinstance(square, float) else np.sqrt(square))
    for s in scales:
        det = det * s
    return det / size


def solve(system, x, length, rounds):
    """Newton's method over arrays x (size, n); return x and where it converged."""
    scales = system.root_scales(length)
    x = np.array(x)
    moved = None
    for _ in range(rounds):
        r, J = system.values(x)
        step, _ = cramer(J, r)
        step = np.array(step)
        x = x - step
        moved = np.max([np.abs(s) / scale for s, scale in zip(step, scales, strict=True)], axis=0)
    tolerance = 1e-11 if x.dtype == LD else 1e-7
    return x, moved < tolerance
