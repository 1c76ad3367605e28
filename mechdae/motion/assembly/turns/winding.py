"""How far one unwrapped angle can be from zero where a single equation holds it: racks, screws.

F(y + k P) = F(y) + k G(y) + k^2 A with P the period of the sines and cosines in it: on a rack A is
zero and G constant; where a screw leads one end of a length along, A is constant. So there is no
solution in turn k once |A| k^2 > |F| + |k| |G|, or |k| |G| > |F|, by the largest |F| and |G| of a
turn.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

GRID = 64
SAME = 1e-10
"""Share of the largest value within which differences from turn to turn are the same: they are
sums of a few sines, which cannot agree at all places of the grid and be others between."""


def turns_at_most(
    values: Callable[[Any], tuple[Any, Any]], period: float, bend: float = 0.0
) -> float:
    """Return beyond how many periods from zero F has no solution; infinite where that is not known.

    Parameters
    ----------
    values
        Gives F (n,) and its derivative (n,) at angles (n,) [rad].
    period
        Of the sines and cosines in F [rad].
    bend
        Bound of |F''|; with it the answer is certain, without it that of the grid.
    """
    grid = np.linspace(0, period, GRID + 1)
    step = period / GRID
    F, J = zip(*(values(grid + k * period) for k in (-1, 0, 1, 2)), strict=True)
    margin = np.abs(J[1]) * step / 2 + bend * step * step / 8
    most = float((np.abs(F[1]) + margin).max())
    grow, slope = (F[2] - F[0]) / 2, (J[2] - J[0]) / 2
    curve = F[2] - 2 * F[1] + F[0]
    third = F[3] - 3 * F[2] + 3 * F[1] - F[0]
    noise = SAME * max(float(np.abs(residual).max()) for residual in F)
    if not np.isfinite(noise) or np.abs(third).max() > noise or np.ptp(curve) > noise:
        return math.inf
    if np.abs(curve).max() > noise:
        a = float(np.abs(curve).min()) / 2
        b = float((np.abs(grow) + np.abs(slope) * step / 2).max()) + bend * step * step / 8
        return (b + math.sqrt(b * b + 4 * a * most)) / (2 * a)
    if np.ptp(grow) > noise or np.abs(grow).min() <= noise:
        return math.inf
    return most / float(np.abs(grow).min())
