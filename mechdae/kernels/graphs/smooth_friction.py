"""Right-hand side with smoothed dry friction: tanh(speed / slope speed) takes the place of a sign.

All functions of the kernel are built with it; what remains of the inputs of friction are the
locks, by which the force that would hold a pair is measured.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from mechdae.equations.structure_cache import structure_property
from mechdae.kernels.graphs.equations_of_motion import Kernel
from mechdae.kernels.run.functions import without_repeats
from mechdae.types import Graph, Sym


class Smooth(Kernel):
    """As `Kernel`; the slope speeds are among the numbers."""

    @structure_property
    def sides(self) -> Graph:
        """(t, x, v, signs, c) -> what takes the place of the signs, (slips,)."""
        return self.function("sides", [self._smoothed[: self.released.rubbing.count]])

    @structure_property
    def _smoothed(self) -> Sym:
        """Inputs of friction over (t, x, v), locks and numbers."""
        count = self.released.rubbing.count
        smooth = ca.tanh(ca.densify(self.released.slips) / self.given["widths"])
        return ca.vertcat((1 - self.signs[count : 2 * count]) * smooth, self.signs[count:])

    def function(self, name: str, results: Sequence[Sym], more: Sequence[Sym] = ()) -> Graph:
        """Return the function (t, x, v, signs, ..., c) with smoothed signs put in."""
        at = [self.t, self.x, self.v, self.signs, *more, self.c]
        general = ca.Function(name, at, list(results))
        smoothed = [self.t, self.x, self.v, self._smoothed, *more, self.c]
        return without_repeats(name, at, general.call(smoothed))
