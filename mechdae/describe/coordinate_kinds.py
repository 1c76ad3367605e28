"""Kinds of coordinates: they decide unit, period and natural size of what has one."""

from __future__ import annotations

from mechdae.records import dataclass


@dataclass(frozen=True)
class CoordinateKind:
    """What a coordinate measures, with its SI unit ("1": the user's own)."""

    name: str
    unit: str


ANGLE = CoordinateKind("angle", "rad")
LENGTH = CoordinateKind("length", "m")
PLACE = CoordinateKind("place on a curve", "1")
UNIT = CoordinateKind("component of a unit quaternion", "1")

KINDS = {
    **dict.fromkeys(("x", "y", "z", "slide", "length"), LENGTH),
    **dict.fromkeys(("angle", "angle2", "elevation", "azimuth"), ANGLE),
    "s": PLACE,
    **dict.fromkeys(("e0", "e1", "e2", "e3"), UNIT),
}
"""By the name of a coordinate."""


def kind_of(name: str) -> CoordinateKind:
    """Return the kind of a coordinate or of its series by its last word; lengths have the rest."""
    return KINDS.get(name.rpartition(".")[2], LENGTH)
