"""The yardstick: the closed-form four-bar in NumPy, two angles with two derivatives each.

Times of sweeps are quoted as ratios to this function, same number of poses, same run.
"""

from __future__ import annotations

import numpy as np

from mechdae.types import Floats

CRANK, COUPLER, ROCKER, GROUND = 0.048, 0.09, 0.08, 0.1


def yardstick(t2: Floats) -> tuple[Floats, ...]:
    """Return coupler and rocker angle, their first and second derivatives, each (n,)."""
    a, b, c, d = CRANK, COUPLER, ROCKER, GROUND
    ax, ay = a * np.cos(t2), a * np.sin(t2)
    dx, dy = d - ax, -ay
    e2 = dx * dx + dy * dy
    e = np.sqrt(e2)
    t3 = np.arctan2(dy, dx) + np.arccos((e2 + b * b - c * c) / (2 * b * e))
    t4 = np.arctan2(ay + b * np.sin(t3), ax + b * np.cos(t3) - d)
    s, k = np.sin(t4 - t3), np.cos(t4 - t3)
    v3, v4 = a * np.sin(t2 - t4) / (b * np.sin(t4 - t3)), a * np.sin(t2 - t3) / (c * s)
    a3 = (a * np.cos(t2 - t4) + b * v3 * v3 * k - c * v4 * v4) / (b * s)
    a4 = (a * np.cos(t2 - t3) + b * v3 * v3 - c * v4 * v4 * k) / (c * s)
    return t3, t4, v3, v4, a3, a4
