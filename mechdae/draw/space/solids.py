"""Solids that symbols in space are made of, and what covers what: the order of drawing.

Places and directions are (right, up, towards the eye) in units of the sheet. Solids are told by
their circles, faces and lines in space: from another side the same facets show what is seen there.
Of two items the one that is nearer where both are seen is drawn later, the rest from far to near.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Sequence
from dataclasses import field
from typing import Any

import numpy as np

from mechdae.draw import style
from mechdae.draw.diagram.places import hull, within
from mechdae.draw.primitives import PAPER, Anchor, Array
from mechdae.draw.sheet import Sheet, normal, unit
from mechdae.records import dataclass

EYE = "eye"
"""What does not turn with anything: symbols that look the same from everywhere."""
EDGE = 1.2 * style.LINE
SHADED = style.FILL
POLE = 10.0
"""How far the place that tells the axis of a circle is from its middle."""
WIDE = 6.0
"""Half width of the plate of a bearing."""
SQUARE = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=float)
UPRIGHT = 0.35
"""Of an axis with less than this share across the vertical the stand is beside it."""


def across(axis: Array) -> tuple[Array, Array]:
    """Return two unit vectors normal to an axis and to each other."""
    k = int(np.argmin(np.abs(axis)))
    first = np.cross(axis, np.eye(3)[k])
    first = first / np.linalg.norm(first)
    return first, np.cross(axis, first)


def rim(center: Array, axis: Array, radius: float) -> Array:
    """Return a circle about an axis as its middle, a place on the axis, and one on it, (3, 3)."""
    return np.array([center, center + POLE * axis, center + radius * across(axis)[0]])


def ring(center: Array, axis: Array, radius: float) -> Array:
    """Return places on a circle about an axis, (m, 3)."""
    return circle(*rim(center, axis, radius))


def solid(facets: Sequence[Facet], gid: str, anchor: Anchor = PAPER) -> Item:
    """Return facets as one item."""
    around = np.vstack([facet.places for facet in facets])
    return Item(
        outline_of(around), closed=True, solid=True, facets=[*facets], gid=gid, anchor=anchor
    )


def outline_of(points: Array) -> Array:
    """Return the convex outline on the sheet of places (m, 3), with the depth of their middle."""
    corners = Facet("hull", points).flat()
    assert corners is not None
    return np.column_stack([corners, np.full(len(corners), points[:, 2].mean())])


def barrel(
    center: Array, axis: Array, half: float, radius: float, gid: str, color: str = style.INK
) -> Item:
    """Return a cylinder about an axis, its ends shaded."""
    ends = [rim(center + side * half * axis, side * axis, radius) for side in (-1.0, 1.0)]
    body = Facet("hull", np.vstack(ends), True, edge=color, width=EDGE)
    caps = [Facet("face", end, True, fill=SHADED, edge=color, width=EDGE) for end in ends]
    return solid([body, *caps], gid)


def disc(center: Array, axis: Array, radius: float, gid: str, color: str, fill: str) -> Item:
    """Return a plane circle about an axis."""
    return solid([Facet("hull", rim(center, axis, radius), True, fill=fill, edge=color)], gid)


def box(center: Array, frame: Array, halves: Array, gid: str, color: str = style.INK) -> Item:
    """Return a block; rows of ``frame`` are its directions."""
    facets = []
    for k, i, j in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        for side in (-1.0, 1.0):
            corners = SQUARE[:: int(side)] * halves[[i, j]] @ frame[[i, j]]
            fill = SHADED if k == 2 else style.PAPER
            face = center + side * halves[k] * frame[k] + corners
            facets.append(Facet("face", face, fill=fill, edge=color, width=EDGE))
    return solid(facets, gid)


def ball(center: Array, radius: float, gid: str, color: str = style.INK, base: str = "") -> Item:
    """Return a ball, which looks the same from everywhere."""
    light = center + radius * np.array([-0.32, 0.32, 0.0])
    facets = [
        Facet("dot", center[None], fill=SHADED, edge=color, width=EDGE, size=radius),
        Facet("dot", light[None], size=0.22 * radius, edge=style.PAPER, width=0.1),
    ]
    item = solid(facets, gid, Anchor((base,), EYE) if base else Anchor(turn=EYE))
    item.points = np.column_stack([center[:2] + radius * SQUARE, np.full(4, center[2])])
    return item


def plate(center: Array, out: Array, along: Array, half: float, wide: float) -> list[Facet]:
    """Return a fixed surface with hatching on its side ``out``, ``along`` one of its sides."""
    side = np.cross(out, along)
    corners = center + SQUARE * (half, wide) @ np.array([along, side])
    facets = [Facet("area", corners, edge=style.GROUND)]
    for k, way in enumerate((along, side, -along, -side)):
        start, length = corners[k], 2 * (half, wide)[k % 2]
        count = max(round(length / style.HATCH), 2)
        feet = start + np.outer((np.arange(count) + 0.75) * length / count, way)
        tips = feet + style.HATCH * (out - 0.9 * way)
        lines = np.stack([tips, feet], axis=1).reshape(-1, 3)
        facets.append(Facet("hatch", lines, edge=style.GROUND, width=style.THIN))
    return facets


def stand(center: Array, axis: Array, up: Array, half: float, reach: float, gid: str) -> Item:
    """Return the stand of something fixed, with hatching, below its axis, or beside it.

    ``half`` is its half width along the axis, ``reach`` how far the hatching is from it.
    """
    out = -(up - axis * (up @ axis))
    if float(np.linalg.norm(out)) < UPRIGHT:
        right = np.array([1.0, 0.0, 0.0])
        out = right - axis * (right @ axis)
    out = out / np.linalg.norm(out)
    side = np.cross(out, axis)
    rows = np.array([axis, side])
    top = center + SQUARE * (0.7 * half, 0.5 * WIDE) @ rows
    base = center + reach * out + SQUARE * (half, 0.75 * WIDE) @ rows
    foot = plate(center + reach * out, out, axis, 1.35 * half, WIDE)
    return solid([*foot, Facet("hull", np.vstack([top, base]), edge=style.GROUND)], gid)


def wall(place: Array, out: Array, gid: str) -> Item:
    """Return a hatched plate across a direction, fixed on that side."""
    return solid(plate(place, out, across(out)[0], 8.0, 8.0), gid)


def polyline(
    points: Array,
    gid: str | None,
    color: str = style.INK,
    width: float = style.BAR,
    bridges: bool = True,
    dash: object = None,
    anchor: Anchor = PAPER,
) -> Item:
    """Return an open line."""
    return Item(
        points, gid=gid, color=color, width=width, bridges=bridges, dash=dash, anchor=anchor
    )


Look = dict[str, Any]
NEARER = 0.5
"""Depths that differ by less are those of one place,"""
BEHIND = 5.0
"""and lines that cross farther apart than this leave a gap in the one behind,"""
GAP = 3.2
"""so wide on either side of the line in front."""
STEP = 3.0
"""Lines are compared with faces at places so far apart."""
HIDDEN: Look = {"width": style.LINE, "dash": (0.0, (3.0, 2.5))}
"""Lines behind the face of another body."""
ROUND = np.linspace(0.0, 2 * np.pi, 37)[:-1]
FIRST, LAST = float(style.Z_BAR), float(style.Z_PIN) + 0.8


@dataclass
class Facet:
    """What is drawn of an item.

    Parameters
    ----------
    kind
        "area", "line", "strokes" (pairs of places); "face", "hatch": an area or strokes that are
        seen from one side, counter-clockwise there; "hull": the outline of places on the sheet;
        "dot": a circle on the sheet; "head": that of an arrow from the first place to the second.
    points
        (m, 3).
    round
        Whether places are circles: of each its middle, a place on its axis, a place on it.
    size
        Radius of a dot, length of a head.
    """

    kind: str
    points: Array
    round: bool = False
    fill: str = style.PAPER
    edge: str = style.INK
    width: float = style.LINE
    dash: Any = None
    size: float = 0.0

    @property
    def places(self) -> Array:
        """Places (m, 3) on what is drawn."""
        if not self.round:
            return self.points
        return np.vstack([circle(*self.points[k : k + 3]) for k in range(0, len(self.points), 3)])

    def flat(self) -> Array | None:
        """Return the corners on the sheet; None where it is not seen."""
        points = self.points
        if self.kind in ("face", "hatch"):
            a, b = (points[1:3] - points[0])[:, :2]
            seen = a[0] * b[1] - a[1] * b[0]
            if (points[1, 2] - points[0, 2] if self.round else seen) <= 0:
                return None
        flat = self.places[:, :2]
        if self.kind == "hull":
            return flat[hull(flat.round(9))]
        if self.kind == "head":
            along = unit(flat[1] - flat[0])
            along = along if along.any() else np.array([1.0, 0.0])
            back, side = flat[1] - self.size * along, 0.4 * self.size * normal(along)
            return np.array([flat[1], back + side, back - side])
        return flat


def circle(middle: Array, pole: Array, rim: Array) -> Array:
    """Return places (m, 3) on the circle about an axis through a place."""
    axis, first = (pole - middle) / np.linalg.norm(pole - middle), rim - middle
    places: Array = middle + np.cos(ROUND)[:, None] * first
    places += np.sin(ROUND)[:, None] * np.cross(axis, first)
    return places


@dataclass
class Item:
    """A line (m, 3), a plane face (m, 3), or a solid.

    What has `facets` is drawn by them, from the first to the last; its `points` are its silhouette,
    of a solid with the depth of its middle.
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
    """Whether it leaves a gap in lines behind it, and is dashed where a body's face hides it."""
    weight: float = style.SOLID
    owner: str = ""
    """The body; its faces are those that hide lines."""
    anchor: Anchor = PAPER
    """What its places move with in a page."""

    @property
    def is_face(self) -> bool:
        return self.closed and not self.solid

    @property
    def parts(self) -> list[Facet]:
        """What is drawn."""
        if self.facets:
            return self.facets
        kind = "area" if self.closed else "line"
        look: Look = {"width": self.width, "dash": self.dash}
        return [Facet(kind, self.points, fill=self.fill, edge=self.color, **look)]

    @property
    def depth(self) -> float:
        return round(float(self.points[:, 2].mean()), 6)  # the last digits differ by machine

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
    return np.column_stack([first[:, :2], first[:, 2] - second[:, 2]])


def _shared(a: Item, b: Item) -> Array:
    """Return places on the sheet where both items are seen, one of them being a face or a solid."""
    if not a.closed:
        return _along(a, b)
    if not b.closed:
        return _along(b, a)
    first, second = a.points[:, :2], b.points[:, :2]
    rings = [np.vstack([corners, corners[:1]]) for corners in (a.points, b.points)]
    both = [first[within(first, second)], second[within(second, first)]]
    return np.vstack([*both, crossings(rings[0], rings[1])[:, :2]])


def _along(line: Item, face: Item) -> Array:
    places: Array = dense(line.points)[:, :2]
    return places[within(places, face.points[:, :2])]


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


def draw_items(sheet: Sheet, items: Sequence[Item], ordered: bool = True) -> None:
    """Draw items, near ones over far ones, with gaps where a line passes behind another.

    Faces of bodies are below all else: lines behind those of another body are dashed there.
    What only labels are to keep off need not be ``ordered``.
    """
    order = depth_order(items) if ordered else list(range(len(items)))
    order.sort(key=lambda k: not items[k].is_face)
    step = (LAST - FIRST) / (len(items) + 1)
    faces = [item for item in items if item.is_face]
    for rank, k in enumerate(order):
        item, z = items[k], FIRST + rank * step
        if item.bridges and not item.closed:
            behind = [items[j] for j in order[:rank]] if ordered else []
            for gap in gaps(item, behind):
                if any(within(gap, face.points[:, :2]).any() for face in faces):
                    continue  # the line behind is seen by its dashes
                width = item.width + 2 * GAP
                sheet.line(gap, color=style.PAPER, width=width, z=z - step / 2, weight=0.0)
            for piece, there in seen(item, faces):
                look: Look = {"width": item.width, "dash": item.dash} if there else HIDDEN
                sheet.line(piece, color=item.color, z=z, gid=item.gid, weight=item.weight, **look)
        else:
            _draw(sheet, item, z)


def seen(item: Item, faces: Sequence[Item]) -> list[tuple[Array, bool]]:
    """Return the stretches (m, 2) of a line, and whether no face of another body hides them."""
    line = dense(item.points)
    hidden = np.zeros(len(line), dtype=bool)
    for face in faces:
        if face.owner != item.owner:
            behind = depths(face, line[:, :2]) > line[:, 2] + BEHIND
            hidden |= behind & within(line[:, :2], face.points[:, :2])
    if not hidden.any():
        return [(item.points[:, :2], True)]
    cuts = [0, *(np.flatnonzero(np.diff(hidden)) + 1).tolist(), len(line) - 1]
    return [(line[a : b + 1, :2], not hidden[a]) for a, b in itertools.pairwise(cuts) if b > a]


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
    single = 0.0 if item.facets else item.weight
    for facet in item.parts:
        flat = facet.flat()
        look: Look = {"width": facet.width, "z": z, "gid": item.gid}
        if flat is None:
            continue
        if facet.kind in ("strokes", "hatch"):
            sheet.strokes(flat[::2], flat[1::2], color=facet.edge, **look)
        elif facet.kind == "line":
            sheet.line(flat, color=facet.edge, dash=facet.dash, weight=single, **look)
        elif facet.kind == "dot":
            look |= {"fill": facet.fill, "edge": facet.edge}
            sheet.circle(flat[0], facet.size, weight=single, **look)
        else:
            sheet.area(flat, fill=facet.fill, edge=facet.edge, weight=single, **look)
    if item.facets and item.closed:
        sheet.box(item.low, item.high, item.weight)
    elif item.facets:
        sheet.keep(item.points[:, :2], item.weight)
