"""Two branches that nearly meet, and do not for the numbers given.

Next to a crossing of a block, x = x* + t0 (s - s*) + a v with the null vector v, the equations are

    A a^2 + 2 B a e + C e^2 + 2 r = 0,    e = (s - s*) / unit,

with the residual r of the crossing (see `change_points`). For A r < 0 each branch goes on past
the place, from the one asymptote to the other; for A r > 0 both turn back at e = -+e0.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.records import dataclass
from mechdae.types import Floats

LEAST = 1e-12
"""Distance of the branches down to which they are told apart [rad, lengths of the mechanism]."""
INNER = 1e-5
"""Radians of the driver, or lengths, within which poses come from the expansion."""


@dataclass(frozen=True, eq=False)
class Missed:
    """Branches that do not meet: ``A``, ``B``, ``C``, the residual ``r``.

    ``tangent`` (n,) is t0, ``v`` (n,) the null vector; ``unit`` that of the driver.
    """

    A: float
    B: float
    C: float
    r: float
    tangent: Floats
    v: Floats
    unit: float

    @property
    def passes(self) -> bool:
        """Whether each branch goes on past the place; else it turns back before."""
        return self.A * self.r < 0

    @property
    def _root(self) -> float:
        return self.B * self.B - self.A * self.C

    @property
    def across(self) -> float:
        """Distance of the branches along ``v`` where they pass each other."""
        return 2 * float(np.sqrt(abs(2 * self.r / self.A)))

    def side(self, slope: Floats, sense: float) -> float:
        """Return the sign of A a + B e on the branch that comes in along a `slope` (n,) of x."""
        along = float((slope - self.tangent) @ self.v / (self.v @ self.v)) * self.unit
        return -sense * float(np.sign(self.A * along + self.B))

    def from_asymptote(self, ds: Floats, side: float, order: int) -> Any:
        """Return a on a branch less that on its asymptote, or a derivative by s.

        `side` is the sign of the branch, that of A a + B e; `ds` (n,) are places from the crossing.
        """
        e, k = np.asarray(ds, float) / self.unit, self._root
        q = -2 * self.A * self.r
        root = np.sqrt(k * e * e + q)
        far = np.sqrt(k) * np.abs(e)
        if order == 0:
            value = q / (root + far)
        elif order == 1:
            value = k * e / root - np.sqrt(k) * np.where(e < 0, -1.0, 1.0)
        else:
            value = k * q / root**3
        return side * value / self.A / self.unit**order

    def turning(self, sense: float) -> tuple[float, Floats]:
        """Return s - s* and x - x* (n,) where the branches coming in a sense turn back."""
        e = -sense * float(np.sqrt(2 * self.A * self.r / self._root))
        return e * self.unit, self.tangent * e * self.unit - self.B * e / self.A * self.v
