"""Bodies, joints and drivers of a certificate, as far as the dimension is no matter."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from typing import Any

from flint import arb

from .arithmetic import LAST, ONE, ZERO, Dual, FalseClaim, Json, Value, exact, exacts, field, need

ROUNDING = arb(2) ** -90
"""Added to bounds that are reported: balls prove no equality."""


class ClaimedMechanism(ABC):
    """A mechanism in coordinates of all its bodies; the dimensions have the equations.

    A pose z is a list of the coordinates in `names` (owner and word each), last the parameter s
    that the drivers are formulas of: numbers, balls, series or values with derivatives.
    """

    dimension = 0
    turns = ""
    """Key of the turns of bodies that are reported."""
    wrong_sense = ""
    """What is said of a pose that is not `oriented`."""
    names: list[tuple[str, str]]
    scale: list[float]
    """Size of each coordinate, and of the parameter."""
    size: float
    unit: float
    """Size of the parameter."""
    left_out: set[int] | frozenset[int] = frozenset()
    """Numbers of redundant equations."""
    spins: Sequence[tuple[str, str, list[arb]]] = ()
    """Of bodies that spin freely the one that hangs on another by a quaternion without a part
    along a direction."""

    def __init__(self, data: Json, at: str) -> None:
        self.points: dict[str, dict[str, list[arb]]] = {}
        for body in field(data, "bodies", dict, at):
            place = f"{at}/bodies"
            self.points[body] = {
                name: exacts(numbers, self.dimension, f"{place}/{body}/{name}")
                for name, numbers in field(data["bodies"], body, dict, place).items()
            }
        joints = field(data, "joints", dict, at)
        self.joints: dict[str, Json] = {
            name: self._joint(joints[name], f"{at}/joints/{name}") for name in joints
        }
        self.drivers: Json = field(data, "drivers", dict, at)
        self.off: float = 0.0
        """How far redundant equations are off at most, of all poses looked at."""

    def _number_names(self, names: list[tuple[str, str]], lengths: str) -> None:
        """Set the coordinates, of which words among `lengths` are as large as the mechanism."""
        self.names = names
        self.n: int = len(names)
        self.at: dict[tuple[str, str], int] = {key: k for k, key in enumerate(names)}
        self.scale = [self.size if word in lengths.split() else 1.0 for _, word in names] + [1.0]

    def _largest(self, *more: arb) -> float:
        """Return the largest length among coordinates of points and others."""
        places = [v for points in self.points.values() for place in points.values() for v in place]
        return max([abs(float(v.mid())) for v in (*places, *more)] or [0]) or 1.0

    def _ends(self, joint: Json, kinds: Iterable[str], at: str) -> Json:
        """Return the kind of a joint, its ends (body, point) and their bodies."""
        kind = field(joint, "kind", str, at)
        ends = [tuple(field(joint, key, str, at).split(".")) for key in ("first", "second")]
        known = all(len(end) == 2 and end[1] in self.points.get(end[0], {}) for end in ends)
        why = f"not a kind that is checked, or no such body, point: {kind[:60]}"
        need(kind in kinds and known, at, why)
        return {"kind": kind, "ends": ends, "bodies": [body for body, _ in ends]}

    @abstractmethod
    def _joint(self, joint: Json, at: str) -> Json:
        """Return a joint with its numbers read: kind, ends, bodies."""

    @abstractmethod
    def rows(self, z: Sequence[Value]) -> list[Value]:
        """Return what vanishes at a pose: as many equations as coordinates."""

    @abstractmethod
    def placed(self, z: Sequence[Value]) -> Any:
        """Return the frames of all bodies."""

    @abstractmethod
    def place(self, end: Sequence[str], frames: Any) -> list[Any]:
        """Return the place of a point (body, point)."""

    @abstractmethod
    def coordinate(self, name: str, z: Sequence[Value], frames: Any) -> Value:
        """Return the coordinate that a driver moves."""

    @abstractmethod
    def law(self, formula: object, s: Value, place: str) -> Value:
        """Return the value of a driver's law."""

    @abstractmethod
    def straight(self, start: arb, end: arb) -> Sequence[object]:
        """Return the law that leads from one value at s = 0 to another at s = 1."""

    @abstractmethod
    def oriented(self, z: Sequence[Value]) -> bool:
        """Whether axes and tangents have the senses that joints need."""

    @abstractmethod
    def turned(self, body: str, reported: object, angle: arb, z: list[arb], at: str) -> bool:
        """Whether the turn of a body is as reported, but for an angle."""

    def driven(self, z: Sequence[Value], frames: object) -> list[Value]:
        """Return how far each driver's coordinate is off its law."""
        return [
            self.coordinate(name, z, frames) - self.law(formula, z[LAST], name[:90])
            for name, formula in self.drivers.items()
        ]

    def slopes(self, z: list[arb]) -> tuple[list[arb], list[dict[int, arb]]]:
        """Return the rows at z and their derivatives."""
        rows = self.rows([Dual(x, {k: ONE}) for k, x in enumerate(z)])
        return [row.v for row in rows], [row.d for row in rows]

    def dense(self, z: list[arb], index: int | None = None) -> list[list[arb]]:
        """Return the derivatives of the rows at z by all coordinates, or all but one."""
        columns = [k for k in range(self.n + 1) if k != index]
        return [[row.get(k, ZERO) for k in columns] for row in self.slopes(z)[1]]

    def joints_of(self, group: Iterable[str], known: Iterable[str]) -> Json:
        """Return the joints of the bodies of a group with each other and with known ones."""
        new, reached = {*group}, {*group, *known}
        return {
            name: joint
            for name, joint in self.joints.items()
            if new & {*joint["bodies"]} and {*joint["bodies"]} <= reached
        }

    def bodies_of(self, k: int) -> set[str]:
        """Return the bodies that a coordinate is of: one, or those of a joint."""
        owner, word = self.names[k]
        return {owner} if self.is_of_body(word) else {*self.joints[owner]["bodies"]}

    @abstractmethod
    def is_of_body(self, word: str) -> bool:
        """Whether a coordinate is one of a body's, and not a joint's."""

    def claimed(self, data: Json, s: arb, at: str) -> list[arb]:
        """Return a pose as it is written in the certificate, with its parameter."""
        bodies, owners = field(data, "bodies", dict, at), [owner for owner, _ in self.names]
        places = [
            exacts(bodies.get(owner), owners.count(owner), f"{at}/bodies/{owner}")
            for owner in dict.fromkeys(owners)
        ]
        return [*(v for numbers in places for v in numbers), s]

    def agrees(self, z: list[arb], claim: Json, at: str, within: float = 1e-12) -> list[arb]:
        """Compare a pose in balls with the place to look at that is written down for it."""
        for k, (x, written) in enumerate(zip(z, self.claimed(claim, z[LAST], at), strict=True)):
            if not abs(x - written) <= within * self.scale[k]:
                place = f"{at}/bodies/{self.names[k][0]}"
                raise FalseClaim(place, f"more than {within} off the pose")
        return z

    def compare(self, z: list[arb], claim: Json, at: str) -> None:
        """Compare points and turns that are reported with a pose in balls, by their bounds."""
        need(self.oriented(z), at, self.wrong_sense)
        bounds, frames = field(claim, "bound", dict, at), self.placed(z)
        length, angle = (
            exact(bounds.get(key, "0"), f"{at}/bound/{key}") + ROUNDING
            for key in ("length", "angle")
        )
        for name, numbers in field(claim, "points", dict, at).items():
            reported = exacts(numbers, self.dimension, f"{at}/{name}")
            spot = self.place(name.split("."), frames)
            gap = sum(((a - b) * (a - b) for a, b in zip(spot, reported, strict=True)), ZERO)
            within = gap <= length * length and length >= 0
            need(within, f"{at}/points/{name}", "further off than its bound")
        for body, reported in field(claim, self.turns, dict, at).items():
            place = f"{at}/{self.turns}/{body}"
            need(self.turned(body, reported, angle, z, place), place, "further off than its bound")
