"""Gears, racks and belts: radii and circles; cams and their rollers, grooves and tracks."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mechdae.describe.joints.curve import Curve, place, span
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND
from mechdae.draw import style
from mechdae.draw.diagram import symbols
from mechdae.draw.diagram.places import fixed_bodies
from mechdae.draw.diagram.scene import DrawnScene
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import Sheet, normal, unit

BELT_SHARE = 0.3
"""Radius of the larger pulley over the distance of the centres: the file gives no radii."""


def pitch_radii(distance: float, ratio: float) -> tuple[float, float] | None:
    """Return the pitch radii of two wheels from the distance of their centres.

    From (w1 - wc) = ratio (w2 - wc) and equal speeds at the pitch point, r2 / r1 = |ratio|.
    A negative ratio is an external mesh, r1 + r2 = distance; a positive one an internal
    mesh, |r1 - r2| = distance. None where no finite circles exist: coaxial wheels, or an
    internal mesh of ratio 1.
    """
    share = 1.0 + abs(ratio) if ratio < 0 else abs(1.0 - ratio)
    if distance <= 0 or share < 1e-9:
        return None
    first = distance / share
    return first, first * abs(ratio)


def belt_radii(distance: float, ratio: float) -> tuple[float, float]:
    """Return radii of pulleys that have the given ratio and do not touch."""
    first = BELT_SHARE * distance / max(1.0, abs(ratio))
    return first, first * abs(ratio)


def circles(scene: DrawnScene, joint: Joint, pose: int) -> list[tuple[str, Array, float]]:
    """Return the circles of a joint of wheels: point, centre [m], radius [m]."""
    first, second = scene.place(joint.first, pose), scene.place(joint.second, pose)
    if joint.wheels == 1:
        radius = abs(scene.numbers[f"{joint.name}.radius"])
        return [(joint.first, first, radius)]
    if not joint.wheels:
        return []
    distance, ratio = float(np.hypot(*(second - first))), joint.turn_ratio(scene.numbers)
    radii = belt_radii(distance, ratio) if joint.strands else pitch_radii(distance, ratio)
    if radii is None:
        return []
    return [(joint.first, first, radii[0]), (joint.second, second, radii[1])]


def draw_wheels(
    sheet: Sheet, scene: DrawnScene, pose: int, colors: Mapping[str, str]
) -> dict[str, tuple[Array, float]]:
    """Draw the circles of all gears, racks and belts, each once.

    Returns
    -------
    dict
        Body -> centre and radius of its largest circle, on the sheet.
    """
    seen: set[tuple[str, float]] = set()
    largest: dict[str, tuple[Array, float]] = {}
    fixed = fixed_bodies(scene.mechanism)
    for joint in scene.joints(pose):
        if joint.strands:
            _draw_belt(sheet, scene, joint, pose)
        if joint.wheels == 1:
            _draw_rack(sheet, scene, joint, pose)
        for reference, middle, length in circles(scene, joint, pose):
            center, radius = sheet.at(middle), length * sheet.metre
            body = reference.split(".")[0]
            if (reference, round(radius, 2)) in seen:
                continue
            seen.add((reference, round(radius, 2)))
            color = colors.get(body, style.WHEEL)
            draw = symbols.rim if joint.rim else symbols.pitch_circle
            grow = f"{joint.first}>{joint.second}" if joint.wheels == 2 else f"{joint.name}/radius"
            with sheet.on(reference, turn="" if body in fixed else body, grow=grow):
                draw(sheet, center, radius, f"joint-{joint.name}-{joint.kind}", color)
                if body in fixed:
                    inner = joint.strands or (
                        joint.wheels == 2 and joint.turn_ratio(scene.numbers) > 0
                    )
                    symbols.fixed_rim(sheet, center, radius, 1.0 if inner else -1.0)
                else:
                    _draw_spoke(sheet, scene, body, center, radius, pose, color)
            if body not in largest or radius > largest[body][1]:
                largest[body] = (center, radius)
    return largest


def _draw_spoke(
    sheet: Sheet,
    scene: DrawnScene,
    body: str,
    center: Array,
    radius: float,
    pose: int,
    color: str,
) -> None:
    """Show how the wheel is turned and what it is fixed to.

    A thin radius with a dot on the rim, through the first other point of the body.
    """
    offsets = [sheet.at(scene.place(point, pose)) - center for point in scene.points(body)]
    arms = [unit(offset) for offset in offsets if np.hypot(*offset) > 1e-6]
    direction = arms[0] if arms else scene.direction(body, 0.0, pose)
    end = center + radius * direction
    sheet.line([center, end], color=color, width=style.THIN)
    symbols.dot(sheet, end, f"body-{body}-wheel", color)


def _draw_belt(sheet: Sheet, scene: DrawnScene, joint: Joint, pose: int) -> None:
    rows = circles(scene, joint, pose)
    (_, first, r1), (_, second, r2) = rows
    a, b = sheet.at(first), sheet.at(second)
    along, distance = unit(b - a), float(np.hypot(*(b - a)))
    if distance == 0.0:
        return
    other = joint.sense * r2
    sine = (r1 - other) * sheet.metre / distance
    if abs(sine) >= 1:
        return
    cosine = float(np.sqrt(1 - sine**2))
    for sign in (1.0, -1.0):
        out = sine * along + sign * cosine * normal(along)
        ends = [a + r1 * sheet.metre * out, b + other * sheet.metre * out]
        way = f"{joint.first}>{joint.second}"
        with sheet.on(joint.first, joint.second, turn=way, grow=way):
            sheet.line(ends, gid=f"joint-{joint.name}-strand")


def rack_span(scene: DrawnScene, joint: Joint, pose: int) -> tuple[Array, Array, Array]:
    """Return start and end [m] of a rack's pitch line, and the side away from the wheel."""
    wheel, radius = scene.place(joint.first, pose), scene.numbers[f"{joint.name}.radius"]
    axis = scene.direction(joint.second_body, scene.numbers[f"{joint.name}.axis"], pose)
    side = -np.sign(radius) * normal(axis)
    travel = rack_travel(scene, joint)
    travel = travel[np.isfinite(travel)] - travel[pose]
    touch = wheel + abs(radius) * side
    margin = 0.9 * abs(radius)
    return (
        touch + (float(travel.min()) - margin) * axis,
        touch + (float(travel.max()) + margin) * axis,
        side,
    )


def rack_travel(scene: DrawnScene, joint: Joint) -> Array:
    """Return how far the wheel is along a rack from its point in each pose, (n,) [m]."""
    turn = scene.angles[joint.second_body] + scene.numbers[f"{joint.name}.axis"]
    offset = scene.track(joint.first) - scene.track(joint.second)
    return offset[:, 0] * np.cos(turn) + offset[:, 1] * np.sin(turn)


def _draw_rack(sheet: Sheet, scene: DrawnScene, joint: Joint, pose: int) -> None:
    start, end, side = rack_span(scene, joint, pose)
    a, b = sheet.at(start), sheet.at(end)
    with sheet.on(f"{joint.name}/low", f"{joint.name}/high", turn=f"{joint.name}/rack", span=True):
        symbols.toothed_line(sheet, a, b, side, f"joint-{joint.name}-rack")
        if joint.second_body in fixed_bodies(scene.mechanism):
            back = symbols.TEETH * side
            symbols.hatch(sheet, a + back, b + back, side, f"joint-{joint.name}-ground")
    point = sheet.at(scene.place(joint.second, pose))
    along = unit(b - a)
    foot = a + float(np.clip((point - a) @ along, 0.0, np.hypot(*(b - a)))) * along
    if np.hypot(*(point - foot)) > 1.0:
        with sheet.on(joint.second, turn=joint.second_body, grow="m"):
            sheet.line([point, foot], width=style.BAR, z=style.Z_BAR)


PLACES = 240
SIDES = 60
"""Sides of the line that labels keep off."""
BOTTOM = 0.5
CORNERS = 8
"""Corners of the polygon that stands for a cam where its number is placed."""


def curve_points(scene: DrawnScene, joint: Curve, pose: int) -> Array:
    """Return points of a curve [m] in one pose, both ends among them."""
    first, last = span(joint, scene.numbers)
    origin = scene.place(joint.first, pose)
    along = scene.direction(joint.first_body, 0.0, pose)
    local = [place(joint, scene.numbers, float(s)) for s in np.linspace(first, last, PLACES + 1)]
    points: Array = origin + np.array(local) @ np.array([along, normal(along)])
    return points


def reach(scene: DrawnScene, joint: Curve, pose: int) -> Array:
    """Return points [m] between which curve and roller lie."""
    center, radius = scene.place(joint.second, pose), _radius(scene, joint)
    return np.vstack([curve_points(scene, joint, pose), center - radius, center + radius])


def draw_curve(
    sheet: Sheet, scene: DrawnScene, joint: Curve, pose: int, colors: Mapping[str, str]
) -> Array | None:
    """Draw curve and follower; return the corners of a cam on the sheet, None for a track.

    A cam that its follower touches from outside is a filled area, other curves that a
    roller touches are lines, hatched on the ground; a point runs in a groove.
    """
    points = sheet.at(curve_points(scene, joint, pose))
    center = sheet.at(scene.place(joint.second, pose))
    color = colors.get(joint.first_body, style.INK)
    fixed, rolls = joint.first_body == GROUND, joint.roller_radius is not None
    gid = f"joint-{joint.name}-curve"
    around = _area(points)
    # the roller is on the right of the curve; the material on the other side
    outside = not rolls or (around > 0) == (joint.side == "right")
    corners = None
    with sheet.on(f"{joint.name}/curve"):
        if joint.closed and outside and not fixed:
            # below everything else: the cam's own pivot and its paths lie within
            sheet.area(points[:-1], fill=style.FILL, edge="none", z=BOTTOM, weight=0.0)
            corners = points[: -1 : PLACES // CORNERS]
        if rolls or corners is not None:
            z = style.Z_FILL
            sheet.line(points, width=style.BAR, color=color, z=z, gid=gid, weight=0.0)
        else:
            symbols.groove(sheet, points, gid, style.GROUND if fixed else color)
    if fixed and rolls:
        with sheet.on(joint.first, grow="m"):
            _hatch(sheet, points, 1.0 if joint.side == "right" else -1.0)
    sheet.keep(points[:: PLACES // SIDES])
    real = _radius(scene, joint) * sheet.metre
    if rolls:
        with sheet.on(joint.second, grow=f"{joint.name}/roller" if real > 1.6 * style.PIN else ""):
            radius, roller = max(real, 1.6 * style.PIN), f"joint-{joint.name}-roller"
            sheet.circle(center, radius, fill=style.PAPER, z=style.Z_BLOCK, gid=roller)
    with sheet.on(joint.second):
        follower = symbols.pin if rolls or corners is None else symbols.dot
        follower(sheet, center, f"joint-{joint.name}-follower")
    return corners


def tangent(scene: DrawnScene, joint: Curve, pose: int) -> Array:
    """Return the direction of growing s nearest to the follower."""
    points = curve_points(scene, joint, pose)
    middles = (points[1:] + points[:-1]) / 2
    k = int(np.argmin(np.hypot(*(middles - scene.place(joint.second, pose)).T)))
    return unit(points[k + 1] - points[k])


def _radius(scene: DrawnScene, joint: Curve) -> float:
    return scene.numbers.get(f"{joint.name}.roller_radius", 0.0)


def _area(points: Array) -> float:
    """Return the area a line runs around, positive counter-clockwise."""
    x, y = points.T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2


def _hatch(sheet: Sheet, points: Array, left: float) -> None:
    """Draw hatching along a fixed curve, on its left for 1."""
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    places = np.arange(0.75 * style.HATCH, length[-1], style.HATCH)
    k = np.searchsorted(length, places, side="right") - 1
    steps = points[k + 1] - points[k]
    along = steps / np.hypot(steps[:, 0], steps[:, 1])[:, None]
    side = np.stack([-along[:, 1], along[:, 0]], axis=-1)
    tips = points[k] + style.HATCH * (left * side - 0.9 * along)
    sheet.strokes(points[k], tips, color=style.GROUND, width=style.THIN, z=style.Z_GROUND)
