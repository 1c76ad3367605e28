"""Lengths and areas of the paths of points of many lanes.

As of `mechdae.motion.measures.curve`: the rule of Gauss and Kronrod over parts of the way that
end where the point stands still, halved until its two orders agree.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mechdae.design.studies.batches.track import LaneTrack
from mechdae.motion.measures.curve import CLOSED, CUSP, STEPS
from mechdae.motion.measures.stationary_places import AT_REST
from mechdae.numerics.quadrature import GAUSS, KRONROD, NOISE, PLACES, SHRINKS, TOLERANCE
from mechdae.types import Floats, Integers

HALVINGS = 12
"""Of a part of the way; what is left then is solved alone."""


def curve_facts(track: LaneTrack, columns: Sequence[int]) -> dict[str, Floats]:
    """Return ``length`` [m], ``area`` [m^2] and ``closed`` (1 or 0) of a point's path (k,).

    The area is positive counter-clockwise in the sense of the poses, and nan where the path is not
    closed, or in space; all are nan where the point does not move.
    """
    every = np.arange(len(track.scale))
    moving = (track.travel(columns) > AT_REST * track.scale).any(axis=0)
    ends = [track.column(track.at(every, s), 0, columns) for s in (track.first, track.last)]
    total = _integrals(track, columns, _parts(track, columns, _stops(track, columns)), ends[0])
    length, area = (np.where(moving, sums, np.nan) for sums in total)
    with np.errstate(invalid="ignore"):
        closed = np.abs(ends[1] - ends[0]).max(axis=0) <= CLOSED * length
    area = np.where(closed & (len(columns) == 2), track.sense * area, np.nan)
    return {"length": length, "area": area, "closed": np.where(moving, closed, np.nan)}


def _stops(track: LaneTrack, columns: Sequence[int]) -> tuple[Integers, Floats]:
    """Return lanes and places at which the point stands still."""

    def family(y: list[Floats], lane: Integers) -> tuple[Floats, Floats]:
        """Half the rate of the squared speed, and its own rate."""
        v, a, j = (track.column(y, order, columns) for order in (1, 2, 3))
        return (v * a).sum(axis=0)[None], (a * a + v * j).sum(axis=0)[None]

    zeros = track.zeros(family)
    y = track.at(zeros.lane, zeros.s)
    speed, bend = (np.hypot.reduce(track.column(y, order, columns)) for order in (1, 2))
    unit = track.unit[zeros.lane]
    grain = np.maximum(CUSP, 8 * np.finfo(float).eps * np.abs(zeros.s) / unit)
    still = speed <= grain * unit * bend
    return zeros.lane[still], zeros.s[still]


def _parts(
    track: LaneTrack, columns: Sequence[int], stops: tuple[Integers, Floats]
) -> tuple[Any, ...]:
    """Return lanes, beginnings and ends of the parts that are integrated over at first."""
    width = track.last - track.first
    step = STEPS * track.step
    count = np.maximum(np.ceil(width / step), 1).astype(int)
    lane = np.repeat(np.arange(len(width)), count)
    share = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    s = track.first[lane] + width[lane] * share / count[lane]
    inside = (stops[1] > track.first[stops[0]]) & (stops[1] < track.last[stops[0]])
    lane, s = np.concatenate([lane, stops[0][inside]]), np.concatenate([s, stops[1][inside]])
    order = np.lexsort((s, lane))
    lane, a = lane[order], s[order]
    b = np.append(a[1:], 0.0)
    final = np.append(lane[1:] != lane[:-1], True)
    b[final] = track.last[lane[final]]
    return lane[b > a], a[b > a], b[b > a]


def _integrals(
    track: LaneTrack, columns: Sequence[int], parts: tuple[Floats, ...], start: Floats
) -> Floats:
    """Return lengths and areas (2, k)."""
    k = len(track.scale)
    lane, a, b = parts
    total, allowed, count = np.zeros((2, k)), None, np.bincount(lane, minlength=k)
    before: Any = np.inf
    for halving in range(HALVINGS + 1):
        places = a[:, None] + (b - a)[:, None] * PLACES
        owners = np.repeat(lane, len(PLACES))
        y = track.at(owners, places.ravel())
        x, v = track.column(y, 0, columns) - start[:, owners], track.column(y, 1, columns)
        values = np.stack([np.hypot.reduce(v), (x[0] * v[1] - x[1] * v[0]) / 2])
        values = values.reshape(2, len(lane), -1) * (b - a)[:, None]
        fine = values @ KRONROD
        gap = np.abs(fine - values @ GAUSS)
        if allowed is None:
            length = np.bincount(lane, fine[0], k)
            size = np.stack([length, length**2])
            allowed, noise = TOLERANCE * size / np.maximum(count, 1), NOISE * size
        rounding = (gap <= noise[:, lane]) & (gap > SHRINKS * before)
        again = ((gap > allowed[:, lane]) & ~rounding).any(axis=0)
        if halving == HALVINGS:
            track.good[lane[again]] = False
            again[:] = False
        for sums, part in zip(total, fine, strict=True):
            sums += np.bincount(lane[~again], part[~again], k)
        if not again.any():
            break
        middle = (a + b)[again] / 2
        lane = np.repeat(lane[again], 2)
        a, b = (np.stack(ends, axis=1).ravel() for ends in ((a[again], middle), (middle, b[again])))
        before = np.repeat(gap[:, again], 2, axis=1)
    return total
