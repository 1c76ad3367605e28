"""Inertia of the bodies as generalised forces: M(q) a + h(q, v), and the kinetic energy."""

from __future__ import annotations

from collections.abc import Collection

import casadi as ca

from mechdae.equations.forces.generalised import Wrench, add, power
from mechdae.equations.model import Model
from mechdae.types import Sym

SX = ca.SX


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
