"""The diagram of one pose of a result, in the plane or in space, in the manner of ISO 3952."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from mechdae.draw import style
from mechdae.draw.diagram.detail import draw_details
from mechdae.draw.diagram.diagram import (
    View,
    draw_pose,
    has_paths,
    larger_for,
    on_axes,
)
from mechdae.draw.diagram.places import AnyScene
from mechdae.draw.diagram.scene import choose_pose, read_scene
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import Sheet
from mechdae.draw.smooth import traced
from mechdae.draw.words import Words
from mechdae.errors import InputError
from mechdae.records import dataclass

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from mechdae.results.result import Result

Eye = tuple[float, float] | str | None


@dataclass(frozen=True)
class Seen:
    """A result as it is looked at.

    Parameters
    ----------
    scene
        Its placements, in the plane or in space.
    pose
        Index of the pose that is drawn.
    view
        What a diagram shows, in space from a viewpoint.
    """

    result: Any
    scene: AnyScene
    pose: int
    view: View

    @property
    def in_space(self) -> bool:
        return bool(self.scene.mechanism.dimension == 3)

    def with_paths(self) -> Seen:
        """Return it with paths of poses near each other."""
        return replace(self, scene=traced(self.scene, self.result, read_placed))

    def bounds(self, poses: Sequence[int], paths: bool) -> tuple[Array, Array, float]:
        """Return the corners [m] of what is in the pictures of poses, and the mechanism's size."""
        return self.view.room(self.scene, poses, paths)

    def draw(
        self, axes: Axes | None, view: View, theme: style.Theme, words: Words,
        pose: int | None = None,
    ) -> Sheet:  # fmt: skip
        """Draw a pose and return its sheet."""
        index = self.pose if pose is None else pose
        return draw_pose(axes, self.scene, self.result, index, view, theme, words)


def read_placed(result: Result) -> AnyScene:
    """Return the placements that a result holds, in the plane or in space."""
    if result.mechanism.dimension == 2:
        return read_scene(result)
    from mechdae.draw.space.spatial_scene import read_spatial

    return read_spatial(result)


def seen(
    result: Result, pose: int | None = None, eye: Eye = None, poses: Sequence[int] = ()
) -> Seen:
    """Return a result with the pose that is drawn and from where, those that are easy to read.

    ``poses`` are those of a motion, which is seen from one direction.

    Raises
    ------
    InputError
        A pose that the result does not have, no direction to look from.
    """
    kind, scene = getattr(result, "kind", ""), read_placed(result)
    if result.mechanism.dimension == 2:
        return Seen(result, scene, poses[0] if poses else choose_pose(scene, kind, pose), View())
    from mechdae.draw.space.pose_choice import choose, choose_for
    from mechdae.draw.space.spatial_drawing import SpatialView

    if poses:
        index, (viewpoint, moved) = poses[0], choose_for(scene, poses, eye)
    else:
        index, viewpoint, moved = choose(scene, kind, pose, eye)
    return Seen(result, scene, index, SpatialView(viewpoint=viewpoint, moved=moved))


def draw(
    result: Result,
    ax: Axes | None = None,
    *,
    pose: int | None = None,
    traces: bool = True,
    ghosts: int | Sequence[int] = 0,
    labels: bool = True,
    loads: bool = True,
    angles: Sequence[str] = (),
    dark: bool = False,
    lang: str = "en",
    scale: float | Callable[[float], float] | None = None,
    label: str = "",
    view: Eye = None,
    axodes: Sequence[str] | None = None,
) -> Axes:
    """Draw the kinematic diagram of one pose, of a spatial mechanism in parallel projection.

    Options are those of the catalogue. A new figure is larger than others where many joints are
    near each other; size and place of given axes decide the scale, so they should be final.
    ``ghosts`` may name poses; ``scale`` is metres per millimetre of paper, in space of lengths in
    the plane of the picture, or a function of the smallest that the axes allow. Without a
    ``view`` joints lie apart and no axis is seen edge-on.

    Returns
    -------
    matplotlib.axes.Axes
        Axes in metres, equal in both directions; of several views those of the front view.

    Raises
    ------
    InputError
        A pose that the result does not have, no direction to look from, axodes of several views
        or of a body that has none.
    UnknownName
        Another language.
    """
    words, theme = Words(lang), style.DARK if dark else style.LIGHT
    three = isinstance(view, str) and view.strip() == "three"
    shown = seen(result, pose, None if three else view)
    traces = traces and has_paths(result, shown.scene)
    shown = shown.with_paths() if traces else shown
    if three and axodes:
        raise InputError("axodes are drawn in one view", where="axodes", hint="leave view out")
    bounds = shown.bounds([shown.pose], traces or bool(ghosts))
    framed = replace(
        shown.view, traces=traces, ghosts=ghosts, labels=labels, loads=loads, bounds=bounds,
        scale=scale, label=label, angles=angles,
    )  # fmt: skip
    if not shown.in_space:
        larger = larger_for(shown.scene, shown.pose, *bounds[:2]) if ax is None else style.USUAL
        details = partial(draw_details, shown.scene, result, shown.pose, labels)
        framed = replace(framed, larger=larger, overlay=details)
    elif three or axodes:
        from mechdae.draw.space import axodes as surfaces
        from mechdae.draw.space.spatial_drawing import SpatialView
        from mechdae.draw.space.three_views import draw_three

        assert isinstance(framed, SpatialView)
        if three:
            return draw_three(result, shown.scene, shown.pose, framed, theme, words, ax)
        given = shown.scene, axodes or (), shown.pose
        framed = surfaces.with_axodes(framed, shown.result, *given, words)

    def paint(paper: Axes | None, margined: View) -> Sheet:
        return shown.draw(paper, margined, theme, words)

    return on_axes(ax, framed, theme, paint)
