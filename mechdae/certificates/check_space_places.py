"""Checks a certificate of spatial assembly modes whose count follows from looking everywhere.

It shares nothing with the rest of the package but the file. The mechanism and the test of a pose
are the same text as in check_space.py, so that either file can be copied and run by itself. All
places and turns of a body on distances are looked at, box by box:
what is proved, and how, is said in docs/certificates.md.
"""
# ruff: noqa: B905
# fmt: off

from __future__ import annotations

import json
import re
import sys
from typing import Any

from flint import arb, arb_mat, arb_series, ctx, fmpq

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
PROOF, MOST, MET, NEAR, WIDER, ALONE, SHRUNK = "places", 200_000, 1e-9, 1e-6, 1.25, 0.9, 0.7
"""What the certificate says that its proof is; boxes that are looked at; equations are met to `MET`
of the size, and what meets them is `NEAR` a mode or excluded; how much wider than a box another one
is that a mode may lie in; bound of |1 - Y J| below which there is one solution in a box; a box that
shrinks by less is halved."""


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


def size_of(values: Any) -> Any:
    return sum((v * v for v in values), ZERO).sqrt().abs_upper()


def identity(n: int) -> arb_mat:
    return arb_mat([[ONE * (i == k) for k in range(n)] for i in range(n)])


class Boxes:
    """All places of `n` unknowns x of a group, looked at box by box; `weights` tell what to halve.

    `at` gives its equations F and their derivatives J in the middle of a box, `rests` how much each
    of combinations W F may differ from its tangent in the box: by terms of degree 2 to `order`.
    """

    group, n, order, weights, met = list[str](), 0, 2, list[float](), MET

    def look(self: Any, boxes: Any, modes: list[Any]) -> int:
        """Return in how many boxes there is nothing but the modes."""
        count = 0
        while boxes:
            (chart, middle, half), count = boxes.pop(), count + 1
            left = self.shrunk(chart, middle, half, modes)
            if left and min(a / b for a, b in zip(left[1], half)) > SHRUNK:
                middle, half = left
                k = max(range(self.n), key=lambda i: half[i] * self.weights[i])
                if count > MOST or half[k] < NEAR / 10:
                    raise FalseClaim("modes", f"{self.group} may be near {middle}: {count} boxes")
                own = [r * (1 - (i == k) * (0.5 - 1e-9)) for i, r in enumerate(half)]
                boxes += [(chart, [v + step * (i == k) for i, v in enumerate(middle)], own)
                          for step in (half[k] / 2, -half[k] / 2)]
            elif left:
                boxes.append((chart, *left))
        return count

    def shrunk(self: Any, chart: int, middle: list[float], half: list[float], modes: Any) -> Any:
        """Return a box of all that is left in a box, None where that is nothing or a mode."""
        n, h, (F, J) = self.n, [arb(v) for v in half], self.at(chart, middle)
        one, T = identity(len(F)), arb_mat([[v.mid() for v in row] for row in J])
        Y = (T * T.transpose() + identity(n) * arb(1e-9)).inv() * T
        W = arb_mat([[v.mid() for v in row] for own in (Y, one, one - T.transpose() * Y)
                     for row in own.tolist()])
        values, slopes = (W * arb_mat(len(F), 1, F)).entries(), W * arb_mat(J).transpose()
        alone, ends = True, list[tuple[float, float]]()
        for i, (w, value, slope, rest) in enumerate(zip(
                W.tolist(), values, slopes.tolist(), self.rests(W, middle, h))):
            off = sum(map(abs, w), ZERO) * self.met
            if abs(value) > dot(map(abs, slope), h) + rest + off:
                return None
            if i < n:
                slope[i] -= 1
                loss, moved = dot(map(abs, slope), h), rest * self.order * WIDER ** (self.order - 1)
                alone = alone and bool(loss + moved < h[i] * ALONE
                                       and off * max(half) < h[i] * (1 - ALONE) * NEAR / 2)
                reach = arb(0, (loss + rest + off).upper()) - value
                ends.append((max(-half[i], float(reach.lower()) - 1e-12),
                             min(half[i], float(reach.upper()) + 1e-12)))
        if (alone and any(self.inside(mode, chart, middle, half) for mode in modes)) or any(
                a > b for a, b in ends):
            return None
        return ([c + (a + b) / 2 for c, (a, b) in zip(middle, ends)],
                [(b - a) / 2 * (1 + 1e-9) + 1e-14 for a, b in ends])


class Legs(Boxes):
    """A body on distances from known points, by its quaternion q and the place T of its origin.

    One entry of q is 1, the others are at most 1: a chart for each of four. With N = |q|^2 and
    R~ = N R the equations are linear in (N T.T, N, N T, R~, R~' T).
    """

    n, order, weights, met = 6, 4, [2.0] * 3 + [1.0] * 3, 4 * MET

    def __init__(self, m: Checked, group: Any, own: list[Any], known: Any, z: Any) -> None:
        self.m, self.group, self.legs, frames, rows = m, group, list[Any](), m.placed(z), []
        for joint in own:
            if joint["kind"] != "distance" or len(group) > 1:
                raise FalseClaim("groups", f"more than distances of a body in {group}")
            one, other = joint["ends"][:: 1 if joint["bodies"][1] in group else -1]
            b = [v / m.size for v in m.place(one, frames)]
            p = [v / m.size for v in m.points[other[0]][other[1]]]
            square = joint["square"] / arb(m.size) ** 2
            self.legs.append((b, p, square.sqrt()))
            rows.append([ONE, dot(p, p) + dot(b, b) - square, *(v * -2 for v in b),
                         *(v * w * -2 for v in b for w in p), *(v * 2 for v in p)])
        self.C = arb_mat(rows)

    def first(self) -> list[Any]:
        far = min(float((length + size_of(b) + size_of(p)).upper()) for b, p, length in self.legs)
        return [(k, [0.0] * 6, [1.0] * 3 + [far * (1 + 1e-9)] * 3) for k in range(4)]

    def shrunk(self, chart: int, middle: list[float], half: list[float], modes: Any) -> Any:
        """Return what is left of a box, None also where a leg is too long or short all over it."""
        q, T = [*map(arb, middle[:chart]), ONE, *map(arb, middle[chart:3])], middle[3:]
        (r, t), N = (size_of(map(arb, own)) for own in (half[:3], half[3:])), size_of(q)
        R = rotation(*(v / dot(q, q).sqrt() for v in q))
        turned = (r * 2 / ONE.max(N - r)).min(arb(2))
        for b, p, length in self.legs:
            way = dot(d := [v + dot(row, p) - c for v, row, c in zip(T, R, b)], d).sqrt()
            if abs(way - length) > t + turned * size_of(p) + MET / length:
                return None
        return super().shrunk(chart, middle, half, modes)

    def at(self, chart: int, middle: list[float]) -> tuple[list[arb], list[list[arb]]]:
        x = [Dual(arb(v), {k: ONE}) for k, v in enumerate(middle)]
        q, T = [*x[:chart], ONE, *x[chart:3]], x[3:]
        N = dot(q, q)
        R = [[v + (N + -ONE) * (i == k) for k, v in enumerate(row)]
             for i, row in enumerate(rotation(*q))]
        terms = [N * dot(T, T), N, *(N * v for v in T), *(v for row in R for v in row),
                 *(dot(T, column) for column in zip(*R))]
        J = self.C * arb_mat([[term.d.get(k, ZERO) for k in range(6)] for term in terms])
        return (self.C * arb_mat(17, 1, [v.v for v in terms])).entries(), J.transpose().tolist()

    def rests(self, W: arb_mat, middle: list[float], h: list[arb]) -> list[arb]:
        T, r, t, found = middle[3:], size_of(h[:3]), size_of(h[3:]), list[arb]()
        U = size_of(map(arb, middle[:3]))
        Q = (U * U + 1).sqrt()
        for w in (W * self.C).tolist():
            s, b, p = abs(w[0]), w[2:5], [v / 2 for v in w[14:]]
            A = abs(w[0] * dot(T, map(arb, T)) + w[1] + dot(b, T))
            K = size_of(w[5 + k] + p[k % 3] * T[k // 3] * 2 for k in range(9))
            more, P = size_of(w[0] * 2 * v + c for v, c in zip(T, b)) * t + s * t * t, size_of(p)
            found.append((Q * Q * s * t * t + U * r * more * 2 + r * r * (A + more)
                          + t * r * P * (Q * 4 + r * 2) + r * r * K * 1.75).abs_upper())
        return found

    def mode(self, z: list[arb]) -> list[arb]:
        k = self.m.at[self.group[0], "x"]
        return [*z[k + 3 : k + 7], *(v / self.m.size for v in z[k : k + 3])]

    def inside(self, mode: Any, chart: int, middle: list[float], half: list[float]) -> bool:
        x = [v / mode[chart] for k, v in enumerate(mode[:4]) if k != chart] + mode[4:]
        return all(abs(v - c) < r * WIDER for v, c, r in zip(x, middle, half))


LOOKED = [Legs]


def proved(m: Checked, told: list[arb], at: str) -> list[arb]:
    """Return balls with one solution of the equations kept, near a place: Krawczyk's test."""
    def matrix(z: list[arb]) -> arb_mat:
        return arb_mat([[row.get(k, ZERO) for k in range(m.n)] for row in m.slopes(z)[1]])

    z, r = [v.mid() for v in told], [arb(1e-25) * scale for scale in m.scale[:LAST]]
    for _ in range(6):
        Y = matrix(z).inv()
        miss = (Y * arb_mat(m.n, 1, m.slopes(z)[0])).entries()
        z, last = [*((v - w).mid() for v, w in zip(z, miss)), told[LAST]], z
    box = [v + arb(0, own) for v, own in zip(last, r)] + told[LAST:]
    for i, loss in enumerate((Y * matrix(box)).tolist()):
        loss[i] -= 1
        if not (abs(miss[i]) + dot(map(abs, loss), r) < r[i]
                and abs(box[i] - told[i]) < 1e-12 * m.scale[i]):
            raise FalseClaim(at, "no pose is proved there, or more than 1e-12 off")
    return box


def parted(m: Checked, groups: list[Any], modes: list[Any], known: set[str]) -> int:
    """Return in how many boxes it is shown that groups have no other poses than those of modes."""
    group, sets, count = groups[0], list[list[Any]](), 0
    own = {k: j for k, j in m.joints.items() if {*j["bodies"]} & {*group}
           and {*j["bodies"]} <= known | {*group}}
    held = [name for name in m.drivers if name.split(".")[0] in own]
    flat = [[v for b in group for row in (m.placed(z)[b][0], *m.placed(z)[b][1]) for v in row]
            for z in modes]
    for mode, here in zip(modes, flat):
        like = [own for own in sets if all(abs(v - w) < MET for v, w in zip(here, own[0][1]))]
        sets += [] if like else [[]]
        (like or sets)[LAST].append((mode, here))
    if len(own) > 1 or not (held or [j["kind"] for j in own.values()] == ["weld"]):
        boxes = LOOKED[0](m, group, [*own.values()], known, modes[0])
        count = boxes.look(boxes.first(), [boxes.mode(other[0][0]) for other in sets])
    elif len(sets) > 1 or len(group) > 1:
        raise FalseClaim("groups", f"{group} have one pose")
    if not groups[1:] and len(sets) < len(modes):
        raise FalseClaim("modes", "one of them stands there twice")
    return count + sum(parted(m, groups[1:], [z for z, _ in other], known | {*group})
                       for other in sets if groups[1:])


def modes(m: Checked, data: Any) -> str:
    """Check all poses at one value of the driver, and that there are no others."""
    u, groups = exact(part(data, "at", str, "modes"), "at"), part(data, "groups", list, "modes")
    found = list[list[arb]]()
    for k, mode in enumerate(part(data, "modes", list, "certificate")):
        exacts(part(mode, "signs", list, f"modes/{k}"), len(groups), f"modes/{k}/signs")
        found.append(proved(m, m.claimed(mode, u, f"modes/{k}"), f"modes/{k}"))
        compare(m, found[LAST], mode, f"modes/{k}")
    if not found or sorted(sum(groups, ["ground"])) != sorted(m.points):
        raise FalseClaim("groups", "not the bodies of the mechanism, or no mode at all")
    count = parted(m, groups, found, {"ground"})
    return f"{len(found)} modes, and no others: nothing else in {count} boxes; " \
           f"superfluous equations to {m.off:.1g}"


def check(path: str) -> str:
    """Check a certificate and return what was proved; the first false claim raises `FalseClaim`."""
    ctx.prec, ctx.cap, data = PRECISION, 3, read(path)
    kind = part(data, "kind", str, "certificate")
    if data.get("certificate") != VERSION or (kind, data.get("proof")) != ("modes", PROOF):
        raise FalseClaim("certificate", f"not of version {VERSION}, or not a kind that is checked")
    try:
        return modes(Checked(data.get("mechanism")), data)
    except (TypeError, AttributeError, LookupError, ValueError, ArithmeticError) as why:
        raise FalseClaim("certificate", f"cannot be read or proved: {str(why)[:200]}") from None


if __name__ == "__main__":
    print(check(sys.argv[1]))
