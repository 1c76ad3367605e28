"""Holes of fronts, and the levels at which a point is sought in them."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from mechdae.numerics.dominance import undominated
from mechdae.records import dataclass
from mechdae.types import Floats

WIDE = 30.0
"""Ratio of the ends of a positive objective from which it is measured by logs."""
HOLE = 3.0
"""A gap between neighbours is a hole from so many even gaps of the levels that are asked for."""


@dataclass(frozen=True)
class FrontHole:
    """Two neighbours on a front that are far apart: no other point is in the ball between them.

    ``width``: share of the front's range, of the objective in which they are further apart.
    ``primary``: the objective in which they are nearest to each other.
    """

    first: Floats
    last: Floats
    width: float
    primary: int
    middle: Floats


def by_logs(low: float, high: float) -> bool:
    """Return whether an objective between two ends is measured by its logarithm."""
    return low > 0 and high > WIDE * low


def holes(terms: Floats, keep: int) -> list[FrontHole]:
    """Return the holes among objectives (n, m), of which less is better, the widest first."""
    values = np.asarray(terms, float)
    values = values[undominated(values)]
    values = values[np.lexsort(values.T[::-1])]
    count = values.shape[1]
    if len(values) < 2:
        return []
    logs = np.array([by_logs(objective.min(), objective.max()) for objective in values.T])
    scaled = np.where(logs, np.log(np.where(logs, values, 1.0)), values)
    span = np.ptp(scaled, axis=0)
    places = scaled / np.where(span > 0, span, np.inf)
    squares = np.sum((places[:, None] - places) ** 2, axis=2)
    even = round(max(keep - count, 0) ** (1 / (count - 1))) + 1
    found = []
    for i, j in combinations(range(len(values)), 2):
        share = np.abs(places[j] - places[i])
        between = squares[i] + squares[j] < squares[i, j]
        if share.max() * even > HOLE and not between.any():
            middle = (scaled[i] + scaled[j]) / 2
            middle = np.where(logs, np.exp(np.where(logs, middle, 0.0)), middle)
            primary = count - 1 - int(np.argmin(share[::-1]))
            found.append(FrontHole(values[i], values[j], float(share.max()), primary, middle))
    return sorted(found, key=lambda hole: -hole.width)
