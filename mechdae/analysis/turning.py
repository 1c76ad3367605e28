"""The way of all that hangs on a fold into it: along sigma, in which nothing is singular.

Next to the fold of a block, s = s* + c sigma^2, the rates of later blocks with respect to s have
no bound, and a step in s is not proved however short it is. With sigma as the parameter the
curve of the block and of those before it is smooth, and later blocks follow it in steps that
are proved by the tube of `Graphs.advance`. One of them that folds earlier has no such way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechdae.analysis.limits import Limit, LimitFinder, solve
from mechdae.analysis.numbers import Constants
from mechdae.kernels.call import Call
from mechdae.kernels.graphs import Graphs

ITERATIONS = 12
STEPS = 400
"""Steps to a fold, those not proved included, after which it is given up."""
BENT = 0.1
"""Share by which the tangent of the fold's own curve may change over a step."""
ARRIVED = 1e-6
"""Natural sizes by which the end of the way may miss the fold."""
LAST = 0.2
"""Largest Newton-Kantorovich number of a pose's last step."""
OPEN = 1e-10
"""Share by which superfluous equations may stay open."""


@dataclass(frozen=True, eq=False)
class _Place:
    """A place on the way: unknowns of the fold's chain and s (n,), all unknowns x (nx,), rates.

    ``tangent`` and ``rate`` are the derivatives of ``y`` and ``x``, ``beta`` and ``sign`` those of
    the later blocks.
    """

    y: Any
    tangent: Any
    x: Any
    rate: Any
    beta: dict[int, float]
    sign: dict[int, float]


class Turning:
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
        motion: Callable[[float], list[Any]],
    ) -> None:
        self.graphs, self.finder, self.motion = graphs, finder, motion
        self.consts, self.kappa = constants.vector(), constants.kappa
        self._steps: dict[int, Call] = {}
        self._tubes: dict[int, Call] = {}

    def lead(self, limit: Limit, s: float, x: Any, blocks: Iterable[int]) -> Limit | None:
        """Return a fold with later `blocks` where the pose `x` at `s` leads them.

        None where the pose is not on the fold's curve, or where no proved way leads to it.
        """
        g = self.graphs
        chain, _ = self.finder.chain(limit.block)
        fixed = set(g.ancestors(limit.block))
        later = sorted({k for b in blocks for k in g.ancestors(b)} - fixed)
        own = list(limit.own)
        start = float(self._normal(limit) @ (x - limit.x)[own])
        if not np.isfinite(start) or start == 0:
            return None
        way = -float(np.sign(start))
        here = self._arrive(limit, start, way, np.append(x[chain], s), x, later)
        if here is None or not self._near(here.y, np.append(x[chain], s), chain):
            return None
        done, step, reach = 0.0, abs(start), abs(start)
        for _ in range(STEPS):
            step = min(step, reach - done)
            last = step == reach - done
            sigma = 0.0 if last else start + way * (done + step)
            ahead = here.y + here.tangent * step
            after = self._arrive(limit, sigma, way, ahead, here.x + here.rate * step, later)
            if after is None or not self._proved(here, after, step, chain, later):
                step /= 2
                continue
            here, done = after, done + step
            if last:
                return self._end(limit, here, chain, later, way)
            step *= 2
        return None

    def _normal(self, limit: Limit) -> Any:
        """Return n with n . (x - x*) = sigma for the unknowns of the fold's block."""
        return limit.v[list(limit.own)] / self.finder.weights[limit.block] ** 2

    def _near(self, y: Any, other: Any, chain: list[int]) -> bool:
        return bool(np.all(np.abs(y - other) <= ARRIVED * self._sizes(chain)))

    def _sizes(self, chain: list[int]) -> Any:
        return np.append(self.finder.sizes[chain], self.finder.unit)

    def _arrive(
        self, limit: Limit, sigma: float, way: float, y: Any, x: Any, later: list[int]
    ) -> _Place | None:
        """Return the place at sigma from guesses; rates are those along the `way`."""
        chain, own = self.finder.chain(limit.block)
        normal, fold = np.zeros(len(chain) + 1), np.append(limit.x[chain], limit.s)
        normal[own] = self._normal(limit)
        sizes, none = self._sizes(chain), np.zeros(len(own))
        moved = np.inf
        try:
            for _ in range(ITERATIONS):
                system, slope, J, *_ = self.finder.evaluate(limit.block, np.append(y, none))
                rows = len(system) - len(J) - 1
                matrix = np.vstack([slope[:rows, : len(y)], normal])
                miss = np.append(system.ravel()[:rows], normal @ (y - fold) - sigma)
                weight = np.max(np.abs(matrix), axis=1)
                weight[weight == 0] = 1.0
                matrix, miss = matrix / weight[:, None], miss / weight
                change = solve(matrix, miss)
                y = y - change
                before, moved = moved, float(np.max(np.abs(change) / sizes))
                if not np.isfinite(moved):
                    return None
                if moved <= 1e-15 or (moved < 1e-10 and moved >= before):
                    break
            else:
                return None
            tangent = solve(matrix, np.append(np.zeros(rows), way / weight[-1]))
        except np.linalg.LinAlgError:
            return None
        x, rate = x.copy(), np.zeros(len(x))
        x[chain], rate[chain] = y[:-1], tangent[:-1]
        u, du, *_ = self.motion(float(y[-1]))
        beta, sign = {}, {}
        for k in later:
            graph = self.graphs.blocks[k]
            for _ in range(ITERATIONS):
                step, _, det, size, left = self._step(k, x, u, rate, du * tangent[-1])
                if not np.all(np.isfinite(step)):
                    return None
                x[graph.own] -= step
                length = np.linalg.norm(step / self.finder.weights[k])
                if length <= 1e-15 or self.kappa[k] * size * length < 1e-8:
                    break
            step, first, det, size, left = self._step(k, x, u, rate, du * tangent[-1])
            x[graph.own] -= step
            length = np.linalg.norm(step / self.finder.weights[k])
            if not self.kappa[k] * size * length <= LAST or not left <= OPEN:
                return None
            rate[graph.own], beta[k], sign[k] = first, float(size), float(np.sign(det))
        return _Place(y, tangent, x, rate, beta, sign)

    def _step(self, b: int, x: Any, u: Any, rate: Any, du: Any) -> tuple[Any, ...]:
        if b not in self._steps:
            self._steps[b] = Call(self.graphs.along(b))
        step, first, det, beta, left = self._steps[b](x, u, rate, du, self.consts)
        return step, first, float(det[0]), float(beta[0]), float(left[0])

    def _proved(
        self, here: _Place, after: _Place, step: float, chain: list[int], later: list[int]
    ) -> bool:
        """Return whether a step is proved: no later block leaves its branch or folds on it."""
        sizes = self._sizes(chain)
        turned = np.max(np.abs(after.tangent - here.tangent) / sizes)
        missed = np.abs(after.y - here.y - here.tangent * step)
        length = np.max(np.abs(here.tangent) / sizes)
        if not (turned <= BENT * length and np.max(missed / sizes) <= BENT * length * step):
            return False
        # twice what a constant second derivative does
        off = np.maximum(np.abs(after.tangent - here.tangent) * step, 4 * missed)
        away = np.abs(after.rate - here.rate) * step
        away[chain] = off[:-1]
        s, t = float(here.y[-1]), float(after.y[-1])
        (u, du, *_), (_, end, *_) = self.motion(s), self.motion(t)
        drift = np.abs(du) * off[-1] + 2 * np.abs(end - du) * abs(t - s)
        for k in later:
            graph = self.graphs.blocks[k]
            if k not in self._tubes:
                self._tubes[k] = Call(self.graphs.tube(k))
            driven = du * here.tangent[-1]
            numbers = (here.beta[k], step)
            inputs = (here.x, here.rate, away, u, driven, drift, numbers, self.consts)
            test, radius = (float(part[0]) for part in self._tubes[k](*inputs))
            w = self.finder.weights[k]
            moved = after.x[graph.own] - here.x[graph.own] - here.rate[graph.own] * step
            inside = np.linalg.norm(moved / w) <= radius * (1 + 1e-6) + 1e-300
            if not (test <= 1 and inside and after.sign[k] == here.sign[k]):
                return False
            away[graph.own] = np.maximum(away[graph.own], radius * w)
        return True

    def _end(
        self, limit: Limit, here: _Place, chain: list[int], later: list[int], way: float
    ) -> Limit | None:
        """Return the fold with the later blocks of its place on the way."""
        if not self._near(here.y, np.append(limit.x[chain], limit.s), chain):
            return None
        x, rate = limit.x.copy(), limit.v.copy()
        columns = [i for k in later for i in self.graphs.blocks[k].own]
        x[columns], rate[columns] = here.x[columns], way * here.rate[columns]
        return replace(limit, x=x, v=rate)
