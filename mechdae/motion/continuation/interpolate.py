"""Guesses between the nodes of a path: quintic Hermite pieces, expansions at folds."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from mechdae.types import Booleans, Floats, Integers, Matrix, Unknowns

CACHED = 32_768
"""Numbers of an array that stays in the cache of the processor."""


class Fold(Protocol):
    """A limit position: unknowns ``x``, null vector ``v`` at ``s``, and ``c`` of s + c sigma^2."""

    @property
    def s(self) -> float: ...
    @property
    def x(self) -> Floats: ...
    @property
    def v(self) -> Floats: ...
    @property
    def c(self) -> float: ...


def upper_coefficients(
    rise: Floats, v0: Floats, v1: Floats, a0: Floats, a1: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return c3, c4, c5 of x0 + v0 t + a0 t^2/2 + c3 t^3 + c4 t^4 + c5 t^5 over 0 <= t <= 1.

    `rise` is x1 - x0; rates are those by t.
    """
    c3 = 10 * rise - 6 * v0 - 4 * v1 - 1.5 * a0 + 0.5 * a1
    c4 = -15 * rise + 8 * v0 + 7 * v1 + 1.5 * a0 - a1
    c5 = 6 * rise - 3 * (v0 + v1) + 0.5 * (a1 - a0)
    return c3, c4, c5


def quintic(S: Floats, X: Unknowns, V: Floats, A: Matrix, s: Floats) -> Floats:
    """Return the quintic Hermite interpolant (n, nx) at `s` (n,).

    S (m,) are rising nodes, X, V, A (m, nx) values, first and second derivatives.
    """
    return quintic_rates(S, X, V, A, s, 0)[0]


@np.errstate(invalid="ignore", over="ignore")
def quintic_rates(
    S: Floats, X: Unknowns, V: Floats, A: Matrix, s: Floats, orders: int = 2
) -> list[Floats]:
    """Return the quintic Hermite interpolant at `s` and its first `orders` derivatives.

    Unknowns of groups that have ended may have run away: they are not finite, without a word.
    """
    k = _pieces(S, s)
    h = np.diff(S)[:, None]
    x0, x1 = X[:-1], X[1:]
    v0, v1, a0, a1 = V[:-1] * h, V[1:] * h, A[:-1] * h * h, A[1:] * h * h
    rise = x1 - x0
    c3, c4, c5 = upper_coefficients(rise, v0, v1, a0, a1)
    pieces = [np.ascontiguousarray(c.T) for c in (c5, c4, c3, 0.5 * a0, v0, x0)]
    width = h[k, 0]
    t = (s - S[k]) / width
    # columns of poses: kernels read them one by one
    results = [np.empty((X.shape[1], len(s))) for _ in range(orders + 1)]
    rows = max(1, CACHED // max(len(s), 1))
    for first in range(0, X.shape[1], rows):
        some = slice(first, first + rows)
        parts = [piece[some].take(k, axis=1) for piece in pieces]
        for order, whole in enumerate(results):
            result = parts[0] * math.perm(5, order)
            for j in range(1, 6 - order):
                result *= t
                result += parts[j] * math.perm(5 - j, order) if order else parts[j]
            whole[some] = result / width**order if order else result
    return [whole.T for whole in results]


def _pieces(S: Floats, s: Floats) -> Integers:
    """Return the number of the piece between nodes that each place is in, (n,)."""
    if len(s) > 4 * len(S) and np.all(s[1:] >= s[:-1]):  # places in order: by pieces
        ends = np.searchsorted(s, S[1:-1])
        return np.repeat(np.arange(len(S) - 1), np.diff(ends, prepend=0, append=len(s)))
    return np.clip(np.searchsorted(S, s, side="right") - 1, 0, len(S) - 2)


def turning(
    h: Floats, y0: Floats, v0: Floats, a0: Floats, y1: Floats, v1: Floats, a1: Floats
) -> tuple[Floats, Floats]:
    """Return where in (0, h) the quintic pieces with these ends are stationary, and the values.

    The rates at both ends of a piece have opposite signs; all arguments are (k,) arrays.
    """
    c1, c2, rise = v0 * h, a0 * h * h / 2, y1 - y0
    c3, c4, c5 = upper_coefficients(rise, c1, v1 * h, 2 * c2, a1 * h * h)
    t = v0 / (v0 - v1)
    for _ in range(6):
        rate = c1 + t * (2 * c2 + t * (3 * c3 + t * (4 * c4 + t * 5 * c5)))
        bend = 2 * c2 + t * (6 * c3 + t * (12 * c4 + t * 20 * c5))
        with np.errstate(invalid="ignore", divide="ignore"):
            step = np.where(bend != 0, rate / bend, 0.0)
        t = np.clip(t - np.nan_to_num(step), 0.0, 1.0)
    return t * h, y0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))


def near_limit(
    s: Floats, S: Floats, X: Unknowns, V: Floats, limit: Fold, side: int
) -> tuple[Booleans, Floats]:
    """Return which places lie between the last node and a fold, and guesses there (k, nx).

    In sigma, with s = s* + c sigma^2, the path is smooth: a parabola through the fold, the
    last node and its derivative. `side` is 1 for a fold at the upper end, -1 at the lower.
    """
    before = np.flatnonzero((limit.s - S) * side > 0)
    nothing = np.zeros(len(s), bool)
    if not before.size:
        return nothing, np.zeros((0, X.shape[1]))
    last = before[-1] if side > 0 else before[0]
    between = ((s - S[last]) * side >= 0) & ((limit.s - s) * side >= 0)
    if not between.any():
        return nothing, np.zeros((0, X.shape[1]))
    sign = np.sign((X[last] - limit.x) @ limit.v) or 1.0
    reach = sign * np.sqrt((S[last] - limit.s) / limit.c)
    sigma = sign * np.sqrt(np.maximum((s[between] - limit.s) / limit.c, 0.0))[:, None]
    rise = X[last] - limit.x
    slope = V[last] * 2 * limit.c * reach
    b = (slope * reach - rise) / reach**2
    a = rise / reach - b * reach
    return between, limit.x + a * sigma + b * sigma**2
