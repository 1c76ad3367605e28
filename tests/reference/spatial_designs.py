"""Spatial linkages in closed form, for designs: RSSR, RSSP, a double wishbone; NumPy alone.

Crank: B = A + r (cos u, sin u, 0) about the z axis through A. The other end C of the bar lies on a
circle (rocker) or a line (slider): |C - B|^2 = bar^2 is P cos v + Q sin v = S, or a quadratic.
"""

from __future__ import annotations

import numpy as np


def crank(r, u, start=(0.0, 0.0, 0.0)):
    """Return the crank's ball joint (n, 3) at angles (n,)."""
    u = np.asarray(u, float)
    return np.asarray(start, float) + r * np.stack([np.cos(u), np.sin(u), 0 * u], axis=1)


def rocker(B, bar, R, pivot, axis, normal, along, mode):
    """Return angles (n,) and ball joints (n, 3) of a rocker; nan where the bar does not reach.

    The rocker's ball joint is R from the axis, `along` it from the pivot; its angle is counted from
    the normal about the axis. Mode 1 or -1: either side of the bar.
    """
    a, n, pivot = (np.asarray(v, float) for v in (axis, normal, pivot))
    a = a / np.linalg.norm(a)
    n = n - (n @ a) * a
    n = n / np.linalg.norm(n)
    m = np.cross(a, n)
    d = pivot + along * a - B
    P, Q = 2 * R * d @ n, 2 * R * d @ m
    S = bar * bar - R * R - (d * d).sum(axis=1)
    with np.errstate(invalid="ignore"):
        v = np.arctan2(Q, P) + mode * np.arccos(S / np.hypot(P, Q))
    C = pivot + along * a + R * (np.cos(v)[:, None] * n + np.sin(v)[:, None] * m)
    return v, C


def slider(B, bar, start, direction, mode):
    """Return slides (n,) along a unit direction and ball joints (n, 3); nan: out of reach."""
    w, start = np.asarray(direction, float), np.asarray(start, float)
    gap = start - B
    half = gap @ w
    with np.errstate(invalid="ignore"):
        s = -half + mode * np.sqrt(half**2 - (gap * gap).sum(axis=1) + bar * bar)
    return s, start + s[:, None] * w


def turned(axis, angle):
    """Return the rotation (3, 3) about an axis (Rodrigues)."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def of_quaternion(e):
    """Return the rotation (3, 3) of a quaternion (4,), real part first, of any length."""
    w, v = e[0], np.asarray(e[1:])
    K = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    square = e @ e
    return ((w * w - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * K) / square


def knuckle(lower_ball, data, start):
    """Return place and quaternion (7,) of a wheel carrier held by two wishbones and a tie rod.

    Newton's method with differences, from a start; `data` holds its points in its frame by name
    (lower, upper, steer), the upper wishbone's pivot, axis and way to its ball joint, the rod's
    inner ball joint and length. The unknowns are place, quaternion and the wishbone's angle.
    """

    def rest(x):
        R = of_quaternion(x[3:7])
        upper = data["pivot"] + turned(data["axis"], x[7]) @ data["arm"]
        rod = x[:3] + R @ data["steer"] - data["inner"]
        return np.concatenate(
            [
                x[:3] + R @ data["lower"] - lower_ball,
                x[:3] + R @ data["upper"] - upper,
                [rod @ rod - data["length"] ** 2, x[3:7] @ x[3:7] - 1],
            ]
        )

    x = np.array(start, float)
    for _ in range(50):
        F = rest(x)
        J = np.stack([(rest(x + h) - rest(x - h)) / 2e-6 for h in 1e-6 * np.eye(8)], axis=1)
        step = np.linalg.solve(J, F)
        x -= step
        if np.abs(step).max() < 1e-14:
            break
    assert np.abs(rest(x)).max() < 1e-13
    return x
