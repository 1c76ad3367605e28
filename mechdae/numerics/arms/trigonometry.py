"""Real solutions of trigonometric equations in one angle, in arrays, and whether they are all."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mechdae.types import Booleans, Floats, Matrix, Numbers

CLEAR = 1e-9
"""Share of its largest value by which a discriminant must keep from 0."""
GRAIN = 1e-13
"""Rounding of a polynomial, as a share of its largest coefficient."""


def signed(cosine: Floats) -> tuple[Floats, Floats, Booleans]:
    """Return sines (2, ...) of both angles that have a cosine, that cosine, whether it is clear.

    nan where there is none; a cosine beyond 1 by no more than `CLEAR` counts as 1.
    """
    rest = (1 - cosine) * (1 + cosine)
    near = np.abs(rest) <= 2 * CLEAR
    sine = np.sqrt(np.where(near, np.maximum(rest, 0), rest))
    return np.stack([sine, -sine]), cosine, ~near


def turns(a: Floats, b: Floats, c: Floats, scale: Floats | float) -> tuple[Floats, Booleans]:
    """Return both angles (2, n) with a cos + b sin = c, and whether they are sure to be all.

    `scale` (n,): what a and b are to be compared with.
    """
    long = np.hypot(a, b)
    sine, cosine, clear = signed(c / long)
    middle = np.arctan2(b, a)
    return middle + np.arctan2(sine, np.clip(cosine, -1, 1)), clear & (long > CLEAR * scale)


def roots_of_two(f: Callable[[Floats], Numbers], count: int) -> tuple[Matrix, Booleans]:
    """Return the real roots (4, n) of trigonometric polynomials of degree 2, nan where there is
    none, and whether they are sure to be all.

    `f` gives values (m, n) at angles (m, 1) or (m, n). Roots in exp(i theta) come in pairs mirrored
    on the unit circle, so a disc that holds one root and meets the circle holds one on it (Smith
    1970).
    """
    samples = 10
    theta = 2 * np.pi * np.arange(samples) / samples
    spectrum = np.fft.fft(f(theta[:, None]), axis=0) / samples
    c = np.concatenate([spectrum[-2:], spectrum[:3]])[::-1].T
    noise = GRAIN * np.abs(c).max(axis=1)
    flat = ~(np.abs(c[:, 0]) > 1e3 * noise)
    lead = np.where(flat, 1, c[:, 0])
    companion = np.zeros((count, 4, 4), complex)
    companion[:, 1:, :3] = np.eye(3)
    companion[:, 0] = -np.where(flat[:, None], 0, c[:, 1:]) / lead[:, None]
    w = np.linalg.eigvals(companion)
    apart = np.abs(w[:, :, None] - w[:, None]) + np.eye(4)
    value, bound = np.zeros_like(w), np.zeros(w.shape)
    for k in range(5):
        value, bound = value * w + c[:, k, None], bound * np.abs(w) + 1
    radius = 4 * (np.abs(value) + noise[:, None] * bound) / (np.abs(lead)[:, None] * apart.prod(2))
    alone = (apart > radius[:, :, None] + radius[:, None]) | np.eye(4, dtype=bool)
    off = np.abs(np.abs(w) - 1)
    on, near = off <= radius, off <= np.maximum(radius, CLEAR)
    roots = np.where(near & ~flat[:, None], np.angle(w), np.nan).T
    step = 1e-6
    for _ in range(2):  # to the last bits
        slope = (f(roots + step) - f(roots - step)) / (2 * step)
        roots = roots - np.where(slope != 0, f(roots) / np.where(slope != 0, slope, 1), 0)
    return roots, alone.all(axis=(1, 2)) & (on == near).all(axis=1) & ~flat
