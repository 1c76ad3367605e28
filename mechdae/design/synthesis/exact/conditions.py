"""Conditions of exact goals: points of a coupler curve with given dimensions, poses of a dyad.

Of a path the first point is the origin. Numbers are the other places d, then d', then the values of
the given dimensions; all may be complex. Dimensions are quadrics in the unknowns. A length of the
coupler is a ninth unknown where the coupler point is given along or across it.

Of a dyad that guides a plane through five poses (Burmester): in isotropic coordinates, with the
first pose as the origin, a pin w and a pivot g are four complex numbers (w, w', g, g'); at another
pose (p, p'), turned by (r, r'), the pin is as far from the pivot as at the first where

    p p' + w r p' + w' r' p - p g' - p' g - (r - 1) w g' - (r' - 1) w' g = 0

Four such equations are linear in (w, w') and in (g, g'): six solutions on two projective planes, of
which (0 : 1 : 0), (0 : 1 : 0) and its mirror image are at infinity for any poses. Four are left.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.random import Generator

from mechdae.design.synthesis.exact import coupler_curve as curve
from mechdae.design.synthesis.exact.coupler_curve import A_, B_, X_, Y_, A, B, X, Y
from mechdae.records import dataclass
from mechdae.types import Complexes, Floats, Matrices, Matrix

LENGTH = 8
NAMES = (
    "pivot_x", "pivot_y", "other_x", "other_y", "ground", "turn", "crank", "coupler", "rocker",
    "along", "across",
)  # fmt: skip
DIMENSIONS = 9
SIZE = 1.5
"""Size of generic complex numbers: that of real points is one."""
UNIT = 2.0**-53
ROUNDINGS = 1000
"""Roundings of the equation of a curve, or of a slope of it, by its size, with a reserve."""
PROBES = 5
"""Places at which a curve is taken for its key."""
W, W_, G, G_ = range(4)
COUNT = 4
"""Dyads through five poses, complex ones too."""
PLACES = 4


class _Jet:
    """A function over boxes of half widths r: value, slope (8), bounds of both, of H (8, 8)."""

    def __init__(self, v: Complexes, size: Floats, g: Complexes, H: Floats, r: Floats) -> None:
        Hr = np.einsum("nkij,nj->nki", H, r)
        self.v, self.size, self.g, self.H, self.r = v, size, g, H, r
        self.most_g = np.abs(g) + Hr
        self.most = np.abs(v) + np.einsum("nki,ni->nk", np.abs(g) + Hr / 2, r)

    def __mul__(self, other: _Jet) -> _Jet:
        outer = self.most_g[..., :, None] * other.most_g[..., None, :]
        H = self.most[..., None, None] * other.H + other.most[..., None, None] * self.H
        g = self.v[..., None] * other.g + other.v[..., None] * self.g
        H = H + outer + np.swapaxes(outer, -1, -2)
        return _Jet(self.v * other.v, self.size * other.size, g, H, self.r)

    def __sub__(self, other: _Jet) -> _Jet:
        size = self.size + other.size
        return _Jet(self.v - other.v, size, self.g - other.g, self.H + other.H, self.r)


@dataclass(frozen=True, eq=False)
class CurveBounds:
    """Bounds over boxes: of second derivatives (n, k, 8, 8), of the sums of absolute values that

    the equations (n, k) and their slopes (n, k, 8) are computed from.
    """

    H: Floats
    size: Any
    slopes: Any


def curve_bounds(z: Complexes, d: Complexes, e: Complexes, r: Floats) -> CurveBounds:
    """Return bounds of the equations of curves through places (k,) over boxes r (n, 8) about z."""
    (A1, B1, C1), (A2, B2, C2) = (_link(z, d, e, r, link) for link in curve.LINKS)
    M, N, D = B1 * C2 - B2 * C1, C1 * A2 - C2 * A1, A1 * B2 - A2 * B1
    G = M * N - D * D
    slopes = (
        M.size[..., None] * N.most_g + N.size[..., None] * M.most_g
        + 2 * D.size[..., None] * D.most_g
    )  # fmt: skip
    return CurveBounds(G.H, G.size, slopes)


def _link(
    z: Complexes, d: Complexes, e: Complexes, r: Floats, link: tuple[int, int, int, int]
) -> tuple[_Jet, _Jet, _Jet]:
    """Return the three coefficients of a link as jets."""
    columns = [z[:, i, None] for i in link]
    x, x_, a, a_ = columns
    s, s_, t, t_ = (np.abs(v) for v in columns)
    n, k = len(z), len(d)
    d, e = d[None], e[None]

    def jet(
        v: Complexes, size: Floats, slopes: dict[int, Complexes], pairs: tuple[tuple[int, int], ...]
    ) -> _Jet:
        g = np.zeros((n, k, 8), complex)
        for i, slope in slopes.items():
            g[:, :, link[i]] = slope
        H = np.zeros((8, 8))
        for i, j in pairs:
            H[link[i], link[j]] = H[link[j], link[i]] = 1
        return _Jet(v, size, g, np.broadcast_to(H, (n, k, 8, 8)), r)

    f, h = np.abs(d), np.abs(e)
    size = f * h + f * t_ + h * t + s * t_ + s_ * t
    return (
        jet(x * (e - a_), s * (h + t_), {0: e - a_, 3: -x}, ((0, 3),)),
        jet(x_ * (d - a), s_ * (f + t), {1: d - a, 2: -x_}, ((1, 2),)),
        jet(
            d * e - d * a_ - e * a + x * a_ + x_ * a, size,
            {0: a_, 1: a, 2: x_ - e, 3: x - d}, ((0, 3), (1, 2)),
        ),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Row:
    """z.Q z + (first + p slope).z - p^power; a power of 0 stands for nothing."""

    Q: Complexes
    first: Any
    slope: Any
    power: int


class PathConditions:
    """Rows of k points with 9 - k given dimensions, a family of equations."""

    def __init__(self, count: int, given: Iterable[str] = ()) -> None:
        self.count: int = count
        self.given: tuple[str, ...] = tuple(name for name in NAMES if name in set(given))
        if len(self.given) != DIMENSIONS - count:
            raise ValueError(f"{count} points and {len(self.given)} dimensions")
        self.long: bool = bool({"along", "across"} & set(self.given))
        self.unknowns: int = 8 + self.long
        self.places: int = count - 1
        self.size: int = 2 * self.places + len(self.given)
        self.quadrics: list[_Row] = [_quadric(name, self.long) for name in self.given]
        if self.long:
            Q = _form(9, (X, X_, 1), (X, Y_, -1), (Y, X_, -1), (Y, Y_, 1), (LENGTH, LENGTH, -1))
            self.quadrics.append(_Row(Q, np.zeros(9), np.zeros(9), 0))
        probes = np.random.default_rng(1442).normal(size=(4, PROBES))
        self.probes: Complexes = probes[:2] + 1j * probes[2:]

    # -- the family ----------------------------------------------------------------------------

    def rows(self, z: Complexes, p: Complexes, rate: Complexes) -> tuple[Any, Any, Any]:
        """Return rows (n, N), derivatives (n, N, N), and along a rate of the numbers (n, N)."""
        k, n = self.places, len(z)
        d, e = p[:, :k], p[:, k : 2 * k]
        G, slopes, by_d, by_e = curve.slopes(z, d, e)
        turned = by_d * rate[:, :k] + by_e * rate[:, k : 2 * k]
        N = self.unknowns
        J = np.zeros((n, N, N), complex)
        J[:, :k, :8] = slopes
        F, Ft = np.zeros((n, N), complex), np.zeros((n, N), complex)
        F[:, :k], Ft[:, :k] = G, turned
        for i, row in enumerate(self.quadrics):
            q, dq = self._value(p, i), self._value(rate, i)
            half = z @ row.Q
            F[:, k + i] = (half * z).sum(axis=1) + z @ row.first + q * (z @ row.slope)
            J[:, k + i] = 2 * half + row.first + q[:, None] * row.slope
            Ft[:, k + i] = dq * (z @ row.slope)
            if row.power:
                F[:, k + i] -= q**row.power
                Ft[:, k + i] -= row.power * q ** (row.power - 1) * dq
        with np.errstate(all="ignore"):
            s = np.abs(J).max(axis=2)
            s = np.where(s > 0, s, 1.0)
            return F / s, J / s[:, :, None], Ft / s

    def _value(self, p: Complexes, i: int) -> Any:
        """Return the value (n,) of a given dimension."""
        if i < len(self.given):
            return p[:, 2 * self.places + i]
        return np.zeros(len(p))

    def numbers(self, generator: Generator) -> Complexes:
        """Return generic complex numbers."""
        return SIZE * _complex(generator, self.size)

    def drawn(self, generator: Generator) -> tuple[Complexes, Complexes]:
        """Return generic complex numbers and a four-bar that keeps them, from its own turns."""
        z = _complex(generator, self.unknowns)
        if self.long:
            z[LENGTH] = np.sqrt((z[X] - z[Y]) * (z[X_] - z[Y_]))
        places: list[tuple[complex, complex]] = []
        while len(places) < self.places:
            m = np.exp(2j * (generator.normal() + 0.5j * generator.normal()))
            places.append(_reached(z, m, int(generator.integers(2))))
        d, e = np.array(places).T
        dimensions = [_dimension(name, z) for name in self.given]
        return np.concatenate([d, e, dimensions]), z

    def key(self, z: Complexes) -> Any:
        """Return what tells solutions apart: curves where nothing is given, else the unknowns."""
        if self.given:
            return z
        G = curve.value(z, *self.probes[:, None])
        with np.errstate(all="ignore"):
            return G[:, 1:] / G[:, :1]

    # -- real data -----------------------------------------------------------------------------

    def of(self, points: Complexes, given: Mapping[str, float]) -> Complexes:
        """Return the numbers of points (k,) complex and of given dimensions."""
        d = points[1:] - points[0]
        shift = {
            "pivot_x": points[0].real, "other_x": points[0].real,
            "pivot_y": points[0].imag, "other_y": points[0].imag,
        }  # fmt: skip
        dimensions = [
            np.exp(2j * given[name]) if name == "turn" else given[name] - shift.get(name, 0.0)
            for name in self.given
        ]
        return np.concatenate([d, d.conj(), np.array(dimensions, complex)])

    def split(self, p: Complexes) -> tuple[Complexes, Complexes]:
        """Return places d, d' of numbers (m,)."""
        return p[: self.places], p[self.places : 2 * self.places]

    @property
    def conjugate(self) -> list[int]:
        """Where the conjugate of each unknown stands."""
        return [*curve.CONJUGATE, LENGTH][: self.unknowns]

    def variants(self, z: Complexes) -> Complexes:
        """Return the six four-bars with the curve of each of some, where nothing is given."""
        return curve.variants(z).reshape(-1, 8)

    @property
    def cognate(self) -> bool:
        """Whether one solution stands for the six four-bars of its curve."""
        return not self.given

    # -- certificates --------------------------------------------------------------------------

    def symmetric(self, p: Complexes) -> bool:
        """Return whether numbers are those of real points and dimensions."""
        d, e = self.split(p)
        rest = p[2 * self.places :]
        turned = np.array([name == "turn" for name in self.given], bool)
        real = np.where(turned, np.abs(np.abs(rest) - 1) < 1e-12, rest.imag == 0)
        return bool((d.conj() == e).all() and real.all())

    def residual(self, p: Complexes, z: Complexes) -> tuple[Complexes, Complexes, Floats]:
        """Return rows (n, N) unscaled, those of points with twice the digits; slopes; roundings."""
        n, k, N = len(z), self.places, self.unknowns
        d, e = self.split(p)
        F, J = np.zeros((n, N), complex), np.zeros((n, N, N), complex)
        rounding = np.zeros((n, N))
        F[:, :k] = curve.wide_value(z, d[None], e[None])
        J[:, :k, :8] = curve.slopes(z, d[None], e[None])[1]
        size = curve_bounds(z, d, e, np.zeros((n, 8))).size
        rounding[:, :k] = ROUNDINGS * UNIT**2 * size + 4 * UNIT * np.abs(F[:, :k])
        for i, row in enumerate(self.quadrics):
            q = complex(self._value(p[None], i)[0])
            half, first = z @ row.Q, row.first + q * row.slope
            power = q**row.power if row.power else 0.0
            F[:, k + i], J[:, k + i] = (half * z).sum(axis=1) + z @ first - power, 2 * half + first
            size = np.einsum("ni,ij,nj->n", np.abs(z), np.abs(row.Q), np.abs(z)) + np.abs(power)
            rounding[:, k + i] = 4 * N * UNIT * (size + np.abs(z) @ np.abs(first))
        return F, J, rounding

    def bounds(self, p: Complexes, z: Complexes, r: Floats) -> tuple[Floats, Matrices]:
        """Return bounds of second derivatives (n, N, N, N) over boxes, of roundings of slopes."""
        n, k, N = len(z), self.places, self.unknowns
        found = curve_bounds(z, *self.split(p), r[:, :8])
        H, slack = np.zeros((n, N, N, N)), np.zeros((n, N, N))
        H[:, :k, :8, :8], slack[:, :k, :8] = found.H, ROUNDINGS * UNIT * found.slopes
        for i, row in enumerate(self.quadrics):
            H[:, k + i] = 2 * np.abs(row.Q)
            most = 2 * np.abs(z) @ np.abs(row.Q) + np.abs(row.first)
            slack[:, k + i] = 4 * N * UNIT * (most + np.abs(self._value(p[None], i)[0] * row.slope))
        return H, slack

    # -- hyperplanes ---------------------------------------------------------------------------

    def pencil(self, p: Complexes, weights: Complexes, probes: Complexes) -> Any:
        """Return (s0, s1) -> equations in which the last place is a hyperplane of curves.

        G(last place) - s sum(weights G(probes)) = 0, with places `probes` (2, q).
        """
        return lambda start, end: _Pencil(self, p, weights, probes, start, end)


class _Pencil:
    """Rows whose last point is replaced by G(place) = s sum(w G(probes)), from s0 to s1."""

    def __init__(
        self,
        family: PathConditions,
        p: Complexes,
        weights: Complexes,
        probes: Complexes,
        start: complex,
        end: complex,
    ) -> None:
        self.family, self.p, self.weights, self.probes = family, p[None], weights, probes
        self.start, self.rate = start, end - start

    def __call__(self, z: Complexes, t: Floats) -> tuple[Complexes, Complexes, Complexes]:
        family, last = self.family, self.family.places - 1
        F, J, Ft = family.rows(z, self.p, 0 * self.p)
        d, e = (values[-1:] for values in family.split(self.p[0]))
        G, by, _, _ = curve.slopes(z, d[None], e[None])
        P, by_p, _, _ = curve.slopes(z, *self.probes[:, None])
        s = self.start + t * self.rate
        scale = P @ self.weights
        own_by = by[:, 0] - s[:, None] * np.einsum("nki,k->ni", by_p, self.weights)
        size = np.abs(own_by).max(axis=1)
        F[:, last] = (G[:, 0] - s * scale) / size
        J[:, last, :8] = own_by / size[:, None]
        Ft[:, last] = -self.rate * scale / size
        return F, J, Ft


def _complex(generator: Generator, *shape: int) -> Complexes:
    return generator.normal(size=shape) + 1j * generator.normal(size=shape)


def _reached(z: Complexes, m: complex, which: int) -> tuple[complex, complex]:
    """Return a place d, d' that the coupler point reaches with a turn m, one of two."""
    rows = []
    for x, x_, a, a_ in ((z[i] for i in link) for link in curve.LINKS):
        rows.append((x_ / m - a_, x * m - a, x * a_ * (1 - m) + x_ * a * (1 - 1 / m)))
    (p, q, c), (p2, q2, c2) = rows  # d d' + p d + q d' + c = 0, and so the second
    u, v, w = p - p2, q - q2, c - c2
    d = np.roots([-u / v, p - (w + q * u) / v, c - q * w / v])[which]
    return d, -(w + u * d) / v


def _form(size: int, *terms: tuple[int, int, complex]) -> Complexes:
    """Return the symmetric matrix of a quadratic form."""
    Q = np.zeros((size, size), complex)
    for i, j, factor in terms:
        Q[i, j] += factor / 2
        Q[j, i] += factor / 2
    return Q


def _line(size: int, *terms: tuple[int, complex]) -> Complexes:
    found = np.zeros(size, complex)
    for i, factor in terms:
        found[i] += factor
    return found


def _quadric(name: str, long: bool) -> _Row:
    """Return the row of a given dimension."""
    n = 8 + long
    nothing = np.zeros(n, complex)
    if name in ("pivot_x", "pivot_y", "other_x", "other_y"):
        a, a_ = (A, A_) if name.startswith("pivot") else (B, B_)
        half = (0.5, 0.5) if name.endswith("x") else (-0.5j, 0.5j)
        return _Row(_form(n), _line(n, (a, half[0]), (a_, half[1])), nothing, 1)
    if name == "turn":
        return _Row(_form(n), _line(n, (B, 1), (A, -1)), _line(n, (B_, -1), (A_, 1)), 0)
    if name == "along":
        Q = _form(n, (X, X_, 2), (X, Y_, -1), (X_, Y, -1))
        return _Row(Q, nothing, _line(n, (LENGTH, -2)), 0)
    if name == "across":
        return _Row(_form(n, (X, Y_, -1), (X_, Y, 1)), nothing, _line(n, (LENGTH, -2j)), 0)
    if name == "coupler" and long:
        return _Row(_form(n), _line(n, (LENGTH, 1)), nothing, 1)
    (u, u_), (v, v_) = {
        "ground": ((A, A_), (B, B_)), "crank": ((X, X_), (A, A_)),
        "coupler": ((X, X_), (Y, Y_)), "rocker": ((Y, Y_), (B, B_)),
    }[name]  # fmt: skip
    return _Row(_form(n, (u, u_, 1), (u, v_, -1), (v, u_, -1), (v, v_, 1)), nothing, nothing, 2)


def _dimension(name: str, z: Complexes) -> complex:
    """Return the value of a dimension of a complex four-bar."""
    row = _quadric(name, len(z) > LENGTH)
    rest = z @ row.Q @ z + row.first @ z
    if row.power:
        return complex(rest if row.power == 1 else np.sqrt(rest))
    return complex(-rest / (row.slope @ z))


class DyadConditions:
    """Rows of five poses, a family of equations: numbers are p, p', r, r' of four poses."""

    unknowns, cognate = 4, False
    conjugate = [W_, W, G_, G]  # noqa: RUF012

    def rows(
        self, z: Complexes, p: Complexes, rate: Complexes
    ) -> tuple[Complexes, Complexes, Complexes]:
        """Return rows (n, 4), derivatives (n, 4, 4), and along a rate of the numbers (n, 4)."""
        F, J = self._values(z, p)
        w, w_, g, g_ = (z[:, i, None] for i in range(4))
        x, x_, r, r_ = np.split(p, 4, axis=1)
        dx, dx_, dr, dr_ = np.split(rate, 4, axis=1)
        Ft = dx * (x_ + w_ * r_ - g_) + dx_ * (x + w * r - g)
        Ft = Ft + dr * w * (x_ - g_) + dr_ * w_ * (x - g)
        return F, J, Ft

    @staticmethod
    def _values(z: Complexes, p: Complexes) -> tuple[Complexes, Complexes]:
        w, w_, g, g_ = (z[:, i, None] for i in range(4))
        x, x_, r, r_ = np.split(p, 4, axis=1)
        F = x * x_ + w * r * x_ + w_ * r_ * x - x * g_ - x_ * g - (r - 1) * w * g_
        F = F - (r_ - 1) * w_ * g
        J = np.stack(
            [r * x_ - (r - 1) * g_, r_ * x - (r_ - 1) * g, -x_ - (r_ - 1) * w_,
             -x - (r - 1) * w], axis=2,
        )  # fmt: skip
        return F, J

    def numbers(self, generator: Generator) -> Any:
        """Return generic complex numbers."""
        return SIZE * (generator.normal(size=16) + 1j * generator.normal(size=16))

    def drawn(self, generator: Generator) -> tuple[Complexes, Complexes]:
        """Return generic complex numbers and a dyad that keeps them."""
        z = generator.normal(size=4) + 1j * generator.normal(size=4)
        x, _, r, r_ = np.split(self.numbers(generator), 4)
        w, w_, g, g_ = z
        rest = w_ * r_ * x - x * g_ - (r - 1) * w * g_ - (r_ - 1) * w_ * g
        return np.concatenate([x, -rest / (x + w * r - g), r, r_]), z

    def key(self, z: Complexes) -> Any:
        """Return what tells solutions apart."""
        return z

    def of(self, places: Any, rotations: Any) -> Any:
        """Return the numbers of poses: places (5,), turns (5,) as unit complex numbers."""
        x, r = places[1:] - places[0], rotations[1:] / rotations[0]
        return np.concatenate([x, x.conj(), r, r.conj()])

    # -- certificates --------------------------------------------------------------------------

    def symmetric(self, p: Complexes) -> bool:
        """Return whether numbers are those of real poses."""
        x, x_, r, r_ = np.split(p, 4)
        return bool((x.conj() == x_).all() and (r.conj() == r_).all())

    def residual(self, p: Complexes, z: Complexes) -> tuple[Complexes, Complexes, Matrix]:
        """Return rows, slopes, and by how much rows may be wrong."""
        F, J = self._values(z, p[None])
        w, w_, g, g_ = (np.abs(z[:, i, None]) for i in range(4))
        x, x_, r, r_ = np.split(np.abs(p[None]), 4, axis=1)
        size = x * x_ + w * r * x_ + w_ * r_ * x + x * g_ + x_ * g + (r + 1) * w * g_
        return F, J, 32 * UNIT * (size + (r_ + 1) * w_ * g)

    def bounds(self, p: Complexes, z: Complexes, r: Matrix) -> tuple[Floats, Floats]:
        """Return bounds of second derivatives (constants) and of what is rounded in slopes."""
        n = len(z)
        x, x_, turn, turn_ = np.split(np.abs(p), 4)
        exact = np.split(p, 4)
        H = np.zeros((n, 4, 4, 4))
        H[:, :, W, G_] = H[:, :, G_, W] = np.abs(exact[2] - 1) * (1 + 4 * UNIT)
        H[:, :, W_, G] = H[:, :, G, W_] = np.abs(exact[3] - 1) * (1 + 4 * UNIT)
        w, w_, g, g_ = (np.abs(z[:, i, None]) for i in range(4))
        slack = np.stack(
            [turn * x_ + (turn + 1) * g_, turn_ * x + (turn_ + 1) * g,
             x_ + (turn_ + 1) * w_, x + (turn + 1) * w], axis=2,
        )  # fmt: skip
        return H, 16 * UNIT * slack
