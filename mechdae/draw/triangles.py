"""Triangles between polygons, by matplotlib's triangulation."""

from __future__ import annotations

import numpy as np
from matplotlib.tri import Triangulation

from mechdae.draw.diagram.places import within
from mechdae.types import Integers, Points


def triangles(loops: list[Points], least: float) -> Integers | None:
    """Return triangles (m, 3), counterclockwise, of an outline and the holes in it.

    Parameters
    ----------
    loops
        Points (n, 2) of the outline, counterclockwise, and of holes, clockwise; triangles count
        all of them one after the other.
    least
        Area of triangles that are left out: of points in line.

    Returns
    -------
    array or None
        None where a side of a loop is no side of a triangle: finer polygons are needed.
    """
    points = np.vstack(loops)
    faces = Triangulation(*points.T).triangles
    middles = points[faces].mean(axis=1)
    inside = within(middles, loops[0])
    for hole in loops[1:]:
        inside &= ~within(middles, hole)
    faces = faces[inside]
    a, b, c = points[faces].transpose(1, 0, 2)
    areas = ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2
    faces = np.where((areas > 0)[:, None], faces, faces[:, ::-1])[np.abs(areas) > least]
    return faces if _complete(faces, loops) else None


def _complete(faces: Integers, loops: list[Points]) -> bool:
    """Return whether the sides of triangles that have no neighbour are just the loops."""
    ways = {(int(t[i]), int(t[(i + 1) % 3])) for t in faces for i in range(3)}
    open_ways = {way for way in ways if way[::-1] not in ways}
    wanted, begin = set(), 0
    for loop in loops:
        count = len(loop)
        wanted |= {(begin + k, begin + (k + 1) % count) for k in range(count)}
        begin += count
    return open_ways == wanted and 3 * len(faces) == len(ways)
