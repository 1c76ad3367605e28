"""Speeds that dry friction may hold at zero, and the forces that do it.

Each slip has three inputs that are fixed between events: the sign of its speed (0 for none),
whether it is locked, and whether its coefficient is the one at rest. A locked slip is a constraint
on its speed; the multiplier is the force of friction that holds it. A slip that is neither locked
nor has a sign is a contact that nothing presses.

Forces of teeth and belts act at their pitch points here (`meshes`): what they have beside the
gradient of the equation that holds the wheels together is one more force with a size.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import casadi as ca

from mechdae.equations.forces.feedback import Feedback, Slip, Unilateral
from mechdae.equations.forces.friction import Laws
from mechdae.equations.forces.generalised import MeshForces, Wrench, add, times
from mechdae.equations.forces.loads import Loads
from mechdae.equations.gradients import gradients
from mechdae.equations.model import Model
from mechdae.types import Sym

SX = ca.SX


class Rubbing:
    """The slips of a mechanism in motion: those of resistances, then those of joints.

    Parameters
    ----------
    model, loads
        Symbols and what acts.
    friction
        Whether joints rub.
    meshes
        Gears, racks and belts by joint, whose bearing forces count.
    unilateral
        Contacts that may rub.

    Attributes
    ----------
    slips : list of Slip
    feedbacks : list of Feedback
        Forces that follow from multipliers.
    owners : list of int or None
        Place of the slip of each feedback, None for one that is no friction.
    sides : list of (int, int)
        Slips of which one at most is pressed: the two sides of a slot.
    steady : dict
        Generalised force of pretensions.
    signs : SX (3 k,)
        Signs, locks, and whether coefficients at rest count.
    """

    def __init__(
        self,
        model: Model,
        loads: Loads,
        friction: bool,
        meshes: Mapping[str, MeshForces] | None = None,
        unilateral: Sequence[Unilateral] = (),
    ) -> None:
        self.model: Model = model
        self.meshes: dict[str, MeshForces] = dict(meshes or {})
        laws = Laws(model, self.meshes, friction=friction, adhesion=True)
        laws.factor = SX(1)
        self.feedbacks: list[Feedback] = []
        self.owners: list[int | None] = []
        self.sides: list[tuple[int, int]] = []
        for name in model.mechanism.joints:
            if name in model.in_gaps:
                continue
            self.feedbacks += laws.of(name)
        for k, contact in enumerate(unilateral):
            self.feedbacks += laws.of_contact(k, contact)
            if contact.owner in self.meshes:  # what presses is minus, and along, its equation
                teeth = [*laws.apart(contact.owner), *self._bearings(contact.owner)]
                self.feedbacks += [
                    replace(one, forms=contact.sign * one.forms, contact=k) for one in teeth
                ]
        for name in self.meshes:
            self.feedbacks += [] if name in model.in_gaps else self._bearings(name)
        self.slips: list[Slip] = [*loads.slips, *laws.slips]
        self.owners = [
            None if feedback.slip is None else self._place(feedback) for feedback in self.feedbacks
        ]
        for k, slip in enumerate(self.slips[:-1]):
            one = slip.resting is not None and self.slips[k + 1].owner == slip.owner
            if one and not model.space.behind:
                self.sides.append((k, k + 1))
        self.steady: Wrench = add(*[mesh.steady for mesh in self.meshes.values()])
        self.assumptions: list[str] = laws.assumptions
        self.count: int = len(self.slips)
        signs = [slip.sign for slip in self.slips]
        self.locks: list[Sym] = [SX.sym(f"lock_{slip.owner}") for slip in self.slips]
        resting = [
            SX.sym(f"resting_{slip.owner}") if slip.resting is None else slip.resting
            for slip in self.slips
        ]
        self.signs: Sym = ca.vertcat(*signs, *self.locks, *resting) if signs else SX(0, 1)

    def _place(self, feedback: Feedback) -> int:
        return next(k for k, slip in enumerate(self.slips) if slip is feedback.slip)

    def _bearings(self, name: str) -> list[Feedback]:
        """Return what a real pair of wheels asks of its bearings beside its equation.

        Its size is the tangential force, with its sign. It does no work.
        """
        mesh = self.meshes[name]
        if mesh.column is None or self.model.space.behind:
            return []  # in space all follows from the forces of teeth themselves
        row = gradients(self.model.mesh_row(name).expression, self.model.q)[0]
        column = times(1 / mesh.tangential, add(row, times(-1, mesh.column)))
        return [Feedback(name, "largest", mesh.tangential, column, SX(0), friction=False)]

    @property
    def frictional(self) -> bool:
        """Whether any joint has friction."""
        return any(feedback.friction for feedback in self.feedbacks)

    @property
    def speeds(self) -> Sym:
        """Relative speeds over (q, velocity), (k,)."""
        return ca.vertcat(*[slip.speed for slip in self.slips]) if self.slips else SX(0, 1)

    @property
    def limits(self) -> tuple[Sym, Sym]:
        """Magnitudes of resistances along falling and growing coordinates, (k,), 0 for joints."""
        falls = [SX(0) if slip.falls is None else SX(slip.falls) for slip in self.slips]
        grows = [SX(0) if slip.grows is None else SX(slip.grows) for slip in self.slips]
        return ca.vertcat(*falls), ca.vertcat(*grows)
