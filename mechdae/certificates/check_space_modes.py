"""Checks a certificate of spatial assembly modes in ball arithmetic: each of them, and their count.

It shares nothing with the rest of the package but the file. The mechanism and the test of a pose
are the same text as in check_space.py, so that either file can be copied and run by itself. What is
proved, and by which theorem, is said in docs/certificates.md.
"""
# ruff: noqa: B905
# fmt: off

from __future__ import annotations

import json
import re
import sys
from typing import Any

from flint import acb, acb_mat, arb, arb_mat, arb_series, ctx, fmpq

VERSION, PRECISION, MOST_BYTES, MOST_UNKNOWNS, HALVINGS = 2, 128, 256_000_000, 450, 12
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
LAST, ZERO, ONE = -1, arb(0), arb(1)
"""What the drivers are formulas of is the last coordinate of a pose."""
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


def together(m: Checked, own: dict[str, Any], new: set[str], known: set[str]) -> tuple[int, str]:
    """Return how many complex poses two or five bodies have at most, 0 where no theorem tells."""
    at = {b: [m.points[b][p] for j in own.values() for e, p in j["ends"] if e == b] for b in new}
    meet = {b for b, spots in at.items() if spots[1:] == spots[:-1]}  # its joints, in one point
    told = sorted((joint["kind"], k, {*joint["bodies"]}) for k, joint in enumerate(own.values()))
    kinds, sides = [kind for kind, *_ in told], [side for *_, side in told]
    first = {b for side in sides if side & known for b in side}
    if kinds == ["revolute"] * 6 and len(new) == 5:  # axes of three at one end may meet in a point
        pieper = any(side <= meet and side & first for side in sides)
        return (8, "Pieper 1968") if pieper else (16, "Primrose 1986, Lee and Liang 1988")
    inner = {bool(side & known) for side in sides[-2:]} == {True, False}
    if kinds in (["distance", k, "spherical", "spherical"] for k in ("prismatic", "revolute")):
        hub = new - sides[1]
        if len(hub) == 1 and hub <= sides[0] & sides[2] & sides[3] and inner:
            return 4, "circle and sphere, twice"
    if kinds == ["cylindrical", "universal", "universal"] and len(new) == 2 and inner:
        shaft = new & sides[0]
        if len(shaft) == 1 and shaft <= meet and not shaft <= sides[1] & sides[2]:
            return 8, "line and sphere, sine and cosine, twice"
    return 0, f"no theorem here tells how many poses {sorted(new)} have"


def most(m: Checked, group: list[str], known: set[str]) -> tuple[int, str]:
    """Return how many complex poses a group has at most, and by which theorem of the field."""
    own = {name: joint for name, joint in m.joints.items() if {*joint["bodies"]} & {*group}
           and {*joint["bodies"]} <= known | {*group}}
    kinds = sorted(joint["kind"] for joint in own.values())
    held = [name for name in m.drivers if name.split(".")[0] in {*own, *group}]
    free = ["".join(word[0] for word in joint["unknown"] if f"{name}.{word}" not in held)
            for name, joint in own.items()]
    left, new = {m.kinds[k] for k in m.left_out}, {*group} - known
    need(len(new) == len(group) > 0, "groups", f"no bodies, or one stands there twice: {group}")
    geared = any(owners & {*own} and all({*m.joints[j]["bodies"]} <= known for j in owners - {*own})
                 for owners in ({name.split(".")[0] for name in terms if name}
                                for terms in m.sums.values()))
    circles = sum(word in ("e", "a", "ea", "la") for word in free)  # spheres and cones are, too
    level = sum(word in ("a", "la") for word in free)
    for count, theorem, holds in (
        (1, "", kinds in (["revolute"], ["prismatic"], ["screw"]) and len(held) == 1),
        (1, "", kinds == ["prismatic", "screw"] and not held and left <= {"screw"}),
        (40, "Ronga and Vust 1995", kinds == ["distance"] * 6 and not held and not left & {*kinds}),
        (1, "", kinds == ["weld"] or (kinds == ["revolute"] and not held and geared)),
        (2, "a sphere and a circle or line",
         kinds in (["distance", "prismatic"], ["distance", "revolute"]) and not held),
        (2, "sine and cosine",
         kinds == ["revolute", "universal"] and not held and left <= {"universal"}),
        (1, "", {*kinds} == {"vector"} and len(own) == len(new) and not any(free)),
        (2**circles // (2 if level > 1 or (circles == 2 and "ea" in free) else 1), "Bezout",
         {*kinds} == {"vector"} and len(own) == len(new) + 1 and len("".join(free)) == 3)):
        if holds and ({*kinds} == {"vector"} or len(new) == 1):
            return count, theorem
    if held or left & {*kinds}:
        return 0, f"no theorem here tells how many poses {group} has"
    return together(m, own, new, known)


def alike(m: Checked, groups: list[Any], one: list[Any], other: list[Any]) -> bool:
    """Whether two poses in balls may be one, whole turns and signs of quaternions aside.

    Theorems count the poses of a group for one pose of those before it. Where wheels tell whole
    turns of these, or a screw its own, poses with other turns of them are not counted twice.
    """
    known, tell, seen = {"ground"}, {c for terms in m.sums.values() for c in terms}, set[int]()
    for group in groups:
        known |= {*group}
        own = [k for k, (owner, word) in enumerate(m.names) if k not in seen and {
            *([owner] if word in "xyz0123" else m.joints[owner]["bodies"])} <= known]
        seen |= {*own}
        screws = [k for k in own if m.joints.get(m.names[k][0], {}).get("kind") == "screw"]
        apart = [k for k in own if ".".join(m.names[k]) in tell or k in screws]
        for k in screws or own:
            word = m.names[k][1]
            off, (a, b) = (one[k] - other[k]) / 2, (one, other)
            if word == "0":  # products of two unit quaternions that are one or opposite are +-1
                off = dot(a[k : k + 4], b[k : k + 4]) ** 2 - 1
            whole = word in (*TURNS, "elevation", "azimuth")
            if word not in "123" and not (off.sin() if whole else off).contains(0):
                return False
        if not all((one[k] - other[k]).contains(0) for k in apart):
            return True
    return True


def senses(m: Checked, groups: list[Any], z: list[arb]) -> Any:
    """Yield the sign of each group's determinant at a pose in balls."""
    rows, seen, known = m.slopes(z)[1], {m.n}, {"ground"}
    for group in groups:
        known |= {*group}
        columns = [k for (owner, word), k in m.at.items() if k not in seen and {
            *([owner] if word in "xyz0123" else m.joints[owner]["bodies"])} <= known]
        seen |= {*columns}
        own, rows = [r for r in rows if r.keys() <= seen], [r for r in rows if not r.keys() <= seen]
        det = arb_mat([[row.get(k, ZERO) for k in columns] for row in own]).det()
        yield bool(det > 0) - bool(det < 0)


def modes(m: Checked, data: Any) -> str:
    """Check all poses at one value of the driver, and that there are no others."""
    u, groups = exact(part(data, "at", str, "modes"), "at"), part(data, "groups", list, "modes")
    found, real, told, count, known = list[Any](), list[Any](), dict[int, arb](), 1, {"ground"}
    theorems, seen = list[tuple[int, str]](), list[Any]()
    for group in groups:
        theorems.append(most(m, group, known))
        count, known = count * theorems[LAST][0], known | set(group)
    for k, own in enumerate(part(data, "complex", list, "certificate")):
        z = [acb(*exacts(pair, 2, f"complex/{k}")) for pair in own] + [acb(u)]
        pose = solution(m, z) if len(z) == m.n + 1 else None
        if not pose or any(alike(m, groups, pose.box(), other) for other in found) or not all(
                (a - b).abs_upper() < 1e-9 * (1 + m.size) for a, b in zip(z, pose.z)):
            raise FalseClaim(f"complex/{k}", "no pose, one that stands there twice, or 1e-9 off")
        need(all(v.real > 0 for v in m.equations(pose.box())[1]), f"complex/{k}",
             "an axis has the other sense, or an angle half a turn")
        found.append(pose.box())
        if all(x.imag == 0 for x in pose.z):  # so is its mirror image, in the same balls: one
            real.append(found[LAST])
        elif all(x.imag.contains(0) for x in found[LAST]):
            raise FalseClaim(f"complex/{k}", "neither real nor not")
    need(known == {*m.points}, "groups", "not the bodies of the mechanism")
    need(len(found) == count or not count, "complex", f"{len(found)} poses, and not all {count}")
    for k, mode in enumerate(part(data, "modes", list, "certificate")):
        z = agrees(m, solution(m, m.claimed(mode, u, f"modes/{k}")).box(), mode, f"modes/{k}")
        compare(m, z, mode, f"modes/{k}")
        left = [own for own in real if not alike(m, groups, own, [acb(x) for x in z])]
        need((len(left) == len(real) - 1 or not count)
             and not any(alike(m, groups, z, other) for other in seen),
             f"modes/{k}", "stands there twice, or is none of the poses found")
        real, seen = left, [*seen, z]
        labels = exacts(part(mode, "signs", list, f"modes/{k}"), len(groups), "signs")
        for g, (sign, label) in enumerate(zip(senses(m, groups, z), labels)):
            if not m.left_out and (
                    sign == 0 or label * sign != told.setdefault(g, label * sign)):
                raise FalseClaim(f"modes/{k}/signs/{g}", "does not fit those of the other modes")
    need(not real, "modes", f"{len(real)} poses are left out")
    why = [f"{own} by {theorem}" for own, theorem in theorems if theorem]
    if not count:
        why = [theorem for own, theorem in theorems if not own]
        return f"{len(seen)} modes exist; that there are no others is not claimed: {why[0]}"
    aside = any(j["kind"] == "screw" and f"{k}.angle" not in m.drivers for k, j in m.joints.items())
    wheels = ", whole turns that wheels would tell aside" * bool(why and m.sums)
    return f"{len(seen)} modes, and no others: of {count} complex poses, " \
           f"{' times '.join(why) or '1 by linear equations'}{', turns of screws aside' * aside}" \
           f"{wheels}"


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
