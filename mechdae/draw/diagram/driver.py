"""The drivers: arrows, what holds those that do not move, values."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.describe.coordinates import NamedCoordinate, coordinate
from mechdae.describe.joints.curve import follows_curve
from mechdae.describe.mechanism import GROUND
from mechdae.describe.units import SI
from mechdae.draw import style
from mechdae.draw.diagram import symbols
from mechdae.draw.diagram.guides import cylinder_of
from mechdae.draw.diagram.placed_scene import PlacedScene
from mechdae.draw.diagram.places import Place
from mechdae.draw.diagram.scene import DrawnScene, driver_names
from mechdae.draw.diagram.wheels import circles, tangent
from mechdae.draw.labels.layout import feet
from mechdae.draw.primitives import Anchor, Array
from mechdae.draw.sheet import Sheet, arc, normal, unit
from mechdae.draw.words import ENGLISH, Words

if TYPE_CHECKING:
    from mechdae.results.result import Result
    from mechdae.results.series import Series


SPAN = np.deg2rad(80.0)
NEAR = 3.0
"""A line covers what is so near."""


def drivers_of(scene: PlacedScene, result: Result) -> list[NamedCoordinate]:
    """Return the coordinates that are given as functions of the pose, or of the time."""
    return [coordinate(scene.mechanism, text) for text in driver_names(result)]


def driven_bodies(scene: PlacedScene, drivers: Iterable[NamedCoordinate]) -> set[str]:
    """Return the links that the drivers move."""
    return {
        entry.part
        if entry.part in scene.mechanism.bodies
        else scene.mechanism.joints[entry.part].second_body
        for entry in drivers
    }


def held_drivers(result: Result, drivers: Sequence[NamedCoordinate]) -> set[str]:
    """Return the names of the drivers that keep their value while others move.

    In a motion and an equilibrium those with a value ``at`` are held, whatever else moves.
    """
    given = getattr(result, "drivers", None) or {}
    if not given:
        listed = getattr(getattr(result, "definition", None), "drivers", None) or ()
        return {driver.coordinate for driver in listed if driver.law is None}
    still = {entry.text for entry in drivers if _rests(given[entry.text])}
    return still if len(still) < len(drivers) else set()


def moving_drivers(result: Result, drivers: Sequence[NamedCoordinate]) -> list[NamedCoordinate]:
    """Return the drivers that do not keep their value."""
    held = held_drivers(result, drivers)
    return [entry for entry in drivers if entry.text not in held]


def _rests(driver: Series) -> bool:
    """Return whether a driver has one value and no speed."""
    values = np.atleast_1d(np.asarray(driver.position, dtype=float))
    velocity = getattr(driver, "velocity", None)
    if velocity is None:
        return len(values) > 1 and float(np.ptp(values)) == 0.0
    speeds = np.atleast_1d(np.asarray(velocity, dtype=float))
    return float(np.ptp(values)) == 0.0 and not np.nan_to_num(speeds).any()


def values_of(result: Result, entry: NamedCoordinate) -> Array | None:
    """Return a driver's value in each pose, (n,), None where the result has none."""
    given = getattr(result, "drivers", None) or {}
    if entry.text in given:
        return np.atleast_1d(np.asarray(given[entry.text].position, dtype=float))
    series: Any = None
    if entry.kind == "body angle":
        series = result.bodies.get(entry.part, {}).get("angle")
    elif entry.kind == "point":
        place = result.points.get(f"{entry.part}.{entry.point}", {}).get("position")
        series = None if place is None else place[:, entry.axis]
    else:
        series = result.joints.get(entry.part, {}).get(entry.text.rpartition(".")[2])
    return None if series is None else np.atleast_1d(np.asarray(series, dtype=float))


def value_text(
    result: Result, entry: NamedCoordinate, pose: int, words: Words = ENGLISH, held: bool = False
) -> str:
    """Return the driver's value in one pose, in degrees or metres, and whether it is held."""
    values = values_of(result, entry)
    if values is None:
        return ""
    value, rest = float(values[pose]), f" ({words('held')})" if held else ""
    shown = getattr(result, "units", SI).of(entry.unit)
    if shown.name not in (entry.unit, "deg"):
        return (
            f"{entry.text} = {words.number(value * shown.factor)} {words.status(shown.name)}{rest}"
        )
    if entry.is_angle:
        return f"{entry.text} = {_plain(np.rad2deg(value), 3, words)}°{rest}"
    unit = f" {words('m')}" if entry.unit == "m" else ""
    return f"{entry.text} = {_plain(value, 5, words)}{unit}{rest}"


def time_text(result: Result, pose: int, words: Words = ENGLISH) -> str:
    """Return the time of one pose of a motion or of laws, empty where there is none."""
    times = getattr(result, "time", None)
    return "" if times is None else f"t = {words.number(float(times[pose]), 5)} {words('s')}"


def _plain(value: float, digits: int, words: Words) -> str:
    """Return a number rounded to `digits` decimals, without trailing zeros or minus zero."""
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".")
    text = ("0" if text == "-0" else text).replace("-", "\N{MINUS SIGN}")
    return text.replace(".", words("point"))


def draw_drivers(
    sheet: Sheet,
    scene: DrawnScene,
    result: Result,
    pose: int,
    drivers: list[NamedCoordinate],
    places: list[Place],
) -> None:
    """Draw an arrow for each driver, in the sense of its speed; held ones are braked."""
    held = held_drivers(result, drivers)
    for entry in drivers:
        if not scene.shown(next(iter(driven_bodies(scene, [entry]))), pose):
            continue
        if entry.text in held:
            with sheet.held(anchor_of(scene, entry, places)):
                draw_brake(sheet, scene, entry, places, pose)
            continue
        sense = sense_of(result, entry)
        with sheet.held(anchor_of(scene, entry, places)):
            if entry.is_angle:
                pivot, arm = pivot_and_arm(scene, entry, places, pose)
                points = turn_arrow(sheet, sheet.at(pivot), arm, sense, style.ARC)
            else:
                point, axis = travel_of(scene, entry, pose)
                points = travel_arrow(sheet, sheet.at(point), axis, sense)
            symbols.arrow(sheet, points, f"driver-{entry.text}")


def anchor_of(scene: DrawnScene, entry: NamedCoordinate, places: Sequence[Place]) -> Anchor:
    """Return what is drawn at a coordinate moves with: with what the coordinate moves."""
    if entry.is_angle:
        reference = pivot_of(scene, entry, places)
        return Anchor((reference,), reference.split(".")[0])
    joint = scene.mechanism.joints.get(entry.part)
    if joint is None:
        return Anchor((f"{entry.part}.{entry.point}",))
    return Anchor((joint.second,), f"{joint.name}/axis")


def draw_brake(
    sheet: Sheet, scene: DrawnScene, entry: NamedCoordinate, places: list[Place], pose: int
) -> None:
    """Draw what holds a coordinate: jaws on a link or a wheel, stops beside what slides."""
    gid = f"held-{entry.text}"
    joint = scene.mechanism.joints.get(entry.part)
    fixed = joint is None or GROUND in (joint.first_body, joint.second_body)
    if not entry.is_angle:
        point, axis = travel_of(scene, entry, pose)
        center = sheet.at(point)
        if entry.part in scene.cylinders:
            assert joint is not None
            mouth = cylinder_of(sheet, scene, joint, pose)[1]
            symbols.stops(sheet, mouth, axis, 2.0, gid, fixed=False)
        else:
            blocked_by = joint is not None and joint.guide
            reach = style.BLOCK[0] if blocked_by else 1.6 * style.PIN
            symbols.stops(sheet, center, axis, reach, gid, fixed)
        return
    pivot, arm = pivot_and_arm(scene, entry, places, pose)
    center = sheet.at(pivot)
    if arm is None:
        body = next(iter(driven_bodies(scene, [entry])))
        wheels = [
            radius * sheet.metre
            for neighbour in scene.joints(pose)
            for name, _, radius in circles(scene, neighbour, pose)
            if name.split(".")[0] == body
        ]
        symbols.shoe(sheet, center, max(wheels, default=3.0 * style.PIN), gid, fixed)
        return
    along = unit(arm)
    if joint is not None and not fixed:
        other = arm_of(scene, joint.first, pose)
        if other is not None:
            symbols.tie(sheet, center, along, unit(other), gid)
            return
    length = float(np.hypot(*arm)) * sheet.metre
    symbols.jaws(sheet, center + min(style.GRIP, 0.5 * length) * along, along, gid, fixed)


def arm_of(scene: DrawnScene, reference: str, pose: int) -> Array | None:
    """Return the way [m] from a point to the farthest one of its body, None if it has one place."""
    body, pivot = reference.split(".")[0], scene.place(reference, pose)
    arms = [scene.place(point, pose) - pivot for point in scene.points(body)]
    longest = max(arms, key=lambda arm: round(float(np.hypot(*arm)), 12))
    return longest if np.hypot(*longest) > 0 else None


def sense_of(result: Result, entry: NamedCoordinate) -> float:
    """Return +1 or -1: the sign of a driver's speed, or of its sweep, or plus."""
    driver = (getattr(result, "drivers", None) or {}).get(entry.text)
    speeds = getattr(driver, "velocity", None)
    values = values_of(result, entry)
    ways = [speeds, None if values is None else np.diff(values)]
    for way in (np.nansum(way) for way in ways if way is not None):
        if way:
            return float(np.sign(way))
    return 1.0


def pivot_of(scene: DrawnScene, entry: NamedCoordinate, places: Sequence[Place]) -> str:
    """Return the point about which a link turns: of its pins a fixed one, else the first."""
    if entry.part in scene.mechanism.joints:
        return scene.mechanism.joints[entry.part].second
    body = entry.part
    chosen = [
        (place, reference)
        for place in places
        if place.pinned
        for reference in place.references
        if reference.startswith(f"{body}.")
    ]
    fixed = [reference for place, reference in chosen if GROUND in place.bodies]
    known = [*fixed, *(reference for _, reference in chosen)]
    return known[0] if known else scene.points(body)[0]


def pivot_and_arm(
    scene: DrawnScene, entry: NamedCoordinate, places: Sequence[Place], pose: int
) -> tuple[Array, Array | None]:
    """Return where a link turns [m] and the direction of its bar from there."""
    reference = pivot_of(scene, entry, places)
    return scene.place(reference, pose), arm_of(scene, reference, pose)


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
    away = points[:, None] - feet(points[:, None], lines[:, 0:2], lines[:, 2:4])
    close = np.hypot(*np.moveaxis(away, -1, 0)) < NEAR
    total = float((lines[:, 4] * close.mean(axis=0)).sum())
    inside = (points[:, None] > boxes[:, 0:2] - NEAR) & (points[:, None] < boxes[:, 2:4] + NEAR)
    return total + float((boxes[:, 4] * inside.all(axis=-1).mean(axis=0)).sum())


def travel_of(scene: DrawnScene, entry: NamedCoordinate, pose: int) -> tuple[Array, Array]:
    """Return the point [m] that travels along a coordinate, and the direction of its growth."""
    if entry.part in scene.mechanism.joints:
        joint = scene.mechanism.joints[entry.part]
        axis = tangent(scene, joint, pose) if follows_curve(joint) else scene.axis(joint, pose)
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
