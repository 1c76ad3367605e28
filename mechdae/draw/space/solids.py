"""The solids that symbols of joints in space are made of, as items in order of depth.

Places and directions are (right, up, towards the eye) in units of the sheet.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdae.draw import style
from mechdae.draw.diagram.shapes import hull
from mechdae.draw.diagram.symbols import DOWN, hatching
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import unit
from mechdae.draw.space.depth import Facet, Item

CIRCLE = np.linspace(0.0, 2 * np.pi, 37)[:-1]
EDGE = 1.2 * style.LINE
SHADED = style.FILL


def across(axis: Array) -> tuple[Array, Array]:
    """Return two unit vectors normal to an axis and to each other."""
    k = int(np.argmin(np.abs(axis)))
    first = np.cross(axis, np.eye(3)[k])
    first = first / np.linalg.norm(first)
    return first, np.cross(axis, first)


def ring(center: Array, axis: Array, radius: float, angles: Array = CIRCLE) -> Array:
    """Return places on a circle about an axis, (m, 3)."""
    first, second = across(axis)
    places: Array = (
        center
        + radius * np.cos(angles)[:, None] * first
        + radius * np.sin(angles)[:, None] * second
    )
    return places


def outline_of(points: Array) -> Array:
    """Return the convex outline on the sheet of places (m, 3), with the depth of their middle."""
    flat = points[:, :2]
    corners = flat[hull(flat.round(9))]
    return np.column_stack([corners, np.full(len(corners), points[:, 2].mean())])


def solid(parts: Sequence[Facet], around: Array, gid: str) -> Item:
    """Return facets as one item with the outline of places around it."""
    return Item(outline_of(around), closed=True, solid=True, facets=list(parts), gid=gid)


def barrel(
    center: Array, axis: Array, half: float, radius: float, gid: str, color: str = style.INK
) -> Item:
    """Return a cylinder about an axis, its nearer end shaded."""
    ends = [ring(center + side * half * axis, axis, radius) for side in (-1.0, 1.0)]
    near = ends[1] if axis[2] >= 0 else ends[0]
    both = np.vstack(ends)
    return solid(
        [
            Facet(outline_of(both)[:, :2], edge=color, width=EDGE),
            Facet(near[:, :2], fill=SHADED, edge=color, width=EDGE),
        ],
        both,
        gid,
    )


def disc(center: Array, axis: Array, radius: float, gid: str, color: str, fill: str) -> Item:
    """Return a plane circle about an axis."""
    return Item(
        ring(center, axis, radius), closed=True, gid=gid, color=color, fill=fill, width=style.LINE
    )


def box(center: Array, frame: Array, halves: Array, gid: str, color: str = style.INK) -> Item:
    """Return a block: the faces that are seen; rows of ``frame`` are its directions."""
    signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    corners = center + (signs * halves) @ frame
    order = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=float)
    parts = []
    for k in range(3):
        side = 1.0 if frame[k, 2] >= 0 else -1.0
        if abs(frame[k, 2]) < 1e-6:
            continue
        rest = [i for i in range(3) if i != k]
        local = np.zeros((4, 3))
        local[:, k] = side
        local[:, rest] = order
        face = center + (local * halves) @ frame
        fill = SHADED if k == 2 else style.PAPER
        parts.append(Facet(face[:, :2], fill=fill, edge=color, width=EDGE))
    return solid(parts, corners, gid)


def ball(center: Array, radius: float, gid: str, color: str = style.INK) -> Item:
    """Return a ball, which looks the same from everywhere."""
    rim = ring(center, np.array([0.0, 0.0, 1.0]), radius)
    light = center[:2] + radius * np.array([-0.32, 0.32])
    spot = light + 0.22 * radius * np.column_stack([np.cos(CIRCLE[::4]), np.sin(CIRCLE[::4])])
    return solid(
        [
            Facet(rim[:, :2], fill=SHADED, edge=color, width=EDGE),
            Facet(spot, fill=style.PAPER, edge=style.PAPER, width=0.1),
        ],
        rim,
        gid,
    )


def hatched(start: Array, end: Array, side: Array) -> list[Facet]:
    """Return the line of a fixed surface on the sheet with hatching on its `side`."""
    lines = np.stack(hatching(start, end, side), axis=1).reshape(-1, 2)
    return [
        Facet(lines, strokes=True, edge=style.GROUND, width=style.THIN),
        Facet(np.array([start, end]), closed=False, edge=style.GROUND, width=style.LINE),
    ]


def pedestal(center: Array, axis: Array, half: float, reach: float, gid: str) -> Item:
    """Return the stand of something fixed, with hatching, on the lower side of its axis.

    ``half`` is its half width along the axis, ``reach`` how far the hatching is from it.
    """
    along = axis[:2] * half
    least = 0.6 * half
    if np.hypot(*along) < least:
        steep = np.hypot(*along) > 0.2 * half
        along = least * (unit(along) if steep else np.array([1.0, 0.0]))
    if abs(along[1]) > 0.85 * np.hypot(*along):  # an upright axis: the stand is beside it
        side = np.array([1.0, 0.0]) if axis[2] * along[1] > 0 else np.array([-1.0, 0.0])
    else:
        side = DOWN
    side = side - along * (side @ along) / float(along @ along)
    side = unit(side)
    base = center[:2] + reach * side
    wide = along * 1.35
    stand = np.array([center[:2] - along * 0.7, center[:2] + along * 0.7, base + wide, base - wide])
    facets = [
        Facet(stand, edge=style.GROUND, width=style.LINE),
        *hatched(base - 1.15 * wide, base + 1.15 * wide, side),
    ]
    outer = np.vstack([stand, stand[2:] + style.HATCH * side])
    low = center[2] - 4.0
    return Item(
        np.column_stack([outer[hull(outer.round(9))], np.full(len(hull(outer.round(9))), low)]),
        closed=True,
        solid=True,
        facets=facets,
        gid=gid,
    )


def polyline(
    points: Array,
    gid: str | None,
    color: str = style.INK,
    width: float = style.BAR,
    bridges: bool = True,
    dash: object = None,
) -> Item:
    """Return an open line."""
    return Item(points, gid=gid, color=color, width=width, bridges=bridges, dash=dash)


def wall(start: Array, end: Array, side: Array, depth: float, gid: str) -> Item:
    """Return a hatched line on the sheet, fixed on its `side`."""
    outer = np.array([start, end, end + style.HATCH * side, start + style.HATCH * side])
    points = np.column_stack([outer, np.full(4, depth)])
    facets = hatched(start, end, side)
    return Item(points, closed=True, solid=True, facets=facets, gid=gid)
