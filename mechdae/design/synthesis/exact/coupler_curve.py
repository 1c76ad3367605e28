"""The curve of a four-bar's coupler point as one equation, in isotropic coordinates.

The plane's points are pairs (p, p') that are conjugate where they are real. With the coupler point
at the origin in the first position a four-bar has the pins x, y and the pivots a, b, eight complex
numbers (x, x', a, a', y, y', b, b'). At another place (d, d') of the coupler point its turn m obeys

    A m + B / m + C = 0,  A = x (d' - a'),  B = x' (d - a),  C = d d' - d a' - d' a + x a' + x' a

and the same with y, b. Both have a common m where

    G = (B1 C2 - B2 C1)(C1 A2 - C2 A1) - (A1 B2 - A2 B1)^2 = 0

(Wampler, Morgan & Sommese 1992). For a four-bar G is the equation of its coupler curve, of degree
three in d and in d': a point of the space of such curves, in which "through (d, d')" is linear.
Cognates have the same curve.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.numerics.double_double import WideComplex
from mechdae.types import Complexes

X, X_, A, A_, Y, Y_, B, B_ = range(8)
"""Places of the unknowns: pins and pivots of two links, each with its conjugate."""
LINKS = ((X, X_, A, A_), (Y, Y_, B, B_))
CONJUGATE = [X_, X, A_, A, Y_, Y, B_, B]
SWAPPED = [Y, Y_, B, B_, X, X_, A, A_]


def value(z: Complexes, d: Complexes, e: Complexes) -> Any:
    """Return G (n, k) of four-bars (n, 8) at places d, d' (k,)."""
    return _product(*_coefficients([z[:, i, None] for i in range(8)], d, e))


def wide_value(z: Complexes, d: Complexes, e: Complexes) -> Any:
    """Return the same, computed with twice the digits from the doubles given."""
    parts = [WideComplex.of(z[:, i, None]) for i in range(8)]
    return _product(*_coefficients(parts, WideComplex.of(d), WideComplex.of(e))).rounded()


def _coefficients(z: Any, d: Any, e: Any) -> list[Any]:
    found = []
    for x, x_, a, a_ in LINKS:
        x, x_, a, a_ = z[x], z[x_], z[a], z[a_]
        found += [x * (e - a_), x_ * (d - a), d * e - d * a_ - e * a + x * a_ + x_ * a]
    return found


def _product(A1: Any, B1: Any, C1: Any, A2: Any, B2: Any, C2: Any) -> Any:
    D = A1 * B2 - A2 * B1
    return (B1 * C2 - B2 * C1) * (C1 * A2 - C2 * A1) - D * D


def slopes(z: Complexes, d: Complexes, e: Complexes) -> tuple[Any, Any, Any, Any]:
    """Return G (n, k), its derivatives by the unknowns (n, k, 8), by d and by d'."""
    parts = [z[:, i, None] for i in range(8)]
    A1, B1, C1, A2, B2, C2 = _coefficients(parts, d, e)
    M, N, D = B1 * C2 - B2 * C1, C1 * A2 - C2 * A1, A1 * B2 - A2 * B1
    by = (
        (-M * C2 - 2 * D * B2, N * C2 + 2 * D * A2, M * A2 - N * B2),
        (M * C1 + 2 * D * B1, -N * C1 - 2 * D * A1, N * B1 - M * A1),
    )
    columns = []
    by_d = by_e = 0.0
    for (gA, gB, gC), places in zip(by, LINKS, strict=True):
        x, x_, a, a_ = (parts[i] for i in places)
        columns += [
            gA * (e - a_) + gC * a_, gB * (d - a) + gC * a,
            gC * (x_ - e) - gB * x_, gC * (x - d) - gA * x,
        ]  # fmt: skip
        by_d, by_e = by_d + gB * x_ + gC * (e - a_), by_e + gA * x + gC * (d - a)
    return M * N - D * D, np.stack(columns, axis=2), by_d, by_e


def turns(z: Any, d: Any, e: Any) -> Any:
    """Return the turns (n, k) of the coupler at places of its point, complex numbers."""
    A1, B1, C1, A2, B2, C2 = _coefficients([z[:, i, None] for i in range(8)], d, e)
    with np.errstate(all="ignore"):
        return (B1 * C2 - B2 * C1) / (A1 * B2 - A2 * B1)


def variants(z: Complexes) -> Complexes:
    """Return the six four-bars (6, n, 8) of each curve: three cognates, each with links swapped."""
    x, x_, a, a_, y, y_, b, b_ = z.T
    with np.errstate(all="ignore"):
        c, c_ = a + (b - a) * x / (x - y), a_ + (b_ - a_) * x_ / (x_ - y_)
        # parallelograms: the new pins of the links at a and b, and their common one at c
        xa, xa_, yb, yb_ = a - x, a_ - x_, b - y, b_ - y_
        s, s_ = x / (x - y), x_ / (x_ - y_)
        second = [xa, xa_, a, a_, xa - xa * s, xa_ - xa_ * s_, c, c_]
        third = [yb - yb * (1 - s), yb_ - yb_ * (1 - s_), c, c_, yb, yb_, b, b_]
    three = np.stack([z, np.stack(second, axis=1), np.stack(third, axis=1)])
    return np.concatenate([three, three[:, :, SWAPPED]])
