"""Adaptive Gauss-Kronrod quadrature of several functions at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mechdae.records import dataclass
from mechdae.types import Floats

_HALF = (
    (0.99145537112081263921, 0.022935322010529224964, 0.0),
    (0.94910791234275852453, 0.063092092629978553291, 0.12948496616886969327),
    (0.86486442335976907279, 0.10479001032225018384, 0.0),
    (0.74153118559939443986, 0.14065325971552591875, 0.2797053914892766679),
    (0.58608723546769113029, 0.16900472663926790283, 0.0),
    (0.40584515137739716691, 0.19035057806478540991, 0.38183005050511894495),
    (0.2077849550078984676, 0.20443294007529889241, 0.0),
)
_MIDDLE = ((0.0, 0.20948214108472782801, 0.41795918367346938776),)
_RULE = np.array([*[(-x, k, g) for x, k, g in _HALF], *_MIDDLE, *reversed(_HALF)])
PLACES, KRONROD, GAUSS = (_RULE[:, 0] + 1) / 2, _RULE[:, 1] / 2, _RULE[:, 2] / 2
"""Nodes on [0, 1] and weights of the rules with 15 and 7 nodes."""
HALVINGS = 40
MOST = 5_000
"""Panels that are halved at once: where there are more it is rounding that differs."""
TOLERANCE = 1e-11
"""Share of a function's size that the first panels together may contribute to its error."""
NOISE = 1e-12
"""Share of the largest integral below which a difference that halving does not shrink is
rounding."""
SHRINKS = 0.2
"""Share of its panel's difference that a half has at least where the function has a kink."""


@dataclass(frozen=True)
class Substitution:
    """An interval [low, high] over t in [0, 1]; quadratic at an end where rates are infinite."""

    low: float
    high: float
    fold: int = 0
    """-1: a limit position at the low end, 1: at the high end."""

    def place(self, t: Floats) -> tuple[Floats, Floats]:
        """Return s(t) and ds/dt."""
        width = self.high - self.low
        if self.fold < 0:
            return self.low + width * t * t, 2 * width * t
        if self.fold > 0:
            return self.high - width * (1 - t) * (1 - t), 2 * width * (1 - t)
        return self.low + width * t, width + 0 * t


def integrate(
    function: Callable[[Any], Any],
    charts: list[Substitution],
    size: Callable[[Any], Any],
    gross: Callable[[Any], Any] | None = None,
) -> tuple[Any, Any]:
    """Return the integrals (m,) of functions over all charts and estimates of their errors.

    `function`: from places (n,) to values (n, m). `size`: from the integrals so far to what the
    error of each is compared with, (m,). `gross`: from the integrals so far to the size of the
    numbers from which each function is computed, (m,): their rounding is no error that halving
    could mend; `size` if left out. Panels are halved until the rules of 7 and 15 nodes agree; the
    estimate is the sum of their differences, far above the true error of the finer rule.
    """
    panels = [(chart, 0.0, 1.0) for chart in charts]
    total: float = 0.0
    error: float = 0.0
    allowed: Any = None
    noise: Any = None
    before: Any = np.inf
    for halving in range(HALVINGS + 1):
        if not panels:
            break
        places, weights = [], []
        for chart, a, b in panels:
            s, slope = chart.place(a + (b - a) * PLACES)
            places.append(s)
            weights.append(slope * (b - a))
        values = function(np.concatenate(places)) * np.concatenate(weights)[:, None]
        values = values.reshape(len(panels), len(PLACES), -1)
        fine = np.einsum("pkm,k->pm", values, KRONROD)
        gap = np.abs(fine - np.einsum("pkm,k->pm", values, GAUSS))
        if allowed is None:
            first = fine.sum(axis=0)
            allowed = TOLERANCE / len(charts) * size(first)
            noise = NOISE * (size(first) if gross is None else gross(first))
        with np.errstate(invalid="ignore"):
            rounding = (gap <= noise) & (gap > SHRINKS * before)
            again = ((gap > allowed) & ~rounding).any(axis=1) & (halving < HALVINGS)
            again &= again.cumsum() <= MOST
        total = total + fine[~again].sum(axis=0)
        error = error + gap[~again].sum(axis=0)
        left = np.flatnonzero(again)
        panels = [(panels[p][0], *part) for p in left for part in _halves(*panels[p][1:])]
        before = np.repeat(gap[left], 2, axis=0)
    return total, error


def _halves(a: float, b: float) -> tuple[tuple[float, float], tuple[float, float]]:
    return (a, (a + b) / 2), ((a + b) / 2, b)
