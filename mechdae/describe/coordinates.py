"""Names of coordinates and outputs: ``crank.angle``, ``slider.C.x``, ``slot.slide``."""

from __future__ import annotations

from dataclasses import dataclass

from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.errors import MechanismError, UnavailableError, UnknownName

ANGLE_JOINTS = ("revolute", "pin-in-slot")
SLIDE_JOINTS = ("prismatic", "pin-in-slot")


@dataclass(frozen=True)
class Coordinate:
    """A scalar that can be driven, sketched or reported.

    ``kind`` is "body angle", "point", "joint angle" or "slide"; ``part`` the body or joint,
    ``point`` and ``axis`` (0, 1, 2) complete a point's coordinate.
    """

    text: str
    kind: str
    part: str
    point: str = ""
    axis: int = 0

    @property
    def is_angle(self) -> bool:
        """Whether the unit is the radian (else the metre)."""
        return self.kind in ("body angle", "joint angle")


def coordinate(mechanism: Mechanism, text: str) -> Coordinate:
    """Return the coordinate named `text`.

    Raises
    ------
    UnknownName
        With the nearest coordinates of the mechanism.
    MechanismError
        A point of the ground, or a coordinate the joint does not have.
    """
    parts = text.split(".")
    if parts[0] in mechanism.bodies:
        if parts[1:] == ["angle"]:
            return Coordinate(text, "body angle", parts[0])
        points = mechanism.bodies[parts[0]].points
        if len(parts) == 3 and parts[1] in points:
            axis = Mechanism.AXES[: mechanism.dimension].find(parts[2])
            if axis >= 0 and len(parts[2]) == 1:
                return Coordinate(text, "point", parts[0], parts[1], axis)
    elif parts[0] in mechanism.joints and len(parts) == 2:
        joint = mechanism.joints[parts[0]]
        if parts[1] == "angle" and joint.kind in ANGLE_JOINTS:
            return Coordinate(text, "joint angle", parts[0])
        if parts[1] == "slide" and joint.kind in SLIDE_JOINTS:
            return Coordinate(text, "slide", parts[0])
        if parts[1] in ("angle", "slide"):
            raise MechanismError(f"a {joint.kind} joint has no coordinate '{text}'")
    elif parts[0] == GROUND:
        raise MechanismError(f"'{text}' is fixed: the ground does not move")
    error = UnknownName("coordinate", text, coordinate_names(mechanism))
    if text in mechanism.bodies:
        error.hint = f"did you mean {text}.angle?"
    raise error


def coordinate_names(mechanism: Mechanism) -> list[str]:
    """Return the names of all coordinates of the mechanism."""
    names = []
    for name, body in mechanism.bodies.items():
        names.append(f"{name}.angle")
        for point in body.points:
            names += [f"{name}.{point}.{axis}" for axis in Mechanism.AXES[: mechanism.dimension]]
    for name, joint in mechanism.joints.items():
        names += [f"{name}.angle"] if joint.kind in ANGLE_JOINTS else []
        names += [f"{name}.slide"] if joint.kind in SLIDE_JOINTS else []
    return names


@dataclass(frozen=True)
class Selection:
    """What a task reports: bodies, points ``body.point`` and joints by name."""

    bodies: tuple[str, ...]
    points: tuple[str, ...]
    joints: tuple[str, ...]


def selection(mechanism: Mechanism, outputs: tuple[str, ...] | None) -> Selection:
    """Return the bodies, points and joints that `outputs` name; None means all.

    Raises
    ------
    UnknownName
        Nothing of that name, with the nearest ones.
    """
    own = {n: [f"{n}.{point}" for point in body.points] for n, body in mechanism.bodies.items()}
    every = {point: None for points in own.values() for point in points}
    joints = {n: j for n, j in mechanism.joints.items() if j.kind in ANGLE_JOINTS + SLIDE_JOINTS}
    if outputs is None:
        return Selection(tuple(mechanism.bodies), tuple(every), tuple(joints))
    bodies: list[str] = []
    points: list[str] = []
    chosen: list[str] = []
    for text in outputs:
        if text in every:
            points.append(text)
        elif text in mechanism.bodies:
            bodies.append(text)
            points += own[text]
        elif text in joints:
            chosen.append(text)
        elif text in mechanism.outputs:
            raise UnavailableError(
                f"the named output '{text}' is not computed by this version",
                hint="name bodies, points, joints or coordinates",
            )
        else:
            try:
                found = coordinate(mechanism, text)
            except UnknownName:
                names = [*every, *mechanism.bodies, *joints, *coordinate_names(mechanism)]
                raise UnknownName("output", text, names) from None
            if found.kind == "body angle":
                bodies.append(found.part)
            elif found.kind == "point":
                points.append(f"{found.part}.{found.point}")
            else:
                chosen.append(found.part)
    return Selection(*(tuple(dict.fromkeys(items)) for items in (bodies, points, chosen)))
