"""The assembly mode nearest to a sketch, by Newton's method from many starts at once.

Owes nothing to the package: planar mechanisms are closed by `planar_closure` in absolute
coordinates, spatial ones by residuals over places and rotations of all bodies. The distance is that
of the documentation: angles without whole turns in radians, lengths over the largest extent.
"""

from __future__ import annotations

import numpy as np

from tests.reference.planar_closure import Closure

SMALL = 1e-9
"""Left-over at which a pose closes."""
ROUNDS = 40
SHORT = 0.7
"""Largest step of a start, in radians and sizes."""


def planar_modes(closure: Closure, u: float, near, rng, starts: int):
    """Return closed poses (k, 3 bodies), each once but for whole turns, from starts about `near`.

    ``near`` (3 bodies,) is a rough pose; half of the starts are drawn near it.
    """
    count = len(closure.bodies)
    sizes = np.tile([closure.scale, closure.scale, 1.0], count)
    q = np.repeat(np.asarray(near, float)[None], starts, 0)
    wide = np.where(np.arange(starts) % 2, np.pi, 0.6)[:, None]
    wide[0] = 0.0
    q += wide * rng.uniform(-1, 1, q.shape) * sizes
    values = np.full(starts, u)
    for _ in range(ROUNDS):
        residual, slopes, _ = closure.rows(q, values)
        scaled = slopes.astype(float) * sizes
        step = np.stack([
            np.linalg.lstsq(J, -F, rcond=1e-10)[0] if np.isfinite(J).all() else np.zeros(len(sizes))
            for J, F in zip(scaled, residual.astype(float), strict=True)
        ])  # fmt: skip
        long = np.abs(step).max(1, keepdims=True)
        q = q + step * sizes * np.minimum(1.0, SHORT / np.maximum(long, 1e-300))
    left = np.abs(closure.rows(q, values)[0].astype(float)).max(1)
    found = []
    for pose in q[left < SMALL]:
        if not any(_same(pose, other, sizes) for other in found):
            found.append(pose)
    return found


def _same(one, other, sizes):
    gap = (one - other) / sizes
    gap[2::3] = np.remainder(gap[2::3] + np.pi, 2 * np.pi) - np.pi
    return np.abs(gap).max() < 1e-6


def disc_and_guide(radius: float, centre, across: float):
    """Return both places along a straight guide, at `across` from the turning point, of a point at
    a distance `radius` from a centre (x, y): the guide is upright.
    """
    under = radius**2 - (across - centre[0]) ** 2
    return [] if under <= 0 else [centre[1] + sign * np.sqrt(under) for sign in (1.0, -1.0)]
