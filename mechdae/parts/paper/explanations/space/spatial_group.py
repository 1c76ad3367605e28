"""One group in space: the arms and axes of its links and pairs, and how an equation is written."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from math import degrees
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.describe import GROUND, Joint, coordinate
from mechdae.draw.diagram.places import numbers_of, places_of
from mechdae.draw.formulas.notations import plain
from mechdae.draw.formulas.tree import (
    Column,
    Equation,
    Formula,
    Grid,
    Letter,
    Part,
    Passage,
    Product,
    Sum,
    UnitName,
    columns,
    number,
)
from mechdae.draw.plans.relations import distinct_letters
from mechdae.draw.space.pose_choice import choose
from mechdae.draw.space.spatial_scene import SpatialScene, read_spatial
from mechdae.draw.space.viewpoint import Array
from mechdae.parts.paper.explanations.motion import group_of
from mechdae.parts.paper.explanations.subject import Subject
from mechdae.records import dataclass

if TYPE_CHECKING:
    from mechdae.describe.mechanism import Mechanism
    from mechdae.results import SweepResult

SPINS = {"velocity": "angular_velocity", "acceleration": "angular_acceleration"}
STILL = 1e-12
"""Vectors shorter than this share of the largest of their kind in the pose are nothing."""
WIDEST = 90
"""Letters of an equation in numbers on one line; a longer one is a table."""
POINT = {"velocity": ("v", "m/s"), "acceleration": ("a", "m/s²")}
LINK = {"velocity": ("ω", "rad/s"), "acceleration": ("ε", "rad/s²")}
DOTS = {"position": "", "velocity": "\N{COMBINING DOT ABOVE}", "acceleration": "\u0308"}
SYMBOL = {
    "angle": ("θ", ""),
    "angle2": ("θ", "2"),
    "slide": ("s", ""),
    "x": ("x", ""),
    "y": ("y", ""),
    "length": ("l", ""),
    "elevation": ("α", ""),
    "azimuth": ("β", ""),
}
ANGLES = ("elevation", "azimuth")
UNITS = {
    True: {"position": "rad", "velocity": "rad/s", "acceleration": "rad/s²"},
    False: {"position": "m", "velocity": "m/s", "acceleration": "m/s²"},
}


@dataclass(frozen=True)
class SpatialSubject(Subject):
    """One pose of a result of a spatial mechanism; vectors are (3,) in the fixed frame."""

    scene: SpatialScene  # type: ignore[assignment]

    @cached_property
    def relations(self) -> dict[str, Any]:
        return {}

    @cached_property
    def numbers(self) -> dict[str, int]:
        return {**numbers_of(self.scene.mechanism), GROUND: 0}

    @cached_property
    def letters(self) -> dict[str, str]:
        places = places_of(self.scene, self.pose)
        return distinct_letters(self.scene, self.pose, places, self.numbers)

    def named_apart(self, start: str, end: str) -> tuple[str, str]:
        """Return the letters of two points; those of one letter get the numbers of their links."""
        one, two = self.letter(start), self.letter(end)
        if one != two:
            return one, two
        bodies = (start.split(".")[0], end.split(".")[0])
        first, second = (f"{one}_{self.numbers[body]}" for body in bodies)
        return first, second

    def rate(self, reference: str, word: str) -> Array | None:
        """Return velocity or acceleration of ``body.point``, None where the result has none."""
        body = reference.split(".")[0]
        if body == GROUND:
            return np.zeros(3)
        found = self._own_rate(reference, word)
        if found is not None:
            return found
        for joint in self.scene.mechanism.joints.values():
            if joint.coincide and reference in (joint.first, joint.second):
                other = joint.second if reference == joint.first else joint.first
                if other.split(".")[0] == GROUND:
                    return np.zeros(3)
                found = self._own_rate(other, word)
                if found is not None:
                    return found
        return None

    def _own_rate(self, reference: str, word: str) -> Array | None:
        series = self.result.points.get(reference) or {}
        if word not in series or not np.isfinite(series[word][self.pose]).all():
            return None
        return np.asarray(series[word][self.pose], dtype=float)

    def spin(self, body: str, word: str = "velocity") -> Array | None:
        """Return angular velocity or acceleration, None of a link that spins freely."""
        if body == GROUND:
            return np.zeros(3)
        series = self.result.bodies.get(body) or {}
        name = SPINS[word]
        if name not in series or not np.isfinite(series[name][self.pose]).all():
            return None
        return np.asarray(series[name][self.pose], dtype=float)

    def turn(self, body: str) -> Array | None:
        """Return the rotation matrix (3, 3) of a body, None of one that spins freely."""
        found = self.scene.turns.get(body)
        if found is None or not np.isfinite(found[self.pose]).all():
            return None
        turn: Array = found[self.pose]
        return turn

    def axis(self, joint: Joint, second: bool = False) -> Array | None:
        return self.scene.axis(joint, self.pose, second)

    def of_joint(self, joint: str, word: str = "position") -> dict[str, float]:
        """Return the values or rates of a joint's coordinates by name, those of drivers too."""
        found = {}
        series = self.result.joints.get(joint) or {}
        for name in self.scene.mechanism.joints[joint].coordinates:
            driver = self.result.drivers.get(f"{joint}.{name}")
            key = name if word == "position" else f"{name}_{word}"
            if key in series:
                found[name] = self.value(series, key)
            elif driver is not None and word in driver:
                found[name] = self.value(driver, word)
        return found


def seen_in_space(result: SweepResult, pose: int | None) -> tuple[type[Subject], Any, int]:
    """Return the class of subject, the placements and the pose of a spatial result."""
    scene = read_spatial(result)
    return SpatialSubject, scene, choose(scene, result.kind, pose, None)[0]


@dataclass(frozen=True)
class Addend:
    """A term of a vector equation: how it is written, and the vector (3,)."""

    letter: Part
    vector: Array


def coordinate_letter(joint: str, word: str, order: str = "position") -> Letter:
    """Return the symbol of a joint's coordinate or of its rate: s with dots, index the joint."""
    symbol, further = SYMBOL[word]
    return Letter(symbol + DOTS[order], (f"{joint},{further}" if further else joint,))


def in_numbers(
    left: Letter, letters: tuple[Part, ...], shown: tuple[Column, ...], gap: float, unit: str
) -> Passage:
    """Return left = sum of terms in numbers: a line, or a table whose last row is the sum.

    `shown` is the left side and then the terms.
    """
    line = Equation((shown[0], Sum(shown[1:])))
    if len(plain(line)) <= WIDEST:
        return Formula(line, gap, unit)
    rows = tuple(
        (letter, *column.components)
        for letter, column in zip((*letters, left), (*shown[1:], shown[0]), strict=True)
    )
    return Grid((UnitName(unit), "x", "y", "z"), rows)


class SpatialGroup:
    """The vector equations of one group."""

    def __init__(self, subject: SpatialSubject, bodies: tuple[str, ...]) -> None:
        self.subject, self.bodies = subject, bodies
        self.mechanism: Mechanism = subject.scene.mechanism
        self.joints: list[Joint] = [
            self.mechanism.joints[name] for name in subject.joints_of(bodies)
        ]
        self._sizes: dict[str, float] = {}
        self.arms: list[tuple[str, str]] = [arm for body in bodies for arm in self._arms(body)]

    def _arms(self, body: str) -> Iterator[tuple[str, str]]:
        """Yield pairs of points of a link: the one it is known by, others that are sought."""
        scene, pose = self.subject.scene, self.subject.pose
        order = self.subject.order
        group = group_of(self.subject, body)

        def rank(reference: str) -> int:
            others = self._others(reference) - set(group)
            return min((order.get(other, len(order)) for other in others), default=len(order))

        placed = [ref for ref in scene.points(body) if np.isfinite(scene.place(ref, pose)).all()]
        if len(placed) < 2:
            return
        base = min(placed, key=rank)
        bars = {ref for joint in self.joints if joint.bar for ref in (joint.first, joint.second)}
        met = [ref for ref in placed if ref in bars or self._others(ref) & set(group)]
        far = [ref for ref in placed if self._apart(ref, base)]
        ends = [ref for ref in met if ref in far] or far[:1]
        for k, end in enumerate(ends):
            if all(self._apart(end, other) for other in ends[:k]):
                yield base, end

    def _others(self, reference: str) -> set[str]:
        """Return the bodies that a point is joined to."""
        body = reference.split(".")[0]
        return {
            other
            for joint in self.mechanism.joints.values()
            if reference in (joint.first, joint.second)
            for other in (joint.first_body, joint.second_body)
            if other != body
        }

    def _apart(self, one: str, other: str) -> bool:
        scene = self.subject.scene
        gap = float(np.linalg.norm(scene.local(one) - scene.local(other)))
        return gap > STILL * scene.mechanism.scale

    def sought(self) -> Iterator[tuple[str, str]]:
        """Yield joint and coordinate of what the group's equations give."""
        for joint in self.joints:
            for word in self.subject.of_joint(joint.name):
                if f"{joint.name}.{word}" not in self.subject.result.drivers:
                    yield joint.name, word

    def directions(self, joint: Joint) -> dict[str, tuple[Letter, Array]]:
        """Return letter and unit vector of each coordinate of a joint that has an axis."""
        subject, found = self.subject, dict[str, tuple[Letter, Array]]()
        if joint.pointer:
            letter = Letter("e", (joint.name,), vector=True)
            return {"length": (letter, self.pointed(joint, "position"))}
        if joint.wheels:
            return found
        axis = subject.axis(joint)
        if axis is None:
            return found
        frame = subject.scene.frame(joint, subject.pose)
        for word in joint.coordinates:
            if word in ("x", "y"):
                if frame is not None:
                    letter = Letter("e", (f"{joint.name},{word}",), vector=True)
                    found[word] = (letter, frame["xy".index(word)])
                continue
            second = subject.axis(joint, second=True) if word == "angle2" else axis
            mark = joint.name + (",2" if word == "angle2" else "")
            if second is not None:
                found[word] = (Letter("e", (mark,), vector=True), second)
        return found

    def slid(self, joint: Joint, word: str = "position") -> list[Addend]:
        """Return what leads from the first point of a joint to the second: along its axes."""
        values = self.values(joint, word)
        if joint.pointer and word == "position":
            values.setdefault("length", self.long(joint))
        ways, found = self.directions(joint), list[Addend]()
        for name, value in values.items():
            if name in ways and name in ("slide", "x", "y", "length") and not joint.coincide:
                (letter, axis), symbol = ways[name], coordinate_letter(joint.name, name, word)
                found.append(Addend(Product((symbol, letter)), value * axis))
        return found

    def values(self, joint: Joint, word: str) -> dict[str, float]:
        """Return the coordinates of a joint, or their rates."""
        return self.subject.of_joint(joint.name, word)

    def long(self, joint: Joint) -> float:
        """Return the length of a vector, which may be a number or a coordinate."""
        name = f"{joint.name}.length"
        return self.values(joint, "position").get(
            "length", self.subject.scene.numbers.get(name, np.nan)
        )

    def pointed(self, joint: Joint, word: str) -> Array:
        """Return the direction of a vector, or its rate, by elevation and azimuth."""
        numbers = self.subject.scene.numbers
        values = self.values(joint, "position")
        e, a = (values.get(angle, numbers.get(f"{joint.name}.{angle}", np.nan)) for angle in ANGLES)
        speeds, gains = self.values(joint, "velocity"), self.values(joint, "acceleration")
        de, da = (speeds.get(angle, 0.0) for angle in ANGLES)
        dde, dda = (gains.get(angle, 0.0) for angle in ANGLES)
        se, ce, sa, ca = np.sin(e), np.cos(e), np.sin(a), np.cos(a)
        up, round_ = np.array([-se * ca, ce, -se * sa]), np.array([-ce * sa, 0.0, ce * ca])
        if word == "position":
            return np.array([ce * ca, se, ce * sa])
        if word == "velocity":
            return up * de + round_ * da
        bent = -np.array([ce * ca, se, ce * sa]) * de**2 - np.array([ce * ca, 0.0, ce * sa]) * da**2
        mixed = 2 * de * da * np.array([se * sa, 0.0, -se * ca])
        return np.asarray(up * dde + round_ * dda + bent + mixed)

    def between(
        self, symbol: str, start: str, end: str, terms: list[Addend], unit: str, word: str = ""
    ) -> Iterator[Passage]:
        """Yield the equation of two points in letters and in numbers."""
        subject = self.subject
        names = subject.named_apart(start, end)
        if word:
            ends = [subject.rate(ref, word) for ref in (start, end)]
        else:
            ends = [subject.scene.place(ref, subject.pose) for ref in (start, end)]
        if ends[0] is None or ends[1] is None:
            return
        left, first = (Letter(symbol, (name,), vector=True) for name in names[::-1])
        yield from self.equation(left, ends[1], [Addend(first, ends[0]), *terms], unit)

    def equation(
        self, left: Letter, value: Array, terms: list[Addend], unit: str
    ) -> Iterator[Passage]:
        """Yield left = sum of terms in letters, then in numbers; terms that vanish are left out."""
        still = STILL * self.size(left.text)
        moving = [term for term in terms if float(np.linalg.norm(term.vector)) > still]
        if not moving:
            return
        value = np.where(np.abs(value) > still, value, 0.0)
        gap = float(np.linalg.norm(np.sum([term.vector for term in moving], axis=0) - value))
        if len(moving) == 1:
            shown = columns(tuple(value), unit=unit)
            yield Formula(Equation((left, moving[0].letter, *shown)), gap, unit)
            return
        shown = columns(tuple(value), *(tuple(term.vector) for term in moving), unit=unit)
        yield Formula(Equation((left, Sum(tuple(term.letter for term in moving)))))
        yield in_numbers(left, tuple(term.letter for term in moving), shown, gap, unit)

    def size(self, symbol: str) -> float:
        """Return the largest vector of a kind in the pose, or what turning makes of lengths."""
        if symbol not in self._sizes:
            self._sizes[symbol] = self._size(symbol)
        return self._sizes[symbol]

    def _size(self, symbol: str) -> float:
        subject, scale = self.subject, self.mechanism.scale
        if symbol == "r":
            return scale
        spins = [subject.spin(body) for body in self.mechanism.bodies]
        spin = max((float(np.linalg.norm(rate)) for rate in spins if rate is not None), default=0.0)
        order = 1 if symbol in ("v", "ω") else 2
        if symbol in ("ω", "ε"):
            word = {"ω": "velocity", "ε": "acceleration"}[symbol]
            rates = [subject.spin(body, word) for body in self.mechanism.bodies]
            reach = spin**order
        else:
            word = {"v": "velocity", "a": "acceleration"}[symbol]
            rates = [subject.rate(point, word) for point in subject.result.points]
            reach = spin**order * scale
        sizes = [float(np.linalg.norm(rate)) for rate in rates if rate is not None]
        return max([reach, *sizes])

    def found(self, word: str) -> Iterator[tuple[Part, Part]]:
        """Yield the coordinates of the group's joints, or their rates."""
        for joint in self.joints:
            for name, value in self.values(joint, word).items():
                if np.isfinite(value):
                    angle = coordinate(self.mechanism, f"{joint.name}.{name}").is_angle
                    unit = UNITS[angle][word]
                    shown = (degrees(value), "°") if unit == "rad" else (value, unit)
                    yield coordinate_letter(joint.name, name, word), number(*shown, 8)
