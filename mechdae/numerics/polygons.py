"""Distances of segments and of convex polygons, in many poses at once."""

from __future__ import annotations

import numpy as np

from mechdae.types import Booleans, Floats, Points


def polygon_gaps(a: Points, b: Points) -> Floats:
    """Return the distance of convex polygons (n, i, 2) and (n, j, 2), 0 where they meet."""
    found = np.full(len(a), np.inf)
    for p, q in _sides(a):
        for r, s in _sides(b):
            found = np.minimum(found, segment_gaps(p, q, r, s))
    for polygon, point in ((a, b[:, 0]), (b, a[:, 0])):
        if polygon.shape[1] > 2:
            found = np.where(_inside(polygon, point), 0.0, found)
    return found


def _sides(polygon: Points) -> list[tuple[Points, Points]]:
    count = polygon.shape[1]
    if count < 3:
        return [(polygon[:, 0], polygon[:, count - 1])]
    return [(polygon[:, k], polygon[:, (k + 1) % count]) for k in range(count)]


def segment_gaps(p: Points, q: Points, r: Points, s: Points) -> Floats:
    """Return the distances (n,) of segments p-q and r-s, (n, 2) each."""
    ends = [_off(p, r, s), _off(q, r, s), _off(r, p, q), _off(s, p, q)]
    cross = (_turn(p, q, r) * _turn(p, q, s) < 0) & (_turn(r, s, p) * _turn(r, s, q) < 0)
    return np.where(cross, 0.0, np.min(ends, axis=0))


def _off(point: Points, start: Points, end: Points) -> Floats:
    way, to = end - start, point - start
    size = np.einsum("ij,ij->i", way, way)
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(size > 0, np.einsum("ij,ij->i", to, way) / size, 0.0)
    off = to - np.clip(share, 0, 1)[:, None] * way
    found: Floats = np.hypot(off[:, 0], off[:, 1])
    return found


def _turn(a: Points, b: Points, c: Points) -> Floats:
    found: Floats = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    return found


def _inside(polygon: Points, point: Points) -> Booleans:
    turns = [_turn(p, q, point) >= 0 for p, q in _sides(polygon)]
    found: Booleans = np.all(turns, axis=0)
    return found
