"""Real roots of trigonometric polynomials, many at a time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mechdae.types import Floats

DROPPED = 1e-13
"""Leading coefficients below this share of the largest are rounding: the degree is lower."""


def angles_of_roots(g: Callable[[Any], Any], count: int, degree: int, near: float) -> Floats:
    """Return the angles t at which g vanishes, (count, 2*degree), `nan` where there are fewer.

    `g`: takes angles (count, m), returns values (count, m): polynomials in cos t, sin t. `count`,
    `degree`: how many of them there are, and the degree of each at most. `near`: roots w = exp(i t)
    of the polynomial in w are taken for real where |log |w|| < near: double ones lie off the circle
    by the root of the rounding.
    """
    samples = 4 * degree + 4
    t = 2 * np.pi * np.arange(samples) / samples
    values = np.fft.fft(g(np.broadcast_to(t, (count, samples))), axis=1) / samples
    order = np.arange(-degree, degree + 1)
    coefficients = values[:, order % samples]
    sizes = np.abs(coefficients)
    held = np.where(sizes > DROPPED * sizes.max(axis=1, keepdims=True), np.abs(order), 0)
    largest = held.max(axis=1)
    result = np.full((count, 2 * degree), np.nan)
    for d in range(1, degree + 1):
        rows = np.flatnonzero(largest == d)
        if not rows.size:
            continue
        part = coefficients[rows, degree - d : degree + d + 1]
        companion = np.zeros((rows.size, 2 * d, 2 * d), complex)
        companion[:, 1:, :-1] = np.eye(2 * d - 1)
        companion[:, :, -1] = -part[:, :-1] / part[:, -1:]
        w = np.linalg.eigvals(companion)
        # rounding may put a close pair off the circle, as w and 1/conj(w): its two sides are tried
        off = np.log(np.abs(w))
        angles = np.where(np.abs(off) < near, np.angle(w) + off, np.nan)
        result[np.ix_(rows, np.arange(2 * d))] = angles
    return result
