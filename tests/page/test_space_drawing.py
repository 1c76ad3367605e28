"""What a page draws in space is what `plot` draws there: the same facets in the same places."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from mechdae.draw import style
from mechdae.draw.fragments import fragments
from mechdae.draw.labels.steady import compared
from mechdae.draw.sheet import Sheet
from mechdae.draw.space.pose_choice import choose
from mechdae.draw.space.spatial_drawing import SpatialView, extent, items_of
from mechdae.draw.space.spatial_scene import read_spatial
from tests.shared.node import needs_node
from tests.shared.page_solids import placed, pose_of
from tests.shared.wheels_in_space import SCENES, TURN

UNIT = 0.6
"""What a place may be off [unit of the sheet]."""
CHOSEN = ("driver-", "support-", "node-")
"""What is turned to the eye, or to what room there is, in the pose that is drawn."""
AT_ONCE = ("rssr", "bennett", "cardan-joint")
NAMES = ("wobble-plate", "spatial-slider-crank-loops", "delta-robot", "screw-press")
"""Those that the long run compares."""


@needs_node
@pytest.mark.parametrize(
    "name",
    [
        *AT_ONCE,
        *(f"wheels {scene}" for scene in SCENES),
        *(pytest.param(name, marks=pytest.mark.slow) for name in NAMES),
    ],
)
def test_facets_are_those_of_plot(name, tmp_path):
    wheels = name.removeprefix("wheels ") if name.startswith("wheels") else None
    result = md.solve(SCENES[wheels], TURN) if wheels else md.solve(name)
    scene = read_spatial(result)
    index, view, moved = choose(scene, result.kind, None, None)
    known = scene.assembled()
    bounds = extent(scene, compared(known or [index], index), view, moved, True)
    shown = SpatialView(loads=False, bounds=bounds, viewpoint=view, moved=moved)
    sheet = Sheet(None, *bounds[:2], larger=style.PAGE)
    rows = [known[len(known) // 7], known[len(known) // 2], known[-1]]
    poses = [pose_of(scene, k) for k in rows]
    drawing = fragments(result, np.linspace(0.0, 1.0, len(result.status)))[1]
    found = placed(drawing, poses, view.basis.tolist(), sheet.metre, tmp_path)
    compared_facets = 0
    for k, shapes in zip(rows, found, strict=True):
        items = items_of(sheet, scene, result, k, shown)[1]
        origin = view.flat(np.zeros(3))
        shift = np.array([*sheet.at(origin), 0.0])
        left = [(own[0], own[1], np.array(own[2]) + shift) for own in shapes]
        for item in items:
            if str(item.gid).startswith(CHOSEN):
                continue
            for facet in item.parts:
                kind = f"{facet.kind} round" if facet.round else facet.kind
                off = [
                    apart(facet, places)
                    for gid, own, places in left
                    if gid == item.gid
                    and own == kind
                    and (kind == "area" or len(places) == len(facet.points))
                ]
                assert off, (k, item.gid, kind)
                assert min(off) <= UNIT, (k, item.gid, kind, min(off))
                compared_facets += 1
    assert compared_facets >= 3 * 5


def outside(places, corners):
    """Return how far the farthest of places is from the border of a polygon."""
    a, way = corners, np.roll(corners, -1, axis=0) - corners
    off = places[:, None] - a
    along = np.clip((off * way).sum(axis=2) / (way**2).sum(axis=1), 0.0, 1.0)
    return float(np.linalg.norm(off - along[..., None] * way, axis=2).min(axis=1).max())


def apart(facet, places):
    """Return how far places are from those of a facet; a circle may begin anywhere."""
    if not facet.round:
        if facet.kind == "area":  # which may begin at any corner, and have one on an edge
            return max(outside(places, facet.points), outside(facet.points, places))
        return float(np.abs(places - facet.points).max())
    rows = [own.reshape(-1, 3, 3) for own in (places, facet.points)]
    radii = [np.linalg.norm(own[:, 2] - own[:, 0], axis=1) for own in rows]
    off = max(np.abs(rows[0][:, :2] - rows[1][:, :2]).max(), np.abs(radii[0] - radii[1]).max())
    return float(off)
