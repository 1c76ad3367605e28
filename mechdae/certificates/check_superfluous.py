"""Checks a certificate of a planar sweep or modes with superfluous equations.

It shares nothing with the rest of the package but the file. More equations than coordinates have
solutions only where numbers fit each other exactly, so the motion is written down in closed form
and put into all equations in exact numbers. What is common with check.py is the same text, so that
either file can be copied and run by itself. What is proved, and by which theorem, is said in
docs/certificates.md.
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
EXACT, MOST_WAVES, MOST_TURNS = 4096, 60, 1000
"""Bits with which sums and products of exact numbers stay exact; what a motion may have."""
NUMBERS: dict[str, list[str]] = {
    "revolute": [], "weld": ["turn"], "prismatic": ["axis", "turn"], "slot": ["axis"],
    "distance": ["length"], "gear": ["ratio", "phase"], "rack": ["radius", "axis", "phase"]}
ROWS = {"revolute": 2, "weld": 3, "prismatic": 2}
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


class Wave:
    """An exact sum of c exp(i k s) over integers k, by k; angles are sums of s and right angles."""

    def __init__(self, own: dict[Any, Any]) -> None:
        self.own = {k: v for k, v in own.items() if not acb(v).is_zero()}

    def __add__(self, other: Any) -> Wave:
        more = other.own if isinstance(other, Wave) else {0: acb(other)}
        return Wave({k: self.own.get(k, 0) + more.get(k, 0) for k in {*self.own, *more}})

    def __mul__(self, other: Any) -> Wave:
        if not isinstance(other, Wave):
            return Wave({k: v * other for k, v in self.own.items()})
        parts = [Wave({k + j: v * w}) for k, v in self.own.items() for j, w in other.own.items()]
        return sum(parts, Wave({}))

    def cos(self) -> Wave:
        k, turn = (acb(self.own.get(key, 0)).real for key in ("s", "right"))
        if not (abs(k) <= MOST_TURNS and k.is_integer() and turn.is_integer()):
            raise ArithmeticError("no exact cosine of such an angle")
        k, unit = int(float(k)), [acb(1), acb(0, 1), acb(-1), acb(0, -1)][int(float(turn)) % 4]
        return Wave({k: unit / 2}) + Wave({-k: unit.conjugate() / 2})

    def sin(self) -> Wave:
        return (self + Wave({"right": -1})).cos()

    def at(self, s: Any) -> arb:
        """Return its real value, in a ball."""
        told = {"s": s, "right": arb.pi() / 2}
        return sum((v.real * told[k] if k in told else (v * acb(0, s * k).exp()).real
                    for k, v in ((k, acb(v)) for k, v in self.own.items())), ZERO)

    __radd__, __rmul__ = __add__, __mul__


class Wide(Checked):
    """A mechanism with more equations than coordinates, and its motion in closed form."""

    def __init__(self, data: Any, at: str = "mechanism") -> None:
        told = [exact(k, f"{at}/superfluous") for k in part(data, "superfluous", list, at)]
        self.left = {int(float(k)) for k in told if k.is_integer()}
        super().__init__(data, at)
        self.rest, row = dict(self.joints), 0
        for name, joint in self.joints.items():
            count = ROWS.get(joint["kind"], 1)
            left = len(self.left & {*range(row, row + count)})
            if left and joint["kind"] != "revolute":
                raise FalseClaim(f"{at}/superfluous", "not the number of an equation of a pin")
            if left == 1:  # what is left of a pin is a line that a point is on
                self.rest[name] = joint | {"kind": "slot"}
            elif left:
                del self.rest[name]
            row += count
        if not len(told) == len(self.left) == len({*range(row)} & self.left):
            raise FalseClaim(f"{at}/superfluous", "one stands twice, or is of no joint")
        self.motion = self._motion(part(data, "motion", dict, at), f"{at}/motion")

    def _motion(self, data: Any, at: str) -> list[Wave]:
        """Return the motion s -> pose that is written down; it has to meet all equations."""
        z = list[Wave]()
        for body in self.bodies:
            *places, angle = part(data, body, list, at)
            need(len(places) == 2, f"{at}/{body}", "not x, y and an angle")
            for waves in places:
                rows = [exacts(row, 3, f"{at}/{body}") for row in waves]
                orders = {float(k) for k, *_ in rows if k.is_integer()}
                need(len(orders) == len(rows) <= MOST_WAVES, f"{at}/{body}",
                     f"more than {MOST_WAVES} waves, one that stands twice, or part of one")
                sums = [Wave({k: acb(a, -b) / 2}) + Wave({-k: acb(a, b) / 2}) for k, a, b in (
                    (int(float(k)), a, b) for k, a, b in rows)]
                z.append(sum(sums, Wave({})))
            z.append(Wave(dict(zip(("s", "right"), exacts(angle, 2, f"{at}/{body}")))))
        ctx.prec = EXACT
        try:
            for k, row in enumerate(self.every([*z, Wave({"s": 1})])):
                if row.own:
                    raise FalseClaim(at, f"equation {k} does not hold along the motion")
        finally:
            ctx.prec = PRECISION
        return z

    def every(self, z: Any) -> list[Any]:
        """Return all equations."""
        return super().rows(z)

    def rows(self, z: Any) -> list[Any]:
        """Return the equations that are kept, as many as there are coordinates."""
        return [row for k, row in enumerate(self.every(z)) if k not in self.left]

    def pose(self, s: arb) -> list[arb]:
        """Return the pose of the motion in balls."""
        return [*(x.at(s) for x in self.motion), s]

    def alone(self, s: arb) -> bool:
        """Whether the Jacobian of all equations has full rank for all s in a ball."""
        def slopes(s: arb) -> arb_mat:
            rows = self.every([Dual(x, {k: ONE}) for k, x in enumerate(self.pose(s))])
            return arb_mat([[row.d.get(k, ZERO) for k in range(self.n)] for row in rows])
        J = slopes(s.mid())
        Y = (J.transpose() * J).inv() * J.transpose()
        A = (arb_mat([[x.mid() for x in row] for row in Y.tolist()]) * slopes(s)).tolist()
        return all(sum((abs(v - int(i == k)).upper() for k, v in enumerate(row)), ZERO) < 1
                   for i, row in enumerate(A))


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


def full(m: Wide, s: arb, to: arb, at: str) -> int:
    """Return the number of parts of a way on each of which the Jacobian has full rank."""
    step, least, count = to - s, abs(to - s) * arb(2) ** -HALVINGS, 0
    while s < to:
        end = to if step >= to - s else (s + step).mid()
        try:
            proved = m.alone(((s + end) / 2).mid() + slack((end - s) * 0.5000001, ZERO))
        except ZeroDivisionError:
            proved = False
        if proved:
            s, step, count = end, step * 1.5, count + 1
        elif step < least:
            raise FalseClaim(at, f"the rank falls at {s.str(12)}")
        else:
            step = step / 2
    return count


def numbered(poses: Any, start: arb, end: arb) -> str:
    """Return what is claimed of a path: its poses' numbers grow, so that none stands twice."""
    own = [part(pose, "pose", int, f"poses/{k}") for k, pose in enumerate(poses)]
    need(own == sorted({*own}), "poses", "one stands there twice, or they are out of order")
    ends = (at.str(9, radius=False) for at in (start, end))
    return f"from {' to '.join(ends)}, {len(own)} poses, of others nothing is claimed"


def sweep(m: Wide, data: Any) -> str:
    """Check the ranks along a motion and the poses on it."""
    path = part(data, "path", dict, "certificate")
    first = s = exact(path.get("at"), "path/at")
    parts, crossed, width = 0, 0, ZERO
    for k, step in enumerate(part(path, "steps", list, "path")):
        at, to = f"path/steps/{k}", exact(step.get("to"), f"path/steps/{k}/to")
        need(exact(part(step, "from", str, at), at) == s < to, at, "begins where none ends")
        if step.get("change_point") is True:
            crossed, width = crossed + 1, max(width, to - s)
        else:
            parts += full(m, s, to, at)
        s = to
    parts += not path["steps"] and m.alone(s)
    need(parts or crossed, "path/at", "the rank falls there")
    need(exact(path.get("to"), "path/to") == s, "path/to", "is not where the last step ends")
    need(width < 1e-4, "path/steps", f"{width.str(3)} is no distance next to a change point")
    for k, pose in enumerate(part(data, "poses", list, "certificate")):
        place = exact(part(pose, "at", str, f"poses/{k}"), f"poses/{k}/at")
        need(pose.get("status") == "ok" and first <= place <= s, f"poses/{k}",
             "its status is not what the path says of it")
        told(m, m.pose(place), pose, f"poses/{k}")
    return f"{parts} parts of full rank, {crossed} change points, {len(m.left)} superfluous " \
           f"equations that hold identically, {numbered(data['poses'], first, s)}"


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


def wheels(m: Checked) -> list[set[str]]:
    """Return the bodies of each joint whose equations tell whole turns apart."""
    return [{joint["carrier"], *(body for body, _ in joint["ends"])} - {"ground"}
            for joint in m.joints.values() if joint["kind"] in ("gear", "rack")]


def alike(m: Checked, groups: list[Any], one: list[Any], other: list[Any]) -> bool:
    """Whether two poses in balls may be one, whole turns aside.

    Theorems count the poses of a group for one pose of those before it. Where wheels or racks tell
    whole turns of these, poses with other turns of them are not counted twice: they are one.
    """
    wheeled = set[str]().union(*wheels(m))
    for group in groups:
        off = [[(one[3 * k + i] - other[3 * k + i]) / 2 for i in range(3)]
               for k in map(m.bodies.index, group)]
        if not all(v.contains(0) for x, y, turn in off for v in (x, y, turn.sin())):
            return False
        if any(b in wheeled and not own[2].contains(0) for b, own in zip(group, off)):
            return True
    return True


def modes(m: Wide, data: Any) -> str:
    """Check all poses at one value of the driver, and that there are no others."""
    u, groups = exact(part(data, "at", str, "modes"), "at"), part(data, "groups", list, "modes")
    found, count, known, every = list[Any](), 1, {"ground"}, m.joints
    theorems, m.joints = list[tuple[int, str]](), m.rest
    for group in groups:
        theorems.append(most(m, group, known))
        count, known = count * theorems[LAST][0], known | set(group)
    m.joints, fit = every, list[Any]()
    for k, own in enumerate(part(data, "complex", list, "certificate")):
        z = [acb(*exacts(pair, 2, f"complex/{k}")) for pair in own] + [acb(u)]
        box = solution(m, z).box() if len(z) == m.n + 1 else []
        need(box and not any(alike(m, groups, box, other) for other in found) and all(
            (a - b).abs_upper() < 1e-9 * (1 + m.size) for a, b in zip(z, box)),
            f"complex/{k}", "no pose, one that stands there twice, or 1e-9 off")
        found.append(box)
        fit += [found[LAST]] if all(row.contains(0) for row in m.every(box)) else []
    why = [f"{own} by {theorem}" if own else theorem for own, theorem in theorems if theorem]
    need(count == len(found) and known == {"ground", *m.bodies}, "complex",
         f"{len(found)} poses, and not all {count}: {' times '.join(why)}")
    need(len(part(data, "modes", list, "modes")) == 1 == len(fit)
         and alike(m, groups, z := m.pose(u), fit[0]), "modes",
         f"{len(fit)} poses may meet all equations, one does for sure")
    told(m, z, data["modes"][0], "modes/0")
    return f"1 mode, and no others: {count - 1} of {count} complex poses, {' times '.join(why)}, " \
           f"miss {len(m.left)} superfluous equations"


def check(path: str) -> str:
    """Check a certificate and return what was proved; the first false claim raises `FalseClaim`."""
    ctx.prec, ctx.cap, data = PRECISION, 3, read(path)
    kind = part(data, "kind", str, "certificate")
    if data.get("certificate") != VERSION or kind not in ("sweep", "modes"):
        raise FalseClaim("certificate", f"not of version {VERSION}, or not a kind that is checked")
    try:
        return (sweep if kind == "sweep" else modes)(Wide(data.get("mechanism")), data)
    except (TypeError, AttributeError, LookupError, ValueError, ArithmeticError, RuntimeError) as e:
        raise FalseClaim("certificate", f"cannot be read or proved: {str(e)[:200]}") from None


if __name__ == "__main__":
    print(check(sys.argv[1]))
