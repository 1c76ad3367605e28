"""The solids that symbols of joints in space are made of, as items in order of depth.

Places and directions are (right, up, towards the eye) in units of the sheet. Solids are told by
their circles, faces and lines in space: from another side the same facets show what is seen there.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdae.draw import style
from mechdae.draw.primitives import PAPER, Anchor, Array
from mechdae.draw.space.depth import Facet, Item, circle

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
