"""Right-hand side with smoothed dry friction: tanh(speed / slope speed) takes the place of a sign.

All functions of the kernel are built with it; what remains of the inputs of friction are the
locks, by which the force that would hold a pair is measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import casadi as ca

from mechdae.kernels.graphs.equations_of_motion import Kernel
from mechdae.model.motion_equations import Released

SX = ca.SX


class Smooth(Kernel):
    """As `Kernel`.

    Parameters
    ----------
    released, p, sizes, length
        As `Kernel`.
    widths
        Slope speed of each slip, in its unit.
    """

    def __init__(self, released: Released, p: Any, sizes: Any, length: float, widths: Any) -> None:
        super().__init__(released, p, sizes, length)
        self.widths = widths

    @cached_property
    def sides(self) -> Any:
        """(t, x, v, signs) -> what takes the place of the signs, (slips,)."""
        return self.function("sides", [self._inputs[: self.slips]])

    @cached_property
    def _inputs(self) -> Any:
        """Inputs of friction over (t, x, v), locks and p."""
        locks = self.signs[self.slips : 2 * self.slips]
        smooth = ca.tanh(ca.densify(self.released.slips) / ca.DM(self.widths))
        return ca.vertcat((1 - locks) * smooth, self.signs[self.slips :])

    def function(self, name: str, results: Sequence[Any], more: Sequence[Any] = ()) -> Any:
        """Return the function (t, x, v, signs, ...) with smoothed signs put in."""
        at = [self.t, self.x, self.v, self.signs, *more]
        p = self.released.model.p
        general = ca.Function(name, [*at, p], list(results))
        smoothed = [self.t, self.x, self.v, self._inputs, *more]
        found = ca.Function(name, [*at, p], general.call([*smoothed, p]))
        return ca.Function(name, at, found.call([*at, self.p]), {"cse": True})
