"""A design between the poses that an NLP knows: any value of the driver, and extremes there.

Nodes see a curve only where they are. Between them the poses follow from Newton's method with
the neighbouring nodes as guesses, many at once; extremes are bracketed on a grid and closed in.
What is found here moves nodes and chooses where certified sweeps look; it certifies nothing.

An optimum of the NLP has times that cannot be moved a little; a target may still be nearer to
another stretch of the curve. Over places all along the curve the best times in order are found
by dynamic programming, for all first places at once, and closed in between the places.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from mechdae.design.synthesis.nlp import NewValues, Values
from mechdae.design.synthesis.poses import dimensions
from mechdae.design.synthesis.space import TURN, WATCHED
from mechdae.design.synthesis.starts.spread import CLOSED, Spread
from mechdae.motion.measures.transmission import Dyad
from mechdae.types import Booleans, Floats, Integers, Matrices, Matrix, Unknowns

STEPS = 6
"""Newton steps from a guess between two nodes."""
ZOOM, ROUNDS = 9, 4
"""Places in a bracket, and how often it is narrowed to the neighbours of the best of them."""
FINE = 8
"""Places of the first grid for each node."""
MET = 1e-6
"""Share by which an extreme may exceed what the nodes see."""
Curve = Callable[[Any], Any]
"""places (m,) -> values (m,), nan where there is none."""
PLACES = 240
"""Places around a turn."""
SEEN = 1e-9
"""What the sine of an angle may fall below its limit between the poses of the NLP."""


class Trace:
    """Poses of one design along its driver.

    `d`: free and chosen parameters (nd,). `u`, `x`: driver values (k,) and unknowns (k, nx) of
    known poses on one branch.
    """

    def __init__(self, spread: Spread, d: Floats, u: Floats, x: Unknowns) -> None:
        order = np.argsort(u, kind="stable")
        self.spread, self.d = spread, np.asarray(d, float)
        self.u, self.x = np.asarray(u, float)[order], np.asarray(x, float)[order]
        signs = spread.poses.function(self.x[0], self.u[0], self.d)[1]
        self.sigma: Floats = np.sign(np.array(signs).ravel())

    def poses(self, u: Floats) -> tuple[Matrix, Matrix, Matrix, Booleans]:
        """Return unknowns (m, nx), branches, asked values, and which poses (m,) are reached."""
        u = np.asarray(u, float)
        x = np.zeros((len(u), self.x.shape[1]))
        for k, column in enumerate(self.x.T):
            x[:, k] = np.interp(u, self.u, column)
        d = np.broadcast_to(self.d, (len(u), len(self.d)))
        guess = x
        with np.errstate(all="ignore"):
            for _ in range(STEPS):
                x = np.nan_to_num(self.spread.newton(x, u[:, None], d)[0], posinf=0, neginf=0)
            # a step near a dead point may go round: whole turns are those of the neighbours
            x = x + np.where(
                self.spread.poses.scene.unknowns.turns, TURN * np.round((guess - x) / TURN), 0.0
            )
            _, F, branch, values = self.spread.newton(x, u[:, None], d)
        held = np.abs(F).max(axis=1, initial=0.0) <= CLOSED
        held &= (np.sign(branch) == self.sigma).all(axis=1)
        return x, branch, values, held


def around(spread: Spread, d: Floats, u: float, x: Any, count: int) -> tuple[Trace, bool]:
    """Return a design followed both ways from a pose, and whether it turns fully."""
    ahead, whole = spread.reached(d, x, u + TURN * np.arange(1, count + 1) / count, u)
    if whole:
        ahead = ahead[:-1]
        places = u + TURN * np.arange(count) / count
        return Trace(spread, d, places, np.concatenate([[x], ahead])), True
    back, _ = spread.reached(d, x, u - TURN * np.arange(1, count + 1) / count, u)
    places = u + TURN * np.arange(-len(back), len(ahead) + 1) / count
    poses = np.vstack([back[::-1].reshape(-1, len(x)), x, ahead.reshape(-1, len(x))])
    return Trace(spread, d, places, poses), False


def maxima(curve: Curve, grid: Floats) -> tuple[Floats, Floats]:
    """Return places and values of the local maxima of a curve over a grid, its ends among them."""
    grid = np.asarray(grid, float)
    values = np.nan_to_num(curve(grid), nan=-np.inf)
    before, after = np.append(-np.inf, values[:-1]), np.append(values[1:], -np.inf)
    tops = np.flatnonzero((values >= before) & (values >= after) & np.isfinite(values))
    if not len(tops):
        return np.zeros(0), np.zeros(0)
    last = len(grid) - 1
    low, high = grid[np.maximum(tops - 1, 0)], grid[np.minimum(tops + 1, last)]
    best, place = values[tops], grid[tops]
    shares = np.linspace(0, 1, ZOOM)
    for _ in range(ROUNDS):
        at = low[:, None] + shares * (high - low)[:, None]
        found = np.nan_to_num(curve(at.ravel()), nan=-np.inf).reshape(at.shape)
        rows, k = np.arange(len(tops)), np.argmax(found, axis=1)
        better = found[rows, k] > best
        place = np.where(better, at[rows, k], place)
        best = np.maximum(best, found[rows, k])
        half = (high - low) / (ZOOM - 1)
        low, high = np.maximum(place - half, low), np.minimum(place + half, high)
    return place, best


def grid_of(nodes: Floats) -> Floats:
    nodes = np.sort(np.asarray(nodes, float))
    parts = nodes[:-1, None] + np.diff(nodes)[:, None] * np.arange(FINE) / FINE
    return np.append(parts.ravel(), nodes[-1])


def moved(nodes: Floats, places: Any, values: object, held: object) -> Any:
    """Return nodes of which the nearest stand on given places, the largest values first."""
    nodes = np.array(nodes, float)
    free = ~np.asarray(held, bool)
    for i in np.argsort(-np.asarray(values), kind="stable"):
        k = int(np.argmin(np.abs(nodes - places[i])))
        if free[k]:
            nodes[k] = places[i]
            free[k] = False
    return nodes


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


def watched(spread: Spread, d: Floats, u: Floats, x: Unknowns) -> tuple[Floats, Floats, Floats]:
    """Return where the watched transmission angles of a design are least.

    `d`, `u`, `x`: parameters, driver values (k,) over a turn and unknowns (k, nx) there.

    Returns
    -------
    u, x, least
        ``WATCHED`` driver values and their unknowns for each dyad that is watched, and the
        least sine of each.
    """
    space = spread.space
    trace = Trace(spread, d, u, x)
    grid = grid_of(np.append(trace.u, trace.u[0] + TURN))
    places, least = [], []
    for dyad in space.watched_dyads:
        at, tops = maxima(partial(_negative, trace, dyad), grid)
        order = np.argsort(-tops, kind="stable")[:WATCHED]
        least.append(float(-tops[order[0]]) if len(order) else np.nan)
        spare = trace.u[0] + TURN * (np.arange(WATCHED - len(order)) + 0.5) / WATCHED
        places.append(np.concatenate([at[order], spare]))
    nodes = np.concatenate(places) if places else np.zeros(0)
    return nodes, trace.poses(nodes)[0], np.array(least)


def _negative(trace: Trace, dyad: Dyad, u: Floats) -> Floats:
    return -sines(trace, dyad, u)


def sines(trace: Trace, dyad: Dyad, u: Floats) -> Floats:
    """Return the sine of a transmission angle (m,), nan where a pose is not reached."""
    poses = trace.spread.poses
    _, branch, values, held = trace.poses(u)
    k = poses.branch_of(dyad)
    sine = np.abs(poses.sine_of(dyad, values) if k is None else branch[:, k])
    return np.where(held, sine, np.nan)


def fallen(spread: Spread, values: Values, given: Values) -> NewValues | None:
    """Return poses and driver values that see the least angles, None where they are seen."""
    space = spread.space
    if not space.watched_dyads or not space.asked.full_turn:
        return None
    whole = np.reshape(values["turn"], (-1, max(space.poses.nx, 1)))
    d = dimensions(values["d"], given)
    unknowns, x, least = watched(spread, d, space.circle, whole[: space.NODES])
    bounds = np.array([np.sin(limit.min) for limit in space.watched_limits])
    if not (least < bounds - SEEN).any():
        return None
    return {"turn": np.concatenate([whole[: space.NODES], x])}, {"watched": unknowns}
