"""What covers what: lines, faces and solids of a picture in the order in which they are drawn.

Places are (x, y, depth) in units of the sheet, depth towards the eye. Of two items the one that is
nearer where both are seen is drawn later; the rest goes from far to near.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Sequence
from dataclasses import field
from typing import Any

import numpy as np

from mechdae.draw import style
from mechdae.draw.diagram.shapes import within
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import Sheet, unit
from mechdae.records import dataclass

NEARER = 0.5
"""Depths that differ by less are those of one place,"""
BEHIND = 5.0
"""and lines that cross farther apart than this leave a gap in the one behind,"""
GAP = 3.2
"""so wide on either side of the line in front."""
STEP = 3.0
"""Lines are compared with faces at places so far apart."""
FIRST, LAST = float(style.Z_BAR), float(style.Z_PIN) + 0.8


@dataclass
class Facet:
    """A polygon or a line of an item, flat on the sheet: points (m, 2)."""

    points: Array
    closed: bool = True
    fill: str = style.PAPER
    edge: str = style.INK
    width: float = style.LINE
    dash: Any = None
    strokes: bool = False
    """Separate lines from every other point to the one after it."""


@dataclass
class Item:
    """A line (m, 3), a plane face (m, 3), or a solid.

    A solid is drawn by its `facets`, from the first to the last; its `points` are its silhouette
    and the depth of its middle.
    """

    points: Array
    closed: bool = False
    solid: bool = False
    facets: list[Facet] = field(default_factory=list)
    gid: str | None = None
    color: str = style.INK
    fill: str = style.FILL
    width: float = style.BAR
    dash: Any = None
    bridges: bool = True
    """Whether it leaves a gap in lines behind it."""
    weight: float = style.SOLID
    owner: str = ""
    """Of one owner faces are behind lines and solids."""

    @property
    def is_face(self) -> bool:
        return self.closed and not self.solid

    @property
    def depth(self) -> float:
        return float(self.points[:, 2].mean())

    @property
    def low(self) -> Array:
        low: Array = self.points[:, :2].min(axis=0)
        return low

    @property
    def high(self) -> Array:
        high: Array = self.points[:, :2].max(axis=0)
        return high


def depth_order(items: Sequence[Item]) -> list[int]:
    """Return the indices of items in the order in which they are drawn."""
    after: list[list[int]] = [[] for _ in items]
    waits = [0] * len(items)
    boxes = np.array([(*item.low, *item.high) for item in items]).reshape(-1, 4)
    for i, a in enumerate(items):
        meets = (boxes[i, :2] <= boxes[i + 1 :, 2:]).all(axis=1)
        meets &= (boxes[i, 2:] >= boxes[i + 1 :, :2]).all(axis=1)
        for j in (np.flatnonzero(meets) + i + 1).tolist():
            lead = nearer(a, items[j])
            if lead:
                far, near = (j, i) if lead > 0 else (i, j)
                after[far].append(near)
                waits[near] += 1
    ready = [(item.depth, k) for k, item in enumerate(items) if not waits[k]]
    heapq.heapify(ready)
    left, order = set(range(len(items))), list[int]()
    while left:
        if not ready:  # they cover each other in a ring: the farthest one first
            k = min(left, key=lambda k: (items[k].depth, k))
            waits[k] = 0
            ready = [(items[k].depth, k)]
        _, k = heapq.heappop(ready)
        if k not in left:
            continue
        left.remove(k)
        order.append(k)
        for near in after[k]:
            waits[near] -= 1
            if not waits[near] and near in left:
                heapq.heappush(ready, (items[near].depth, near))
    return order


def nearer(a: Item, b: Item) -> int:
    """Return 1 where a covers b, -1 where b covers a, 0 where neither does."""
    if a.owner and a.owner == b.owner and a.is_face != b.is_face:
        return 1 if b.is_face else -1
    if not a.closed and not b.closed:
        differences = crossings(a.points, b.points)[:, 2]
    else:
        places = _shared(a, b)
        if not len(places):
            return 0
        differences = depths(a, places) - depths(b, places)
    if not len(differences) or float(np.abs(differences).max()) < NEARER:
        return 0
    return int(np.sign(differences.mean()))


def crossings(a: Array, b: Array) -> Array:
    """Return where two lines cross on the sheet: x, y and the depth of a less that of b, (k, 3)."""
    p, r = a[:-1, None], (a[1:] - a[:-1])[:, None]
    q, s = b[None, :-1], (b[1:] - b[:-1])[None]
    cross = r[..., 0] * s[..., 1] - r[..., 1] * s[..., 0]
    way = q - p
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (way[..., 0] * s[..., 1] - way[..., 1] * s[..., 0]) / cross
        u = (way[..., 0] * r[..., 1] - way[..., 1] * r[..., 0]) / cross
        met = (t >= 0) & (t <= 1) & (u >= 0) & (u <= 1)
    i, j = np.nonzero(met & (np.abs(cross) > 1e-9))
    first = a[i] + t[i, j][:, None] * (a[i + 1] - a[i])
    second = b[j] + u[i, j][:, None] * (b[j + 1] - b[j])
    found: Array = np.column_stack([first[:, :2], first[:, 2] - second[:, 2]])
    return found


def _shared(a: Item, b: Item) -> Array:
    """Return places on the sheet where both items are seen, one of them being a face or a solid."""
    if not a.closed:
        return _along(a, b)
    if not b.closed:
        return _along(b, a)
    first, second = a.points[:, :2], b.points[:, :2]
    rings = [np.vstack([own, own[:1]]) for own in (a.points, b.points)]
    both = [first[within(first, second)], second[within(second, first)]]
    return np.vstack([*both, crossings(rings[0], rings[1])[:, :2]])


def _along(line: Item, face: Item) -> Array:
    places: Array = dense(line.points)[:, :2]
    inside: Array = places[within(places, face.points[:, :2])]
    return inside


def dense(points: Array, step: float = STEP) -> Array:
    """Return a line with more points, at most `step` apart on the sheet."""
    found = [points[:1]]
    for a, b in itertools.pairwise(points):
        count = max(int(np.ceil(np.hypot(*(b - a)[:2]) / step)), 1)
        found.append(a + (np.arange(1, count + 1) / count)[:, None] * (b - a))
    return np.vstack(found)


def depths(item: Item, places: Array) -> Array:
    """Return the depth of an item at places (k, 2) where it is seen, (k,)."""
    if item.solid:
        return np.full(len(places), item.depth)
    if not item.closed:
        line = dense(item.points)
        apart = ((places[:, None] - line[None, :, :2]) ** 2).sum(axis=-1)
        near: Array = line[np.argmin(apart, axis=1), 2]
        return near
    middle = item.points.mean(axis=0)
    away = item.points - middle
    normal = np.cross(away, np.roll(away, -1, axis=0)).sum(axis=0)
    if abs(normal[2]) < 1e-3 * float(np.linalg.norm(normal)):
        return np.full(len(places), item.depth)
    plane: Array = middle[2] - ((places - middle[:2]) @ normal[:2]) / normal[2]
    return plane


def draw_items(sheet: Sheet, items: Sequence[Item]) -> None:
    """Draw items, near ones over far ones, with gaps where a line passes behind another."""
    order = depth_order(items)
    step = (LAST - FIRST) / (len(items) + 1)
    for rank, k in enumerate(order):
        item, z = items[k], FIRST + rank * step
        if item.bridges and not item.closed:
            for gap in gaps(item, [items[j] for j in order[:rank]]):
                width = item.width + 2 * GAP
                sheet.line(gap, color=style.PAPER, width=width, z=z - step / 2, weight=0.0)
        _draw(sheet, item, z)


def gaps(item: Item, behind: Sequence[Item]) -> list[Array]:
    """Return the stretches (2, 2) of a line that need a gap in a line behind."""
    found = []
    for other in behind:
        if other.closed or not other.bridges:
            continue
        for x, y, ahead in crossings(item.points, other.points).tolist():
            if ahead < BEHIND or _near_end(item, other, np.array([x, y])):
                continue
            along = _direction(item.points, np.array([x, y]))
            half = 0.5 * other.width + 2.0
            found.append(np.array([(x, y), (x, y)]) + np.array([[-half], [half]]) * along)
    return found


def _near_end(item: Item, other: Item, place: Array) -> bool:
    ends = np.vstack([item.points[[0, -1], :2], other.points[[0, -1], :2]])
    return bool((np.hypot(*(ends - place).T) < 2 * GAP).any())


def _direction(points: Array, place: Array) -> Array:
    """Return the direction of a line at a place of it."""
    a, b = points[:-1, :2], points[1:, :2]
    off = np.hypot(*(a - place).T) + np.hypot(*(b - place).T) - np.hypot(*(b - a).T)
    k = int(np.argmin(off))
    return unit(b[k] - a[k])


def _draw(sheet: Sheet, item: Item, z: float) -> None:
    flat = item.points[:, :2]
    if item.facets:
        for facet in item.facets:
            _draw_facet(sheet, facet, z, item.gid)
        sheet.box(item.low, item.high, item.weight)
    elif item.closed:
        sheet.area(
            flat, fill=item.fill, edge=item.color, width=item.width, z=z, gid=item.gid,
            weight=item.weight,
        )  # fmt: skip
    else:
        sheet.line(
            flat, color=item.color, width=item.width, z=z, dash=item.dash, gid=item.gid,
            weight=item.weight,
        )  # fmt: skip


def _draw_facet(sheet: Sheet, facet: Facet, z: float, gid: str | None) -> None:
    if facet.strokes:
        sheet.strokes(
            facet.points[::2], facet.points[1::2], color=facet.edge, width=facet.width, z=z, gid=gid
        )
    elif facet.closed:
        sheet.area(
            facet.points, fill=facet.fill, edge=facet.edge, width=facet.width, z=z, gid=gid,
            weight=0.0,
        )  # fmt: skip
    else:
        sheet.line(
            facet.points, color=facet.edge, width=facet.width, dash=facet.dash, z=z, gid=gid,
            weight=0.0,
        )  # fmt: skip
