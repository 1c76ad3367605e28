"""Checks a certificate of modes on curves in ball arithmetic: all, and no others.

It shares nothing with the rest of the package but the file. Curves have no count of complex poses;
their real ones are counted place by place along the whole curve. What is common with check.py,
check_curves.py and check_superfluous.py is the same text, so that each file can be copied and run
by itself. What is proved, and by which theorem, is said in docs/certificates.md.
"""
# ruff: noqa: B905
# fmt: off

from __future__ import annotations

import json
import re
import sys
from typing import Any

from flint import acb, acb_mat, arb, arb_mat, arb_series, ctx, fmpq

VERSION, PRECISION, MOST_BYTES, MOST_BODIES, HALVINGS = 2, 128, 256_000_000, 150, 12
NUMBERS: dict[str, list[str]] = {
    "revolute": [], "weld": ["turn"], "prismatic": ["axis", "turn"], "slot": ["axis"], "curve": [],
    "distance": ["length"], "gear": ["ratio", "phase"], "rack": ["radius", "axis", "phase"]}
OPERATIONS = {"+": 2, "*": 2, "/": 2, "sin": 1, "cos": 1, "sqrt": 1}
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


def told(m: Any, z: list[arb], claim: Any, at: str) -> None:
    """Compare points and angles that are reported with a pose in balls, by the bounds reported."""
    frames, bounds = m.placed(z), part(claim, "bound", dict, at)
    length, angle = (exact(bounds.get(k, "0"), f"{at}/bound/{k}") + arb(2) ** -90
                     for k in ("length", "angle"))  # balls prove no equality
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


def most(m: Checked, group: list[str], known: set[str]) -> tuple[int, str]:
    """Return how many complex poses a group has at most, and by which theorem of the field."""
    kinds, inner, driven, arm, turn = list[str](), list[Any](), set[str](), {""}, ZERO
    hubs, fresh = list[Any](), group and not known & set(group) and len(set(group)) == len(group)
    need(fresh, "groups", f"no bodies, or one stands there twice: {str(group)[:60]}")
    for name, joint in m.joints.items():
        (one, _), (other, _) = joint["ends"]
        touched = {one, other, joint["carrier"]}
        if touched & set(group) and touched <= known | set(group):
            kinds.append(joint["kind"])
            inner += [{one, other}] if {one, other} <= set(group) else []
            driven |= {f"{name}.slide"} | ({f"{name}.angle"} if name not in m.bodies else set())
            hubs += [m.points[body][p] for body, p in joint["ends"] if body in group]
            hubs += [None] if joint["kind"] == "rack" and other not in known else []
            if joint["kind"] == "gear" and one in known:  # of the wheel, for one of its carrier
                turn, arm = ONE - ONE / joint["ratio"], {other, joint["carrier"]}
    own = [name for name in m.drivers if name in driven or (
        name.split(".")[0] in group and not name.endswith(".slide"))]
    pins, slides, gears = map(kinds.count, ("revolute", "prismatic", "gear"))
    shape = (len(set(group) - known), len(kinds), len(inner), len(own), pins + slides == len(kinds))
    circles = "circles and lines"
    for count, theorem, holds in (
        (1, "", kinds == ["weld"] or (shape == (1, 1, 0, 1, True) and own[0].count(".") == 1)),
        (2 if slides <= 1 else 1, circles, shape == (2, 3, 1, 0, True)),
        (2, circles, shape == (2, 2, 1, 2, True) and not slides and own[0][:-2] == own[1][:-2]),
        (2 if "distance" in kinds or (pins and "slot" in kinds) else 1, circles,
         shape[:4] == (1, 2, 0, 0) and pins + slides == 1 and not gears
         and "weld" not in kinds and (slides or "rack" not in kinds
                                      or all(spot == hubs[0] for spot in hubs))),  # round a pin
        (1, "", len(kinds) == 2 * gears == 2 * pins == 2 * shape[0] and not own),  # linear
        (2, circles, shape == (3, 4, 2, 1, True) and slides == 1 and own[0].endswith(".slide")),
        (6, "Roberts 1875", shape == (3, 4, 2, 1, True) and own[0].count(".") == 2 and not slides),
        (2 * max(1, *(abs(int(float(k))) for k in (turn, turn - 1))), "degree in exp(i angle)",
         turn.is_integer() and arm in inner and shape[:4] == (3, 5, 2, 0) and gears == 1
         and pins == 4),
        (6, "Gosselin, Sefrioui, Richard 1992", shape == (4, 6, 3, 0, True) and slides <= 2
         and any(sum(body in pair for pair in inner) == 3 for body in group))):
        if holds:
            return count, theorem
    return 0, f"no theorem here tells how many poses {group} has"


def repeats(f: Any) -> bool:
    """Whether a formula has the period 2 pi: s stands in whole multiples in sines and cosines."""
    if not isinstance(f, list) or f[0] not in ("sin", "cos"):
        return f != "s" if not isinstance(f, list) else all(map(repeats, f[1:]))
    rate = slope(f[1])
    return "s" not in re.findall("'(.*?)'", str(rate)) and bool(
        formula(rate, ZERO, "a curve").is_integer())


def count_of(m: Checked, group: list[str], known: set[str], z: list[arb]) -> tuple[int, str]:
    """Return how many poses a group has at most, or touches its curve in, others being as in z.

    From the place s on the curve a body's follows; its guide's equation is one of s alone.
    """
    ends = {name: [body for body, _ in joint["ends"]] for name, joint in m.joints.items()}
    kinds = sorted((m.joints[name]["kind"], name) for name, own in ends.items()
                   if {*group} & {*own} and {*own} <= known | {*group})
    if "curve" not in str(kinds):
        return most(m, group, known)
    (curve, name), (kind, other) = kinds
    joint, guide, frames = m.joints[name], m.joints[other], m.placed(z)
    if (curve, kind, ends[name][1:]) != ("curve", "prismatic", group):
        return 0, f"no theorem here tells how many poses {group} has"
    need(all(map(repeats, joint["curve"][:2])), f"joints/{name}", "has not the period 2 pi")
    base = next(body for body in ends[other] if body not in group)
    angle = frames[base].angle + guide["turn"] * (1 if ends[other][1:] == group else -1)
    (carrier, first), (_, second) = joint["ends"]

    def height(s: arb) -> Any:
        """Return how far the body is off its guide with the contact at s."""
        x, y, vx, vy = (formula(f, Dual(s, {0: ONE}), name) for f in joint["curve"])
        if "roller" in joint:
            r = inverse(root(vx * vx + vy * vy)) * joint["roller"]
            x, y = x + vy * r, y + vx * r * -1
        x, y = frames[carrier].turned(x, y)
        start, arm = frames[carrier].point(m.points[carrier][first]), Placing(ZERO, ZERO, angle)
        dx, dy = arm.point(m.points[group[0]][second])
        placing = Placing(x + start[0] + dx * -ONE, y + start[1] + dy * -ONE, angle)
        one, _, dx, dy = m.gap(guide, frames | {group[0]: placing})
        return one.along(guide["axis"], dy, dx * -ONE)

    todo, count, whole = [(ZERO, ONE)], 0, arb.pi() * 2
    while todo:
        a, b = todo.pop()
        middle = (a + b) / 2
        h = height((middle + slack((b - a) / 2, ZERO)) * whole + ONE / 7)
        if h.v > 0 or h.v < 0:
            continue
        if (d := h.d[0]) > 0 or d < 0:
            ends = height(a * whole + ONE / 7).v * height(b * whole + ONE / 7).v
            count += bool(ends < 0)
            if ends < 0 or ends > 0:
                continue
        if b - a < arb(2) ** -30:
            raise FalseClaim("modes", f"contacts of {group} that are too near each other")
        todo += [(a, middle), (middle, b)]
    return count, "signs along the whole curve"


def wheels(m: Checked) -> list[set[str]]:
    """Return the bodies of each joint whose equations tell whole turns apart."""
    return [{joint["carrier"], *(body for body, _ in joint["ends"])} - {"ground"}
            for joint in m.joints.values() if joint["kind"] in ("gear", "rack")]


def alike(m: Checked, one: list[Any], other: list[Any], group: list[str]) -> bool:
    """Whether the poses of a group in balls may be one, whole turns aside."""
    pairs = zip(m.names, one, other)
    return all(((a - b) if word in ("x", "y") else ((a - b) / 2).sin()).contains(0)
               for (owner, word), a, b in pairs if owner in group)


def modes(m: Checked, data: Any) -> str:
    """Check all poses at one value of the driver, and that there are no others."""
    u, groups = exact(part(data, "at", str, "modes"), "at"), part(data, "groups", list, "modes")
    poses, known, told_by = list[list[arb]](), {"ground"}, dict[str, int]()
    wheeled = set[str]().union(*wheels(m))
    for k, mode in enumerate(part(data, "modes", list, "certificate")):
        at = f"modes/{k}"
        poses.append(agrees(m, solution(m, m.claimed(mode, u, at)).box(), mode, at))
        told(m, poses[k], mode, at)
        need(m.forward(poses[k]), at, "a roller's tangent points against its curve")
    families = [poses]
    for group in groups:
        split = list[list[list[arb]]]()
        for family in families:
            parts = list[list[list[arb]]]()
            for z in family:
                same = [own for own in parts if alike(m, own[0], z, group)][:1]
                parts += [] if same else [[]]
                (*same, parts[LAST])[0].append(z)
                turns = [m.at[own, "angle"] for own in wheeled & {*group}]
                need(not same or all((same[0][0][k] - z[k]).contains(0) for k in turns), "modes",
                     "one stands there twice, with whole turns that wheels tell")
            count, why = count_of(m, group, known, family[0])
            need(count in (len(parts), 0), "modes", f"{len(parts)} of {count} poses of {group}")
            split, told_by[why] = split + parts, count
        families, known = split, known | {*group}
    need(known == {"ground", *m.bodies} and all(len(family) == 1 for family in families), "modes",
         "one stands there twice, or bodies are in no group")
    if not all(told_by.values()):
        return f"{len(poses)} modes exist; that there are no others is not claimed: " \
               f"{next(why for why, count in told_by.items() if not count)}"
    return f"{len(poses)} modes, and no others: {', '.join(filter(None, told_by))}"


def check(path: str) -> str:
    """Check a certificate and return what was proved; the first false claim raises `FalseClaim`."""
    ctx.prec, ctx.cap, data = PRECISION, 3, read(path)
    kind = part(data, "kind", str, "certificate")
    if data.get("certificate") != VERSION or kind != "modes":
        raise FalseClaim("certificate", f"not of version {VERSION}, or not a kind that is checked")
    try:
        return modes(Checked(data.get("mechanism")), data)
    except (TypeError, AttributeError, LookupError, ValueError, ArithmeticError, RuntimeError) as e:
        raise FalseClaim("certificate", f"cannot be read or proved: {str(e)[:200]}") from None


if __name__ == "__main__":
    print(check(sys.argv[1]))
