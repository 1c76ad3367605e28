"""Laws of impact: the impulses of contacts that close, of one or of several at once.

With the matrix G of inverse masses along the normals of the contacts that touch, and their speeds
u before and u' = u + G p behind the impact, no contact pulls: p >= 0. Newton's hypothesis speaks of
speeds, in the form of Moreau: each contact has u' >= -e u, with equality where p > 0. Poisson's
speaks of impulses: a compression ends with speeds that are not negative, then each contact gives
back e times its impulse, and more where it would close again.

Sources: J. J. Moreau, Unilateral contact and dry friction in finite freedom dynamics, 1988;
F. Pfeiffer, C. Glocker, Multibody Dynamics with Unilateral Contacts, 1996, ch. 8;
K. G. Murty, Linear Complementarity, Linear and Nonlinear Programming, 1988, ch. 4.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np

from mechdae.types import Floats, Matrix

ROUNDING = 1e-12
"""Share of the largest impulse or speed up to which one is none."""
MOST = 3
"""Contacts that close at once of which all orders are compared."""
TURNS = 200
"""Single impacts in one order after which the comparison is given up."""
APART = 1e-9
"""Share of the largest speed by which outcomes differ."""


def complementary(G: Matrix, q: Floats) -> Floats:
    """Return p >= 0 with G p + q >= 0 where only one of both is above zero, by least index.

    `G` (n, n) is symmetric and has no negative eigenvalue.
    """
    n = len(q)
    active = np.zeros(n, bool)
    p = np.zeros(n)
    size = float(np.abs(q).max(initial=0.0))
    for _ in range(4 * 2 ** min(n, 16)):
        p = np.zeros(n)
        if active.any():
            p[active] = np.linalg.lstsq(G[np.ix_(active, active)], -q[active], rcond=None)[0]
        w = G @ p + q
        pulls = active & (p < -ROUNDING * np.abs(p).max(initial=0.0))
        closes = ~active & (w < -ROUNDING * size)
        wrong = np.flatnonzero(pulls | closes)
        if not len(wrong):
            break
        active[wrong[0]] = not active[wrong[0]]
    return np.maximum(p, 0.0)


def newton(G: Matrix, before: Floats, e: Floats) -> Floats:
    """Return the impulses (n,) by Newton's hypothesis, from speeds (n,) and restitutions."""
    return complementary(G, before + e * np.minimum(before, 0.0))


def poisson(G: Matrix, before: Floats, e: Floats) -> Floats:
    """Return the impulses (n,) by Poisson's hypothesis."""
    compression = complementary(G, before)
    given_back = e * compression
    more = complementary(G, before + G @ (compression + given_back))
    return compression + given_back + more


LAWS: dict[str, Callable[[Matrix, Floats, Floats], Floats]] = {
    "newton": newton, "poisson": poisson,
}  # fmt: skip


def orders(G: Matrix, before: Floats, e: Floats) -> list[Floats]:
    """Return the speeds behind impacts that happen one after the other, for each order.

    Only contacts that close are put in orders, of many none.
    """
    closing = np.flatnonzero(before < 0).tolist()
    if not 2 <= len(closing) <= MOST:
        return []
    found, others = [], [i for i in range(len(before)) if i not in closing]
    for order in itertools.permutations(closing):
        speeds = before.copy()
        for _ in range(TURNS):
            turns = (*order, *others)
            first = next((i for i in turns if speeds[i] < -APART * np.abs(before).max()), None)
            if first is None:
                found.append(speeds)
                break
            speeds = speeds - G[:, first] * (1 + e[first]) * speeds[first] / G[first, first]
    return found


def unique(G: Matrix, before: Floats, e: Floats, after: Floats) -> bool:
    """Return whether single impacts in any order lead to the same speeds as all at once."""
    room = APART * float(np.abs(before).max(initial=0.0))
    return all(bool((np.abs(speeds - after) <= room).all()) for speeds in orders(G, before, e))
