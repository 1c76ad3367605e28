"""Inertia of the bodies as generalised forces: M(q) a + h(q, v), and the kinetic energy."""

from __future__ import annotations

from typing import Any

import casadi as ca

from mechdae.model.forces.generalised import Wrench, add, cross
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
    x, y, turn = (model.places[name, c] for c in ("x", "y", "angle"))
    v, a = model.velocity, model.acceleration
    spin, alpha = v[turn], a[turn]
    centre = ca.vertcat(
        a[x] - alpha * arm[1] - spin * spin * arm[0], a[y] + alpha * arm[0] - spin * spin * arm[1]
    )
    force = mass * centre
    return {x: force[0], y: force[1], turn: moment * alpha + cross(arm, force)}


def kinetic_energy(model: Model) -> tuple[Any, Any]:
    """Return the kinetic energy and its rate in time."""
    energy, power = SX(0), SX(0)
    v = model.velocity
    for name in massive(model):
        mass, moment, arm = _numbers(model, name)
        x, y, turn = (model.places[name, c] for c in ("x", "y", "angle"))
        centre = (v[x] - v[turn] * arm[1], v[y] + v[turn] * arm[0])
        energy += (mass * (centre[0] ** 2 + centre[1] ** 2) + moment * v[turn] ** 2) / 2
    for i, force in inertia(model).items():
        power += force * v[i]
    return energy, power


def _numbers(model: Model, name: str) -> tuple[Any, Any, Any]:
    mass, moment = (model.numbers.get(f"{name}.{entry}", SX(0)) for entry in ("mass", "inertia"))
    return mass, moment, model.frame(name).direction(model.center(name))
