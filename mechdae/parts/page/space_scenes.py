"""What a page draws of a spatial mechanism: joints with their axes, and from where it is seen."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mechdae.describe import GROUND, Joint, Mechanism
from mechdae.describe.joints.bearings import bearings
from mechdae.describe.joints.spatial import AXES, SpatialJoint
from mechdae.draw import style
from mechdae.draw.fragments import FragmentWriter
from mechdae.draw.labels.steady import compared
from mechdae.draw.space.anchors import anchor
from mechdae.draw.space.pose_choice import choose
from mechdae.draw.space.spatial_drawing import SpatialFrame, SpatialView, extent, steady_in_space
from mechdae.draw.space.spatial_scene import SpatialScene, read_spatial
from mechdae.draw.words import Words
from mechdae.types import Json

if TYPE_CHECKING:
    from mechdae.results import SweepResult


def joint_in_space(mechanism: Mechanism, joint: Joint) -> Json:
    """Return what is drawn of a joint.

    ``axis`` is its direction in the first body and ``axis2`` the one in the second, ``sliding``
    tells that its symbol is at the second point.
    """
    entry: Json = {"sliding": joint.straight, "pointer": joint.pointer}
    if isinstance(joint, SpatialJoint) and dict(joint.directions()):
        sides = [_axis(mechanism, joint, second) for second in (False, True)]
        entry |= {"axis": sides[0], "axis2": sides[1]}
    if joint.wheels:
        entry["mesh"] = _mesh(mechanism, joint)
    return entry


def _axis(mechanism: Mechanism, joint: SpatialJoint, second: bool) -> list[float]:
    """Return the unit axis of a side of a joint, in the body of that side."""
    values = mechanism.values()
    given = np.array([values[f"{joint.name}.{joint.side(second)[0]}.{axis}"] for axis in AXES])
    size = float(np.linalg.norm(given))
    return [float(part) / size for part in given]


def _mesh(mechanism: Mechanism, mesh: Joint) -> Json:
    """Return what tells where the wheels, or wheel and rack, of a mesh are.

    ``members``: the body, its ``bearing`` on the ``carrier``, the axis there, the points of that
    joint on the carrier (``at``) and on the body (``end``), the body's ``own`` point of the mesh.
    """
    values, carrier = mechanism.values(), getattr(mesh, "carrier", None) or GROUND
    members = []
    for k, bearing in enumerate(bearings(mechanism, mesh)):
        joint = mechanism.joints[bearing.joint]
        second = joint.second_body == carrier
        at, end = (joint.second, joint.first) if second else (joint.first, joint.second)
        if not isinstance(joint, SpatialJoint):
            raise TypeError(f"{joint.name} has no axis in space")
        members.append(
            {
                "body": mesh.bodies[k],
                "bearing": joint.name,
                "carrier": carrier,
                "axis": _axis(mechanism, joint, second),
                "at": at,
                "end": end,
                "own": mesh.second if k else mesh.first,
            }
        )
    keys = [key for key in ("ratio", "radius") if f"{mesh.name}.{key}" in values]
    numbers = {key: values[f"{mesh.name}.{key}"] for key in keys}
    return {
        "members": members,
        "rack": mesh.wheels == 1,
        "point": getattr(mesh, "point", None),
        **numbers,
    }


def _reach(scene: SpatialScene, mesh: Joint) -> list[float]:
    """Return between which places a rack slides on its carrier [m]."""
    bearing = bearings(scene.mechanism, mesh)[1]
    joint = scene.mechanism.joints[bearing.joint]
    ways = [bearing.sense * scene.along(joint, pose) for pose in scene.assembled()]
    ways = [way for way in ways if np.isfinite(way)]
    return [min(ways), max(ways)] if ways else [0.0, 0.0]


def space_of(result: SweepResult, lang: str) -> tuple[Json, Json]:
    """Return the direction to look from with symbols moved along axes [m], and the labels."""
    scene = read_spatial(result)
    pose, view, moved = choose(scene, result.kind, None, None)
    anchors = [
        anchor(scene, joint, pose, moved)[0].tolist()
        for joint in scene.joints(pose)
        if joint.name in moved
    ]
    some = compared(scene.assembled() or [pose], pose)
    bounds = extent(scene, some, view, moved, True)
    shown = SpatialView(loads=False, bounds=bounds, viewpoint=view, moved=moved)
    sheet, labels = steady_in_space(scene, result, some, shown, Words(lang))
    labels.write(sheet, pose)
    writer = FragmentWriter(sheet, lambda own: SpatialFrame(sheet, scene, pose, own, shown))
    drawing = {"parts": list(writer.parts(style.Z_LABEL)), "traces": list(scene.paths)}
    return {
        "azimuth": view.azimuth,
        "elevation": view.elevation,
        "up": list(view.upward),
        "moved": moved,
        "anchors": anchors,
        "reaches": {
            joint.name: _reach(scene, joint)
            for joint in scene.mechanism.joints.values()
            if joint.wheels == 1
        },
    }, drawing
