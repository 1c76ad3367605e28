"""The names of all coordinates: what a task chooses by them, what is meant by an unknown one."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from mechdae.describe.coordinates import Selection, coordinate
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.errors import UnknownName


def coordinate_names(mechanism: Mechanism) -> list[str]:
    """Return the names of all coordinates of the mechanism."""
    names = []
    for name, body in mechanism.bodies.items():
        names += [f"{name}.angle"] if mechanism.dimension == 2 else []
        for point in body.points:
            names += [f"{name}.{point}.{axis}" for axis in mechanism.axes]
    for name, joint in mechanism.joints.items():
        names += [f"{name}.{word}" for word in sorted(joint.coordinates)]
    return [*names, *(name for name in mechanism.aliases if "." in name)]


def no_coordinate(mechanism: Mechanism, text: str) -> UnknownName:
    """Return the error for a name that no coordinate has."""
    parts = text.split(".")
    error = UnknownName("coordinate", text, coordinate_names(mechanism))
    if mechanism.dimension == 3 and parts[1:] in ([], ["angle"]) and parts[0] in mechanism.bodies:
        error.hint = "bodies have no angle in space: name that of a joint, or a point"
    elif text in mechanism.bodies:
        error.hint = f"did you mean {text}.angle?"
    return error


def instead(joint: Joint) -> str:
    """Return what can be named instead of a coordinate that a joint does not have."""
    if joint.coordinates:
        return f"it has {' and '.join(f'{joint.name}.{word}' for word in joint.coordinates)}"
    point = joint.first if joint.second_body == GROUND else joint.second
    return f"name the place of a point, like {point}"


def chosen(
    mechanism: Mechanism,
    outputs: Sequence[str],
    points_of: Mapping[str, Sequence[str]],
    joints: Collection[str],
) -> Selection:
    """Return what a task names, see `selection`; `points_of` bodies, `joints` with coordinates."""
    every = [point for points in points_of.values() for point in points]
    bodies: list[str] = []
    points: list[str] = []
    moving: list[str] = []
    for text in outputs:
        if text in every:
            points.append(text)
        elif text in mechanism.bodies:
            bodies.append(text)
            points += points_of[text]
        elif text in joints:
            moving.append(text)
        elif text not in mechanism.outputs:
            try:
                result = coordinate(mechanism, text)
            except UnknownName:
                names = [*every, *mechanism.bodies, *joints, *coordinate_names(mechanism)]
                names += mechanism.outputs
                raise UnknownName("output", text, names) from None
            if result.kind == "body angle":
                bodies.append(result.part)
            elif result.kind == "point":
                points.append(f"{result.part}.{result.point}")
            else:
                moving.append(result.part)
    named = [text for text in outputs if text in mechanism.outputs]
    return Selection(*(tuple(dict.fromkeys(items)) for items in (bodies, points, moving, named)))
