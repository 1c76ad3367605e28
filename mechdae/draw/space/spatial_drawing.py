"""A pose of a spatial mechanism on axes: what is in the picture, its titles, its labels."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND
from mechdae.draw import style
from mechdae.draw.diagram import symbols
from mechdae.draw.diagram.diagram import FAR, DrawnPose, View
from mechdae.draw.diagram.driver import driven_bodies, drivers_of, moving_drivers, sense_of
from mechdae.draw.diagram.heads import outside_of
from mechdae.draw.diagram.loads import load_points
from mechdae.draw.diagram.places import free_points
from mechdae.draw.fonts import font, ink
from mechdae.draw.labels import layout
from mechdae.draw.labels.labels import AIR, Links, Writing, link_numbers, load_names
from mechdae.draw.labels.obstacles import Obstacles
from mechdae.draw.labels.steady import AnchorFrame
from mechdae.draw.primitives import PAPER, Anchor, Array, Primitive
from mechdae.draw.sheet import Sheet, normal, unit
from mechdae.draw.space import solids
from mechdae.draw.space.anchors import anchor as anchor_of
from mechdae.draw.space.anchors import base_of, size_of
from mechdae.draw.space.solids import Item, draw_items
from mechdae.draw.space.spatial_drivers import head, straight, turning
from mechdae.draw.space.spatial_loads import SpatialLoads
from mechdae.draw.space.spatial_pose import SpatialPose
from mechdae.draw.space.spatial_scene import SpatialScene
from mechdae.draw.space.spatial_symbols import SYMBOLS
from mechdae.draw.space.spatial_wheels import surfaces
from mechdae.draw.space.viewpoint import Viewpoint
from mechdae.draw.words import Words
from mechdae.records import dataclass

if TYPE_CHECKING:
    from mechdae.results import SweepResult

ARM = 24.0
"""Length of an axis that lies in the plane of the picture."""
ROOM = 34.0
"""Half the side of what is kept free for it."""
SMALL = 0.12
"""An axis that looks shorter than this share of its length points at the eye: a dot."""


PLAIN: Mapping[str, str] = {}


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
        return self.viewpoint.flat(places)

    def pose(
        self, sheet: Sheet, scene: SpatialScene, index: int, colors: Mapping[str, str] = PLAIN,
        outside: Iterable[str] = (),
    ) -> SpatialPose:  # fmt: skip
        """Return a pose as it is seen."""
        look = colors, frozenset(outside)
        return SpatialPose(sheet, scene, index, self.viewpoint, self.moved, *look)

    def room(
        self, scene: SpatialScene, poses: Sequence[int], paths: bool
    ) -> tuple[Array, Array, float]:
        return extent(scene, poses, self.viewpoint, self.moved, paths)

    def ghost(self, sheet: Sheet, scene: SpatialScene, pose: int) -> Iterator[tuple[Array, Array]]:
        """Yield the bars of the links in another pose on the sheet, without joints."""
        for bars in self.pose(sheet, scene, pose).build()[1].bars.values():
            yield from bars

    def draw(
        self, sheet: Sheet, scene: SpatialScene, result: SweepResult, pose: int, words: Words,
        ordered: bool = True,
    ) -> DrawnPose:  # fmt: skip
        """Draw one pose without labels."""
        seen, items, links = items_of(sheet, scene, result, pose, self)
        loads = SpatialLoads(seen, result, words, self.peak, rings=ordered)
        if self.loads:
            loads.arrows()
            items += loads.items
        draw_items(sheet, items, ordered)
        if self.loads:
            loads.springs()
        marks = loads.masses() if self.loads else []
        names = vector_names(seen)
        turning = any(name in scene.turns for name in scene.mechanism.bodies)
        letters = []
        if turning or not names:  # nodes of vectors alone go without
            letters = [*seen.letters(links), *link_numbers(scene, pose, links)]
        return DrawnPose([*letters, *names, *load_names(marks)], links, marks, items)

    def note(self, sheet: Sheet, scene: SpatialScene, pose: int, words: Words) -> str:
        """Draw the directions x, y, z; return from where it is seen, and what is not drawn."""
        draw_triad(sheet, self.viewpoint)
        lacking = [
            joint.name
            for joint in scene.joints(pose)
            if SYMBOLS.get(joint.kind) is None
            and not joint.pointer
            and not surfaces(scene, joint, pose, self.moved)
        ]  # wheels about one line
        angles = self.viewpoint.azimuth, self.viewpoint.elevation
        note = words("seen from", *(words.number(angle, 4) for angle in angles))
        return f"{note}; {words('undrawn')}: {', '.join(lacking)}" if lacking else note


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
        places += load_points(scene, pose)
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


def items_of(
    sheet: Sheet, scene: SpatialScene, result: SweepResult, index: int, shown: SpatialView
) -> tuple[SpatialPose, list[Item], Links]:
    """Return one pose with what is drawn of joints, links, vectors and drivers."""
    moving = moving_drivers(result, drivers_of(scene, result))
    colors = dict.fromkeys(driven_bodies(scene, moving), style.DRIVEN)
    pose = shown.pose(sheet, scene, index, colors, outside_of(result))
    items, links = pose.build()
    items += vector_items(pose, moving)
    for entry in moving:
        items += pose.arrow(entry, sense_of(result, entry))
    return pose, items, links


class SpatialFrame(AnchorFrame):
    """Where what keeps beside points, or beside symbols along axes, is on the sheet."""

    def __init__(
        self, view: SpatialView, sheet: Sheet, scene: SpatialScene, pose: int, anchor: Anchor
    ) -> None:
        self.of = view.pose(sheet, scene, pose)
        super().__init__(sheet, scene, pose, anchor)

    def base(self, point: str) -> Array:
        return self.sheet.at(self.of.view.flat(self.of.base(point)))

    def angle(self, turn: str) -> float:
        """Return the angle [rad] of what ways are told in: a line, or an axis of `along`."""
        if "/" not in turn:
            return super().angle(turn)
        _, body, axis, _ = self.of.along[turn]
        return float(np.arctan2(*self.of.view.flat(self.of.turned(body) @ axis)[::-1]))


def spatial_anchors(
    scene: SpatialScene,
    label: Writing,
    pose: int,
    drawn: Iterable[Item | Primitive],
    moved: Mapping[str, float],
) -> list[Anchor]:
    """Return what a label moves with: a joint, its link, what its load moves with."""
    kind, _, name = label.gid.partition("-")
    joint = scene.mechanism.joints.get(name)
    if kind == "number":
        points = scene.points(name)
        shown_at = {
            base_of(joint, moved, second=name == joint.second_body): None
            for joint in scene.joints(pose)
            if name in joint.bodies[:2] and (SYMBOLS.get(joint.kind) or joint.pointer)
        }
        shown_at |= dict.fromkeys(ref for ref in free_points(scene, pose) if ref in points)
        return [Anchor(tuple(shown_at or points))]
    if name.startswith("load-"):
        held = [each.anchor.points for each in drawn if each.gid == name and each.anchor.points]
        return [Anchor(held[0]) if held else PAPER]
    if joint is None:
        return [Anchor((name,))]
    return [Anchor((joint.first, joint.second) if joint.pointer else (base_of(joint, moved),))]


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
            symbols.tip(sheet, middle, tip, color, size=(6.0, 2.2))
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
