"""What is planar: axes, twists and wrenches of bodies, moments, velocities, inertia, mobility."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

SX = ca.SX


@dataclass(frozen=True)
class Space:
    """The space that bodies move in: its axes, and the coordinates of a free body.

    A twist holds the velocity of a body's anchor and its angular velocity, in the order of
    ``twist``; force and moment of a wrench have the same order.
    """

    axes: str
    twist: tuple[str, ...]

    @property
    def freedoms(self) -> int:
        """Coordinates of a free body."""
        return len(self.twist)

    def moment(self, arm: Any, force: Any) -> Any:
        """Return arm x force, the component along the axis of turning."""
        return arm[0] * force[1] - arm[1] * force[0]

    def velocity(self, twist: Any, arm: Any) -> Any:
        """Return the velocity of a point, `arm` from the anchor of a body with a `twist` (3,)."""
        return ca.vertcat(twist[0], twist[1]) + twist[2] * left(arm)

    def acceleration(self, twist: Any, rate: Any, arm: Any) -> Any:
        """Return the acceleration of a point by the twist, its rate and the arm of the point."""
        spin, alpha = twist[2], rate[2]
        return ca.vertcat(
            rate[0] - alpha * arm[1] - spin * spin * arm[0],
            rate[1] + alpha * arm[0] - spin * spin * arm[1],
        )

    def inertia(self, mass: Any, moment: Any, arm: Any) -> Any:
        """Return the matrix (3, 3) of a body at its anchor, `arm` from there to the centre c.

        [[m, 0, -m c_y], [0, m, m c_x], [-m c_y, m c_x, I + m c.c]].
        """
        return ca.vertcat(
            ca.horzcat(mass, 0, -mass * arm[1]),
            ca.horzcat(0, mass, mass * arm[0]),
            ca.horzcat(-mass * arm[1], mass * arm[0], moment + mass * ca.sumsqr(arm)),
        )

    def mobility(self, links: int, lower: int, higher: int) -> int:
        """Return W = 3 n - 2 p5 - p4 (Chebyshev)."""
        return self.freedoms * links - (self.freedoms - 1) * lower - (self.freedoms - 2) * higher


def left(direction: Any) -> Any:
    """Return a direction of the plane turned by +90 degrees."""
    return ca.vertcat(-direction[1], direction[0])


SPACE = Space("xyz", ("x", "y", "z", "wx", "wy", "wz"))
PLANE = Space("xy", ("x", "y", "angle"))
