"""Frames of bodies: everything that a residual may use of a body's place.

A frame is a position vector r and a rotation matrix R of casadi symbols, with the
coordinates it is made of. Joint residuals use points ``r + R s`` and directions ``R d``
only, so that other coordinates (or a third axis) need no second set of joints.
"""

from __future__ import annotations

import casadi as ca

from mechdae.equations.coordinates import Coordinate, of_owner
from mechdae.equations.space import PLANE
from mechdae.records import dataclass
from mechdae.types import Sym

SX = ca.SX


@dataclass(frozen=True)
class Frame:
    """Placement of one body: ``r`` (d,), ``R`` (d, d), turning ``angle`` and coordinates."""

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
