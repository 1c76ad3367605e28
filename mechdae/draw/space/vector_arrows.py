"""Vectors of spatial loops: arrows from tail to head with their names."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND
from mechdae.draw import style
from mechdae.draw.diagram.symbols import DOWN
from mechdae.draw.fonts import font, ink
from mechdae.draw.labels import layout
from mechdae.draw.labels.labels import AIR, Writing
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import normal, unit
from mechdae.draw.space import solids
from mechdae.draw.space.depth import Facet, Item
from mechdae.draw.space.spatial_drivers import straight, turning
from mechdae.draw.space.spatial_pose import SpatialPose

HEAD = (9.0, 3.6)
"""Length and half width of an arrow head."""


def shown_vectors(pose: SpatialPose) -> list[tuple[Joint, Array, Array]]:
    """Return the vectors of a pose with tail and head on the sheet."""
    return [
        (joint, *pose.anchors(joint))
        for joint in pose.scene.joints(pose.pose)
        if joint.pointer
    ]  # fmt: skip


def vector_items(pose: SpatialPose, drivers: Sequence[NamedCoordinate]) -> list[Item]:
    """Return the arrows of vectors, grey where nothing of them moves, and those of drivers."""
    driven = {entry.part for entry in drivers}
    items: list[Item] = []
    for joint, tail, head in shown_vectors(pose):
        still = not joint.coordinates
        color = style.DRIVEN if joint.name in driven else style.GROUND if still else style.INK
        items += _arrow(tail, head, f"vector-{joint.name}", color)
        for body, place in ((joint.first_body, tail), (joint.second_body, head)):
            gid = f"node-{body}"
            items.append(solids.ball(place, 0.7 * style.PIN, gid))
            if body == GROUND:
                items.append(_ground(place, gid))
    for entry in drivers:
        vectors = {joint.name: (tail, head) for joint, tail, head in shown_vectors(pose)}
        if entry.part in vectors:
            items += _driven(pose, entry, *vectors[entry.part])
    return items


def _arrow(tail: Array, head: Array, gid: str, color: str) -> list[Item]:
    away = head - tail
    along = unit(away[:2])
    length = float(np.hypot(*away[:2]))
    if length < 1.0:
        return [solids.polyline(np.array([tail, head]), gid, color)]
    tip = head[:2] - 0.7 * style.PIN * along
    back = tip - min(HEAD[0], 0.6 * length) * along
    corners = np.array([tip, back + HEAD[1] * normal(along), back - HEAD[1] * normal(along)])
    facets = [Facet(corners, fill=color, edge=color, width=0.3)]
    depth = np.full(3, head[2])
    tipped = Item(
        np.column_stack([corners, depth]), closed=True, solid=True, facets=facets, gid=gid
    )
    share = 1.0 - 0.6 * HEAD[0] / length if length > HEAD[0] else 0.5
    return [solids.polyline(np.array([tail, tail + share * away]), gid, color), tipped]


def _ground(place: Array, gid: str) -> Item:
    start, depth = place[:2] + np.array([-8.0, -5.0]), float(place[2]) - 3.0
    return solids.wall(start, start + np.array([16.0, 0.0]), DOWN, depth, f"support-{gid}")


def _driven(pose: SpatialPose, entry: NamedCoordinate, tail: Array, head: Array) -> list[Item]:
    """Return the arrow of a driven length, elevation or azimuth."""
    gid = f"driver-{entry.text}"
    away = head - tail
    size = float(np.linalg.norm(away))
    if size == 0:
        return []
    if not entry.is_angle:
        beside = np.array([*normal(unit(away[:2])), 0.0])
        return straight((tail + head) / 2 + 12.0 * beside, away / size, gid)
    up = pose.view.seen(np.array([0.0, 1.0, 0.0]))
    axis = -up  # azimuths go from x to z: clockwise about y
    if entry.word == "elevation":
        axis = np.cross(away, up)
        axis = axis / np.linalg.norm(axis)
    radius = min(24.0, 0.5 * size)
    return turning(tail, axis, 1.0, gid, radius)


def vector_names(pose: SpatialPose) -> list[Writing]:
    """Return the names of vectors beside them."""
    result = []
    for joint, tail, head in shown_vectors(pose):
        chosen = font(style.LOAD_TEXT, style.NOTE_FONT)
        low, high = ink(joint.name, chosen)
        width, height = (float(side) for side in high - low + 2 * AIR)
        label = layout.along([(tail[:2], head[:2])], width, height, 3.0)
        gid = f"label-{joint.name}"
        bar = (tail[:2], head[:2])
        result.append(Writing(joint.name, "load", gid, chosen, label, [bar]))
    return result
