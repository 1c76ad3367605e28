"""Reactions of joints in space at states of a motion: sums over all that acts behind a joint."""

from __future__ import annotations

from typing import Any

import casadi as ca

from mechdae.describe.coordinates import coordinate
from mechdae.model.forces.generalised import Wrench, add, reaction, times
from mechdae.model.forces.inertia import inertia
from mechdae.model.model import Model
from mechdae.model.motion_equations import Released

SX = ca.SX


def columns_in_space(r: Released) -> list[Wrench]:
    """Return what minus a unit of the multiplier of each equation does, in joints too."""
    joints = r.model.mechanism.joints
    held = [
        (row.driver and row.part != "law") or (row.owner in joints and joints[row.owner].meshes)
        for row in r.rows
    ]
    others = [row for row, alone in zip(r.rows, held, strict=True) if not alone]
    found = iter(r.model.columns_of(others))
    return [
        Model.columns_of(r.model, [row])[0] if alone else next(found)
        for row, alone in zip(r.rows, held, strict=True)
    ]


def lock_columns(r: Released) -> list[Wrench]:
    """Return what minus a unit of the force that holds each slip does: those of resistances."""
    mechanism = r.model.mechanism
    found = []
    for slip in r.rubbing.slips:
        load: Any = mechanism.loads[slip.owner]
        found.append(r.model.gradient(coordinate(mechanism, load.coordinate)))
    return found


def reactions_in_space(r: Released, lam: Any, held: list[Any], a: Any) -> Any:
    """Return force and moment of all joints in their order, (6 joints,), over states.

    Parameters
    ----------
    lam : SX (rows,)
        Multipliers of all equations.
    held : list of SX
        Forces that hold slips.
    a : SX (n,)
        Accelerations of the free coordinates.
    """
    model = r.model
    acting = [r.loads.total, times(-1, inertia(model))]
    acting += [times(-lam[i], own) for i, own in enumerate(columns_in_space(r))]
    acting += [times(-held[k], own) for k, own in enumerate(lock_columns(r))]
    whole = add(*acting)
    parts = [part for name in model.mechanism.joints for part in reaction(model, name, whole)]
    symbols = ca.vertcat(lam, *held)
    if not symbols.numel():
        return r.moved(ca.vertcat(*parts), a)
    # lam and held are no inputs of `moved`: linear in them
    stacked = ca.vertcat(*parts)
    slopes = ca.jacobian(stacked, symbols)
    rest = ca.substitute(stacked, symbols, SX.zeros(symbols.numel()))
    moved = r.moved(ca.horzcat(ca.densify(rest), ca.densify(slopes)), a)
    return moved[:, 0] + moved[:, 1:] @ symbols
