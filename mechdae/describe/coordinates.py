"""Names of coordinates and outputs: ``crank.angle``, ``slider.C.x``, ``slot.slide``."""

from __future__ import annotations

from dataclasses import replace

from mechdae.describe.coordinate_kinds import KINDS, PLACE, kind_of
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.errors import MechanismError, MechdaeError, UnknownName
from mechdae.records import dataclass

RELATIVE = {
    "angle": "joint angle",
    "angle2": "joint angle 2",
    "slide": "slide",
    "x": "joint x",
    "y": "joint y",
    "s": "curve",
    "length": "length",
    "elevation": "elevation",
    "azimuth": "azimuth",
}
"""Kinds of the relative coordinates of joints by their names."""
BALL = "component of a unit quaternion"
"""Kind of what tells the turn of a ball joint; no file names it."""
RATES = (".speed", ".acceleration")
"""Ends of the names of rates."""
ANGLES = ("body angle", *(RELATIVE[word] for word in ("angle", "angle2", "elevation", "azimuth")))


@dataclass(frozen=True)
class NamedCoordinate:
    """A scalar that can be driven, sketched or reported.

    ``kind`` is "body angle", "point" or one of `RELATIVE`; ``part`` the body or joint,
    ``point`` and ``axis`` (0, 1, 2) complete a point's coordinate.
    """

    text: str
    kind: str
    part: str
    point: str = ""
    axis: int = 0

    @property
    def is_angle(self) -> bool:
        """Whether the unit is the radian."""
        return self.kind in ANGLES

    def bodies(self, mechanism: Mechanism) -> tuple[str, ...]:
        """Return the bodies that it belongs to."""
        joint = mechanism.joints.get(self.part)
        return (self.part,) if joint is None else joint.bodies

    @property
    def word(self) -> str:
        """The last word of its name."""
        return self.text.rpartition(".")[2]

    @property
    def on_curve(self) -> bool:
        """Whether it is a place on a curve, whose unit is the user's."""
        return self.kind == RELATIVE["s"]

    @property
    def unit(self) -> str:
        """The unit: "rad", "m", or "1" for the parameter of a curve."""
        return "rad" if self.is_angle else "1" if self.on_curve or self.kind == BALL else "m"


def coordinate(mechanism: Mechanism, text: str) -> NamedCoordinate:
    """Return the coordinate named `text`.

    Raises
    ------
    UnknownName
        With the nearest coordinates of the mechanism.
    MechanismError
        A point of the ground, or a coordinate the joint does not have.
    """
    if text in mechanism.aliases:
        return replace(coordinate(mechanism, mechanism.aliases[text]), text=text)
    parts = text.split(".")
    if parts[0] in mechanism.bodies:
        if parts[1:] == ["angle"] and mechanism.dimension == 2:
            return NamedCoordinate(text, "body angle", parts[0])
        points = mechanism.bodies[parts[0]].points
        if len(parts) == 3 and parts[1] in points:
            axis = mechanism.axes.find(parts[2])
            if axis >= 0 and len(parts[2]) == 1:
                return NamedCoordinate(text, "point", parts[0], parts[1], axis)
    elif parts[0] in mechanism.joints and len(parts) == 2:
        joint = mechanism.joints[parts[0]]
        if parts[1] in joint.coordinates:
            return NamedCoordinate(text, RELATIVE[parts[1]], parts[0])
        if parts[1] in RELATIVE:
            raise MechanismError(
                f"a {joint.kind} joint has no coordinate '{text}'", hint=_instead(joint)
            )
    elif parts[0] == GROUND:
        raise MechanismError(f"'{text}' is fixed: the ground does not move")
    error = UnknownName("coordinate", text, coordinate_names(mechanism))
    if mechanism.dimension == 3 and parts[1:] in ([], ["angle"]) and parts[0] in mechanism.bodies:
        error.hint = "bodies have no angle in space: name that of a joint, or a point"
    elif text in mechanism.bodies:
        error.hint = f"did you mean {text}.angle?"
    raise error


def _instead(joint: Joint) -> str:
    """Return what can be named instead of a coordinate that a joint does not have."""
    if joint.coordinates:
        return f"it has {' and '.join(f'{joint.name}.{word}' for word in joint.coordinates)}"
    point = joint.first if joint.second_body == GROUND else joint.second
    return f"name the place of a point, like {point}"


def split_rate(name: str) -> tuple[str, int]:
    """Return a coordinate's name and the order of its rate: 0, 1 speed, 2 acceleration."""
    for order, rate in enumerate(RATES, start=1):
        if name.endswith(rate):
            return name.removesuffix(rate), order
    return name, 0


def unit_of(mechanism: Mechanism, text: str) -> str | None:
    """Return the unit of a coordinate, or of a body's or joint's name in a sketch.

    None for places on curves, whose unit is the user's, and for unknown names.
    """
    if text in mechanism.joints:
        kind = KINDS[mechanism.joints[text].usual]
        return None if kind is PLACE else kind.unit
    try:
        result = coordinate(mechanism, f"{text}.angle" if text in mechanism.bodies else text)
    except MechdaeError:
        return None
    return None if result.on_curve else result.unit


def coordinate_unit(mechanism: Mechanism, text: str) -> str:
    """Return the unit of a coordinate, "1" for a place on a curve; all front ends ask here."""
    try:
        return coordinate(mechanism, text).unit
    except MechdaeError:  # a name without its mechanism
        return kind_of(text).unit


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


@dataclass(frozen=True)
class Selection:
    """What a task reports: bodies, points ``body.point``, joints, named outputs by name."""

    bodies: tuple[str, ...]
    points: tuple[str, ...]
    joints: tuple[str, ...]
    named: tuple[str, ...] = ()


def selection(
    mechanism: Mechanism, outputs: tuple[str, ...] | None, forces: bool = False
) -> Selection:
    """Return the bodies, points, joints and named outputs in `outputs`; None means all.

    A name that belongs to a part and to a named output means both. A task of `forces` may ask
    for joints without a coordinate of their own.

    Raises
    ------
    UnknownName
        Nothing of that name, with the nearest ones.
    """
    points_of = {
        n: [f"{n}.{point}" for point in body.points] for n, body in mechanism.bodies.items()
    }
    every = {point: None for points in points_of.values() for point in points}
    joints = {n: j for n, j in mechanism.joints.items() if forces or j.coordinates}
    if outputs is None:
        whole = (tuple(mechanism.bodies), tuple(every), tuple(joints))
        return Selection(*whole, tuple(mechanism.outputs))
    bodies: list[str] = []
    points: list[str] = []
    chosen: list[str] = []
    for text in outputs:
        if text in every:
            points.append(text)
        elif text in mechanism.bodies:
            bodies.append(text)
            points += points_of[text]
        elif text in joints:
            chosen.append(text)
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
                chosen.append(result.part)
    named = [text for text in outputs if text in mechanism.outputs]
    return Selection(*(tuple(dict.fromkeys(items)) for items in (bodies, points, chosen, named)))
