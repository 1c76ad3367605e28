"""Positions, velocities and accelerations of one group in space: vector equations with numbers.

Of two points S and E of a link r_E = r_S + r_ES, v_E = v_S + w x r_ES and
a_E = a_S + e x r_ES + w x (w x r_ES); of two links in a pair w_2 = w_1 + q' u about its axis u and
e_2 = e_1 + q'' u + w_1 x q' u; of a point that slides along an axis v_Q = v_P + w_1 x r_QP + s' u
with 2 w_1 x s' u in its acceleration; of a bar the components along it vanish (Wittenburg,
Dynamics of Multibody Systems). Arms and axes are made of orientations and joint coordinates of
the result, the ends they have to meet are points of the result: how far they miss is the gap.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mechdae.describe import GROUND, Joint
from mechdae.draw.formulas.tree import (
    Cross,
    Equation,
    Formula,
    Less,
    Letter,
    Norm,
    Note,
    Number,
    Part,
    Passage,
    Product,
    Section,
    Sum,
    columns,
    number,
    numbers,
)
from mechdae.draw.space.viewpoint import Array
from mechdae.parts.paper.explanations.motion import facts_of, motion_section, solved_values
from mechdae.parts.paper.explanations.space.spatial_group import (
    DOTS,
    LINK,
    POINT,
    SYMBOL,
    UNITS,
    Addend,
    SpatialGroup,
    SpatialSubject,
    coordinate_letter,
    in_numbers,
)


class SpatialRates:
    """The equations of one group."""

    def __init__(self, group: SpatialGroup, word: str) -> None:
        self.group, self.subject, self.word = group, group.subject, word

    def passages(self) -> Iterator[Passage]:
        """Yield the equations of links, of points, of bars and wheels, and the rates found."""
        known: set[str] = set()
        for joint in self.group.joints:
            yield from self._turning(joint, known)
        for body in self.group.bodies:
            spin = self.subject.spin(body, self.word)
            if body not in known and spin is not None and spin.any():
                symbol, unit = LINK[self.word]
                yield Formula(
                    Equation((self._link(symbol, body), *columns(tuple(spin), unit=unit)))
                )
        for start, end in self.group.arms:
            yield from self._carried(start, end)
        for joint in self.group.joints:
            if joint.bar:
                yield from self._along(joint.first, joint.second)
            elif joint.wheels > 1:
                yield from self._meshed(joint)
            elif joint.pointer:
                yield from self._pointing(joint)
            else:
                yield from self._sliding(joint)
        yield from solved_values(self.subject, self.group.found(self.word))

    def _link(self, symbol: str, body: str) -> Letter:
        return Letter(symbol, (str(self.subject.numbers[body]),), vector=True)

    def _turning(self, joint: Joint, known: set[str]) -> Iterator[Passage]:
        """Yield the angular rate of the second link of a pair by that of the first one."""
        if joint.pointer or joint.wheels or joint.bar or getattr(joint, "ball", False):
            return
        subject, (symbol, unit) = self.subject, LINK[self.word]
        first, second = joint.first_body, joint.second_body
        one, two = (subject.spin(body, self.word) for body in (first, second))
        base, top = (subject.spin(body) for body in (first, second))
        rates = subject.of_joint(joint.name, "velocity")
        gains = subject.of_joint(joint.name, self.word)
        ways = {
            w: way for w, way in self.group.directions(joint).items() if w in ("angle", "angle2")
        }
        if one is None or two is None or base is None or top is None or set(ways) - set(gains):
            return
        terms = [Addend(self._link(symbol, first), one)]
        for name, (letter, axis) in ways.items():
            rate = Product((coordinate_letter(joint.name, name, self.word), letter))
            terms.append(Addend(rate, gains[name] * axis))
            if self.word == "acceleration":
                rate = Product((coordinate_letter(joint.name, name, "velocity"), letter))
                carrier, spin = (first, base) if name == "angle" else (second, top)
                turned = np.cross(spin, rates[name] * axis)
                terms.append(Addend(Cross(self._link("ω", carrier), rate), turned))
        if second in self.group.bodies:
            known.add(second)
        yield from self.group.equation(self._link(symbol, second), two, terms, unit)

    def _carried(self, start: str, end: str) -> Iterator[Passage]:
        """Yield the rate of one point of a link by that of another one."""
        subject, body = self.subject, start.split(".")[0]
        turn, spins = subject.turn(body), self._spins(body)
        if turn is None or spins is None:
            yield from self._along(start, end)
            return
        scene, (symbol, unit) = subject.scene, POINT[self.word]
        names = subject.named_apart(start, end)
        arm = turn @ (scene.local(end) - scene.local(start))
        letter = Letter("r", names[::-1], vector=True)
        terms = self._borne(body, spins, letter, arm)
        yield from self.group.between(symbol, start, end, terms, unit, self.word)

    def _spins(self, body: str) -> tuple[Array, Array] | None:
        """Return angular velocity and, of that order, angular rate of a link; None without."""
        spin, gain = self.subject.spin(body), self.subject.spin(body, self.word)
        return None if spin is None or gain is None else (spin, gain)

    def _borne(
        self, body: str, spins: tuple[Array, Array], letter: Letter, arm: Array
    ) -> list[Addend]:
        """Return what a link's turning adds at the end of an arm."""
        omega, (spin, gain) = self._link("ω", body), spins
        if self.word == "velocity":
            return [Addend(Cross(omega, letter), np.cross(spin, arm))]
        return [
            Addend(Cross(self._link("ε", body), letter), np.cross(gain, arm)),
            Addend(Cross(omega, Cross(omega, letter)), np.cross(spin, np.cross(spin, arm))),
        ]

    def _along(self, start: str, end: str) -> Iterator[Passage]:
        """Yield that the distance of two points stays: v·r = 0, a·r = -v^2."""
        subject, pose = self.subject, self.subject.pose
        one, two = (subject.rate(ref, self.word) for ref in (start, end))
        slow, fast = (subject.rate(ref, "velocity") for ref in (start, end))
        if one is None or two is None or slow is None or fast is None:
            return
        (symbol, unit), index = POINT[self.word], subject.named_apart(start, end)[::-1]
        letter = Letter(symbol, index, vector=True)
        left, first = (Letter(symbol, (name,), vector=True) for name in index)
        rate: Array = two - one
        if one.any():
            yield Formula(Equation((letter, Sum((left, Less(first))))))
            shown = columns(tuple(rate), tuple(two), tuple(one), unit=unit)
            yield Formula(Equation((shown[0], Sum((shown[1], Less(shown[2]))))), 0.0, unit)
        else:
            yield Formula(Equation((letter, left, *columns(tuple(rate), unit=unit))), 0.0, unit)
        arm = subject.scene.place(end, pose) - subject.scene.place(start, pose)
        length, dot = float(np.linalg.norm(arm)), float(rate @ arm)
        product = Product((letter, Letter("r", index, vector=True)))
        if self.word == "velocity":
            yield Formula(Equation((product, Number("0"))), abs(dot) / length, unit)
            return
        square = float(np.sum((fast - slow) ** 2))
        size = Norm(Letter("v", index, vector=True))
        sides: tuple[Part, ...] = (product, Less(Product((size, size))), number(-square, "m²/s²"))
        yield Formula(Equation(sides), abs(dot + square) / length, unit)

    def _sliding(self, joint: Joint) -> Iterator[Passage]:
        """Yield the rate of a point that slides in a link, by that of the link's point."""
        seen, body = self.group.slid(joint, self.word), joint.first_body
        spins, turning = self._spins(body), self.subject.spin(body)
        if not seen or spins is None or turning is None:
            return
        names = self.subject.named_apart(joint.first, joint.second)
        arm = np.sum([term.vector for term in self.group.slid(joint)], axis=0)
        terms = self._borne(body, spins, Letter("r", names[::-1], vector=True), arm)
        if self.word == "acceleration":
            for term in self.group.slid(joint, "velocity"):
                twice = Product((Number("2"), Cross(self._link("ω", body), term.letter)))
                terms.append(Addend(twice, 2 * np.cross(turning, term.vector)))
        symbol, unit = POINT[self.word]
        terms += seen
        yield from self.group.between(symbol, joint.first, joint.second, terms, unit, self.word)

    def _pointing(self, joint: Joint) -> Iterator[Passage]:
        """Yield the rate of the head of a vector of a loop by that of its tail."""
        turned = [Letter("e" + DOTS[order], (joint.name,), vector=True) for order in POINT]
        length = coordinate_letter(joint.name, "length")
        terms = self.group.slid(joint, self.word)
        if self.word == "acceleration":
            speed = self.group.values(joint, "velocity").get("length", 0.0)
            letter = Product(
                (Number("2"), coordinate_letter(joint.name, "length", "velocity"), turned[0])
            )
            terms.append(Addend(letter, 2 * speed * self.group.pointed(joint, "velocity")))
        direction = self.group.long(joint) * self.group.pointed(joint, self.word)
        terms.append(Addend(Product((length, turned[self.word == "acceleration"])), direction))
        symbol, unit = POINT[self.word]
        yield from self.group.between(symbol, joint.first, joint.second, terms, unit, self.word)

    def _meshed(self, joint: Joint) -> Iterator[Passage]:
        """Yield the ratio of the rates of two wheels about their axes, relative to the carrier."""
        carrier = getattr(joint, "carrier", None) or GROUND
        pins = [self._pin(carrier, wheel) for wheel in (joint.first_body, joint.second_body)]
        if any(pin is None for pin in pins):
            return
        letters, rates = list[Part](), list[float]()
        for pin in (pin for pin in pins if pin is not None):
            rate = self.subject.of_joint(pin.name, self.word).get("angle", np.nan)
            letter = coordinate_letter(pin.name, "angle", self.word)
            away = pin.first_body == carrier
            letters.append(letter if away else Less(letter))
            rates.append(rate if away else -rate)
        if not np.isfinite(rates).all() or not np.any(rates):
            return
        ratio, unit = joint.turn_ratio(self.subject.scene.numbers), UNITS[True][self.word]
        shown = numbers(rates[1], rates[0], unit=unit)
        value = Product((number(ratio), shown[0]))
        sides = (letters[0], Product((Letter("i"), letters[1])), value, shown[1])
        yield Formula(Equation(sides), abs(rates[0] - ratio * rates[1]), unit)

    def _pin(self, carrier: str, wheel: str) -> Joint | None:
        for joint in self.group.mechanism.joints.values():
            ends = {joint.first_body, joint.second_body}
            if ends == {carrier, wheel} and joint.turns and not joint.wheels:
                return joint
        return None


def spatial_group_section(subject: SpatialSubject, name: str, bodies: tuple[str, ...]) -> Section:
    """Return what there is to say of the motion of one group."""
    say, group = subject.say, SpatialGroup(subject, bodies)
    sought = ", ".join(f"{_plain(word)} ({joint})" for joint, word in group.sought())
    facts = [*facts_of(subject, bodies), (say("sought"), (sought,))]

    def rates(word: str) -> tuple[Passage, ...]:
        return tuple(SpatialRates(group, word).passages()) or (Note((say("no relation"),)),)

    return motion_section(subject, name, facts, _positions(group), rates)


def _plain(word: str) -> str:
    return "".join(SYMBOL[word])


def _positions(group: SpatialGroup) -> Iterator[Passage]:
    """Yield axes, closures of links and pairs, and the coordinates that were found."""
    subject = group.subject
    for joint in group.joints:
        for letter, axis in dict(group.directions(joint).values()).items():
            gap = abs(float(np.linalg.norm(axis)) - 1.0)
            yield Formula(Equation((letter, *columns(tuple(axis)))), gap)
    for start, end in group.arms:
        yield from _closure(subject, start, end)
        if subject.turn(start.split(".")[0]) is None:
            scene = subject.scene
            span = float(np.linalg.norm(scene.local(end) - scene.local(start)))
            yield _length(subject, start, end, span)
    for joint in group.joints:
        if joint.bar:
            length = subject.scene.numbers[f"{joint.name}.length"]
            yield _length(subject, joint.first, joint.second, length)
        elif group.slid(joint):
            yield from group.between("r", joint.first, joint.second, group.slid(joint), "m")
    yield from solved_values(subject, group.found("position"))


def _closure(subject: SpatialSubject, start: str, end: str) -> Iterator[Passage]:
    """Yield r_E = r_S + r_ES, in letters and in numbers."""
    scene = subject.scene
    one, two = (scene.place(ref, subject.pose) for ref in (start, end))
    names, turn = subject.named_apart(start, end), subject.turn(start.split(".")[0])
    arm = two - one
    if turn is not None:
        arm = turn @ (scene.local(end) - scene.local(start))
    first, second = (Letter("r", (name,), vector=True) for name in names)
    shown = columns(tuple(two), tuple(one), tuple(arm), unit="m")
    terms = (first, Letter("r", names[::-1], vector=True))
    yield Formula(Equation((second, Sum(terms))))
    yield in_numbers(second, terms, shown, float(np.linalg.norm(one + arm - two)), "m")


def _length(subject: SpatialSubject, start: str, end: str, length: float) -> Formula:
    """Return the distance of two points that stays."""
    one, two = (subject.scene.place(ref, subject.pose) for ref in (start, end))
    arm = float(np.linalg.norm(two - one))
    names = subject.named_apart(start, end)
    letter = Norm(Letter("r", names[::-1], vector=True))
    return Formula(Equation((letter, number(length, "m"))), abs(arm - length), "m")
