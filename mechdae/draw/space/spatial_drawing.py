"""A pose of a spatial mechanism on axes: what is in the picture, its titles, its labels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes

from mechdae.draw import style
from mechdae.draw.closing import check_closes
from mechdae.draw.diagram.diagram import (
    draw_frame,
    draw_traces,
    others_of,
    outside_of,
    write_titles,
)
from mechdae.draw.diagram.driver import (
    driven_bodies,
    drivers_of,
    held_drivers,
    time_text,
    value_text,
)
from mechdae.draw.diagram.scene import SHORT
from mechdae.draw.labels.labels import link_numbers, load_names, write_all
from mechdae.draw.sheet import Sheet
from mechdae.draw.space.anchors import anchor, size_of
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
    from mechdae.results.kinds import SweepResult


FAR = 1.5
"""Paths are in the picture up to so many sizes of the mechanism beside it."""


@dataclass(frozen=True)
class SpatialView:
    """What a diagram in space shows, and what the diagrams of one motion have in common.

    Parameters
    ----------
    viewpoint
        From where.
    moved
        See `mechdae.draw.space.anchors.offsets`.
    bounds
        Corners [m] in the picture.
    memory, scale, larger
        See `mechdae.draw.sheet.Sheet`.
    bare
        Without titles, scale bar and note.
    subtitle
        In place of the drivers' values.
    loads, peak
        See `mechdae.draw.space.spatial_loads.SpatialLoads`.
    overlay
        Draws more behind the links, and returns what is to be noted below.
    """

    viewpoint: Viewpoint
    moved: dict[str, float]
    bounds: tuple[Array, Array]
    traces: bool = True
    ghosts: int | Sequence[int] = 0
    labels: bool = True
    loads: bool = True
    peak: float | None = None
    memory: dict[str, Array] | None = None
    scale: float | Callable[[float], float] | None = None
    label: str = ""
    bare: bool = False
    larger: tuple[float, float] = style.USUAL
    subtitle: str = ""
    overlay: Callable[[Sheet], str] | None = None


def has_paths(result: SweepResult, scene: SpatialScene) -> bool:
    """Return whether the poses of a result are a motion."""
    return getattr(result, "kind", "") != "modes" and len(scene.status) > SHORT


def extent(
    scene: SpatialScene,
    poses: Sequence[int],
    view: Viewpoint,
    moved: dict[str, float],
    traces: bool,
) -> tuple[Array, Array]:
    """Return the corners [m] in the picture of what is to be seen."""
    places = [
        scene.place(ref, pose)
        for pose in poses
        for body in scene.mechanism.bodies
        for ref in scene.points(body)
    ]
    for pose in poses:
        for joint in scene.joints(pose):
            places += anchor(scene, joint, pose, moved)
            axis = scene.axis(joint, pose) if joint.straight else None
            if axis is not None:
                ways = [scene.along(joint, own) for own in scene.assembled()] or [0.0]
                places += [places[-2] + way * axis for way in (min(ways), max(ways), 0.0)]
            if joint.wheels:
                for part in surfaces(scene, joint, pose, moved):
                    places += list(part.outline())
    near = np.array([place for place in places if np.isfinite(place).all()] or [np.zeros(3)])
    flat = view.flat(near)
    low, high = flat.min(axis=0), flat.max(axis=0)
    if traces:
        paths = np.vstack([view.flat(track) for track in scene.paths.values()] or [flat])
        paths = paths[np.isfinite(paths).all(axis=1)]
        most = FAR * size_of(scene, poses[0])
        low = np.minimum(low, np.maximum(paths.min(axis=0), low - most))
        high = np.maximum(high, np.minimum(paths.max(axis=0), high + most))
    if not (high - low).any():
        low, high = low - size_of(scene, poses[0]), high + size_of(scene, poses[0])
    return low, high


def draw_spatial_pose(
    axes: Axes,
    scene: SpatialScene,
    result: Any,
    index: int,
    shown: SpatialView,
    theme: style.Theme,
    words: Words,
) -> Sheet:
    """Draw one pose of a result whose placements are known; return its sheet."""
    view = shown.viewpoint
    sheet = Sheet(axes, *shown.bounds, shown.scale, theme, shown.memory, shown.larger)
    check_closes(sheet, scene, result, index, words)
    if shown.traces:
        draw_traces(sheet, result, {ref: view.flat(own) for ref, own in scene.paths.items()})
    for other in others_of(scene, index, shown.ghosts):
        for line in ghost_lines(SpatialPose(sheet, scene, other, view, shown.moved)):
            sheet.line(line, color=style.GHOST, width=style.LINE, z=style.Z_GHOST, gid="ghost",
                       weight=style.SHADE)  # fmt: skip
    extra = shown.overlay(sheet) if shown.overlay is not None else ""
    drivers = drivers_of(scene, result)
    held = held_drivers(result, drivers)
    moving = [entry for entry in drivers if entry.text not in held]
    colors = dict.fromkeys(driven_bodies(scene, moving), style.DRIVEN)
    outside = frozenset(outside_of(result))
    pose = SpatialPose(sheet, scene, index, view, shown.moved, colors, outside)
    items, links = pose.build()
    items += vector_items(pose, moving)
    for entry in moving:
        items += pose.arrow(entry, sense_of(result, entry.text))
    loads = SpatialLoads(pose, result, words, shown.peak) if shown.loads else None
    if loads is not None:
        items += loads.arrows()
    draw_items(sheet, items)
    marks = loads.flat() if loads is not None else []
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
    if shown.labels:
        names = vector_names(pose)
        turning = any(name in scene.turns for name in scene.mechanism.bodies)
        letters = []
        if turning or not names:  # nodes of vectors alone go without
            letters = [*pose.letters(links), *link_numbers(scene, index, links)]
        write_all(sheet, [*letters, *names, *load_names(marks)], links)
    if not shown.bare:
        titles(sheet, result, scene, index, shown, words)
    return sheet


def titles(
    sheet: Sheet,
    result: SweepResult,
    scene: SpatialScene,
    index: int,
    shown: SpatialView,
    words: Words,
) -> None:
    """Write the title, and below it the values of the drivers."""
    drivers = drivers_of(scene, result)
    held = held_drivers(result, drivers)
    values = [value_text(result, own, index, words, own.text in held) for own in drivers]
    texts = [time_text(result, index, words), *values, shown.label]
    write_titles(sheet, result, texts, index, words, shown.subtitle)


def sense_of(result: SweepResult, driver: str) -> float:
    """Return +1 or -1: the sign of a driver's speed, or of its sweep."""
    own = (getattr(result, "drivers", None) or {}).get(driver)
    for name in ("velocity", "position"):
        values = getattr(own, name, None)
        if values is None:
            continue
        values = np.atleast_1d(np.asarray(values, dtype=float))
        values = values[np.isfinite(values)]
        if not len(values):
            continue
        total = float(values.sum() if name == "velocity" else values[-1] - values[0])
        if total:
            return float(np.sign(total))
    return 1.0
