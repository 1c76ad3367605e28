"""When a given curve comes nearest to its targets: the globally best times.

An optimum of the NLP has times that cannot be moved a little; a target may still be nearer to
another stretch of the curve. Over places all along the curve the best times in order are found
by dynamic programming, for all first places at once, and closed in between the places.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.design.synthesis.trace import ROUNDS, ZOOM, Trace
from mechdae.types import Floats, Integers, Matrices

PLACES = 240
"""Places around a turn."""


def ordered(costs: Floats, worst: bool, closed: bool) -> tuple[float, Integers]:
    """Return the least total of targets visited one after the other, and their places.

    `costs` (n, k): of each target at each place of the curve, in the sense of the visits. `closed`:
    whether the last place is followed by the first one: any place may come first then.

    Returns
    -------
    total, places
        Places (k,) rise and span less than n; they go beyond n where the curve is closed.
    """
    n = len(costs)
    join = np.maximum if worst else np.add
    if not closed:
        best, last = _chain(costs[None], join, any_first=True)
        return float(best[0]), _traced(costs, last[0], join, any_first=True)
    rolled = costs[(np.arange(n)[:, None] + np.arange(n)) % n]
    best, last = _chain(rolled, join, any_first=False)
    first = int(np.argmin(best))
    return float(best[first]), first + _traced(rolled[first], last[first], join, any_first=False)


def _chain(costs: Matrices, join: Any, any_first: bool) -> tuple[Floats, Integers]:
    """Return least totals (m,) of costs (m, n, k) and the last places."""
    total = costs[:, :, 0].copy()
    if not any_first:
        total[:, 1:] = np.inf
    for j in range(1, costs.shape[2]):
        total = join(_before(total), costs[:, :, j])
    last = np.argmin(total, axis=1)
    return total[np.arange(len(total)), last], last


def _before(total: Floats) -> Floats:
    """Return the least of all earlier places."""
    least = np.minimum.accumulate(total, axis=1)
    return np.concatenate([np.full((len(total), 1), np.inf), least[:, :-1]], axis=1)


def _traced(costs: Floats, last: int, join: Any, any_first: bool) -> Integers:
    """Return the places of the best chain of costs (n, k) that ends in `last`."""
    n, k = costs.shape
    totals = [np.where(np.arange(n) < (n if any_first else 1), costs[:, 0], np.inf)]
    for j in range(1, k):
        totals.append(join(_before(totals[-1][None])[0], costs[:, j]))
    places = [int(last)]
    for j in range(k - 2, -1, -1):
        places.append(int(np.argmin(totals[j][: places[-1]])))
    return np.array(places[::-1])


def closed_in(trace: Trace, cost: Any, u: Floats, step: float) -> tuple[Floats, Floats]:
    """Return driver values of least cost within `step` of given ones, and their unknowns.

    ``cost`` (asked values (m, w), targets (m,)) -> (m,). Values stay on their side of the middle
    between neighbours, so that their order is kept.
    """
    k = len(u)
    gaps = np.abs(np.diff(u))
    room = np.minimum(np.append(gaps, np.inf), np.append(np.inf, gaps)) * 0.499
    low, high = u - np.minimum(step, room), u + np.minimum(step, room)
    shares = np.linspace(0, 1, ZOOM)
    targets = np.repeat(np.arange(k), ZOOM)
    best = np.array(u, float)
    for _ in range(ROUNDS):
        at = low[:, None] + shares * (high - low)[:, None]
        _, _, values, held = trace.poses(at.ravel())
        found = np.where(held, cost(values, targets), np.inf).reshape(k, ZOOM)
        best = at[np.arange(k), np.argmin(found, axis=1)]
        half = (high - low) / (ZOOM - 1)
        low, high = np.maximum(best - half, low), np.minimum(best + half, high)
    return best, trace.poses(best)[0]
