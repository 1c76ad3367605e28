"""Inertia of the bodies as generalised forces: M(q) a + h(q, v), and the kinetic energy."""

from __future__ import annotations

from typing import Any

import casadi as ca

from mechdae.equations.forces.generalised import Wrench, add, power
from mechdae.equations.model import Model

SX = ca.SX


def massive(model: Model) -> list[str]:
    """Return the bodies with a mass or a moment of inertia."""
    return [
        name
        for name, body in model.mechanism.bodies.items()
        if body.mass is not None or body.inertia is not None
    ]


def inertia(model: Model) -> Wrench:
    """Return M qdd + h: mass times acceleration of each body's centre, at its anchor."""
    return add(*[model.space.inertia_force(model, name) for name in massive(model)])


def kinetic_energy(model: Model) -> tuple[Any, Any]:
    """Return the kinetic energy and its rate in time."""
    energy = sum((model.space.kinetic_energy(model, name) for name in massive(model)), SX(0))
    return energy, sum(power(model, inertia(model)), SX(0))
