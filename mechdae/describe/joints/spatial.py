"""The kinematic pairs of spatial mechanisms as frozen values.

A pair has a frame on either body: the axis a, the normal n that is its zero, and a x n. ``axis``
and ``zero`` are directions in the first body, ``axis2`` and ``zero2`` in the second; where the
second ones are absent they are the same numbers. An absent ``zero`` is the coordinate axis that
follows the largest component of the axis (z -> x, as in the plane), made normal to the axis.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator, Mapping
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any, ClassVar

from mechdae.describe.joints.joint import PRESSURE_ANGLE, REBOUNDS, SENSES, STOPS, TURNS, Joint
from mechdae.describe.joints.wheels import Gear
from mechdae.describe.values import Number
from mechdae.errors import MechanismError
from mechdae.records import dataclass, key, optional

if TYPE_CHECKING:
    from mechdae.describe.values import Numbers, NumbersOrNone
    from mechdae.types import Json

AXES, ALONG = "xyz", 1e-9
"""The second: share of its length by which a zero direction must leave the axis."""
Direction = tuple[Number, ...]


def largest(vector: tuple[float, ...]) -> int:
    """Return which component of a direction is the largest, the first of equal ones."""
    return max(range(3), key=lambda i: (abs(vector[i]), -i))


@dataclass(frozen=True)
class SpatialJoint(Joint):
    """Base of the pairs in space.

    ``freedoms`` are its coordinates as an edge of the tree, ``straightens`` tells that the rows of
    an opened pair hold for axes of opposite sense too, which no assembly may have.
    """

    spatial: ClassVar[bool] = True
    freedoms: ClassVar[int] = 0
    crossed: ClassVar[bool] = False
    """The second axis crosses the first one: it is no other name of the first."""
    opening: ClassVar[int] = 0
    rubbed: ClassVar[str] = "pin"
    """What friction needs the radius of."""

    def directions(self) -> Iterator[tuple[str, Direction]]:
        """Yield the directions that are given, by their keys."""
        for entry in fields(self):
            if entry.metadata.get("kind") == "direction" and getattr(self, entry.name) is not None:
                yield entry.name, getattr(self, entry.name)

    def numbers(self) -> tuple[tuple[str, Number], ...]:
        directions = [
            (f"{name}.{axis}", number)
            for name, direction in self.directions()
            for axis, number in zip(AXES, direction, strict=True)
        ]
        return (*super().numbers(), *directions)

    def with_number(self, entry: str, number: Number) -> Joint:
        name, _, axis = entry.partition(".")
        if axis not in AXES:
            return super().with_number(entry, number)
        place = AXES.index(axis)
        old = getattr(self, name)
        changes: Json = {name: (*old[:place], number, *old[place + 1 :])}
        return replace(self, **changes)

    def side(self, second: bool) -> tuple[str, str | None]:
        """Return the keys of the axis and of the zero of a side; no zero: it follows the axis."""
        given = dict(self.directions())
        if not second or "axis2" not in given:
            zero = "zero2" if second and "zero2" in given else "zero"
            return "axis", zero if zero in given else None
        return "axis2", "zero2" if "zero2" in given else None

    def settled(self, values: Mapping[str, float]) -> tuple[Hashable, ...]:
        """Return what of its values is part of the structure: where absent zeros point."""
        found = []
        for second in (False, True):
            axis, zero = self.side(second) if dict(self.directions()) else ("", "")
            if zero is None:
                found.append(largest(_vector(values, f"{self.name}.{axis}")))
        return tuple(found)

    def check(self, values: Mapping[str, float]) -> None:
        super().check(values)
        vectors = {name: _vector(values, name) for name, _ in self.directions()}
        for name, vector in vectors.items():
            if not any(vector):
                raise MechanismError(
                    "a direction needs a length", where=f"joints.{self.name}.{name}",
                    hint="like [0, 0, 1]",
                )  # fmt: skip
        for second in (False, True) if vectors else ():
            axis, zero = self.side(second)
            if zero is not None and _along(vectors[axis], vectors[zero]):
                raise MechanismError(
                    f"{zero} lies along {axis}",
                    where=f"joints.{self.name}.{zero}",
                    hint=f"a direction across the axis, or leave {zero} out",
                )
        self._check_friction(values)

    def _check_friction(self, values: Mapping[str, float]) -> None:
        """Raise for friction without the lengths that it needs."""
        part = self.rubbed
        radius = f"{part}_radius"
        lacks = radius not in values or (part == "thread" and values[radius] == 0)
        rubs = values.get("friction", 0.0) or values.get("friction_static", 0.0)
        if hasattr(self, radius) and rubs and lacks:
            raise MechanismError(
                f"friction in a {part} needs the radius of the {part}",
                where=f"joints.{self.name}.{radius}",
                hint=f"{radius} = ... [m]",
            )
        for entry, what in (("contact_length", "tilting"), ("contact_width", "torsion")):
            if values.get(entry, 1.0) == 0:
                raise MechanismError(
                    f"{entry} is zero",
                    where=f"joints.{self.name}.{entry}",
                    hint=f"leave it out where {what} causes no friction",
                )


def _vector(values: Mapping[str, float], name: str) -> tuple[float, ...]:
    return tuple(values[f"{name}.{axis}"] for axis in AXES)


def _along(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    """Return whether two directions lie on one line."""
    a, b = (tuple(x / max(map(abs, v)) for x in v) for v in (a, b))
    cross = [a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)]
    return math.hypot(*cross) <= ALONG * math.hypot(*a) * math.hypot(*b)


def _other(doc: str) -> Any:
    return optional("direction", doc=doc, unit="1")


def _friction(doc: str = "Coulomb coefficient") -> Any:
    return optional("number", doc=doc, unit="1")


def _length(doc: str) -> Any:
    return optional("number", doc=doc, unit="m")


def _rho(article: bool) -> str:
    """Return the radius of the friction circle in symbols."""
    return "r f" if article else "r sin(atan f)"


PLANES = "2b, distance of the two bearing planes; absent: tilting causes no friction"
AXIS2 = "direction of the axis in the second body; absent: the same numbers"
ZERO = "normal of the axis in the first body, from which it is counted"
ZERO2 = "normal of the axis in the second body, which coincides with the first one's at zero"


@dataclass(frozen=True)
class AxisPair(SpatialJoint):
    """Base of the pairs whose axes coincide."""

    axis: Numbers = key("direction", doc="direction of the axis in the first body", unit="1")
    axis2: NumbersOrNone = _other(AXIS2)
    zero: NumbersOrNone = _other(ZERO)
    zero2: NumbersOrNone = _other(ZERO2)


@dataclass(frozen=True)
class SpatialRevolute(AxisPair):
    """Turning pair: points and axes coincide. Relative coordinate: angle.

    Examples
    --------
    >>> md.SpatialRevolute("A", "ground.A", "crank.A", axis=[0, 0, 1]).axis
    (0.0, 0.0, 1.0)
    """

    friction: Number | None = _friction()
    friction_static: Number | None = _friction("coefficient of a pair at rest")
    pin_radius: Number | None = _length("")
    contact_length: Number | None = _length(PLANES)
    collar_radius: Number | None = _length("mean radius at which an axial force rubs; absent: none")
    limits: NumbersOrNone = optional("pair", doc="least and greatest angle", unit="rad")
    restitution: Number | None = optional("number", doc=REBOUNDS, unit="1")

    kind: ClassVar[str] = "revolute"
    letter: ClassVar[str] = "R"
    smoothed: ClassVar[bool] = True
    coordinates: ClassVar[tuple[str, ...]] = ("angle",)
    coincide: ClassVar[bool] = True
    freedoms: ClassVar[int] = 1

    def friction_law(self, article: bool) -> str:
        return f"{_rho(article)} (|N1| + |N2|) + f r_c |F_a|"


@dataclass(frozen=True)
class SpatialPrismatic(AxisPair):
    """Sliding pair: the second point on the axis through the first. Coordinate: slide.

    Examples
    --------
    >>> md.SpatialPrismatic("guide", "ground.A", "slider.A", axis=[1, 0, 0], friction=0.1).friction
    0.1
    """

    friction: Number | None = _friction()
    friction_static: Number | None = _friction("coefficient of a pair at rest")
    contact_length: Number | None = _length(PLANES)
    contact_width: Number | None = _length("2w, width that a moment about the axis turns on")
    limits: NumbersOrNone = optional("pair", doc=STOPS, unit="m")
    restitution: Number | None = optional("number", doc=REBOUNDS, unit="1")

    kind: ClassVar[str] = "prismatic"
    letter: ClassVar[str] = "P"
    smoothed: ClassVar[bool] = True
    coordinates: ClassVar[tuple[str, ...]] = ("slide",)
    straight: ClassVar[bool] = True
    keeps_angle: ClassVar[bool] = True
    freedoms: ClassVar[int] = 1
    opening: ClassVar[int] = 2

    def friction_law(self, article: bool) -> str:
        return "f (|N1| + |N2| + |M_a| / w)"


@dataclass(frozen=True)
class Cylindrical(AxisPair):
    """Turns about its axis and slides along it. Coordinates: angle, slide.

    Examples
    --------
    >>> md.Cylindrical("C", "ground.A", "ram.A", axis=[0, 1, 0]).name
    'C'
    """

    friction: Number | None = _friction()
    pin_radius: Number | None = _length("")
    contact_length: Number | None = _length(PLANES)
    limits: NumbersOrNone = optional("pair", doc=STOPS, unit="m")

    kind: ClassVar[str] = "cylindrical"
    letter: ClassVar[str] = "C"
    smoothed: ClassVar[bool] = True
    coordinates: ClassVar[tuple[str, ...]] = ("angle", "slide")
    straight: ClassVar[bool] = True
    freedoms: ClassVar[int] = 2
    opening: ClassVar[int] = 1

    def rubs_all_ways(self, values: Mapping[str, float]) -> bool:
        return values.get(f"{self.name}.pin_radius", 0.0) != 0

    def friction_law(self, article: bool) -> str:
        return "f (|N1| + |N2|) / sqrt(1 + f_t^2) against the sliding"


@dataclass(frozen=True)
class Screw(SpatialJoint):
    """Turns and slides along its axis by ``pitch`` a turn. Coordinates: angle, slide.

    Examples
    --------
    >>> md.Screw("spindle", "ground.A", "nut.A", axis=[0, 0, 1], pitch=0.004).pitch
    0.004
    """

    axis: Numbers = key("direction", doc="direction of the axis in the first body", unit="1")
    pitch: Number = key("number", doc="slide in a whole turn; negative: left-handed", unit="m")
    axis2: NumbersOrNone = _other(AXIS2)
    zero: NumbersOrNone = _other(ZERO)
    zero2: NumbersOrNone = _other(ZERO2)
    friction: Number | None = _friction()
    friction_static: Number | None = _friction("coefficient of a pair at rest")
    thread_radius: Number | None = _length("mean radius of the thread; needed for friction")
    limits: NumbersOrNone = optional("pair", doc=STOPS, unit="m")

    kind: ClassVar[str] = "screw"
    rubbed: ClassVar[str] = "thread"
    letter: ClassVar[str] = "H"
    smoothed: ClassVar[bool] = True
    coordinates: ClassVar[tuple[str, ...]] = ("angle", "slide")
    straight: ClassVar[bool] = True
    freedoms: ClassVar[int] = 1
    opening: ClassVar[int] = 2

    def check(self, values: Mapping[str, float]) -> None:
        super().check(values)
        if values["pitch"] == 0:
            raise MechanismError(
                "pitch is zero", where=f"joints.{self.name}.pitch", hint="that is a revolute joint"
            )

    def friction_law(self, article: bool) -> str:
        return "f |N| along the helix, N = F_a cos g - M_a sin g / r"


@dataclass(frozen=True)
class Universal(SpatialJoint):
    """Two crossed axes through one point, the pins of the cross. Coordinates: angle, angle2.

    The first angle turns the cross about ``axis``, the second one the second body about ``axis2``.

    Examples
    --------
    >>> joint = md.Universal("U", "shaft.A", "tube.A", axis=[0, 1, 0], axis2=[0, 0, 1])
    >>> joint.axis2
    (0.0, 0.0, 1.0)
    """

    axis: Numbers = key("direction", doc="direction of the axis in the first body", unit="1")
    axis2: Numbers = key("direction", doc="the pin of the second body, in it", unit="1")
    zero: NumbersOrNone = _other(ZERO)
    zero2: NumbersOrNone = _other("where the first pin lies in the second body at angle2 = 0")
    friction: Number | None = _friction()
    friction_static: Number | None = _friction("coefficient of a pair at rest")
    pin_radius: Number | None = _length("of both pins")
    contact_length: Number | None = _length(PLANES)
    collar_radius: Number | None = _length("mean radius at which an axial force rubs; absent: none")
    limits: NumbersOrNone = optional("pair", doc="least and greatest first angle", unit="rad")

    kind: ClassVar[str] = "universal"
    letter: ClassVar[str] = "U"
    smoothed: ClassVar[bool] = True
    coordinates: ClassVar[tuple[str, ...]] = ("angle", "angle2")
    coincide: ClassVar[bool] = True
    freedoms: ClassVar[int] = 2
    crossed: ClassVar[bool] = True

    def friction_law(self, article: bool) -> str:
        return f"each pin {_rho(article)} (|N1| + |N2|) + f r_c |F_a|"


@dataclass(frozen=True)
class Spherical(SpatialJoint):
    """Ball joint: the points coincide.

    Examples
    --------
    >>> md.Spherical("B", "crank.B", "rod.B", friction=0.1, ball_radius=0.01).ball_radius
    0.01
    """

    friction: Number | None = _friction()
    ball_radius: Number | None = _length("radius of the ball, which friction needs")

    kind: ClassVar[str] = "spherical"
    rubbed: ClassVar[str] = "ball"
    letter: ClassVar[str] = "S"
    coincide: ClassVar[bool] = True
    freedoms: ClassVar[int] = 3
    ball: ClassVar[bool] = True

    def rubs_all_ways(self, values: Mapping[str, float]) -> bool:
        return True

    def friction_law(self, article: bool) -> str:
        return f"{_rho(article)} |F| against the spin across F"


@dataclass(frozen=True)
class PlanarPair(AxisPair):
    """A plane of the second body slides on one of the first. Coordinates: angle, x, y.

    ``axis`` is the normal of the planes; x is along ``zero``.

    Examples
    --------
    >>> md.PlanarPair("E", "table.A", "foot.A", axis=[0, 0, 1]).axis
    (0.0, 0.0, 1.0)
    """

    one_sided: str | None = optional(
        "text", choices=SENSES, doc="side along the axis on which the second body lies"
    )

    kind: ClassVar[str] = "planar"
    letter: ClassVar[str] = "E"
    coordinates: ClassVar[tuple[str, ...]] = ("angle", "x", "y")
    lacking: ClassVar[Mapping[str, str]] = {
        "friction": "friction of a planar pair is not computed: where on the plane its load "
        "presses does not follow from force and moment"
    }
    freedoms: ClassVar[int] = 3


@dataclass(frozen=True)
class SpatialWeld(SpatialJoint):
    """Rigid connection: points and the frames of both sides coincide.

    Examples
    --------
    >>> md.SpatialWeld("W", "arm.B", "plate.B").axis
    (0.0, 0.0, 1.0)
    """

    axis: Numbers = optional(
        "direction", (0.0, 0.0, 1.0), doc="a direction in the first body", unit="1"
    )
    axis2: NumbersOrNone = _other("the same direction in the second body")
    zero: NumbersOrNone = _other("a normal of it in the first body")
    zero2: NumbersOrNone = _other("the same normal in the second body")

    kind: ClassVar[str] = "weld"
    letter: ClassVar[str] = "W"
    coincide: ClassVar[bool] = True
    keeps_angle: ClassVar[bool] = True


MEAN = "mean pitch radius of the first wheel; for forces where the axes meet"
PITCH = "pitch point, a point of the carrier; absent: it follows, unless axes cross"
HELIX = "helix angle of the first wheel at the pitch point; right-handed positive; absent: 0"


def _check_teeth(joint: Joint, values: Mapping[str, float]) -> None:
    """Raise for teeth that could bear nothing."""
    where = f"joints.{joint.name}"
    for entry in ("pressure_angle", "helix"):
        if abs(values.get(entry, 0.0)) >= math.pi / 2:
            raise MechanismError(f"{entry} is 90 degrees or more", where=f"{where}.{entry}")
    if "radius" in values and joint.wheels > 1 and values["radius"] <= 0:
        raise MechanismError("radius is not above zero", where=f"{where}.radius")


@dataclass(frozen=True)
class SpatialGear(Gear):
    """Two wheels with axes that are parallel, meet or cross, on a carrier (absent: the ground).

    Counted are the angles of the joints that the wheels turn in on the carrier, each about its own
    axis from the carrier to the wheel: first = ratio * second + phase. Forces act at the pitch
    point: on the line of centres of parallel axes, at ``radius`` on the pitch cones of axes that
    meet, at ``point`` of axes that cross.

    Examples
    --------
    >>> bevel = md.SpatialGear("bevel", "pinion.A", "wheel.B", ratio=-2, radius=0.03)
    >>> bevel.ratio
    -2.0
    """

    radius: Number | None = optional("number", doc=MEAN, unit="m")
    point: str | None = optional("reference", doc=PITCH)
    helix: Number | None = optional("number", doc=HELIX, unit="rad")

    def check(self, values: Mapping[str, float]) -> None:
        super().check(values)
        _check_teeth(self, values)


@dataclass(frozen=True)
class SpatialRack(Joint):
    """A wheel and a rack on a carrier: slide of the rack = radius * angle of the wheel + phase.

    Angle and slide are those of the joints that wheel and rack have on the carrier.

    Examples
    --------
    >>> md.SpatialRack("mesh", "wheel.A", "rack.B", radius=0.02, helix=0.3).helix
    0.3
    """

    radius: Number = key("number", doc="signed pitch radius", unit="m")
    carrier: str | None = optional("name")
    phase: Number = optional("number", 0.0, unit="m")
    pressure_angle: Number = optional("number", PRESSURE_ANGLE, unit="rad")
    mesh_loss: Number | None = optional("number", doc="share of power", unit="1")
    point: str | None = optional("reference", doc=PITCH)
    helix: Number | None = optional("number", doc=HELIX, unit="rad")
    one_sided: str | None = optional("text", choices=SENSES, doc=TURNS)

    kind: ClassVar[str] = "rack"
    lower: ClassVar[bool] = False
    wheels: ClassVar[int] = 1

    def check(self, values: Mapping[str, float]) -> None:
        super().check(values)
        if values["radius"] == 0:
            raise MechanismError("radius is zero", where=f"joints.{self.name}.radius")
        _check_teeth(self, values)


OF_VECTORS = ("length", "elevation", "azimuth")
"""Coordinates of a vector of a loop."""


@dataclass(frozen=True)
class Pointer(SpatialJoint):
    """Head less tail is a vector by length, elevation and azimuth in the fixed frame.

    What is absent is a coordinate. Its bodies are points: they do not turn.
    """

    length: Number | None = optional("number", unit="m")
    elevation: Number | None = optional("number", unit="rad")
    azimuth: Number | None = optional("number", unit="rad")
    friction: Number | None = optional("number", doc="where its length alone is unknown", unit="1")
    friction_static: Number | None = optional("number", unit="1")

    kind: ClassVar[str] = "vector"
    pointer: ClassVar[bool] = True
    smoothed: ClassVar[bool] = True

    @property
    def coordinates(self) -> tuple[str, ...]:  # type: ignore[override]
        return tuple(word for word in OF_VECTORS if getattr(self, word) is None)

    def friction_law(self, article: bool) -> str:
        return "f |F across|"

    @property
    def freedoms(self) -> int:  # type: ignore[override]
        return len(self.coordinates)
