"""A pose of a spatial mechanism on axes: what is in the picture, its titles, its labels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND
from mechdae.draw import style
from mechdae.draw.closing import check_closes
from mechdae.draw.diagram.diagram import FAR, View, draw_traces, others_of
from mechdae.draw.diagram.driver import driven_bodies, drivers_of, held_drivers, sense_of
from mechdae.draw.diagram.heads import draw_frame, outside_of, write_heads
from mechdae.draw.diagram.loads import Mark, coordinate_of
from mechdae.draw.diagram.places import free_points
from mechdae.draw.fonts import font, ink
from mechdae.draw.labels import layout
from mechdae.draw.labels.labels import AIR, Links, Writing, link_numbers, load_names, write_all
from mechdae.draw.labels.obstacles import Obstacles
from mechdae.draw.labels.steady import AnchorFrame, SteadyLabels, chosen_labels
from mechdae.draw.primitives import Anchor, Array
from mechdae.draw.sheet import Sheet, normal, unit
from mechdae.draw.space import solids
from mechdae.draw.space.anchors import anchor as anchor_of
from mechdae.draw.space.anchors import base_of, size_of
from mechdae.draw.space.solids import Item, draw_items
from mechdae.draw.space.spatial_drivers import head, straight, turning
from mechdae.draw.space.spatial_loads import SpatialLoads
from mechdae.draw.space.spatial_pose import SpatialPose, ghost_lines
from mechdae.draw.space.spatial_scene import SpatialScene
from mechdae.draw.space.spatial_symbols import SYMBOLS
from mechdae.draw.space.spatial_wheels import surfaces
from mechdae.draw.space.viewpoint import Viewpoint
from mechdae.draw.words import Words
from mechdae.records import dataclass

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from mechdae.results import SweepResult

ARM = 24.0
"""Length of an axis that lies in the plane of the picture."""
ROOM = 34.0
"""Half the side of what is kept free for it."""
SMALL = 0.12
"""An axis that looks shorter than this share of its length points at the eye: a dot."""


@dataclass(frozen=True)
class SpatialView(View):
    """What a diagram in space shows from a viewpoint.

    Parameters
    ----------
    moved
        See `mechdae.draw.space.anchors.offsets`.
    """

    viewpoint: Viewpoint = field(default_factory=lambda: Viewpoint(0.0, 0.0))
    moved: Mapping[str, float] = field(default_factory=dict)

    def flat(self, places: ArrayLike) -> Array:
        """Return places in the picture, (..., 2), in the same unit."""
        return self.viewpoint.flat(places)

    def pose(self, sheet: Sheet, scene: SpatialScene, index: int) -> SpatialPose:
        """Return a pose as it is seen."""
        return SpatialPose(sheet, scene, index, self.viewpoint, self.moved)


def extent(
    scene: SpatialScene,
    poses: Sequence[int],
    view: Viewpoint,
    moved: Mapping[str, float],
    traces: bool,
) -> tuple[Array, Array, float]:
    """Return the corners [m] in the picture of what is to be seen, and the mechanism's size."""
    places = [
        scene.place(ref, pose)
        for pose in poses
        for body in scene.mechanism.bodies
        for ref in scene.points(body)
    ]
    for pose in poses:
        for joint in scene.joints(pose):
            places += anchor_of(scene, joint, pose, moved)
            axis = scene.axis(joint, pose) if joint.straight else None
            if axis is not None:
                ways = scene.travels.get(joint.name) or [0.0]
                places += [places[-2] + way * axis for way in (min(ways), max(ways), 0.0)]
            if joint.wheels:
                for part in surfaces(scene, joint, pose, moved):
                    places += list(part.outline())
    near = np.array([place for place in places if np.isfinite(place).all()] or [np.zeros(3)])
    flat, size = view.flat(near), size_of(scene, poses[0])
    low, high = flat.min(axis=0), flat.max(axis=0)
    if traces:
        paths = np.vstack([view.flat(track) for track in scene.paths.values()] or [flat])
        paths = paths[np.isfinite(paths).all(axis=1)]
        most = FAR * size
        low = np.minimum(low, np.maximum(paths.min(axis=0), low - most))
        high = np.maximum(high, np.minimum(paths.max(axis=0), high + most))
    if not (high - low).any():
        low, high = low - size, high + size
    return low, high, size


def draw_spatial_pose(
    axes: Axes | None,
    scene: SpatialScene,
    result: Any,
    index: int,
    shown: SpatialView,
    theme: style.Theme,
    words: Words,
) -> Sheet:
    """Draw one pose of a result whose placements are known; return its sheet."""
    view = shown.viewpoint
    assert shown.bounds is not None
    sheet = Sheet(
        axes, *shown.bounds[:2], shown.scale, theme, shown.memory, shown.larger, shown.margins
    )
    check_closes(sheet, scene, result, index, words)
    if shown.traces:
        draw_traces(sheet, result, {ref: view.flat(path) for ref, path in scene.paths.items()})
    for other in others_of(scene, index, shown.ghosts):
        for line in ghost_lines(shown.pose(sheet, scene, other)):
            sheet.line(line, color=style.GHOST, z=style.Z_GHOST, gid="ghost", weight=style.SHADE)
    extra = shown.overlay(sheet) if shown.overlay is not None else ""
    links, labels, marks = draw_in_space(sheet, scene, result, index, shown, words)
    draw_triad(sheet, view)
    if not shown.bare:
        note = words("seen from", words.number(view.azimuth, 4), words.number(view.elevation, 4))
        lacking = [
            joint.name
            for joint in scene.joints(index)
            if SYMBOLS.get(joint.kind) is None
            and not joint.pointer
            and not surfaces(scene, joint, index, shown.moved)
        ]
        if lacking:  # wheels about one line
            note += f"; {words('undrawn')}: {', '.join(lacking)}"
        draw_frame(sheet, scene, result, index, words, f"{note}; {extra}" if extra else note)
    if shown.labels and shown.steady is not None:
        shown.steady.write(sheet, index, marks)
    elif shown.labels:
        write_all(sheet, labels, links)
    if not shown.bare:
        sheet.theme = shown.paper or theme
        write_heads(sheet, scene, result, index, words, shown.label, shown.subtitle)
    return sheet


def draw_in_space(
    sheet: Sheet,
    scene: SpatialScene,
    result: SweepResult,
    index: int,
    shown: SpatialView,
    words: Words,
    ordered: bool = True,
) -> tuple[Links, list[Writing], list[Mark]]:
    """Draw one pose without labels; return links, labels to be placed, and loads."""
    pose, items, links = items_of(sheet, scene, result, index, shown)
    loads = SpatialLoads(pose, result, words, shown.peak) if shown.loads else None
    if loads is not None:
        items += loads.arrows()
    draw_items(sheet, items, ordered)
    marks = loads.flat() if loads is not None else []
    names = vector_names(pose)
    turning = any(name in scene.turns for name in scene.mechanism.bodies)
    letters = []
    if turning or not names:  # nodes of vectors alone go without
        letters = [*pose.letters(links), *link_numbers(scene, index, links)]
    return links, [*letters, *names, *load_names(marks)], marks


def items_of(
    sheet: Sheet, scene: SpatialScene, result: SweepResult, index: int, shown: SpatialView
) -> tuple[SpatialPose, list[Item], Links]:
    """Return one pose with what is drawn of joints, links, vectors and drivers."""
    drivers, view = drivers_of(scene, result), shown.viewpoint
    held = held_drivers(result, drivers)
    moving = [entry for entry in drivers if entry.text not in held]
    colors = dict.fromkeys(driven_bodies(scene, moving), style.DRIVEN)
    outside = frozenset(outside_of(result))
    pose = SpatialPose(sheet, scene, index, view, shown.moved, colors, outside)
    items, links = pose.build()
    items += vector_items(pose, moving)
    for entry in moving:
        items += pose.arrow(entry, sense_of(result, entry))
    return pose, items, links


class SpatialFrame(AnchorFrame):
    """Where what keeps beside points, or beside symbols along axes, is on the sheet."""

    def __init__(self, sheet: Sheet, pose: SpatialPose, anchor: Anchor) -> None:
        self.of = pose
        super().__init__(sheet, pose.scene, pose.pose, anchor)

    def base(self, point: str) -> Array:
        """Return a point on the sheet."""
        return self.sheet.at(self.of.view.flat(self.of.base(point)))


def load_ends(scene: SpatialScene, name: str) -> list[str]:
    """Return the points at which a load acts; none of gravity."""
    load = scene.mechanism.loads.get(name)
    if load is None:
        return []
    ends = [getattr(load, "point", None), *(getattr(load, "between", None) or ())]
    if any(ends):
        return [str(end) for end in ends if end]
    if getattr(load, "body", None):
        return scene.points(str(getattr(load, "body", "")))[:1]
    entry = coordinate_of(scene, load)
    joint = scene.mechanism.joints.get(entry.part)
    return [f"{entry.part}.{entry.point}" if joint is None else joint.second]


def steady_in_space(
    scene: SpatialScene, result: SweepResult, poses: Sequence[int], shown: SpatialView, words: Words
) -> tuple[Sheet, SteadyLabels]:
    """Return labels with places for all poses, and the first one drawn without them."""
    assert shown.bounds is not None
    sheets = [Sheet(None, *shown.bounds[:2], larger=shown.larger) for _ in poses]
    rows = [
        draw_in_space(sheet, scene, result, k, shown, words, ordered=False)[1]
        for sheet, k in zip(sheets, poses, strict=True)
    ]

    first = shown.pose(Sheet(None, *shown.bounds[:2], larger=shown.larger), scene, poses[0])
    items = SpatialLoads(first, result, words, shown.peak).arrows() if shown.loads else []
    arrows = {item.gid: Anchor(item.anchor.points) for item in items}

    def anchors_of(label: Writing) -> list[Anchor]:
        kind, _, name = label.gid.partition("-")
        joint = scene.mechanism.joints.get(name)
        if kind == "number":
            points = scene.points(name)
            shown_at = {
                base_of(joint, shown.moved, second=name == joint.second_body): None
                for joint in scene.joints(poses[0])
                if name in joint.bodies[:2] and (SYMBOLS.get(joint.kind) or joint.pointer)
            }
            shown_at |= dict.fromkeys(ref for ref in free_points(scene, poses[0]) if ref in points)
            return [Anchor(tuple(shown_at or points))]
        if name.startswith("load-"):
            return [arrows.get(name) or Anchor(tuple(load_ends(scene, name[len("load-") :])))]
        if joint is None:
            return [Anchor((name,))]
        ends = (joint.first, joint.second) if joint.pointer else (base_of(joint, shown.moved),)
        return [Anchor(ends)]

    def frame_of(sheet: Sheet, pose: int, anchor: Anchor) -> SpatialFrame:
        return SpatialFrame(sheet, shown.pose(sheet, scene, pose), anchor)

    return sheets[0], chosen_labels(sheets, poses, rows, anchors_of, frame_of)


def draw_triad(sheet: Sheet, view: Viewpoint) -> None:
    """Draw the directions x, y, z in a corner where they cover least."""
    low, high = ROOM * 0.8, sheet.size - ROOM * 0.8
    corners = np.array(
        [(low, low + style.STRIP), (low, high[1]), (high[0], low + style.STRIP), tuple(high)]
    )
    half = np.array([ROOM, ROOM])
    spot = corners[layout.cheapest(corners, half * 0.8, Obstacles(*sheet.obstacles(), sheet.size))]
    arms = ARM * view.flat(np.eye(3))
    middle = spot - (arms.min(axis=0) + arms.max(axis=0)) / 2
    order = np.argsort(view.seen(np.eye(3))[:, 2])
    for k in order.tolist():
        name, arm = "xyz"[k], arms[k]
        color = style.FAINT
        tip = middle + arm
        if np.hypot(*arm) < SMALL * ARM:
            sheet.circle(middle, 2.0, fill=color, edge=color, gid=f"axis-{name}")
            away = -unit(arms.sum(axis=0))
            away = away if away.any() else np.array([-1.0, -1.0])
            place = middle + 9.0 * away
        else:
            along = unit(arm)
            sheet.line([middle, tip - 4.0 * along], color=color, gid=f"axis-{name}")
            back, side = tip - 6.0 * along, 2.2 * normal(along)
            sheet.area([tip, back + side, back - side], fill=color, edge=color, width=0.3)
            place = tip + 6.5 * along
        sheet.text(place, name, font(11.0, style="italic"), color, f"axis-{name}-label", "")
    sheet.box(spot - half * 0.9, spot + half * 0.9)


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
