"""What plain balances ask of joints whose equation does not tell their forces: teeth and belts."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Protocol

from mechdae.equations.forces.generalised import Wrench
from mechdae.types import Sym


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
