"""Holes of fronts of two objectives, and the levels at which a point is sought in them."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from mechdae.numerics.dominance import undominated
from mechdae.records import dataclass

WIDE = 30.0
"""Ratio of the ends of a positive objective from which it is measured by logs."""
HOLE = 3.0
"""A gap between neighbours is a hole from so many even gaps of the front that is asked for."""


@dataclass(frozen=True)
class FrontHole:
    """Two neighbours on a front that are far apart.

    Attributes
    ----------
    first, last : (2,) arrays
        Least in the first objective, and in the second.
    width
        Share of the front's range, of the objective in which they are further apart.
    bounded, middle
        That objective, and its value halfway.
    """

    first: Any
    last: Any
    width: float
    bounded: int
    middle: float


def by_logs(low: float, high: float) -> bool:
    """Return whether an objective between two ends is measured by its logarithm."""
    return low > 0 and high > WIDE * low


def holes(terms: Any, keep: int) -> list[FrontHole]:
    """Return the holes among objectives (n, 2), of which less is better, the widest first."""
    values = np.asarray(terms, float)
    values = values[undominated(values)]
    values = values[np.lexsort((values[:, 1], values[:, 0]))]
    if len(values) < 2:
        return []
    logs = [by_logs(own.min(), own.max()) for own in values.T]
    scaled = np.stack([np.log(v) if log else v for v, log in zip(values.T, logs, strict=True)], 1)
    span = np.ptp(scaled, axis=0)
    found = []
    for k, _ in pairwise(range(len(values))):
        share = np.abs(scaled[k + 1] - scaled[k]) / np.where(span > 0, span, np.inf)
        own = int(np.argmax(share))
        if share[own] * max(keep - 1, 1) > HOLE:
            middle = (scaled[k, own] + scaled[k + 1, own]) / 2
            middle = float(np.exp(middle)) if logs[own] else float(middle)
            found.append(FrontHole(values[k], values[k + 1], float(share[own]), own, middle))
    return sorted(found, key=lambda hole: -hole.width)
