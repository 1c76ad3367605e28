"""The pose that is explained, in the plane or in space."""

from __future__ import annotations

from typing import Any

from mechdae.draw.diagram.scene import choose_pose, read_scene
from mechdae.errors import InputError
from mechdae.parts.paper.explanations.subject import KINDS, Subject
from mechdae.parts.paper.phrases import Phrases


def subject_of(result: Any, pose: int | None, say: Phrases) -> Subject:
    """Return the pose to be explained."""
    if result.kind not in KINDS:
        raise InputError(
            f"a task of kind {result.kind} is not explained",
            hint="a sweep, or a task of kind reactions",
        )
    if result.mechanism.dimension == 3:
        from mechdae.parts.paper.explanations.space.spatial_subject import seen_in_space

        make, scene, index = seen_in_space(result, pose)
    else:
        make, scene = Subject, read_scene(result)
        index = choose_pose(scene, result.kind, pose)
    good = [k for k in scene.assembled() if scene.status[k] != "jammed"]
    if index not in good:
        near = min(good, key=lambda k: abs(k - index), default=None)
        if near is not None and pose is None:
            return make(result, scene, near, say)
        raise InputError(
            f"pose {index} is {scene.status[index]}: there is nothing to explain",
            hint=f"pose {near} is {scene.status[near]}" if near is not None else "",
        )
    return make(result, scene, index, say)
