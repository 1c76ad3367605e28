"""The symbols of kinematic diagrams, after ISO 3952 and GOST 2.770.

Each function draws one symbol on a `Sheet`; positions and lengths are in its units.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdae.draw import style
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import Sheet, arc, normal, unit

DOWN = np.array([0.0, -1.0])


def pin(sheet: Sheet, center: Array, gid: str) -> None:
    """Draw a turning pair: a small open circle."""
    sheet.circle(
        center, style.PIN, fill=style.PAPER, width=1.4 * style.LINE, z=style.Z_PIN, gid=gid
    )


def dot(sheet: Sheet, center: Array, gid: str, color: str = style.INK) -> None:
    """Draw a point of a link that is no joint."""
    sheet.circle(center, style.DOT, fill=color, edge=color, z=style.Z_PIN, gid=gid)


TEETH, TOOTH = 5.0, 7.0
"""Height of a rack behind its pitch line."""


def hatch(sheet: Sheet, start: Array, end: Array, side: Array, gid: str | None = None) -> None:
    """Draw the line of a fixed surface with hatching on its `side`."""
    sheet.line([start, end], color=style.GROUND, z=style.Z_GROUND, gid=gid)
    ends = hatching(start, end, side)
    sheet.strokes(*ends, color=style.GROUND, width=style.THIN, z=style.Z_GROUND)
    _keep_strip(sheet, start, end, side)


def hatching(start: Array, end: Array, side: Array) -> tuple[Array, Array]:
    """Return where the strokes of a hatched line begin and end."""
    along, length = unit(end - start), float(np.hypot(*(end - start)))
    count = max(round(length / style.HATCH), 2)
    feet = start + np.outer((np.arange(count) + 0.75) * length / count, along)
    return feet, feet + style.HATCH * (side - 0.9 * along)


def _hatch_arc(sheet: Sheet, feet: Array, out: Array) -> None:
    """Draw hatching from places on an arc, `out` of it."""
    tips = feet + style.HATCH * (out - 0.8 * np.stack([-out[:, 1], out[:, 0]], axis=-1))
    color, width, z = style.GROUND, style.THIN, style.Z_MARK
    sheet.strokes(feet, tips, color=color, width=width, z=z, weight=style.SOLID)


def _keep_strip(sheet: Sheet, start: Array, end: Array, side: Array) -> None:
    """Keep labels off the hatching: its outer border, and its box if it is upright."""
    shift = style.HATCH * side
    sheet.keep([start + shift, end + shift])
    if min(abs(side)) < 1e-9:
        corners = np.array([start, end, start + shift, end + shift])
        sheet.box(corners.min(axis=0), corners.max(axis=0))


def support(sheet: Sheet, center: Array, gid: str) -> None:
    """Draw the triangle and the hatched ground under a fixed pin."""
    half, height = style.SUPPORT
    left, right = center - np.array([half, height]), center + np.array([half, -height])
    sheet.area([center, left, right], z=style.Z_GROUND, edge=style.GROUND, gid=gid)
    sheet.box(left + np.array([half / 2, 0.0]), center + np.array([half / 2, 0.0]))
    reach = np.array([4.5, 0.0])
    hatch(sheet, left - reach, right + reach, DOWN)


def block(sheet: Sheet, center: Array, along: Array, gid: str) -> None:
    """Draw a slider: a rectangle along its guide."""
    sheet.area(rectangle(center, along), z=style.Z_BLOCK, width=1.4 * style.LINE, gid=gid)
    inner = style.BLOCK[1]
    sheet.box(center - inner, center + inner)


def rectangle(center: Array, along: Array, room: float = 0.0) -> Array:
    """Return the corners of a block, with so much room around it."""
    a, b = (style.BLOCK[0] + room) * along, (style.BLOCK[1] + room) * normal(along)
    return np.array([center - a - b, center + a - b, center + a + b, center - a + b])


def slot(sheet: Sheet, start: Array, end: Array, gid: str, color: str = style.INK) -> None:
    """Draw the rounded outline of a slot between the extreme places of its pin."""
    along = unit(end - start)
    turn = float(np.arctan2(along[1], along[0]))
    outline = np.vstack(
        [
            arc(start, style.SLOT, turn + np.pi / 2, turn + 3 * np.pi / 2, 12),
            arc(end, style.SLOT, turn - np.pi / 2, turn + np.pi / 2, 12),
        ]
    )
    sheet.area(outline, edge=color, width=1.4 * style.LINE, z=style.Z_BLOCK, gid=gid)


def groove(sheet: Sheet, points: Array, gid: str, color: str = style.INK) -> None:
    """Draw a curved slot along the path of its pin."""
    edge = 1.4 * style.LINE
    sheet.line(points, width=2 * style.SLOT, color=color, z=style.Z_FILL, gid=gid, weight=0)
    inner = 2 * (style.SLOT - edge)
    sheet.line(points, width=inner, color=style.PAPER, z=style.Z_FILL, weight=0)


def bridge(sheet: Sheet, center: Array, along: Array, side: Array, gid: str, color: str) -> None:
    """Draw the half-arc by which a bar runs past a pin without a break."""
    turn = float(np.arctan2(along[1], along[0]))
    sign = 1.0 if float(normal(along) @ side) > 0 else -1.0
    points = arc(center, 2.1 * style.PIN, turn, turn + sign * np.pi, 16)
    sheet.line(points, width=0.8 * style.BAR, color=color, z=style.Z_BAR, gid=gid, weight=0)
    sheet.keep(points[::4])


def corner(
    sheet: Sheet, center: Array, arms: Sequence[Array], gid: str | None, color: str = style.INK
) -> None:
    """Draw the filled corner of a rigid connection between two directions."""
    (first, second), size = (unit(arm) for arm in arms), 2.6 * style.PIN
    if abs(float(first @ normal(second))) < 0.1:
        side = 0.5 * size * normal(first)
        points = [center - side, center + 0.9 * size * first, center + side]
    else:
        points = [center, center + size * first, center + size * second]
    sheet.area(points, fill=color, edge=color, z=style.Z_BAR, width=style.THIN, gid=gid)


def weld(sheet: Sheet, center: Array, arms: Sequence[Array], gid: str) -> None:
    """Draw a rigid connection: a filled corner, or a filled square without two directions."""
    if len(arms) >= 2 and abs(float(unit(arms[0]) @ normal(unit(arms[1])))) >= 0.1:
        corner(sheet, center, arms[:2], gid)
        return
    half = 0.9 * style.PIN
    square = center + half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    sheet.area(square, fill=style.INK, z=style.Z_PIN, gid=gid)


def pitch_circle(
    sheet: Sheet, center: Array, radius: float, gid: str, color: str = style.WHEEL
) -> None:
    """Draw a toothed wheel by its pitch circle."""
    sheet.circle(center, radius, edge=color, dash=style.DASH_DOT, gid=gid, weight=style.RING)


def rim(sheet: Sheet, center: Array, radius: float, gid: str, color: str = style.WHEEL) -> None:
    """Draw a smooth wheel, a pulley or a roller."""
    sheet.circle(center, radius, edge=color, gid=gid, weight=style.RING)


def fixed_rim(sheet: Sheet, center: Array, radius: float, outward: float) -> None:
    """Draw hatching along four short arcs of a wheel that is fixed."""
    for middle in np.deg2rad([45.0, 135.0, 225.0, 315.0]):
        span = min(22.0 / radius, 0.5)
        points = arc(center, radius, middle - span, middle + span, 12)
        sheet.line(points, color=style.GROUND)
        feet = points[1::2]
        out = outward * (feet - center) / radius
        _hatch_arc(sheet, feet, out)


def toothed_line(sheet: Sheet, start: Array, end: Array, side: Array, gid: str) -> None:
    """Draw a rack: its pitch line, and its body on the `side` away from the wheel."""
    sheet.line([start, end], color=style.WHEEL, dash=style.DASH_DOT, gid=gid, weight=style.RING)
    along, depth = unit(end - start), TEETH
    count = max(int(np.hypot(*(end - start)) / TOOTH), 2)
    steps = np.linspace(0.0, float(np.hypot(*(end - start))), 4 * count + 1)
    heights = np.tile([0.0, 0.0, 1.0, 1.0], count + 1)[: len(steps)]
    teeth = start + np.outer(steps, along) + np.outer(depth * (0.3 + 0.7 * heights), side)
    sheet.line(teeth, z=style.Z_BAR)


def arrow(sheet: Sheet, points: Array, gid: str, color: str = style.ARROW) -> None:
    """Draw a line with an arrow head at its end."""
    behind = points[max(len(points) - 4, 0)] if len(points) > 4 else points[0]
    back = points[-1] - 8.0 * unit(points[-1] - behind)
    shaft = points[:-2] if len(points) > 4 else np.array([points[0], back])
    sheet.line(shaft, color=color, width=1.3 * style.LINE, gid=gid)
    tip(sheet, behind, points[-1], color)


def tip(
    sheet: Sheet, start: Array, end: Array, color: str, z: float = style.Z_MARK,
    size: tuple[float, float] = (8.0, 3.2),
) -> None:  # fmt: skip
    """Draw the head of an arrow that ends at a place; ``size`` is its length and half width."""
    along = unit(end - start)
    back, side = end - size[0] * along, size[1] * normal(along)
    sheet.area([end, back + side, back - side], fill=color, edge=color, width=0.3, z=z)


def end_on(sheet: Sheet, center: Array, towards: bool, gid: str) -> Array:
    """Draw the arrow of a load seen end-on: a ring with a dot or, away from the eye, a cross.

    Returns
    -------
    numpy.ndarray
        A place on the ring.
    """
    radius = 1.7 * style.PIN
    sheet.circle(center, radius, edge=style.LOAD, width=style.LINE, gid=gid)
    if towards:
        dot(sheet, center, gid, style.LOAD)
    else:
        half = radius * np.sqrt(0.5) * np.array([(1.0, 1.0), (1.0, -1.0)])
        sheet.strokes(center - half, center + half, color=style.LOAD, gid=gid)
    edge: Array = center + np.array([radius, 0.0])
    return edge


def spring(sheet: Sheet, start: Array, end: Array, gid: str) -> None:
    """Draw a compression or tension spring: a zigzag between two straight ends."""
    along, length = unit(end - start), float(np.hypot(*(end - start)))
    straight = min(9.0, 0.2 * length)
    count = int(np.clip((length - 2 * straight) / 7.0, 3, 14))
    steps = np.linspace(straight, length - straight, 2 * count + 1)
    sides = np.zeros(2 * count + 1)
    sides[1::2] = style.COIL * np.where(np.arange(count) % 2, -1.0, 1.0)
    coil = start + np.outer(steps, along) + np.outer(sides, normal(along))
    sheet.line([start, *coil, end], color=style.LOAD, gid=gid)


def damper(sheet: Sheet, start: Array, end: Array, gid: str) -> None:
    """Draw a damper: a cylinder open at one end, with its piston."""
    along = unit(end - start)
    side = normal(along)
    reach, half = style.POT
    reach = min(reach, 0.35 * float(np.hypot(*(end - start))))
    middle = (start + end) / 2
    back, front = middle - reach * along, middle + reach * along
    cup = [front + half * side, back + half * side, back - half * side, front - half * side]
    sheet.line([start, back], gid=gid, color=style.LOAD)
    sheet.line(cup, color=style.LOAD)
    piston = middle + 0.25 * reach * along
    sheet.line([piston, end], color=style.LOAD)
    inner = 0.7 * half * side
    sheet.line([piston - inner, piston + inner], width=1.5 * style.LINE, color=style.LOAD)


def spiral(sheet: Sheet, center: Array, gid: str) -> None:
    """Draw a torsion spring around a pin."""
    angles = np.linspace(0.0, 5 * np.pi, 90)
    radii = np.linspace(1.6 * style.PIN, 3.6 * style.PIN, 90)
    points = center + radii[:, None] * np.stack([np.cos(angles), np.sin(angles)], -1)
    sheet.line(points, color=style.LOAD, width=style.THIN, gid=gid)


def brake(sheet: Sheet, center: Array, angle: float, gid: str) -> None:
    """Draw a damper of a turning pair: an open ring with a vane in it."""
    radius = 4.3 * style.PIN
    out = np.array([np.cos(angle), np.sin(angle)])
    for shift in (-0.5, 0.5):
        r = radius + shift * style.POT[1] * 1.6
        sheet.line(arc(center, r, angle - 0.75, angle + 0.55, 12), gid=gid, color=style.LOAD)
    low, high = radius - 0.8 * style.POT[1], radius + 0.8 * style.POT[1]
    shut = np.array([np.cos(angle + 0.55), np.sin(angle + 0.55)])
    sheet.line([center + low * shut, center + high * shut], color=style.LOAD)
    vane = [center + (low + 1.2) * out, center + (high - 1.2) * out]
    sheet.line(vane, width=1.5 * style.LINE, color=style.LOAD)
    sheet.line(arc(center, radius, angle - 1.1, angle, 8), color=style.LOAD)


def jaws(sheet: Sheet, center: Array, along: Array, gid: str, fixed: bool = True) -> None:
    """Draw a link that is held: two jaws on its bar, hatched if the ground holds it."""
    across, half = normal(along), style.JAW / 2 * along
    for side in (across, -across):
        foot = center + 2.0 * style.BAR * side
        sheet.line([foot - half, foot + half], width=1.6 * style.LINE, gid=gid)
        if fixed:
            hatch(sheet, foot - half, foot + half, side)


def stops(
    sheet: Sheet, center: Array, along: Array, reach: float, gid: str, fixed: bool = True
) -> None:
    """Draw what cannot slide: a stop at either side, hatched if the ground holds it."""
    half = style.JAW / 2 * normal(along)
    for side in (along, -along):
        foot = center + (reach + 0.7 * style.BAR) * side
        sheet.line([foot - half, foot + half], width=style.BAR, gid=gid)
        if fixed:
            hatch(sheet, foot - half, foot + half, side)


def shoe(sheet: Sheet, center: Array, radius: float, gid: str, fixed: bool = True) -> None:
    """Draw a wheel that is held: a brake shoe on either side of its rim."""
    span = min(style.JAW / radius, 0.6)
    for middle in (np.deg2rad(160.0), np.deg2rad(-20.0)):
        gap = radius + 1.2 * style.BAR
        points = arc(center, gap, middle - span / 2, middle + span / 2, 12)
        sheet.line(points, width=style.BAR, gid=gid)
        if fixed:
            _hatch_arc(sheet, points[1::3], (points[1::3] - center) / gap)


def tie(sheet: Sheet, center: Array, first: Array, second: Array, gid: str) -> None:
    """Draw two links whose angle is held: a strut between their bars."""
    ends = [center + style.GRIP * first, center + style.GRIP * second]
    sheet.line(ends, width=style.BAR, gid=gid)
    for end in ends:
        sheet.circle(end, 0.5 * style.PIN, fill=style.INK)


def barrel(sheet: Sheet, eye: Array, back: Array, mouth: Array, gid: str) -> None:
    """Draw the eye and the closed barrel of a hydraulic cylinder."""
    half = style.BLOCK[1] * normal(unit(mouth - back))
    sheet.line([eye, back], width=style.BAR, z=style.Z_BLOCK, gid=f"{gid}-eye")
    corners = [back - half, back + half, mouth + half, mouth - half]
    sheet.area(corners, z=style.Z_BLOCK, width=1.4 * style.LINE, gid=gid)
    sheet.box(np.minimum(back, mouth), np.maximum(back, mouth), style.SHADE)


def piston(sheet: Sheet, center: Array, along: Array, gid: str, color: str = style.INK) -> None:
    """Draw the piston in the barrel of a cylinder."""
    head, width = 0.85 * style.BLOCK[1] * normal(along), 1.5 * style.BAR
    ends = [center - head, center + head]
    sheet.line(ends, width=width, color=color, z=style.Z_BAR, gid=f"{gid}-piston")


def mass_center(sheet: Sheet, center: Array, gid: str, angle: float = 0.0) -> None:
    """Draw a centre of mass: a circle with two quarters filled, which turn with the body."""
    radius = 1.3 * style.DOT
    sheet.circle(center, radius, fill=style.PAPER, width=style.THIN, gid=gid)
    for start in (angle, angle + np.pi):
        rim_points = arc(center, radius, start, start + np.pi / 2, 6)
        quarter = [center, *rim_points]
        sheet.area(quarter, fill=style.INK, edge="none", width=0.0, weight=0)


def scale_bar(sheet: Sheet, start: Array, length: float, gid: str) -> None:
    """Draw a measured length with end ticks."""
    end, tick = start + np.array([length, 0.0]), np.array([0.0, 3.0])
    points = [start + tick, start - tick, start, end, end + tick, end - tick]
    sheet.line(points, color=style.FAINT, z=style.Z_LABEL, gid=gid)
