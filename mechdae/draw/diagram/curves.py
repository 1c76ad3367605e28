"""Curve joints: cams and their rollers, grooves and tracks."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mechdae.describe.joints.curve import Curve, place, span
from mechdae.describe.mechanism import GROUND
from mechdae.draw import style
from mechdae.draw.diagram import symbols
from mechdae.draw.diagram.scene import Array, DrawnScene
from mechdae.draw.sheet import Sheet, normal, unit

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
