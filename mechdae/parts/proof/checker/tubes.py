"""Steps: tubes around curves that hold one solution each, proved by Krawczyk's test (1969)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from flint import acb, acb_mat, arb, arb_mat, arb_series, ctx

from .arithmetic import LAST, ONE, PRECISION, ZERO, ball, coefficient, need, polynomials
from .mechanism import ClaimedMechanism

CURVE_TERMS, SLOPE_TERMS = 6, 3
"""Powers of t of a curve's equations, and of their derivatives, before Lagrange's remainder."""
HALVINGS = 16
"""How often a step is halved at most."""
NEWTON_STEPS, KRAWCZYK_TESTS = 30, 5
CLOSE, CONVERGED = 1e-6, 1e-25
"""Newton's steps: below which the inverse is kept, and which is the last."""
SHARE = 0.3
"""Part of a tube's radius that the next tube's length is chosen to use up."""


class Tube:
    """One solution within r of c(t) for each |t| <= half, and no other; c[index] is z[index] + t.

    With G(e, t) the rows at c(t) + e and Y(t) near the inverse of dG/de, Krawczyk's test
    |Y G(0, t)| + |1 - Y dG/de| r < r proves one solution with |e| < r for each t, and no second.
    All are polynomials of t; the last coefficient of G and of dG/de holds Lagrange's remainder.
    A tube without length is a pose, which may be complex.
    """

    def __init__(
        self, m: ClaimedMechanism, z: list[arb], half: arb, index: int, Y: arb_mat
    ) -> None:
        self.m, self.z, self.half, self.index = m, z, half, index
        self.T, self.matrix = arb(0, half), type(Y)
        self.free, self.Y, self.r = [k for k in range(m.n + 1) if k != index], [Y], [ZERO] * m.n
        self.c: list[list[arb]] = [
            [x, ONE] if k == index and half != 0 else [x] for k, x in enumerate(z)
        ]
        if half != 0:
            self._bend()
        self._prove(arb(2) ** ((24 if half != 0 else 16) - PRECISION))

    def _bend(self) -> None:
        """Give the curve the coefficients with which the equations nearly vanish."""
        for terms in range(2, CURVE_TERMS + 1):
            ctx.cap = terms
            rows = [[coefficient(x, terms - 1)] for x in self.m.rows([*map(arb_series, self.c)])]
            found = (self.Y[0] * arb_mat(rows) * -1).mid().entries()
            for k, value in zip(self.free, found, strict=True):
                self.c[k].append(value)

    def _prove(self, least: arb) -> None:
        """Find radii that pass the test, at first four times what the curve misses."""
        G = self._terms(CURVE_TERMS, lambda z: [[x] for x in self.m.rows(z)])
        self.r = [(x.abs_upper() * 4 + least).upper() for x in self._product(G).entries()]
        for _ in range(KRAWCZYK_TESTS):
            J = self._terms(SLOPE_TERMS, lambda z: self.m.dense(z, self.index))
            while len(self.Y) < len(J) - 1:
                after = sum(map(arb_mat.__mul__, J[1:], self.Y[::-1]), self.Y[0] * 0)
                self.Y.append((-self.Y[0] * after).mid())
            radii = self.matrix([[ball(r, self.z[0])] for r in self.r])
            grown = (self._product(J) - 1) * radii
            shares = zip(grown.entries(), self.r, strict=True)
            self.share: float = max(float(x.abs_upper() / r) for x, r in shares)
            reach = [x.abs_upper() for x in (self._product(G) + grown).entries()]
            if all(bool(a < r) for a, r in zip(reach, self.r, strict=True)):
                return
            self.r = [(a * 2 + least).upper() for a in reach]
        raise ArithmeticError("Krawczyk's test fails")

    def _terms(self, count: int, rows: Callable[[list[arb]], list[list[arb]]]) -> list[arb_mat]:
        """Return rows within r of c(t) by powers of t; the last one is for all t."""
        if self.half == 0:
            return [self.matrix(rows(self.box()))]
        found = list[arb_mat]()
        for t, terms in ((ZERO, count), (self.T, count + 1)):
            ctx.cap = terms
            series = rows(self.box(arb_series([t, ONE])))
            for k in range(len(found), terms):
                found.append(arb_mat([[coefficient(x, k) for x in row] for row in series]))
        return found

    def _product(self, terms: list[arb_mat]) -> arb_mat:
        """Return what holds Y(t) times a polynomial, for all t."""
        total = terms[0] * 0
        for k in reversed(range(len(self.Y) + len(terms) - 1)):
            parts = (Y * terms[k - i] for i, Y in enumerate(self.Y) if 0 <= k - i < len(terms))
            total = sum(parts, total * self.T)
        return total

    def rates(self) -> tuple[list[arb], arb]:
        """Return dz by t, of the solutions for all t, and the second derivative of the driver."""
        slopes = self._product(self._terms(SLOPE_TERMS, self.m.dense)).tolist()
        J = arb_mat([[row[k] for k in self.free] for row in slopes])
        v = J.solve(arb_mat([[-row[self.index]] for row in slopes])).entries()
        v.insert(self.index, ONE)
        ctx.cap = 3
        lines = [arb_series([a, b], 3) for a, b in zip(self.box(), v, strict=True)]
        push = self._product([arb_mat([[coefficient(x, 2) * -2] for x in self.m.rows(lines)])])
        return v, J.solve(push).entries()[LAST]

    def box(self, t: arb | arb_series | None = None) -> list[arb]:
        """Return balls that hold all of it, at t if it is given."""
        z = [*polynomials(self.c, self.T if t is None else t)]
        for k, r in zip(self.free, self.r, strict=True):
            z[k] += ball(r, self.z[k])
        return z

    def ahead(self, value: arb) -> list[arb]:
        """Return the curve where the coordinate `index` has a value."""
        z = [*polynomials(self.c, value - self.z[self.index])]
        z[self.index] = value
        return z

    def holds(self, z: list[arb]) -> bool:
        """Whether a pose in balls lies inside."""
        c, off = self.ahead(z[self.index]), abs(z[self.index] - self.z[self.index])
        pairs = zip(self.free, self.r, strict=True)
        return bool(off <= self.half) and all(bool(abs(z[k] - c[k]) < r) for k, r in pairs)

    def pose(self, value: arb) -> list[arb]:
        """Return balls with the pose where the coordinate has a value, [] where none is found."""
        z = solution(self.m, self.ahead(value), self.index).box()
        return z if self.holds(z) else []


def solution(m: ClaimedMechanism, z: list[arb], index: int = LAST) -> Tube:
    """Return the one pose near z, real or complex, whose coordinate `index` is that of z."""
    z, index, off = [x.mid() for x in z], index % (m.n + 1), 1.0
    matrix = acb_mat if isinstance(z[0], acb) else arb_mat
    for _ in range(NEWTON_STEPS):
        if off > CLOSE:
            unit = matrix(m.n, m.n) + 1
            Y = matrix(m.dense(z, index)).solve(unit, algorithm="approx").mid()
        move = (Y * matrix([[x] for x in m.rows(z)])).entries()
        off = max(float(x.abs_upper()) for x in move)
        move.insert(index, ZERO)
        z = [(a - b).mid() for a, b in zip(z, move, strict=True)]
        if off < CONVERGED:
            return Tube(m, z, ZERO, index, Y)
        if not off < 1e3 * (1 + m.size):  # balls take long with sines of large numbers
            break
    raise ArithmeticError("Newton's method does not find a pose")


def follow(
    m: ClaimedMechanism,
    z: list[arb],
    index: int,
    to: arb,
    good: Callable[[Tube], bool] | None = None,
    step: arb | None = None,
) -> Iterator[tuple[Tube, list[arb]]]:
    """Yield tubes that lead from the pose z until coordinate `index` is `to`, each with its end."""
    c: Sequence[Sequence[arb]] = [*zip(z, solution(m, z, index).rates()[0], strict=True)]
    least, longest = abs(to - z[index]) / 2**HALVINGS, 4.0
    step = step or (to - z[index]).mid()
    while z[index] != to:
        end = to if abs(step) * 1.1 >= abs(to - z[index]) else (z[index] + step).mid()
        half = ((end - z[index]) / 2).mid()
        try:
            middle = solution(m, [*polynomials(c, z[index] + half - c[index][0])], index)
            length = (abs(half) * (1 + arb(2) ** -50)).mid()
            tube = Tube(m, middle.z, length, index, middle.Y[0])
            after = solution(m, tube.ahead(end), index).box()
            if not (tube.holds(z) and tube.holds(after) and (good is None or good(tube))):
                raise ArithmeticError("the ends of a step leave it")
        except (ArithmeticError, ValueError):  # also of series whose divisor may vanish
            if abs(step) < least:
                raise
            step, longest = half, 1.0
        else:
            yield tube, after
            longer = min(longest, (SHARE / (tube.share + 1e-3)) ** (1 / SLOPE_TERMS))
            step, longest = ((end - z[index]) * longer).mid(), 2 * longest
            z, c = after, tube.c


def turning(m: ClaimedMechanism, z: list[arb], claim: list[arb], sense: int, at: str) -> list[arb]:
    """Return balls with the limit position behind the pose z: there the driver turns back."""
    v, _ = solution(m, z).rates()
    q = max(range(m.n), key=lambda k: abs(float(v[k].mid())) / m.scale[k])

    def good(tube: Tube) -> bool:  # one place at most where the driver stands still
        v, bend = tube.rates()
        return not v[LAST].contains(0) or not bend.contains(0)

    def speed(tube: Tube, z: list[arb]) -> arb:
        near = solution(m, z, q)
        need(tube.holds(near.box()), at, "a pose is not that of the way there")
        return near.rates()[0][LAST] * way * sense

    way, z = claim[q] - z[q].mid(), solution(m, z, q).box()
    for tube, after in follow(m, z, q, (z[q] + way * 2.1).mid(), good):
        if not (speed(tube, z) > 0 and speed(tube, after) > 0):
            break
        z = after
    turns = speed(tube, z) > 0 > speed(tube, after)
    need(turns, at, "the driver does not turn back, or moves away from there")
    z = tube.ahead(claim[q])
    for _ in range(8):
        near = solution(m, z, q)
        (v, bend), z = near.rates(), near.z.copy()
        z[q] = (z[q] - v[LAST] / bend).mid()
    near = Tube(m, near.z, arb(2) ** -60, q, near.Y[0])
    one, other = (speed(near, near.ahead(near.z[q] + t)) for t in (near.half, -near.half))
    need(one * other < 0, at, "the place where the driver turns back is not found")
    return near.box()
