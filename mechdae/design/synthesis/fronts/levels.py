"""Points of fronts, levels at which they are sought, and what is between two of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mechdae.design.synthesis.fronts.holes import by_logs
from mechdae.design.synthesis.ipopt import Optimum
from mechdae.design.synthesis.search import MOST, NO_LIMIT, PICK
from mechdae.types import Floats


@dataclass(frozen=True, eq=False)
class Point:
    """A feasible optimum: class, parameters of its NLP, terms (m,) of the objectives."""

    kind: int
    given: dict[str, Any]
    found: Optimum
    terms: Floats


@dataclass(frozen=True, eq=False)
class Level:
    """An objective that is as small as possible, and the most that each of them may be, (m,)."""

    primary: int
    most: Floats

    def allows(self, terms: Floats) -> bool:
        """Return whether objectives keep the level."""
        return bool((terms <= self.most + 1e-9 * (np.abs(self.most) + 1e-3)).all())

    @property
    def given(self) -> dict[str, Any]:
        """Values of the NLP's parameters."""
        pick = np.zeros(len(self.most))
        pick[self.primary] = 1.0
        return {PICK: pick, MOST: np.minimum(self.most, NO_LIMIT)}

    def missed(self, terms: Floats) -> float:
        """Return by how much objectives are above the level, relative to it."""
        gaps = np.maximum(terms - self.most, 0.0) / (np.abs(self.most) + 1e-300)
        return float(np.where(np.isfinite(gaps), gaps, 0.0).max())


@dataclass(frozen=True)
class FrontGap:
    """What is between two neighbours on a front: how wide, and from which level to which."""

    width: float
    low: float
    high: float

    @property
    def area(self) -> float:
        """What a point in it may add to the hypervolume at most."""
        return self.width * (self.high - self.low)


def spread(low: float, high: float, count: int) -> Floats:
    """Return values between two ends."""
    share = np.arange(1, count + 1) / (count + 1)
    if by_logs(low, high):
        return low * (high / low) ** share
    return low + (high - low) * share
