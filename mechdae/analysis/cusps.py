"""Poses at which two branches of a block meet with one tangent and the motion turns back.

Near a singular pose the block's equations reduce to A alpha^2 + e(s) = 0 (Lyapunov and
Schmidt), e(s) being the least load that makes the pose at s singular. A simple zero of e is
a limit position, a double one a change point; an odd higher one is a cusp of the motion:
both branches come to it with one tangent and none goes on. e is smooth on both sides of
its zero, so it is sampled there, and the mean of its cluster of zeros is well conditioned.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.analysis.crossings import CrossingFinder, Scaling
from mechdae.kernels.call import Call
from mechdae.kernels.jets import vertex

SAMPLES = 17
REACHES = (4.0, 2.0, 1.0)
"""Half widths of the sampled interval, in largest steps of the path."""
CLUSTER = 0.04
"""Radius of a cluster of zeros, in half widths."""
NOISE = 1e-11


class CuspFinder:
    """Finds cusps of the motion ahead of a pose; `crossings` knows the scene's blocks."""

    def __init__(self, crossings: CrossingFinder) -> None:
        self.crossings = crossings
        self._systems: dict[int, Call] = {}

    def find(self, b: int, s: float, state: Any, sense: float) -> float | None:
        """Return where block `b` has a cusp ahead of the node `state` at s, None without."""
        for reach in REACHES:
            half = reach * self.crossings.largest
            places = s + sense * half * (1 - np.cos(np.pi * np.arange(SAMPLES) / (SAMPLES - 1)))
            loads = self._loads(b, s, state, places)
            found = None if loads is None else _cusp(s, sense, half, places, loads)
            if found is not None:
                return found
        return None

    def _loads(self, b: int, s: float, state: Any, places: Any) -> Any:
        """Return e at the places, None where it does not exist."""
        finder = self.crossings
        g, n = finder.graphs, finder.graphs.nx
        graph, earlier = g.blocks[b], g.ancestors(b)[:-1]
        if b not in self._systems:
            self._systems[b] = Call(vertex(g.scene, graph))
        x, v, a = state[:n], state[n : 2 * n], state[2 * n : 3 * n]
        own, count = graph.own, graph.size
        J = graph.value_at(x, finder.u(s), finder.p)[1]
        scaling = finder.scaling(b, J)
        left, _, right = np.linalg.svd(scaling.equations(J * scaling.columns))
        y = np.concatenate([x[own] / scaling.columns, [0.0], right[-1]])
        w0 = left[:, -1]
        loads = []
        for place in places:
            ds = place - s
            whole = finder.follow(earlier, place, x + v * ds + a * ds * ds / 2, {})[0]
            y = self._solve(b, y, w0, whole[graph.uses], finder.u(place), scaling)
            if y is None:
                return None
            loads.append(y[count])
        return np.array(loads)

    def _solve(self, b: int, y: Any, w0: Any, z: Any, u: Any, scaling: Scaling) -> Any:
        for _ in range(12):
            inputs = (y, w0, z, u, self.crossings.p, *scaling.vectors)
            system, slope = self._systems[b](*inputs)
            if not (np.isfinite(system).all() and np.isfinite(slope).all()):
                return None
            change = np.linalg.lstsq(slope, -system)[0]
            y = y + change
            size = float(np.abs(change).max())
            if size > 1.0:
                return None
            if size < 1e-14:
                return y
        return y if size < 1e-9 else None


def _cusp(s: float, sense: float, half: float, places: Any, loads: Any) -> float | None:
    """Return the place of an odd cluster of at least three zeros of the interpolant."""
    t = (places - s) * sense / half - 1
    series = np.polynomial.chebyshev.chebfit(t, loads, SAMPLES - 1)
    largest = np.abs(series).max()
    if largest == 0 or np.abs(series[-4:]).max() > NOISE * largest:
        return None
    kept = int(np.flatnonzero(np.abs(series) > 1e-15 * largest)[-1]) + 1
    zeros = np.polynomial.chebyshev.chebroots(series[:kept])
    ahead = zeros[(np.abs(zeros.imag) < CLUSTER) & (zeros.real > -1) & (zeros.real < 1)]
    if not ahead.size:
        return None
    first = ahead[np.argmin(ahead.real)]
    centre = first
    for _ in range(3):
        cluster = zeros[np.abs(zeros - centre) < CLUSTER]
        centre = cluster.mean()
    if len(cluster) < 3 or len(cluster) % 2 == 0:
        return None
    return float(s + sense * half * (centre.real + 1))
