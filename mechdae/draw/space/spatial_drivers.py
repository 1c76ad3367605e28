"""Arrows of drivers in space: around axes, along guides, about the tails of vectors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.mechanism import GROUND
from mechdae.draw import style
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import normal, unit
from mechdae.draw.space import solids
from mechdae.draw.space.solids import Facet, Item
from mechdae.draw.space.spatial_symbols import ARROW, HALF, SHAFT, SLEEVE

SPAN = np.deg2rad(250.0)
QUARTERS = 5
"""Pieces of an arc that find their places between what is near and far."""
BETWEEN = 9.5
"""From one of several heads to the next."""
LENGTH = 34.0
"""Of straight arrows."""


def turning(
    center: Array,
    axis: Array,
    sense: float,
    gid: str,
    radius: float = ARROW,
    color: str = style.ARROW,
    heads: int = 1,
) -> list[Item]:
    """Return an arrow around an axis, counter-clockwise about it for a positive sense.

    It is open on the side away from the eye.
    """
    first, second = solids.across(axis)
    away = np.array([0.0, 0.0, -1.0])
    back = float(np.arctan2(away @ second, away @ first)) if abs(axis[2]) < 0.999 else np.pi / 2
    gap = (2 * np.pi - SPAN) / 2
    turn = (back + sense * np.linspace(gap, gap + SPAN, 10 * QUARTERS + 1))[:, None]
    points = center + radius * (np.cos(turn) * first + np.sin(turn) * second)
    items = with_head(points, gid, color)
    step = max(round(BETWEEN / radius / SPAN * (len(points) - 1)), 1)
    for k in range(1, heads):
        tip = len(points) - 1 - k * step
        items.append(head(points[tip - 5], points[tip], gid, color))
    return items


def straight(center: Array, way: Array, gid: str) -> list[Item]:
    """Return an arrow of a usual length through a place, along a direction."""
    return with_head(center + np.linspace(-0.5, 0.5, 11)[:, None] * LENGTH * way, gid)


def with_head(points: Array, gid: str, color: str = style.ARROW) -> list[Item]:
    """Return a line (m, 3) with an arrow head at its end."""
    tip, behind = points[-1], points[-6] if len(points) > 11 else points[0]
    items = [head(behind, tip, gid, color)]
    keep = np.linalg.norm(points - tip, axis=1) > 6.0
    last = int(np.flatnonzero(keep)[-1]) + 1 if keep.any() else 1
    shaft = points[:last]
    for part in np.array_split(np.arange(max(len(shaft) - 1, 0)), QUARTERS):
        if len(part):
            piece = shaft[part[0] : part[-1] + 2]
            items.append(solids.polyline(piece, gid, color, 1.3 * style.LINE, bridges=False))
    return items


def head(behind: Array, tip: Array, gid: str, color: str, size: float = 8.0) -> Item:
    """Return an arrow head that points away from a place behind it."""
    shape = Facet("head", np.array([behind, tip]), fill=color, edge=color, width=0.3, size=size)
    corners = shape.flat()
    assert corners is not None
    points = np.column_stack([corners, np.full(3, tip[2])])
    return Item(points, closed=True, solid=True, facets=[shape], gid=gid)


def arrow_of(
    entry: NamedCoordinate,
    places: tuple[Array, Array],
    axes: Sequence[Array],
    bodies: tuple[str, str],
    sense: float,
) -> list[Item]:
    """Return the arrow of a driven coordinate.

    Parameters
    ----------
    places
        Middle of the joint's symbol, and of what slides in it.
    axes
        Directions about which the angles of the joint count: of one angle or of two.
    bodies
        Names of the joint's bodies; where the second is fixed the first one is seen to move.
    sense
        +1 or -1: of the speed.
    """
    gid = f"driver-{entry.text}"
    sense = -sense if bodies[1] == GROUND else sense
    axis = axes[1] if entry.word == "angle2" and len(axes) > 1 else axes[0]
    if entry.is_angle:
        out = HALF + 0.4 * SHAFT
        side = 1.0 if axis[2] >= 0 else -1.0
        return turning(places[0] + side * out * axis, axis, sense, gid)
    way = axis
    beside = np.array([*normal(unit(way[:2])), 0.0]) if np.hypot(*way[:2]) > 1e-6 else np.zeros(3)
    if beside[1] < 0:
        beside = -beside
    return straight(places[1] + (SLEEVE[1] + 9.0) * beside, sense * way, gid)
