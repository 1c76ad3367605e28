"""Equations of a spatial mechanism: place and unit quaternion of each body, turns of joints.

Every joint has its equations between two bodies: no tree of joints, no elimination.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, TypeAlias

from flint import arb, arb_series

from .arithmetic import ONE, ZERO, Dual, FalseClaim, Json, Value, exact, exacts, field, need
from .formulas import at_corners, number_of
from .mechanism import ClaimedMechanism

AXIAL = "ng mg nA mA"
PRODUCTS = {
    "revolute": "ng mg ag nA mA",
    "cylindrical": AXIAL,
    "prismatic": f"{AXIAL} nM",
    "screw": f"{AXIAL} ag",
    "universal": "ng mg ag aN",
    "spherical": "xg yg zg",
    "planar": "ag nA mA",
    "weld": "ng mg ag nA mA nM",
    "distance": "gg",
    "vector": "xg yg zg",
}
"""Products that vanish, of the gap g of a joint's points, the fixed axes x y z, normal, axis x
normal and axis of its first side, n m a, and of its second, N M A; gg is a square that is given."""
VECTOR = ("length", "elevation", "azimuth")
SIDES = (("axis", "zero"), ("axis2", "zero2"))
SENSES = (("aA", "nA"), ("nN", "nM"))
"""What is positive where a product vanishes."""
SLIDES = {"slide": "ag", "x": "ng", "y": "mg"}
TURNS = {"angle": "nmN", "angle2": "AMa"}
"""Coordinates of joints: products; of turns from where in which sense to where they count."""
FREE = ("spherical", "distance")
"""Joints that hold a point of a body alone."""
PLACE, QUATERNION = "xyz", "0123"
MOST_UNKNOWNS = 450
Frames: TypeAlias = dict[str, tuple[Sequence[Value], list[list[Value]]]]
"""Place and rotation of each body."""
UNTURNED = [[ONE if i == k else ZERO for k in range(3)] for i in range(3)]


def dot(one: Iterable[Value], other: Iterable[Value]) -> Any:
    """Return the product of two directions; what is exactly zero takes no time."""
    pairs = zip(one, other, strict=False)
    return sum((a * b for a, b in pairs if not (_vanishes(a) or _vanishes(b))), ZERO)


def _vanishes(v: Value) -> bool:
    return type(v) is arb and bool(v == 0)


def cross(a: Sequence[Value], b: Sequence[Value]) -> list[Value]:
    return [a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)]


def difference(one: Sequence[Value], other: Sequence[Value]) -> list[Value]:
    return [a - b for a, b in zip(one, other, strict=True)]


def rotation(w: Value, x: Value, y: Value, z: Value) -> list[list[Any]]:
    """Return the rotation by a unit quaternion, its real part first."""
    xx, yy, zz, xy, xz, yz, wx, wy, wz = (
        x * x,
        y * y,
        z * z,
        x * y,
        x * z,
        y * z,
        w * x,
        w * y,
        w * z,
    )
    return [
        [(yy + zz) * -2 + ONE, (xy - wz) * 2, (xz + wy) * 2],
        [(xy + wz) * 2, (xx + zz) * -2 + ONE, (yz - wx) * 2],
        [(xz - wy) * 2, (yz + wx) * 2, (xx + yy) * -2 + ONE],
    ]


def normal_cross_axis(axis: list[arb], zero: list[arb]) -> list[list[arb]]:
    """Return normal, axis x normal, axis of a side."""
    a = [v / dot(axis, axis).sqrt() for v in axis]
    n = [v - w * dot(a, zero) for v, w in zip(zero, a, strict=True)]
    n = [v / dot(n, n).sqrt() for v in n]
    return [n, cross(a, n), a]


class SpatialMechanism(ClaimedMechanism):
    """Coordinates are places and quaternions of bodies, turns and parts of vectors of joints.

    `left_out` are numbers of redundant equations of joints, in the order of `kinds`.
    """

    dimension = 3
    turns = "orientations"
    wrong_sense = "an axis has the other sense, or an angle half a turn"

    def __init__(self, data: Json, at: str = "mechanism", square: bool = True) -> None:
        super().__init__(data, at)
        numbers = [j[key] for j in self.joints.values() for key in ("length", "pitch") if key in j]
        self.size: float = self._largest(*numbers)
        names = [(body, word) for body in self.points for word in self._words(body)]
        names += [(name, word) for name, j in self.joints.items() for word in j["unknown"]]
        self._number_names(names, "x y z length")
        self.sums: dict[str, dict[str, arb]] = {
            name: {term: exact(v, f"{at}/sums/{name}") for term, v in terms.items()}
            for name, terms in data.get("sums", {}).items()
        }
        self.spins: list[tuple[str, str, list[arb]]] = [
            self._spin(spin, f"{at}/spins") for spin in data.get("spins", [])
        ]
        every = [body for spin, *_ in self.spins for body in self._spun(spin)]
        need(len(every) == len(set(every)), f"{at}/spins", "a body spins twice")
        lengths = (".slide", ".length", ".x", ".y", ".z")
        self.unit: float = self.size if next(iter(self.drivers), "").endswith(lengths) else 1.0
        self.kinds: list[str] = ["norm" for _, word in names if word == "0"]
        for joint in self.joints.values():
            turns = [word for word in TURNS if word in joint["unknown"]]
            self.kinds += [joint["kind"]] * len([*PRODUCTS[joint["kind"]].split(), *turns])
        numbers = data.get("superfluous", [])
        self.left_out: set[int] = {int(k) for k in numbers}
        known = all(0 <= k < len(self.kinds) and self.kinds[k] != "norm" for k in self.left_out)
        why = "not the number of an equation of a joint, or one stands twice"
        need(len(numbers) == len(self.left_out) and known, f"{at}/superfluous", why)
        count = len(self.equations([ZERO] * (self.n + 1))[0]) - len(self.left_out)
        why = f"{count} equations for {self.n} unknowns, of at most {MOST_UNKNOWNS}"
        need(self.n <= MOST_UNKNOWNS and (count == self.n or not square), at, why)

    def _words(self, body: str) -> str:
        """Return the coordinates of a body: at ends of vectors are points, which do not turn."""
        kinds = {joint["kind"] for joint in self.joints.values() if body in joint["bodies"]}
        if not kinds or body == "ground":
            return ""
        point = len(self.points[body]) == 1 and kinds <= {"vector", "spherical", "distance"}
        return PLACE if point and "vector" in kinds else PLACE + QUATERNION

    def _joint(self, joint: Json, at: str) -> Json:
        made = self._ends(joint, PRODUCTS, at)
        kind = made["kind"]
        keys = {"screw": ["pitch"], "distance": ["square"]}.get(kind)
        keys = [key for key in VECTOR if key in joint] if keys is None else keys
        made |= {key: exact(joint.get(key), f"{at}/{key}") for key in keys}
        sided = "A" in PRODUCTS[kind] or kind == "universal"
        made["sides"] = [
            normal_cross_axis(*(exacts(joint.get(key), 3, f"{at}/{key}") for key in pair))
            for pair in SIDES * sided
        ]
        if kind == "universal":  # the pin of the second side is its normal
            n, m, a = made["sides"][1]
            made["sides"][1] = [a, [-v for v in m], n]
        allowed = [w for w in VECTOR if w not in joint] if kind == "vector" else [*TURNS] * sided
        unknown = joint.get("unknown", allowed)
        made["unknown"] = [word for word in allowed if word in unknown]
        need(len(made["unknown"]) == len(unknown), at, "unknown twice")
        return made

    def _spun(self, body: str) -> list[str]:
        """Return the bodies that move with one but for balls and bars."""
        found = [body]
        for one in found:
            for joint in self.joints.values():
                rigid = joint["kind"] not in FREE and one in joint["bodies"]
                found += [other for other in joint["bodies"] if rigid and other not in found]
        return found

    def _spin(self, claim: Json, at: str) -> tuple[str, str, list[arb]]:
        """Return what chooses a spin: bodies that two points alone hold turn about their line."""
        body, on = (field(claim, key, str, at) for key in ("body", "on"))
        need(
            (body, "0") in self.at and (on == "ground" or (on, "0") in self.at), at, "no such body"
        )
        spun = self._spun(body)
        ends = [end for j in self.joints.values() if j["kind"] in FREE for end in j["ends"]]
        driven = [tuple(name.split(".")[:2]) for name in self.drivers if name.count(".") == 2]
        held = {end for end in [*ends, *driven] if end[0] in spun}
        free = not {"ground", on} & {*spun} and len(held) <= 2
        fixed = [
            j for j in self.joints.values() if j["kind"] == "vector" and {*j["bodies"]} & {*spun}
        ]
        need(free and not fixed, at, f"{body[:40]} does not spin: more than two points hold it")
        return body, on, exacts(claim.get("across"), 3, at)

    def rows(self, z: Sequence[Value]) -> list[Value]:
        return [row for k, row in enumerate(self.equations(z)[0]) if k not in self.left_out]

    def oriented(self, z: Sequence[Value]) -> bool:
        return all(v.real > 0 for v in self.equations(z)[1])

    def equations(self, z: Sequence[Value]) -> tuple[list[Any], list[Any]]:
        """Return all rows, also those left out, and what is positive at a pose."""
        frames, positive = self.placed(z), list[Any]()
        quaternions = [z[k : k + 4] for k, (_, word) in enumerate(self.names) if word == "0"]
        rows = [dot(q, q) - ONE for q in quaternions]
        for name, joint in self.joints.items():
            of_joint, senses = self._joint_rows(name, joint, frames, z)
            rows += of_joint
            positive += senses
        for terms in self.sums.values():
            parts = (self.coordinate(c, z, frames) * v for c, v in terms.items() if c)
            rows.append(sum(parts, terms.get("", ZERO)))
        for body, on, across in self.spins:
            (p, *v), (q, *w) = (
                z[self.at[end, "0"] :][:4] if end != "ground" else [ONE, ZERO, ZERO, ZERO]
                for end in (on, body)
            )
            turned = [p * b - q * a - c for a, b, c in zip(v, w, cross(v, w), strict=True)]
            rows.append(dot(turned, across))
        return rows + self.driven(z, frames), positive

    def _joint_rows(
        self, name: str, joint: Json, frames: Frames, z: Any
    ) -> tuple[list[Value], list[Value]]:
        """Return the rows of a joint, and what is positive."""
        unknown = {word: z[self.at[name, word]] for word in joint["unknown"]}
        d, rows, positive = self.directions(joint, frames), list[Value](), list[Value]()
        if joint["kind"] == "vector":
            length, elevation, azimuth = (unknown[w] if w in unknown else joint[w] for w in VECTOR)
            level, up = length * elevation.cos(), length * elevation.sin()
            d["g"] = difference(d["g"], (level * azimuth.cos(), up, level * azimuth.sin()))
            # of vectors told in two ways one
            positive += [elevation.cos()] if {"elevation", "azimuth"} <= {*unknown} else []
            positive += [length] if {"length", "elevation"} <= {*unknown} else []
        products = PRODUCTS[joint["kind"]].split()
        for pair in products:
            row = dot(*(d[letter] for letter in pair))
            if pair == "ag" and "pitch" in joint:
                row -= unknown["angle"] * (joint["pitch"] / arb.pi() / 2)
            rows.append(row - joint["square"] if pair == "gg" else row)
        positive += [dot(d[p[0]], d[p[1]]) for p, product in SENSES if product in products]
        for word in [word for word in TURNS if word in unknown]:
            turn, (x, y, w) = unknown[word], (d[letter] for letter in TURNS[word])
            x, y, c, s = dot(x, w), dot(y, w), turn.cos(), turn.sin()
            rows.append(s * x - c * y)
            positive.append(c * x + s * y)
        return rows, positive

    def placed(self, z: Sequence[Value]) -> Frames:
        """Return places and rotations of all bodies."""
        frames: Frames = {"ground": ([ZERO] * 3, UNTURNED)}
        for k, (body, word) in enumerate(self.names):
            if word == "x":
                turned = (body, "0") in self.at
                frames[body] = z[k : k + 3], rotation(*z[k + 3 : k + 7]) if turned else UNTURNED
        return frames

    def place(self, end: Sequence[str], frames: Frames) -> list[Any]:
        (body, point), (r, R) = end, frames[end[0]]
        return [x + dot(row, self.points[body][point]) for x, row in zip(r, R, strict=True)]

    def directions(self, joint: Json, frames: Frames) -> dict[str, list[Value]]:
        """Return those that rows are made of, by their letters."""
        one, other = (self.place(end, frames) for end in joint["ends"])
        found = {"g": difference(other, one)} | dict(zip(PLACE, UNTURNED, strict=True))
        for body, side, letters in zip(
            joint["bodies"], joint["sides"], ("nma", "NMA"), strict=False
        ):
            for letter, v in zip(letters, side, strict=True):
                found[letter] = [dot(row, v) for row in frames[body][1]]
        return found

    def coordinate(self, name: str, z: Sequence[Value], frames: Frames) -> Value:
        """Return BODY.POINT.x, .y, .z or a coordinate of a joint."""
        owner, *words = name.split(".")
        if len(words) == 2 and words[0] in self.points.get(owner, {}) and words[1] in [*PLACE]:
            return self.place((owner, words[0]), frames)[PLACE.index(words[1])]
        if owner in self.joints and len(words) == 1:
            if (owner, words[0]) in self.at:
                return z[self.at[owner, words[0]]]
            if words[0] in SLIDES and self.joints[owner]["sides"]:
                d = self.directions(self.joints[owner], frames)
                return dot(*(d[letter] for letter in SLIDES[words[0]]))
        raise FalseClaim("mechanism/drivers", f"no such coordinate: {name[:60]}")

    def law(self, formula: object, s: Value, place: str) -> Value:
        """Return a driver's value: "s", a number, or those at s = 0, 1, ..., straight between."""
        if not isinstance(formula, list):
            return s if isinstance(formula, str) and formula == "s" else number_of(formula, place)
        at = s.v if isinstance(s, Dual) else s
        return at_corners(formula, s, at[0] if isinstance(at, arb_series) else at, place)

    def straight(self, start: arb, end: arb) -> list[arb]:
        return [start, end]

    def compare(self, z: list[arb], claim: Json, at: str) -> None:
        """Compare what is reported; redundant equations are nearly met."""
        super().compare(z, claim, at)
        rows = self.equations(z)[0] if self.left_out else []
        for k in self.left_out:
            near = abs(rows[k]) <= 1e-9 * (1 + self.size)
            need(near, at, f"the redundant equation {k} is off")
            self.off: float = max(self.off, 1.05 * float(rows[k].abs_upper()))

    def turned(self, body: str, reported: object, angle: arb, z: list[arb], at: str) -> bool:
        q, k = exacts(reported, 4, at), self.at[body, "0"]
        w, *axis = z[k : k + 4]
        turn = zip(q[1:], axis, cross(q[1:], axis), strict=True)
        miss = [q[0] * b - w * a - c for a, b, c in turn]
        near = dot(miss, miss) <= dot(q, q) * (angle / 2).sin() ** 2
        return bool(abs(dot(q, q) - 1) < 1e-12 and 0 <= angle <= 1 and near)

    def is_of_body(self, word: str) -> bool:
        return word in PLACE + QUATERNION
