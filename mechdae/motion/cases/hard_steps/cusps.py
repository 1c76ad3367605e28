"""Poses at which two branches of a block touch: of which order, where, or how far apart.

Near a singular pose the block's equations reduce to A alpha^2 / 2 + e(s) = 0 (Lyapunov and
Schmidt), e(s) being the least load that makes the pose at s singular. A simple zero of e is
a limit position, a double one a change point; an odd higher one is a cusp of the motion:
both branches come to it with one tangent and none goes on. Where an even one, of multiplicity
2 m, is, the branches touch: they differ by s^m and both go on. e is smooth on both sides of
its zero, so it is sampled there, and the mean of its cluster of zeros is well conditioned;
each of them is known as well as rounding of e lets it be, the root of order 2 m of that.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.kernels.bounds.walk import ROUNDOFF
from mechdae.kernels.graphs.singular import vertex
from mechdae.kernels.run.functions import Call
from mechdae.motion.cases.hard_steps.crossings.change_points import CrossingFinder, Scaling
from mechdae.records import dataclass
from mechdae.types import Complexes, Floats

SAMPLES = 17
REACHES = (16.0, 8.0, 4.0, 2.0, 1.0)
"""Half widths of the sampled interval, in largest steps of the path."""
CLUSTER = 0.04
"""Radius of a cluster of zeros, in half widths."""
WIDEST = 0.12
"""The same of a cluster of many zeros, that of the order to which branches touch."""
NOISE = 1e-11
ROUNDING = 8 * ROUNDOFF
"""Coefficients of a series that are rounding, where loads are small."""
LOAD = 16 * ROUNDOFF
"""What rounding does to a load, as a share of the units of the equations."""
SAFE = 2.0
"""Factor on the range of a place."""


@dataclass(frozen=True)
class Touch:
    """Where two branches touch, or come nearest to each other.

    ``order`` is m where they differ by (s - s*)^m, half a whole number at a cusp; the place lies
    between ``low`` and ``high``. ``gap`` is how far apart they are there [rad or lengths of the
    mechanism] if they do not ``meet``, else how far apart rounding would let them be.
    """

    s: float
    order: float
    low: float
    high: float
    gap: float
    meet: bool

    @property
    def cusp(self) -> bool:
        return self.order % 1 != 0


class CuspFinder:
    """Finds where branches touch ahead of a pose; `crossings` knows the scene's blocks."""

    def __init__(self, crossings: CrossingFinder) -> None:
        self.crossings = crossings

    def find(self, b: int, s: float, state: Floats, sense: float) -> Touch | None:
        """Return where block `b` has such a place ahead of the node `state` at s, None without."""
        for reach in REACHES:
            half = reach * self.crossings.largest
            t = -np.cos(np.pi * np.arange(SAMPLES) / (SAMPLES - 1))
            sampled = self._loads(b, s, state, s + sense * half * (t + 1))
            if sampled is None:
                continue
            loads, solutions = sampled
            found = _cluster(t, loads)
            if found is None:
                continue
            centre, count, spread, least, slope = found
            k = int(np.argmin(np.abs(t - centre)))
            place = float(s + sense * half * (centre + 1))
            bend = self._bend(b, s, state, place, solutions[k])
            if bend is None or bend == 0:
                continue
            meet = abs(least) <= LOAD
            wide = SAFE * half * (spread + (LOAD / slope) ** (1 / count))
            gap = 2 * float(np.sqrt(2 * max(abs(least), LOAD) / bend))
            return Touch(place, count / 2, place - wide, place + wide, gap, meet)
        return None

    def _loads(
        self, b: int, s: float, state: Floats, places: Floats
    ) -> tuple[Floats, list[Floats]] | None:
        """Return e at the places and the solutions there, None where it does not exist."""
        finder = self.crossings
        n, unknowns = finder.graphs.nx, finder.graphs.blocks[b].own
        J = finder.graphs.blocks[b].value_at(state[:n], finder.u(s), finder.p)[1]
        scaling = finder.scaling(b, J)
        left, _, right = np.linalg.svd(scaling.equations(J * scaling.columns))
        y = np.concatenate([state[:n][unknowns] / scaling.columns, [0.0], right[-1]])
        found = []
        for place in places:
            z = self._upstream(b, s, state, place)[finder.graphs.blocks[b].uses]
            y = self._solve(b, y, left[:, -1], z, finder.u(place), scaling)
            if y is None:
                return None
            found.append(y)
        return np.array(found)[:, len(unknowns)], found

    def _upstream(self, b: int, s: float, state: Floats, place: float) -> Floats:
        """Return the unknowns (nx,) at a place with earlier blocks solved for."""
        n, ds = self.crossings.graphs.nx, place - s
        x, v, a = state[:n], state[n : 2 * n], state[2 * n : 3 * n]
        earlier = self.crossings.graphs.ancestors(b)[:-1]
        return self.crossings.follow(earlier, place, x + v * ds + a * ds * ds / 2, {})[0]

    def _bend(self, b: int, s: float, state: Floats, place: float, y: Floats) -> float | None:
        """Return |A| at the singular pose near `y` at a place."""
        finder = self.crossings
        n, graph = finder.graphs.nx, finder.graphs.blocks[b]
        J = graph.value_at(state[:n], finder.u(s), finder.p)[1]
        scaling = finder.scaling(b, J)
        w = np.linalg.svd(scaling.equations(J * scaling.columns))[0][:, -1]
        z = self._upstream(b, s, state, place)[graph.uses]
        y = self._solve(b, y, w, z, finder.u(place), scaling)
        if y is None:
            return None
        still = [z, 0 * z, 0 * z, 0 * z]
        x, v = y[: graph.size] * scaling.columns, y[graph.size + 1 :] * scaling.columns

        def second(slope: Floats) -> float:
            values = finder.jet(b, place, x, (slope, 0 * slope), still)[3]
            return float(w @ scaling.equations(values))

        return abs((second(v) + second(-v)) / 2 - second(0 * v))

    def _solve(self, b: int, y: Floats, w0: Floats, z: Floats, u: Floats, scaling: Scaling) -> Any:
        graphs = self.crossings.graphs
        call = graphs.cache(("cusp", b), lambda: Call(vertex(graphs.scene, graphs.blocks[b])))
        for _ in range(12):
            inputs = (y, w0, z, u, self.crossings.p, *scaling.vectors)
            system, slope = call(*inputs)
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


def _cluster(t: Any, loads: Floats) -> tuple[float, int, float, float, float] | None:
    """Return the first cluster of more than two zeros of the interpolant on -1 .. 1.

    Its centre, their number, how far they spread, the load nearest to zero and the factor a of
    e = a (t - centre)^number.
    """
    series = np.polynomial.chebyshev.chebfit(t, loads, SAMPLES - 1)
    largest = np.abs(series).max()
    tail = float(np.abs(series[-4:]).max())
    if largest <= LOAD or tail > max(NOISE * largest, ROUNDING):
        return None
    remaining = int(np.flatnonzero(np.abs(series) > max(1e-15 * largest, 2 * tail))[-1]) + 1
    zeros = np.polynomial.chebyshev.chebroots(series[:remaining])
    ahead = zeros[(np.abs(zeros.imag) < WIDEST) & (zeros.real > -1) & (zeros.real < 1)]
    if not ahead.size:
        return None
    first = ahead[np.argmin(ahead.real)]
    for radius in (WIDEST, CLUSTER):
        centre = first
        for _ in range(3):
            cluster = zeros[np.abs(zeros - centre) < radius]
            centre = cluster.mean() if cluster.size else centre
        if len(cluster) < 3:
            continue
        middle, spread = float(centre.real), float(np.max(np.abs(cluster - centre)))
        slope = _slope(series, zeros, cluster, middle)
        ours = np.sign(np.polynomial.chebyshev.chebval(middle - 2 * max(spread, 1e-3), series))
        near = middle + spread * np.linspace(-1, 1, 65)
        values = ours * np.polynomial.chebyshev.chebval(near, series)
        # zeros that lie far apart are one if rounding moves them so far, or branches stay apart
        rounded = spread <= SAFE * (LOAD / slope) ** (1 / len(cluster))
        if radius == CLUSTER or rounded or values.min() > LOAD:
            break
    else:
        return None
    if len(cluster) % 2 == 0 and values.min() < -LOAD:
        return None  # a limit position, and behind it another one
    least = 0.0 if values.min() < 0 else float(values.min())
    return middle, len(cluster), spread, least, slope


def _slope(series: Floats, zeros: Any, cluster: Complexes, middle: float) -> float:
    """Return the factor a of e = a (t - middle)^number near a cluster of zeros."""
    others = zeros[~np.isin(zeros, cluster)]
    far = np.polynomial.chebyshev.chebval(2.0, series)
    whole = abs(far) / np.prod(np.abs(2.0 - zeros))
    return float(whole * np.prod(np.abs(middle - others)))
