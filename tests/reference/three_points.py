"""Three points at given distances, each on a circle or a line: the first one by exact elimination.

All numbers are fractions. The squared distances, with the tangents of half the angles as unknowns,
are polynomials of degree two in each; two Sylvester determinants in fractions, at whole numbers,
give the eliminant of the first unknown, whose real roots are isolated by balls.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from typing import Any

PAIRS = ((0, 1), (1, 2), (0, 2))
DEGREE = 16


@dataclass(frozen=True)
class ExactCourse:
    """Centre c, unit directions u, v at right angles, radius: c + r (u cos + v sin) or c + z u."""

    centre: tuple[Fraction, ...]
    u: tuple[Fraction, ...]
    v: tuple[Fraction, ...]
    radius: Fraction
    straight: bool = False

    def polynomial(self) -> tuple[list[list[Fraction]], list[Fraction]]:
        """Return the place as coefficients by coordinate, and the denominator."""
        rows = zip(self.centre, self.u, self.v, strict=True)
        if self.straight:
            return [[c, u, Fraction(0)] for c, u, _ in rows], [
                Fraction(1),
                Fraction(0),
                Fraction(0),
            ]
        r, one = self.radius, Fraction(1)
        return [[c + r * u, 2 * r * v, c - r * u] for c, u, v in rows], [one, Fraction(0), one]

    def at(self, z: Fraction) -> list[Fraction]:
        """Return the place at z: a length, or the tangent of half an angle."""
        rows, denominator = self.polynomial()
        powers = (1, z, z * z)
        d = sum(a * b for a, b in zip(denominator, powers, strict=True))
        return [sum(a * b for a, b in zip(row, powers, strict=True)) / d for row in rows]


def _times(a: list[Fraction], b: list[Fraction]) -> list[list[Fraction]]:
    return [[x * y for y in b] for x in a]


def _divided(F: list[list[Fraction]], by: list[Fraction]) -> list[list[Fraction]]:
    """Return F (5 rows) by 1 + z^2 of its rows, or F where that is 1."""
    if not by[2]:
        return F[:3]
    rows = [list(row) for row in F]
    found = []
    for k in range(3):
        found.append(list(rows[k]))
        rows[k + 2] = [a - b for a, b in zip(rows[k + 2], rows[k], strict=True)]
    assert not any(any(row) for row in rows[3:])
    return found


def equation(one: ExactCourse, other: ExactCourse, square: Fraction) -> list[list[Fraction]]:
    """Return the coefficients (3, 3) of the squared distance less `square`, denominators freed."""
    (P, d), (Q, e) = one.polynomial(), other.polynomial()
    F = [[Fraction(0)] * 5 for _ in range(5)]
    for p, q in zip(P, Q, strict=True):
        D = [[p[i] * e[j] - d[i] * q[j] for j in range(3)] for i in range(3)]
        for i, j, k, m in product(range(3), repeat=4):
            F[i + k][j + m] += D[i][j] * D[k][m]
    for i, j, k, m in product(range(3), repeat=4):
        F[i + k][j + m] -= square * d[i] * e[j] * d[k] * e[m]
    F = _divided(F, d)
    turned = _divided([list(row) for row in zip(*F, strict=True)], e)
    return [list(row) for row in zip(*turned, strict=True)]


def first_unknowns(courses: Any, squares: Any) -> tuple[list[float], int]:
    """Return the first unknown of all real solutions, in order, and the number of complex ones."""
    from flint import fmpq, fmpq_mat, fmpq_poly

    F = [equation(courses[i], courses[j], s) for (i, j), s in zip(PAIRS, squares, strict=True)]

    def number(x: Fraction) -> Any:
        return fmpq(x.numerator, x.denominator)

    def value(z: int) -> Fraction:
        powers = (1, z, z * z)
        a = [sum(p * row[k] for p, row in zip(powers, F[0], strict=True)) for k in range(3)]
        b = [sum(p * row[k] for p, row in zip(powers, F[2], strict=True)) for k in range(3)]
        c = [[F[1][i][k] for i in range(3)] for k in range(3)]  # of powers of the third unknown

        def by(i: int, j: int) -> list[Fraction]:
            return [b[i] * y - b[j] * x for x, y in zip(c[i], c[j], strict=True)]

        first, second, third = by(0, 2), by(0, 1), by(1, 2)
        g = [Fraction(0)] * 5
        for i in range(3):
            for j in range(3):
                g[i + j] += first[i] * first[j] - second[i] * third[j]
        rows = [[Fraction(0)] * k + a + [Fraction(0)] * (3 - k) for k in range(4)]
        rows += [[Fraction(0)] * k + g + [Fraction(0)] * (1 - k) for k in range(2)]
        found = fmpq_mat(6, 6, [number(x) for row in rows for x in row]).det()
        return Fraction(int(found.p), int(found.q))

    at = range(-DEGREE // 2, DEGREE // 2 + 1)
    powers = fmpq_mat(DEGREE + 1, DEGREE + 1, [fmpq(z) ** k for z in at for k in range(DEGREE + 1)])
    values = fmpq_mat(DEGREE + 1, 1, [number(value(z)) for z in at])
    polynomial = fmpq_poly(powers.solve(values).entries())
    every = polynomial.numer().complex_roots()
    assert all(times == 1 for _, times in every)
    real = [float(root.real.mid()) for root, _ in every if root.imag == 0]
    return sorted(real), len(every)
