"""Screening: random dimensions that assemble over a whole turn, and many tracing points of each.

Points are drawn one after the other. Bars of a dyad are drawn such that they reach from the
least to the largest distance of the points that they hang on: each set assembles. Of a tracing
point in the frame of two points of a link many places are tried: their curves are sums of two.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.schemes.closure import material
from mechdae.schemes.scheme import CRANK, DYAD, FIXED, RIGID, Scheme
from mechdae.schemes.shape import centred, fitted, resampled

ANGLES, POINTS = 64, 64
PLACES = 24
"""Tracing points tried with each set."""
MARGIN = 0.12
"""By how much bars reach further than they must, at least."""
TURN = 2 * np.pi


def screened(
    scheme: Scheme, wanted: Any, count: int, seed: list[int], keep: int, limits: list[float]
) -> tuple[Any, Any]:
    """Return the places (k, n) of the best sets, and their mean square distances (k,).

    Parameters
    ----------
    wanted
        (`POINTS`,) the wanted curve, centred.
    count
        Sets that are drawn.
    keep
        Sets returned for each limit of material.
    """
    generator = np.random.default_rng(seed)
    angles = TURN * np.arange(ANGLES) / ANGLES
    x = _drawn(scheme, count, angles, generator)
    kind, i, j = scheme.points[scheme.trace]
    rows = np.arange(count)
    if kind == RIGID:
        share = _shares(generator, (count, PLACES))
        curves = x[i][:, None, :] + share[:, :, None] * (x[j] - x[i])[:, None, :]
    else:
        share = None
        curves = x[scheme.trace][:, None, :]
    flat = curves.reshape(-1, ANGLES)
    points = centred(resampled(flat, POINTS).points)
    straight, mirrored = (fitted(own, wanted, scaled=True) for own in (points, np.conj(points)))
    mirror = mirrored.residual < straight.residual
    residual = np.where(mirror, mirrored.residual, straight.residual).reshape(count, -1)
    factor = np.where(mirror, mirrored.factor, straight.factor).reshape(count, -1)
    places = x[:, :, 0].T.copy()
    found_places, found = [], []
    amounts = np.empty(residual.shape)
    for p in range(residual.shape[1]):
        if share is not None:
            places[:, scheme.trace] = x[i, :, 0] + share[:, p] * (x[j, :, 0] - x[i, :, 0])
        amounts[:, p] = material(scheme, places) * np.abs(factor[:, p])
    for limit in limits:
        own = np.where(amounts <= limit, residual, np.inf)
        best = own.argmin(axis=1)
        value = own[rows, best]
        order = np.argsort(value, kind="stable")[:keep]
        for k in order[np.isfinite(value[order])].tolist():
            p = best[k]
            whole = x[:, k, 0].copy()
            if share is not None:
                whole[scheme.trace] = x[i, k, 0] + share[k, p] * (x[j, k, 0] - x[i, k, 0])
            if mirror.reshape(count, -1)[k, p]:
                whole = np.conj(whole)
            found_places.append(factor[k, p] * (whole - whole[0]))
            found.append(value[k])
    if not found:
        return np.zeros((0, scheme.size), complex), np.zeros(0)
    return np.array(found_places), np.array(found)


def _drawn(scheme: Scheme, count: int, angles: Any, generator: Any) -> Any:
    """Return the places (n, count, t) of all points over a turn; the crank has length 1."""
    x = np.empty((scheme.size, count, len(angles)), complex)
    for k, (kind, i, j) in enumerate(scheme.points):
        if kind == FIXED:
            far = 0.0 if k == 0 else _far(generator, count)
            x[k] = np.broadcast_to(np.asarray(far).reshape(-1, 1), x[k].shape)
        elif kind == CRANK:
            x[k] = np.exp(1j * angles)
        elif kind == RIGID:
            share = 0.0 if k == scheme.trace else _shares(generator, (count, 1))
            x[k] = x[i] + share * (x[j] - x[i])
        elif kind == DYAD:
            first, second, side = reaching(x[i], x[j], generator)
            gap = x[j] - x[i]
            far = np.abs(gap) ** 2
            along = (first**2 - second**2 + far) / (2 * far)
            across = np.sqrt(np.maximum(first**2 / far - along**2, 0.0))
            x[k] = x[i] + gap * (along + 1j * side * across)
    return x


def reaching(one: Any, other: Any, generator: Any, margin: float = MARGIN) -> tuple[Any, Any, Any]:
    """Return lengths of two bars (b, 1) between moving points that always meet, and a side."""
    far = np.abs(other - one)
    low, high = far.min(axis=1, keepdims=True), far.max(axis=1, keepdims=True)
    count = len(low)
    least = high * (1 + margin)
    whole = least + high * generator.exponential(0.5, (count, 1))
    most = (1 - margin) * low
    difference = most * generator.uniform(-1, 1, (count, 1))
    side = generator.choice([-1.0, 1.0], (count, 1))
    return (whole + difference) / 2, (whole - difference) / 2, side


def _far(generator: Any, count: int) -> Any:
    size = np.exp(generator.normal(0.8, 0.6, count))
    return size * np.exp(1j * generator.uniform(0, TURN, count))


def _shares(generator: Any, shape: tuple[int, ...]) -> Any:
    return 0.5 + generator.normal(0, 0.9, shape) + 1j * generator.normal(0, 0.9, shape)
