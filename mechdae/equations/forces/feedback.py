"""Sliding speeds, and forces whose size follows from the reactions of their own joint."""

from __future__ import annotations

from typing import Any

import casadi as ca

from mechdae.equations.forces.generalised import Wrench
from mechdae.records import dataclass
from mechdae.types import Floats, Sym

SX = ca.SX
ACROSS = ("across x", "across y", "across z")
"""Laws of the components of p t / |t| for the forms (p, t), t (3,): they may be negative."""


@dataclass(frozen=True)
class Slip:
    """A relative speed whose sign a force needs: expression of (q, v), unit "rad" or "m".

    ``falls`` and ``grows`` are the magnitudes of a resistance; ``resting`` is a symbol, 1 where
    ``friction_static`` takes the place of ``friction``. ``column`` is what a unit of the force or
    moment along it does in joints in space, as part of the joint's own reaction.

    A pair that glides in several directions has a slip for each of its `parts`, of one unit, one
    after the other; ``sign`` is then a component of the direction in which it starts, ``resting``
    1 where its speeds change along one line, and ``weight`` that of the square of a force that
    holds it.
    """

    owner: str
    speed: Sym
    unit: str
    sign: Sym
    falls: Sym | None = None
    grows: Sym | None = None
    resting: Sym | None = None
    column: Wrench | None = None
    part: int = 0
    parts: int = 1
    weight: Sym = 1.0


@dataclass(frozen=True)
class Unilateral:
    """A contact of a joint that pushes and does not pull: ``gap`` over q, unit "rad" or "m".

    The gap is not negative. ``column`` is its gradient, what a unit of the contact's force does;
    ``end`` tells the contacts of one joint apart, ``sign`` whether it pushes along what the joint
    measures. Its velocity may be held at zero like that of a slip. With friction it slides along
    ``axis`` at ``place``.
    """

    owner: str
    gap: Sym
    unit: str
    column: Wrench
    end: str
    sign: float = 1.0
    axis: Sym | None = None
    place: Sym | None = None


@dataclass(frozen=True)
class Feedback:
    """A force with a size that follows from its joint's multipliers.

    Attributes
    ----------
    joint
        Its joint.
    law
        "length" (of the vector of forms), "largest" (of the forms, one of them is never
        negative) or one of `ACROSS`.
    forms : SX (k, n)
        The linear forms over the joint's n multipliers in the order of its rows.
    column : dict
        Generalised force per unit of size.
    rate : SX
        Power lost per unit of size.
    friction
        Whether it vanishes without friction.
    strength
        Coefficient, or radius of the friction circle: force or moment per unit of size.
    falling
        The same where the speed is negative, None if it does not depend on that.
    needs : SX (k, n) or None
        The forms that have to be unique where constraints are redundant, without speeds; None:
        ``forms``.
    slip
        The speed whose sign the force has; None for a force that is no friction.
    contact
        The unilateral contact whose force the forms are over, in place of the joint's multipliers.
    """

    joint: str
    law: str
    forms: Sym
    column: Wrench
    rate: Sym
    friction: bool = True
    strength: Sym = 0.0
    falling: Sym | None = None
    slip: Slip | None = None
    needs: Any = None
    contact: int | None = None

    def idle(self, p: Sym, values: Floats) -> bool:
        """Return whether it is nothing for these numbers: a coefficient or a radius of zero."""
        found = ca.substitute(SX(self.strength), p, ca.DM(values))
        return bool(ca.simplify(found).is_zero())
