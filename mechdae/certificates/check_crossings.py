"""Checks a certificate of a planar sweep across change points in ball arithmetic.

It shares nothing with the rest of the package but the file. Where two branches meet, the pose has
to be exact: places without rounding and angles that are right angles, so that equations vanish and
the rank falls exactly. What is common with check.py is the same text, so that either file can be
copied and run by itself. What is proved, and by which theorem, is said in docs/certificates.md.
"""
# ruff: noqa: B905
# fmt: off

from __future__ import annotations

import json
import re
import sys
from typing import Any

from flint import acb, acb_mat, arb, arb_mat, arb_series, ctx, fmpq, fmpq_mat

VERSION, PRECISION, MOST_BYTES, MOST_BODIES, HALVINGS = 2, 128, 256_000_000, 150, 12
EXACT, SHORT = 4096, arb(2) ** -40
"""Bits with which sums and products of exact numbers stay exact; so near a
change point the equations tell no pose, and so wide is a cone at least."""
NUMBERS: dict[str, list[str]] = {
    "revolute": [], "weld": ["turn"], "prismatic": ["axis", "turn"], "slot": ["axis"],
    "distance": ["length"], "gear": ["ratio", "phase"], "rack": ["radius", "axis", "phase"]}
LAST, ZERO, ONE = -1, arb(0), arb(1)
"""What the drivers are formulas of is the last coordinate of a pose."""


class FalseClaim(Exception):
    """A claim that does not hold, or something that cannot be read; says where."""

    def __init__(self, place: str, why: str) -> None:
        super().__init__(f"{place}: {why}")


def need(holds: Any, place: str, why: str) -> None:
    """Refuse a claim that does not hold."""
    if not holds:
        raise FalseClaim(place, why)


def read(path: str) -> Any:
    """Return the content of a file, of at most `MOST_BYTES`; no key may stand twice."""

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        if len(dict(pairs)) < len(pairs):
            raise RecursionError(f"a key stands twice among {[key for key, _ in pairs][:5]}")
        return dict(pairs)

    with open(path, "rb") as file:
        text = file.read(MOST_BYTES + 1)
    need(len(text) <= MOST_BYTES, path, f"longer than {MOST_BYTES} bytes")
    try:
        return json.loads(text.decode(), object_pairs_hook=once)
    except (ValueError, RecursionError) as error:
        raise FalseClaim(path, f"cut off, or no JSON: {str(error)[:150]}") from None


def part(data: Any, key: str, kind: type, place: str) -> Any:
    """Return an entry of a table, of the kind that is expected."""
    need(isinstance(data, dict) and type(data.get(key)) is kind, f"{place}/{key}",
         f"missing, or not a {kind.__name__}")
    return data[key]


def exact(text: Any, place: str) -> arb:
    """Return an exact number, the text 'p' or 'p/q'."""
    need(isinstance(text, str) and re.fullmatch(r"-?\d{1,700}(/[1-9]\d{0,699})?", text, re.A),
         place, f"not an exact number 'p/q': {str(text)[:40]}")
    return arb(fmpq(*map(int, text.split("/"))))


def exacts(data: Any, count: int, place: str) -> list[arb]:
    """Return a list of `count` exact numbers."""
    need(isinstance(data, list) and len(data) == count, place, f"not a list of {count} numbers")
    return [exact(text, f"{place}/{k}") for k, text in enumerate(data)]


def formula(data: Any, s: Any, place: str) -> Any:
    """Return the value of a formula: "s", an exact number, or [operation, formulas]."""
    if not isinstance(data, list):
        return data if isinstance(data, arb) else s if data == "s" else exact(data, place)
    need(len(data) == 3 - (data[0] in ("sin", "cos")), place, f"no formula: {str(data)[:60]}")
    one, *more = (formula(entry, s, place) for entry in data[1:])
    return {"+": lambda: one + more[0], "*": lambda: one * more[0], "sin": lambda: one.sin(),
            "/": lambda: one * (Dual(x := ONE / more[0].v, (more[0] * (x * -x)).d) if isinstance(
                more[0], Dual) else ONE / more[0]), "cos": lambda: one.cos()}[data[0]]()


class Dual:
    """A value with its derivatives by the unknowns it depends on."""

    def __init__(self, v: Any, d: dict[int, Any]) -> None:
        self.v, self.d = v, d

    def __add__(self, other: Any) -> Dual:
        if not isinstance(other, Dual):
            return Dual(self.v + other, self.d)
        own = {k: self.d[k] + v if k in self.d else v for k, v in other.d.items()}
        return Dual(self.v + other.v, self.d | own)

    def __mul__(self, other: Any) -> Dual:
        if not isinstance(other, Dual):
            return Dual(self.v * other, {k: v * other for k, v in self.d.items()})
        return Dual(self.v * other.v, (Dual(0, (self * other.v).d) + Dual(0, (other * self.v).d)).d)

    def cos(self) -> Dual:
        return Dual(self.v.cos(), (self * -self.v.sin()).d)

    def sin(self) -> Dual:
        return Dual(self.v.sin(), (self * self.v.cos()).d)

    __radd__, __rmul__ = __add__, __mul__


class Placing:
    """Origin, unwrapped angle, its cosine and sine of a body."""

    def __init__(self, x: Any, y: Any, angle: Any) -> None:
        self.x, self.y, self.angle, self.c, self.s = x, y, angle, angle.cos(), angle.sin()

    def turned(self, a: Any, b: Any) -> tuple[Any, Any]:
        return self.c * a + self.s * (b * -1), self.s * a + self.c * b

    def along(self, axis: arb, x: Any, y: Any) -> Any:
        return (a := self.turned(axis.cos(), axis.sin()))[0] * x + a[1] * y

    def point(self, place: list[arb]) -> tuple[Any, Any]:
        x, y = self.turned(*place)
        return x + self.x, y + self.y


class Checked:
    """Bodies, joints and driver of a certificate, and their equations."""

    def __init__(self, data: Any, at: str = "mechanism") -> None:
        self.points: dict[str, dict[str, list[arb]]] = {}
        for body, own in part(data, "bodies", dict, at).items():
            table = part(data["bodies"], body, dict, f"{at}/bodies")
            self.points[body] = {p: exacts(own[p], 2, f"{at}/bodies/{body}/{p}") for p in table}
        self.bodies = [body for body in self.points if body != "ground"]
        joints = part(data, "joints", dict, at)
        self.joints = {own: self._joint(joints[own], f"{at}/joints/{own}") for own in joints}
        self.drivers, self.n = part(data, "drivers", dict, at), 3 * len(self.bodies)
        self.size = max([abs(float(v.mid())) for own in self.points.values() for place in
                         own.values() for v in place] or [0]) or 1.0
        self.unit = 1.0 if ".angle" in str(self.drivers) else self.size
        self.scale = [*[self.size, self.size, 1.0] * len(self.bodies), 1.0]
        self.names = [(body, word) for body in self.bodies for word in ("x", "y", "angle")]
        fits = len(self.bodies) <= MOST_BODIES and len(self.rows([ZERO] * (self.n + 1))) == self.n
        need(fits, at, f"over {MOST_BODIES} bodies, or equations do not fit coordinates")

    def _joint(self, joint: Any, at: str) -> dict[str, Any]:
        kind, carrier = part(joint, "kind", str, at), joint.get("carrier", "ground")
        ends = [tuple(part(joint, end, str, at).split(".")) for end in ("first", "second")]
        known = all(len(end) == 2 and end[1] in self.points.get(end[0], {}) for end in ends)
        need(kind in NUMBERS and carrier in self.points and known, at,
             f"not a kind that is checked, or no such body, point: {kind[:60]}")
        own: dict[str, Any] = {key: exact(joint.get(key), f"{at}/{key}") for key in NUMBERS[kind]}
        return own | {"kind": kind, "ends": ends, "carrier": carrier}

    def rows(self, z: Any) -> list[Any]:
        """Return what vanishes at a pose z: x, y, angle of each body, last the driver."""
        frames, rows = self.placed(z), []
        for joint in self.joints.values():
            one, two, dx, dy = self.gap(joint, frames)
            kind, carrier = joint["kind"], frames[joint["carrier"]].angle * -ONE
            first, second = one.angle + carrier, two.angle + carrier
            if kind in ("revolute", "weld"):
                rows += [dx, dy]
            elif kind in ("prismatic", "slot"):
                rows.append(one.along(joint["axis"], dy, dx * -ONE))
            elif kind == "distance":
                rows.append(dx * dx + dy * dy + joint["length"] * joint["length"] * -1)
            elif kind == "gear":
                rows.append(second * joint["ratio"] + joint["phase"] + first * -ONE)
            else:
                rolled = first * joint["radius"] + joint["phase"]
                rows.append(two.along(joint["axis"], dx, dy) + rolled * -ONE)
            rows += [second + first * -ONE + joint["turn"] * -1] if "turn" in joint else []
        return [*rows, *(self.coordinate(name, frames) + formula(law, z[LAST], name[:90]) * -ONE
                         for name, law in self.drivers.items())]

    def placed(self, z: Any) -> dict[str, Placing]:
        """Return the frames of all bodies."""
        return {"ground": Placing(ZERO, ZERO, ZERO)} | {
            body: Placing(*z[3 * k : 3 * k + 3]) for k, body in enumerate(self.bodies)}

    def gap(self, joint: Any, frames: Any) -> Any:
        """Return the frames of a joint's bodies, and second point less first point."""
        (x1, y1), (x2, y2) = (frames[b].point(self.points[b][p]) for b, p in joint["ends"])
        return *(frames[b] for b, _ in joint["ends"]), x2 + x1 * -ONE, y2 + y1 * -ONE

    def coordinate(self, name: str, frames: Any) -> Any:
        """Return BODY.angle, BODY.POINT.x or .y, JOINT.angle or JOINT.slide."""
        owner, *words = name.split(".")
        if owner in self.bodies and words == ["angle"]:
            return frames[owner].angle
        if owner in self.bodies and words[1:] in (["x"], ["y"]) and words[0] in self.points[owner]:
            return frames[owner].point(self.points[owner][words[0]])[words[1] == "y"]
        joint = self.joints.get(owner, {})
        one, two, dx, dy = self.gap(joint, frames) if joint else (None, None, ZERO, ZERO)
        if words == ["angle"] and one and two:
            return two.angle + one.angle * -ONE
        if words == ["slide"] and joint.get("kind") in ("prismatic", "slot") and one:
            return one.along(joint["axis"], dx, dy)
        raise FalseClaim("mechanism/drivers", f"no such coordinate: {name[:60]}")

    def slopes(self, z: list[Any]) -> tuple[list[Any], list[dict[int, Any]]]:
        """Return the rows at z and their derivatives."""
        rows = self.rows([Dual(x, {k: ONE}) for k, x in enumerate(z)])
        return [row.v for row in rows], [row.d for row in rows]

    def claimed(self, data: Any, u: arb, at: str) -> list[arb]:
        """Return a pose (x, y, angle of each body; u) as it is written in the certificate."""
        own = part(data, "bodies", dict, at)
        return [v for b in self.bodies for v in exacts(own.get(b), 3, f"{at}/bodies/{b}")] + [u]


def slack(r: Any, like: Any) -> Any:
    """Return the ball, of real or complex numbers as `like`, of all that is at most r."""
    return acb(*[arb(0, arb(r).upper())] * 2) if isinstance(like, acb) else arb(0, arb(r).upper())


class Tube:
    """One solution near z + v t for each |t| <= half, and no other one; z[index] + t tells it.

    With G(e, t) the rows at z + v t + e and Y near the inverse of dG/de, Krawczyk's test (1969)
    |Y G(0, t)| + |1 - Y dG/de| r < r proves one solution with |e| < r for each t, and no second.
    """

    def __init__(self, m: Checked, z: list[Any], v: list[Any], half: Any, index: int) -> None:
        self.m, self.z, self.v, self.half, self.index = m, z, v, half, index
        self.free, T = [k for k in range(m.n + 1) if k != index], slack(half, ZERO)
        self.matrix = acb_mat if isinstance(z[0], acb) else arb_mat
        g, d = m.slopes(z)
        if half != 0:  # F + F' t + F''(z + v T) t^2 / 2
            line = m.rows([arb_series([a + b * T, b], 3) for a, b in zip(z, v)])
            slopes = [sum((own * v[k] for k, own in row.items()), ZERO) for row in d]
            g = [a + b * T + c[2] * T * T for a, b, c in zip(g, slopes, line)]
        Y = self.matrix([[x.mid() for x in row] for row in self.inverse(z)[0].tolist()])
        miss = [x.abs_upper() for x in (Y * self.matrix(m.n, 1, g)).entries()]
        least = arb(2) ** ((16 if half == 0 else 24) - PRECISION)
        self.r = [x * 2 + least for x in miss]
        for _ in range(6):
            A = (Y * self.matrix(self.dense(m.slopes(self.box())[1]))).tolist()
            loss = [[(A[i][j] - int(i == j)).abs_upper() for j in range(m.n)] for i in range(m.n)]
            after = [own + sum(map(arb.__mul__, row, self.r), ZERO) for own, row in zip(miss, loss)]
            if all(bool(a < r) for a, r in zip(after, self.r)):
                return
            self.r = [arb((a * 2 + least).upper()) for a in after]
        raise ArithmeticError("Krawczyk's test fails")

    def box(self) -> list[Any]:
        """Return balls that hold all of it."""
        at = [a + b * slack(self.half, ZERO) for a, b in zip(self.z, self.v)]
        for k, r in zip(self.free, self.r):
            at[k] += slack(r, at[k])
        return at

    def dense(self, rows: list[dict[int, Any]]) -> list[list[Any]]:
        return [[row.get(k, ZERO) for k in self.free] for row in rows]

    def inverse(self, z: list[Any]) -> tuple[Any, Any]:
        """Return balls with the inverse of dG/de for every z in the balls, and with de/dt."""
        rows = self.m.slopes(z)[1]
        push = self.matrix(self.m.n, 1, [-row.get(self.index, ZERO) for row in rows])
        return (inverse := self.matrix(self.dense(rows)).inv()), inverse * push

    def rates(self, z: list[arb]) -> list[arb]:
        """Return dz by the parameter, for all solutions in the balls z."""
        found = self.inverse(z)[1].entries()
        return [*found[: self.index], ONE, *found[self.index :]]

    def holds(self, z: list[arb]) -> bool:
        """Whether a pose in balls lies inside."""
        t = z[self.index] - self.z[self.index]
        return bool(abs(t) <= self.half) and all(
            bool(abs(z[k] - self.z[k] - self.v[k] * t) < r) for k, r in zip(self.free, self.r))


def solution(m: Checked, z: list[Any], index: int = LAST) -> Tube:
    """Return the one pose near z whose coordinate `index` is that of z: a tube without length."""
    z, index = [x.mid() for x in z], index % (m.n + 1)
    free = [k for k in range(m.n + 1) if k != index]
    matrix = acb_mat if isinstance(z[0], acb) else arb_mat
    for _ in range(30):
        g, d = m.slopes(z)
        J = matrix([[row.get(k, ZERO) for k in free] for row in d])
        move = J.solve(matrix(m.n, 1, g)).entries()
        for k, own in zip(free, move):
            z[k] = (z[k] - own).mid()
        if (off := max(float(own.abs_upper()) for own in move)) < 1e-25:
            return Tube(m, z, [ZERO] * (m.n + 1), ZERO, index)
        if not off < 1e3 * (1 + m.size):  # balls take long with sines of large numbers
            break
    raise ArithmeticError("Newton's method does not find a pose")


def follow(m: Checked, z: list[arb], index: int, to: arb, good: Any = bool) -> Any:
    """Yield tubes that lead from the pose z until coordinate `index` is `to`, each with its end."""
    step = (to - z[index]).mid()
    least = abs(step) * arb(2) ** -HALVINGS
    while z[index] != to:
        end = to if abs(step) >= abs(to - z[index]) else (z[index] + step).mid()
        half = ((end - z[index]) / 2).mid()
        try:
            v = solution(m, z, index).rates(z)
            middle = solution(m, [a + b * half for a, b in zip(z, v)], index)
            v = [x.mid() for x in middle.rates(middle.box())]
            tube = Tube(m, middle.z, v, (abs(half) * (1 + arb(2) ** -50)).mid(), index)
            ahead = [a + b * half for a, b in zip(middle.z, v)]
            ahead[index] = end
            after = solution(m, ahead, index).box()
            if not (tube.holds(z) and tube.holds(after) and good(tube)):
                raise ArithmeticError("the ends of a step leave it")
        except (ArithmeticError, ValueError):  # also of series whose divisor may vanish
            if abs(step) < least:
                raise
            step = half
        else:
            yield tube, after
            z, step = after, (half * 4).mid()


class Right(Dual):
    """An angle of a whole number of right angles, whose cosine and sine are exact."""

    def __init__(self, count: arb, unit: arb, k: int) -> None:
        super().__init__(count * unit, {k: ONE})
        if not count.is_integer():
            raise ArithmeticError("an angle at a change point is no right angle")
        self.c, self.s = ((1, 0), (0, 1), (-1, 0), (0, -1))[int(float(count)) % 4]

    def cos(self) -> Dual:
        return Dual(arb(self.c), {k: v * -self.s for k, v in self.d.items()})

    def sin(self) -> Dual:
        return Dual(arb(self.s), {k: v * self.c for k, v in self.d.items()})


class Meeting:
    """A pose x, y, right angles of each body, right angles of the driver, where two branches meet.

    Equations vanish there exactly, also with other numbers for a right angle. The Jacobian's rank
    is one less than at other poses: `left` times the rows is zero, `picked` rows are independent.
    """

    def __init__(self, m: Checked, numbers: list[arb], at: str) -> None:
        turns = [k % 3 == 2 or k == m.n for k in range(m.n + 1)]
        self.m, self.z = m, [x * arb.pi() / 2 if t else x for x, t in zip(numbers, turns)]
        ctx.prec = EXACT
        try:
            for unit in (arb(2), ONE):
                rows = m.rows([Right(x, unit, k) if turn else Dual(x, {k: ONE})
                               for k, (x, turn) in enumerate(zip(numbers, turns))])
                need(all(row.v == 0 for row in rows), at, "the equations do not vanish exactly")
            J = [[row.d.get(k, ZERO).fmpq() for k in range(m.n + 1)] for row in rows]
        finally:
            ctx.prec = PRECISION
        whole = [[*row, *(fmpq(int(i == k)) for k in range(m.n))] for i, row in enumerate(J)]
        *_, last = fmpq_mat(whole).rref()[0].tolist()
        self.picked = [next(k for k, v in enumerate(row) if v)
                       for row in fmpq_mat(J).transpose().rref()[0].tolist() if any(row)]
        need(len(self.picked) == m.n - 1 and not any(last[: m.n + 1]), at,
             f"rank {len(self.picked)} of {m.n}: no two branches that meet")
        self.left = [arb(v) for v in last[m.n + 1 :]]


def term(x: Any, k: int) -> Any:
    """Return the factor of t^k in a series or number."""
    return x[k] if isinstance(x, arb_series) else ZERO if k else x


class Cone:
    """One branch z + t w through a change point z, |t| <= half, t told by the last coordinate.

    G(t, w) = (F(z + t w) / t, l F(z + t w) / t^2) of independent rows F and of l F with l F' = 0
    is smooth, also at t = 0, and has the same zeros as all rows elsewhere. Krawczyk's test proves
    one w for each t within r of w + v t, and no second.
    """

    def __init__(self, meeting: Meeting, w: list[arb], half: arb) -> None:
        self.meeting, self.m, self.z, self.half = meeting, meeting.m, meeting.z, half
        n, T, none = self.m.n, slack(half, ZERO), [ZERO] * (self.m.n + 1)
        for _ in range(12):
            move = self.slopes(w, ZERO).solve(self.parts(w, none, ZERO, 0)).entries()
            w = [*((a - b).mid() for a, b in zip(w, move)), ONE]
        Y = arb_mat([[x.mid() for x in row] for row in self.slopes(w, ZERO).inv().tolist()])
        bent = (Y * self.parts(w, none, ZERO, 1)).entries()
        self.w, self.v = w, [*((-x).mid() for x in bent), ZERO]
        G = [self.parts(w, self.v, *own) for own in ((ZERO, 0), (ZERO, 1), (T, 2))]
        miss = [x.abs_upper() for x in (Y * (G[0] + G[1] * T + G[2] * (T * T))).entries()]
        self.r = [x * 2 + SHORT for x in miss]  # so that poses in balls have room
        for _ in range(6):
            A = (Y * self.slopes(self.rates(T), T)).tolist()
            loss = [[(A[i][j] - int(i == j)).abs_upper() for j in range(n)] for i in range(n)]
            after = [own + sum(map(arb.__mul__, row, self.r), ZERO) for own, row in zip(miss, loss)]
            if all(bool(a < r) for a, r in zip(after, self.r)):
                return
            self.r = [arb((a * 2 + SHORT).upper()) for a in after]
        raise ArithmeticError("Krawczyk's test fails at a change point")

    def parts(self, w: list[arb], v: list[arb], T: arb, k: int) -> arb_mat:
        """Return the factors of t^k in G(t, w + v t), around T."""
        z = [arb_series([a + b * T + c * T * T, b + c * T * 2, c], 5)
             for a, b, c in zip(self.z, w, v)]
        rows, own = self.m.rows(z), self.meeting
        last = sum((term(x, k + 2) * v for x, v in zip(rows, own.left)), ZERO)
        return arb_mat(self.m.n, 1, [*(term(rows[i], k + 1) for i in own.picked), last])

    def slopes(self, w: list[arb], T: arb) -> arb_mat:
        """Return balls with dG/dw for all t in T and all w: l F' / t is a mean of l F'' w."""
        z = [Dual(arb_series([a + b * T, b], 2), {k: ONE})
             for k, (a, b) in enumerate(zip(self.z, w))]
        rows, own, ks = [row.d for row in self.m.rows(z)], self.meeting, range(self.m.n)
        last = [sum((term(x.get(k, 0), 1) * v for x, v in zip(rows, own.left)), ZERO) for k in ks]
        return arb_mat([*([term(rows[i].get(k, ZERO), 0) for k in ks] for i in own.picked), last])

    def rates(self, t: arb) -> list[arb]:
        """Return balls with w at t."""
        radii = [*(slack(r, ZERO) for r in self.r), ZERO]
        return [a + b * t + r for a, b, r in zip(self.w, self.v, radii)]

    def ahead(self, u: arb) -> list[arb]:
        """Return balls with the pose at u."""
        t = u - self.z[LAST]
        return [*(a + b * t for a, b in zip(self.z[:LAST], self.rates(t))), u]

    def holds(self, z: list[arb]) -> bool:
        """Whether a pose in balls lies inside."""
        t = z[LAST] - self.z[LAST]
        own = zip(z, self.z, self.w, self.v, [*self.r, ONE])
        return bool(abs(t) <= self.half) and all(
            bool(abs(x - a - b * t - c * t * t) < r * abs(t)) for x, a, b, c, r in own)


def pose_on(tube: Any, u: arb) -> list[arb]:
    """Return balls with the pose at u on a tube or cone, [] where it is not found."""
    t = u - tube.z[LAST]
    ahead = tube.ahead(u) if isinstance(tube, Cone) else [
        *(a + b * t for a, b in zip(tube.z[:LAST], tube.v)), u]
    if abs(t) <= SHORT and isinstance(tube, Cone):  # its balls are small there, and nothing else
        return ahead
    z = solution(tube.m, ahead).box()
    return z if tube.holds(z) else []


def across(m: Checked, z: list[arb], to: arb, data: Any, at: str) -> Any:
    """Yield tubes and a cone that lead from the pose z across a change point, each with its end."""
    own = part(data, "bodies", dict, at)
    numbers = [v for b in m.bodies for v in exacts(own.get(b), 3, f"{at}/bodies/{b}")]
    meeting = Meeting(m, [*numbers, exact(data.get("at"), f"{at}/at")], at)
    for _ in range(HALVINGS):
        t = z[LAST] - meeting.z[LAST]
        try:
            w = [((a - b) / t).mid() for a, b in zip(z, meeting.z)]
            cone = Cone(meeting, w, (abs(t) * (1 + arb(2) ** -50)).upper())
            if cone.holds(z):
                break
        except ArithmeticError:
            pass
        nearer = [*follow(m, z, m.n, (z[LAST] - t / 2).mid())]
        yield from nearer
        z = nearer[LAST][1]
    else:
        raise ArithmeticError("no branch is proved through the change point")
    other = to if abs(to - cone.z[LAST]) <= cone.half else (cone.z[LAST] - t).mid()
    after = pose_on(cone, other)
    if not after or not (to - cone.z[LAST]) * t < 0:
        raise FalseClaim(at, "the step does not lead across the change point")
    yield cone, after
    yield from follow(m, after, m.n, to)


def compare(m: Checked, z: list[arb], claim: Any, at: str) -> None:
    """Compare points and angles that are reported with a pose in balls, by the bounds reported."""
    laws, told = m.drivers, claim.get("drivers", {})
    need(z and all(abs(m.coordinate(name, m.placed(z)) - exact(text, at)) <= 1e-12 * (1 + m.size)
                   for name, text in told.items()),
         at, "is not where the path is, or not at the values of the laws")
    bounds = part(claim, "bound", dict, at)
    length, angle = (exact(bounds.get(k, "0"), f"{at}/bound/{k}") + arb(2) ** -90
                     for k in ("length", "angle"))  # balls prove no equality
    for name, text in told.items():  # values of laws are rounded: straight on to those told
        here = m.coordinate(name, m.placed(z))
        m.drivers = m.drivers | {name: ["+", here, ["*", exact(text, at) - here, "s"]]}
    *_, (_, z) = follow(m, [*z[:LAST], ZERO], m.n, ONE) if told else [(None, z)]
    m.drivers, frames = laws, m.placed(z)
    for name, place in part(claim, "points", dict, at).items():
        body, _, point = name.partition(".")
        own = zip(frames[body].point(m.points[body][point]), exacts(place, 2, f"{at}/{name}"))
        need(sum(((a - b) * (a - b) for a, b in own), ZERO) <= length * length and length >= 0,
             f"{at}/points/{name}", "further off than its bound")
    for body, own in part(claim, "angles", dict, at).items():
        need(abs(exact(own, f"{at}/angles/{body}") - frames[body].angle) <= angle,
             f"{at}/angles/{body}", "further off than its bound")


def agrees(m: Checked, z: list[arb], claim: Any, at: str, within: float = 1e-12) -> list[arb]:
    """Compare a pose in balls with the place to look at that is written down for it."""
    for k, (own, other) in enumerate(zip(z, m.claimed(claim, z[LAST], at))):
        if not abs(own - other) <= within * m.scale[k]:
            raise FalseClaim(f"{at}/bodies/{m.names[k][0]}", f"more than {within} off the pose")
    return z


def numbered(poses: Any, start: arb, end: arb) -> str:
    """Return what is claimed of a path: its poses' numbers grow, so that none stands twice."""
    own = [part(pose, "pose", int, f"poses/{k}") for k, pose in enumerate(poses)]
    need(own == sorted({*own}), "poses", "one stands there twice, or they are out of order")
    ends = (at.str(9, radius=False) for at in (start, end))
    return f"from {' to '.join(ends)}, {len(own)} poses, of others nothing is claimed"


def sweep(m: Checked, data: Any) -> str:
    """Check the steps of a path and the poses on it."""
    path = part(data, "path", dict, "certificate")
    start = solution(m, m.claimed(path, exact(path.get("at"), "path/at"), "path"))
    first = z = agrees(m, start.box(), path, "path")
    tubes: list[Any] = [Tube(m, start.z, start.v, arb(2) ** -110, m.n)]
    for k, step in enumerate(part(path, "steps", list, "path")):
        at = f"path/steps/{k}"
        to, meeting = exact(step.get("to"), at), step.get("through")
        need(exact(part(step, "from", str, at), at) == z[LAST] < to, at,
             "begins where none ends, or leads back")
        try:
            for tube, after in (follow(m, z, m.n, to) if meeting is None else
                                across(m, z, to, meeting, f"{at}/through")):
                tubes.append(tube)
                z = after
        except ArithmeticError as error:
            raise FalseClaim(at, f"not proved from {z[LAST].str(12)} on: {error}") from None
        agrees(m, z, step, at)
    for k, pose in enumerate(part(data, "poses", list, "certificate")):
        at, status = f"poses/{k}", part(pose, "status", str, f"poses/{k}")
        place = exact(part(pose, "at", str, at), at)
        near = [tube for tube in tubes if abs(place - tube.z[LAST]) <= tube.half][LAST:]
        need(status == "ok" and near, at, f"{status[:40]!r} is not what the path says of it")
        compare(m, pose_on(near[0], place), pose, at)
    crossed = sum("through" in step for step in path["steps"])
    return f"{len(tubes) - 1} steps, {crossed} change points, " \
           f"{numbered(data['poses'], first[LAST], z[LAST])}"


def check(path: str) -> str:
    """Check a certificate and return what was proved; the first false claim raises `FalseClaim`."""
    ctx.prec, ctx.cap, data = PRECISION, 5, read(path)
    if part(data, "kind", str, "certificate") != "sweep" or data.get("certificate") != VERSION:
        raise FalseClaim("certificate", f"not of version {VERSION}, or not a kind that is checked")
    try:
        return sweep(Checked(data.get("mechanism")), data)
    except (TypeError, AttributeError, LookupError, ValueError, ArithmeticError, RuntimeError) as e:
        raise FalseClaim("certificate", f"cannot be read or proved: {str(e)[:200]}") from None


if __name__ == "__main__":
    print(check(sys.argv[1]))
