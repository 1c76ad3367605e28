"""Forces and inertia of bodies as generalised forces of the absolute coordinates.

A generalised force is kept as {position in q: expression}: most of them touch one or two
bodies only. In space other keys tell what it does in joints, see `mechdae.equations.tree.solid`.
"""

from __future__ import annotations

from collections.abc import Collection, Hashable
from typing import Any, Protocol

import casadi as ca

from mechdae.describe.mechanism import GROUND
from mechdae.equations.model import Model
from mechdae.types import Sym

SX = ca.SX
Wrench = dict[Any, Any]


def add(*parts: Wrench) -> Wrench:
    """Return the sum of generalised forces."""
    total: Wrench = {}
    for part in parts:
        for i, value in part.items():
            total[i] = total[i] + value if i in total else value
    return total


def put(total: Wrench, factor: Sym, part: Wrench) -> None:
    """Add a generalised force, multiplied by a number, to another one in place."""
    for i, value in part.items():
        entry = factor * value
        total[i] = total[i] + entry if i in total else entry


def times(factor: Sym, wrench: Wrench) -> Wrench:
    """Return a generalised force multiplied by a number."""
    return {i: factor * value for i, value in wrench.items()}


def push(model: Model, body: str, place: Sym, force: Sym) -> Wrench:
    """Return the generalised force of a `force` (d,) at a `place` (d,), world axes, on a body."""
    return {} if body == GROUND else model.space.push(model, body, place, force)


def couple(model: Model, body: str, moment: Sym) -> Wrench:
    """Return the generalised force of a couple on a body."""
    return {} if body == GROUND else model.space.couple(model, body, moment)


def pair(model: Model, first: str, second: str, place: Sym, force: Sym) -> Wrench:
    """Return that of a force on the second body, and its opposite on the first, at a place."""
    return add(push(model, second, place, force), push(model, first, place, -force))


def couples(model: Model, first: str, second: str, moment: Sym) -> Wrench:
    """Return that of a couple on the second body, and its opposite on the first."""
    return add(couple(model, second, moment), couple(model, first, -moment))


def reaction(model: Model, name: str, wrench: Wrench) -> list[Sym]:
    """Return force and moment about the second body's point, on the second body, of a joint."""
    return model.space.reaction(model, name, wrench)


def velocity(model: Model, body: str, place: Sym) -> Sym:
    """Return the velocity (d,) of a body's material point that is now at `place`."""
    if body == GROUND:
        return SX.zeros(len(model.space.axes))
    return model.space.point_velocity(model, body, place)


def spin(model: Model, body: str) -> Sym:
    """Return the angular velocity of a body, a vector in space."""
    if body == GROUND:
        return SX.zeros(3) if len(model.space.axes) == 3 else SX(0)
    return model.space.spin(model, body)


def power(model: Model, wrench: Wrench) -> list[Sym]:
    """Return the powers of the parts of a generalised force."""
    return [force * model.velocity[i] for i, force in of_coordinates(wrench).items()]


def of_coordinates(wrench: Wrench) -> dict[int, Sym]:
    """Return what of a generalised force acts on coordinates."""
    return {i: force for i, force in wrench.items() if isinstance(i, int)}


def massive(model: Model, among: Collection[str] | None = None) -> list[str]:
    """Return the bodies with a mass or a moment of inertia, of all or `among` some."""
    return [
        name
        for name, body in model.mechanism.bodies.items()
        if (body.mass is not None or body.inertia is not None) and (among is None or name in among)
    ]


def inertia(model: Model, among: Collection[str] | None = None) -> Wrench:
    """Return M qdd + h: mass times acceleration of each body's centre, at its anchor."""
    return add(*[model.space.inertia_force(model, name) for name in massive(model, among)])


def kinetic_energy(model: Model, among: Collection[str] | None = None) -> tuple[Sym, Sym]:
    """Return the kinetic energy and its rate in time."""
    each = (model.space.kinetic_energy(model, name) for name in massive(model, among))
    return sum(each, SX(0)), sum(power(model, inertia(model, among)), SX(0))


class MeshForces(Protocol):
    """The forces of one joint in place of the gradient of its row.

    ``column`` is the generalised force of its multiplier, None: that of the row itself;
    ``tangential`` times the multiplier is the tangential force, ``apart`` what a unit of that does
    beside, ``steady`` does not depend on it; ``rubbing`` is the speed that losses go with,
    ``holding`` what a unit of the couple against it does where the row does not say, ``kept_by``
    what decides all that beside the joint.
    """

    @property
    def column(self) -> Wrench | None: ...
    @property
    def tangential(self) -> Sym: ...
    @property
    def apart(self) -> Wrench: ...
    @property
    def steady(self) -> Wrench: ...
    @property
    def rubbing(self) -> Sym: ...
    @property
    def holding(self) -> Wrench | None: ...
    @property
    def kept_by(self) -> Hashable: ...
    def lost(self, loss: Sym, side: int, sign: Sym) -> tuple[Sym, Wrench]:
        """Return the arm of a loss and what it does."""
