"""Screening: random dimensions that assemble over a whole turn, and many tracing points of each.

Of a tracing point in the frame of two points of a link many places are tried: their curves are sums
of two.
"""

from __future__ import annotations

import numpy as np

from mechdae.parts.types.schemes.drawing import amount_of, drawn, shares
from mechdae.parts.types.schemes.scheme import RIGID, Scheme
from mechdae.parts.types.schemes.shape import centred, fitted, resampled
from mechdae.types import Complexes, Floats

ANGLES, POINTS = 64, 64
PLACES = 24
"""Tracing points tried with each set."""
TURN = 2 * np.pi


def screened(
    scheme: Scheme, wanted: Complexes, count: int, seed: list[int], keep: int, limits: list[float]
) -> tuple[Complexes, Floats]:
    """Return the places (k, n) of the best sets, and their mean square distances (k,).

    `wanted` (`POINTS`,): the wanted curve, centred.
    """
    generator = np.random.default_rng(seed)
    angles = TURN * np.arange(ANGLES) / ANGLES
    x = drawn(scheme, count, angles, generator)
    kind, i, j = scheme.points[scheme.trace]
    rows = np.arange(count)
    if kind == RIGID:
        share = shares(generator, (count, PLACES))
        curves = x[i][:, None, :] + share[:, :, None] * (x[j] - x[i])[:, None, :]
    else:
        share = None
        curves = x[scheme.trace][:, None, :]
    flat = curves.reshape(-1, ANGLES)
    points = centred(resampled(flat, POINTS).points)
    straight, mirrored = (fitted(curve, wanted, scaled=True) for curve in (points, np.conj(points)))
    mirror = mirrored.residual < straight.residual
    residual = np.where(mirror, mirrored.residual, straight.residual).reshape(count, -1)
    factor = np.where(mirror, mirrored.factor, straight.factor).reshape(count, -1)
    places = x[:, :, 0].T.copy()
    found_places, found = [], []
    amounts = np.empty(residual.shape)
    for p in range(residual.shape[1]):
        if share is not None:
            places[:, scheme.trace] = x[i, :, 0] + share[:, p] * (x[j, :, 0] - x[i, :, 0])
        amounts[:, p] = amount_of(scheme, places, x) * np.abs(factor[:, p])
    for limit in limits:
        allowed = np.where(amounts <= limit, residual, np.inf)
        best = allowed.argmin(axis=1)
        value = allowed[rows, best]
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
