"""The driver: its arrow and its value."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.describe.coordinates import Coordinate, coordinate
from mechdae.describe.joints import Curve
from mechdae.describe.mechanism import GROUND
from mechdae.draw import style, symbols
from mechdae.draw.curves import tangent
from mechdae.draw.places import Place
from mechdae.draw.scene import Array, Scene
from mechdae.draw.sheet import Sheet, arc, normal
from mechdae.draw.words import ENGLISH, Words

SPAN = np.deg2rad(80.0)
NEAR = 3.0
"""A line covers what is so near."""


def drivers_of(scene: Scene, result: Any) -> list[Coordinate]:
    """Return the coordinates that are given as functions of the pose."""
    return [coordinate(scene.mechanism, text) for text in getattr(result, "drivers", None) or {}]


def driven_bodies(scene: Scene, drivers: list[Coordinate]) -> set[str]:
    """Return the links that the drivers move."""
    return {
        entry.part
        if entry.part in scene.mechanism.bodies
        else scene.mechanism.joints[entry.part].second_body
        for entry in drivers
    }


def value_text(result: Any, entry: Coordinate, pose: int, words: Words = ENGLISH) -> str:
    """Return the driver's value in one pose, in degrees or metres."""
    value = float(np.atleast_1d(result.drivers[entry.text].position)[pose])
    if entry.is_angle:
        return f"{entry.text} = {_plain(np.rad2deg(value), 3, words)}°"
    unit = f" {words('m')}" if entry.unit == "m" else ""
    return f"{entry.text} = {_plain(value, 5, words)}{unit}"


def _plain(value: float, digits: int, words: Words) -> str:
    """Return a number rounded to `digits` decimals, without trailing zeros or minus zero."""
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".")
    text = ("0" if text == "-0" else text).replace("-", "\N{MINUS SIGN}")
    return text.replace(".", words("point"))


def draw_drivers(
    sheet: Sheet,
    scene: Scene,
    result: Any,
    pose: int,
    drivers: list[Coordinate],
    places: list[Place],
) -> None:
    """Draw an arrow for each driver, in the sense of its speed if the result has one."""
    for entry in drivers:
        if not scene.shown(next(iter(driven_bodies(scene, [entry]))), pose):
            continue
        sense = _sense(result, entry)
        if entry.is_angle:
            pivot, arm = pivot_of(scene, entry, places, pose)
            points = turn_arrow(sheet, sheet.at(pivot), arm, sense, style.ARC)
        else:
            point, axis = travel_of(scene, entry, pose)
            points = travel_arrow(sheet, sheet.at(point), axis, sense)
        symbols.arrow(sheet, points, f"driver-{entry.text}")


def _sense(result: Any, entry: Coordinate) -> float:
    """Return +1 or -1: the sign of the speed, or of the sweep, or plus."""
    driver = result.drivers[entry.text]
    velocity = getattr(driver, "velocity", None)
    if velocity is not None:
        values = np.atleast_1d(np.asarray(velocity, dtype=float))
        total = float(values[np.isfinite(values)].sum())
    else:
        values = np.atleast_1d(np.asarray(driver.position, dtype=float))
        total = float(values[-1] - values[0])
    return -1.0 if total < 0 else 1.0


def pivot_of(
    scene: Scene, entry: Coordinate, places: list[Place], pose: int
) -> tuple[Array, Array | None]:
    """Return where a link turns [m] and the direction of its bar from there."""
    if entry.part in scene.mechanism.joints:
        body, point = scene.mechanism.joints[entry.part].second.split(".")
    else:
        body = entry.part
        own = [
            (place, reference)
            for place in places
            if place.pinned
            for reference in place.references
            if reference.startswith(f"{body}.")
        ]
        fixed = [reference for place, reference in own if GROUND in place.bodies]
        known = [*fixed, *(reference for _, reference in own)]
        point = (known or [f"{body}.{next(iter(scene.mechanism.body(body).points))}"])[0].split(
            "."
        )[1]
    pivot = scene.place(f"{body}.{point}", pose)
    arms = [
        scene.place(f"{body}.{other}", pose) - pivot for other in scene.mechanism.body(body).points
    ]
    longest = max(arms, key=lambda arm: round(float(np.hypot(*arm)), 12))
    return pivot, longest if np.hypot(*longest) > 0 else None


def turn_arrow(sheet: Sheet, pivot: Array, arm: Array | None, sense: float, radius: float) -> Array:
    """Return a curved arrow in the widest free sector around the pivot, near its bar."""
    bar = 0.0 if arm is None else float(np.arctan2(arm[1], arm[0]))
    best = bar + sense * (SPAN / 2 + 0.35)
    middles = best + np.arange(24) * np.pi / 12
    ends = SPAN / 2 + 0.1
    near = _around(sheet, pivot - radius, pivot + radius)
    cost = [
        _covered(*near, arc(pivot, radius, middle - ends, middle + ends, 12))
        + 2.0 * (1.0 - np.cos(middle - best))
        for middle in middles
    ]
    middle = float(middles[int(np.argmin(np.round(cost, 6)))])
    return arc(pivot, radius, middle - sense * SPAN / 2, middle + sense * SPAN / 2)


def blocked(sheet: Sheet, points: Array) -> float:
    """Return what a line would cover."""
    return _covered(*_around(sheet, points.min(axis=0), points.max(axis=0)), points)


def _around(sheet: Sheet, low: Array, high: Array) -> tuple[Array, Array]:
    """Return the segments and the boxes drawn so far that come near a box."""
    lines, boxes = sheet.obstacles()
    floor, ceiling = low - NEAR, high + NEAR
    beside = (np.minimum(lines[:, 0:2], lines[:, 2:4]) > ceiling).any(axis=1)
    beside |= (np.maximum(lines[:, 0:2], lines[:, 2:4]) < floor).any(axis=1)
    clear = ((boxes[:, 0:2] >= ceiling) | (boxes[:, 2:4] <= floor)).any(axis=1)
    return lines[~beside], boxes[~clear]


def _covered(lines: Array, boxes: Array, points: Array) -> float:
    """Return what a line through some points would cover of segments and boxes."""
    start, step, weight = lines[:, 0:2], lines[:, 2:4] - lines[:, 0:2], lines[:, 4]
    length = (step**2).sum(axis=1)
    along = ((points[:, None] - start) * step).sum(axis=-1) / np.where(length > 0, length, 1.0)
    foot = start + np.clip(along, 0.0, 1.0)[..., None] * step
    close = np.hypot(*np.moveaxis(points[:, None] - foot, -1, 0)) < NEAR
    total = float((weight * close.mean(axis=0)).sum())
    inside = (points[:, None] > boxes[:, 0:2] - NEAR) & (points[:, None] < boxes[:, 2:4] + NEAR)
    return total + float((boxes[:, 4] * inside.all(axis=-1).mean(axis=0)).sum())


def travel_of(scene: Scene, entry: Coordinate, pose: int) -> tuple[Array, Array]:
    """Return the point [m] that travels along a coordinate, and the direction of its growth."""
    if entry.part in scene.mechanism.joints:
        joint = scene.mechanism.joints[entry.part]
        if isinstance(joint, Curve):
            axis = tangent(scene, joint, pose)
        else:
            axis = scene.direction(joint.first_body, scene.numbers[f"{joint.name}.axis"], pose)
        return scene.place(joint.second, pose), axis
    return scene.place(f"{entry.part}.{entry.point}", pose), np.eye(2)[entry.axis]


def travel_arrow(sheet: Sheet, center: Array, axis: Array, sense: float) -> Array:
    """Return a straight arrow beside the point that travels."""
    lines = []
    for sign in (1.0, -1.0):
        for lift in (16.0, 22.0, 30.0):
            middle = center + sign * lift * normal(axis)
            lines.append(np.array([middle - 16 * sense * axis, middle + 16 * sense * axis]))
    cost = [blocked(sheet, np.linspace(line[0], line[1], 9)) for line in lines]
    return lines[int(np.argmin(np.round(cost, 6)))]
