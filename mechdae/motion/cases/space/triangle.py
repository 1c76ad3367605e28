"""Three points at given distances from each other, each on a circle or a line: all places.

A point on a circle is c + r (u (1 - z^2) + v 2 z) / (1 + z^2), z the tangent of half its angle, on
a line c + z r u. The squared distance of two is a polynomial of degree 2 in either z, once it is
freed of its denominators. Without lines or with one there are at most 16 solutions, with two 12,
with three 8: 16 is the number in which such polynomials of (z1, z2), (z2, z3) and (z3, z1) meet
(Bezout in P1 x P1 x P1; Nanua, Waldron and Murthy 1990), 8 that of three quadrics, 12 the degree of
the eliminant of random fractions (`python -m tests.scripts.three_points`).

Two of the unknowns are eliminated by resultants: what is left is a trigonometric polynomial of the
first angle, of degree 8, or a polynomial of the first length, whose roots come from an eigenvalue
problem. Newton's method leads to solutions, and Newton and Kantorovich's theorem proves them, as
in `mechdae.numerics.homotopy.certify`. With as many different ones as there can be there are no
others: the distances of other places would be near those of so many places and one more.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np

from mechdae.records import dataclass
from mechdae.types import Booleans, Complexes, Floats, Matrices, Matrix, Unknowns

MOST = (16, 16, 12, 8)
"""Solutions at most, by the number of lines."""
PAIRS = ((0, 1), (1, 2), (0, 2))
GRAIN = 1e-14
"""What rounding, and that of the numbers given, may make of a coefficient, by its terms."""
LEAST = 1e-9
"""Size of an equation by its terms below which it is nothing."""
LARGEST, BALL = 0.25, 0.1
BENDING = float(np.sqrt(3)) * (2 + 4 + 2) * (1 + BALL) ** 2
"""Bound of the second derivative in the ball, of polynomials whose coefficients sum up to 1."""
SAMPLES, NEWTON, POLISH = 32, 8, 6
REACHES = (1.0, 10.0, 100.0)
"""Lengths at which the eliminant is sampled, in turn."""
LOST = 1e-11
"""Coefficients of the eliminant below this share of the largest one are rounding."""
TURNED = (0.7137, 2.1961, 1.3219)
"""Angles from which those of circles count: no pose of interest is opposite of them."""
CLOSE = 1e-7
"""Largest error of a solution; those that are nearer to each other are one."""


@dataclass(frozen=True)
class PointCourse:
    """Where a point is led: ``centre`` + ``size`` u, the columns of ``frame`` (3, 3) u, v, axis.

    On a circle of radius ``size`` it is u cos + v sin, on a line along u (``straight``) by lengths
    in units of ``size``.
    """

    centre: Floats
    frame: Floats
    size: float
    straight: bool = False

    def at(self, value: float) -> Any:
        """Return the place (3,) at an angle, or at a length [m]."""
        u, v = self.frame[:, 0], self.frame[:, 1]
        if self.straight:
            return self.centre + value * u
        return self.centre + self.size * (np.cos(value) * u + np.sin(value) * v)


@dataclass(frozen=True)
class Triangles:
    """Real solutions: ``values`` (n, 3), angles, or lengths along lines.

    ``regular`` counts the certified complex ones; ``proven``: there are no more than those.
    """

    values: Any
    regular: int
    most: int
    proven: bool


def triangles(courses: Sequence[PointCourse], distances: Sequence[float]) -> Triangles | None:
    """Return all places of three points, None where the equations do not tell any.

    Parameters
    ----------
    courses
        Of points 1, 2, 3.
    distances
        Of points 1 and 2, 2 and 3, 3 and 1 [m].
    """
    order = sorted(range(3), key=lambda k: courses[k].straight)
    most = MOST[sum(course.straight for course in courses)]
    squares = {frozenset(pair): length**2 for pair, length in zip(PAIRS, distances, strict=True)}
    ordered = [courses[k] for k in order]
    found = [
        _equation(
            ordered[i], ordered[j], TURNED[i], TURNED[j], squares[frozenset((order[i], order[j]))]
        )
        for i, j in PAIRS
    ]
    C, terms = (np.stack([pair[k] for pair in found]) for k in (0, 1))
    size = np.abs(C).sum(axis=(1, 2))[:, None, None]
    if not (size[:, 0, 0] > LEAST * terms.sum(axis=(1, 2))).all():
        return None
    system = _System(C / size, GRAIN * terms / size, [o.straight for o in ordered])
    z = np.zeros((0, 3), complex)
    for k in range(3):  # where roots lie far apart another unknown may tell what one does not
        more = system.starts(k)
        z = z if more is None else np.concatenate([z, more])
        solved = system.solved(z)
        real, proven = system.judged(solved, most)
        if len(solved.z) >= most:
            break
    values = np.empty((len(real), 3))
    for i, k in enumerate(order):
        if ordered[i].straight:
            values[:, k] = real[:, i] * ordered[i].size
        else:
            values[:, k] = (TURNED[i] + 2 * np.arctan(real[:, i]) + np.pi) % (2 * np.pi) - np.pi
    values = values[np.lexsort(values.T[::-1])] if len(values) else values
    return Triangles(values, len(solved.z), most, proven)


def _polynomial(course: PointCourse, turned: float) -> tuple[Floats, Floats]:
    """Return the place (3,) as coefficients (3, 3) of powers of z, and the denominator (3,)."""
    u, v = course.frame[:, 0] * course.size, course.frame[:, 1] * course.size
    if course.straight:
        return np.stack([course.centre, u, np.zeros(3)], axis=1), np.array([1.0, 0, 0])
    c, s = np.cos(turned), np.sin(turned)
    u, v = c * u + s * v, c * v - s * u
    quadratic = np.stack([course.centre + u, 2 * v, course.centre - u], axis=1)
    return quadratic, np.array([1.0, 0, 1.0])


def _equation(
    one: PointCourse, other: PointCourse, turned: float, also: float, square: float
) -> tuple[Floats, Floats]:
    """Return the coefficients (3, 3) of |P - Q|^2 = square, and the sizes of their terms.

    |P - Q|^2 is |c|^2 + |p|^2 + |q|^2 + 2 c.p - 2 c.q - 2 p.q with p and q from the centres, whose
    difference is c; the squares of p and q are constants on circles.
    """
    c = one.centre - other.centre
    nothing = np.zeros(3)
    p, d = _polynomial(PointCourse(nothing, one.frame, one.size, one.straight), turned)
    q, e = _polynomial(PointCourse(nothing, other.frame, other.size, other.straight), also)
    pp = one.size**2 * (np.array([0, 0, 1.0]) if one.straight else d)
    qq = other.size**2 * (np.array([0, 0, 1.0]) if other.straight else e)
    found = (c @ c - square) * np.outer(d, e) + np.outer(pp, e) + np.outer(d, qq)
    found += 2 * np.outer(c @ p, e) - 2 * np.outer(d, c @ q) - 2 * p.T @ q
    far, (p, q) = np.abs(c), (np.abs(p), np.abs(q))
    terms = (c @ c + square) * np.outer(d, e) + np.outer(pp, e) + np.outer(d, qq)
    terms += 2 * np.outer(far @ p, e) + 2 * np.outer(d, far @ q) + 2 * p.T @ q
    return found, terms


@dataclass(frozen=True)
class Solved:
    """Complex solutions: ``z`` (n, 3) in a chart of each, in which circles are ``turned`` by pi.

    Of lines z is measured by ``size``. ``radius`` (n,) bounds the error, within ``alone`` there is
    no other solution.
    """

    z: Complexes
    turned: Any
    size: Any
    radius: Any
    alone: Any


class _System:
    """F12(z1, z2) = F23(z2, z3) = F13(z1, z3) = 0, coefficients (3, 3, 3) of sums 1."""

    def __init__(self, C: Matrices, noise: Matrices, straight: list[bool]) -> None:
        self.C, self.noise, self.straight = C, noise, np.array(straight)
        flips = np.array([[0, 0, 1], [0, -1, 0], [1, 0, 0.0]])  # z = -1 / z'
        self.flip = np.stack([np.eye(3), flips])

    # -- elimination -----------------------------------------------------------------------

    def starts(self, k: int) -> Any:
        """Return places (n, 3) to look from by way of unknown `k`, None without an eliminant."""
        i, j = (other for other in range(3) if other != k)
        a, b, c = self._of(k, i), self._of(k, j), self._of(i, j)
        first = self._first(a, b, c, REACHES[k] if self.straight[k] else 0.0)
        if first is None:
            return None
        powers = first[:, None] ** np.arange(3)
        second, third = _quadratic(powers @ a), _quadratic(powers @ b)
        found = np.empty((4, len(first), 3), complex)
        for solution, (m, n) in zip(found, product((0, 1), (0, 1)), strict=True):
            solution[:, k], solution[:, i], solution[:, j] = first, second[:, m], third[:, n]
        every: Complexes = found.reshape(-1, 3)
        return every[np.isfinite(every).all(axis=1)]

    def _of(self, i: int, j: int) -> Any:
        """Return the coefficients of the equation of two unknowns, by powers of the first."""
        form = self.C[PAIRS.index((min(i, j), max(i, j)))]
        return form if i < j else form.T

    @staticmethod
    def _first(a: Floats, b: Floats, C: Matrix, reach: float) -> Any:
        """Return the unknowns (n,) of all solutions: angles, or lengths of a size (reach > 0)."""
        w = np.exp(2j * np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES)
        if reach:
            powers, lowest = (reach * w)[:, None] ** np.arange(3), 0
        else:  # z = tan(a / 2): (1, z, z^2) cos^2(a / 2) on the unit circle of exp(ia)
            c, s = (w + 1 / w) / 2, (w - 1 / w) / 2j
            powers, lowest = np.stack([(1 + c) / 2, s / 2, (1 - c) / 2], axis=1), MOST[0] // 2
        values = _eliminant(powers @ a, powers @ b, C)
        turned = np.exp(-1j * np.pi * np.arange(SAMPLES) / SAMPLES)
        found = (np.fft.fft(values * w**lowest) / SAMPLES * turned)[: MOST[0] + 1]
        remaining = np.flatnonzero(np.abs(found) > LOST * np.abs(found).max())
        if not len(remaining) or not np.isfinite(found).all():
            return None
        roots = np.roots(found[remaining[0] : remaining[-1] + 1][::-1])
        if reach:
            return roots * reach
        with np.errstate(all="ignore"):
            z = -1j * (roots - 1) / (roots + 1)
        lost = [1j, -1j] if remaining[0] > 0 or remaining[-1] < MOST[0] else []
        return np.concatenate([z[np.isfinite(z)], lost])

    # -- solutions -------------------------------------------------------------------------

    def _charted(self, z: Complexes) -> tuple[Complexes, Booleans, Floats, Floats, Floats]:
        """Return z in charts where it is at most 1, which are turned, sizes, C and its noise."""
        turned = (np.abs(z) > 1) & ~self.straight
        z = np.where(turned, -1 / np.where(z == 0, 1, z), z)
        size = np.where(self.straight, np.maximum(np.abs(z), 1.0), 1.0)
        moves = self.flip[turned.astype(int)] * size[..., None, None] ** np.arange(3)[:, None]
        C, noise = (
            [
                np.einsum("ab,nax,nby->nxy", forms[k], by[:, i], by[:, j])
                for k, (i, j) in enumerate(PAIRS)
            ]
            for forms, by in ((self.C, moves), (self.noise, np.abs(moves)))
        )
        return z / size, turned, size, np.stack(C, axis=1), np.stack(noise, axis=1)

    def _values(self, C: Floats, z: Complexes) -> tuple[Complexes, Complexes]:
        """Return F (n, 3) and J (n, 3, 3)."""
        powers = z[:, :, None] ** np.arange(3)
        slopes = np.zeros_like(powers)
        slopes[:, :, 1], slopes[:, :, 2] = 1, 2 * z
        F, J = np.empty((len(z), 3), complex), np.zeros((len(z), 3, 3), complex)
        for k, (i, j) in enumerate(PAIRS):
            left = np.einsum("nab,na->nb", C[:, k], powers[:, i])
            right = np.einsum("nab,nb->na", C[:, k], powers[:, j])
            F[:, k] = (left * powers[:, j]).sum(axis=1)
            J[:, k, i] = (right * slopes[:, i]).sum(axis=1)
            J[:, k, j] = (left * slopes[:, j]).sum(axis=1)
        return F, J

    @np.errstate(all="ignore")
    def solved(self, z: Complexes) -> Solved:
        """Return the different solutions that Newton's method finds from places, certified."""
        z, turned, size, C, _ = self._charted(z.astype(complex))
        for _ in range(NEWTON):
            F, J = self._values(C, z)
            step = _solve(J, F)
            z = z - step / np.maximum(1.0, np.abs(step).max(axis=1))[:, None]
        again = np.where(turned, -1 / z, z * size)
        z, turned, size, C, noise = self._charted(again[np.isfinite(again).all(axis=1)])
        scale = np.abs(C).sum(axis=(2, 3))
        C = C / scale[:, :, None, None]
        for _ in range(POLISH):
            F, J = self._values(C, z)
            z = z - _solve(J, F)
        F, J = self._values(C, z)
        grain = noise.sum(axis=(2, 3)) / scale
        missed = np.linalg.norm(np.abs(F) + grain, axis=1)
        s = np.linalg.svd(np.where(np.isfinite(J), J, 0), compute_uv=False)[:, -1]
        beta = 1 / np.maximum(s - 4 * np.linalg.norm(grain, axis=1), 1e-300)
        radius, alone = 2 * beta * missed, np.minimum(1 / (2 * beta * BENDING), BALL)
        good = (beta**2 * BENDING * missed <= LARGEST) & (radius <= CLOSE)
        good &= np.isfinite(z).all(axis=1) & (np.abs(z).max(axis=1) <= 1 + BALL)
        every = Solved(*(part[good] for part in (z, turned, size, radius, alone)))
        near, remaining = self._gaps(every) < CLOSE, list[int]()
        for k in range(len(near)):
            if not near[k, remaining].any():
                remaining.append(k)
        parts = (every.z, every.turned, every.size, every.radius, every.alone)
        return Solved(*(part[remaining] for part in parts))

    def _gaps(self, found: Solved) -> Any:
        """Return how far solutions are apart at least (n, n): by chords and lengths."""
        z, turned, size = found.z, found.turned, found.size
        x, y = np.where(turned, -1, z), np.where(turned, z, 1)
        norm = np.sqrt(np.abs(x) ** 2 + np.abs(y) ** 2)
        x, y, length = x / norm, y / norm, z * size
        chords = np.abs(x[:, None] * y[None] - x[None] * y[:, None])
        gaps = np.abs(length[:, None] - length[None]) / np.maximum(size[:, None], size[None])
        return np.where(self.straight, gaps, chords).max(axis=2, initial=0.0)

    def judged(self, found: Solved, most: int) -> tuple[Floats, bool]:
        """Return z (n, 3) of the real solutions in no chart, and whether these are all."""
        gap = 2 * np.linalg.norm(found.z.imag, axis=1)
        real = gap + found.radius <= found.alone
        other = gap > 2 * found.radius
        gaps = self._gaps(found)
        np.fill_diagonal(gaps, np.inf)
        apart = bool((gaps > found.radius[:, None] + found.radius[None]).all())
        z = found.z[real].real
        with np.errstate(divide="ignore"):
            z = np.where(found.turned[real], -1 / z, z * found.size[real])
        return z, bool(len(real) == most and apart and (real | other).all())


def _solve(J: Complexes, F: Complexes) -> Any:
    """Return J^-1 F by Cramer's rule; not finite where J is singular."""
    a, b, c = J[:, :, 0], J[:, :, 1], J[:, :, 2]
    bc = np.cross(b, c)
    det = (a * bc).sum(axis=1)[:, None]
    ca, ab = np.cross(c, a), np.cross(a, b)
    return np.stack([(form * F).sum(axis=1) for form in (bc, ca, ab)], axis=1) / det


def _quadratic(c: Complexes) -> Complexes:
    """Return both roots (n, 2) of c0 + c1 x + c2 x^2, without cancellation."""
    with np.errstate(all="ignore"):
        root = np.sqrt(c[:, 1] ** 2 - 4 * c[:, 0] * c[:, 2])
        sign = np.where((np.conj(c[:, 1]) * root).real < 0, -1, 1)
        q = -(c[:, 1] + sign * root) / 2
        return np.stack([q / c[:, 2], c[:, 0] / q], axis=1)


def _eliminant(a: Complexes, b: Complexes, C: Matrix) -> Any:
    """Return the resultant (n,) of a(z2), b(z3) and C(z2, z3), quadratic in all of them."""
    n = len(a)
    # by z3: (b0 c2 - b2 c0)^2 - (b0 c1 - b1 c0) (b1 c2 - b2 c1), the c being quadratic in z2
    c0, c1, c2 = (C[:, k] for k in range(3))

    def by(i: int, j: int, x: Unknowns, y: Floats) -> Complexes:
        return b[:, i, None] * y - b[:, j, None] * x

    first, second, third = by(0, 2, c0, c2), by(0, 1, c0, c1), by(1, 2, c1, c2)
    g = np.zeros((n, 5), complex)
    for i in range(3):
        for j in range(3):
            g[:, i + j] += first[:, i] * first[:, j] - second[:, i] * third[:, j]
    S = np.zeros((n, 6, 6), complex)
    for k in range(4):
        S[:, k, k : k + 3] = a
    for k in range(2):
        S[:, 4 + k, k : k + 5] = g
    return np.linalg.det(S)
