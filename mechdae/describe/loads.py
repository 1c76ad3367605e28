"""Loads as frozen values; what they mean is in the documentation of the file format."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from mechdae.describe.values import Number, Value, key


@dataclass(frozen=True)
class Load(Value):
    """Base of all loads."""

    name: str = key("name")
    kind: ClassVar[str] = ""


@dataclass(frozen=True)
class Force(Load):
    """Force [N] at a point; ``frame`` is "world" or a body."""

    point: str = key("reference")
    value: tuple[Number, ...] = key("pair")
    frame: str = key("text", "world")
    kind: ClassVar[str] = "force"


@dataclass(frozen=True)
class Torque(Load):
    """Torque [N m] on a body."""

    body: str = key("name")
    value: Number = key("number")
    kind: ClassVar[str] = "torque"


@dataclass(frozen=True)
class Resistance(Load):
    """Magnitudes against the motion while the coordinate falls / grows [N or N m]."""

    coordinate: str = key("text")
    negative: Number = key("number", 0.0)
    positive: Number = key("number", 0.0)
    kind: ClassVar[str] = "resistance"


@dataclass(frozen=True)
class Spring(Load):
    """Spring and damper between two points, or on a coordinate."""

    between: tuple[str, ...] | None = key("names", None)
    coordinate: str | None = key("text", None)
    stiffness: Number = key("number", 0.0)
    free_length: Number = key("number", 0.0)
    preload: Number = key("number", 0.0)
    damping: Number = key("number", 0.0)
    kind: ClassVar[str] = "spring"


@dataclass(frozen=True)
class TableLoad(Load):
    """Values read from a CSV file over a coordinate."""

    coordinate: str = key("text")
    file: str = key("text")
    columns: tuple[str, ...] | None = key("names", None)
    factor: Number = key("number", 1.0)
    along: str | None = key("text", None)
    body: str | None = key("name", None)
    periodic: bool = key("flag", False)
    kind: ClassVar[str] = "table"


LOADS: dict[str, type[Load]] = {
    load.kind: load for load in (Force, Torque, Resistance, Spring, TableLoad)
}
