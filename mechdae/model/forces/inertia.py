"""Inertia of the bodies as generalised forces: M(q) a + h(q, v), and the kinetic energy."""

from __future__ import annotations

from typing import Any

import casadi as ca

from mechdae.model.forces.generalised import Wrench, add
from mechdae.model.model import Model

SX = ca.SX


def massive(model: Model) -> list[str]:
    """Return the bodies with a mass or a moment of inertia."""
    return [
        name
        for name in model.mechanism.bodies
        if any(f"{name}.{entry}" in model.numbers for entry in ("mass", "inertia"))
    ]


def inertia(model: Model) -> Wrench:
    """Return M qdd + h: mass times acceleration of each body's centre, at its anchor."""
    return add(*[_of_body(model, name) for name in massive(model)])


def _of_body(model: Model, name: str) -> Wrench:
    mass, moment, arm = _numbers(model, name)
    places = model.twist(name)
    twist, rate = model.velocity[places], model.acceleration[places]
    force = mass * model.space.acceleration(twist, rate, arm)
    turning = moment * rate[-1] + model.space.moment(arm, force)
    return dict(zip(places, (force[0], force[1], turning), strict=True))


def kinetic_energy(model: Model) -> tuple[Any, Any]:
    """Return the kinetic energy and its rate in time."""
    energy, power = SX(0), SX(0)
    v = model.velocity
    for name in massive(model):
        mass, moment, arm = _numbers(model, name)
        twist = v[model.twist(name)]
        centre = model.space.velocity(twist, arm)
        energy += (mass * (centre[0] ** 2 + centre[1] ** 2) + moment * twist[-1] ** 2) / 2
    for i, force in inertia(model).items():
        power += force * v[i]
    return energy, power


def _numbers(model: Model, name: str) -> tuple[Any, Any, Any]:
    mass, moment = (model.numbers.get(f"{name}.{entry}", SX(0)) for entry in ("mass", "inertia"))
    return mass, moment, model.frame(name).direction(model.center(name))
