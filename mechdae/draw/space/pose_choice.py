"""The pose and the direction that are drawn without a wish: those that are easy to read."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdae.describe.mechanism import GROUND
from mechdae.draw.diagram.scene import SHORT, in_book, longest_run, named_pose
from mechdae.draw.space.anchors import anchor, offsets, size_of
from mechdae.draw.space.spatial_scene import SpatialScene
from mechdae.draw.space.spatial_wheels import sides
from mechdae.draw.space.viewpoint import (
    Array,
    Viewpoint,
    Wireframe,
    best_view,
    candidates,
    clutter,
    upward_of,
    viewpoint,
)

TRIED = 9
"""Poses that are compared."""
LOOKED_AT = 7
"""Poses of a motion by which its direction is chosen."""
SAME = 1e-6
"""Points nearer than this share of the mechanism are one place."""


def choose(
    scene: SpatialScene, kind: str, pose: int | None, view: tuple[float, float] | str | None
) -> tuple[int, Viewpoint, dict[str, float]]:
    """Return the pose, the viewpoint, and how far symbols are moved along their axes.

    Raises
    ------
    InputError
        A pose that the result does not have, no direction to look from.
    """
    count, up = len(scene.status), upward_of(scene.mechanism)
    wanted = None if view is None else viewpoint(scene.mechanism, view)
    known = scene.assembled()
    if pose is not None:
        tried = [named_pose(count, pose)]
    elif not known:
        tried = [0]
    elif kind == "modes" or len(known) <= SHORT:
        tried = known[:1]
    else:
        run = longest_run(known)
        run = sorted(in_book(scene.turn, run)) or run
        share = np.linspace(0.1, 0.9, TRIED) * (len(run) - 1)
        tried = [run[k] for k in dict.fromkeys(share.round().astype(int).tolist())]
    middle_pose = tried[len(tried) // 2]
    moved = offsets(scene, middle_pose, sides(scene, middle_pose))
    frames = [wireframe(scene, index, moved) for index in tried]
    chosen = wanted or best_view(frames, up)
    if len(tried) == 1:
        return tried[0], chosen, moved
    if wanted is None:  # the best pose of all, from its own best direction
        views = candidates(up)
        basis = np.array([candidate.basis for candidate in views])
        least = [float(clutter(frame, basis).min()) for frame in frames]
    else:
        basis = np.array([chosen.basis])
        least = [float(clutter(frame, basis)[0]) for frame in frames]
    middle = np.abs(np.linspace(-1.0, 1.0, len(tried)))
    best = int(np.argmin(np.round(np.array(least) + 0.05 * middle, 6)))
    return tried[best], wanted or best_view([frames[best]], up), moved


def choose_for(
    scene: SpatialScene, poses: Sequence[int], view: tuple[float, float] | str | None
) -> tuple[Viewpoint, dict[str, float]]:
    """Return the viewpoint with the least clutter in poses, and how far symbols are moved."""
    moved = offsets(scene, poses[0], sides(scene, poses[0]))
    if view is not None:
        return viewpoint(scene.mechanism, view), moved
    step = max(len(poses) // LOOKED_AT, 1)
    frames = [wireframe(scene, pose, moved) for pose in poses[::step]]
    return best_view(frames, upward_of(scene.mechanism)), moved


def wireframe(scene: SpatialScene, pose: int, moved: dict[str, float]) -> Wireframe:
    """Return the places, bars and axes of one pose."""
    near = SAME * size_of(scene, pose)
    places: list[Array] = []

    def index(place: Array) -> int:
        for k, known in enumerate(places):
            if float(np.linalg.norm(known - place)) <= near:
                return k
        places.append(place)
        return len(places) - 1

    of_body: dict[str, set[int]] = {}
    axes: list[Array] = []
    for joint in scene.joints(pose):
        sides = anchor(scene, joint, pose, moved)
        for body, place in zip((joint.first_body, joint.second_body), sides, strict=True):
            if body == GROUND and joint.guide:
                continue  # a guide has no end of its own
            of_body.setdefault(body, set()).add(index(place))
        if joint.bar or joint.pointer:
            of_body[f"bar {joint.name}"] = {index(place) for place in sides}
        axis = scene.axis(joint, pose)
        if axis is not None and joint.turns:
            axes.append(axis)
        pin = scene.axis(joint, pose, second=True) if getattr(joint, "crossed", False) else None
        if pin is not None:
            axes.append(pin)
    for body in scene.mechanism.bodies:
        for reference in scene.points(body):
            place = scene.place(reference, pose)
            if np.isfinite(place).all():
                of_body.setdefault(body, set())
                of_body[body].add(index(place))
    of_body.pop(GROUND, None)
    bars = {
        (a, b)
        for nodes in of_body.values()
        for a in nodes
        for b in nodes
        if a < b and len(nodes) <= 4
    }
    return Wireframe(
        np.array(places).reshape(-1, 3), tuple(sorted(bars)), np.array(axes).reshape(-1, 3)
    )
