"""All isolated real solutions of small polynomial systems: Levenberg-Marquardt in batches.

The unknowns of a system with poses are of two kinds: `x`, shared by all poses (the dimensions),
and `t`, one of each pose (the turn of the coupler). A row of pose j depends on x and t_j alone,
so that the steps of t are eliminated and every start costs one small system over x. Thousands of
starts go at once; solutions are told apart by a key, polished by Newton's method on the whole
system and kept where they are isolated.

A search finds what its starts lead to: it proves no solution absent. Hits that stand alone, over
all hits, estimate the share of hits that would be new (Good and Turing).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Integers, Jacobians, Matrices, Matrix, Points, Unknowns

Rows = tuple[Matrices, Floats, Any]
"""Residuals (n, k, e), their derivatives by x (n, k, e, q) and by the own t (n, k, e) or None."""

BATCH = 2000
"""Starts that go at once."""
SOLVED = 1e-22
"""Sum of squares at which a start is at a solution, of a system scaled to one."""
FAR = 1e5
"""Unknowns beyond this run to infinity."""
BEYOND = 1e300
"""Sum of squares of a point at which there are no rows."""
LOOK, PATIENCE = 10, 40
"""Iterations between two looks at what is done, and at what hardly moves."""
SAME = 1e-6
"""Relative difference below which two keys are of one solution."""
SINGULAR = 1e-9
"""Ratio of singular values (of scaled columns) below which a solution is not isolated."""
POLISH = 12


@dataclass(frozen=True)
class DistinctSolutions:
    """Distinct solutions in the order in which they were found.

    ``x`` (m, q) and ``t`` (m, k) are the unknowns, ``residual`` (m,) the largest row, ``hits``
    (m,) how often each was reached; ``starts``, ``iterations`` (of single starts), ``converged``
    (degenerate solutions among them) count the work.
    """

    x: Matrix
    t: Matrix
    residual: Floats
    hits: Integers
    starts: int
    iterations: int
    converged: int

    def __len__(self) -> int:
        return len(self.x)


def solve_all(
    rows: Callable[[Floats, Floats], Rows],
    draw: Callable[[np.random.Generator, int], tuple[Floats, Floats]],
    starts: int,
    *,
    key: Callable[[Floats], Floats] | None = None,
    usable: Callable[[Floats], Booleans] | None = None,
    seed: int = 0,
    iterations: int = 300,
    enough: int | None = None,
    batch: int = BATCH,
) -> DistinctSolutions:
    """Return the distinct isolated real solutions that starts lead to.

    `draw`: (generator, n) -> x (n, q) and t (n, k), or (n, 0) where poses have no own unknown.
    `key`: x (n, q) -> numbers (n, m) that agree for solutions which are the same; None: x.
    `usable`: x (n, q) -> which are no degenerate solutions; None: all.
    """
    generator = np.random.default_rng(seed)
    found = _Known(rows, key or (lambda x: x))
    drawn = work = converged = 0
    while drawn < starts:
        n = min(batch, starts - drawn)
        x, t = draw(generator, n)
        drawn += n
        x, t, solved, count = descend(rows, x, t, iterations)
        work += count
        converged += int(solved.sum())
        x, t = x[solved], t[solved]
        if usable is not None:
            good = usable(x)
            x, t = x[good], t[good]
        found.add(x, t)
        if enough is not None and len(found.x) >= enough:
            break
    m, q, k = len(found.x), x.shape[1], t.shape[1]
    return DistinctSolutions(
        np.reshape(found.x, (m, q)), np.reshape(found.t, (m, k)), np.array(found.residual),
        np.array(found.hits, int), drawn, work, converged,
    )  # fmt: skip


class _Known:
    """Solutions found so far, with their hits."""

    def __init__(self, rows: Callable[[Any, Any], Rows], key: Callable[[Floats], Floats]) -> None:
        self.rows, self.key = rows, key
        self.x: list[Floats] = []
        self.t: list[Floats] = []
        self.residual: list[float] = []
        self.hits: list[int] = []
        self.keys: list[Floats] = []

    def add(self, x: Unknowns, t: Floats) -> None:
        """Count the hits of a batch and keep the solutions that are new."""
        if not len(x):
            return
        keys = self.key(x)
        for i, one in enumerate(keys):
            n = self._index(one)
            if n < 0:
                n = self._new(x[i], t[i])
            if n >= 0:
                self.hits[n] += 1

    def _index(self, one: Floats) -> int:
        if not self.keys:
            return -1
        known = np.array(self.keys)
        near = (np.abs(known - one) <= SAME * (1 + np.abs(one))).all(axis=1)
        return int(np.argmax(near)) if near.any() else -1

    def _new(self, x: Unknowns, t: Floats) -> int:
        x, t, residual, isolated = polished(self.rows, x, t)
        if not isolated:
            return -1
        one = self.key(x[None])[0]
        n = self._index(one)
        if n < 0:
            self.keys.append(one)
            self.x.append(x)
            self.t.append(t)
            self.residual.append(residual)
            self.hits.append(0)
            n = len(self.x) - 1
        return n


def descend(
    rows: Callable[[Floats, Floats], Rows], x: Unknowns, t: Floats, iterations: int
) -> tuple[Floats, Floats, Booleans, int]:
    """Return points (n, q), (n, k) after Levenberg-Marquardt, which are solved, and the work.

    Damping follows Nielsen: down with the gain of a step, up twice as fast at each failure; the
    scales of the unknowns are the largest columns met so far (More).
    Starts leave the batch when they are solved, run away, are stuck or hardly move.
    """
    x, t = np.array(x, float), np.array(t, float)
    ends_x, ends_t, solved = x.copy(), t.copy(), np.zeros(len(x), bool)
    left = np.arange(len(x))
    damping, growth = np.full(len(x), 0.1), np.full(len(x), 2.0)
    F, J, by_t = rows(x, t)
    f, before = _squares(F), _squares(F)
    scale, scale_own = _scales(J, by_t)
    work = 0
    for iteration in range(1, iterations + 1):
        work += len(x)
        dx, dt, expected = _step(F, J, by_t, scale, scale_own, damping)
        nx, nt = x + dx, t + dt
        nF, nJ, own_next = rows(nx, nt)
        nf = _squares(nF)
        better = nf < f
        gain = np.where(better, f - nf, 0.0) / np.maximum(expected, 1e-30 * f + 1e-300)
        lower = np.maximum(1 / 3, 1 - (2 * np.clip(gain, 0, 2) - 1) ** 3)
        damping = np.clip(np.where(better, damping * lower, damping * growth), 1e-12, 1e12)
        growth = np.where(better, 2.0, 2 * growth)
        x[better], t[better], f[better] = nx[better], nt[better], nf[better]
        F[better], J[better] = nF[better], nJ[better]
        if by_t is not None:
            by_t[better] = own_next[better]
        scale, scale_own = _larger(scale, scale_own, *_scales(J, by_t))
        if iteration % LOOK and iteration < iterations:
            continue
        done = f < SOLVED
        stop = done | (growth > 1e6) | (np.abs(x).max(axis=1) > FAR)
        if iteration % PATIENCE == 0:
            stop |= (f > 0.5 * before) & (f > 1e-6)
            before = f.copy()
        ends_x[left], ends_t[left], solved[left] = x, t, done
        keep = ~stop
        if not keep.any():
            break
        left, x, t, f, before = left[keep], x[keep], t[keep], f[keep], before[keep]
        damping, growth, F, J, scale = damping[keep], growth[keep], F[keep], J[keep], scale[keep]
        if by_t is not None:
            by_t, scale_own = by_t[keep], scale_own[keep]
    return ends_x, ends_t, solved, work


def _squares(F: Matrices) -> Floats:
    f = np.einsum("nke,nke->n", F, F)
    return np.where(np.isfinite(f), f, BEYOND)


def _larger(one: Floats, one_by_t: Floats | None, other: Floats, other_own: Any) -> tuple[Any, Any]:
    return np.maximum(one, other), None if one_by_t is None else np.maximum(one_by_t, other_own)


def _scales(J: Floats, by_t: Matrices | None) -> tuple[Floats, Floats | None]:
    """Return squares of the columns of x (n, q) and of t (n, k)."""
    squares = np.einsum("nkeq,nkeq->nq", J, J)
    return np.maximum(squares, 1e-12), None if by_t is None else np.einsum(
        "nke,nke->nk", by_t, by_t
    )


def _step(
    F: Matrices, J: Floats, by_t: Matrices | None, scale: Floats, scale_own: Any, damping: Floats
) -> tuple[Any, Floats, Floats]:
    """Return the damped steps of x and t and the decrease that the linear model expects."""
    n, k, e, q = J.shape
    flat = J.reshape(n, k * e, q)
    turned = flat.transpose(0, 2, 1)
    H = turned @ flat
    g = (turned @ F.reshape(n, k * e, 1))[:, :, 0]
    right = g
    if by_t is not None:
        square = np.einsum("nke,nke->nk", by_t, by_t)
        slope = np.einsum("nke,nke->nk", by_t, F)
        cross = (by_t[:, :, None, :] @ J)[:, :, 0, :]
        damped = square + damping[:, None] * scale_own + 1e-300
        share = cross / damped[:, :, None]
        H = H - cross.transpose(0, 2, 1) @ share
        right = g - np.einsum("nkq,nk->nq", share, slope)
    at = np.arange(q)
    H[:, at, at] += damping[:, None] * scale + 1e-14
    dx = -np.linalg.solve(H, right[:, :, None])[:, :, 0]
    expected = damping * np.einsum("nq,nq->n", dx * scale, dx) - np.einsum("nq,nq->n", dx, g)
    if by_t is None:
        return dx, np.zeros((n, 0)), expected
    dt = -(slope + np.einsum("nkq,nq->nk", cross, dx)) / damped
    expected += damping * np.einsum("nk,nk->n", dt * scale_own, dt)
    return dx, dt, expected - np.einsum("nk,nk->n", dt, slope)


def polished(
    rows: Callable[[Floats, Floats], Rows], x: Unknowns, t: Floats
) -> tuple[Floats, Floats, float, bool]:
    """Return one solution after Newton's method on the whole system, its residual, isolated.

    The best of at most `POLISH` iterates is kept, which is where rounding takes over.
    """
    best = (x, t, np.inf)
    isolated = False
    for _ in range(POLISH):
        F, J, by_t = rows(x[None], t[None])
        size = float(np.abs(F).max())
        if not size < best[2]:
            break
        best = (x, t, size)
        A = _whole(J[0], None if by_t is None else by_t[0])
        scale = np.linalg.norm(A, axis=0)
        scale[scale == 0] = 1.0
        step, _, _, values = np.linalg.lstsq(A / scale, -F.ravel(), rcond=None)
        isolated = len(values) == A.shape[1] and bool(values[-1] > SINGULAR * values[0])
        step = step / scale
        x, t = x + step[: len(x)], t + step[len(x) :]
    return *best, isolated


def _whole(J: Jacobians, by_t: Points | None) -> Floats:
    """Return the Jacobian (k e, q + k) of all rows by all unknowns."""
    k, e, q = J.shape
    if by_t is None:
        return J.reshape(k * e, q)
    A = np.zeros((k, e, q + k))
    A[:, :, :q] = J
    A[np.arange(k), :, q + np.arange(k)] = by_t
    return A.reshape(k * e, q + k)
