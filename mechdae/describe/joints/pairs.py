"""The pairs of most planar mechanisms: pins, slides, slots, bars, and what is rigid."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from mechdae.describe.joints.joint import LIES, REBOUNDS, SIDES, STIFF, STOPS, WIDE, Joint
from mechdae.describe.values import Number
from mechdae.errors import MechanismError
from mechdae.records import dataclass, key, optional

if TYPE_CHECKING:
    from mechdae.describe.values import NumbersOrNone


@dataclass(frozen=True)
class Revolute(Joint):
    """Turning pair: the two points coincide. Relative coordinate: angle.

    Examples
    --------
    >>> pin = md.Revolute("A", "ground.A", "crank.A", friction=0.1, pin_radius=0.01)
    >>> pin.first, pin.friction
    ('ground.A', 0.1)
    """

    friction: Number | None = optional("number", doc="Coulomb coefficient", unit="1")
    friction_static: Number | None = optional("number", unit="1")
    pin_radius: Number | None = optional("number", unit="m")
    face_width: Number | None = optional("number", doc=WIDE, unit="m")
    clearance: Number | None = optional("number", doc="of the pin, radial", unit="m")
    limits: NumbersOrNone = optional("pair", doc="least and greatest angle", unit="rad")
    restitution: Number | None = optional("number", doc=REBOUNDS, unit="1")

    kind: ClassVar[str] = "revolute"
    surfaces: ClassVar[tuple[tuple[str, ...], ...]] = (("pin_radius",),)
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

    Relative coordinate: slide, along ``axis``.

    Examples
    --------
    >>> md.Prismatic("guide", "ground.O", "slider.C", axis=0.5, contact_length=0.04).axis
    0.5
    """

    axis: Number = optional(
        "number", 0.0, doc="direction of the guide in the first body", unit="rad"
    )
    turn: Number = optional(
        "number", 0.0, doc="angle of the second less that of the first", unit="rad"
    )
    friction: Number | None = optional("number", unit="1")
    friction_static: Number | None = optional("number", unit="1")
    contact_length: Number | None = optional("number", doc="2b; absent: a long guide", unit="m")
    one_sided: str | None = optional("text", choices=SIDES, doc=LIES)
    face_width: Number | None = optional("number", doc=WIDE, unit="m")
    clearance: Number | None = optional("number", doc="on each side of the block", unit="m")
    limits: NumbersOrNone = optional("pair", doc=STOPS, unit="m")
    restitution: Number | None = optional("number", doc=REBOUNDS, unit="1")

    kind: ClassVar[str] = "prismatic"
    surfaces: ClassVar[tuple[tuple[str, ...], ...]] = (("contact_length",),)
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
    """Pin of the second body in a straight slot of the first. Coordinates: slide, angle.

    Examples
    --------
    >>> md.PinInSlot("slot", "lever.D", "crank.B", axis="beta/2").axis
    'beta/2'
    """

    axis: Number = optional(
        "number", 0.0, doc="direction of the slot in the first body", unit="rad"
    )
    friction: Number | None = optional("number", unit="1")
    pin_radius: Number | None = optional("number", unit="m")
    one_sided: str | None = optional("text", choices=SIDES, doc=LIES)
    face_width: Number | None = optional("number", doc=WIDE, unit="m")
    shoe_length: Number | None = optional("number", doc="of a flat shoe on the pin", unit="m")
    contact_modulus: Number | None = optional("number", doc=STIFF, unit="Pa")
    clearance: Number | None = optional("number", doc="on each side of the pin", unit="m")
    limits: NumbersOrNone = optional("pair", doc=STOPS, unit="m")
    restitution: Number | None = optional("number", doc=REBOUNDS, unit="1")

    kind: ClassVar[str] = "pin-in-slot"
    surfaces: ClassVar[tuple[tuple[str, ...], ...]] = (
        ("shoe_length",), ("pin_radius", "contact_modulus")
    )  # fmt: skip
    lower: ClassVar[bool] = False
    replaced: ClassVar[str] = "PR"
    coordinates: ClassVar[tuple[str, ...]] = ("slide", "angle")
    straight: ClassVar[bool] = True
    opening: ClassVar[int] = 1

    def friction_law(self, article: bool) -> str:
        return "f |N| on the pin"


@dataclass(frozen=True)
class Weld(Joint):
    """Rigid connection: points coincide, angle between the bodies fixed.

    Examples
    --------
    >>> md.Weld("joint", "arm.B", "plate.B", turn=0.5).turn
    0.5
    """

    turn: Number = optional(
        "number", 0.0, doc="angle of the second less that of the first", unit="rad"
    )

    kind: ClassVar[str] = "weld"
    letter: ClassVar[str] = "W"
    coincide: ClassVar[bool] = True
    keeps_angle: ClassVar[bool] = True


@dataclass(frozen=True)
class Distance(Joint):
    """Massless bar: the two points keep their distance.

    Examples
    --------
    >>> md.Distance("rope", "crank.B", "load.C", length=0.4, one_sided="pull").length
    0.4
    """

    length: Number = key("number", unit="m")
    one_sided: str | None = optional(
        "text",
        choices=("pull", "push"),
        doc="all that it can do: a rope pulls, a prop pushes",
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
