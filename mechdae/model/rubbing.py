"""Speeds that dry friction may hold at zero, and the forces that do it.

Each slip has three inputs that are fixed between events: the sign of its speed (0 for none),
whether it is locked, and whether its coefficient is the one at rest. A locked slip is a constraint
on its speed; the multiplier is the force of friction that holds it.
"""

from __future__ import annotations

from typing import Any

import casadi as ca

from mechdae.model.friction import Feedback, Laws, Slip
from mechdae.model.loads import Loads
from mechdae.model.model import Model

SX = ca.SX
COMPUTED = ("revolute", "prismatic", "curve")
"""Kinds of joints whose friction is computed in motion: one slip, one place of contact."""


class Rubbing:
    """The slips of a mechanism in motion: those of resistances, then those of joints.

    Attributes
    ----------
    slips : list of Slip
    feedbacks : list of Feedback
        Forces that follow from multipliers, each of one slip.
    owners : list of int
        Place of the slip of each feedback.
    signs : SX (3 k,)
        Signs, locks, and whether coefficients at rest count.
    """

    def __init__(self, model: Model, loads: Loads, friction: bool) -> None:
        self.model = model
        laws = Laws(model, {}, friction=friction, adhesion=True)
        laws.factor = SX(1)
        self.feedbacks: list[Feedback] = []
        self.slips: list[Slip] = list(loads.slips)
        self.owners: list[int] = []
        resting = [SX.sym(f"resting_{slip.owner}") for slip in self.slips]
        for name, joint in model.mechanism.joints.items():
            found = laws.of(name) if joint.kind in COMPUTED else []
            for feedback in found:
                self.owners.append(len(self.slips))
                self.feedbacks.append(feedback)
                self.slips.append(laws.slips[len(self.feedbacks) - 1])
                resting.append(laws.resting[name])
        self.assumptions = laws.assumptions
        self.count = len(self.slips)
        signs = [slip.sign for slip in self.slips]
        self.locks = [SX.sym(f"lock_{slip.owner}") for slip in self.slips]
        self.signs = ca.vertcat(*signs, *self.locks, *resting) if signs else SX(0, 1)

    @property
    def speeds(self) -> Any:
        """Relative speeds over (q, velocity), (k,)."""
        return ca.vertcat(*[slip.speed for slip in self.slips]) if self.slips else SX(0, 1)

    @property
    def limits(self) -> tuple[Any, Any]:
        """Magnitudes of resistances along falling and growing coordinates, (k,), 0 for joints."""
        falls = [SX(0) if slip.falls is None else SX(slip.falls) for slip in self.slips]
        grows = [SX(0) if slip.grows is None else SX(slip.grows) for slip in self.slips]
        return ca.vertcat(*falls), ca.vertcat(*grows)
