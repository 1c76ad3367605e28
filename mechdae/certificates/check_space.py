"""Checks a certificate of a spatial sweep in ball arithmetic: every step, pose, limit position.

It shares nothing with the rest of the package but the file. Every body has a place and a unit
quaternion, every joint its equations between two of them; no tree, no elimination. What does not
depend on the dimension is the same text as in check.py, so that either file can be copied and run
by itself. What is proved, and by which theorem, is said in docs/certificates.md.
"""
# ruff: noqa: B007, B020, B905
# fmt: off

from __future__ import annotations

import json
import re
import sys
from typing import Any

from flint import arb, arb_mat, arb_series, ctx, fmpq

VERSION, PRECISION, MOST_BYTES, MOST_UNKNOWNS, HALVINGS = 2, 128, 256_000_000, 450, 16
AXIAL = "ng mg nA mA"
ROWS = {"revolute": "ng mg ag nA mA", "cylindrical": AXIAL, "prismatic": f"{AXIAL} nM",
        "screw": f"{AXIAL} ag", "universal": "ng mg ag aN", "spherical": "xg yg zg",
        "planar": "ag nA mA", "weld": "ng mg ag nA mA nM", "distance": "gg", "vector": "xg yg zg"}
"""Products that vanish, of the gap g of a joint's points, the fixed axes x y z, normal, axis x
normal and axis of its first side, n m a, and of its second, N M A; gg is a square that is given."""
SPAN, NUMBERS = ("length", "elevation", "azimuth"), {"screw": ["pitch"], "distance": ["square"]}
SIDES = (("axis", "zero"), ("axis2", "zero2"))
SENSES, ALONG = (("aA", "nA"), ("nN", "nM")), {"slide": "ag", "x": "ng", "y": "mg"}
TURNS = {"angle": "nmN", "angle2": "AMa"}
"""What is positive where a row vanishes; coordinates of joints: products, and of turns from where
in which sense to where they count."""
LAST, ZERO, ONE, CURVED, STRAIGHT = -1, arb(0), arb(1), 6, 3
"""What the drivers are formulas of is the last coordinate of a pose; powers of t."""
STILL = [[ONE if i == k else ZERO for k in range(3)] for i in range(3)]


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
    """Return a driver's value: "s", a number, or those at s = 0, 1, ..., straight on between."""
    if not isinstance(data, list):
        return s if data == "s" else exact(data, place)
    at = s.v if isinstance(s, Dual) else s
    at = at[0] if isinstance(at, arb_series) else at
    k = min(max(int(float(at.lower()) + 1e-9), 0), len(data) - 2)
    if not at < k + 1 + 1e-9:
        raise ArithmeticError("a step leads past a corner")
    one, other = (exact(data[i], place) for i in (k, k + 1))
    return (s + -k) * (other - one) + one


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


def dot(one: Any, other: Any) -> Any:
    """Return the product of two directions; what is exactly zero takes no time."""
    pairs = [(a, b) for a, b in zip(one, other) if not any(
        type(v) is arb and v == 0 for v in (a, b))]
    return sum((a * b for a, b in pairs), ZERO)


def cross(a: Any, b: Any) -> list[Any]:
    return [a[i - 2] * b[i - 1] + a[i - 1] * b[i - 2] * -ONE for i in range(3)]


def less(one: Any, other: Any) -> list[Any]:
    return [a + b * -ONE for a, b in zip(one, other)]


def rotation(w: Any, x: Any, y: Any, z: Any) -> list[list[Any]]:
    """Return the rotation by a unit quaternion, its real part first."""
    xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
    wx, wy, wz = w * (x * -ONE), w * (y * -ONE), w * (z * -ONE)
    return [[(yy + zz) * -2 + ONE, (xy + wz) * 2, (xz + wy * -ONE) * 2],
            [(xy + wz * -ONE) * 2, (xx + zz) * -2 + ONE, (yz + wx) * 2],
            [(xz + wy) * 2, (yz + wx * -ONE) * 2, (xx + yy) * -2 + ONE]]


class Checked:
    """Bodies, joints and drivers of a certificate, and their equations."""

    def __init__(self, data: Any, at: str = "mechanism", square: bool = True) -> None:
        self.points: dict[str, dict[str, list[arb]]] = {}
        for body, own in part(data, "bodies", dict, at).items():
            table = part(data["bodies"], body, dict, f"{at}/bodies")
            self.points[body] = {p: exacts(own[p], 3, f"{at}/bodies/{body}/{p}") for p in table}
        joints, self.names = part(data, "joints", dict, at), list[tuple[str, str]]()
        self.joints = {own: self._joint(joints[own], f"{at}/joints/{own}") for own in joints}
        for body in self.points:
            kinds = {joint["kind"] for joint in self.joints.values() if body in joint["bodies"]}
            if kinds and body != "ground":  # at ends of vectors are points, which do not turn
                held = len(self.points[body]) == 1 and kinds <= {"vector", "spherical", "distance"}
                self.names += [(body, w) for w in ("xyz0123", "xyz")[held and "vector" in kinds]]
        for name, joint in self.joints.items():
            self.names += [(name, word) for word in joint["unknown"]]
        self.n, self.at = len(self.names), {key: k for k, key in enumerate(self.names)}
        lengths = [v for own in self.points.values() for place in own.values() for v in place]
        lengths += [j[key] for j in self.joints.values() for key in ("length", "pitch") if key in j]
        self.size = max([abs(float(v.mid())) for v in lengths] or [0]) or 1.0
        self.scale = [self.size if word in (*"xyz", "length") else 1.0
                      for _, word in [*self.names, ("", "")]]
        sums = data.get("sums", {})
        self.sums = {k: {c: exact(v, f"{at}/sums/{k}") for c, v in sums[k].items()} for k in sums}
        self.kinds = ["norm" for _, word in self.names if word == "0"] + [
            j["kind"] for j in self.joints.values() for row in (
                *ROWS[j["kind"]].split(), *({*j["unknown"]} & {*TURNS}))]
        self.drivers, left = part(data, "drivers", dict, at), data.get("superfluous", [])
        slides = (".slide", ".length", ".x", ".y", ".z")
        self.unit = self.size if str([*self.drivers][:1])[:-2].endswith(slides) else 1.0
        self.left_out, self.off = {int(k) for k in left}, 0.0
        need(len(left) == len(self.left_out) and all(
            0 <= k < len(self.kinds) and self.kinds[k] != "norm" for k in self.left_out),
            f"{at}/superfluous", "not the number of an equation of a joint, or one stands twice")
        count = len(self.equations([ZERO] * (self.n + 1))[0]) - len(self.left_out)
        fits = self.n <= MOST_UNKNOWNS and (count == self.n or not square)
        need(fits, at, f"{count} equations for {self.n} unknowns, of at most {MOST_UNKNOWNS}")

    def _joint(self, joint: Any, at: str) -> dict[str, Any]:
        kind = part(joint, "kind", str, at)
        ends = [tuple(part(joint, end, str, at).split(".")) for end in ("first", "second")]
        known = all(len(end) == 2 and end[1] in self.points.get(end[0], {}) for end in ends)
        need(kind in ROWS and known, at, f"not checked, or no such body, point: {kind[:60]}")
        keys = NUMBERS.get(kind, [key for key in SPAN if key in joint])
        own: dict[str, Any] = {key: exact(joint.get(key), f"{at}/{key}") for key in keys}
        sided = "A" in ROWS[kind] or kind == "universal"
        own["sides"] = [self._side(*(exacts(joint.get(key), 3, f"{at}/{key}") for key in pair))
                        for pair in SIDES * sided]
        if kind == "universal":  # the pin of the second side is its normal
            n, m, a = own["sides"][1]
            own["sides"][1] = [a, [v * -ONE for v in m], n]
        allowed = [w for w in SPAN if w not in joint] if kind == "vector" else [*TURNS] * sided
        own["unknown"] = [word for word in allowed if word in joint.get("unknown", allowed)]
        need(len(own["unknown"]) == len(joint.get("unknown", own["unknown"])), at, "unknown twice")
        return own | {"kind": kind, "ends": ends, "bodies": [body for body, _ in ends]}

    def _side(self, axis: list[arb], zero: list[arb]) -> list[list[arb]]:
        """Return normal, axis x normal, axis of a side."""
        a = [v / dot(axis, axis).sqrt() for v in axis]
        n = [v - w * dot(a, zero) for v, w in zip(zero, a)]
        n = [v / dot(n, n).sqrt() for v in n]
        return [n, cross(a, n), a]

    def rows(self, z: Any) -> list[Any]:
        """Return what vanishes at a pose z: places and quaternions, turns; last the parameter."""
        return [row for k, row in enumerate(self.equations(z)[0]) if k not in self.left_out]

    def equations(self, z: Any) -> tuple[list[Any], list[Any]]:
        """Return all rows, also those left out, and what is positive at a pose."""
        frames, positive, own = self.placed(z), list[Any](), self.at
        turns = [z[k : k + 4] for (_, word), k in own.items() if word == "0"]
        rows = [dot(e, e) + -ONE for e in turns]
        for name, joint in self.joints.items():
            d, pairs = self.directions(joint, frames), ROWS[joint["kind"]].split()
            if joint["kind"] == "vector":
                v = [joint[w] if w in joint else z[own[name, w]] for w in SPAN]
                level, up = v[0] * v[1].cos(), v[0] * v[1].sin()
                d["g"] = less(d["g"], (level * v[2].cos(), up, level * v[2].sin()))
            if {"elevation", "azimuth"} <= {*joint["unknown"]}:  # of vectors told in two ways one
                positive.append(v[1].cos())
            if {"length", "elevation"} <= {*joint["unknown"]}:
                positive.append(v[0])
            for pair in pairs:
                row = dot(*(d[letter] for letter in pair))
                if pair == "ag" and "pitch" in joint:
                    row += z[own[name, "angle"]] * (joint["pitch"] / arb.pi() / -2)
                rows.append(row + joint["square"] * -ONE if pair == "gg" else row)
            positive += [dot(d[p[0]], d[p[1]]) for p, row in SENSES if row in pairs]
            for word in {*joint["unknown"]} & {*TURNS}:
                turn, (x, y, w) = z[own[name, word]], [d[c] for c in TURNS[word]]
                x, y, c, s = dot(x, w), dot(y, w), turn.cos(), turn.sin()
                rows.append(s * x + c * y * -ONE)
                positive.append(c * x + s * y)
        rows += [sum((self.coordinate(c, frames) * v for c, v in own.items() if c),
                     own.get("", ZERO)) for own in self.sums.values()]
        return [*rows, *(self.coordinate(name, frames) + formula(law, z[LAST], name[:90]) * -ONE
                         for name, law in self.drivers.items())], positive

    def placed(self, z: Any) -> dict[str, Any]:
        """Return places and rotations of all bodies, and the coordinates themselves."""
        at, frames = self.at, {"": z, "ground": ([ZERO] * 3, STILL)}
        return frames | {b: (z[k : k + 3], rotation(*z[k + 3 : k + 7]) if (b, "0") in at else STILL)
                         for (b, word), k in at.items() if word == "x"}

    def place(self, end: Any, frames: Any) -> list[Any]:
        (body, point), (r, R) = end, frames[end[0]]
        return [x + dot(row, self.points[body][point]) for x, row in zip(r, R)]

    def directions(self, joint: Any, frames: Any) -> dict[str, Any]:
        """Return those that rows are made of, by their letters."""
        one, other = (self.place(end, frames) for end in joint["ends"])
        return {"g": less(other, one), **dict(zip("xyz", STILL))} | {
            letter: [dot(row, v) for row in frames[body][1]]
            for body, side, letters in zip(joint["bodies"], joint["sides"], ("nma", "NMA"))
            for letter, v in zip(letters, side)}

    def coordinate(self, name: str, frames: Any) -> Any:
        """Return BODY.POINT.x, .y, .z or a coordinate of a joint."""
        owner, *words = name.split(".")
        if len(words) == 2 and words[0] in self.points.get(owner, {}) and words[1] in [*"xyz"]:
            return self.place((owner, words[0]), frames)["xyz".index(words[1])]
        if owner in self.joints and (owner, *words) in self.at:
            return frames[""][self.at[owner, words[0]]]
        if owner in self.joints and name[len(owner) + 1 :] in ALONG and self.joints[owner]["sides"]:
            d, pair = self.directions(self.joints[owner], frames), ALONG[words[0]]
            return dot(*(d[letter] for letter in pair))
        raise FalseClaim("mechanism/drivers", f"no such coordinate: {name[:60]}")

    def slopes(self, z: list[Any]) -> tuple[list[Any], list[dict[int, Any]]]:
        """Return the rows at z and their derivatives."""
        rows = self.rows([Dual(x, {k: ONE}) for k, x in enumerate(z)])
        return [row.v for row in rows], [row.d for row in rows]

    def claimed(self, data: Any, u: arb, at: str) -> list[arb]:
        """Return a pose (7 or 3 numbers of each body, turns; u) as it is in the certificate."""
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
    """Compare points and orientations with a pose in balls, by the bounds that are reported."""
    need(z, at, "is not where the path is")
    bounds = part(claim, "bound", dict, at)
    length, angle = (exact(bounds.get(k, "0"), f"{at}/bound/{k}") + arb(2) ** -90
                     for k in ("length", "angle"))  # balls prove no equality
    frames, (rows, positive) = m.placed(z), m.equations(z)
    need(all(v > 0 for v in positive), at, "an axis has the other sense, or an angle half a turn")
    for k in m.left_out:
        need(abs(rows[k]) <= 1e-9 * (1 + m.size), at, f"the superfluous equation {k} is off")
        m.off = max(m.off, 1.05 * float(rows[k].abs_upper()))
    for name, place in part(claim, "points", dict, at).items():
        own = zip(m.place(name.split("."), frames), exacts(place, 3, f"{at}/{name}"))
        need(sum(((a - b) * (a - b) for a, b in own), ZERO) <= length * length and length >= 0,
             f"{at}/points/{name}", "further off than its bound")
    for body, own in part(claim, "orientations", dict, at).items():
        q, k = exacts(own, 4, f"{at}/orientations/{body}"), m.at[body, "0"]
        turn, w = cross(q[1:], z[k + 1 : k + 4]), z[k]
        turn = [q[0] * b - w * a - c for a, b, c in zip(q[1:], z[k + 1 : k + 4], turn)]
        need(abs(dot(q, q) - 1) < 1e-12 and 0 <= angle <= 1
             and dot(turn, turn) <= dot(q, q) * (angle / 2).sin() ** 2,
             f"{at}/orientations/{body}", "further off than its bound")


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
        m = Checked(data.get("mechanism"))
        corners = {len(law) for law in m.drivers.values() if isinstance(law, list)}
        done = sweep(m, data)
        need(len(corners) <= 1, "mechanism/drivers", "lists of values are not of one length")
        said = f", drivers with {corners.pop()} values each" if corners else ""
        if m.left_out:
            said += f", {len(m.left_out)} superfluous equations off by {m.off:.1e}"
        return done + said
    except (TypeError, AttributeError, LookupError, ValueError, ArithmeticError, RuntimeError) as e:
        raise FalseClaim("certificate", f"cannot be read or proved: {str(e)[:200]}") from None


if __name__ == "__main__":
    print(check(sys.argv[1]))
