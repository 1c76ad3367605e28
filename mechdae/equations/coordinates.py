"""Coordinates as values, owner, symbol, unit, period and size; frames of bodies made of them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE, KINDS, LENGTH, PLACE, UNIT, CoordinateKind
from mechdae.equations.space import PLANE
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Sym

SX = ca.SX
QUATERNION = ("e0", "e1", "e2", "e3")
"""Coordinates of what turns about a ball joint, or hangs on bars: a unit quaternion."""


@dataclass(frozen=True, eq=False)
class Coordinate:
    """An entry of q.

    Attributes
    ----------
    owner, name : str
        The body, or the joint that has coordinates of its own, and which of them it is.
    symbol : SX
    period : float
        By which the same pose comes again; 0 without one. Of places on curves in their unit.
    extent : float, SX
        Of a place on a curve the range over 2 pi, as a number and in symbols.
    middle : float
        Where it is looked for when nothing is known.
    """

    owner: str
    name: str
    symbol: Sym
    period: float = 0.0
    extent: float = 1.0
    extent_symbol: Any = None
    middle: float = 0.0

    @cached_property
    def kind(self) -> CoordinateKind:
        return KINDS[self.name]

    @cached_property
    def key(self) -> tuple[str, str]:
        """(owner, name), by which results and poses hold its value."""
        return self.owner, self.name

    @property
    def unit(self) -> str:
        return self.kind.unit

    def size(self, length: Sym) -> Any:
        """Return the natural size: 1 rad, a `length`, or the range of a curve over 2 pi."""
        return length if self.kind is LENGTH else self.extent

    def size_symbol(self, length: Sym) -> Sym:
        """Return the natural size in symbols."""
        return self.extent_symbol if self.kind is PLACE else self.size(length)


def of_owner(owner: str, names: Sequence[str]) -> tuple[Coordinate, ...]:
    """Return new coordinates of a body or joint by their names."""
    return tuple(
        Coordinate(
            owner, name, ca.SX.sym(f"{owner}.{name}"), 2 * math.pi if KINDS[name] is ANGLE else 0.0
        )
        for name in names
    )


class Coordinates(tuple[Coordinate, ...]):
    """Several coordinates in order, and what arrays of their values need."""

    def of_kind(self, kind: CoordinateKind) -> Booleans:
        """Return which are of a kind, (n,) booleans."""
        result = np.array([c.kind is kind for c in self], bool)
        result.flags.writeable = False
        return result

    @cached_property
    def turns(self) -> Booleans:
        """Which are angles, (n,) booleans."""
        return self.of_kind(ANGLE)

    @cached_property
    def lengths(self) -> Booleans:
        """Which are lengths, (n,) booleans."""
        return self.of_kind(LENGTH)

    @cached_property
    def places(self) -> Booleans:
        """Which are places on curves, (n,) booleans."""
        return self.of_kind(PLACE)

    @cached_property
    def periods(self) -> Floats:
        """Their periods (n,): a turn of angles, the range of a closed curve, 0 without one."""
        return np.array([c.period for c in self])

    @cached_property
    def balls(self) -> list[list[int]]:
        """The places of the four components of each unit quaternion."""
        found: dict[str, list[int]] = {}
        for i, coordinate in enumerate(self):
            if coordinate.name in QUATERNION:
                found.setdefault(coordinate.owner, []).append(i)
        return list(found.values())

    def sizes(self, length: float) -> Floats:
        """Return natural sizes (n,): 1 rad, a `length`, the range of a curve over 2 pi."""
        return np.array([c.size(length) for c in self])

    @property
    def keys(self) -> list[tuple[str, str]]:
        return [c.key for c in self]


def quaternions(coordinates: Iterable[Coordinate]) -> list[list[int]]:
    """Return the places of quaternions among coordinates."""
    places: dict[str, list[int]] = {}
    for i, c in enumerate(coordinates):
        if c.kind is UNIT:
            places.setdefault(c.owner, []).append(i)
    return [group for group in places.values() if len(group) == len(QUATERNION)]


@dataclass(frozen=True)
class Frame:
    """Placement of one body: ``r`` (d,), ``R`` (d, d), turning ``angle`` and coordinates.

    Residuals of joints use points ``r + R s`` and directions ``R d`` only, so that other
    coordinates (or a third axis) need no second set of joints.
    """

    r: Sym
    R: Sym
    angle: Sym
    coordinates: tuple[Coordinate, ...]

    def point(self, s: Sym) -> Sym:
        """Return the place of a point with local coordinates `s`."""
        return self.r + self.R @ s

    def direction(self, d: Sym) -> Sym:
        """Return a body-fixed direction in the fixed frame."""
        return self.R @ d


def rotation(angle: Sym) -> Sym:
    """Return the planar rotation matrix."""
    c, s = ca.cos(angle), ca.sin(angle)
    return ca.vertcat(ca.horzcat(c, -s), ca.horzcat(s, c))


def fixed_frame(dimension: int) -> Frame:
    """Return the frame of the ground."""
    return Frame(SX.zeros(dimension), SX.eye(dimension), SX(0), ())


def planar_frame(body: str) -> Frame:
    """Return the frame (x, y, theta) of a planar body."""
    coordinates = of_owner(body, PLANE.twist)
    x, y, theta = (c.symbol for c in coordinates)
    return Frame(ca.vertcat(x, y), rotation(theta), theta, coordinates)
