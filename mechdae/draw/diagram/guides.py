"""Guides, blocks and slots: the pairs in which something slides."""

from __future__ import annotations

import numpy as np

from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND
from mechdae.draw import style
from mechdae.draw.diagram import symbols
from mechdae.draw.diagram.places import edges, shape_of
from mechdae.draw.diagram.scene import DrawnScene
from mechdae.draw.labels.layout import cuts
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import Sheet, normal, unit

MOUTH, PISTON = 0.85, 0.75
"""Ends of a cylinder's barrel, and of its piston's way, over the shortest travel."""
REACH = 2.5
"""A guide is drawn at most so many sizes of the mechanism beyond its block."""
USUAL = 250.0
"""Size of a mechanism in a picture of usual size [units]."""


def travel(scene: DrawnScene, joint: Joint, pose: int, size: float) -> tuple[float, float]:
    """Return the least and greatest slide [m] of all poses, near the one drawn."""
    slides = scene.slide(joint)
    now = float(slides[pose])
    near = np.clip(slides[np.isfinite(slides)], now - REACH * size, now + REACH * size)
    return float(near.min()), float(near.max())


def guide_ends(scene: DrawnScene, joint: Joint, pose: int, size: float) -> Array:
    """Return the places [m] between which what slides is in all poses, (2, 2)."""
    ways = np.outer(travel(scene, joint, pose, size), scene.axis(joint, pose))
    return scene.place(joint.first, pose) + ways


def cylinder_of(
    sheet: Sheet, scene: DrawnScene, joint: Joint, pose: int
) -> tuple[Array, Array, Array, float]:
    """Return where a cylinder's barrel begins and ends on the sheet, its piston, and its share.

    The barrel ends before the shortest travel; the piston has a share of the travel.
    """
    eye, tip = (sheet.at(scene.place(side, pose)) for side in (joint.first, joint.second))
    lengths = np.abs(scene.slide(joint)) * sheet.metre
    least, most = float(np.nanmin(lengths)), float(np.nanmax(lengths))
    along, share = unit(tip - eye), PISTON * least / most
    back = eye + min(style.BARREL, 0.2 * least) * along
    return back, eye + MOUTH * least * along, eye + share * (tip - eye), share


def draw_guides(
    sheet: Sheet, scene: DrawnScene, pose: int, size: float, colors: dict[str, str]
) -> dict[str, list[tuple[Array, Array]]]:
    """Draw all sliding pairs; return the lines of moving guides by body."""
    lines: dict[str, list[tuple[Array, Array]]] = {}
    for joint in scene.joints(pose):
        if joint.name in scene.cylinders:
            parts = _draw_cylinder(sheet, scene, joint, pose, colors)
            lines.setdefault(joint.second_body, []).append(parts.pop())
        elif joint.guide:
            parts = _draw_prismatic(sheet, scene, joint, pose, size, colors)
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
    back, mouth, piston, share = cylinder_of(sheet, scene, joint, pose)
    color, gid = colors.get(joint.second_body, style.INK), f"joint-{joint.name}-cylinder"
    ends, way = (joint.first, joint.second), f"{joint.first}>{joint.second}"
    near = "low" if np.nanmin(scene.slide(joint)) >= 0 else "high"
    held = (joint.first, f"{joint.name}/{near}")
    with sheet.on(*held, turn=way, span=True, weight=(0.0, 0.0, MOUTH, MOUTH)):
        symbols.barrel(sheet, eye, back, mouth, gid)
    with sheet.on(*ends, turn=way, span=True, weight=(share,)):
        symbols.piston(sheet, piston, unit(tip - eye), gid, color)
    with sheet.on(*ends, turn=way, span=True, weight=(share, 1.0)):
        sheet.line([piston, tip], width=style.BAR, color=color, z=style.Z_BAR, gid=f"{gid}-rod")
    return [(eye, mouth), (mouth, tip)]


def _draw_prismatic(
    sheet: Sheet, scene: DrawnScene, joint: Joint, pose: int, size: float, colors: dict[str, str]
) -> list[tuple[Array, Array]]:
    center = sheet.at(scene.place(joint.second, pose))
    axis, turn = scene.axis(joint, pose), f"{joint.name}/axis"
    start, end = sheet.at(guide_ends(scene, joint, pose, size))
    with sheet.on(joint.second, turn=turn):
        symbols.block(sheet, center, axis, f"joint-{joint.name}-prismatic")
    margin = (style.BLOCK[0] + 7.0) * axis
    ends = (f"{joint.name}/low", f"{joint.name}/high")
    if joint.first_body == GROUND:
        side = _clear_side(sheet, scene, joint, pose, size)
        shift, gid = style.BLOCK[1] * side, f"joint-{joint.name}-guide"
        with sheet.on(*ends, turn=turn, span=True):
            symbols.hatch(sheet, start - margin + shift, end + margin + shift, side, gid)
        return []
    if joint.second_body == GROUND:
        side = guide_side(axis, center, sheet.at(_middle(scene, pose)))
        shift, half = style.BLOCK[1] * side, style.BLOCK[0] * axis
        with sheet.on(joint.second, turn=turn):
            symbols.hatch(sheet, center - half + shift, center + half + shift, side)
    origin = sheet.at(scene.place(joint.first, pose))
    reach = [float((spot - origin) @ axis) for spot in (start - margin, end + margin)]
    line = origin + min(0.0, *reach) * axis, origin + max(0.0, *reach) * axis
    points = (
        ends[0] if min(reach) < 0 else joint.first,
        ends[1] if max(reach) > 0 else joint.first,
    )
    color = colors.get(joint.first_body, style.INK)
    with sheet.on(*points, turn=turn):
        gid = f"joint-{joint.name}-guide"
        sheet.line(line, color=color, width=style.BAR, z=style.Z_SLID, gid=gid)
    with sheet.on(joint.first, turn=joint.first_body):
        _draw_corner(sheet, scene, joint, pose, center)
    return [line]


def _clear_side(sheet: Sheet, scene: DrawnScene, joint: Joint, pose: int, size: float) -> Array:
    """Return the side of a fixed guide that fewer bars cross, in a motion in all its poses.

    It is the same at every scale: the wall is as far off as in a picture of usual size.
    """
    key, poses = f"guide-{joint.name}", [pose]
    if sheet.memory is not None:
        if key in sheet.memory:
            return sheet.memory[key]
        known = scene.assembled() or [pose]
        poses = known[:: max(len(known) // 12, 1)]
    axis, ends = scene.axis(joint, pose), guide_ends(scene, joint, pose, size)
    middle = np.mean([_middle(scene, k) for k in poses], axis=0)
    side = guide_side(axis, ends.mean(axis=0), middle)
    bars = np.vstack([_other_bars(scene, joint.second_body, k) for k in poses])
    spots = np.vstack([bars.reshape(-1, 2), middle])
    step = float(np.ptp(spots, axis=0).max()) / USUAL
    ends += step * (style.BLOCK[0] + 7.0) * np.outer([-1.0, 1.0], axis)

    def crossed(way: Array) -> float:
        line = ends + step * style.BLOCK[1] * way
        return float(cuts(line[:1], line[1:], bars)[0])

    side = min((side, -side), key=crossed)
    if sheet.memory is not None:
        sheet.memory[key] = side
    return side


def _draw_corner(sheet: Sheet, scene: DrawnScene, joint: Joint, pose: int, center: Array) -> None:
    """Mark where a moving guide is fixed to a bar of its body."""
    origin = sheet.at(scene.place(joint.first, pose))
    toward, axis = center - origin, scene.axis(joint, pose)
    if np.hypot(*toward) < 2.2 * style.BLOCK[0]:
        toward = -axis * np.sign(float(toward @ axis) or 1.0)
    for point in scene.points(joint.first_body):
        arm = sheet.at(scene.place(point, pose)) - origin
        if np.hypot(*arm) > style.BLOCK[0] and abs(unit(arm) @ normal(unit(toward))) > 0.1:
            symbols.corner(sheet, origin, (toward, arm), f"joint-{joint.name}-corner")


def guide_side(axis: Array, center: Array, middle: Array) -> Array:
    """Return the side of a guide that is hatched: below, or away from the mechanism."""
    side = normal(axis)
    if abs(side[1]) < 0.35:
        away = float(side @ (center - middle))  # nothing but rounding where it is in line
        side = side if away > 1e-9 * float(np.hypot(*(center - middle))) else -side
    elif side[1] > 0:
        side = -side
    return side


def _other_bars(scene: DrawnScene, body: str, pose: int) -> Array:
    """Return the lines [m] of all bodies but one, (n, 4)."""
    ends = [
        [scene.place(f"{name}.{point}", pose) for point in pair]
        for name in scene.mechanism.bodies
        if name != body and scene.shown(name, pose)
        for pair in edges(shape_of(scene, name))
    ]
    return np.reshape(ends, (-1, 4))


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
    low, high = sheet.at(guide_ends(scene, joint, pose, size))
    play = (4.0 if (high != low).any() else 5.0 * style.PIN) * scene.axis(joint, pose)
    return low - play, high + play


def _draw_slot(
    sheet: Sheet, scene: DrawnScene, joint: Joint, pose: int, size: float, colors: dict[str, str]
) -> list[tuple[Array, Array]]:
    start, end = _slot_ends(sheet, scene, joint, pose, size)
    body, axis = joint.first_body, scene.axis(joint, pose)
    color, turn = colors.get(body, style.INK), f"{joint.name}/axis"
    ends = (f"{joint.name}/low", f"{joint.name}/high")
    with sheet.on(*ends, turn=turn, span=True):
        symbols.slot(sheet, start, end, f"joint-{joint.name}-pin-in-slot", color)
        if body == GROUND:
            side = guide_side(axis, (start + end) / 2, sheet.at(_middle(scene, pose)))
            shift = style.SLOT * side
            symbols.hatch(sheet, start + shift, end + shift, side)
            return []
    origin = sheet.at(scene.place(joint.first, pose))
    near = 0 if np.hypot(*(start - origin)) <= np.hypot(*(end - origin)) else 1
    if abs(float((origin - (start + end) / 2) @ axis)) > float(np.hypot(*(end - start))) / 2:
        with sheet.on(joint.first, ends[near], turn=turn):
            foot = (start, end)[near]
            sheet.line([origin, foot], color=color, width=style.BAR, z=style.Z_SLID)
    return [(start, end)]
