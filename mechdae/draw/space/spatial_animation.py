"""The diagram of a spatial mechanism in motion, from one direction."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from mechdae.draw import style
from mechdae.draw.animation import (
    CLOSED,
    SECONDS,
    Animation,
    check_frames,
    frame_time,
    frames_of,
)
from mechdae.draw.diagram.diagram import has_paths
from mechdae.draw.diagram.loads import peak_force
from mechdae.draw.figure import new_axes
from mechdae.draw.labels.steady import compared
from mechdae.draw.sheet import Sheet
from mechdae.draw.smooth import traced
from mechdae.draw.space.anchors import offsets
from mechdae.draw.space.pose_choice import wireframe
from mechdae.draw.space.spatial_drawing import (
    SpatialView,
    draw_spatial_pose,
    extent,
    steady_in_space,
)
from mechdae.draw.space.spatial_scene import SpatialScene, read_spatial
from mechdae.draw.space.spatial_wheels import sides
from mechdae.draw.space.view_choice import best_view
from mechdae.draw.space.viewpoint import Viewpoint, upward_of, viewpoint
from mechdae.draw.words import Words
from mechdae.errors import InputError
from mechdae.records import dataclass

LOOKED_AT = 7
"""Poses by which the direction is chosen."""


@dataclass(frozen=True)
class SpatialAnimation(Animation):
    """Frames of a motion in space, see `mechdae.draw.animation.Animation`.

    Parameters
    ----------
    viewpoint
        From where; without it the direction with the least clutter in all poses.
    """

    viewpoint: Viewpoint | None = None

    @cached_property
    def _scene(self) -> SpatialScene:
        scene = read_spatial(self.result)
        if not self.traces or not has_paths(self.result, scene):
            return scene
        way: SpatialScene = traced(scene, self.result, read_spatial)
        return way

    def drawn(self, poses: Sequence[int], axes: bool = False) -> Iterator[Sheet]:
        """Yield the drawing of each pose, all to one scale, on axes or as primitives alone."""
        scene = self._scene
        moved = offsets(scene, poses[0], sides(scene, poses[0]))
        step = max(len(poses) // LOOKED_AT, 1)
        frames = [wireframe(scene, pose, moved) for pose in poses[::step]]
        eye = self.viewpoint or best_view(frames, upward_of(scene.mechanism))
        traces = self.traces and has_paths(self.result, scene)
        bounds = extent(scene, poses, eye, moved, traces)
        peak = peak_force(scene, self.result, poses) if self.loads else None
        view = SpatialView(
            traces, 0, self.labels, self.loads, bounds, peak, {}, viewpoint=eye, moved=moved
        )
        if self.labels:
            some, words = compared(poses, poses[0]), Words(self.lang)
            labels = steady_in_space(scene, self.result, some, view, words)[1]
            view = replace(view, steady=labels)
        theme = style.DARK if self.dark else style.LIGHT
        for pose in poses:
            paper = new_axes(theme) if axes else None
            yield draw_spatial_pose(
                paper, self._scene, self.result, pose, view, theme, Words(self.lang)
            )


def draw(
    result: Any,
    ax: object = None,
    *,
    frames: int | None = None,
    seconds: float = SECONDS,
    dpi: int = style.DPI,
    view: Any = None,
    **shown: Any,
) -> SpatialAnimation:
    """Return the motion of a result as an animation, see `mechdae.draw.animation.animate`.

    ``view`` is azimuth and elevation of the eye [deg].

    Raises
    ------
    InputError
        Fewer than two poses, or numbers out of range.
    """
    if ax is not None:
        raise InputError("an animation has a figure of its own", where="ax")
    Words(shown.get("lang", "en"))
    most = check_frames(frames, seconds, dpi)
    scene = read_spatial(result)
    eye = None if view is None else viewpoint(scene.mechanism, view)
    chosen, whole = frames_of(scene.assembled(), lambda run: returns(scene, run), most)
    duration = frame_time(seconds, len(chosen))
    return SpatialAnimation(result, chosen, whole, duration, dpi, **shown, viewpoint=eye)


def returns(scene: SpatialScene, run: Sequence[int]) -> bool:
    """Return whether a run of poses ends where it begins: points and directions."""
    if len(run) < 3:
        return False
    ends = [run[0], run[-1]]
    for track in scene.tracks.values():
        spread = float(np.ptp(track[list(run)], axis=0).max())
        if float(np.linalg.norm(np.diff(track[ends], axis=0))) > CLOSED * spread:
            return False
    turned = [np.abs(np.diff(turn[ends], axis=0)).max() for turn in scene.turns.values()]
    return float(max(turned, default=0.0)) <= CLOSED
