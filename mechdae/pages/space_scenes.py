"""What a page draws of a spatial mechanism: joints with their axes, and from where it is seen."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.describe.joints import Joint
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.spatial_joints import AXES, SpatialJoint
from mechdae.draw.space.anchors import anchor
from mechdae.draw.space.pose_choice import choose
from mechdae.draw.space.spatial_scene import read_spatial
from mechdae.results import Result


def joint_in_space(mechanism: Mechanism, joint: Joint) -> dict[str, Any]:
    """Return what is drawn of a joint.

    ``axis`` is its direction in the first body and ``axis2`` the one in the second, ``sliding``
    tells that its symbol is at the second point.
    """
    values = mechanism.values()

    def vector(name: str) -> list[float]:
        given = np.array([values[f"{joint.name}.{name}.{axis}"] for axis in AXES])
        size = float(np.linalg.norm(given))
        return [float(part) / size for part in given]

    entry: dict[str, Any] = {"sliding": joint.straight, "pointer": joint.pointer}
    if isinstance(joint, SpatialJoint) and dict(joint.directions()):
        entry |= {"axis": vector(joint.side(False)[0]), "axis2": vector(joint.side(True)[0])}
    return entry


def space_of(result: Result) -> dict[str, Any]:
    """Return the direction to look from, and symbols that are moved along their axes [m]."""
    scene = read_spatial(result)
    pose, view, moved = choose(scene, result.kind, None, None)
    anchors = [
        anchor(scene, joint, pose, moved)[0].tolist()
        for joint in scene.joints(pose)
        if joint.name in moved
    ]
    return {
        "azimuth": view.azimuth,
        "elevation": view.elevation,
        "up": list(view.upward),
        "moved": moved,
        "anchors": anchors,
    }
