"""A design between the poses that an NLP knows: any value of the driver, and extremes there.

Nodes see a curve only where they are. Between them the poses follow from Newton's method with
the neighbouring nodes as guesses, many at once; extremes are bracketed on a grid and closed in.
What is found here moves nodes and chooses where certified sweeps look; it certifies nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mechdae.design.synthesis.space import TURN
from mechdae.design.synthesis.starts.spread import CLOSED, Spread
from mechdae.types import Floats, Unknowns

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
        self.sigma = np.sign(np.array(signs).ravel())

    def poses(self, u: Floats) -> tuple[Any, Any, Any, Any]:
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
    """Return a design followed both ways from a pose, and whether it turns fully.

    What a full turn passes is there once; else all that is reached before the closure opens.
    """
    ahead, whole = spread.reached(d, x, u + TURN * np.arange(1, count + 1) / count, u)
    if whole:
        ahead = ahead[:-1]
        places = u + TURN * np.arange(count) / count
        return Trace(spread, d, places, np.concatenate([[x], ahead])), True
    back, _ = spread.reached(d, x, u - TURN * np.arange(1, count + 1) / count, u)
    places = u + TURN * np.arange(-len(back), len(ahead) + 1) / count
    parts = [back[::-1].reshape(-1, len(x)), [x], ahead.reshape(-1, len(x))]
    return Trace(spread, d, places, np.concatenate(parts)), False


def maxima(curve: Curve, grid: Floats) -> tuple[Any, Any]:
    """Return places and values of the local maxima of a curve over a grid, its ends among them.

    Each is closed in from the neighbours of a point of the grid that none of them exceeds.
    """
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
    """Return places between nodes, and the nodes."""
    nodes = np.sort(np.asarray(nodes, float))
    parts = nodes[:-1, None] + np.diff(nodes)[:, None] * np.arange(FINE) / FINE
    return np.append(parts.ravel(), nodes[-1])


def moved(nodes: Floats, places: Any, values: Any, held: Any) -> Any:
    """Return nodes of which the nearest stand on given places, the largest values first.

    Nodes that are `held` stay; a node moves once, by less than to its neighbours.
    """
    nodes = np.array(nodes, float)
    free = ~np.asarray(held, bool)
    for i in np.argsort(-np.asarray(values), kind="stable"):
        k = int(np.argmin(np.abs(nodes - places[i])))
        if free[k]:
            nodes[k] = places[i]
            free[k] = False
    return nodes
