"""Guides, blocks and slots: the pairs in which something slides."""

from __future__ import annotations

import numpy as np

from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND
from mechdae.draw import style
from mechdae.draw.diagram import symbols
from mechdae.draw.diagram.scene import Array, DrawnScene
from mechdae.draw.diagram.shapes import HiddenStretch, edges, pieces, shape_of
from mechdae.draw.sheet import Sheet, normal, unit

REACH = 2.5
"""A guide is drawn at most so many sizes of the mechanism beyond its block."""


def axis_of(scene: DrawnScene, joint: Joint, pose: int) -> Array:
    """Return the direction of a guide or slot."""
    return scene.direction(joint.first_body, scene.numbers[f"{joint.name}.axis"], pose)


def travel(scene: DrawnScene, joint: Joint, pose: int, size: float) -> tuple[float, float]:
    """Return the least and greatest slide [m] of all poses, near the one drawn."""
    slides = scene.slide(joint)
    now = float(slides[pose])
    near = np.clip(slides[np.isfinite(slides)], now - REACH * size, now + REACH * size)
    return float(near.min()), float(near.max())


def gaps_of(
    sheet: Sheet, scene: DrawnScene, pose: int, size: float
) -> dict[str, list[HiddenStretch]]:
    """Return for each body the stretches of its bars hidden by blocks and slots."""
    result: dict[str, list[HiddenStretch]] = {}
    for joint in scene.joints(pose):
        if joint.name in scene.cylinders:
            continue
        if joint.guide:
            center = sheet.at(scene.place(joint.second, pose))
            reach = style.BLOCK[0] * axis_of(scene, joint, pose)
            gap = HiddenStretch(center - reach, center + reach)
        elif joint.slot:
            start, end = _slot_ends(sheet, scene, joint, pose, size)
            reach = style.SLOT * unit(end - start)
            gap = HiddenStretch(start - reach, end + reach)
        else:
            continue
        result.setdefault(joint.first_body, []).append(gap)
    return result


def cylinder_of(
    sheet: Sheet, scene: DrawnScene, joint: Joint, pose: int
) -> tuple[Array, Array, Array]:
    """Return where a cylinder's barrel begins and ends on the sheet, and its piston.

    The barrel ends before the shortest travel; the piston is where the travel is in it.
    """
    eye, tip = (sheet.at(scene.place(side, pose)) for side in (joint.first, joint.second))
    along, now = unit(tip - eye), float(np.hypot(*(tip - eye)))
    lengths = np.abs(scene.slide(joint)) * sheet.metre
    lengths = lengths[np.isfinite(lengths)]
    least, most = float(lengths.min()), float(lengths.max())
    back = min(style.BARREL, 0.2 * now)
    mouth = float(np.clip(0.85 * least, 0.45 * now, 0.85 * now))
    share = (now - least) / (most - least) if most > least else 0.5
    piston = back + (0.15 + 0.7 * share) * (mouth - back)
    return eye + back * along, eye + mouth * along, eye + piston * along


def draw_guides(
    sheet: Sheet, scene: DrawnScene, pose: int, size: float, colors: dict[str, str]
) -> dict[str, list[tuple[Array, Array]]]:
    """Draw all sliding pairs; return the lines of moving guides by body."""
    gaps = gaps_of(sheet, scene, pose, size)
    lines: dict[str, list[tuple[Array, Array]]] = {}
    for joint in scene.joints(pose):
        if joint.name in scene.cylinders:
            parts = _draw_cylinder(sheet, scene, joint, pose, colors)
            lines.setdefault(joint.second_body, []).append(parts.pop())
        elif joint.guide:
            parts = _draw_prismatic(sheet, scene, joint, pose, size, gaps, colors)
        elif joint.slot:
            parts = _draw_slot(sheet, scene, joint, pose, size, colors)
        else:
            continue
        lines.setdefault(joint.first_body, []).extend(parts)
    return lines


def _draw_cylinder(
    sheet: Sheet, scene: DrawnScene, joint: Joint, pose: int, colors: dict[str, str]
) -> list[tuple[Array, Array]]:
    """Draw a cylinder; return the lines of its barrel and of its rod."""
    eye, tip = (sheet.at(scene.place(side, pose)) for side in (joint.first, joint.second))
    back, mouth, piston = cylinder_of(sheet, scene, joint, pose)
    color = colors.get(joint.second_body, style.INK)
    symbols.cylinder(sheet, eye, back, mouth, piston, tip, f"joint-{joint.name}-cylinder", color)
    return [(eye, mouth), (mouth, tip)]


def _draw_prismatic(
    sheet: Sheet,
    scene: DrawnScene,
    joint: Joint,
    pose: int,
    size: float,
    gaps: dict[str, list[HiddenStretch]],
    colors: dict[str, str],
) -> list[tuple[Array, Array]]:
    center = sheet.at(scene.place(joint.second, pose))
    axis = axis_of(scene, joint, pose)
    low, high = travel(scene, joint, pose, size)
    now = float(scene.slide(joint)[pose])
    start = center + (low - now) * sheet.metre * axis
    end = center + (high - now) * sheet.metre * axis
    symbols.block(sheet, center, axis, f"joint-{joint.name}-prismatic")
    margin = (style.BLOCK[0] + 7.0) * axis
    if joint.first_body == GROUND:
        side = _clear_side(sheet, scene, joint, pose, (start - margin, end + margin))
        shift = style.BLOCK[1] * side
        symbols.hatch(
            sheet, start - margin + shift, end + margin + shift, side, f"joint-{joint.name}-guide"
        )
        return []
    if joint.second_body == GROUND:
        side = guide_side(axis, center, sheet.at(_middle(scene, pose)))
        shift, half = style.BLOCK[1] * side, style.BLOCK[0] * axis
        symbols.hatch(sheet, center - half + shift, center + half + shift, side)
    origin = sheet.at(scene.place(joint.first, pose))
    reach = [float((spot - origin) @ axis) for spot in (start - margin, end + margin)]
    ends = origin + min(0.0, *reach) * axis, origin + max(0.0, *reach) * axis
    covered = _covered(sheet, scene, joint.first_body, pose)
    drawn = [
        part
        for a, b in pieces(*ends, covered)
        for part in pieces(a, b, gaps.get(joint.first_body, []))
    ]
    for part in drawn:
        sheet.line(
            part,
            color=colors.get(joint.first_body, style.INK),
            width=style.BAR,
            z=style.Z_BAR,
            gid=f"joint-{joint.name}-guide",
        )
    if drawn:
        _draw_corner(sheet, scene, joint, pose, center)
    return drawn


def _clear_side(
    sheet: Sheet, scene: DrawnScene, joint: Joint, pose: int, ends: tuple[Array, Array]
) -> Array:
    """Return the side of a fixed guide that fewer bars cross, in a motion in all its poses."""
    key, poses = f"guide-{joint.name}", [pose]
    if sheet.memory is not None:
        if key in sheet.memory:
            return sheet.memory[key]
        known = scene.assembled()
        poses = known[:: max(len(known) // 12, 1)]
    axis = axis_of(scene, joint, pose)
    side = guide_side(axis, (ends[0] + ends[1]) / 2, sheet.at(_middle(scene, pose)))
    bars = [bar for k in poses for bar in _other_bars(sheet, scene, joint.second_body, k)]

    def crossed(way: Array) -> int:
        shift = style.BLOCK[1] * way
        return _crossings(ends[0] + shift, ends[1] + shift, bars)

    side = min((side, -side), key=crossed)
    if sheet.memory is not None:
        sheet.memory[key] = side
    return side


def _draw_corner(sheet: Sheet, scene: DrawnScene, joint: Joint, pose: int, center: Array) -> None:
    """Mark where a moving guide is fixed to a bar of its body."""
    origin = sheet.at(scene.place(joint.first, pose))
    toward = center - origin
    if np.hypot(*toward) < 2.2 * style.BLOCK[0]:
        toward = -axis_of(scene, joint, pose) * np.sign(
            float(toward @ axis_of(scene, joint, pose)) or 1.0
        )
    for point in scene.mechanism.body(joint.first_body).points:
        arm = sheet.at(scene.place(f"{joint.first_body}.{point}", pose)) - origin
        if np.hypot(*arm) > style.BLOCK[0] and abs(unit(arm) @ normal(unit(toward))) > 0.1:
            symbols.corner(sheet, origin, (toward, arm), f"joint-{joint.name}-corner")


def _covered(sheet: Sheet, scene: DrawnScene, body: str, pose: int) -> list[HiddenStretch]:
    """Return the stretch of a moving guide that the body's own bar draws."""
    shape = shape_of(scene, body)
    if shape.kind != "bar":
        return []
    a, b = (
        sheet.at(scene.place(f"{body}.{point}", pose))
        for point in (shape.points[0], shape.points[-1])
    )
    return [HiddenStretch(a, b)]


def guide_side(axis: Array, center: Array, middle: Array) -> Array:
    """Return the side of a guide that is hatched: below, or away from the mechanism."""
    side = normal(axis)
    if abs(side[1]) < 0.35:
        side = side if float(side @ (middle - center)) < 0 else -side
    elif side[1] > 0:
        side = -side
    return side


def _other_bars(sheet: Sheet, scene: DrawnScene, own: str, pose: int) -> list[tuple[Array, Array]]:
    """Return the lines of all bodies but one."""
    return [
        (sheet.at(scene.place(f"{name}.{a}", pose)), sheet.at(scene.place(f"{name}.{b}", pose)))
        for name in scene.mechanism.bodies
        if name != own and scene.shown(name, pose)
        for a, b in edges(shape_of(scene, name))
    ]


def _crossings(start: Array, end: Array, lines: list[tuple[Array, Array]]) -> int:
    """Return how many lines a stretch of guide crosses."""
    out = normal(end - start)
    count = 0
    for a, b in lines:
        across = float((a - start) @ out) * float((b - start) @ out)
        beyond = float((start - a) @ normal(b - a)) * float((end - a) @ normal(b - a))
        count += across < 0 and beyond < 0
    return count


def _middle(scene: DrawnScene, pose: int) -> Array:
    """Return the mean of all joints' points."""
    points = [
        scene.place(reference, pose)
        for joint in scene.joints(pose)
        for reference in (joint.first, joint.second)
    ]
    middle: Array = np.mean(points, axis=0)
    return middle


def _slot_ends(
    sheet: Sheet, scene: DrawnScene, joint: Joint, pose: int, size: float
) -> tuple[Array, Array]:
    """Return the places of the pin at the ends of the slot, with some play."""
    low, high = travel(scene, joint, pose, size)
    now, axis = float(scene.slide(joint)[pose]), axis_of(scene, joint, pose)
    center = sheet.at(scene.place(joint.first, pose)) + now * sheet.metre * axis
    play = 4.0 if high > low else 5.0 * style.PIN
    below = center + ((low - now) * sheet.metre - play) * axis
    above = center + ((high - now) * sheet.metre + play) * axis
    return below, above


def _draw_slot(
    sheet: Sheet,
    scene: DrawnScene,
    joint: Joint,
    pose: int,
    size: float,
    colors: dict[str, str],
) -> list[tuple[Array, Array]]:
    start, end = _slot_ends(sheet, scene, joint, pose, size)
    body, axis = joint.first_body, axis_of(scene, joint, pose)
    color = colors.get(body, style.INK)
    symbols.slot(sheet, start, end, f"joint-{joint.name}-pin-in-slot", color)
    if body == GROUND:
        side = guide_side(axis, (start + end) / 2, sheet.at(_middle(scene, pose)))
        shift = style.SLOT * side
        symbols.hatch(sheet, start + shift, end + shift, side)
        return []
    origin = sheet.at(scene.place(joint.first, pose))
    near = min((start, end), key=lambda spot: float(np.hypot(*(spot - origin))))
    reach = style.SLOT * unit(near - (start + end) / 2)
    outside = abs(float((origin - (start + end) / 2) @ axis)) > (
        float(np.hypot(*(end - start))) / 2 + style.SLOT
    )
    foot = near + reach if outside else near
    drawn = pieces(origin, foot, _covered(sheet, scene, body, pose))
    for part in drawn if outside else []:
        sheet.line(part, color=color, width=style.BAR, z=style.Z_BAR)
    return [(start, end)]
