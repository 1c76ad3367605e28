"""How later groups are followed into a fold of an earlier one: by sigma, in which all is regular.

Next to the fold of a block, s = s* + c sigma^2, the rates of later blocks with respect to s have
no bound, and a step in s is not proved however short it is. With sigma as the parameter the
curve of the block and of those before it is smooth, and later blocks follow it in steps that
are proved by the tube of `Graphs.advance`. One of them that folds earlier has no such way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import field, replace
from typing import Any

import numpy as np

from mechdae.kernels.graphs.folds import PATH_STEP_LIMIT
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import Call
from mechdae.motion.continuation.limit_positions import Limit, LimitFinder
from mechdae.motion.setup.scales import Constants
from mechdae.numerics.null_space import solve
from mechdae.records import dataclass
from mechdae.types import Floats, Unknowns

ITERATIONS = 12
STEPS = 1500
"""Steps to a fold above which it is given up, those that were not proved not counted."""
GROWTH = 1.3
"""Growth of a step after one that was proved."""
BENT = 0.1
"""Share of a step by which a curve whose bounds are measured may leave its tangent."""
ARRIVED = 1e-6
"""Natural sizes by which the end of the way may miss the fold."""
LAST = 0.2
"""Largest Newton-Kantorovich number of a pose's last step."""
SMALL = 1e-8
"""The same below which no further step is taken."""
HARDLY = 1e-12
"""Units of s, or shares of it, that a fold's place is not known to."""
MONOTONE = 3.0
"""Slope at an end, over the mean, up to which a cubic piece rises all the way (Fritsch and
Carlson, SIAM J. Numer. Anal. 17, 1980): on the way into a fold s must not turn back before."""
CLOSE_BY = 1e-5
"""Radians, or lengths, from which a fold is taken up where no step can be proved."""
OPEN = 1e-10
"""Share by which redundant equations may stay open."""


@dataclass(frozen=True, eq=False)
class _Curve:
    """The way of a fold's block: unknowns `chain` of it and of those before it, and s.

    ``normal`` (y - ``fold``) is sigma, ``columns`` and ``rows`` are units of y and of equations.
    """

    block: int
    chain: list[int]
    fold: Floats
    normal: Floats
    columns: Any
    rows: Floats

    def near(self, y: Floats, other: Floats) -> bool:
        return bool(np.all(np.abs(y - other) <= ARRIVED * self.columns))


@dataclass(frozen=True, eq=False)
class _Place:
    """A place on the way: (x, s) of the curve and its tangent, all unknowns and their rates.

    ``size`` is the norm of the inverse of the curve's equations, ``last`` the last Newton step;
    ``beta`` and ``sign`` (of the determinant) are those of the later blocks.
    """

    y: Floats
    tangent: Floats
    size: float
    last: float
    x: Unknowns
    rate: Floats
    beta: dict[int, float] = field(default_factory=dict)
    sign: dict[int, float] = field(default_factory=dict)


class FoldApproach:
    """Follows later blocks into the folds of earlier ones.

    Parameters
    ----------
    graphs, constants
        Functions and numbers of the scene.
    finder
        Finds the folds.
    motion
        The function s -> u, u', u'', u''' (nd,).
    """

    def __init__(
        self,
        graphs: Graphs,
        constants: Constants,
        finder: LimitFinder,
        motion: Callable[[float], list[Floats]],
    ) -> None:
        self.graphs: Graphs = graphs
        self.finder: LimitFinder = finder
        self.motion: Callable[[float], list[Floats]] = motion
        self.constants: Constants = constants
        self.consts: Floats = constants.consts
        self.kappa: Floats = constants.kappa

    def lead(self, limit: Limit, s: float, x: Unknowns, blocks: Iterable[int]) -> Limit | None:
        """Return a fold with later `blocks` where the pose `x` at `s` leads them.

        None where the pose is not on the fold's curve, where no proved way leads to it, or where
        another fold of the same block comes first.
        """
        g = self.graphs
        curve = self._curve(limit)
        later = sorted({k for b in blocks for k in g.ancestors(b)} - set(g.ancestors(limit.block)))
        y = np.append(x[curve.chain], s)
        start = float(curve.normal @ (y - curve.fold))
        if not np.isfinite(start) or start == 0:
            return None
        way, reach, gap = -float(np.sign(start)), abs(start), limit.s - s
        hardly = HARDLY * max(self.finder.unit, abs(s))
        sense = float(np.sign(gap)) if abs(gap) > hardly else 0.0
        here = self._arrive(curve, start, way, y, x, later)
        if here is None or not curve.near(here.y, y) or sense * here.tangent[-1] < 0:
            return None
        done, step, taken = 0.0, reach, 0
        while True:
            rest = reach - done
            if rest > (STEPS - taken) * step:
                return None
            last = step >= rest
            step = min(step, rest)
            sigma = 0.0 if last else start + way * (done + step)
            ahead = here.y + here.tangent * step
            after = self._arrive(curve, sigma, way, ahead, here.x + here.rate * step, later)
            if after is None or not self._proved(curve, here, after, step, later):
                step /= 2
                continue
            if not last and sense * after.tangent[-1] < 0:
                return None  # another fold comes first
            rise = sense * float(after.y[-1] - here.y[-1])
            steepest = step * max(sense * here.tangent[-1], sense * after.tangent[-1])
            if steepest > MONOTONE * rise + hardly:
                step /= 2
                continue
            if last:
                return self._end(limit, curve, after, later, way)
            here, done, step, taken = after, done + step, GROWTH * step, taken + 1

    def beside(self, limit: Limit, s: float, x: Unknowns, blocks: Iterable[int]) -> Limit | None:
        """Return a fold with later `blocks` as they stand there, from the pose `x` (nx,) close by.

        Nothing is proved about the way; None where the pose is not close, or they do not close.
        """
        g, unknowns = self.graphs, list(limit.own)
        if abs(limit.s - s) > CLOSE_BY * self.finder.unit:
            return None
        later = sorted({k for b in blocks for k in g.ancestors(b)} - set(g.ancestors(limit.block)))
        chain, _ = self.finder.chain(limit.block)
        at, rate = x.copy(), limit.v.copy()
        at[chain], at[unknowns] = limit.x[chain], limit.x[unknowns]
        u = self.motion(limit.s)[0]
        for k in later:
            graph, w, size = g.blocks[k], self.finder.weights[k], np.inf
            for _ in range(ITERATIONS):
                F, J, Fz = graph.value_at(at, u, self.finder.p)
                step = solve(J, F)
                before, size = size, float(np.linalg.norm(step / w))
                if not size < before:
                    break
                at[graph.own] -= step
            if not size <= SMALL:
                return None
            rate[graph.own] = -solve(J, Fz @ rate[graph.uses])
        return replace(limit, x=at, v=rate)

    def _curve(self, limit: Limit) -> _Curve:
        """Return the curve of a fold's block and those before it."""
        g, b = self.graphs, limit.block
        chain, unknowns = self.finder.chain(b)
        columns = np.append(self.finder.sizes[chain], self.finder.unit)
        scale = self.finder.scale
        kinds = [unit for k in g.ancestors(b) for unit in g.blocks[k].block.units]
        rows = np.array([scale if unit == "m" else 1.0 for unit in kinds])
        normal = np.zeros(len(columns))
        normal[unknowns] = limit.v[list(limit.own)] / columns[unknowns] ** 2
        normal /= np.linalg.norm(normal * columns)
        fold = np.append(limit.x[chain], limit.s)
        return _Curve(b, chain, fold, normal, columns, rows)

    def _arrive(
        self, curve: _Curve, sigma: float, way: float, y: Floats, x: Unknowns, later: list[int]
    ) -> _Place | None:
        """Return the place at sigma from guesses; rates are those along the `way`."""
        nothing = np.zeros(len(self.graphs.blocks[curve.block].own))
        moved, m = np.inf, len(curve.rows)
        weight = np.append(curve.rows, 1.0)[:, None]
        try:
            for _ in range(ITERATIONS):
                system, slope, *_ = self.finder.evaluate(curve.block, np.append(y, nothing))
                matrix = np.vstack([slope[:m, : len(y)], curve.normal]) * curve.columns / weight
                miss = np.append(system.ravel()[:m], curve.normal @ (y - curve.fold) - sigma)
                change = solve(matrix, miss / weight[:, 0])
                y = y - curve.columns * change
                before, moved = moved, float(np.linalg.norm(change))
                if not np.isfinite(moved):
                    return None
                if moved <= 1e-15 or (moved < 1e-10 and moved >= before):
                    break
            else:
                return None
            tangent = curve.columns * solve(matrix, np.append(np.zeros(m), way))
            size = float(np.linalg.norm(np.linalg.pinv(matrix)))
        except np.linalg.LinAlgError:
            return None
        x, rate = x.copy(), np.zeros(len(x))
        x[curve.chain], rate[curve.chain] = y[:-1], tangent[:-1]
        place = _Place(y, tangent, size, moved, x, rate)
        return place if all(self._later(k, place) for k in later) else None

    def _later(self, b: int, place: _Place) -> bool:
        """Solve for the unknowns of a later block and their rates; return whether that held."""
        unknowns, w = self.graphs.blocks[b].own, self.finder.weights[b]
        u, du, *_ = self.motion(float(place.y[-1]))
        du = du * place.tangent[-1]
        for k in range(ITERATIONS):
            step, rate, det, beta, left = self._step(b, place.x, u, place.rate, du)
            if not np.all(np.isfinite(step)):
                return False
            place.x[unknowns] -= step
            h = self.kappa[b] * beta * np.linalg.norm(step / w)
            if k > 0 and h < SMALL:
                break
        place.rate[unknowns], place.beta[b], place.sign[b] = rate, beta, float(np.sign(det))
        open_by = self.graphs.scene.model.mechanism.tolerance / self.finder.scale
        return bool(h <= LAST and left <= OPEN + open_by)

    def _step(
        self, b: int, x: Unknowns, u: Floats, rate: Floats, du: Floats
    ) -> tuple[Floats, Floats, float, float, float]:
        call = self.graphs.cache(("along", b), lambda: Call(self.graphs.along(b)))
        step, first, det, beta, left = call(x, u, rate, du, self.consts)
        return step, first, float(det[0]), float(beta[0]), float(left[0])

    def _tube(self, k: int) -> Call:
        return self.graphs.cache(("tube", k), lambda: Call(self.graphs.tube(k)))

    def _proved(
        self, curve: _Curve, here: _Place, after: _Place, step: float, later: list[int]
    ) -> bool:
        """Return whether a step is proved: no block leaves its branch or folds on it."""
        off = self._off(curve, here, after, step)
        if off is None:
            return False
        away = np.zeros(len(here.x))
        away[curve.chain] = off[:-1]
        s, t = float(here.y[-1]), float(after.y[-1])
        (u, du, *_), (_, end, *_) = self.motion(s), self.motion(t)
        drift = np.abs(du) * off[-1] + 2 * np.abs(end - du) * abs(t - s)
        for k in later:
            tube = self._tube(k)
            unknowns, w = self.graphs.blocks[k].own, self.finder.weights[k]
            driven, numbers = du * here.tangent[-1], (here.beta[k], step)
            inputs = (here.x, here.rate, away, u, driven, drift, numbers, self.consts)
            (test, *_), (radius, *_), reach = tube(*inputs)
            moved = np.linalg.norm(
                (after.x[unknowns] - here.x[unknowns] - here.rate[unknowns] * step) / w
            )
            if not (test <= 1 and _within(moved, radius) and after.sign[k] == here.sign[k]):
                return False
            away[unknowns] = reach
        return True

    def _off(self, curve: _Curve, here: _Place, after: _Place, step: float) -> Floats | None:
        """Return by how much (x, s) may leave the tangent on the curve, None: unproved.

        Proved by Newton-Kantorovich for the equations with sigma as the parameter; along laws
        and in scenes with curves measured, twice what a constant second derivative does.
        """
        b, numbers = curve.block, self.constants
        missed = (after.y - here.y - here.tangent * step) / curve.columns
        if self.graphs.course is not None or self.graphs.contacts:
            turned = np.abs(after.tangent - here.tangent) / curve.columns * step
            length = step * np.max(np.abs(here.tangent) / curve.columns)
            off = np.maximum(turned, 4 * np.abs(missed))
            return off * curve.columns if np.max(off) <= BENT * length else None
        turn = self.graphs.cache(("turn", b), lambda: Call(self.graphs.turn(b)))
        u, d, *_ = self.motion(float(here.y[-1]))
        driven = (here.x, here.rate, u, d * here.tangent[-1], numbers.size_x, numbers.size_u, d)
        found = turn(*driven, step, numbers.p, curve.columns, curve.rows)
        residual, change, kappa = (float(part[0]) for part in found)
        delta = here.size * change
        grown = here.size / max(1 - delta, 1e-9)
        eta = grown * (residual + self._rounding(b))
        h = grown * kappa * eta
        radius = 2 * eta / (1 + np.sqrt(max(1 - 2 * h, 0.0)))
        good = delta <= 0.9 and h <= PATH_STEP_LIMIT and kappa * after.size * after.last <= LAST
        return radius * curve.columns if good and _within(np.linalg.norm(missed), radius) else None

    def _rounding(self, b: int) -> float:
        """Return the rounding of the equations of a block and of those before it."""
        parts = []
        for k in self.graphs.ancestors(b):
            alike = "m" in self.graphs.blocks[k].block.units and np.all(self.finder.weights[k] == 1)
            parts.append(self.constants.rho[k] / (self.finder.scale if alike else 1.0))
        return float(np.linalg.norm(parts))

    def _end(
        self, limit: Limit, curve: _Curve, here: _Place, later: list[int], way: float
    ) -> Limit | None:
        """Return the fold with the later blocks of its place on the way."""
        if not curve.near(here.y, curve.fold):
            return None
        unknowns = [i for k in later for i in self.graphs.blocks[k].own]
        x, rate = limit.x.copy(), limit.v.copy()
        # as in the fold's expansion, which may count sigma in other units
        share = float(curve.normal[:-1] @ limit.v[curve.chain])
        x[unknowns], rate[unknowns] = here.x[unknowns], way * share * here.rate[unknowns]
        return replace(limit, x=x, v=rate)


def _within(distance: Any, radius: float) -> bool:
    return bool(distance <= radius * (1 + 1e-6) + 1e-300)
