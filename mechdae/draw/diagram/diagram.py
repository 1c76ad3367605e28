"""The kinematic diagram of one pose, in the manner of ISO 3952 and GOST 2.770."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.joints.curve import follows_curve
from mechdae.describe.mechanism import GROUND
from mechdae.draw import style
from mechdae.draw.closing import check_closes, draw_gaps
from mechdae.draw.diagram import symbols
from mechdae.draw.diagram.driver import draw_drivers, driven_bodies, drivers_of, moving_drivers
from mechdae.draw.diagram.guides import draw_guides, guide_ends
from mechdae.draw.diagram.heads import draw_frame, outside_of, write_heads, write_legend
from mechdae.draw.diagram.loads import DrawnLoads, Mark, load_points
from mechdae.draw.diagram.placed_scene import PlacedScene
from mechdae.draw.diagram.places import (
    AnyScene,
    Place,
    draw_body,
    draw_bridges,
    free_points,
    ghost_lines,
    places_of,
    shape_of,
)
from mechdae.draw.diagram.scene import SHORT, DrawnScene, named_pose
from mechdae.draw.diagram.wheels import circles, draw_curve, draw_wheels, rack_span, reach
from mechdae.draw.labels.labels import Links, Writing, write_all, writings
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import Sheet, margins_of
from mechdae.draw.smooth import few_named
from mechdae.draw.words import Words
from mechdae.records import dataclass
from mechdae.types import Json

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from mechdae.draw.labels.steady import SteadyLabels
    from mechdae.draw.space.solids import Item
    from mechdae.results.result import Result


FAR = 1.5
"""Paths and guides are in the picture up to so many sizes of the mechanism beside it."""
WHOLE = 4.0
"""Wheels with a radius of less than so many sizes are in the picture as a whole."""
DOT = 3.0
"""Size of a place on a path of a few poses."""
STRIDE = 8.0
"""Length of the pieces of a path that labels keep off."""


@dataclass(frozen=True)
class DrawnPose:
    """What is on a sheet of a pose: labels to be placed, links and loads, in space its items."""

    texts: list[Writing]
    links: Links
    marks: list[Mark]
    items: Sequence[Item] = ()


@dataclass(frozen=True)
class View:
    """What a diagram shows, and what the diagrams of one motion have in common.

    Parameters
    ----------
    bounds
        Corners [m] and size of what is in the picture; without it those of the pose.
    peak
        The force that has the longest arrow [N]; without it the largest of the pose.
    memory, scale, larger, margins
        See `Sheet`.
    subtitle
        In place of driver value, task and pose.
    label
        Name of the variant, behind these.
    behind
        Sheets of other variants on the same axes, whose lines labels keep off.
    bare
        Without titles, scale bar and note: another variant has them.
    legend
        Names and colours of variants, in place of the subtitle.
    paper
        Colours of titles, where links have that of their variant.
    overlay
        Draws more between links and labels, and returns what is to be noted below.
    steady
        Labels of a motion, in place of those whose places are chosen in the pose.
    drivers
        Those that are drawn, by default all.
    angles
        Which have an arc.
    """

    traces: bool = True
    ghosts: int | Sequence[int] = 0
    labels: bool = True
    loads: bool = True
    bounds: tuple[Array, Array, float] | None = None
    peak: float | None = None
    memory: dict[str, Array] | None = None
    scale: float | Callable[[float], float] | None = None
    larger: tuple[float, float] = style.USUAL
    margins: style.Margins = style.MARGINS
    subtitle: str = ""
    label: str = ""
    behind: tuple[Sheet, ...] = ()
    bare: bool = False
    legend: tuple[tuple[str, str], ...] = ()
    paper: style.Theme | None = None
    overlay: Callable[[Sheet], str] | None = None
    steady: SteadyLabels | None = None
    drivers: Sequence[NamedCoordinate] | None = None
    angles: Sequence[str] = ()

    def flat(self, places: ArrayLike) -> Array:
        """Return places in the picture, (..., 2), in the same unit."""
        return np.asarray(places, dtype=float)

    def room(
        self, scene: AnyScene, poses: Sequence[int], paths: bool
    ) -> tuple[Array, Array, float]:
        """Return the corners [m] of what is in the pictures of poses, and the mechanism's size."""
        return common_extent(scene, poses, paths)

    def ghost(self, sheet: Sheet, scene: AnyScene, pose: int) -> Iterator[tuple[Array, Array]]:
        """Yield the lines of the links in another pose on the sheet."""
        return ghost_lines(sheet, scene, pose)

    def draw(
        self,
        sheet: Sheet,
        scene: AnyScene,
        result: Any,
        pose: int,
        words: Words,
        ordered: bool = True,
    ) -> DrawnPose:
        """Draw one pose without labels; ``ordered``: not only for labels."""
        places, links, marks = draw_scene(sheet, scene, result, pose, self, words)
        marks += draw_gaps(sheet, scene, result, words)
        return DrawnPose(writings(sheet, scene, pose, places, links, marks), links, marks)

    def note(self, sheet: Sheet, scene: AnyScene, pose: int, words: Words) -> str:
        """Return what the view says below the picture."""
        return ""


V = TypeVar("V", bound="View")


def on_axes(
    ax: Axes | None, view: V, theme: style.Theme, drawn: Callable[[Axes | None, V], Sheet]
) -> Axes:
    """Draw a view on axes, without any on those of a new figure; return them.

    On paper of a given width there is only as much room around as symbols and labels need.
    """
    from mechdae.draw.figure import current_format, new_axes

    if ax is None:
        assert view.bounds is not None
        low, high, _ = view.bounds
        if current_format().width is not None:
            view = replace(view, margins=margins_of(drawn(None, view), low, high))
        ax = new_axes(theme, view.larger, high - low, view.margins)
    drawn(ax, view)
    return ax


def has_paths(result: Result, scene: PlacedScene) -> bool:
    """Return whether the poses of a result are a motion."""
    return getattr(result, "kind", "") != "modes" and len(scene.status) > SHORT


def draw_pose(
    axes: Axes | None, scene: AnyScene, result: Result, pose: int, view: View,
    theme: style.Theme, words: Words,
) -> Sheet:  # fmt: skip
    """Draw one pose of a result whose placements are known; return its sheet."""
    low, high, _ = view.bounds or view.room(scene, [pose], view.traces)
    sheet = Sheet(axes, low, high, view.scale, theme, view.memory, view.larger, view.margins)
    check_closes(sheet, scene, result, pose, words)
    for behind in view.behind:
        sheet.segments += behind.segments
        sheet.boxes += behind.boxes
    if view.traces:
        draw_traces(sheet, result, {ref: view.flat(path) for ref, path in scene.paths.items()})
    for other in others_of(scene, pose, view.ghosts):
        for line in view.ghost(sheet, scene, other):
            sheet.line(line, color=style.GHOST, z=style.Z_GHOST, gid="ghost", weight=style.SHADE)
    drawn = view.draw(sheet, scene, result, pose, words)
    extra = view.overlay(sheet) if view.overlay is not None else ""
    note = "; ".join(text for text in (view.note(sheet, scene, pose, words), extra) if text)
    if not view.bare:
        draw_frame(sheet, scene, result, pose, words, note)
    if view.labels and view.steady is not None:
        view.steady.write(sheet, pose, drawn.marks)
    elif view.labels:
        texts = [text for text in drawn.texts if text.gid not in sheet.elsewhere]
        if view.angles:
            from mechdae.draw.diagram.angles import draw_angles

            texts = [*texts, *draw_angles(sheet, scene, pose, view.angles)]
        write_all(sheet, texts, drawn.links)
    if view.bare:
        return sheet
    sheet.theme = view.paper or theme
    subtitle = " " if view.legend else view.subtitle
    write_heads(sheet, scene, result, pose, words, view.label, subtitle)
    write_legend(sheet, view.legend)
    return sheet


def draw_scene(
    sheet: Sheet, scene: DrawnScene, result: Result, pose: int, view: View, words: Words
) -> tuple[list[Place], Links, list[Mark]]:
    """Draw one pose without labels; return its joint places, links and loads."""
    size = (view.bounds or extent(scene, pose, view.traces))[2]
    places = places_of(scene, pose)
    drivers = drivers_of(scene, result) if view.drivers is None else [*view.drivers]
    colors = dict.fromkeys(driven_bodies(scene, moving_drivers(result, drivers)), style.DRIVEN)
    links = _draw_links(sheet, scene, pose, size, colors, outside_of(result))
    _draw_places(sheet, scene, pose, places, links)
    if not view.bare:
        draw_drivers(sheet, scene, result, pose, drivers, places)
    loads = DrawnLoads(sheet, scene, result, pose, words, view.peak, places) if view.loads else None
    return places, links, [] if loads is None else loads.draw()


def larger_for(scene: DrawnScene, pose: int, low: Array, high: Array) -> tuple[float, float]:
    """Return how much larger a new figure is to be so that labels find room between joints."""
    spots = np.array([scene.place(place.references[0], pose) for place in places_of(scene, pose)])
    border = np.array([2 * style.MARGIN, 2 * style.MARGIN + style.STRIP])
    scale = float(((high - low) / (np.array(style.AREA) - border)).max())
    if len(spots) < style.CROWD or not scale > 0:
        return style.USUAL
    gaps = np.hypot(*np.moveaxis(spots[:, None] - spots, -1, 0))
    np.fill_diagonal(gaps, np.inf)
    nearest = max(float(np.median(gaps.min(axis=0))) / scale, style.APART / style.LARGEST)
    sides = (high - low) / scale * max(style.APART / nearest, 1.0) + border
    width, height = np.maximum(sides / style.AREA, 1.0).tolist()
    return width, height


def extent(scene: DrawnScene, pose: int, paths: bool) -> tuple[Array, Array, float]:
    """Return the corners of what is to be in the picture, and the size of the mechanism."""
    bodies, joints = scene.mechanism.bodies, scene.mechanism.joints.values()
    names = [f"{n}.{point}" for n in bodies if scene.shown(n, pose) for point in bodies[n].points]
    names += [side for joint in scene.joints(pose) for side in (joint.first, joint.second)]
    # the fixed pivots belong to the picture, also where their links have no pose
    sides = {side for joint in joints for side in (joint.first, joint.second)}
    names += sorted(side for side in sides if side.split(".")[0] == GROUND)
    points = [scene.place(name, pose) for name in names] + load_points(scene, pose)
    for joint in scene.joints(pose):
        if follows_curve(joint):
            points += list(reach(scene, joint, pose))
    near = np.array(points or [np.zeros(2)])
    size = float(np.ptp(near, axis=0).max())
    more = [near]
    for joint in scene.joints(pose):
        for _, center, radius in circles(scene, joint, pose):
            more.append(center + radius * np.array([[-1, -1], [1, 1]]))
            near = np.vstack([near, *more[-1:]]) if radius < WHOLE * size else near
        if joint.wheels == 1:
            more.append(np.array(rack_span(scene, joint, pose)[:2]))
        if joint.straight and joint.name not in scene.cylinders:
            more.append(guide_ends(scene, joint, pose, size))
    if paths:
        more += scene.paths.values()
    everything = np.vstack(more)
    everything = everything[np.isfinite(everything).all(axis=1)]
    most = FAR * (size or 1.0)
    low = np.maximum(everything.min(axis=0), near.min(axis=0) - most)
    high = np.minimum(everything.max(axis=0), near.max(axis=0) + most)
    return low, high, size


def common_extent(
    scene: DrawnScene, poses: Sequence[int], paths: bool
) -> tuple[Array, Array, float]:
    """Return the corners of what is in the pictures of several poses, and their largest size."""
    low, high, size = zip(*(extent(scene, pose, paths) for pose in poses), strict=True)
    return np.min(low, axis=0), np.max(high, axis=0), max(size)


def draw_traces(sheet: Sheet, result: Result, paths: Mapping[str, Array]) -> None:
    """Draw the paths of points; between a few poses that are named there is no line."""
    dots = few_named(result)
    for reference, track in paths.items():
        points, gid = sheet.at(track), f"trace-{reference}"
        look: Json = {"color": style.TRACE, "z": style.Z_TRACE, "gid": gid}
        if dots:
            there = points[np.isfinite(points).all(axis=1)]
            sheet.strokes(there, there + 1e-3, width=DOT, **look)
            continue
        sheet.line(points, width=style.THIN, weight=0.0, **look)
        sheet.keep(thinned(points), style.PATH)


def thinned(points: Array) -> Array:
    """Return a path with fewer points, which labels avoid just as well."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    gap = np.isnan(points[:, 0])
    pieces = np.cumsum(np.nan_to_num(steps)) // STRIDE
    chosen = np.array(gap)
    chosen[[0, -1]] = True
    chosen[1:] |= (np.diff(pieces, prepend=0.0) > 0) | gap[:-1]
    chosen[:-1] |= gap[1:]
    fewer: Array = points[chosen]
    return fewer


def others_of(scene: PlacedScene, pose: int, ghosts: int | Sequence[int]) -> list[int]:
    """Return up to `ghosts` other assembled poses, evenly spread, or those that are named."""
    if not isinstance(ghosts, int):
        return [named_pose(len(scene.status), other) for other in ghosts]
    rest = [index for index in scene.assembled() if index != pose]
    if ghosts <= 0 or not rest:
        return []
    picks = np.linspace(0, len(rest) - 1, min(ghosts, len(rest))).round().astype(int)
    return [rest[i] for i in dict.fromkeys(picks.tolist())]


def _draw_links(
    sheet: Sheet, scene: DrawnScene, pose: int, size: float, colors: dict[str, str],
    outside: set[str],
) -> Links:  # fmt: skip
    links = Links()
    guides = draw_guides(sheet, scene, pose, size, colors)
    links.wheels = draw_wheels(sheet, scene, pose, colors)
    slides = [j for j in scene.joints(pose) if j.name not in scene.cylinders]
    sliding = {j.second_body for j in slides if j.guide}
    sliding |= {j.first_body for j in slides if j.guide or j.slot}
    for name, body in scene.mechanism.bodies.items():
        if not scene.shown(name, pose):
            continue
        color = colors.get(name, style.INK)
        z = style.Z_SLID if name in sliding else style.Z_BAR
        links.bars[name] = draw_body(sheet, scene, name, pose, color, z, dashed=name in outside)
        links.bars[name] += guides.get(name, [])
        shape = shape_of(scene, name)
        spots = [sheet.at(scene.place(f"{name}.{point}", pose)) for point in shape.points]
        if shape.kind == "polygon":
            links.polygons[name] = np.array(spots)
        links.points[name] = spots[0] if body.points else sheet.at(scene.origins[name][pose])
    for joint in scene.joints(pose):
        first, second = (
            sheet.at(scene.place(entry, pose)) for entry in (joint.first, joint.second)
        )
        if follows_curve(joint):
            corners = draw_curve(sheet, scene, joint, pose, colors)
            if corners is not None:
                links.polygons.setdefault(joint.first_body, corners)
                sides = zip(corners, np.roll(corners, -1, axis=0), strict=True)
                links.bars[joint.first_body] = [*links.bars[joint.first_body], *sides]
        if joint.guide and joint.name not in scene.cylinders:
            links.blocks[joint.second_body] = symbols.rectangle(second, scene.axis(joint, pose))
        if joint.bar:
            ends, gid, z = [first, second], f"joint-{joint.name}-distance", style.Z_BAR
            with sheet.on(joint.first, joint.second):
                sheet.line(ends, dash=style.DASHED, z=z, gid=gid)
    return links


def _draw_places(
    sheet: Sheet, scene: DrawnScene, pose: int, places: list[Place], links: Links
) -> None:
    for place in places:
        here = place.references[0]
        center = sheet.at(scene.place(here, pose))
        draw_bridges(sheet, scene, pose, place, center, links.bars)
        bodies = [body for body in place.bodies if body != GROUND]
        for joint in place.joints:
            if joint.rigid and not (place.fixed and GROUND in joint.bodies):
                arms, gid = _weld_arms(sheet, scene, pose, place), f"joint-{joint.name}-weld"
                with sheet.on(here, turn=bodies[0]):
                    symbols.weld(sheet, center, arms, gid)
        with sheet.on(here):
            if place.fixed:
                symbols.support(sheet, center, f"support-{place.letter}")
            if place.pinned:
                names = "-".join(joint.name for joint in place.joints if joint.pinned)
                symbols.pin(sheet, center, f"joint-{names}-pin")
    for reference in free_points(scene, pose):
        with sheet.on(reference):
            symbols.dot(sheet, sheet.at(scene.place(reference, pose)), f"point-{reference}")


def _weld_arms(sheet: Sheet, scene: DrawnScene, pose: int, place: Place) -> list[Array]:
    """Return one direction of each welded body."""
    arms = []
    for reference in place.references:
        body, point = reference.split(".")
        start = sheet.at(scene.place(reference, pose))
        for other in scene.mechanism.body(body).points if body != GROUND else ():
            arm = sheet.at(scene.place(f"{body}.{other}", pose)) - start
            if other != point and np.hypot(*arm) > 1e-6:
                arms.append(arm)
                break
    return arms
