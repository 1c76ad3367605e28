"""Whether the pose drawn closes, and the gaps of one that does not by request."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from mechdae.describe.joints.curve import follows_curve
from mechdae.describe.joints.joint import Joint
from mechdae.describe.joints.limits import in_gaps
from mechdae.describe.mechanism import GROUND
from mechdae.draw import style
from mechdae.draw.diagram import symbols
from mechdae.draw.diagram.loads import Mark
from mechdae.draw.diagram.scene import DrawnScene, open_of
from mechdae.draw.diagram.wheels import curve_points
from mechdae.draw.labels.layout import feet
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import Sheet
from mechdae.draw.space.spatial_scene import SpatialScene
from mechdae.errors import InputError

if TYPE_CHECKING:
    from mechdae.draw.words import Words
    from mechdae.results import SweepResult
    from mechdae.results.result import Result


PIXEL = 0.5
"""Gap of a joint that is not seen [pixel]."""


def check_closes(
    sheet: Sheet, scene: DrawnScene | SpatialScene, result: Result, pose: int, words: Words
) -> None:
    """Refuse a pose whose joints would gape: its numbers are not those of the mechanism.

    Joints that are drawn open by request are left out, those that move in their gaps, and bodies
    without a place.

    Raises
    ------
    InputError
        Says which joint, and by how much.
    """
    most = PIXEL * 72 / style.DPI / (sheet.metre * sheet.k)
    off = _planar(scene, result, pose) if isinstance(scene, DrawnScene) else _spatial(scene, pose)
    free = loose(result)
    name, gap = max(
        (each for each in off if each[0] not in free), key=lambda each: each[1], default=("", 0.0)
    )
    if gap > most:
        raise InputError(
            f"pose {pose} does not close with the dimensions of its mechanism: "
            f"{name} is off by {words.amount(gap, 'm')}",
            where=f"{result.problem}: {result.task}",
            hint="poses and mechanism of a picture have to be of one design",
        )


def loose(result: Result) -> list[str]:
    """Return the joints that move in their gaps."""
    if getattr(getattr(result, "definition", None), "clearance", None) is None:
        return []
    return in_gaps(result.mechanism.joints, result.mechanism.values())


def _planar(scene: DrawnScene, result: Result, pose: int) -> Iterator[tuple[str, float]]:
    """Yield what is off in the plane, and by how much [m]."""
    for reference, series in result.points.items():
        if scene.shown(reference.split(".")[0], pose):
            yield reference, _size(series.position[pose] - scene.place(reference, pose))
    joints = scene.joints(pose)
    for name, gap in gaps(scene, joints, slice(pose, pose + 1)):
        yield name, _size(gap)
    for joint in joints:
        if follows_curve(joint):
            radius = scene.numbers.get(f"{joint.name}.roller_radius", 0.0)
            place = scene.place(joint.second, pose)
            yield joint.name, abs(_distance(curve_points(scene, joint, pose), place) - radius)


def gaps(
    scene: DrawnScene, joints: Iterable[Joint], poses: slice = slice(None)
) -> Iterator[tuple[str, Array]]:
    """Yield the gaps of joints in poses of the plane, (n, 1) or (n, 2) [m]."""
    for joint in joints:
        way = scene.track(joint.second)[poses] - scene.track(joint.first)[poses]
        if joint.coincide:
            yield joint.name, way
        elif joint.straight:
            angle = scene.angles[joint.first_body][poses] + scene.numbers[f"{joint.name}.axis"]
            yield joint.name, (np.cos(angle) * way[:, 1] - np.sin(angle) * way[:, 0])[:, None]
        elif joint.bar:
            length = scene.numbers[f"{joint.name}.length"]
            yield joint.name, np.hypot(*way.T)[:, None] - length
        if joint.keeps_angle:
            first, second = (scene.angles[body][poses] for body in joint.bodies[:2])
            turn = second - first - scene.numbers[f"{joint.name}.turn"]
            yield joint.name, (2 * np.sin(turn / 2) * _arm(scene, joint))[:, None]


def _spatial(scene: SpatialScene, pose: int) -> Iterator[tuple[str, float]]:
    """Yield what is off in space, and by how much [m]."""
    for body in scene.mechanism.bodies:
        known = [ref for ref in scene.points(body) if np.isfinite(scene.place(ref, pose)).all()]
        if body in scene.turns and np.isfinite(scene.turns[body][pose]).all():
            for ref in known[1:]:
                arm = scene.local(ref) - scene.local(known[0])
                way = scene.place(ref, pose) - scene.place(known[0], pose)
                yield ref, _size(way - scene.turns[body][pose] @ arm)
    for joint in scene.joints(pose):
        way = scene.place(joint.second, pose) - scene.place(joint.first, pose)
        if joint.coincide:
            yield joint.name, _size(way)
        elif joint.straight:
            axis = scene.axis(joint, pose)
            yield joint.name, 0.0 if axis is None else _size(way - axis * (way @ axis))
        elif joint.bar:
            yield joint.name, abs(_size(way) - scene.numbers[f"{joint.name}.length"])


def _arm(scene: DrawnScene, joint: Joint) -> float:
    """Return how far the points of the second body are from the joint at most."""
    here, points = scene.local(joint.second), scene.points(joint.second_body)
    return max((_size(scene.local(point) - here) for point in points), default=0.0)


def _distance(line: Array, place: Array) -> float:
    """Return the distance of a place from a line through points."""
    return float(np.hypot(*(place - feet(place, line[:-1], line[1:])).T).min())


def _size(way: Array) -> float:
    return float(np.nan_to_num(np.linalg.norm(way)))


def draw_gaps(sheet: Sheet, scene: DrawnScene, result: Result, words: Words) -> list[Mark]:
    """Draw the gap of each open joint as a dashed line; return what its size is written beside."""
    marks = []
    for entry in open_of(result):
        name = entry["joint"]
        ends = [sheet.at(np.array(entry[word])) for word in ("from", "to")]
        gid = f"gap-{name}"
        sheet.line(ends, color=style.ARROW, dash=style.DASHED, gid=gid)
        joint = scene.mechanism.joints[name]
        for end, side in zip(ends, (joint.first, joint.second), strict=True):
            if side.split(".")[0] == GROUND:
                symbols.support(sheet, end, f"support-{name}")
            symbols.pin(sheet, end, f"open-{name}")
        size = words("gap", name, words.amount(entry["gap"], "m"))
        marks.append(Mark(gid, size, ((ends[0], ends[1]),), style.ARROW))
    return marks


def open_text(result: Result, words: Words) -> str:
    """Return which joints stay open by how much, empty where all close."""
    rows = [f"{row['joint']} {words.amount(row['gap'], 'm')}" for row in open_of(result)]
    return words("does not close", ", ".join(rows)) if rows else ""


def blame_text(result: SweepResult, words: Words) -> str:
    """Return which lengths are too short or too long."""
    summary = getattr(result, "summary", None) or {}
    parts = [
        words(word, ", ".join(fault["what"] for fault in summary[key]))
        for key, word in (("too_short", "too short"), ("too_long", "too long"))
        if summary.get(key)
    ]
    return "; ".join(parts)
