"""What is planar: axes, twists and wrenches of bodies, moments, velocities, inertia, mobility.

What a force does is a generalised force, {position in q: expression}. That of the plane has the
rows of a body's own coordinates; `mechdae.equations.tree.solid` has that of a tree of joints.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca

from mechdae.records import dataclass
from mechdae.types import Sym

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

    @property
    def behind(self) -> bool:
        """Whether reactions of joints follow from all that acts behind them, not from multipliers
        of their own alone.
        """
        return False

    def moment(self, arm: Any, force: Any) -> Sym:
        """Return arm x force, the component along the axis of turning."""
        return arm[0] * force[1] - arm[1] * force[0]

    def velocity(self, twist: Sym, arm: Sym) -> Sym:
        """Return the velocity of a point, `arm` from the anchor of a body with a `twist` (3,)."""
        return ca.vertcat(twist[0], twist[1]) + twist[2] * left(arm)

    def acceleration(self, twist: Any, rate: Any, arm: Any) -> Sym:
        """Return the acceleration of a point by the twist, its rate and the arm of the point."""
        spin, alpha = twist[2], rate[2]
        return ca.vertcat(
            rate[0] - alpha * arm[1] - spin * spin * arm[0],
            rate[1] + alpha * arm[0] - spin * spin * arm[1],
        )

    def inertia(self, mass: Sym, moment: Sym, arm: Any) -> Sym:
        """Return the matrix (3, 3) of a body at its anchor, `arm` from there to the centre c.

        [[m, 0, -m c_y], [0, m, m c_x], [-m c_y, m c_x, I + m c.c]].
        """
        return ca.vertcat(
            ca.horzcat(mass, 0, -mass * arm[1]),
            ca.horzcat(0, mass, mass * arm[0]),
            ca.horzcat(-mass * arm[1], mass * arm[0], moment + mass * ca.sumsqr(arm)),
        )

    # -- forces on the bodies of a model -----------------------------------------------------

    def push(self, model: Any, body: str, place: Sym, force: Sym) -> dict[int, Sym]:
        """Return the generalised force of a `force` at a `place` on a body that moves."""
        arm = place - model.frame(body).r
        parts = (force[0], force[1], self.moment(arm, force))
        return dict(zip(model.twist(body), parts, strict=True))

    def couple(self, model: Any, body: str, moment: Sym) -> dict[int, Sym]:
        """Return the generalised force of a couple on a body that moves."""
        return {model.turn(body): moment}

    def point_velocity(self, model: Any, body: str, place: Sym) -> Sym:
        """Return the velocity of a moving body's material point that is now at `place`."""
        twist = model.velocity[model.twist(body)]
        return self.velocity(twist, place - model.frame(body).r)

    def spin(self, model: Any, body: str) -> Sym:
        """Return the angular velocity of a body that moves."""
        return model.velocity[model.turn(body)]

    def on_body(self, model: Any, wrench: dict[int, Sym], body: str, place: Sym) -> tuple[Sym, ...]:
        """Return force and moment about `place` of the part of a wrench that acts on a body."""
        x, y, moment = (wrench.get(i, SX(0)) for i in model.twist(body))
        return x, y, moment - self.moment(place - model.frame(body).r, (x, y))

    def at_origin(self, model: Any, wrench: dict[int, Sym], body: str) -> Sym | None:
        """Return the force and the moment about the body's origin of what acts on it, or None."""
        places = model.twist(body)
        if not any(i in wrench for i in places):
            return None
        *force, moment = (wrench.get(i, 0.0) for i in places)
        acting = ca.vertcat(*force)
        arm = model.frame(body).r - model.origin(body)
        return ca.vertcat(acting, moment + self.moment(arm, acting))

    def reaction(self, model: Any, name: str, wrench: dict[int, Sym]) -> list[Sym]:
        """Return force and moment about the second body's point, on the second body, of a joint."""
        joint, place = model.mechanism.joints[name], model.ends[name].p2
        if joint.second_body not in model.mechanism.bodies:
            return [-part for part in self.on_body(model, wrench, joint.first_body, place)]
        return list(self.on_body(model, wrench, joint.second_body, place))

    def imbalance(
        self, model: object, bodies: Sequence[str],
        parts: Sequence[dict[tuple[int | str, ...] | int, Sym]], reactions: Mapping[str, Sym],
    ) -> Sym:  # fmt: skip
        """Return what is left of the balance of bodies under all `parts` and reactions.

        Of the plane the balance has it itself: its wrenches are those of the bodies.
        """
        raise NotImplementedError

    def moves(self, model: object, joint: str) -> Sym:
        """Return how a joint lets the second body move; in the plane its rows tell."""
        raise NotImplementedError

    def inertia_force(self, model: Any, name: str) -> dict[int, Sym]:
        """Return M qdd + h of one body: mass times acceleration of its centre, at its anchor."""
        mass, moment, arm = _numbers(model, name)
        places = model.twist(name)
        twist, rate = model.velocity[places], model.acceleration[places]
        force = mass * self.acceleration(twist, rate, arm)
        turning = moment * rate[-1] + self.moment(arm, force)
        return dict(zip(places, (force[0], force[1], turning), strict=True))

    def kinetic_energy(self, model: Any, name: str) -> Sym:
        """Return the kinetic energy of one body."""
        mass, moment, arm = _numbers(model, name)
        twist = model.velocity[model.twist(name)]
        centre = self.velocity(twist, arm)
        return (mass * (centre[0] ** 2 + centre[1] ** 2) + moment * twist[-1] ** 2) / 2

    def mobility(self, links: int, lower: int, higher: int) -> int:
        """Return W = 3 n - 2 p5 - p4 (Chebyshev)."""
        return self.freedoms * links - (self.freedoms - 1) * lower - (self.freedoms - 2) * higher


def left(direction: Sym) -> Sym:
    """Return a direction of the plane turned by +90 degrees."""
    return ca.vertcat(-direction[1], direction[0])


def _numbers(model: Any, name: str) -> tuple[Sym, Sym, Sym]:
    mass, moment = (model.numbers.get(f"{name}.{entry}", SX(0)) for entry in ("mass", "inertia"))
    return mass, moment, model.frame(name).direction(model.center(name))


PLANE = Space("xy", ("x", "y", "angle"))
