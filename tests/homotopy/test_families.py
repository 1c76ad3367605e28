"""Families of equations: ways, round trips, trace tests, boxes, ends at infinity.

Expected are roots of binomials and of polynomials with known factors, in closed form.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache

import mpmath
import numpy as np
import pytest

from mechdae.numerics.double_double import WideComplex
from mechdae.numerics.homotopy.boxes import apart, enclosed
from mechdae.numerics.homotopy.families import arrived, far_ends, round_trip, there, trace_test, way

DEGREE = 5
POWERS = np.arange(DEGREE)
UNIT = 2.0**-53


class Polynomial:
    """x^5 + p4 x^4 + ... + p0 = 0 and y = x^2, with bounds of what is rounded."""

    unknowns = 2
    conjugate = (0, 1)

    def rows(self, z, p, rate):
        x, y = z.T
        powers = x[:, None] ** POWERS
        slopes = POWERS * x[:, None] ** np.maximum(POWERS - 1, 0)
        F = np.stack([x**DEGREE + (p * powers).sum(axis=1), y - x * x], axis=1)
        J = np.zeros((len(z), 2, 2), complex)
        J[:, 0, 0] = DEGREE * x ** (DEGREE - 1) + (p * slopes).sum(axis=1)
        J[:, 1, 0], J[:, 1, 1] = -2 * x, 1
        return F, J, np.stack([(rate * powers).sum(axis=1), 0 * x], axis=1)

    def numbers(self, generator):
        return generator.normal(size=DEGREE) + 1j * generator.normal(size=DEGREE)

    def drawn(self, generator):
        x, *p = self.numbers(generator)
        x = x / abs(x)
        p = np.array([0.0, *p])
        p[0] = -(x**DEGREE) - p @ x**POWERS
        return p, np.array([x, x * x])

    def key(self, z):
        return z

    def symmetric(self, p):
        return bool((p.imag == 0).all())

    def residual(self, p, z):
        F, J, _ = self.rows(z, p[None], 0 * p[None])
        x, y = np.abs(z).T
        size = x**DEGREE + (np.abs(p) * x[:, None] ** POWERS).sum(axis=1)
        return F, J, 64 * UNIT * np.stack([size, y + x * x], axis=1)

    def bounds(self, p, z, r):
        H, slack = np.zeros((len(z), 2, 2, 2)), np.zeros((len(z), 2, 2))
        far = (np.abs(z[:, 0]) + r[:, 0])[:, None]
        every = np.append(np.abs(p), 1.0)
        k = np.arange(DEGREE + 1)
        H[:, 0, 0, 0] = (every * k * (k - 1) * far ** np.maximum(k - 2, 0)).sum(axis=1)
        H[:, 1, 0, 0] = 2
        slack[:, 0, 0] = 64 * UNIT * (every * k * far ** np.maximum(k - 1, 0)).sum(axis=1)
        return H, slack


def roots(p):
    """The five solutions in 40 digits."""
    every = [1.0, *p[::-1]]
    with mpmath.workdps(40):
        c = [mpmath.mpc(complex(v)) for v in every]
        slope = [k * v for k, v in zip(range(DEGREE, 0, -1), c, strict=False)]
        found = [mpmath.mpc(root) for root in np.roots(every)]
        for _ in range(8):
            found = [x - _at(c, x) / _at(slope, x) for x in found]
        return found


def _at(c, x):
    value = mpmath.mpc(0)
    for v in c:
        value = value * x + v
    return value


@cache
def all_five(seed=3):
    own = Polynomial()
    generator = np.random.default_rng(seed)
    p, first = own.drawn(generator)
    z = first[None]
    for _ in range(200):
        z = round_trip(own, p, z, generator)
        if len(z) == DEGREE:
            break
    return own, p, round_trip(own, p, z, generator)


REAL = np.array([1.25, -2.0, 0.0, 0.5, -0.75], complex)
"""Of a polynomial whose coefficients are exact in doubles."""


def test_round_trips_find_all_roots_once() -> None:
    _, p, z = all_five()
    assert len(z) == DEGREE
    known = np.array([complex(root) for root in roots(p)])
    gaps = np.abs(z[:, :1] - known)
    assert sorted(gaps.argmin(axis=1)) == list(range(DEGREE))
    assert gaps.min(axis=1).max() < 1e-10


def test_boxes_hold_the_roots_and_no_other() -> None:
    own, p, z = all_five()
    ends = there(arrived(way(own, p, REAL), z))
    found = enclosed(own, REAL, ends)
    assert len(ends) == DEGREE
    assert found.certain.all()
    assert apart(found)
    known = roots(REAL)
    assert 1 <= int(found.real.sum()) < DEGREE
    assert int(found.real.sum()) == sum(abs(root.imag) < 1e-30 for root in known)
    for box, radius, isreal in zip(found.z, found.radius, found.real, strict=True):
        gaps = [abs(mpmath.mpc(box[0]) - root) for root in known]
        assert sum(gap <= radius[0] for gap in gaps) == 1
        if isreal:
            assert np.abs(box.imag).max() == 0
    # the same solution twice does not count twice
    twice = enclosed(own, REAL, np.concatenate([ends, ends[:1]]))
    assert twice.certain.all()
    assert not apart(twice)


def test_a_double_root_has_no_box() -> None:
    own = Polynomial()
    # (x - 1)^2 (x^3 + 2) = x^5 - 2 x^4 + x^3 + 2 x^2 - 4 x + 2
    double = np.array([2.0, -4.0, 2.0, 1.0, -2.0], complex)
    assert not enclosed(own, double, np.array([[1.0, 1.0]], complex)).certain.any()
    # nor has a place that is no solution
    assert not enclosed(own, REAL, np.array([[np.nan, 1.0]], complex)).certain.any()


def test_the_trace_of_some_points_is_not_linear() -> None:
    own, p, z = all_five()

    def pencil(start, end):
        """p(x) = s x^4: the sum of the roots is s - p4."""

        def system(x, t):
            s, rate = start + t * (end - start), end - start
            F, J, _ = own.rows(x, p[None], 0 * p[None])
            F[:, 0] -= s * x[:, 0] ** 4
            J[:, 0, 0] -= 4 * s * x[:, 0] ** 3
            return F, J, np.stack([-rate * x[:, 0] ** 4, 0 * x[:, 0]], axis=1)

        return system

    generator = np.random.default_rng(0)
    whole = trace_test(pencil, z, lambda x: x[:, :1], generator)
    assert whole.linear
    assert whole.followed == DEGREE
    assert whole.bent < 1e-12
    for left in range(DEGREE):
        part = trace_test(pencil, np.delete(z, left, axis=0), lambda x: x[:, :1], generator)
        assert part.followed == DEGREE - 1
        assert not part.linear
        assert part.bent > 1e-4


@pytest.mark.parametrize("power", [1, 2, 3, 5])
def test_ends_at_infinity_are_told_from_multiple_ones(power) -> None:
    def away(x, t):  # (1 - t) x^n = 1
        left = (1 - t)[:, None]
        return left * x**power - 1, (power * left * x ** (power - 1))[..., None], -(x**power)

    def together(x, t):  # x^(n + 1) = 1 - t
        left = (1 - t)[:, None]
        return x ** (power + 1) - left, ((power + 1) * x**power)[..., None], 1 + 0 * x

    turn = np.exp(2j * np.pi * np.arange(power) / power)[:, None]
    found = far_ends(away, turn)
    assert found.infinite.all()
    assert not found.finite.any()
    found = far_ends(together, np.ones((1, 1), complex))
    assert not found.infinite.any()


def test_sums_and_products_of_twice_the_digits() -> None:
    generator = np.random.default_rng(5)
    a, b, c = (generator.normal(size=50) + 1j * generator.normal(size=50) for _ in range(3))
    # (a + b)(a - b) - a a + b b = 0, and a small rest
    wide = [WideComplex.of(v) for v in (a, b, c)]
    rest = (wide[0] + wide[1]) * (wide[0] - wide[1]) - wide[0] * wide[0] + wide[1] * wide[1]
    assert np.abs(rest.rounded()).max() < 1e-30
    product = wide[0] * wide[1] * wide[2] + wide[2]
    for k in range(50):
        parts = [(Fraction(v.real), Fraction(v.imag)) for v in (a[k], b[k], c[k])]
        exact = parts[0]
        for x, y in parts[1:]:
            exact = (exact[0] * x - exact[1] * y, exact[0] * y + exact[1] * x)
        exact = (exact[0] + parts[2][0], exact[1] + parts[2][1])
        for own, true in ((product.re, exact[0]), (product.im, exact[1])):
            assert abs(Fraction(float(own[0][k])) + Fraction(float(own[1][k])) - true) < 1e-30
