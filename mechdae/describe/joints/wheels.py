"""Wheels that drive each other, a rack, or a belt."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar

from mechdae.describe.joints.joint import PRESSURE_ANGLE, REBOUNDS, SENSES, TURNS, Joint
from mechdae.describe.values import Number
from mechdae.errors import MechanismError
from mechdae.records import dataclass, key, optional

if TYPE_CHECKING:
    from mechdae.describe.values import NumbersOrNone
    from mechdae.types import Floats


@dataclass(frozen=True)
class Gear(Joint):
    """Gear pair between two wheel centres, on a carrier.

    (angle of the first - carrier) = ratio * (angle of the second - carrier) + phase, with
    unwrapped angles. Give ``ratio``, or ``teeth`` and ``mesh``.

    Examples
    --------
    >>> mesh = md.Gear("mesh", "pinion.A", "wheel.B", teeth=[20, 50], mesh="external")
    >>> mesh.teeth
    (20.0, 50.0)
    """

    carrier: str | None = optional("name")
    ratio: Number | None = optional(
        "number", doc="(w1 - wc) / (w2 - wc), below 0 of an external mesh", unit="1"
    )
    teeth: NumbersOrNone = optional("pair", doc="[z1, z2], with mesh, in place of ratio", unit="1")
    mesh: str | None = optional("text", choices=("external", "internal"), doc="side of the teeth")
    phase: Number = optional("number", 0.0, unit="rad")
    pressure_angle: Number = optional("number", PRESSURE_ANGLE, unit="rad")
    mesh_loss: Number | None = optional("number", doc="share of power", unit="1")
    one_sided: str | None = optional("text", choices=SENSES, doc=TURNS)
    backlash: Number | None = optional("number", doc="along the pitch circle", unit="m")
    backlash_angle: Number | None = optional("number", doc="of the first wheel", unit="rad")
    restitution: Number | None = optional("number", doc=REBOUNDS, unit="1")

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

    def numbers(self) -> tuple[tuple[str, Number], ...]:
        if self.teeth is None:
            return super().numbers()
        first, second = self.teeth
        sign = "-" if self.mesh == "external" else ""
        return (*super().numbers(), ("ratio", f"{sign}({second})/({first})"))

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
    """Wheel on a rack: travel along ``axis`` of the second body = radius * angle + phase.

    Examples
    --------
    >>> md.Rack("mesh", "wheel.O", "rack.A", radius=-0.02).radius
    -0.02
    """

    radius: Number = key("number", doc="signed pitch radius", unit="m")
    carrier: str | None = optional("name")
    axis: Number = optional("number", 0.0, doc="of the rack in the second body", unit="rad")
    phase: Number = optional("number", 0.0, unit="m")
    pressure_angle: Number = optional("number", PRESSURE_ANGLE, unit="rad")
    mesh_loss: Number | None = optional("number", unit="1")
    one_sided: str | None = optional("text", choices=SENSES, doc=TURNS)
    backlash: Number | None = optional("number", doc="along the rack", unit="m")
    restitution: Number | None = optional("number", doc=REBOUNDS, unit="1")

    kind: ClassVar[str] = "rack"
    lower: ClassVar[bool] = False
    wheels: ClassVar[int] = 1

    def check(self, values: Mapping[str, float]) -> None:
        super().check(values)
        if values["radius"] == 0:
            raise MechanismError("radius is zero", where=f"joints.{self.name}.radius")


@dataclass(frozen=True)
class Belt(Joint):
    """Belt or chain between two wheels.

    Examples
    --------
    >>> md.Belt("belt", "motor.A", "shaft.B", ratio=2.5, pretension=300).crossed
    False
    """

    ratio: Number = key("number", doc="(w1 - wc) / (w2 - wc) of an open belt, above 0", unit="1")
    carrier: str | None = optional("name")
    crossed: bool = optional("flag", False, doc="the wheels turn in opposite senses")
    pretension: Number | None = optional("number", doc="of each strand", unit="N")
    radius: Number | None = optional(
        "number", doc="of the first wheel; only forces use it", unit="m"
    )
    phase: Number = optional("number", 0.0, unit="rad")
    mesh_loss: Number | None = optional("number", unit="1")

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

    def needed(self, values: Mapping[str, float], moment: Floats) -> Floats:
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

    Examples
    --------
    >>> wheels = md.FrictionWheel("pair", "a.A", "b.B", 0.02, 0.05, press=400, adhesion=0.3)
    >>> wheels.second_radius
    0.05
    """

    radius: Number = key("number", doc="of the first wheel", unit="m")
    second_radius: Number = key("number", doc="of the second wheel", unit="m")
    carrier: str | None = optional("name")
    contact: str = optional(
        "text", "external", choices=("external", "internal"), doc="side on which they touch"
    )
    phase: Number = optional("number", 0.0, unit="rad")
    press: Number | None = optional("number", doc="force that presses them together", unit="N")
    adhesion: Number | None = optional("number", doc="coefficient of adhesion", unit="1")

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

    def needed(self, values: Mapping[str, float], moment: Floats) -> Floats:
        most = values.get(f"{self.name}.adhesion", math.inf) * values[f"{self.name}.second_radius"]
        return abs(moment) / most if most else abs(moment) * math.inf

    def gives_way(self, where: str, force: float) -> str:
        return (
            f"friction wheels {self.name} slip{where}: they must be pressed together with "
            f"{force:.6g} N at least"
        )
