"""Change points of the plane, where two branches meet: exact poses, and cones around them."""

from __future__ import annotations

from collections.abc import Iterator

from flint import arb, arb_mat, arb_series, ctx, fmpq, fmpq_mat

from .arithmetic import (
    LAST,
    ONE,
    ZERO,
    Dual,
    FalseClaim,
    Json,
    ball,
    coefficient,
    exact,
    exact_precision,
    exacts,
    field,
    need,
)
from .plane import PlanarMechanism
from .tubes import Tube, follow, solution

SHORT = arb(2) ** -40
"""So near a change point the equations tell no pose, and so wide is a cone at least."""
CONE_TERMS = 5
NEARER = 12
"""How often the way to a change point is halved at most."""


class RightAngles(Dual):
    """An angle of a whole number of right angles, whose cosine and sine are exact."""

    def __init__(self, count: arb, unit: arb, k: int) -> None:
        super().__init__(count * unit, {k: ONE})
        if not count.is_integer():
            raise ArithmeticError("an angle at a change point is no right angle")
        self.exact_cos, self.exact_sin = ((1, 0), (0, 1), (-1, 0), (0, -1))[int(float(count)) % 4]

    def cos(self) -> Dual:
        return self._scaled(arb(self.exact_cos), -self.exact_sin)

    def sin(self) -> Dual:
        return self._scaled(arb(self.exact_sin), self.exact_cos)


class ExactChangePoint:
    """A pose x, y, right angles of each body, right angles of the driver, where two branches meet.

    Equations vanish there exactly, also with other numbers for a right angle. The Jacobian's rank
    is one less than at other poses: `left` times the rows is zero, `picked` rows are independent.
    """

    def __init__(self, m: PlanarMechanism, numbers: list[arb], at: str) -> None:
        turns = [k % 3 == 2 or k == m.n for k in range(m.n + 1)]
        places = [*zip(numbers, turns, strict=True)]
        self.m, self.z = m, [x * arb.pi() / 2 if turn else x for x, turn in places]
        with exact_precision():
            for unit in (arb(2), ONE):
                z = [
                    RightAngles(x, unit, k) if turn else Dual(x, {k: ONE})
                    for k, (x, turn) in enumerate(places)
                ]
                rows = m.rows(z)
                zero = all(row.v == 0 for row in rows)
                need(zero, at, "the equations do not vanish exactly")
            J = [[row.d.get(k, ZERO).fmpq() for k in range(m.n + 1)] for row in rows]
        beside = [[*row, *(fmpq(int(i == k)) for k in range(m.n))] for i, row in enumerate(J)]
        *_, last = fmpq_mat(beside).rref()[0].tolist()
        columns = fmpq_mat(J).transpose().rref()[0].tolist()
        self.picked: list[int] = [
            next(k for k, v in enumerate(row) if v) for row in columns if any(row)
        ]
        falls = len(self.picked) == m.n - 1 and not any(last[: m.n + 1])
        need(falls, at, f"rank {len(self.picked)} of {m.n}: no two branches that meet")
        self.left: list[arb] = [arb(v) for v in last[m.n + 1 :]]


class Cone:
    """One branch z + t w through a change point z, |t| <= half, t told by the last coordinate.

    G(t, w) = (F(z + t w) / t, l F(z + t w) / t^2) of independent rows F and of l F with l F' = 0
    is smooth, also at t = 0, and has the same zeros as all rows elsewhere. Krawczyk's test proves
    one w for each t within r of w + v t, and no second.
    """

    def __init__(self, point: ExactChangePoint, w: list[arb], half: arb) -> None:
        self.point, self.m, self.z, self.half = point, point.m, point.z, half
        n, T, still = self.m.n, ball(half), [ZERO] * (self.m.n + 1)
        for _ in range(12):
            move = self._slopes(w, ZERO).solve(self._parts(w, still, ZERO, 0)).entries()
            w = [*((a - b).mid() for a, b in zip(w[:n], move, strict=True)), ONE]
        Y = self._slopes(w, ZERO).inv().mid()
        bent = (Y * self._parts(w, still, ZERO, 1)).entries()
        self.w, self.v = w, [*((-x).mid() for x in bent), ZERO]
        G = [self._parts(w, self.v, *order) for order in ((ZERO, 0), (ZERO, 1), (T, 2))]
        miss = Y * (G[0] + G[1] * T + G[2] * (T * T))
        self.r: list[arb] = [
            x.abs_upper() * 2 + SHORT for x in miss.entries()
        ]  # poses in balls have room
        for _ in range(6):
            loss = Y * self._slopes(self.rates(T), T) - 1
            grown = loss * arb_mat([[ball(r)] for r in self.r])
            pairs = zip(miss.entries(), grown.entries(), strict=True)
            reach = [a.abs_upper() + b.abs_upper() for a, b in pairs]
            if all(bool(a < r) for a, r in zip(reach, self.r, strict=True)):
                return
            self.r = [arb((a * 2 + SHORT).upper()) for a in reach]
        raise ArithmeticError("Krawczyk's test fails at a change point")

    def _parts(self, w: list[arb], v: list[arb], T: arb, k: int) -> arb_mat:
        """Return the factors of t^k in G(t, w + v t), around T."""
        ctx.cap = CONE_TERMS
        z = [
            arb_series([a + b * T + c * T * T, b + c * T * 2, c], CONE_TERMS)
            for a, b, c in zip(self.z, w, v, strict=True)
        ]
        rows = self.m.rows(z)
        independent = [coefficient(rows[i], k + 1) for i in self.point.picked]
        return arb_mat(self.m.n, 1, [*independent, self._last(rows, k + 2)])

    def _last(self, rows: list[arb_series], k: int) -> arb:
        """Return the coefficient of t^k in l times rows."""
        pairs = zip(rows, self.point.left, strict=True)
        return sum((coefficient(x, k) * v for x, v in pairs), ZERO)

    def _slopes(self, w: list[arb], T: arb) -> arb_mat:
        """Return balls with dG/dw for all t in T and all w: l F' / t is a mean of l F'' w."""
        ctx.cap = CONE_TERMS
        z = [
            Dual(arb_series([a + b * T, b], 2), {k: ONE})
            for k, (a, b) in enumerate(zip(self.z, w, strict=True))
        ]
        rows, columns = [row.d for row in self.m.rows(z)], range(self.m.n)
        picked = [
            [coefficient(rows[i].get(k, ZERO), 0) for k in columns] for i in self.point.picked
        ]
        return arb_mat([*picked, [self._last([x.get(k, ZERO) for x in rows], 1) for k in columns]])

    def rates(self, t: arb) -> list[arb]:
        """Return balls with w at t."""
        radii = [*map(ball, self.r), ZERO]
        return [a + b * t + r for a, b, r in zip(self.w, self.v, radii, strict=True)]

    def ahead(self, value: arb) -> list[arb]:
        """Return balls with the pose where the driver has a value."""
        t = value - self.z[LAST]
        pairs = zip(self.z[:LAST], self.rates(t)[:LAST], strict=True)
        return [*(a + b * t for a, b in pairs), value]

    def holds(self, z: list[arb]) -> bool:
        """Whether a pose in balls lies inside."""
        t = z[LAST] - self.z[LAST]
        entries = zip(z, self.z, self.w, self.v, [*self.r, ONE], strict=True)
        return bool(abs(t) <= self.half) and all(
            bool(abs(x - a - b * t - c * t * t) < r * abs(t)) for x, a, b, c, r in entries
        )

    def pose(self, value: arb) -> list[arb]:
        """Return balls with the pose where the driver has a value, [] where none is found."""
        ahead = self.ahead(value)
        if abs(value - self.z[LAST]) <= SHORT:  # its balls are small there, and nothing else
            return ahead
        z = solution(self.m, ahead).box()
        return z if self.holds(z) else []


def across(
    m: PlanarMechanism, z: list[arb], to: arb, data: Json, at: str
) -> Iterator[tuple[Tube | Cone, list[arb]]]:
    """Yield tubes and a cone that lead from the pose z across a change point, each with its end."""
    bodies = field(data, "bodies", dict, at)
    numbers = [v for b in m.bodies for v in exacts(bodies.get(b), 3, f"{at}/bodies/{b}")]
    point = ExactChangePoint(m, [*numbers, exact(data.get("at"), f"{at}/at")], at)
    for _ in range(NEARER):
        t = z[LAST] - point.z[LAST]
        try:
            w = [((a - b) / t).mid() for a, b in zip(z, point.z, strict=True)]
            cone = Cone(point, w, (abs(t) * (1 + arb(2) ** -50)).upper())
            if cone.holds(z):
                break
        except ArithmeticError:
            pass
        for tube, after in follow(m, z, m.n, (z[LAST] - t / 2).mid()):
            yield tube, after
            z = after
    else:
        raise ArithmeticError("no branch is proved through the change point")
    end = to if abs(to - cone.z[LAST]) <= cone.half else (cone.z[LAST] - t).mid()
    after = cone.pose(end)
    if not after or not (to - cone.z[LAST]) * t < 0:
        raise FalseClaim(at, "the step does not lead across the change point")
    yield cone, after
    yield from follow(m, after, m.n, to)
