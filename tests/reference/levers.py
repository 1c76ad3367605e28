"""Chains of four-bars in closed form: the levers of `chain-of-four-bars`, in 80-bit floats."""

from __future__ import annotations

import numpy as np

LONG = np.longdouble


def levers(t, count: int, r, b, c, d, omega):
    """Return angle, speed and acceleration of each lever by circle intersections, 80 bits.

    Written for arrays of crank angles `t`; lever k has its arm C along +-axis in turn.
    """
    angle, speed, bend = t, np.full_like(t, omega), np.zeros_like(t)
    arm, found = r, []
    for k in range(1, count + 1):
        side = LONG(1 if k % 2 else -1)
        cos, sin = np.cos(angle), np.sin(angle)
        B = arm * np.stack([cos, sin])
        Bv = arm * speed * np.stack([-sin, cos])
        Ba = arm * (bend * np.stack([-sin, cos]) - speed**2 * np.stack([cos, sin]))
        gap = np.stack([d - B[0], -B[1]])
        e2 = np.sum(gap**2, axis=0)
        along = (b * b - c * c + e2) / (2 * e2)
        across = side * np.sqrt(b * b / e2 - along**2)
        C = B + along * gap + across * np.stack([-gap[1], gap[0]])
        coupler = C - B
        lever = C - np.stack([np.full_like(t, d), np.zeros_like(t)])
        # coupler . (C' - B') = 0 gives the lever's speed, its derivative the acceleration
        turn = np.stack([-lever[1], lever[0]])
        speed = np.sum(coupler * Bv, axis=0) / np.sum(coupler * turn, axis=0)
        slip = speed * turn - Bv
        push = np.sum(coupler * (Ba + speed**2 * lever), axis=0) - np.sum(slip**2, axis=0)
        bend = push / np.sum(coupler * turn, axis=0)
        angle = np.arctan2(side * lever[1], side * lever[0])
        arm = -side * c
        found.append((angle, speed, bend))
    return found
