"""Equations of a planar mechanism: x, y and angle of each body, places on curves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

from flint import arb

from .arithmetic import ZERO, FalseClaim, Json, Value, exact, need
from .formulas import evaluate, parsed, slope
from .mechanism import ClaimedMechanism

PLANAR_NUMBERS: dict[str, list[str]] = {
    "revolute": [],
    "weld": ["turn"],
    "prismatic": ["axis", "turn"],
    "slot": ["axis"],
    "curve": [],
    "distance": ["length"],
    "gear": ["ratio", "phase"],
    "rack": ["radius", "axis", "phase"],
}
"""Kinds of joints and their numbers."""
MOST_BODIES = 150


class PlanarFrame:
    """Origin and unwrapped angle of a body, cosine and sine of the angle."""

    def __init__(self, x: Value, y: Value, angle: Value) -> None:
        self.x: Value = x
        self.y: Value = y
        self.angle: Value = angle
        self.cos: Value = angle.cos()
        self.sin: Value = angle.sin()

    def rotated(self, a: Value, b: Value) -> tuple[Value, Value]:
        return self.cos * a - self.sin * b, self.sin * a + self.cos * b

    def along(self, axis: arb, x: Value, y: Value) -> Value:
        """Return the component of (x, y) along an axis of the body."""
        a, b = self.rotated(axis.cos(), axis.sin())
        return a * x + b * y

    def point(self, place: list[arb]) -> list[Any]:
        x, y = self.rotated(*place)
        return [x + self.x, y + self.y]


class PlanarMechanism(ClaimedMechanism):
    """Coordinates are x, y, angle of each body; of each curve s, and a roller's tangent."""

    dimension = 2
    turns = "angles"
    wrong_sense = "a roller's tangent points against its curve"
    words: ClassVar = ("x", "y", "angle")

    def __init__(self, data: Json, at: str = "mechanism", square: bool = True) -> None:
        super().__init__(data, at)
        self.bodies: list[str] = [body for body in self.points if body != "ground"]
        self.size: float = self._largest()
        self.unit: float = 1.0 if ".angle" in str(self.drivers) else self.size
        curves = [name for name, joint in self.joints.items() if joint["kind"] == "curve"]
        contacts = [
            (name, word)
            for name in curves
            for word in ("s", "turn")[: 2 if "roller" in self.joints[name] else 1]
        ]
        names = [(body, word) for body in self.bodies for word in self.words]
        self._number_names(names + contacts, "x y")
        self.counted: dict[str, Json] = self.joints
        """Joints by which poses are counted."""
        need(len(self.bodies) <= MOST_BODIES, at, f"over {MOST_BODIES} bodies")
        if square:
            self.need_square(at)

    def need_square(self, at: str) -> None:
        """Refuse a mechanism with another number of equations than coordinates."""
        count = len(self.rows([ZERO] * (self.n + 1)))
        need(count == self.n, at, f"{count} equations do not fit {self.n} coordinates")

    def _joint(self, joint: Json, at: str) -> Json:
        made = self._ends(joint, PLANAR_NUMBERS, at) | {"carrier": joint.get("carrier", "ground")}
        need(made["carrier"] in self.points, at, "no such carrier")
        keys = [*PLANAR_NUMBERS[made["kind"]], *({"roller"} & {*joint})]
        made |= {key: exact(joint.get(key), f"{at}/{key}") for key in keys}
        if made["kind"] == "curve":
            place = [parsed(joint.get(key), f"{at}/{key}") for key in ("x", "y")]
            made["curve"] = place
            made["slopes"] = [*map(slope, place)] if "roller" in joint else [ZERO, ZERO]
        return made

    def rows(self, z: Sequence[Value]) -> list[Value]:
        frames, rows = self.placed(z), list[Value]()
        for name, joint in self.joints.items():
            rows += self._joint_rows(name, joint, frames, z)
        return rows + self.driven(z, frames)

    def _joint_rows(self, name: str, joint: Json, frames: Any, z: Sequence[Value]) -> list[Value]:
        one, two, dx, dy = self.gap(joint, frames)
        kind, carrier = joint["kind"], frames[joint["carrier"]].angle
        first, second = one.angle - carrier, two.angle - carrier
        rows: list[Value]
        if kind in ("revolute", "weld"):
            rows = [dx, dy]
        elif kind in ("prismatic", "slot"):
            rows = [one.along(joint["axis"], dy, -dx)]
        elif kind == "curve":
            (x, y), (vx, vy), tangent = self.contact(name, z)
            x, y = one.rotated(x, y)
            rows = [dx - x, dy - y]
            rows += [vx * tangent.sin() - vy * tangent.cos()] if "roller" in joint else []
        elif kind == "distance":
            rows = [dx * dx + dy * dy - joint["length"] * joint["length"]]
        elif kind == "gear":
            rows = [second * joint["ratio"] + joint["phase"] - first]
        else:  # a rack
            rolled = first * joint["radius"] + joint["phase"]
            rows = [two.along(joint["axis"], dx, dy) - rolled]
        return [*rows, second - first - joint["turn"]] if "turn" in joint else rows

    def contact(self, name: str, z: Sequence[Value]) -> tuple[Any, Any, Any]:
        """Return the place of a contact (x, y), derivatives of the curve, angle of its tangent."""
        s, joint = z[self.at[name, "s"]], self.joints[name]
        x, y = (evaluate(f, s, name[:90]) for f in joint["curve"])
        slopes = [evaluate(f, s, name[:90]) for f in joint["slopes"]]
        if "roller" not in joint:
            return (x, y), slopes, ZERO
        tangent, r = z[self.at[name, "turn"]], joint["roller"]
        return (x + tangent.sin() * r, y - tangent.cos() * r), slopes, tangent

    def oriented(self, z: Sequence[Value]) -> bool:
        """Whether the tangents of all rollers point along their curves, not against them."""
        contacts = [self.contact(name, z) for name, word in self.names if word == "turn"]
        return all(vx * a.cos() + vy * a.sin() > 0 for _, (vx, vy), a in contacts)

    def placed(self, z: Sequence[Value]) -> dict[str, PlanarFrame]:
        return {"ground": PlanarFrame(ZERO, ZERO, ZERO)} | {
            body: PlanarFrame(*z[3 * k : 3 * k + 3]) for k, body in enumerate(self.bodies)
        }

    def place(self, end: Sequence[str], frames: dict[str, PlanarFrame]) -> list[Any]:
        body, point = end
        return frames[body].point(self.points[body][point])

    def gap(self, joint: Json, frames: Any) -> tuple[PlanarFrame, PlanarFrame, Value, Value]:
        """Return the frames of a joint's bodies, and second point less first point."""
        (x1, y1), (x2, y2) = (self.place(end, frames) for end in joint["ends"])
        one, two = (frames[body] for body in joint["bodies"])
        return one, two, x2 - x1, y2 - y1

    def coordinate(self, name: str, z: Sequence[Value], frames: dict[str, PlanarFrame]) -> Value:
        """Return BODY.angle, BODY.POINT.x or .y, JOINT.angle or JOINT.slide."""
        owner, *words = name.split(".")
        if owner in self.bodies and words == ["angle"]:
            return frames[owner].angle
        if owner in self.bodies and words[1:] in (["x"], ["y"]) and words[0] in self.points[owner]:
            return self.place((owner, words[0]), frames)[words[1] == "y"]
        if joint := self.joints.get(owner):
            one, two, dx, dy = self.gap(joint, frames)
            if words == ["angle"]:
                return two.angle - one.angle
            if words == ["slide"] and joint["kind"] in ("prismatic", "slot"):
                return one.along(joint["axis"], dx, dy)
        raise FalseClaim("mechanism/drivers", f"no such coordinate: {name[:60]}")

    def law(self, formula: object, s: Value, place: str) -> Value:
        return evaluate(formula, s, place)

    def straight(self, start: arb, end: arb) -> list[object]:
        return ["+", start, ["*", end - start, "s"]]

    def turned(self, body: str, reported: object, angle: arb, z: list[arb], at: str) -> bool:
        return bool(abs(exact(reported, at) - z[self.at[body, "angle"]]) <= angle)

    def is_of_body(self, word: str) -> bool:
        return word in self.words
