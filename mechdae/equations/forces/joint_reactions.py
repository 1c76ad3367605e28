"""Reactions of joints in space along a motion: sums over all that acts behind a joint.

They are linear in what the equations of motion leave open: accelerations of the free coordinates,
multipliers of all equations, forces that hold slips, sizes of friction and of teeth.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca

from mechdae.describe.coordinates import coordinate
from mechdae.describe.loads import Resistance
from mechdae.equations.forces.generalised import Wrench, add, inertia, reaction, times
from mechdae.equations.gradients import gradients
from mechdae.equations.model import Model
from mechdae.types import Sym

SX = ca.SX


def row_columns(r: Any) -> list[Wrench]:
    """Return what minus a unit of the multiplier of each equation does, in space in joints too.

    Forces of teeth take the place of the equations of gears and racks, where they are known.
    """
    joints, meshes = r.model.mechanism.joints, r.rubbing.meshes
    held = [
        (row.driver and row.part != "law") or (row.owner in joints and joints[row.owner].meshes)
        for row in r.rows
    ]
    others = [row for row, alone in zip(r.rows, held, strict=True) if not alone]
    found, columns = iter(r.model.columns_of(others)), []
    for row, alone in zip(r.rows, held, strict=True):
        mesh = None if row.driver else meshes.get(row.owner)
        if mesh is not None and mesh.column is not None:
            columns.append(mesh.column)
        else:
            columns.append(Model.columns_of(r.model, [row])[0] if alone else next(found))
    return columns


def lock_columns(r: Any) -> list[Wrench]:
    """Return what minus a unit of the force that holds each slip, and each contact, does."""
    model, columns = r.model, []
    for slip in r.rubbing.slips:
        if slip.column is not None:
            columns.append(slip.column)
        elif slip.falls is None:
            columns += gradients(slip.speed, model.velocity)
        else:
            load: Resistance = model.mechanism.loads[slip.owner]
            columns.append(model.gradient(coordinate(model.mechanism, load.coordinate)))
    for contact in r.unilateral:  # of a mesh as the force of its teeth, where that is known
        mesh = r.rubbing.meshes.get(contact.owner)
        known = mesh is not None and mesh.column is not None
        columns.append(times(contact.sign, mesh.column) if known else contact.column)
    return columns


def reactions_of(
    r: Any, names: Sequence[str], acceleration: Sym, multipliers: Sym, locks: Sym, sizes: Sym
) -> Sym:
    """Return force and moment of joints below one another, over (x, v, t, signs, p).

    In the plane a joint's own multipliers tell them, forces that hold its slips and friction.
    """
    model, rubbing = r.model, r.rubbing
    if model.space.behind:
        return JointReactions(r, names).at(acceleration, multipliers, locks, sizes)
    acting: dict[str, list[Wrench]] = {name: [] for name in names}
    columns = gradients(ca.vertcat(*[row.expression for row in r.rows]), model.q)
    for i, row in enumerate(r.rows):
        if not row.driver:
            acting[row.owner].append(times(-multipliers[i], columns[i]))
    for j, feedback in enumerate(rubbing.feedbacks):
        acting[feedback.joint].append(times(sizes[j], feedback.column))
    for slip in sorted({owner for owner in rubbing.owners if owner is not None}):
        (held,) = gradients(rubbing.slips[slip].speed, model.velocity)
        acting[rubbing.slips[slip].owner].append(times(-locks[slip], held))
    for k, contact in enumerate(r.unilateral, rubbing.count):
        acting[contact.owner].append(times(-locks[k], contact.column))
    for name, mesh in rubbing.meshes.items():
        acting[name].append(mesh.steady)
    parts = [part for name in names for part in reaction(model, name, add(*acting[name]))]
    return ca.substitute(ca.vertcat(*parts), model.q, r.q)


class JointReactions:
    """Force and moment of joints, (6 joints,), as linear functions over (x, v, t, signs, p).

    Parameters
    ----------
    r : mechdae.equations.motion_equations.Released
        The equations of motion.
    names
        The joints.

    Attributes
    ----------
    still : SX (6 k,)
        What loads and inertia at x'' = 0 make of them.
    by_acceleration, by_multiplier, by_lock, by_size : SX
        What a unit of each acceleration of x, of each equation's multiplier, of each holding force
        and of each size of a feedback adds.
    """

    def __init__(self, r: Any, names: Sequence[str]) -> None:
        model = r.model
        self.names: list[str] = list(names)
        still = self._told(model, add(r.loads.total, times(-1, inertia(model))))
        steady = self._stacked(model, row_columns(r), -1)
        locks = self._stacked(model, lock_columns(r), -1)
        sizes = self._stacked(model, [feedback.column for feedback in r.rubbing.feedbacks], 1)
        slopes = ca.jacobian(still, model.acceleration)
        parts = [ca.densify(still), slopes, steady, locks, sizes]
        moved = r.moved(ca.horzcat(*parts))
        ends = [0]
        for part in parts:
            ends.append(ends[-1] + part.shape[1])
        self.still, turned, self.by_multiplier, self.by_lock, self.by_size = ca.horzsplit(
            moved, ends
        )
        self.by_acceleration: Sym = turned @ r.V

    def _told(self, model: Model, wrench: Wrench) -> Sym:
        parts = [part for name in self.names for part in reaction(model, name, wrench)]
        return ca.vertcat(SX(0, 1), *parts)

    def _stacked(self, model: Model, columns: Sequence[Wrench], sign: float) -> Sym:
        sides = [ca.sparsify(sign * self._told(model, column)) for column in columns]
        return ca.horzcat(SX(6 * len(self.names), 0), *sides)

    def place(self, name: str) -> slice:
        """Return where the six numbers of a joint stand."""
        k = 6 * self.names.index(name)
        return slice(k, k + 6)

    def at(self, acceleration: Sym, multipliers: Sym, locks: Sym, sizes: Sym, acts: Sym = 1) -> Sym:
        """Return reactions; without what `acts` by itself they are those of a change."""
        return (
            acts * self.still
            + self.by_acceleration @ acceleration
            + self.by_multiplier @ multipliers
            + self.by_lock @ locks
            + self.by_size @ sizes
        )
