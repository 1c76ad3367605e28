"""The shape of a closed path against a closed curve, by the definition of the measure.

Both are resampled at equal arc length, centred, and divided by the wanted one's radius; of all
shifts in both senses, each with its best rotation, the least mean distance counts, times 2 pi.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.design.synthesis.verification.design_file import TURN

POINTS = 200


def shape_distance(curve: Any, wanted: Any) -> float:
    """Return how far a closed curve (t,) is from another one (k,) in shape and size."""
    traced, target = (_resampled(np.asarray(each, complex)) for each in (curve, wanted))
    traced, target = traced - traced.mean(), target - target.mean()
    radius = np.sqrt(np.mean(np.abs(target) ** 2))
    least = np.inf
    for way in (target, target[::-1]):
        for shift in range(POINTS):
            shifted = np.roll(way, shift)
            turn = np.vdot(traced, shifted)
            gaps = np.abs(traced * turn / max(abs(turn), 1e-300) - shifted)
            least = min(least, float(gaps.mean()))
    return TURN * least / float(radius)


def _resampled(corners: Any) -> Any:
    """Return points of a closed polyline at equal arc length, from its first corner on."""
    closed = np.append(corners, corners[0])
    length = np.append(0.0, np.cumsum(np.abs(np.diff(closed))))
    at = length[-1] * np.arange(POINTS) / POINTS
    return np.interp(at, length, closed)
