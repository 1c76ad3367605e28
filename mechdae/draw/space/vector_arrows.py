"""Vectors of spatial loops: arrows from tail to head with their names."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND
from mechdae.draw import style
from mechdae.draw.fonts import font, ink
from mechdae.draw.labels import layout
from mechdae.draw.labels.labels import AIR, Writing
from mechdae.draw.primitives import Anchor, Array
from mechdae.draw.sheet import normal, unit
from mechdae.draw.space import solids
from mechdae.draw.space.depth import Item
from mechdae.draw.space.spatial_drivers import head, straight, turning
from mechdae.draw.space.spatial_pose import SpatialPose

HEAD = 9.0
"""Length of an arrow head."""


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
    for joint, tail, tip in shown_vectors(pose):
        still = not joint.coordinates
        color = style.DRIVEN if joint.name in driven else style.GROUND if still else style.INK
        ends = joint.first, joint.second
        items += _arrow(tail, tip, f"vector-{joint.name}", color, ends)
        for body, place, base in zip(joint.bodies, (tail, tip), ends, strict=True):
            gid = f"node-{body}"
            items.append(solids.ball(place, 0.7 * style.PIN, gid, base=base))
            if body == GROUND:
                up = pose.up
                items.append(solids.wall(place - 5.0 * up, -up, f"support-{gid}"))
                items[-1].anchor = Anchor((base,))
    for entry in drivers:
        for joint, tail, tip in shown_vectors(pose):
            if entry.part == joint.name:
                arrow = _driven(pose, entry, tail, tip)
                for item in arrow:
                    item.anchor = Anchor((joint.first,))
                items += arrow
    return items


def _arrow(tail: Array, tip: Array, gid: str, color: str, ends: tuple[str, str]) -> list[Item]:
    away, anchor = tip - tail, Anchor(ends, ">".join(ends))
    length = float(np.linalg.norm(away))
    if float(np.hypot(*away[:2])) < 1.0:
        return [solids.polyline(np.array([tail, tip]), gid, color, anchor=anchor)]
    point = tip - 0.7 * style.PIN * away / length
    shaft = tip - min(0.6 * HEAD, 0.5 * length) * away / length
    items = [
        solids.polyline(np.array([tail, shaft]), gid, color, anchor=anchor),
        head(tail, point, gid, color, HEAD),
    ]
    items[1].anchor = anchor
    return items


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
    for joint, tail, tip in shown_vectors(pose):
        chosen = font(style.LOAD_TEXT, style.NOTE_FONT)
        low, high = ink(joint.name, chosen)
        width, height = (float(side) for side in high - low + 2 * AIR)
        label = layout.along([(tail[:2], tip[:2])], width, height, 3.0)
        gid = f"label-{joint.name}"
        bar = (tail[:2], tip[:2])
        result.append(Writing(joint.name, "load", gid, chosen, label, [bar]))
    return result
