"""Why a pose has no values: its group stays open, its equations lose rank, or no proof holds."""

from __future__ import annotations

import numpy as np

from mechdae.kernels.graphs.steps import Graphs
from mechdae.motion.setup.scales import Constants
from mechdae.records import dataclass
from mechdae.results.status import Cause
from mechdae.types import Floats, Integers, Json, Unknowns

RANK = 1e-6
"""Least singular value by the largest below which equations are said to lose rank."""
HOLDS = 1e-9
"""Residual of a pose, in sizes of the mechanism and radians."""
ITERATIONS = 40


@dataclass(frozen=True)
class Reason:
    """A cause, and the least singular value by the largest of the equations met there."""

    cause: Cause
    least: float = np.nan

    def entry(self) -> Json:
        """Return it as results hold it."""
        if self.cause is Cause.OPEN:
            return {}
        return {"cause": str(self.cause), "least_singular_value": self.least}


def reason(
    graphs: Graphs, constants: Constants, x: Unknowns, u: Floats, blocks: Integers | range
) -> Reason:
    """Return why some `blocks` have no certified pose near unknowns `x` (nx,) at drivers `u`.

    That is asked of the equations in the units of the mechanism, without any bounds.
    """
    x, p, least = np.array(x, float), constants.p, np.inf
    columns, rows = graphs.units(constants.scale, p)
    for b in blocks:
        graph, w, r = graphs.blocks[b], columns[b], rows[b]
        for _ in range(ITERATIONS):
            F, J, _ = graph.value_at(x, u, p)
            if not (np.isfinite(F).all() and np.isfinite(J).all()):
                return Reason(Cause.OPEN)
            step = np.linalg.lstsq(J / r[:, None] * w, F / r, rcond=1e-12)[0]
            x[graph.own] -= step * w * min(1.0, 0.5 / max(np.abs(step).max(initial=0.0), 0.5))
            if np.abs(step).max(initial=0.0) < 1e-15:
                break
        F, J, _ = graph.value_at(x, u, p)
        sigma = np.linalg.svd(J / r[:, None] * w, compute_uv=False)
        if not np.linalg.norm(F / r) < HOLDS:
            return Reason(Cause.OPEN)
        least = min(least, float(sigma[-1] / sigma[0]))
    return Reason(Cause.RANK if least < RANK else Cause.CERTIFICATE, least)
