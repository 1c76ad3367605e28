"""All poses of a platform on six legs (Stewart and Gough), certified.

They are followed in an affine chart in which solutions at infinity are regular too. The first leg's
points are the origins of both bodies. The displacement is t = 2 vec(f e*) / e.e for any f + m e, e
and f being quaternions, so that with a generic complex c there is one of them with

    c.e = 1,  c.f = 0,

six unknowns. The first leg is 4 (f.f e.e - (e.f)^2) = L^2 (e.e)^2; of the others its square less
that of the first is divided by e.e, and a quadric. Where t grows beyond all bounds e.e vanishes,
and e and f stay what they are.

Two bodies joined by six distances: the quadrics of a platform in Study's coordinates.

A pose is (e, g), e a quaternion and g = t e / 2 with the displacement t, up to a factor. With the
base points a, platform points b and legs L

    e.g = 0,  4 g.g + (a.a + b.b - L^2) e.e + 4 b.vec(e* g) - 4 a.vec(g e*) - 2 a.(e b e*) = 0.

They have 40 solutions at most (Ronga and Vust; Lazard; Mourrain).
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from mechdae.errors import InputError
from mechdae.numerics.homotopy.certify import CertifiedSolutions, apart, certify
from mechdae.numerics.homotopy.tracker import System, distinct, track
from mechdae.records import dataclass
from mechdae.types import Booleans, Complexes, Floats, Matrices, Unknowns

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


UNIT = 2.0**-53
ROUNDINGS = 200
"""Roundings of a sum of 64 products of rounded complex numbers, with a reserve."""
LARGEST = 0.25
BALL = 0.1
"""Radius of the balls in which second derivatives are bounded."""
BENDING = float(np.sqrt(5 * 2**2 + 1))
"""Bound of the second derivative: 2 of quadrics of norm 1; the last row is divided by its own."""
NOT_REAL = 1e-9
"""Share of |e|^2 by which |e.e| has to be less."""


@dataclass(frozen=True)
class ChartedSolutions:
    """Of each of n solutions ``y`` (n, 6), (e, f) ``X`` (n, 8): whether it is ``simple``.

    ``other`` ones are no real poses. ``radius`` bounds the error; within ``alone`` it is alone.
    """

    y: Complexes
    X: Complexes
    simple: Booleans
    other: Booleans
    radius: Floats
    alone: Floats


def _form(pairs: list[tuple[int, int]]) -> Floats:
    result = np.zeros((8, 8))
    for i, j in pairs:
        result[i, j] += 0.5
        result[j, i] += 0.5
    return result


EE, EF, FF = (
    _form([(i + a, i + b) for i in range(4)]) for a, b in ((0, 0), (0, 4), (4, 4))
)  # fmt: skip


def from_first_leg(
    base: Complexes | Floats, platform: Complexes | Floats, squares: Complexes | Floats
) -> Complexes:
    """Return the numbers (36,) of a platform: points 2 to 6 from the first, squared legs."""
    return np.concatenate(
        [(base[1:] - base[0]).ravel(), (platform[1:] - platform[0]).ravel(), squares]
    )


def points(p: Complexes | Floats) -> tuple[Complexes, Complexes]:
    """Return base and platform (6, 3) of a platform's numbers."""
    nothing = np.zeros((1, 3))
    base, platform = (np.concatenate([nothing, rows.reshape(5, 3)]) for rows in (p[:15], p[15:30]))
    return base, platform


def study(X: Complexes) -> Any:
    """Return (e, g) with e.g = 0 of solutions (e, f), as (n, 8) of size 1."""
    e, f = X[:, :4], X[:, 4:]
    square, both = (e * e).sum(axis=1)[:, None], (e * f).sum(axis=1)[:, None]
    result = np.concatenate([square * e, square * f - both * e], axis=1)
    return result / np.maximum(np.linalg.norm(result, axis=1), 1e-300)[:, None]


def numbers_along(start: Complexes, end: Complexes, bend: Any = None) -> Complexes:
    """Return the numbers (k, 36) along a route by powers of t: start + t (end - start) + ..."""
    slope = end - start
    if bend is None:
        return np.stack([start, slope])
    return np.stack([start, slope + bend, -bend])


class StudyChart:
    """The solutions with c.e = 1 and c.f = 0, as y (n, 6)."""

    def __init__(self, c: Complexes) -> None:
        self.c: Complexes = c / np.linalg.norm(c)
        q, _ = np.linalg.qr(np.concatenate([self.c.conj()[:, None], np.eye(4)], axis=1))
        across = q[:, 1:4]
        self.basis: Complexes = np.zeros((8, 7), complex)
        """(e, f) = basis (1, y); its columns are orthonormal."""
        self.basis[:4, 0] = self.c.conj()
        self.basis[:4, 1:4] = self.basis[4:, 4:] = across

    def solutions(self, y: Complexes) -> Complexes:
        """Return (e, f) as (n, 8)."""
        return y @ self.basis[:, 1:].T + self.basis[:, 0]

    def coordinates(self, X: Complexes) -> Any:
        """Return y of solutions (e, f), of which any multiple and any f + m e will do."""
        e, f = X[:, :4], X[:, 4:]
        s = (e @ self.c)[:, None]
        f = (f - (f @ self.c)[:, None] / s * e) / s
        return np.concatenate([e / s, f], axis=1) @ self.basis[:, 1:].conj()

    def _rows(self, p: Complexes) -> Any:
        Q = quadrics(*points(p), p[30:])
        return np.einsum("iab,ax,by->ixy", Q[2:] - Q[1], self.basis, self.basis)

    def system(self, route: Complexes) -> System:
        """Return the equations along a route of numbers (k, 36) by powers of t."""
        degree = 2 * (len(route) - 1)
        t = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1)) / 2 + 0.5
        powers = np.vander(t, increasing=True)
        values = np.stack([self._rows(numbers) for numbers in powers[:, : len(route)] @ route])
        Q = np.tensordot(np.linalg.inv(powers), values, axes=1)
        forms = np.einsum("iab,ax,by->ixy", np.stack([EE, EF, FF]), self.basis, self.basis)
        flat = np.concatenate([Q.reshape(-1, 7), forms.reshape(-1, 7)]).T.copy()
        first = np.concatenate([route[:, 30], np.zeros(degree + 1 - len(route))])
        d, exponents = degree + 1, np.arange(degree + 1)

        def system(y: Complexes, t: Floats) -> tuple[Complexes, Complexes, Complexes]:
            n = len(y)
            Y = np.ones((n, 7), complex)
            Y[:, 1:] = y
            every = Y @ flat
            powers = np.zeros((n, 2, d))
            powers[:, 0] = t[:, None] ** exponents
            powers[:, 1, 1:] = powers[:, 0, :-1] * exponents[1:]
            half = (powers @ every[:, : 35 * d].reshape(n, d, 35)).reshape(n, 10, 7)
            values = (half @ Y[:, :, None])[:, :, 0]
            turned = every[:, 35 * d :].reshape(n, 3, 7)
            ee, ef, ff = (turned @ Y[:, :, None])[:, :, 0].T
            square, rate = (powers @ first).T
            F, Ft = np.empty((n, 6), complex), np.empty((n, 6), complex)
            J = np.empty((n, 6, 6), complex)
            F[:, :5], Ft[:, :5], J[:, :5] = values[:, :5], values[:, 5:], 2 * half[:, :5, 1:]
            F[:, 5], Ft[:, 5] = 4 * (ff * ee - ef * ef) - square * ee * ee, -rate * ee * ee
            factors = np.stack([8 * ff - 4 * square * ee, -16 * ef, 8 * ee], axis=1)
            J[:, 5] = (factors[:, None] @ turned[:, :, 1:])[:, 0]
            return F, J, Ft

        return system

    def certify(self, p: Any, y: Complexes) -> ChartedSolutions:
        """Certify solutions y (n, 6) of a real platform: Newton and Kantorovich, as in `certify`.

        Second derivatives are bounded in the ball of radius `BALL`.
        """
        X = self.solutions(y)
        Q = quadrics(*points(p), p[30:])
        D, terms, square = Q[2:] - Q[1], np.abs(Q[2:]) + np.abs(Q[1]), p[30]
        size = np.sqrt((D**2).sum(axis=(1, 2)))[:, None, None]
        D, terms, large = D / size, terms / size, np.abs(X)
        e, f = (np.linalg.norm(half, axis=1) for half in (X[:, :4], X[:, 4:]))
        E, G = e + BALL, f + BALL
        bent = 16 * (E**2 + G**2) + 40 * E * G + 12 * square * E**2
        half = np.einsum("iab,nb->nia", D, X)
        turned = np.einsum("iab,nb->nia", np.stack([EE, EF, FF]), X)
        ee, ef, ff = np.einsum("nia,na->in", turned, X)
        last = 4 * (ff * ee - ef * ef) - square * ee * ee
        F = np.concatenate([np.einsum("nia,na->ni", half, X), (last / bent)[:, None]], axis=1)
        noise = np.concatenate(
            [
                np.einsum("iab,na,nb->ni", terms, large, large),
                ((8 * e**2 * f**2 + square * e**4) / bent)[:, None],
            ],
            axis=1,
        )
        factors = np.stack([8 * ff - 4 * square * ee, -16 * ef, 8 * ee], axis=1)
        row = np.einsum("ni,nia->na", factors / bent[:, None], turned)
        J = np.concatenate([2 * half, row[:, None]], axis=1) @ self.basis[:, 1:]
        slopes = 2 * np.linalg.norm(terms) * np.linalg.norm(X, axis=1) + e + f
        with np.errstate(all="ignore"):
            s = np.linalg.svd(J, compute_uv=False)[:, -1]
            beta = 1 / np.maximum(s - ROUNDINGS * UNIT * slopes, 1e-300)
            missed = np.linalg.norm(F, axis=1) + ROUNDINGS * UNIT * np.linalg.norm(noise, axis=1)
            radius, alone = 2 * beta * missed, np.minimum(1 / (2 * beta * BENDING), BALL)
            simple = (beta**2 * missed * BENDING <= LARGEST) & (radius <= BALL)
            # of a real pose e is a multiple of a real one: |e.e| = |e|^2
            other = np.abs(ee) + 2 * e * radius + radius**2 < (1 - NOT_REAL) * (e - radius) ** 2
        return ChartedSolutions(y, X, simple, simple & other & (radius < e), radius, alone)


def all_apart(found: ChartedSolutions) -> bool:
    """Return whether all solutions are proven to be different ones."""
    gaps = np.linalg.norm(found.y[:, None] - found.y[None], axis=2)
    np.fill_diagonal(gaps, np.inf)
    return bool((gaps > found.radius[:, None] + found.radius[None]).all())


def same(chart: StudyChart, charted: ChartedSolutions, found: CertifiedSolutions) -> Any:
    """Return (n,) whether solutions certified as (e, g) are those that are certified in a chart.

    Their balls are carried over: e / c.e and (g - (c.g / c.e) e) / c.e, with |c| = 1.
    """
    x, r = found.x, found.radius
    with np.errstate(all="ignore"):
        e, g = (np.linalg.norm(half, axis=1) + r for half in (x[:, :4], x[:, 4:]))
        s = np.abs(x[:, :4] @ chart.c) - r
        moved = r * (1 / s + e / s**2) + r * (1 / s + (e + 2 * g) / s**2 + 2 * g * e / s**3)
        off = np.linalg.norm(chart.coordinates(x) - charted.y, axis=1)
        return found.simple & (s > 0) & (off + moved <= charted.alone)


STORE = Path(__file__).resolve().parent / "platform.json"
ROUTES = 4
FLAT = 1e-7
"""Size of e.e by |e|^2 below which a solution is no pose."""
SIMPLE = 1e-9
"""Last Newton step of an end point that is a simple solution, by the size 1 of (e, g)."""
SAME = 1e-6


@dataclass(frozen=True)
class PlatformPoses:
    """Real poses: ``position`` (n, 3) and ``quaternion`` (n, 4), real part first.

    The largest entry of a quaternion is positive; ``error`` (n,) bounds that of (e, g) by its size.
    ``regular`` counts the simple complex solutions ``every`` (m, 8), (e, g) in units of ``size``,
    ``far`` those at infinity, or so far out that only the chart of `study_chart` tells them,
    ``singular`` paths that end in others. ``basis`` is "theorem" where all 40 are certified and
    different (the real ones are all there are: ``proven``), "homotopy" where fewer are.
    """

    position: Floats
    quaternion: Floats
    error: Floats
    regular: int
    far: int
    singular: int
    basis: str
    every: Complexes
    size: float

    @property
    def proven(self) -> bool:
        return self.basis == "theorem"

    def complex_places(self, point: Floats) -> tuple[Complexes, Complexes]:
        """Return the places (m, 3) of a point (3,) of the platform, and the unit quaternions."""
        e = self.every[:, :4]
        e = e / np.sqrt((e * e).sum(axis=1))[:, None]
        turned = product(product(e, np.concatenate([[0], point])[None]), conjugate(e))[:, 1:]
        return self.size * displacement(self.every) + turned, e


@cache
def generic() -> tuple[Complexes, Complexes]:
    """Return the parameters (42,) of a generic complex platform and its 40 solutions, checked."""
    data = json.loads(STORE.read_text(encoding="utf-8"))
    p = np.array(data["parameters"]) @ [1, 1j]
    X = np.array(data["solutions"]) @ [1, 1j]
    Q = quadrics(p[:18].reshape(6, 3), p[18:36].reshape(6, 3), p[36:])
    found = certify(X, Q)
    if len(X) != MOST or not found.simple.all() or not apart(found):
        raise InputError("the stored solutions do not solve their platform", where=str(STORE))
    return p, X


def platform_poses(
    base: Floats | list[Floats], platform: Floats | list[Floats], legs: Floats | list[float]
) -> PlatformPoses:
    """Return all poses at which six points of a platform keep their distances from a base.

    Parameters
    ----------
    base, platform
        Points (6, 3), each in its own body [m].
    legs
        Their distances (6,) [m].

    Returns
    -------
    PlatformPoses
        ``position`` (n, 3) [m] and ``quaternion`` (n, 4) of the n real poses; ``proven`` where all
        40 complex solutions are certified.

    Raises
    ------
    InputError
        Not six points or legs, a leg whose length is not above 0.

    Notes
    -----
    There are at most 40 complex poses: M. Raghavan, ASME J. Mech. Des. 115 (1993).

    Examples
    --------
    >>> base = [[1, 0, 0], [0.6, 0.9, 0.1], [-0.5, 0.8, 0], [-1, 0.1, 0.2], [-0.4, -0.9, 0]]
    >>> top = [[0.5, 0.1, 0], [0.2, 0.5, 0], [-0.3, 0.4, 0.1], [-0.5, 0, 0], [-0.2, -0.4, 0]]
    >>> legs = [1.3, 1.2, 1.25, 1.3, 1.2, 1.35]
    >>> poses = md.platform_poses([*base, [0.7, -0.6, 0]], [*top, [0.3, -0.5, 0.1]], legs)
    >>> poses.regular, len(poses.position)
    (40, 6)
    """
    a, b, lengths = (np.asarray(given, float) for given in (base, platform, legs))
    if a.shape != (6, 3) or b.shape != (6, 3) or lengths.shape != (6,):
        raise InputError("six points of three coordinates on either body and six legs are needed")
    if not (lengths > 0).all():
        raise InputError("legs have lengths above 0", where="legs")
    here = np.stack([a - a[0], b - b[0]])
    size = float(np.sqrt((here**2).mean(axis=(1, 2)).sum() * 3 + (lengths**2).mean()))
    p = from_first_leg(a / size, b / size, (lengths / size) ** 2)
    chart, y = _followed(p)
    X = study(chart.solutions(y))
    e = X[:, :4]
    square = np.abs((e * e).sum(axis=1)) / np.maximum((np.abs(e) ** 2).sum(axis=1), 1e-300)
    found = certify(X, quadrics(*points(p), p[30:]))
    regular = found.simple & (square > FLAT)
    every, far = int(regular.sum()), 0
    whole = every == MOST and bool((found.real | found.other).all()) and apart(found)
    if len(y) == MOST and not whole:
        charted = chart.certify(p, y)
        whole = _whole(chart, charted, found, regular)
        far = MOST - every if whole else 0
    poses = found.x[regular & found.real].real
    place = displacement(poses) + (a[0] - _turned(poses, b[0])) / size
    order: Any = np.lexsort(np.round(place, 9).T) if len(poses) else []
    e = poses[order, :4]
    norm = np.linalg.norm(e, axis=1, keepdims=True)
    top = np.take_along_axis(e, np.argmax(np.abs(e), axis=1)[:, None], axis=1)
    error = found.radius[regular & found.real][order] / np.maximum(norm[:, 0], 1e-300)
    return PlatformPoses(
        size * place[order],
        e / (norm * np.sign(top)),
        error,
        every,
        far,
        MOST - every - far,
        "theorem" if whole else "homotopy",
        _moved(found.x[regular], a[0] / size, b[0] / size),
        size,
    )


def _whole(
    chart: StudyChart, charted: ChartedSolutions, found: CertifiedSolutions, regular: Booleans
) -> bool:
    """Return whether 40 different solutions are certified, each real one of them by `found` too."""
    decided = charted.other | (regular & (found.real | found.other) & same(chart, charted, found))
    return bool(charted.simple.all() and decided.all() and all_apart(charted))


def _pure(v: Complexes | Floats) -> Complexes:
    return np.concatenate([[0.0], v])[None]


def _turned(X: Unknowns, v: Floats) -> Any:
    """Return a vector (3,) of the platform in poses (n, 8), as (n, 3)."""
    e = X[:, :4]
    turned = product(product(e, _pure(v)), conjugate(e))[:, 1:]
    return turned / (e * e).sum(axis=1)[:, None]


def _moved(X: Complexes, a: Complexes, b: Complexes) -> Complexes:
    """Return poses (n, 8) told from points a and b of both bodies as such from their origins."""
    e, g = X[:, :4], X[:, 4:]
    return np.concatenate([e, g + (product(_pure(a), e) - product(e, _pure(b))) / 2], axis=1)


def _followed(p: Any) -> tuple[StudyChart, Complexes]:
    """Return the simple solutions (n, 6) that routes lead to, until one brings nothing new."""
    generic_p, first = generic()
    start = from_first_leg(
        generic_p[:18].reshape(6, 3), generic_p[18:36].reshape(6, 3), generic_p[36:]
    )
    first = _moved(first, -generic_p[:3], -generic_p[18:21])
    rng = np.random.default_rng(20)
    whole: StudyChart | None = None
    best = np.zeros((0, 6), complex)
    for number in range(ROUTES):
        chart = StudyChart(rng.normal(size=4) + 1j * rng.normal(size=4))
        bend = None
        if number:
            bend = (rng.normal(size=36) + 1j * rng.normal(size=36)) * 0.5
        system = chart.system(numbers_along(start, p.astype(complex), bend))
        ends = track(system, chart.coordinates(first), relative=True, hasty=True)
        size = np.maximum(np.linalg.norm(ends.x, axis=1), 1)
        y = ends.x[ends.followed & (ends.step < SIMPLE * size)]
        if whole is None:
            whole = chart
        else:
            y = whole.coordinates(chart.solutions(y))
        known, every = len(best), np.concatenate([best, y])
        size = np.maximum(np.linalg.norm(every, axis=1), 1)[:, None]
        best = every[distinct(every / size, SAME)]
        if len(best) == MOST or (number and len(best) == known):
            break
    assert whole is not None
    return whole, best
