"""The kinematic pairs as frozen values.

A joint connects a point of its first body to a point of its second; its relative
coordinate is second minus first, the reaction listed for it acts on the second body.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import fields, replace
from functools import cache
from typing import Any, ClassVar, TypeGuard

from mechdae.describe.values import Number, Value, key
from mechdae.errors import MechanismError
from mechdae.records import dataclass

PRESSURE_ANGLE = math.radians(20)
"""That of teeth where none is given [rad]."""


@cache
def _number_keys(kind: Any) -> tuple[str, ...]:
    """Return the keys of a kind of joint that hold numbers."""
    return tuple(entry.name for entry in fields(kind) if entry.metadata["kind"] == "number")


@dataclass(frozen=True)
class Joint(Value):
    """Base of all joints: a name and two points ``body.point``."""

    name: str = key("name")
    first: str = key("reference")
    second: str = key("reference")

    kind: ClassVar[str] = ""
    lower: ClassVar[bool] = True
    """A lower pair (surface contact, p5); otherwise a higher one (p4)."""
    letter: ClassVar[str] = ""
    """The letter of the pair in the name of an Assur group."""
    replaced: ClassVar[str] = ""
    """Letters of the lower pairs and the link that replace a higher one, the first body's first."""
    dyad: ClassVar[str] = ""
    """Name of the group of one body that a higher pair closes, where letters do not tell it."""
    coordinates: ClassVar[tuple[str, ...]] = ()
    """Relative coordinates, the one that the joint's name stands for first."""
    coincide: ClassVar[bool] = False
    """Its two points are one place."""
    keeps_angle: ClassVar[bool] = False
    """Its bodies do not turn relative to each other."""
    straight: ClassVar[bool] = False
    """The second point lies on a line of the first body, along ``axis``."""
    on_curve: ClassVar[bool] = False
    """The second point follows a curve of the first body; the joint has coordinates of its own."""
    bar: ClassVar[bool] = False
    """Its two points keep a ``length``."""
    wheels: ClassVar[int] = 0
    """How many of its bodies roll: their unwrapped angles are in its equation."""
    pivots: ClassVar[tuple[str, ...]] = ()
    """Numbers that never vanish, by which its equation may be solved for an angle."""
    keep_for: ClassVar[str] = ""
    """The number that is a force, which has to be large enough: a pretension."""
    strands: ClassVar[bool] = False
    """Its forces run in two strands instead of acting where wheels touch."""
    rim: ClassVar[bool] = False
    """Its wheels have no teeth."""
    smoothed: ClassVar[bool] = False
    """Friction in it can be smoothed."""
    opening: ClassVar[int] = 5
    """Rank among joints to be opened where a mechanism cannot be assembled: pins first."""
    pointer: ClassVar[bool] = False
    """A vector of a loop in space: its bodies are points."""
    lacking: ClassVar[Mapping[str, str]] = {}
    """Keys that others have and this one cannot have, and why."""
    spatial: ClassVar[bool] = False
    """A pair of spatial mechanisms only."""
    freedoms: ClassVar[int] = 0
    """Relative freedoms of a pair in space."""
    ball: ClassVar[bool] = False
    """Two bodies have a point in common and nothing else."""

    @property
    def usual(self) -> str:
        """The coordinate that the joint's name stands for."""
        return self.coordinates[0] if self.coordinates else "angle"

    @property
    def slides(self) -> bool:
        return "slide" in self.coordinates

    @property
    def turns(self) -> bool:
        return "angle" in self.coordinates

    @property
    def winds(self) -> bool:
        """Its turn slides it along: after a whole turn it is elsewhere."""
        return self.spatial and self.freedoms == 1 and self.turns and self.slides

    @property
    def hinge(self) -> bool:
        """A turning pair."""
        return self.coincide and not self.keeps_angle

    @property
    def rigid(self) -> bool:
        """Two bodies that are one."""
        return self.coincide and self.keeps_angle

    @property
    def guide(self) -> bool:
        """A sliding pair."""
        return self.straight and self.keeps_angle

    @property
    def slot(self) -> bool:
        """A pin in a slot."""
        return self.straight and not self.keeps_angle

    @property
    def pinned(self) -> bool:
        """There are pins at its points."""
        return self.hinge or self.slot or self.bar

    @property
    def meshes(self) -> bool:
        """Wheels that drive each other or something else."""
        return self.wheels > 0

    @property
    def sense(self) -> int:
        """1 of wheels that turn in one sense by their numbers, -1 of those that do not."""
        return 1

    @property
    def loaded(self) -> bool:
        """Its bodies are loaded by a force that its own numbers give."""
        return bool(self.keep_for) and getattr(self, self.keep_for) is not None

    def turn_ratio(self, values: Mapping[str, float]) -> float:
        """Return (w1 - wc) / (w2 - wc) of two wheels, by the mechanism's numbers."""
        return self.sense * values[f"{self.name}.ratio"]

    def needed(self, values: Mapping[str, float], moment: Any) -> Any:
        """Return how large the force has to be that it is held by, for moments (n,) on the second.

        The moments of its reaction about the second point; nothing where none is needed.
        """
        raise NotImplementedError

    def gives_way(self, where: str, force: float) -> str:
        """Return the message about a force that is too small, and the remedy."""
        raise NotImplementedError

    @property
    def normal_force(self) -> bool:
        """Something slides along it, and a force presses across."""
        return self.straight or self.on_curve

    @property
    def rubs(self) -> bool:
        """It may have friction."""
        return any(hasattr(self, entry) for entry in ("friction", "mesh_loss"))

    def rubs_all_ways(self, values: Mapping[str, float]) -> bool:
        """Return whether its friction has no sign, but a direction that turns with the sliding."""
        return False

    def friction_law(self, article: bool) -> str:
        """Return the law of its friction in symbols; `article`: pins with their full radius."""
        return "mesh_loss of the power"

    @property
    def first_body(self) -> str:
        return self.first.split(".")[0]

    @property
    def second_body(self) -> str:
        return self.second.split(".")[0]

    @property
    def bodies(self) -> tuple[str, ...]:
        """The bodies whose position the joint's equations use."""
        carrier = getattr(self, "carrier", None)
        return (self.first_body, self.second_body, *((carrier,) if carrier else ()))

    def numbers(self) -> Iterator[tuple[str, Number]]:
        """Yield the joint's numbers with the last part of their automatic name."""
        kind: Any = type(self)
        for name in _number_keys(kind):
            value = getattr(self, name)
            if value is not None:
                yield name, value

    def settled(self, values: Mapping[str, float]) -> tuple[int, ...]:
        """Return what of the mechanism's values belongs to the structure."""
        return ()

    def with_number(self, entry: str, number: Number) -> Joint:
        """Return the joint with one of its numbers replaced."""
        changes: dict[str, Any] = {entry: number}
        return replace(self, **changes)

    def check(self, values: Mapping[str, float]) -> None:
        """Raise `MechanismError` for values that make no joint."""
        if values.get("mesh_loss", 0.0) >= 1:
            raise MechanismError(
                "mesh_loss is a share of the power, below 1",
                where=f"joints.{self.name}.mesh_loss",
            )
        for entry in NOT_NEGATIVE:
            if values.get(entry, 0.0) < 0:
                raise MechanismError(
                    f"{entry} is negative ({values[entry]:g})", where=f"joints.{self.name}.{entry}"
                )


TURN = 2 * math.pi
SIDES, SENSES = ("left", "right"), ("positive", "negative")
LIES = "side on which the second body lies, and to which alone the contact pushes it"
TURNS = "sense in which alone the teeth push the second body"
NOT_NEGATIVE = (
    "friction",
    "friction_static",
    "pin_radius",
    "contact_length",
    "contact_width",
    "collar_radius",
    "thread_radius",
    "ball_radius",
    "roller_radius",
    "mesh_loss",
    "pretension",
    "press",
    "adhesion",
)


@dataclass(frozen=True)
class Revolute(Joint):
    """Turning pair: the two points coincide. Relative coordinate: angle."""

    friction: Number | None = key("number", None, doc="Coulomb coefficient", unit="1")
    friction_static: Number | None = key("number", None, unit="1")
    pin_radius: Number | None = key("number", None, doc="m", unit="m")

    kind: ClassVar[str] = "revolute"
    letter: ClassVar[str] = "R"
    coordinates: ClassVar[tuple[str, ...]] = ("angle",)
    coincide: ClassVar[bool] = True
    smoothed: ClassVar[bool] = True
    opening: ClassVar[int] = 0

    def friction_law(self, article: bool) -> str:
        return "r f |R|" if article else "r sin(atan f) |R|"

    def check(self, values: Mapping[str, float]) -> None:
        super().check(values)
        if values.get("friction", 0.0) and "pin_radius" not in values:
            raise MechanismError(
                "friction in a pin needs the radius of the pin",
                where=f"joints.{self.name}.pin_radius",
                hint="pin_radius = ... [m]",
            )


@dataclass(frozen=True)
class Prismatic(Joint):
    """Sliding pair: the block's point on the guide's line, the angle between them fixed.

    ``axis`` is the guide's direction in the first body, ``turn`` the second body's angle
    less the first's. Relative coordinate: slide, along the axis.
    """

    axis: Number = key(
        "number", 0.0, doc="direction of the guide in the first body, rad", unit="rad"
    )
    turn: Number = key(
        "number", 0.0, doc="angle of the second less that of the first, rad", unit="rad"
    )
    friction: Number | None = key("number", None, unit="1")
    friction_static: Number | None = key("number", None, unit="1")
    contact_length: Number | None = key("number", None, doc="2b, m; absent: long guide", unit="m")
    one_sided: str | None = key("text", None, choices=SIDES, doc=LIES)

    kind: ClassVar[str] = "prismatic"
    letter: ClassVar[str] = "P"
    coordinates: ClassVar[tuple[str, ...]] = ("slide",)
    straight: ClassVar[bool] = True
    keeps_angle: ClassVar[bool] = True
    smoothed: ClassVar[bool] = True
    opening: ClassVar[int] = 2

    def friction_law(self, article: bool) -> str:
        return "f |N|" if self.contact_length is None else "f max(|N|, |M|/b)"

    def check(self, values: Mapping[str, float]) -> None:
        super().check(values)
        if values.get("contact_length", 1.0) == 0:
            raise MechanismError(
                "contact_length is zero",
                where=f"joints.{self.name}.contact_length",
                hint="leave it out for a long guide, whose moment causes no friction",
            )


@dataclass(frozen=True)
class PinInSlot(Joint):
    """Pin of the second body in a straight slot of the first. Coordinates: slide, angle."""

    axis: Number = key(
        "number", 0.0, doc="direction of the slot in the first body, rad", unit="rad"
    )
    friction: Number | None = key("number", None, unit="1")
    pin_radius: Number | None = key("number", None, doc="m", unit="m")
    one_sided: str | None = key("text", None, choices=SIDES, doc=LIES)

    kind: ClassVar[str] = "pin-in-slot"
    lower: ClassVar[bool] = False
    replaced: ClassVar[str] = "PR"
    coordinates: ClassVar[tuple[str, ...]] = ("slide", "angle")
    straight: ClassVar[bool] = True
    opening: ClassVar[int] = 1

    def friction_law(self, article: bool) -> str:
        return "f |N| on the pin"


@dataclass(frozen=True)
class Weld(Joint):
    """Rigid connection: points coincide, angle between the bodies fixed."""

    turn: Number = key(
        "number", 0.0, doc="angle of the second less that of the first, rad", unit="rad"
    )

    kind: ClassVar[str] = "weld"
    letter: ClassVar[str] = "W"
    coincide: ClassVar[bool] = True
    keeps_angle: ClassVar[bool] = True


@dataclass(frozen=True)
class Gear(Joint):
    """Gear pair between two wheel centres, on a carrier (absent: the ground).

    (angle of the first - carrier) = ratio * (angle of the second - carrier) + phase, with
    unwrapped angles. Either ``ratio`` or ``teeth = [z1, z2]`` with ``mesh``.
    """

    carrier: str | None = key("name", None)
    ratio: Number | None = key(
        "number", None, doc="(w1 - wc) / (w2 - wc); external mesh: < 0", unit="1"
    )
    teeth: tuple[Number, ...] | None = key("pair", None, doc="[z1, z2]", unit="1")
    mesh: str | None = key("text", None, choices=("external", "internal"))
    phase: Number = key("number", 0.0, doc="rad", unit="rad")
    pressure_angle: Number = key("number", PRESSURE_ANGLE, doc="rad", unit="rad")
    mesh_loss: Number | None = key("number", None, doc="share of power", unit="1")
    one_sided: str | None = key("text", None, choices=SENSES, doc=TURNS)

    kind: ClassVar[str] = "gear"
    lower: ClassVar[bool] = False
    wheels: ClassVar[int] = 2
    pivots: ClassVar[tuple[str, ...]] = ("ratio",)

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.ratio is None) == (self.teeth is None):
            raise MechanismError("a gear needs either 'ratio' or 'teeth' with 'mesh'")
        if self.teeth is not None and self.mesh is None:
            raise MechanismError('\'teeth\' needs mesh = "external" or "internal"', where="mesh")
        for count in self.teeth or ():
            if not isinstance(count, str) and (count <= 0 or count != int(count)):
                raise MechanismError(
                    f"numbers of teeth are whole and above 0, not {count:g}", where="teeth"
                )

    def numbers(self) -> Iterator[tuple[str, Number]]:
        yield from super().numbers()
        if self.teeth is not None:
            first, second = self.teeth
            sign = "-" if self.mesh == "external" else ""
            yield "ratio", f"{sign}({second})/({first})"

    def with_number(self, entry: str, number: Number) -> Joint:
        if entry == "ratio":
            return replace(self, ratio=number, teeth=None, mesh=None)
        return super().with_number(entry, number)

    def check(self, values: Mapping[str, float]) -> None:
        super().check(values)
        if values["ratio"] == 0:
            raise MechanismError("ratio is zero", where=f"joints.{self.name}.ratio")
        if self.teeth is not None and (values["ratio"] < 0) != (self.mesh == "external"):
            raise MechanismError("numbers of teeth are above 0", where=f"joints.{self.name}.teeth")


@dataclass(frozen=True)
class Rack(Joint):
    """Wheel on a rack: travel along ``axis`` of the second body = radius * angle + phase."""

    radius: Number = key("number", doc="signed, m", unit="m")
    carrier: str | None = key("name", None)
    axis: Number = key("number", 0.0, doc="in the second body, rad", unit="rad")
    phase: Number = key("number", 0.0, doc="m", unit="m")
    pressure_angle: Number = key("number", PRESSURE_ANGLE, unit="rad")
    mesh_loss: Number | None = key("number", None, unit="1")
    one_sided: str | None = key("text", None, choices=SENSES, doc=TURNS)

    kind: ClassVar[str] = "rack"
    lower: ClassVar[bool] = False
    wheels: ClassVar[int] = 1

    def check(self, values: Mapping[str, float]) -> None:
        super().check(values)
        if values["radius"] == 0:
            raise MechanismError("radius is zero", where=f"joints.{self.name}.radius")


@dataclass(frozen=True)
class Belt(Joint):
    """Belt or chain between two wheels; ``crossed`` reverses the sense."""

    ratio: Number = key("number", unit="1")
    carrier: str | None = key("name", None)
    crossed: bool = key("flag", False)
    pretension: Number | None = key("number", None, doc="of each strand, N", unit="N")
    radius: Number | None = key(
        "number", None, doc="of the first wheel, m; only forces use it", unit="m"
    )
    phase: Number = key("number", 0.0, doc="rad", unit="rad")
    mesh_loss: Number | None = key("number", None, unit="1")

    kind: ClassVar[str] = "belt"
    lower: ClassVar[bool] = False
    wheels: ClassVar[int] = 2
    pivots: ClassVar[tuple[str, ...]] = ("ratio",)
    keep_for: ClassVar[str] = "pretension"
    strands: ClassVar[bool] = True
    rim: ClassVar[bool] = True

    @property
    def sense(self) -> int:
        return -1 if self.crossed else 1

    def needed(self, values: Mapping[str, float], moment: Any) -> Any:
        return abs(moment) / (2 * (values[f"{self.name}.radius"] * values[f"{self.name}.ratio"]))

    def gives_way(self, where: str, force: float) -> str:
        return f"belt {self.name} goes slack{where}: pretension of {force:.6g} N at least is needed"

    def check(self, values: Mapping[str, float]) -> None:
        super().check(values)
        if values["ratio"] <= 0:
            raise MechanismError(
                "ratio must be above 0", where=f"joints.{self.name}.ratio", hint="use 'crossed'"
            )
        if values.get("radius", 1.0) <= 0:
            raise MechanismError("radius must be above 0", where=f"joints.{self.name}.radius")


@dataclass(frozen=True)
class FrictionWheel(Joint):
    """Two round wheels pressed together that roll on each other, from outside or inside.

    radius (angle of the first - carrier - phase) = -+ second_radius (angle of the second -
    carrier), plus for ``contact = "internal"``. It can transmit ``adhesion`` times ``press``.
    """

    radius: Number = key("number", doc="of the first wheel, m", unit="m")
    second_radius: Number = key("number", doc="of the second wheel, m", unit="m")
    carrier: str | None = key("name", None)
    contact: str = key("text", "external", choices=("external", "internal"))
    phase: Number = key("number", 0.0, doc="rad", unit="rad")
    press: Number | None = key("number", None, doc="force that presses them together, N", unit="N")
    adhesion: Number | None = key("number", None, doc="coefficient of adhesion", unit="1")

    kind: ClassVar[str] = "friction-wheel"
    lower: ClassVar[bool] = False
    wheels: ClassVar[int] = 2
    pivots: ClassVar[tuple[str, ...]] = ("radius", "second_radius")
    keep_for: ClassVar[str] = "press"
    rim: ClassVar[bool] = True

    @property
    def sense(self) -> int:
        return 1 if self.contact == "internal" else -1

    def check(self, values: Mapping[str, float]) -> None:
        super().check(values)
        for entry in self.pivots:
            if values[entry] <= 0:
                raise MechanismError(f"{entry} is not above 0", where=f"joints.{self.name}.{entry}")
        if self.contact == "internal" and values["radius"] == values["second_radius"]:
            raise MechanismError(
                "a wheel inside another one is smaller", where=f"joints.{self.name}.second_radius"
            )
        if "adhesion" in values and not values.get("press"):
            raise MechanismError(
                "adhesion needs the force that presses the wheels together",
                where=f"joints.{self.name}.press",
                hint="press = ... [N]",
            )

    def turn_ratio(self, values: Mapping[str, float]) -> float:
        return self.sense * values[f"{self.name}.second_radius"] / values[f"{self.name}.radius"]

    def needed(self, values: Mapping[str, float], moment: Any) -> Any:
        most = values.get(f"{self.name}.adhesion", math.inf) * values[f"{self.name}.second_radius"]
        return abs(moment) / most if most else abs(moment) * math.inf

    def gives_way(self, where: str, force: float) -> str:
        return (
            f"friction wheels {self.name} slip{where}: they must be pressed together with "
            f"{force:.6g} N at least"
        )


@dataclass(frozen=True)
class Distance(Joint):
    """Massless bar: the two points keep their distance ``length`` [m]."""

    length: Number = key("number", doc="m", unit="m")
    one_sided: str | None = key(
        "text", None, choices=("pull", "push"), doc="what it can do: a rope, a prop"
    )

    kind: ClassVar[str] = "distance"
    lower: ClassVar[bool] = False
    replaced: ClassVar[str] = "RR"
    bar: ClassVar[bool] = True
    opening: ClassVar[int] = 4

    def check(self, values: Mapping[str, float]) -> None:
        super().check(values)
        if values["length"] <= 0:
            raise MechanismError(
                f"length must be above 0, not {values['length']:g}",
                where=f"joints.{self.name}.length",
                hint="two points that coincide are a revolute joint",
            )


@dataclass(frozen=True)
class Curve(Joint):
    """Follower point of the second body on a curve (x(s), y(s)) of the first.

    The curve lies in the first body, its origin is the first point, the axes are those of
    the body. With ``roller_radius`` the second point is the centre of a roller on the
    ``side`` of growing s: right is outside of a closed curve that runs counter-clockwise.
    Relative coordinate: s, the place of the contact on the curve.
    """

    x: Number = key("expression", doc="expression of s and parameters, m", unit="m")
    y: Number = key("expression", doc="expression of s and parameters, m", unit="m")
    range: tuple[Number, ...] | None = key("pair", None, doc="first and last s; closed: [0, 2 pi]")
    closed: bool = key("flag", False, doc="the curve ends where it begins")
    roller_radius: Number | None = key("number", None, doc="m; absent: a point follower", unit="m")
    side: str = key("text", "right", choices=("right", "left"), doc="of the roller")
    friction: Number | None = key("number", None, unit="1")
    one_sided: str | None = key("text", None, choices=SIDES, doc=LIES)

    kind: ClassVar[str] = "curve"
    lower: ClassVar[bool] = False
    dyad: ClassVar[str] = "cam"
    coordinates: ClassVar[tuple[str, ...]] = ("s",)
    on_curve: ClassVar[bool] = True
    smoothed: ClassVar[bool] = True
    opening: ClassVar[int] = 3

    def friction_law(self, article: bool) -> str:
        return "f |N| along the tangent"

    @property
    def ends(self) -> tuple[Number, Number]:
        """First and last value of s."""
        first, last = self.range or (0.0, TURN)
        return first, last

    def numbers(self) -> Iterator[tuple[str, Number]]:
        yield from super().numbers()
        yield from zip(("start", "end"), self.ends, strict=True)

    def with_number(self, entry: str, number: Number) -> Joint:
        first, last = self.ends
        if entry in ("start", "end"):
            return replace(self, range=(number, last) if entry == "start" else (first, number))
        return super().with_number(entry, number)

    def check(self, values: Mapping[str, float]) -> None:
        super().check(values)
        if self.range is None and not self.closed:
            raise MechanismError(
                "the key 'range' is missing",
                where=f"joints.{self.name}.range",
                hint="range = [first s, last s], or closed = true for one turn",
            )
        if self.one_sided is not None and self.roller_radius and self.one_sided != self.side:
            raise MechanismError(
                f"the roller lies on the {self.side} of the curve, which pushes it there",
                where=f"joints.{self.name}.one_sided",
                hint=f'one_sided = "{self.side}", or another side',
            )
        if values["end"] <= values["start"]:
            raise MechanismError(
                f"range ends at {values['end']:g}, not after its start {values['start']:g}",
                where=f"joints.{self.name}.range",
            )


def follows_curve(joint: Joint) -> TypeGuard[Curve]:
    """Return whether a joint has a curve, and so the keys of one."""
    return joint.on_curve


JOINTS: dict[str, type[Joint]] = {
    joint.kind: joint
    for joint in (
        Revolute,
        Prismatic,
        PinInSlot,
        Weld,
        Gear,
        Rack,
        Belt,
        FrictionWheel,
        Distance,
        Curve,
    )
}
