"""A scene of space as fragments: facets in frames of bodies, which a page projects and paints."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from mechdae.describe.loads import Resistance
from mechdae.draw import style
from mechdae.draw.diagram.amounts import load_values
from mechdae.draw.diagram.loads import peak_force
from mechdae.draw.fragments import FragmentWriter, look_of
from mechdae.draw.labels.steady import compared
from mechdae.draw.primitives import Anchor, Array
from mechdae.draw.sheet import Sheet
from mechdae.draw.space.depth import Item
from mechdae.draw.space.pose_choice import choose
from mechdae.draw.space.spatial_drawing import (
    SpatialFrame,
    SpatialView,
    extent,
    items_of,
    steady_in_space,
)
from mechdae.draw.space.spatial_loads import SpatialLoads
from mechdae.draw.space.spatial_pose import SpatialPose
from mechdae.draw.space.spatial_scene import SpatialScene, read_spatial
from mechdae.draw.words import Words
from mechdae.types import Json

if TYPE_CHECKING:
    from mechdae.results import SweepResult


def fragments_in_space(result: SweepResult, shares: Array, lang: str = "en") -> tuple[Json, Json]:
    """Return from where a motion is seen, and what is drawn of it.

    ``shares`` are those of the way at all poses. In what is drawn,
    ``solids``: what is drawn in space, see `_solid`; ``along``: places along axes by name: a point,
    a body, a direction in it, how far [m]; ``parts``: labels, as in the plane; ``traces``: points
    whose paths are drawn.
    """
    scene = read_spatial(result)
    index, view, moved = choose(scene, result.kind, None, None)
    some = compared(scene.assembled() or [index], index)
    bounds = extent(scene, some, view, moved, True)
    peak = peak_force(scene, result, some)
    shown = SpatialView(bounds=bounds, peak=peak, larger=style.PAGE, viewpoint=view, moved=moved)
    sheet, labels = steady_in_space(scene, result, some, shown, Words(lang))
    paper = Sheet(None, *bounds[:2], larger=style.PAGE)
    pose, items, _ = items_of(paper, scene, result, index, shown)
    loads = SpatialLoads(pose, result, Words(lang), peak)
    arrows = [arrow for arrow in loads.arrows() if _steady(scene, result, str(arrow.gid), some)]
    drawn = {arrow.gid for arrow in arrows}
    sheet.drawn.clear()
    labels.write(
        sheet, index, [mark for mark in loads.marks if f"load-{mark.name}" in drawn], shares
    )
    writer = FragmentWriter(sheet, lambda body: SpatialFrame(sheet, pose, body))
    drawing = {
        "solids": list(_solids(items + arrows, pose)),
        "along": {name: [*row[:2], row[2].tolist(), row[3]] for name, row in pose.along.items()},
        "parts": list(writer.parts(style.Z_LABEL)),
        "traces": list(scene.paths),
    }
    space = {"azimuth": view.azimuth, "elevation": view.elevation, "up": list(view.upward)}
    return space, drawing


def _steady(scene: SpatialScene, result: SweepResult, gid: str, poses: Sequence[int]) -> bool:
    """Return whether an arrow is the same in all poses, seen from what it turns with."""
    load = scene.mechanism.loads[gid.removeprefix("load-")]
    rows = [load_values(scene, result, load, k) for k in poses]
    return not isinstance(load, Resistance) and all(row == rows[0] for row in rows)


def _solids(items: list[Item], pose: SpatialPose) -> Iterator[Json]:
    """Yield what is drawn of items: ``at`` the places, ``turn`` what it turns with, ``shapes``.

    A shape is a kind (`mechdae.draw.space.depth.Facet`), a paint, a size and the ways of its places
    from those ``at``, in units; of ``round`` ones by middle, pole and rim.
    """
    for item in items:
        anchor = item.anchor
        bases = np.array([pose.at(pose.base(name)) for name in anchor.points])
        turn = pose.view.basis @ pose.turned(anchor.turn)
        part: Json = {"id": item.gid or "", "at": list(anchor.points), "turn": anchor.turn}
        if item.is_face or (item.bridges and not item.closed):
            part["owner"] = item.owner
        if anchor.grow:
            part["grow"] = [anchor.grow, round(_length(anchor, pose), 6)]
        part["shapes"] = []
        for facet in item.parts:
            each = len(bases) == len(facet.points)
            ways = (facet.points - (bases if each else bases[:1])) @ turn
            kind = f"{facet.kind} round" if facet.round else facet.kind
            row = [round(coordinate, 2) + 0.0 for coordinate in ways.ravel().tolist()]
            part["shapes"].append([kind, look_of(facet), round(facet.size, 2), row])
        yield part


def _length(anchor: Anchor, pose: SpatialPose) -> float:
    if ">" not in anchor.grow:
        return pose.sheet.metre
    a, b = (pose.base(name) for name in anchor.grow.split(">"))
    return float(np.linalg.norm(b - a)) * pose.sheet.metre
