"""Kinds of coordinates: they decide unit, period and natural size of what has one."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class CoordinateKind:
    """What a coordinate measures, with its SI unit ("1": the user's own)."""

    name: str
    unit: str


ANGLE = CoordinateKind("angle", "rad")
LENGTH = CoordinateKind("length", "m")
PLACE = CoordinateKind("place on a curve", "1")

KINDS = {"x": LENGTH, "y": LENGTH, "z": LENGTH, "slide": LENGTH, "angle": ANGLE, "s": PLACE}
"""By the name of a coordinate."""
