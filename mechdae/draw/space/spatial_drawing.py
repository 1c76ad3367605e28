"""A pose of a spatial mechanism on axes: what is in the picture, its titles, its labels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.draw import style
from mechdae.draw.closing import check_closes
from mechdae.draw.diagram.diagram import (
    FAR,
    View,
    draw_frame,
    draw_traces,
    others_of,
    outside_of,
    write_heads,
)
from mechdae.draw.diagram.driver import driven_bodies, drivers_of, held_drivers, sense_of
from mechdae.draw.diagram.loads import Mark, coordinate_of
from mechdae.draw.labels.labels import Links, Writing, link_numbers, load_names, write_all
from mechdae.draw.labels.steady import AnchorFrame, SteadyLabels, chosen_labels
from mechdae.draw.primitives import Anchor
from mechdae.draw.sheet import Sheet
from mechdae.draw.space.anchors import anchor as anchor_of
from mechdae.draw.space.anchors import size_of
from mechdae.draw.space.depth import draw_items
from mechdae.draw.space.spatial_loads import SpatialLoads
from mechdae.draw.space.spatial_pose import SpatialPose, ghost_lines
from mechdae.draw.space.spatial_scene import SpatialScene
from mechdae.draw.space.spatial_symbols import SYMBOLS
from mechdae.draw.space.spatial_wheels import surfaces
from mechdae.draw.space.triad import draw_triad
from mechdae.draw.space.vector_arrows import vector_items, vector_names
from mechdae.draw.space.viewpoint import Array, Viewpoint
from mechdae.draw.words import Words
from mechdae.records import dataclass

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from mechdae.results import SweepResult


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
                ways = [scene.along(joint, own) for own in scene.assembled()] or [0.0]
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
    sheet = Sheet(axes, *shown.bounds[:2], shown.scale, theme, shown.memory, shown.larger)
    check_closes(sheet, scene, result, index, words)
    if shown.traces:
        draw_traces(sheet, result, {ref: view.flat(own) for ref, own in scene.paths.items()})
    for other in others_of(scene, index, shown.ghosts):
        for line in ghost_lines(SpatialPose(sheet, scene, other, view, shown.moved)):
            sheet.line(line, color=style.GHOST, width=style.LINE, z=style.Z_GHOST, gid="ghost",
                       weight=style.SHADE)  # fmt: skip
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
        write_heads(sheet, scene, result, index, words, shown)
    return sheet


def draw_in_space(
    sheet: Sheet,
    scene: SpatialScene,
    result: SweepResult,
    index: int,
    shown: SpatialView,
    words: Words,
) -> tuple[Links, list[Writing], list[Mark]]:
    """Draw one pose without labels; return links, labels to be placed, and loads."""
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
    loads = SpatialLoads(pose, result, words, shown.peak) if shown.loads else None
    if loads is not None:
        items += loads.arrows()
    draw_items(sheet, items)
    marks = loads.flat() if loads is not None else []
    names = vector_names(pose)
    turning = any(name in scene.turns for name in scene.mechanism.bodies)
    letters = []
    if turning or not names:  # nodes of vectors alone go without
        letters = [*pose.letters(links), *link_numbers(scene, index, links)]
    return links, [*letters, *names, *load_names(marks)], marks


class SpatialFrame(AnchorFrame):
    """Where labels are that keep beside points, or beside symbols moved along axes: ``joint/``."""

    def __init__(
        self, sheet: Sheet, scene: SpatialScene, pose: int, anchor: Anchor, shown: SpatialView
    ) -> None:
        self.shown = shown
        super().__init__(sheet, scene, pose, anchor)

    def base(self, point: str) -> Array:
        """Return a point on the sheet."""
        name, slash, _ = point.partition("/")
        place = self.scene.place(point, self.pose) if not slash else None
        if place is None:
            joint = self.scene.mechanism.joints[name]
            place = anchor_of(self.scene, joint, self.pose, self.shown.moved)[0]
        return self.sheet.at(self.shown.viewpoint.flat(place))


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
    sheets = [Sheet(None, *shown.bounds[:2]) for _ in poses]
    rows = [
        draw_in_space(sheet, scene, result, k, shown, words)[1]
        for sheet, k in zip(sheets, poses, strict=True)
    ]

    def anchors_of(label: Writing) -> list[Anchor]:
        kind, _, name = label.gid.partition("-")
        joint = scene.mechanism.joints.get(name)
        if kind == "number":
            return [Anchor(tuple(scene.points(name)))]
        if name.startswith("load-"):
            return [Anchor(tuple(load_ends(scene, name.removeprefix("load-"))))]
        if joint is None:
            return [Anchor((name,))]
        return [Anchor((joint.first, joint.second) if joint.pointer else (f"{name}/",))]

    def frame_of(sheet: Sheet, pose: int, anchor: Anchor) -> SpatialFrame:
        return SpatialFrame(sheet, scene, pose, anchor, shown)

    return sheets[0], chosen_labels(sheets, poses, rows, anchors_of, frame_of)
