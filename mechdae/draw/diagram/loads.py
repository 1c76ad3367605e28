"""Loads in the diagram: arrows of forces and torques, springs, dampers, gravity, masses.

The arrow of a force starts or ends at its point and lies on its line of action. Where the
description gives the values at the pose the arrows of forces are as long as they are large,
relative to the largest; where it does not the direction is what is known of it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mechdae.describe.coordinates import NamedCoordinate, coordinate
from mechdae.describe.loads import Force, Load, Resistance, Spring, TableLoad, Torque
from mechdae.describe.mechanism import GROUND
from mechdae.draw import style
from mechdae.draw.diagram import symbols
from mechdae.draw.diagram.amounts import acts, load_values, pushing
from mechdae.draw.diagram.driver import blocked, held_by, pivot_and_arm, travel_of, turn_arrow
from mechdae.draw.diagram.places import JoinedScene, Place, hull, within
from mechdae.draw.diagram.scene import Array, DrawnScene, turned
from mechdae.draw.primitives import Anchor
from mechdae.draw.sheet import Sheet, arc, normal, unit
from mechdae.draw.words import Words
from mechdae.records import dataclass

RADII = (style.ARC + 8.0, style.ARC + 15.0)
"""Radii of the curved arrows of torques, outside the driver's."""
MANY = 4
"""With more loads their sizes are not written."""
ASIDE = style.BLOCK[1] + 5.0
"""Forces on a coordinate may be drawn so far beside it."""
SHORTEST = 34.0
"""A spring on a coordinate is drawn at least so long."""


@dataclass(frozen=True)
class Mark:
    """A load that was drawn: its letter belongs to the lines given, on the sheet."""

    name: str
    text: str
    lines: tuple[tuple[Array, Array], ...]
    color: str = style.LOAD


def draw_loads(
    sheet: Sheet,
    scene: DrawnScene,
    result: Any,
    pose: int,
    places: list[Place],
    words: Words,
    peak: float | None = None,
) -> list[Mark]:
    """Draw all loads whose bodies are shown; return what letters are attached to.

    A resistance whose coordinate stands still has heads at both ends. The arrow of the
    force `peak` [N] has full length, without it that of the largest in this pose.
    """
    marks: list[Mark] = []
    straight: list[tuple[Load, Array, Array | None, float | None, float, Anchor]] = []
    either: set[str] = set()
    for load in scene.mechanism.loads.values():
        if not acting(scene, load, pose):
            continue
        if isinstance(load, Spring):
            marks.append(_draw_spring(sheet, scene, load, pose, places))
            continue
        values = load_values(scene, result, load, pose)
        if isinstance(load, Force):
            straight.append(_force(scene, load, values, pose))
            continue
        entry = coordinate_of(scene, load)
        way = pushing(scene, result, load, pose) if isinstance(load, Resistance) else 1.0
        size = None if values is None else values[0]
        if entry.is_angle:
            with held_by(sheet, scene, entry, places):
                marks += _draw_torque(sheet, scene, load, entry, size, way, pose, places, words)
        else:
            point, axis = travel_of(scene, entry, pose)
            direction: Array | None = axis * (way or 1.0) * (1.0 if size is None else np.sign(size))
            if isinstance(load, TableLoad) and size is None:
                direction = None
            gap = style.BLOCK[0] + 2.0
            with held_by(sheet, scene, entry, places):
                held = sheet.anchor
            straight.append(
                (load, point, direction, None if size is None else abs(size), gap, held)
            )
            if way == 0.0:
                either.add(load.name)
    largest = peak or max((row[3] for row in straight if row[3]), default=1.0)
    for load, point, direction, size, gap, held in straight:
        if size == 0.0:
            continue
        share = 1.0 if size is None else size / largest
        text = text_of(load.name, size, "N", words)
        with sheet.held(held):
            mark = _draw_force(sheet, load.name, text, sheet.at(point), direction, share, gap)
            if load.name in either:
                symbols.arrow(sheet, np.array(mark.lines[0])[::-1], f"load-{load.name}", style.LOAD)
        marks.append(mark)
    if len(marks) > MANY:
        marks = [replace(mark, text=mark.name) for mark in marks]
    return [*marks, *_draw_masses(sheet, scene, pose)]


def load_points(scene: DrawnScene, pose: int) -> list[Array]:
    """Return the points [m] at which forces and springs take hold."""
    references: list[str] = []
    for load in scene.mechanism.loads.values():
        if isinstance(load, Force):
            references.append(load.point)
        elif isinstance(load, Spring):
            references += load.between or ()
    shown = [entry for entry in references if scene.shown(entry.split(".")[0], pose)]
    return [scene.place(entry, pose) for entry in shown]


def peak_force(scene: JoinedScene, result: Any, poses: Sequence[int]) -> float | None:
    """Return the largest of the forces with a straight arrow that are known, in some poses."""
    sizes = []
    for load in scene.mechanism.loads.values():
        straight = isinstance(load, Force)
        if not straight and not isinstance(load, (Spring, Torque)):
            turns = getattr(load, "body", None) is not None or coordinate_of(scene, load).is_angle
            straight = not turns
        if not straight:
            continue
        rows = [load_values(scene, result, load, pose) for pose in poses]
        sizes += [math.hypot(*row) for row in rows if row is not None]
    return max(sizes, default=0.0) or None


def acting(scene: JoinedScene, load: Load, pose: int) -> bool:
    """Return whether the bodies that a load acts on are shown."""
    ends = (load.point,) if isinstance(load, Force) else getattr(load, "between", None)
    body = getattr(load, "body", None)
    bodies = {end.split(".")[0] for end in ends or ()} if body is None else {body}
    if not bodies:
        entry = coordinate_of(scene, load)
        joint = scene.mechanism.joints.get(entry.part)
        bodies = {entry.part} if joint is None else set(joint.bodies)
    return all(scene.shown(body, pose) for body in bodies)


def coordinate_of(scene: JoinedScene | JoinedScene, load: object) -> NamedCoordinate:
    """Return the coordinate along which a load works."""
    body = getattr(load, "body", None)
    along = getattr(load, "along", None) or getattr(load, "coordinate", None)
    return coordinate(scene.mechanism, f"{body}.angle" if body is not None else str(along))


def text_of(name: str, size: float | None, unit: str, words: Words) -> str:
    """Return what is written at a load: its name and, if it is known, its size."""
    return name if size is None else f"{name} = {words.amount(abs(size), unit)}"


def _force(
    scene: DrawnScene, load: Force, values: tuple[float, ...] | None, pose: int
) -> tuple[Load, Array, Array | None, float | None, float, Anchor]:
    """Return a force with its point, direction and size, and what its arrow moves with."""
    point, gap = scene.place(load.point, pose), style.PIN + 2.0
    held = Anchor((load.point,), "" if load.frame in ("world", GROUND) else load.frame)
    if values is None:
        return load, point, None, None, gap, held
    value = np.array(values)
    if load.frame != "world":
        value = turned(scene.angles[load.frame][pose : pose + 1], value)[0]
    return load, point, unit(value), float(np.hypot(*value)), gap, held


def _draw_force(
    sheet: Sheet, name: str, text: str, point: Array, direction: Array | None, share: float,
    gap: float,
) -> Mark:  # fmt: skip
    """Draw a straight arrow from or to its point, where it covers least."""
    gid = f"load-{name}"
    if direction is None:  # the description does not tell the direction
        sheet.circle(point, 2.0 * style.PIN, edge=style.LOAD, dash=style.DASHED, gid=gid)
        return Mark(name, text, ((point, point + 1e-3),))
    length = max(style.PULL[0], style.PULL[1] * share)
    across = normal(direction)
    lines = [
        np.array([point + start * direction + lift * across] * 2)
        + np.outer([0.0, length], direction)
        for lift in ((0.0, ASIDE, -ASIDE) if gap > style.BLOCK[0] else (0.0,))
        for start in (gap, -gap - length)
    ]
    cost = [
        blocked(sheet, np.linspace(line[0], line[1], 9))
        + 2.0 * (k > 1)
        + 100.0 * bool((line < 3.0).any() or (line > sheet.size - 3.0).any())
        for k, line in enumerate(lines)
    ]
    line = lines[int(np.argmin(np.round(cost, 6)))]
    symbols.arrow(sheet, line, gid, style.LOAD)
    return Mark(name, text, ((line[0], line[1]),))


def _draw_torque(
    sheet: Sheet, scene: DrawnScene, load: Load, entry: NamedCoordinate, size: float | None,
    way: float, pose: int, places: list[Place], words: Words,
) -> list[Mark]:  # fmt: skip
    """Draw a curved arrow; one with two heads where the sense is not known."""
    if size == 0.0:
        return []
    pivot, arm = pivot_and_arm(scene, entry, places, pose)
    sign = way * (1.0 if size is None else float(np.sign(size)))
    both = sign == 0.0 or (size is None and not isinstance(load, Resistance))
    center, turn = sheet.at(pivot), sign or 1.0
    options = [turn_arrow(sheet, center, arm, turn, radius) for radius in RADII]
    points = min(options, key=lambda line: round(blocked(sheet, line), 6))
    symbols.arrow(sheet, points, f"load-{load.name}", style.LOAD)
    if both:
        symbols.arrow(sheet, points[::-1], f"load-{load.name}", style.LOAD)
    text = text_of(load.name, size, "N m", words)
    pieces = tuple(zip(points[0:-6:6], points[6::6], strict=True))
    return [Mark(load.name, text, pieces)]


# -- springs and dampers -------------------------------------------------------------------


def _draw_spring(
    sheet: Sheet, scene: DrawnScene, load: Spring, pose: int, places: list[Place]
) -> Mark:
    if load.between is None:
        entry = coordinate(scene.mechanism, str(load.coordinate))
        with held_by(sheet, scene, entry, places):
            if entry.is_angle:
                pivot = pivot_and_arm(scene, entry, places, pose)[0]
                return torsion_mark(sheet, load, sheet.at(pivot))
            ends, zero = _ends(sheet, scene, entry, pose)
            held = sheet.anchor
        if zero and entry.kind == "slide":
            joint = scene.mechanism.joints[entry.part]
            held = Anchor((joint.first, joint.second), held.turn, span=True)
        with sheet.held(held):
            return spring_mark(sheet, load, ends)
    a, b = (sheet.at(scene.place(entry, pose)) for entry in load.between)
    for reference, place in zip(load.between, (a, b), strict=True):
        if reference.split(".")[0] == GROUND and not _is_place(reference, places):
            with sheet.on(reference):
                symbols.support(sheet, place, f"support-{reference}")
                symbols.pin(sheet, place, f"load-{load.name}-pin")
    with sheet.on(*load.between, turn=">".join(load.between), span=True):
        return spring_mark(sheet, load, between_points(a, b))


def kinds_of_spring(load: Spring) -> tuple[bool, bool]:
    """Return whether a spring and whether a damper is drawn of it."""
    elastic = acts(load, "stiffness") or acts(load, "preload") or not acts(load, "damping")
    return elastic, acts(load, "damping")


def between_points(a: Array, b: Array) -> tuple[Array, Array]:
    """Return the ends of a spring between two points on the sheet, beside their pins."""
    along = unit(b - a)
    gap = min(style.PIN, 0.2 * float(np.hypot(*(b - a))))
    return a + gap * along, b - gap * along


def spring_mark(sheet: Sheet, load: Spring, ends: tuple[Array, Array]) -> Mark:
    """Draw a spring, a damper or both beside each other between two places on the sheet."""
    elastic, damped = kinds_of_spring(load)
    shift = style.SPREAD * normal(unit(ends[1] - ends[0])) if elastic and damped else np.zeros(2)
    for wanted, draw, side in (
        (elastic, symbols.spring, 1.0),
        (damped, symbols.damper, -1.0),
    ):
        if wanted:
            draw(sheet, ends[0] + side * shift, ends[1] + side * shift, f"load-{load.name}")
    if shift.any():
        for end in ends:
            tie = [end + 1.6 * shift, end - 1.6 * shift]
            sheet.line(tie, color=style.LOAD)
    return Mark(load.name, load.name, ((ends[0] + 2 * shift, ends[1] + 2 * shift),))


def _is_place(reference: str, places: list[Place]) -> bool:
    return any(reference in place.references and place.pinned for place in places)


def _ends(
    sheet: Sheet, scene: DrawnScene, entry: NamedCoordinate, pose: int
) -> tuple[tuple[Array, Array], bool]:
    """Return the ends of a spring on a slide or on a point's coordinate, and whether from zero.

    From where the coordinate is zero to the point, if that is long enough; else on the
    free side of the point.
    """
    point, axis = travel_of(scene, entry, pose)
    center = sheet.at(point)
    if entry.kind == "slide":
        joint = scene.mechanism.joints[entry.part]
        origin = sheet.at(scene.place(joint.first, pose))
        value = float((center - origin) @ axis)
    else:
        value = 0.0
    gap = style.BLOCK[0]
    options = [center - way * gap * axis for way in (1.0, -1.0)]
    far = [center - way * (gap + SHORTEST) * axis for way in (1.0, -1.0)]
    if abs(value) > gap + SHORTEST and abs(value) < 200.0:
        way = float(np.sign(value))
        ends = np.array([center - value * axis, center - way * gap * axis])
        rows = [ends + lift * normal(axis) for lift in (0.0, style.COIL + 1.0, -style.COIL - 1.0)]
        rest = [round(blocked(sheet, np.linspace(a, b, 17)[3:-3]), 6) for a, b in rows]
        chosen = rows[int(np.argmin(rest))]
        return (chosen[0], chosen[1]), True
    cost = [blocked(sheet, np.linspace(a, b, 9)) for a, b in zip(far, options, strict=True)]
    k = int(np.argmin(np.round(cost, 6)))
    return (far[k], options[k]), False


def torsion_mark(sheet: Sheet, load: Spring, center: Array) -> Mark:
    """Draw a torsion spring, a damper of turns or both around a place on the sheet."""
    elastic, damped = kinds_of_spring(load)
    if elastic:
        symbols.spiral(sheet, center, f"load-{load.name}")
    if damped:
        radius = 4.3 * style.PIN
        angles = np.deg2rad(135.0) + np.arange(24) * np.pi / 12
        cost = [blocked(sheet, arc(center, radius, a - 1.1, a + 0.6, 10)) for a in angles]
        angle = float(angles[int(np.argmin(np.round(cost, 6)))])
        symbols.brake(sheet, center, angle, f"load-{load.name}")
    reach = 4.2 * style.PIN
    box = ((-1, -1), (1, -1)), ((1, -1), (1, 1)), ((1, 1), (-1, 1)), ((-1, 1), (-1, -1))
    sides = tuple((center + reach * np.array(a), center + reach * np.array(b)) for a, b in box)
    return Mark(load.name, load.name, sides)


# -- gravity and masses --------------------------------------------------------------------


def _draw_masses(sheet: Sheet, scene: DrawnScene, pose: int) -> list[Mark]:
    """Draw centres of mass that are no joints, and the direction of gravity."""
    pull = np.array([scene.numbers.get(f"gravity.{axis}", 0.0) for axis in "xy"])
    heavy = False
    for name, body in scene.mechanism.bodies.items():
        if body.mass is None or not scene.shown(name, pose):
            continue
        heavy = True
        if body.center is None:
            continue
        local = np.array([scene.numbers[f"{name}.center.{axis}"] for axis in "xy"])
        if any(np.hypot(*(scene.local(f"{name}.{p}") - local)) <= 1e-12 for p in body.points):
            continue
        turn = scene.angles[name][pose : pose + 1]
        center = scene.origins[name][pose] + turned(turn, local)[0]
        with sheet.on(f"{name}.{next(iter(body.points))}", turn=name, grow="m"):
            points = [scene.place(f"{name}.{point}", pose) for point in body.points]
            mass_mark(sheet, sheet.at(center), sheet.at(points), name, float(turn[0]))
    if not heavy or not pull.any():
        return []
    return gravity_mark(sheet, unit(pull))


def mass_mark(sheet: Sheet, center: Array, corners: Array, name: str, angle: float = 0.0) -> None:
    """Draw a centre of mass, tied by a thin line to its link where it lies beside it.

    ``corners`` are the points of the link, (n, 2).
    """
    ends = corners[hull(corners)] if len(corners) > 2 else corners
    way = np.roll(ends, -1, axis=0) - ends
    size = np.maximum((way**2).sum(axis=1), 1e-12)
    share = np.clip(((center - ends) * way).sum(axis=1) / size, 0.0, 1.0)
    feet = ends + share[:, None] * way
    foot = feet[int(np.argmin(np.round(np.hypot(*(feet - center).T), 6)))]
    beside = len(ends) < 3 or not within(center[None], ends)[0]
    if beside and float(np.hypot(*(foot - center))) > 2 * style.DOT:
        sheet.line(
            [center, foot], color=style.GROUND, width=style.THIN, dash=style.DASHED,
            z=style.Z_BAR, gid=f"mass-{name}-tie", weight=style.RING,
        )  # fmt: skip
    symbols.mass_center(sheet, center, f"mass-{name}", angle)


def gravity_mark(sheet: Sheet, way: Array) -> list[Mark]:
    """Draw the arrow of gravity in a corner that is free; `way` is shorter than 1 in perspective.

    None where it is seen end-on.
    """
    if float(np.hypot(*way)) < 0.3:
        return []
    step, edge = 26.0 * way, 18.0
    low, high = np.minimum(step, 0.0), np.maximum(step, 0.0)
    floor = np.array([edge, edge + style.STRIP])
    starts = [
        np.where(side, sheet.size - edge - high, floor - low)
        for side in ((True, True), (False, True), (True, False), (False, False))
    ]
    lines = [np.array([start, start + step]) for start in starts]
    cost = [blocked(sheet, np.linspace(line[0], line[1], 9)) for line in lines]
    line = lines[int(np.argmin(np.round(cost, 6)))]
    symbols.arrow(sheet, line, "gravity", style.FAINT)
    return [Mark("gravity", "g", ((line[0], line[1]),), style.FAINT)]
