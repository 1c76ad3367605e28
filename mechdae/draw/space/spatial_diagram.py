"""The kinematic diagram of a spatial mechanism, in the manner of ISO 3952."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from mechdae.draw import style
from mechdae.draw.diagram.diagram import has_paths, on_axes
from mechdae.draw.sheet import Sheet
from mechdae.draw.smooth import traced
from mechdae.draw.space.axodes import drawn, rulings, with_room
from mechdae.draw.space.pose_choice import choose
from mechdae.draw.space.spatial_drawing import SpatialView, draw_spatial_pose, extent
from mechdae.draw.space.spatial_scene import read_spatial
from mechdae.draw.space.three_views import draw_three
from mechdae.draw.words import Words
from mechdae.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from mechdae.results import SweepResult


def draw(
    result: SweepResult,
    ax: Axes | None = None,
    *,
    pose: int | None = None,
    traces: bool = True,
    ghosts: int | Sequence[int] = 0,
    labels: bool = True,
    loads: bool = True,
    dark: bool = False,
    lang: str = "en",
    scale: float | Callable[[float], float] | None = None,
    label: str = "",
    view: tuple[float, float] | str | None = None,
    axodes: Sequence[str] | None = None,
) -> Axes:
    """Draw the kinematic diagram of one pose in parallel projection.

    Parameters
    ----------
    result
        What `mechdae.solve` returned of a spatial mechanism.
    ax
        Axes to draw in; without it those of a new figure.
    pose
        Index of the pose, negative from the end; by default one near the middle of a sweep that
        is easy to read, the first of a few.
    traces, ghosts, labels, loads, dark, lang, scale, label
        As in the plane, see `mechdae.draw.diagram.diagram.draw`. ``scale`` is that of lengths in
        the plane of the picture.
    view
        ``"azimuth,elevation"`` or two numbers [deg]; without it a direction from which the joints
        lie apart and no axis is seen edge-on. ``"three"``: front, top and left view beside it.
    axodes
        Bodies whose axodes are drawn behind, with the screw axis of the pose: the fixed surface
        and the moving one, where the body carries it. The task has the measure ``axodes``.

    Returns
    -------
    matplotlib.axes.Axes
        Axes in metres of the picture's plane; of several views those of the front view.

    Raises
    ------
    InputError
        A pose that the result does not have, no direction to look from, axodes of several views
        or of a body that has none.
    UnknownName
        Another language.
    """
    words, theme = Words(lang), style.DARK if dark else style.LIGHT
    scene = read_spatial(result)
    three = isinstance(view, str) and view.strip() == "three"
    traces = traces and has_paths(result, scene)
    scene = traced(scene, result, read_spatial) if traces else scene
    index, chosen, moved = choose(scene, getattr(result, "kind", ""), pose, None if three else view)
    surfaces = rulings(result, scene, axodes, index) if axodes else []
    if three and surfaces:
        raise InputError("axodes are drawn in one view", where="axodes", hint="leave view out")
    bounds = extent(scene, [index], chosen, moved, traces)
    shown = SpatialView(
        traces, ghosts, labels, loads, bounds, scale=scale, label=label,
        viewpoint=chosen, moved=moved,
    )  # fmt: skip
    if three:
        return draw_three(result, scene, index, shown, theme, words, ax)
    if surfaces:
        behind = drawn(surfaces, chosen, index, words)
        shown = replace(shown, bounds=with_room(bounds, surfaces, chosen), overlay=behind)

    def paint(paper: Axes | None, view: SpatialView) -> Sheet:
        return draw_spatial_pose(paper, scene, result, index, view, theme, words)

    return on_axes(ax, shown, theme, paint)
