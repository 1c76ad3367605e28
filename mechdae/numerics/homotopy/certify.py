"""Certificates of solutions of quadrics: that one is there, alone, real, apart from others.

Newton and Kantorovich (Ortega and Rheinboldt 1970): with beta = |J^-1|, eta = |J^-1 F| with the
rounding of F, K a bound of the second derivative and beta K eta <= 1/4 there is one solution within
2 eta, and no other within 1/(2 beta K).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.records import dataclass
from mechdae.types import Booleans, Complexes, Floats

UNIT = 2.0**-53
ROUNDINGS = 100
"""Roundings of a quadric of 64 terms in complex numbers, with a reserve."""
LARGEST = 0.25


@dataclass(frozen=True)
class CertifiedSolutions:
    """Of each of n solutions (n,): whether it is ``simple``, ``real``, not real (``other``).

    ``radius`` bounds its error in the chart of its largest entry, ``x`` (n, 8) is it there.
    """

    x: Complexes
    simple: Booleans
    real: Any
    other: Booleans
    radius: Floats
    alone: Floats


def certify(X: Complexes, Q: Complexes) -> CertifiedSolutions:
    """Certify homogeneous solutions (n, k) of real quadrics (k - 1, k, k)."""
    n, k = X.shape
    Q = Q / np.sqrt((np.abs(Q) ** 2).sum(axis=(1, 2), keepdims=True))
    K = 2 * np.sqrt(len(Q))
    largest = np.argmax(np.abs(X), axis=1)
    x = X / X[np.arange(n), largest][:, None]
    columns = np.array([[j for j in range(k) if j != m] for m in largest], int).reshape(n, k - 1)
    half = np.einsum("iab,nb->nia", Q, x)
    J = np.take_along_axis(2 * half, columns[:, None, :], axis=2)
    F = np.einsum("nia,na->ni", half, x)
    rounding = ROUNDINGS * UNIT * np.einsum("iab,na,nb->ni", np.abs(Q), np.abs(x), np.abs(x))
    with np.errstate(all="ignore"):
        s = np.linalg.svd(J, compute_uv=False)[:, -1]
        # the singular value itself is rounded
        beta = 1 / np.maximum(s - ROUNDINGS * UNIT * np.abs(J).sum(axis=(1, 2)), 1e-300)
        eta = beta * (np.linalg.norm(F, axis=1) + np.linalg.norm(rounding, axis=1))
        simple = beta * K * eta <= LARGEST
        radius, alone = 2 * eta, 1 / (2 * beta * K)
    gap = 2 * np.linalg.norm(x.imag, axis=1)
    return CertifiedSolutions(
        x, simple, simple & (gap + radius <= alone), simple & (gap > 2 * radius), radius, alone
    )


def apart(certified: CertifiedSolutions) -> bool:
    """Return whether all solutions are proven to be different ones."""
    x, radius = certified.x, certified.radius
    chart = np.argmax(np.abs(x), axis=1)
    for i in range(len(x)):
        scale = np.abs(x[:, chart[i]])
        with np.errstate(all="ignore"):
            other = x / x[:, chart[i]][:, None]
            # a ball of the other chart in this one: |y - y'| <= r (1 + |y|) / (scale - r)
            reach = radius * (1 + np.linalg.norm(other, axis=1)) / (scale - radius)
        gap = np.linalg.norm(other - x[i], axis=1)
        near = ~((gap > radius[i] + reach) & (scale > radius)) & (scale > radius)
        near[i] = False
        if near.any():
            return False
    return True
