"""Two bodies joined by six distances: the quadrics of a platform in Study's coordinates.

A pose is (e, g), e a quaternion and g = t e / 2 with the displacement t, up to a factor. With the
base points a, platform points b and legs L

    e.g = 0,  4 g.g + (a.a + b.b - L^2) e.e + 4 b.vec(e* g) - 4 a.vec(g e*) - 2 a.(e b e*) = 0.

They have 40 solutions at most (Ronga and Vust; Lazard; Mourrain).
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from mechdae.types import Complexes, Floats, Matrices, Unknowns

MOST = 40


def product(p: Complexes | Floats, q: Complexes | Floats) -> Complexes:
    """Return the quaternion product of arrays (..., 4), real part first."""
    a, b = p[..., :1], q[..., :1]
    u, v = p[..., 1:], q[..., 1:]
    real = a * b - (u * v).sum(axis=-1, keepdims=True)
    return np.concatenate([real, a * v + b * u + np.cross(u, v)], axis=-1)


def conjugate(q: object) -> Any:
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def displacement(X: Complexes) -> Any:
    """Return the displacements (n, 3) of poses (n, 8)."""
    e, g = X[..., :4], X[..., 4:]
    return 2 * product(g, conjugate(e))[..., 1:] / (e * e).sum(axis=-1, keepdims=True)


@cache
def _forms() -> tuple[Floats, ...]:
    """Return e.g, e.e, g.g (8, 8), vec(e* g), vec(g e*) (3, 8, 8) and e b e* (3, 3, 8, 8)."""
    basis = np.eye(8)
    X = (basis[:, None] + basis[None, :]).reshape(-1, 8)

    def polar(form: Any) -> Matrices:
        values = form(X).reshape(8, 8, -1)
        matrix = form(basis).reshape(8, -1)
        return np.moveaxis((values - matrix[:, None] - matrix[None, :]) / 2, -1, 0)

    def e(x: Unknowns) -> Floats:
        return x[..., :4]

    def g(x: Unknowns) -> Floats:
        return x[..., 4:]

    points = np.concatenate([np.zeros((3, 1)), np.eye(3)], axis=1)
    turned = [
        polar(lambda x, b=b: product(product(e(x), np.broadcast_to(b, e(x).shape)),
                                     conjugate(e(x)))[..., 1:])
        for b in points
    ]  # fmt: skip
    return (
        polar(lambda x: (e(x) * g(x)).sum(axis=-1))[0],
        polar(lambda x: (e(x) * e(x)).sum(axis=-1))[0],
        polar(lambda x: (g(x) * g(x)).sum(axis=-1))[0],
        polar(lambda x: product(conjugate(e(x)), g(x))[..., 1:]),
        polar(lambda x: product(g(x), conjugate(e(x)))[..., 1:]),
        np.stack(turned, axis=1),
    )


def quadrics(base: Complexes, platform: object, squares: Complexes) -> Complexes:
    """Return the matrices (7, 8, 8) of the quadrics; real or complex numbers."""
    eg, ee, gg, left, right, turned = _forms()
    a, b = np.asarray(base), np.asarray(platform)
    size = (a * a).sum(axis=1) + (b * b).sum(axis=1) - np.asarray(squares)
    legs = (
        4 * gg
        + size[:, None, None] * ee
        + 4 * np.einsum("ik,kxy->ixy", b, left)
        - 4 * np.einsum("ik,kxy->ixy", a, right)
        - 2 * np.einsum("ij,ik,jkxy->ixy", a, b, turned)
    )
    return np.concatenate([eg[None].astype(legs.dtype), legs])
