"""Axodes behind a spatial mechanism: the screw axes of a body at the poses, as ruled surfaces.

The fixed surface is drawn where it is, the moving one where the body carries it in the pose drawn;
they touch along the axis of that pose.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mechdae.draw import style
from mechdae.draw.sheet import Sheet
from mechdae.draw.space.anchors import size_of
from mechdae.draw.space.spatial_drawing import SpatialView
from mechdae.draw.space.spatial_scene import SpatialScene
from mechdae.draw.space.viewpoint import Array, Viewpoint
from mechdae.draw.words import Words
from mechdae.errors import InputError, UnknownName
from mechdae.records import dataclass
from mechdae.results.status import stretches
from mechdae.types import Floats

if TYPE_CHECKING:
    from mechdae.results import SweepResult


HALF = 0.7
"""Half length of a ruling in sizes of the mechanism."""
NEAR = 2.5
"""Sizes of the mechanism beyond which axes are left out."""
MOST = 72
"""Rulings of a surface."""
MOVING = (0, (4, 1.5))
AXIS = (0, (7, 2, 1.5, 2))
KINDS = ("fixed", "moving")


@dataclass(frozen=True)
class Rulings:
    """Ends of the rulings of one surface, (n, 2, 3), nan where there is no axis near."""

    body: str
    kind: str
    ends: Array


def with_axodes(
    view: SpatialView, result: SweepResult, scene: SpatialScene, bodies: Sequence[str], pose: int,
    words: Words,
) -> SpatialView:  # fmt: skip
    """Return a view with the axodes of bodies behind the mechanism."""
    assert view.bounds is not None
    surfaces = rulings(result, scene, bodies, pose)
    bounds = with_room(view.bounds, surfaces, view.viewpoint)
    return replace(view, bounds=bounds, overlay=drawn(surfaces, view.viewpoint, pose, words))


def rulings(
    result: SweepResult, scene: SpatialScene, bodies: Sequence[str], pose: int
) -> list[Rulings]:
    """Return both axodes of bodies as they lie in a pose.

    Raises
    ------
    InputError
        A body whose axodes the result does not have.
    """
    found = []
    middle, size = _middle(scene, pose), size_of(scene, pose)
    for body in dict.fromkeys(bodies):
        if body not in scene.mechanism.bodies:
            raise UnknownName("body", body, list(scene.mechanism.bodies), where="axodes")
        series = result.bodies.get(body, {})
        if "axode_fixed_point" not in series:
            still = result.summary.get("axodes", {}).get("never_turn", ())
            raise InputError(
                f"body {body} never turns: it has no axodes" if body in still
                else f"the result has no axodes of '{body}'",
                where="axodes",
                hint="another body" if body in still else 'measures = ["axodes"] in a sweep of it',
            )  # fmt: skip
        for kind in KINDS:
            point = np.array(series[f"axode_{kind}_point"], float)
            direction = np.array(series[f"axode_{kind}_direction"], float)
            if kind == "moving":
                turn = scene.turns[body][pose]
                point = point @ turn.T + scene.origin(body)[pose]
                direction = direction @ turn.T
            found.append(Rulings(body, kind, _ends(point, direction, middle, size)))
    return found


def _middle(scene: SpatialScene, pose: int) -> Array:
    """Return the middle of the points of a mechanism in a pose."""
    places = [
        scene.place(ref, pose) for body in scene.mechanism.bodies for ref in scene.points(body)
    ]
    known = np.array([place for place in places if np.isfinite(place).all()] or [np.zeros(3)])
    middle: Array = (known.min(axis=0) + known.max(axis=0)) / 2
    return middle


def _ends(point: Array, direction: Array, middle: Array, size: float) -> Array:
    """Return the ends of lines, each around its point that is nearest to the middle."""
    along = np.sum((middle - point) * direction, axis=1, keepdims=True)
    foot = point + along * direction
    reach = HALF * size * direction
    ends: Array = np.stack([foot - reach, foot + reach], axis=1)
    with np.errstate(invalid="ignore"):
        ends[np.linalg.norm(foot - middle, axis=1) > NEAR * size] = np.nan
    return ends


def with_room(
    bounds: tuple[Array, Array, float], every: Sequence[Rulings], view: Viewpoint
) -> tuple[Floats, Floats, float]:
    """Return the corners of a picture that shows the surfaces too."""
    low, high, size = bounds
    for lines in every:
        flat = view.flat(lines.ends.reshape(-1, 3))
        flat = flat[np.isfinite(flat).all(axis=1)]
        if len(flat):
            low, high = np.minimum(low, flat.min(axis=0)), np.maximum(high, flat.max(axis=0))
    return low, high, size


def drawn(
    every: Sequence[Rulings], view: Viewpoint, pose: int, words: Words
) -> Callable[[Sheet], str]:
    """Return what draws the surfaces on a sheet, and then returns the note below it."""

    def draw(sheet: Sheet) -> str:
        names = []
        for k, lines in enumerate(every):
            color = style.color_of(k)
            ends = view.flat(lines.ends)
            gid = f"axode-{lines.kind}-{lines.body}"
            dash = MOVING if lines.kind == "moving" else None
            step = max(1, -(-len(ends) // MOST))
            for line in ends[::step]:
                if np.isfinite(line).all():
                    sheet.line(sheet.at(line), color=color, width=0.4, z=style.Z_TRACE, gid=gid,
                               dash=dash, weight=0.0)  # fmt: skip
            for side in (0, 1):
                for part in _whole(ends[:, side]):
                    sheet.line(sheet.at(part), color=color, width=style.THIN, z=style.Z_TRACE,
                               gid=f"{gid}-rim", dash=dash, weight=0.0)  # fmt: skip
            if lines.kind == "fixed" and np.isfinite(ends[pose]).all():
                sheet.line(sheet.at(ends[pose]), z=style.Z_GHOST, dash=AXIS, weight=style.SHADE,
                           gid=f"screw-axis-{lines.body}")  # fmt: skip
            names.append(f"{lines.body} {words(lines.kind + ' axode')}")
        return ", ".join(names)

    return draw


def _whole(line: Array) -> list[Array]:
    """Return the stretches of a line that have a place."""
    there = np.isfinite(line).all(axis=1)
    return [line[a:b] for a, b in stretches(there) if b - a > 1]
