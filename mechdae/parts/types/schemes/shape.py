"""How far a traced curve is from a wanted one in shape and size.

Both curves are resampled to points at equal arc length, centred, and divided by the wanted one's
radius (root mean square of the distance from the centre). Cyclic shift, sense and rotation are the
best ones; the distance is 2 pi times the mean distance of points.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.records import dataclass
from mechdae.types import Booleans, Complexes, Floats, Integers

POINTS = 200
"""Of the measure itself; searches take fewer."""
TURN = 2 * np.pi


@dataclass
class Resampled:
    """Closed polylines at equal arc length.

    ``points`` (b, m) complex. ``segment``, ``share`` (b, m): in which segment each point lies, and
    where in it. ``steps``, ``lengths`` (b, t): of the segments.
    """

    points: Complexes
    segment: Integers
    share: Floats
    steps: Complexes
    lengths: Floats

    def derivatives(self, rates: Complexes) -> Any:
        """Return those of the points (b, m, p) from those of the corners (b, t, p)."""
        count = self.points.shape[1]
        following = np.roll(rates, -1, axis=1)
        way = np.conj(self.steps / self.lengths)[:, :, None]
        longer = (way * (following - rates)).real
        ends = np.cumsum(longer, axis=1)
        at = self.segment[:, :, None]
        before = np.take_along_axis(ends - longer, at, axis=1)
        longer = np.take_along_axis(longer, at, axis=1)
        wanted = (np.arange(count) / count)[None, :, None] * ends[:, -1:, :]
        length = np.take_along_axis(self.lengths, self.segment, axis=1)[:, :, None]
        step = np.take_along_axis(self.steps, self.segment, axis=1)[:, :, None]
        share = self.share[:, :, None]
        moved = (wanted - before - share * longer) / length
        one = np.take_along_axis(rates, at, axis=1)
        other = np.take_along_axis(following, at, axis=1)
        return one + share * (other - one) + step * moved


def resampled(curves: Complexes, count: int) -> Resampled:
    """Return closed curves (b, t) at equal arc length, beginning where they begin."""
    curves = np.asarray(curves, complex)
    steps = np.roll(curves, -1, axis=1) - curves
    lengths = np.maximum(np.abs(steps), 1e-300)
    ends = np.cumsum(lengths, axis=1)
    whole = ends[:, -1:]
    # one search for all: rows follow each other at distance 1
    rows = np.arange(len(curves))[:, None]
    flat = (ends / whole + rows).ravel()
    wanted = np.arange(count) / count + rows
    segment = np.searchsorted(flat, wanted.ravel(), side="right").reshape(wanted.shape)
    segment = np.clip(segment - rows * curves.shape[1], 0, curves.shape[1] - 1)
    length = np.take_along_axis(lengths, segment, axis=1)
    before = np.take_along_axis(ends, segment, axis=1) - length
    share = ((wanted - rows) * whole - before) / length
    points = np.take_along_axis(curves, segment, axis=1)
    points = points + share * np.take_along_axis(steps, segment, axis=1)
    return Resampled(points, segment, share, steps, lengths)


def centred(points: Complexes) -> Any:
    """Return curves with their mean at zero."""
    return points - points.mean(axis=-1, keepdims=True)


@dataclass
class Wanted:
    """The curve that is wanted, in its own place and size.

    `corners` (k,) complex: the closed polyline.
    """

    corners: Complexes

    def __post_init__(self) -> None:
        points = resampled(np.asarray(self.corners, complex)[None], POINTS).points[0]
        self.center: complex = complex(points.mean())
        self.radius: float = float(np.sqrt((np.abs(points - self.center) ** 2).mean()))

    def points(self, count: int) -> Any:
        """Return so many points at equal arc length, centred, of radius about 1."""
        even = resampled(np.asarray(self.corners, complex)[None], count).points[0]
        return (even - self.center) / self.radius


@dataclass
class Fit:
    """The best shift, sense, rotation and size of curves by least squares.

    ``shift``, ``backward`` (b,): point k of a curve meets point k + shift of the wanted one, which
    may run backward. ``factor`` (b,) complex: what the centred curve is multiplied with; of size 1
    where size is given. ``residual`` (b,): mean square of the distances.
    """

    shift: Integers
    backward: Booleans
    factor: Complexes
    residual: Floats

    def targets(self, wanted: Complexes) -> Any:
        """Return the points (b, m) of the wanted curve in the order of the curves' own."""
        count = len(wanted)
        ways = np.stack([wanted, backward_of(wanted)])
        at = (np.arange(count)[None, :] + self.shift[:, None]) % count
        return ways[self.backward.astype(int)[:, None], at]


def backward_of(wanted: Complexes) -> Complexes:
    """Return a curve from the same first point in the other sense."""
    return np.roll(wanted[..., ::-1], 1, axis=-1)


def fitted(curves: Complexes, wanted: Complexes, scaled: bool = False) -> Fit:
    """Return how centred curves (b, m) lie best on the wanted one (m,); through one FFT each."""
    count = wanted.shape[-1]
    transforms = np.fft.fft(curves, axis=1)
    ways = np.stack([wanted, backward_of(wanted)])
    other = np.fft.fft(ways, axis=1)
    # r[s] = sum conj(c[k]) w[k + s]
    found = np.fft.ifft(np.conj(transforms)[:, None, :] * other[None], axis=2)
    flat = np.abs(found).reshape(len(curves), -1)
    best = flat.argmax(axis=1)
    rows = np.arange(len(curves))
    best_r = found.reshape(len(curves), -1)[rows, best]
    size = (np.abs(curves) ** 2).sum(axis=1)
    whole = float((np.abs(wanted) ** 2).sum())
    with np.errstate(invalid="ignore", divide="ignore"):
        if scaled:
            factor = best_r / size
            residual = (whole - np.abs(best_r) ** 2 / size) / count
        else:
            factor = best_r / np.abs(best_r)
            residual = (whole + size - 2 * np.abs(best_r)) / count
    return Fit(best % count, best // count == 1, factor, np.nan_to_num(residual, nan=np.inf))


def distances(curves: Complexes, wanted: Wanted) -> Floats:
    """Return the measure (b,) of closed polylines (b, t) in units of the wanted curve's radius."""
    centered = centred(resampled(curves, POINTS).points)
    target = wanted.points(POINTS)
    target = target - target.mean()
    ways = np.stack([target, backward_of(target)])
    at = (np.arange(POINTS)[:, None] + np.arange(POINTS)[None, :]) % POINTS
    shifted = ways[:, at].reshape(-1, POINTS)
    found = np.empty(len(centered))
    for k, curve in enumerate(centered):
        turn = shifted @ np.conj(curve)
        turn = turn / np.maximum(np.abs(turn), 1e-300)
        near = np.argsort(-np.abs(shifted @ np.conj(curve)), kind="stable")[:NEAR]
        gaps = np.abs(curve[None, :] * turn[near, None] - shifted[near])
        found[k] = TURN * gaps.mean(axis=1).min()
    return found


NEAR = 24
"""Shifts, best by least squares, among which that of the least mean distance is looked for."""
