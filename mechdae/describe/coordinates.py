"""Names of coordinates and outputs: ``crank.angle``, ``slider.C.x``, ``slot.slide``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from importlib import import_module

from mechdae.describe.coordinate_kinds import KINDS, PLACE, kind_of
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.describe.values import Value
from mechdae.errors import MechanismError, MechdaeError
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
NAMES = "mechdae.describe.coordinate_names"
"""It knows coordinates: what was meant by a name."""
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

    @cached_property
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

    @cached_property
    def on_curve(self) -> bool:
        """Whether it is a place on a curve, whose unit is the user's."""
        return self.kind == RELATIVE["s"]

    @cached_property
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
                f"a {joint.kind} joint has no coordinate '{text}'",
                hint=import_module(NAMES).instead(joint),
            )
    elif parts[0] == GROUND:
        raise MechanismError(f"'{text}' is fixed: the ground does not move")
    raise import_module(NAMES).no_coordinate(mechanism, text)


def named_coordinate(mechanism: Mechanism, name: str) -> NamedCoordinate:
    """Return the coordinate of that name; a body means its angle, a joint its usual coordinate."""
    if name in mechanism.bodies:
        name = f"{name}.angle"
    elif name in mechanism.joints:
        name = f"{name}.{mechanism.joints[name].usual}"
    return coordinate(mechanism, name)


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


SERIES = "mechdae.describe.series_units"
"""It knows coordinates: the units of what results have."""


def unit_within(mechanism: Mechanism, task: Value | None, text: str) -> str | None:
    """Return the unit of a coordinate, an output or a path; "" is the driver of a task."""
    text = text or getattr(getattr(task, "driver", None), "coordinate", "")
    if "/" in text or text in mechanism.outputs:
        of_force = "N" if "/reaction" in text else None  # which goals and limits make a size of
        return import_module(SERIES).path_unit(mechanism, text) or of_force
    name, order = split_rate(text)
    base = unit_of(mechanism, name)
    return f"{base}{('', '/s', '/s2')[order]}" if base else None


def coordinate_unit(mechanism: Mechanism, text: str) -> str:
    """Return the unit of a coordinate, "1" for a place on a curve; all front ends ask here."""
    try:
        return coordinate(mechanism, text).unit
    except MechdaeError:  # a name without its mechanism
        return kind_of(text).unit


@dataclass(frozen=True)
class Selection:
    """What a task reports: bodies, points ``body.point``, joints, named outputs by name."""

    bodies: tuple[str, ...]
    points: tuple[str, ...]
    joints: tuple[str, ...]
    named: tuple[str, ...] = ()


def selection(
    mechanism: Mechanism, outputs: Sequence[str] | None, forces: bool = False
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
    chosen: Selection = import_module(NAMES).chosen(mechanism, outputs, points_of, joints)
    return chosen
