"""Starts for any mechanism: dimensions drawn evenly, moved over the programme all at once.

Each sample is assembled at the first value of the driver by Newton's method from random
unknowns, and follows the driver with the last pose as the next guess; samples that lose their
closure or whose determinants change sign are dropped.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from mechdae.kernels.batch import Batch
from mechdae.kernels.straight import straight
from mechdae.synthesis.poses import Poses

SX = ca.SX
FIRST, NEXT = 14, 4
"""Newton steps of the first pose, and of each that follows."""
CLOSED = 1e-9
"""Share of the mechanism by which a pose may be open."""


class Spread:
    """Random designs of a mechanism with their poses.

    Parameters
    ----------
    poses
        Of the mechanism.
    size
        A length of the mechanism [m].
    """

    def __init__(self, poses: Poses, size: float) -> None:
        self.poses, self.size = poses, size
        g = poses.graphs
        d = SX.sym("d", len(poses.free))
        F, branch, values = poses.function(g.x, g.u, d)
        step = ca.solve(ca.jacobian(F, g.x), F) if poses.nx else SX(0, 1)
        function = ca.Function(
            "step", [g.x, g.u, d], [g.x - step, F, ca.densify(branch), ca.densify(values)],
            {"cse": True},
        )  # fmt: skip
        self._step = Batch(function, (), straight=lambda: straight(function))
        self.lengths = np.array([name not in ("angle", "s") for _, name in poses.x_names])

    def moved(self, d: Any, u: Any, generator: Any) -> tuple[Any, Any, Any, Any]:
        """Return which samples hold, their poses (n, k, nx), branches (n, nb), values (n, k, m).

        `d` (n, nd) are dimensions, `u` (n, k) the driver's values.
        """
        n, k = u.shape
        x = generator.uniform(-np.pi, np.pi, (n, self.poses.nx))
        x[:, self.lengths] *= self.size
        held = np.ones(n, bool)
        places, signs, values = [], None, []
        with np.errstate(all="ignore"):
            for i in range(k):
                for _ in range(NEXT if i else FIRST):
                    x = np.nan_to_num(self._step(x, u[:, i : i + 1], d)[0], posinf=0, neginf=0)
                _, F, branch, value = self._step(x, u[:, i : i + 1], d)
                held &= np.abs(F).max(axis=1, initial=0.0) <= CLOSED * self.size
                sign = np.sign(branch)
                signs = sign if signs is None else signs
                held &= (sign == signs).all(axis=1)
                places.append(x)
                values.append(value)
        return held, np.stack(places, axis=1), signs, np.stack(values, axis=1)


def drawn(generator: Any, bounds: Any, count: int) -> Any:
    """Return dimensions (count, nd) within bounds (nd, 2), in a scrambled even sequence.

    Positive ranges over more than a decade are drawn by their logarithm.
    """
    low, high = np.asarray(bounds, float).T
    share = generator.random((count, len(low)))
    wide = (low > 0) & (high > 10 * low)
    even = low + share * (high - low)
    with np.errstate(all="ignore"):
        logs = np.exp(np.log(low) + share * (np.log(high) - np.log(low)))
    return np.where(wide, logs, even)
