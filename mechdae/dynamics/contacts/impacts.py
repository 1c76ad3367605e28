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

from mechdae.types import Booleans, Floats, Integers, Matrix

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

    Only contacts that close are put in orders; of many both directions.
    """
    room = APART * float(np.abs(before).max(initial=0.0))
    closing = np.flatnonzero(before < -room).tolist()
    if len(before) < 2 or not closing:
        return []
    found, others = [], [i for i in range(len(before)) if i not in closing]
    many = len(closing) > MOST
    for order in (closing, closing[::-1]) if many else itertools.permutations(closing):
        speeds = before.copy()
        for _ in range(TURNS):
            turns = (*order, *others)
            first = next((i for i in turns if speeds[i] < -room), None)
            if first is None:
                found.append(speeds)
                break
            speeds = speeds - G[:, first] * (1 + e[first]) * speeds[first] / G[first, first]
    return found


def unique(G: Matrix, before: Floats, e: Floats, after: Floats) -> bool:
    """Return whether single impacts in any order lead to the same speeds as all at once."""
    room = APART * float(np.abs(before).max(initial=0.0))
    return all(bool((np.abs(speeds - after) <= room).all()) for speeds in orders(G, before, e))


class RubbingImpacts:
    """Impacts of contacts that rub: Coulomb's law of impulses, without a tangential rebound.

    All ways are tried, each contact open or closed, sticking or sliding to either side.

    Parameters
    ----------
    G
        Of the normals (n,), then of the tangents of the contacts that rub.
    rubs
        Places of these contacts among the n.
    mu
        Their coefficients.
    """

    def __init__(self, G: Matrix, rubs: Integers, mu: Floats) -> None:
        self.G, self.rubs, self.mu = G, rubs, mu
        self.n = len(G) - len(rubs)

    def newton(self, before: Floats, e: Floats) -> list[Floats]:
        """Return the impulses of all ways that fit, by Newton's hypothesis."""
        return self._ways(before, e * np.minimum(before[: self.n], 0.0), np.zeros(self.n))

    def poisson(self, before: Floats, e: Floats) -> list[Floats]:
        """Return the same by Poisson's hypothesis, of the first compression that fits."""
        none = np.zeros(self.n)
        for compression in self._ways(before, none, none)[:1]:
            given_back = e * compression[: self.n]
            middle = before + self.G @ compression
            return [compression + more for more in self._ways(middle, none, given_back)]
        return []

    def _ways(self, before: Floats, wanted: Floats, given: Floats) -> list[Floats]:
        """Return impulses p with u' + wanted >= 0 complementary to p - given >= 0."""
        found: list[Floats] = []
        sides = itertools.product((0.0, 1.0, -1.0), repeat=len(self.rubs))
        for way, closed in itertools.product(sides, itertools.product((1, 0), repeat=self.n)):
            p = self._impulses(before, wanted, given, np.array(way), np.array(closed, bool))
            if p is not None and not any(self._same(p, other) for other in found):
                found.append(p)
        return found

    def _same(self, p: Floats, other: Floats) -> bool:
        u, v = self.G @ p, self.G @ other
        return bool((np.abs(u - v) <= APART * np.abs(u).max(initial=0.0)).all())

    def _impulses(
        self, before: Floats, wanted: Floats, given: Floats, way: Floats, closed: Booleans
    ) -> Floats | None:
        """Return the impulses of one way, None where it does not fit."""
        n, size = self.n, len(self.G)
        A, b = np.eye(size), np.concatenate([given, np.zeros(size - n)])
        A[:n][closed] = self.G[:n][closed]
        b[:n][closed] = -(before[:n] + wanted)[closed]
        for j, (k, side) in enumerate(zip(self.rubs.tolist(), way.tolist(), strict=True), n):
            if side:
                A[j, k] = side * self.mu[j - n]
            else:
                A[j], b[j] = self.G[j], -before[j]
        p = np.linalg.lstsq(A, b, rcond=None)[0]
        after = before + self.G @ p
        if np.abs(A @ p - b).max(initial=0.0) > APART * np.abs(b).max(initial=0.0):
            return None
        push, speed = (ROUNDING * np.abs(part).max(initial=0.0) for part in (p, before))
        limit = self.mu * p[self.rubs]
        fits = (p[:n] >= given - push).all() and (after[:n] + wanted >= -speed).all()
        fits &= (np.abs(p[n:]) <= limit + push).all() and (way * after[n:] >= -speed).all()
        return p if fits else None
