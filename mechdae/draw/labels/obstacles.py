"""What a box covers of a drawing: lines, areas, the border of the sheet.

Many boxes are asked about at once. Only the pairs of a box and a line that come near each
other are looked at; boxes of one neighbourhood share the search for them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechdae.types import Floats, Matrix

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

HALO = 4.0
"""More room that a label with segments of its own keeps to those of others,"""
STRANGER = 0.12
"""at this share of their weight."""
OUTSIDE = 1000.0
"""Cost of leaving the sheet."""
CELL = 20.0
"""Size of a neighbourhood."""


class Obstacles:
    """Lines and boxes of a drawing that labels should not cover.

    Parameters
    ----------
    segments, boxes
        What should stay visible: rows (x0, y0, x1, y1, weight).
    size
        Width and height of the sheet.
    """

    def __init__(self, segments: ArrayLike, boxes: ArrayLike, size: ArrayLike) -> None:
        self.lines: Matrix = np.asarray(segments, dtype=float).reshape(-1, 5)
        self.areas: Matrix = np.asarray(boxes, dtype=float).reshape(-1, 5)
        ends = self.lines[:, 0:2], self.lines[:, 2:4]
        self.middle, self.way = ((ends[0] + ends[1]) / 2).T, ((ends[1] - ends[0]) / 2).T
        self.floor, self.ceiling = np.minimum(*ends).T, np.maximum(*ends).T
        self.size: Floats = np.asarray(size, dtype=float)

    def cost(self, middle: Array, half: Array, shy: NDArray[np.bool_]) -> Array:
        """Return what each box costs, (boxes,), around `middle` and with sides of twice `half`.

        A shy one keeps a halo to lines.
        """
        count = len(middle)
        x, y, a, b = np.hstack([middle, half]).T.copy()
        room = np.where(shy, HALO, 0.0)
        k, s = _near(x, y, a + room, b + room, self.floor, self.ceiling)
        box = np.array([x[k], y[k], a[k], b[k]])
        line = np.array([self.middle[0][s], self.middle[1][s], self.way[0][s], self.way[1][s]])
        within = np.flatnonzero(crosses(line, box))
        inside = length_inside(line[:, within], box[:, within])
        i, weight = k[within], self.lines[s[within], 4]
        result = np.zeros(count)
        result += np.bincount(i, (1.0 + inside / (2 * (a + b)[i])) * weight, count)
        halo = np.flatnonzero(shy[k])
        line, box = line[:, halo], box[:, halo]
        box[2:4] += HALO
        close = halo[crosses(line, box)]
        result += np.bincount(k[close], STRANGER * self.lines[s[close], 4], count)
        k, s = _near(x, y, a, b, self.areas[:, 0:2].T, self.areas[:, 2:4].T)
        share = np.ones(len(k))
        for middles, halves, axis in ((x[k], a[k], 0), (y[k], b[k], 1)):
            low, high = self.areas[s, axis], self.areas[s, axis + 2]
            shared = np.minimum(middles + halves, high) - np.maximum(middles - halves, low)
            share *= np.maximum(shared, 0.0) / (2 * halves)
        result += np.bincount(k, (share > 0) * self.areas[s, 4] * (1.0 + 2.0 * share), count)
        out = np.zeros(count)
        for middles, halves, most in ((x, a, self.size[0]), (y, b, self.size[1])):
            out += np.maximum(halves - middles, 0.0) + np.maximum(middles + halves - most, 0.0)
        return result + OUTSIDE * (out > 0) + out


def crosses(line: Array, box: Array) -> NDArray[np.bool_]:
    """Return whether lines come into boxes.

    Parameters
    ----------
    line
        Middles x, y and halves of the way from end to end, (4, n).
    box
        Middles x, y and halves of the sides, (4, n).
    """
    x, y, dx, dy = line[0] - box[0], line[1] - box[1], np.abs(line[2]), np.abs(line[3])
    result: NDArray[np.bool_] = np.abs(x * line[3] - y * line[2]) < box[2] * dy + box[3] * dx
    result &= np.abs(x) < box[2] + dx
    result &= np.abs(y) < box[3] + dy
    return result


def length_inside(line: Array, box: Array) -> Array:
    """Return the length of each line in its box, both as in `crosses`."""
    enter, leave = -1.0, 1.0
    for axis in (0, 1):
        way = line[axis + 2]
        moving = np.abs(way) > 1e-12
        slope = np.where(moving, way, 1.0)
        middle = (box[axis] - line[axis]) / slope
        reach = np.where(moving, np.abs(box[axis + 2] / slope), np.inf)
        enter, leave = np.maximum(enter, middle - reach), np.minimum(leave, middle + reach)
    result: Array = np.maximum(leave - enter, 0.0) * np.hypot(line[2], line[3])
    result[~crosses(line, box)] = 0.0
    return result


def _near(
    x: Array, y: Array, a: Array, b: Array, floor: Array, ceiling: Array
) -> tuple[Indices, Indices]:
    """Return the pairs of a box and another one that meet: indices of both.

    The first boxes are given by middle and half sides, the others by corners, (2, n).
    """
    if not len(x) or not floor.shape[1]:
        return np.zeros(0, dtype=np.intp), np.zeros(0, dtype=np.intp)
    row, column = np.floor(x / CELL), np.floor(y / CELL)
    key = row * (np.ptp(column) + 1.0) + column
    order = np.argsort(key, kind="stable")
    key = key[order]
    starts = np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1]]))
    counts = np.diff(starts, append=len(order))
    near = np.ones((len(starts), floor.shape[1]), dtype=bool)
    sides = []
    for middle, half, least, most in ((x, a, floor[0], ceiling[0]), (y, b, floor[1], ceiling[1])):
        low, high = (middle - half)[order], (middle + half)[order]
        near &= least <= np.maximum.reduceat(high, starts)[:, None]
        near &= most >= np.minimum.reduceat(low, starts)[:, None]
        sides.append((low, high, least, most))
    group, s = np.nonzero(near)
    times = counts[group]
    first = np.repeat(starts[group] - (np.cumsum(times) - times), times)
    k, s = first + np.arange(len(first)), np.repeat(s, times)
    for low, high, least, most in sides:
        keep = np.flatnonzero((least[s] <= high[k]) & (most[s] >= low[k]))
        k, s = k[keep], s[keep]
    return order[k], s
