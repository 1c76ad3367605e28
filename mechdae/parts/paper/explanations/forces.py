"""Forces on the links of a group: equilibrium with its numbers, reactions, friction.

What acts on a link is looked up: reactions and efforts are those of the result, weights and loads
its load wrenches, which follow from the loads alone. Forces of inertia are masses times the
accelerations of the result. So a sum that closes is a check.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import degrees

import numpy as np

from mechdae.describe.mechanism import GROUND
from mechdae.draw.diagram.scene import Array
from mechdae.draw.formulas import (
    Equation,
    Facts,
    Formula,
    Grid,
    Letter,
    Note,
    Number,
    Part,
    Passage,
    Section,
    Sum,
)
from mechdae.draw.formulas.tree import columns, decimals, number, numbers, rounded
from mechdae.draw.plans.forces import BodyForces
from mechdae.parts.paper.explanations.subject import Subject
from mechdae.records import dataclass

NOTHING = 1e-12
"""Share of the largest force of the pose below which a force is left out."""


@dataclass(frozen=True)
class Acting:
    """A force on a link: symbol, the letter of its place, force, moment about the link's point."""

    letter: Letter
    at: str
    force: Array
    moment: float


class BalanceOfLinks:
    """What acts on the links of one pose."""

    def __init__(self, subject: Subject) -> None:
        self.subject = subject
        self.forces = BodyForces(subject.result, subject.scene, subject.pose)
        every = [
            self._reaction(joint, body)[0]
            for body in subject.scene.mechanism.bodies
            for joint in self.forces.joints(body)
        ]
        sizes = [float(np.hypot(*force)) for force in every]
        self.size = max([own for own in sizes if np.isfinite(own)], default=0.0)

    def pole(self, body: str) -> tuple[str, Array]:
        """Return the point about which moments are taken: the link's first joint, its letter."""
        for name in self.forces.joints(body):
            joint = self.subject.scene.mechanism.joints[name]
            if joint.coincide:
                return self.subject.letter(joint.second), self.subject.place(joint.second)
        for name in self.forces.joints(body):
            joint = self.subject.scene.mechanism.joints[name]
            return self.subject.letter(joint.second), self.subject.place(joint.second)
        return "O", self.subject.scene.origins[body][self.subject.pose]

    def acting(self, body: str) -> list[Acting]:
        """Return the forces on a link that do not vanish."""
        _, pole = self.pole(body)
        found = [own for own in self._all(body, pole) if self._counts(own)]
        return found

    def not_unique(self, body: str) -> list[str]:
        """Return the joints of a link whose reactions the equations do not determine."""
        row = self.subject.pose
        return [
            name
            for name in self.forces.joints(body)
            if not np.isfinite(self.subject.result.joints[name].reaction[row]).all()
        ]

    def _counts(self, own: Acting) -> bool:
        still = NOTHING * self.size
        reach = self.subject.scene.mechanism.scale
        return float(np.hypot(*own.force)) > still or abs(own.moment) > still * reach

    def _all(self, body: str, pole: Array) -> Iterator[Acting]:
        subject, forces = self.subject, self.forces
        mark = str(subject.numbers[body])
        for name in forces.joints(body):
            joint = subject.scene.mechanism.joints[name]
            force, couple = self._reaction(name, body)
            other = str(subject.numbers[forces.other(name, body)])
            gap = "," if max(len(other), len(mark)) > 1 else ""
            index = f"{other}{gap}{mark}"
            letter = Letter("R", (index,), vector=True)
            place = subject.place(joint.second)
            at = subject.letter(joint.second)
            at = at if at == name else f"{at} ({name})"
            yield Acting(letter, at, force, couple + _moment(place - pole, force))
        origin = subject.scene.origins[body][subject.pose]
        for load, wrenches in self.subject.result.loads.items():
            if body in wrenches:
                x, y, couple = (float(own) for own in wrenches[body][subject.pose])
                force = np.array([x, y])
                weight = load == "gravity"
                letter = Letter("G" if weight else "P", (mark,), "" if weight else load, True)
                where = subject.say("centre") if weight else self._place_of(load, body)
                yield Acting(letter, where, force, couple + _moment(origin - pole, force))
        for text, place, force in forces.pushes(body):
            letter = Letter("F", (mark,), vector=True)
            yield Acting(letter, text, force, _moment(place - pole, force))
        inertia = forces.inertia(body)
        letter, centre = Letter("Φ", (mark,), vector=True), forces.centre(body)
        yield Acting(letter, subject.say("centre"), inertia, _moment(centre - pole, inertia))
        nothing = np.zeros(2)
        yield Acting(Letter("M", (mark,), "Φ"), subject.say("couple"), nothing, forces.couple(body))
        for text, torque in forces.twists(body).items():
            yield Acting(Letter("M", (mark,)), text, nothing, torque)

    def _place_of(self, load: str, body: str) -> str:
        own = self.subject.scene.mechanism.loads[load]
        for reference in (getattr(own, "point", None), *(getattr(own, "between", None) or ())):
            if reference and reference.split(".")[0] == body:
                return self.subject.letter(reference)
        return self.subject.say("couple") if getattr(own, "body", None) == body else load

    def _reaction(self, name: str, body: str) -> tuple[Array, float]:
        """Return force and moment, about the joint's place, of a joint on one of its bodies."""
        joint = self.subject.scene.mechanism.joints[name]
        row = np.asarray(self.subject.result.joints[name].reaction[self.subject.pose], dtype=float)
        sign = 1.0 if joint.second_body == body else -1.0
        return sign * row[:2], float(sign * row[2])


def _moment(arm: Array, force: Array) -> float:
    return float(arm[0] * force[1] - arm[1] * force[0])


def forces_section(
    subject: Subject, balance: BalanceOfLinks, name: str, bodies: tuple[str, ...]
) -> Section:
    """Return the equilibrium of each link of a group, and its reactions."""
    links = tuple(_link(subject, balance, body) for body in reversed(bodies))
    return Section(subject.say("forces of", name), (), links)


def _link(subject: Subject, balance: BalanceOfLinks, body: str) -> Section:
    say = subject.say
    title = say("link", subject.numbers[body], body)
    lost = balance.not_unique(body)
    if lost:
        note = Note((say("not unique", ", ".join(lost)),))
        return Section(title, (note, *_reactions(subject, balance, body)))
    acting = balance.acting(body)
    if not acting:
        return Section(title, (Note((say("unloaded"),)),))
    forces = [own for own in acting if np.any(own.force)]
    blocks: list[Passage] = [Note((say("in sum"),))]
    if forces:
        letters = Sum(tuple(own.letter for own in forces))
        total = np.sum([own.force for own in forces], axis=0)
        shown = columns((0.0, 0.0), *(tuple(own.force) for own in forces), unit="N")
        gap = float(np.hypot(*total))
        blocks.append(Formula(Equation((letters, Number("0")))))
        blocks.append(Formula(Equation((Sum(shown[1:]), shown[0])), gap, "N"))
    blocks.append(_moments(subject, balance, body, acting))
    blocks += _reactions(subject, balance, body)
    return Section(title, tuple(blocks))


def _moments(subject: Subject, balance: BalanceOfLinks, body: str, acting: list[Acting]) -> Grid:
    """Return the table of forces and moments about the link's point with their sums."""
    say = subject.say
    pole, _ = balance.pole(body)
    table = np.array([[*own.force, own.moment] for own in acting])
    total = table.sum(axis=0)
    still = NOTHING * balance.size * np.array([1.0, 1.0, subject.scene.mechanism.scale])
    table[np.abs(table) <= still] = 0.0
    places = [decimals(*table[:, :2].ravel()), decimals(*table[:, 2])]
    formats = (places[0], places[0], places[1])

    def cells(row: Array) -> tuple[Part, ...]:
        return tuple(
            Number(rounded(float(value), *style), style[1])
            for value, style in zip(row, formats, strict=True)
        )

    rows: list[tuple[str | Part, ...]] = [
        (own.letter, own.at, *cells(row)) for own, row in zip(acting, table, strict=True)
    ]
    rows.append((say("sum"), "", *cells(total)))
    newton, moment = say.unit("N"), f"{say('moment about', pole)}, {say.unit('N m')}"
    heads = (say("acts"), say("at"), f"F x, {newton}", f"F y, {newton}", moment)
    return Grid(heads, tuple(rows))


def _reactions(subject: Subject, balance: BalanceOfLinks, body: str) -> Iterator[Passage]:
    """Yield sizes of the reactions in which the link is the second body, their friction."""
    rows, rates = [], balance.forces.rates
    for joint in subject.scene.mechanism.joints.values():
        series = subject.result.joints.get(joint.name) or {}
        if joint.second_body != body or "reaction" not in series:
            continue
        if not np.isfinite(series["reaction"][subject.pose]).all():
            continue
        x, y, couple = (float(own) for own in series["reaction"][subject.pose])
        size = number(float(np.hypot(x, y)), "N")
        angle = number(degrees(float(np.arctan2(y, x))), "°")
        parts = spliced(subject.say("reaction is", "\0", "\0", subject.title(body)), size, angle)
        loss = subject.value(series, "loss")
        if np.isfinite(loss) and loss:
            lost = number(loss, "W")
            normal = subject.value(series, "normal")
            if joint.coincide:
                spins = [rates.spins[own][0] for own in (joint.second_body, joint.first_body)]
                turning = number(spins[0] - spins[1], "rad/s")
                text = subject.say("pin friction", "\0", "\0", "\0")
                parts += spliced(text, number(couple, "N m"), turning, lost)
            elif np.isfinite(normal):
                along = _along(subject, joint.name, np.array([x, y]))
                sliding = number(subject.value(series, "slide_velocity"), "m/s")
                text = subject.say("slide friction", *"\0\0\0\0")
                parts += spliced(text, number(normal, "N"), number(along, "N"), sliding, lost)
            else:
                parts += spliced(subject.say("other friction", "\0"), lost)
        rows.append((subject.say("reaction", joint.name), tuple(parts)))
    if rows:
        yield Note((subject.say("reactions"),))
        yield Facts(tuple(rows))


def _along(subject: Subject, name: str, force: Array) -> float:
    """Return the component of a force along the guide of a joint."""
    joint = subject.scene.mechanism.joints[name]
    angle = subject.scene.numbers.get(f"{name}.axis", 0.0)
    axis = subject.scene.direction(joint.first_body, angle, subject.pose)
    return float(force @ axis)


def spliced(text: str, *parts: Part) -> list[str | Part]:
    """Return words with formulas in the places that are marked."""
    pieces = text.split("\0")
    found: list[str | Part] = [pieces[0]]
    for part, piece in zip(parts, pieces[1:], strict=True):
        found += [part, piece]
    return [own for own in found if own != ""]


def driver_section(subject: Subject) -> Section:
    """Return the efforts of the drivers."""
    rows = []
    for text, effort in subject.result.efforts.items():
        unit = subject.result.path_unit(f"efforts/{text}")
        value = number(float(effort[subject.pose]), unit, 8)
        rows.append((text, tuple(spliced(subject.say("effort is", "\0", text), value))))
    return Section(subject.say("effort"), (Facts(tuple(rows)),))


def power_section(subject: Subject, balance: BalanceOfLinks) -> Section | None:
    """Return the balance of powers, which no reaction is in; None without speeds."""
    result, pose = subject.result, subject.pose
    bodies = [body for body in subject.scene.mechanism.bodies if subject.scene.shown(body, pose)]
    rates = balance.forces.rates
    if any(not rates.has(body, "acceleration") for body in bodies):
        return None

    def power(body: str, place: Array, force: Array, couple: float) -> float:
        return float(force @ rates.at(body, place, "velocity")) + couple * rates.spins[body][0]

    drive = sum(
        float(effort[pose]) * float(result.drivers[text].velocity[pose])
        for text, effort in result.efforts.items()
    )
    loads = sum(
        power(body, subject.scene.origins[body][pose], own[pose][:2], float(own[pose][2]))
        for wrenches in result.loads.values()
        for body, own in wrenches.items()
        if body in bodies
    )
    inertia = sum(
        power(
            body,
            balance.forces.centre(body),
            balance.forces.inertia(body),
            balance.forces.couple(body),
        )
        for body in bodies
    )
    return sum_of_powers(subject, drive, loads, inertia)


def sum_of_powers(subject: Subject, drive: float, loads: float, inertia: float) -> Section:
    """Return the sum of the powers of drivers, loads and inertia less what friction takes."""
    say, result = subject.say, subject.result
    loss = sum(
        subject.value(series, "loss")
        for series in result.joints.values()
        if np.isfinite(subject.value(series, "loss"))
    )
    if result.definition.friction != "coupled":
        loss = 0.0
    shown = numbers(0.0, drive, loads, inertia, -loss, unit="W")
    words = ("N drive", "N loads", "N inertia", "N loss")
    letters = Sum(tuple(Letter(say("power letter"), (say(word),)) for word in words))
    gap = abs(drive + loads + inertia - loss)
    blocks = (
        Note((say("power"),)),
        Formula(Equation((letters, Number("0")))),
        Formula(Equation((Sum(shown[1:]), shown[0])), gap, "W"),
    )
    return Section(say("check"), blocks)


__all__ = ["GROUND", "BalanceOfLinks", "driver_section", "forces_section", "power_section"]
