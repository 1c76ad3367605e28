"""Checks a certificate of a planar sweep on curves in ball arithmetic: steps, poses, limits.

It shares nothing with the rest of the package but the file. Curves are formulas of the file, their
derivatives follow from rules written here. What does not depend on curves is the same text as in
check.py, so that either file can be copied and run by itself. What is proved, and by which theorem,
is said in docs/certificates.md.
"""
# ruff: noqa: B007, B020, B905
# fmt: off

from __future__ import annotations

import json
import re
import sys
from typing import Any

from flint import arb, arb_mat, arb_series, ctx, fmpq

VERSION, PRECISION, MOST_BYTES, MOST_BODIES, HALVINGS = 2, 128, 256_000_000, 150, 16
NUMBERS: dict[str, list[str]] = {
    "revolute": [], "weld": ["turn"], "prismatic": ["axis", "turn"], "slot": ["axis"], "curve": [],
    "distance": ["length"], "gear": ["ratio", "phase"], "rack": ["radius", "axis", "phase"]}
OPERATIONS = {"+": 2, "*": 2, "/": 2, "sin": 1, "cos": 1, "sqrt": 1}
LAST, ZERO, ONE, CURVED, STRAIGHT = -1, arb(0), arb(1), 6, 3
"""What the drivers are formulas of is the last coordinate of a pose; powers of t."""


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


def inverse(x: Any) -> Any:
    """Return 1 / x."""
    if isinstance(x, Dual):
        own = inverse(x.v)
        return Dual(own, {k: v * (own * own * -1) for k, v in x.d.items()})
    if isinstance(x, arb_series) and x[0].contains(0):
        raise ZeroDivisionError("a divisor may vanish")
    return ONE / x


def root(x: Any) -> Any:
    """Return the square root of x."""
    if isinstance(x, Dual):
        own = root(x.v)
        return Dual(own, {k: v * (inverse(own) / 2) for k, v in x.d.items()})
    if isinstance(x, arb_series) and not x[0] > 0:
        raise ZeroDivisionError("what a root is taken of may vanish")
    return x.sqrt()


def formula(data: Any, s: Any, place: str) -> Any:
    """Return the value of a formula: "s", an exact number, or [operation, formulas]."""
    if not isinstance(data, list):
        return data if isinstance(data, arb) else s if data == "s" else exact(data, place)
    need(len(data) == OPERATIONS[data[0]] + 1, place, f"not a formula: {str(data)[:60]}")
    one, *more = (formula(entry, s, place) for entry in data[1:])
    return {"+": lambda: one + more[0], "*": lambda: one * more[0], "sin": lambda: one.sin(),
            "/": lambda: one * inverse(more[0]), "cos": lambda: one.cos(),
            "sqrt": lambda: root(one)}[data[0]]()


def parsed(data: Any, place: str) -> Any:
    """Return a formula with its numbers read."""
    if isinstance(data, list) and data[:1] and data[0] in OPERATIONS:
        return [data[0], *(parsed(entry, place) for entry in data[1:])]
    return data if data == "s" else exact(data, place)


def joined(sign: str, a: Any, b: Any) -> Any:
    """Return the formula of a sum or product; those with 0 and 1 need none."""
    none, one = (next((k for k, v in enumerate((a, b)) if type(v) is arb and v == own), None)
                 for own in (0, 1))
    if none is not None:
        return ZERO if sign == "*" else (b, a)[none]
    return (b, a)[one] if sign == "*" and one is not None else [sign, a, b]


def slope(f: Any) -> Any:
    """Return the derivative of a formula that is parsed."""
    if not isinstance(f, list):
        return ONE if type(f) is str else ZERO
    (name, a, *b), d = f, [slope(own) for own in f[1:]]
    if name == "+":
        return joined("+", *d)
    if name == "*":
        return joined("+", joined("*", d[0], b[0]), joined("*", a, d[1]))
    if name == "/":  # (a' - f b') / b
        above = joined("+", d[0], joined("*", -ONE, joined("*", f, d[1])))
        return joined("*", above, ["/", ONE, b[0]])
    factor = {"sin": ["cos", a], "cos": ["*", -ONE, ["sin", a]], "sqrt": ["/", ONE / 2, f]}[name]
    return joined("*", factor, d[0])


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
    """Bodies, joints, curves and driver of a certificate, and their equations."""

    def __init__(self, data: Any, at: str = "mechanism") -> None:
        self.points: dict[str, dict[str, list[arb]]] = {}
        for body, own in part(data, "bodies", dict, at).items():
            table = part(data["bodies"], body, dict, f"{at}/bodies")
            self.points[body] = {p: exacts(own[p], 2, f"{at}/bodies/{body}/{p}") for p in table}
        self.bodies = [body for body in self.points if body != "ground"]
        joints = part(data, "joints", dict, at)
        self.joints = {own: self._joint(joints[own], f"{at}/joints/{own}") for own in joints}
        self.drivers, rolls = part(data, "drivers", dict, at), [("s",), ("s", "turn")]
        self.names = [(body, word) for body in self.bodies for word in ("x", "y", "angle")] + [
            (name, word) for name, joint in self.joints.items() if joint["kind"] == "curve"
            for word in rolls["roller" in joint]]
        self.n, self.at = len(self.names), {key: k for k, key in enumerate(self.names)}
        self.size = max([abs(float(v.mid())) for own in self.points.values() for place in
                         own.values() for v in place] or [0]) or 1.0
        self.unit = 1.0 if ".angle" in str(self.drivers) else self.size
        self.scale = [self.size if word in ("x", "y") else 1.0 for _, word in self.names] + [1.0]
        fits = len(self.bodies) <= MOST_BODIES and len(self.rows([ZERO] * (self.n + 1))) == self.n
        need(fits, at, f"over {MOST_BODIES} bodies, or equations do not fit coordinates")

    def _joint(self, joint: Any, at: str) -> dict[str, Any]:
        kind, carrier = part(joint, "kind", str, at), joint.get("carrier", "ground")
        ends = [tuple(part(joint, end, str, at).split(".")) for end in ("first", "second")]
        known = all(len(end) == 2 and end[1] in self.points.get(end[0], {}) for end in ends)
        need(kind in NUMBERS and carrier in self.points and known, at,
             f"not a kind that is checked, or no such body, point: {kind[:60]}")
        own: dict[str, Any] = {key: exact(joint.get(key), f"{at}/{key}")
                               for key in (*NUMBERS[kind], *({"roller"} & {*joint}))}
        if kind == "curve":
            place = [parsed(joint.get(key), f"{at}/{key}") for key in ("x", "y")]
            own["curve"] = [*place, *(map(slope, place) if "roller" in joint else (ZERO, ZERO))]
        return own | {"kind": kind, "ends": ends, "carrier": carrier}

    def rows(self, z: Any) -> list[Any]:
        """Return what vanishes at a pose z: x, y, angle of each body, last the driver."""
        frames, rows = self.placed(z), []
        for name, joint in self.joints.items():
            one, two, dx, dy = self.gap(joint, frames)
            kind, carrier = joint["kind"], frames[joint["carrier"]].angle * -ONE
            first, second = one.angle + carrier, two.angle + carrier
            if kind in ("revolute", "weld"):
                rows += [dx, dy]
            elif kind in ("prismatic", "slot"):
                rows.append(one.along(joint["axis"], dy, dx * -ONE))
            elif kind == "curve":
                x, y, vx, vy, c, s = self.contact(name, z)
                gone = one.turned(x, y)
                rows += [dx + gone[0] * -ONE, dy + gone[1] * -ONE]
                rows += [vx * s + vy * c * -ONE] if "roller" in joint else []
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

    def contact(self, name: str, z: Any) -> list[Any]:
        """Return place, derivative and, of a roller, cosine and sine of a curve's tangent."""
        s, joint = z[self.at[name, "s"]], self.joints[name]
        x, y, vx, vy = (formula(own, s, name[:90]) for own in joint["curve"])
        turn = z[self.at[name, "turn"]] if "roller" in joint else ZERO
        c, s, r = turn.cos(), turn.sin(), joint.get("roller", ZERO)
        return [x + s * r, y + c * (r * -1), vx, vy, c, s]

    def forward(self, z: Any) -> bool:
        """Whether the tangents of all rollers point along their curves, not against them."""
        told = [self.contact(own, z) for own, word in self.names if word == "turn"]
        return all(vx * c + vy * s > 0 for _, _, vx, vy, c, s in told)

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
        own, owners = part(data, "bodies", dict, at), [owner for owner, _ in self.names]
        return [v for owner in dict.fromkeys(owners) for v in exacts(
            own.get(owner), owners.count(owner), f"{at}/bodies/{owner}")] + [u]


def term(x: Any, k: int) -> Any:
    """Return the coefficient of t^k of a series, or of a number."""
    return x[k] if isinstance(x, arb_series) else x if k == 0 else ZERO


def along(c: Any, t: Any) -> Any:
    """Yield c(t) of the coefficients of each coordinate, t a number, a ball or a series."""
    for own, *more in map(reversed, c):
        for lower in more:
            own = own * t + lower
        yield own


def dense(m: Checked, z: list[Any], index: Any = None) -> list[list[Any]]:
    """Return the derivatives of the rows at z by all coordinates, or all but one."""
    return [[row.get(k, ZERO) for k in range(m.n + 1) if k != index] for row in m.slopes(z)[1]]


class Tube:
    """One solution within r of c(t) for each |t| <= half, and no other; c[index] is z[index] + t.

    With G(e, t) the rows at c(t) + e and Y(t) near the inverse of dG/de, Krawczyk's test (1969)
    |Y G(0, t)| + |1 - Y dG/de| r < r proves one solution with |e| < r for each t, and no second.
    All are polynomials of t; the last coefficient of G and of dG/de holds Lagrange's remainder.
    """

    def __init__(self, m: Checked, z: list[arb], half: arb, index: int, Y: arb_mat) -> None:
        self.m, self.z, self.half, self.index = m, z, half, index
        self.T, least = arb(0, half), arb(2) ** ((24 if half != 0 else 16) - PRECISION)
        self.free, self.Y, self.r = [k for k in range(m.n + 1) if k != index], [Y], [ZERO] * m.n
        self.c = [[x, ONE] if k == index and half != 0 else [x] for k, x in enumerate(z)]
        for ctx.cap in range(2, CURVED + 1 if half != 0 else 0):  # looked for, not proved
            rows = [[term(x, ctx.cap - 1)] for x in m.rows([*map(arb_series, self.c)])]
            for k, own in zip(self.free, (Y * arb_mat(rows) * -1).mid().entries()):
                self.c[k].append(own)
        G = self.terms(CURVED, lambda z: [[x] for x in m.rows(z)])
        self.r = [(x.abs_upper() * 4 + least).upper() for x in self.product(G).entries()]
        for _ in range(5):
            J = self.terms(STRAIGHT, lambda z: dense(m, z, index))
            while len(self.Y) < len(J) - 1:
                self.Y.append((-Y * sum(map(arb_mat.__mul__, J[1:], self.Y[::-1]), Y * 0)).mid())
            grown = (self.product(J) - 1) * arb_mat([[arb(0, r)] for r in self.r])
            self.share = max(float(x.abs_upper() / r) for x, r in zip(grown.entries(), self.r))
            after = [x.abs_upper() for x in (self.product(G) + grown).entries()]
            if all(bool(a < r) for a, r in zip(after, self.r)):
                return
            self.r = [(a * 2 + least).upper() for a in after]
        raise ArithmeticError("Krawczyk's test fails")

    def terms(self, count: int, rows: Any) -> list[arb_mat]:
        """Return rows within r of c(t) by powers of t; the last one is for all t."""
        found = list[arb_mat]()
        for t, ctx.cap in [(0, count), (self.T, count + 1)] if self.half != 0 else [(0, 3)]:
            own, upto = rows(self.box(arb_series([t, ONE]))), ctx.cap if self.half != 0 else 1
            for k in range(len(found), upto):
                found.append(arb_mat([[term(x, k) for x in row] for row in own]))
        return found

    def product(self, terms: list[arb_mat]) -> arb_mat:
        """Return what holds Y(t) times a polynomial, for all t."""
        total = terms[0] * 0
        for k in reversed(range(len(self.Y) + len(terms) - 1)):
            own = (Y * terms[k - i] for i, Y in enumerate(self.Y) if 0 <= k - i < len(terms))
            total = sum(own, total * self.T)
        return total

    def rates(self) -> tuple[list[arb], arb]:
        """Return dz by t, of the solutions for all t, and the second derivative of the driver."""
        own = self.product(self.terms(STRAIGHT, lambda z: dense(self.m, z))).tolist()
        J = arb_mat([[row[k] for k in self.free] for row in own])
        v = J.solve(arb_mat([[-row[self.index]] for row in own])).entries()
        v.insert(self.index, ONE)
        rows = self.m.rows([arb_series([a, b], 3) for a, b in zip(self.box(), v)])
        push = self.product([arb_mat([[term(x, 2) * -2] for x in rows])])
        return v, J.solve(push).entries()[LAST]

    def box(self, t: Any = None) -> list[Any]:
        """Return balls that hold all of it, at t if it is given."""
        z = [*along(self.c, self.T if t is None else t)]
        for k, r in zip(self.free, self.r):
            z[k] += arb(0, r)
        return z

    def holds(self, z: list[arb]) -> bool:
        """Whether a pose in balls lies inside."""
        c = [*along(self.c, t := z[self.index] - self.z[self.index])]
        return bool(abs(t) <= self.half) and all(
            bool(abs(z[k] - c[k]) < r) for k, r in zip(self.free, self.r))


def solution(m: Checked, z: list[Any], index: int = LAST) -> Tube:
    """Return the one pose near z whose coordinate `index` is that of z: a tube without length."""
    z, index, off = [x.mid() for x in z], index % (m.n + 1), 1.0
    for _ in range(30):
        if off > 1e-6:
            Y = arb_mat(dense(m, z, index)).solve(arb_mat(m.n, m.n) + 1, algorithm="approx")
        move = (Y * arb_mat([[x] for x in m.rows(z)])).entries()
        move.insert(index, ZERO)
        z, off = [(a - b).mid() for a, b in zip(z, move)], max(float(x.abs_upper()) for x in move)
        if off < 1e-25:
            return Tube(m, z, ZERO, index, Y)
        if not off < 1e3 * (1 + m.size):  # balls take long with sines of large numbers
            break
    raise ArithmeticError("Newton's method does not find a pose")


def follow(m: Checked, z: list[arb], index: int, to: arb, good: Any = bool, step: Any = 0) -> Any:
    """Yield tubes that lead from the pose z until coordinate `index` is `to`, each with its end."""
    c, least = list[Any](zip(z, solution(m, z, index).rates()[0])), abs(to - z[index]) / 2**HALVINGS
    step, most = step or (to - z[index]).mid(), 4.0
    while z[index] != to:
        end = to if abs(step) * 1.1 >= abs(to - z[index]) else (z[index] + step).mid()
        half = ((end - z[index]) / 2).mid()
        try:
            near = solution(m, along(c, z[index] + half - c[index][0]), index)
            tube = Tube(m, near.z, (abs(half) * (1 + arb(2) ** -50)).mid(), index, near.Y[0])
            ahead = [*along(tube.c, end - tube.z[index])]
            after = solution(m, [*ahead[:index], end, *ahead[index + 1 :]], index).box()
            if not (tube.holds(z) and tube.holds(after) and good(tube)):
                raise ArithmeticError("the ends of a step leave it")
        except (ArithmeticError, ValueError):  # also of series whose divisor may vanish
            if abs(step) < least:
                raise
            step, most = half, 1.0
        else:
            yield tube, after
            longer = min(most, (0.3 / (tube.share + 1e-3)) ** (1 / STRAIGHT))
            step, most, z, c = ((end - z[index]) * longer).mid(), 2 * most, after, tube.c


def turning(m: Checked, z: list[arb], claim: list[arb], sense: int, at: str) -> list[arb]:
    """Return balls with the limit position behind the pose z: there the driver turns back."""
    v, _ = solution(m, z).rates()
    q = max(range(m.n), key=lambda k: abs(float(v[k].mid())) / m.scale[k])

    def good(tube: Tube) -> bool:  # one place at most where the driver stands still
        v, bend = tube.rates()
        return not v[LAST].contains(0) or not bend.contains(0)

    def speed(z: Any) -> arb:
        near = solution(m, z, q)
        need(tube.holds(near.box()), at, "a pose is not that of the way there")
        return near.rates()[0][LAST] * ahead * sense

    ahead, z = claim[q] - z[q].mid(), solution(m, z, q).box()
    for tube, after in follow(m, z, q, (z[q] + ahead * 2.1).mid(), good):
        if not (speed(z) > 0 and speed(after) > 0):
            break
        z = after
    need(speed(z) > 0 > speed(after), at, "the driver does not turn back, or moves away from there")
    z = [*along(tube.c, claim[q] - tube.z[q])]
    for _ in range(8):
        near = solution(m, z, q)
        (v, bend), z = near.rates(), near.z.copy()
        z[q] = (z[q] - v[LAST] / bend).mid()
    near = Tube(m, near.z, arb(2) ** -60, q, near.Y[0])
    one, other = (speed(along(near.c, t)) for t in (near.half, -near.half))
    need(one * other < 0, at, "the place where the driver turns back is not found")
    return near.box()


def compare(m: Checked, z: list[arb], claim: Any, at: str) -> None:
    """Compare points and angles that are reported with a pose in balls, by the bounds reported."""
    laws, told = m.drivers, claim.get("drivers", {})
    need(z and all(abs(m.coordinate(name, m.placed(z)) - exact(text, at)) <= 1e-12 * (1 + m.size)
                   for name, text in told.items()),
         at, "is not where the path is, or not at the values of the laws")
    need(m.forward(z), at, "a roller's tangent points against its curve")
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
        need(abs(exact(own, at) - frames[body].angle) <= angle, f"{at}/angles/{body}", "is too far")


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
    """Check the steps of a path, its limit positions, and the poses on it."""
    path = part(data, "path", dict, "certificate")
    start = solution(m, m.claimed(path, exact(path.get("at"), "path/at"), "path"))
    first = z = agrees(m, start.box(), path, "path")
    tubes, ends = [Tube(m, start.z, arb(2) ** -110, m.n, start.Y[0])], {}
    for k, step in enumerate(part(path, "steps", list, "path")):
        at = f"path/steps/{k}"
        need(exact(part(step, "from", str, at), at) == z[LAST] < exact(step.get("to"), at), at,
             "begins where none ends, or leads back")
        try:
            before = k and tubes[LAST].half * 4
            for tube, z in follow(m, z, m.n, exact(step.get("to"), at), step=before):
                tubes.append(tube)
        except ArithmeticError as error:
            raise FalseClaim(at, f"not proved from {z[LAST].str(12)} on: {error}") from None
        agrees(m, z, step, at)
    last = z[LAST]
    for end, sense, own in (("low", -1, first), ("high", 1, z)):
        if path.get(end) is not None:
            at, u = f"path/{end}", exact(part(path[end], "at", str, f"path/{end}"), f"path/{end}")
            z = ends[end] = turning(m, own, m.claimed(path[end], u, at), sense, at)
            need(abs(z[LAST] - u) <= 1e-12 * m.unit, f"{at}/at", f"it is at {z[LAST].str(20)}")
            agrees(m, z, path[end], at)
    for k, pose in enumerate(part(data, "poses", list, "certificate")):
        at, status = f"poses/{k}", part(pose, "status", str, f"poses/{k}")
        place = exact(part(pose, "at", str, at), at)
        near = [tube for tube in tubes if abs(place - tube.z[LAST]) <= tube.half][LAST:]
        if status == "ok" and near:
            z = solution(m, [*[*along(near[0].c, place - near[0].z[LAST])][:LAST], place]).box()
            compare(m, z if near[0].holds(z) else [], pose, at)
        elif status == "limit" and pose.get("end") in ends:
            z = ends[pose["end"]]
            compare(m, z if abs(z[LAST] - place) <= 1e-12 * m.unit else [], pose, at)
        else:
            need(status == "unassembled" and (
                ("low" in ends and place < ends["low"][LAST])
                or ("high" in ends and place > ends["high"][LAST])), at,
                f"{status[:40]!r} is not what the path says of it")
    return f"{len(tubes) - 1} steps, {len(ends)} limit positions, " \
           f"{numbered(data['poses'], first[LAST], last)}"


def check(path: str) -> str:
    """Check a certificate and return what was proved; the first false claim raises `FalseClaim`."""
    ctx.prec, ctx.cap, data = PRECISION, 3, read(path)
    need(part(data, "kind", str, "certificate") == "sweep" and data.get("certificate") == VERSION,
         "certificate", f"not of version {VERSION}, or not a kind that is checked")
    try:
        return sweep(Checked(data.get("mechanism")), data)
    except (TypeError, AttributeError, LookupError, ValueError, ArithmeticError, RuntimeError) as e:
        raise FalseClaim("certificate", f"cannot be read or proved: {str(e)[:200]}") from None


if __name__ == "__main__":
    print(check(sys.argv[1]))
