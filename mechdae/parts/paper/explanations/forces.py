"""Forces on the links of a group: equilibrium with its numbers, reactions, friction.

What acts on a link is looked up: reactions and efforts are those of the result, weights and loads
its load wrenches, which follow from the loads alone. Forces of inertia are masses times the
accelerations of the result. So a sum that closes is a check.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from functools import cached_property
from math import degrees
from typing import TYPE_CHECKING

import numpy as np

from mechdae.describe import Joint
from mechdae.draw.formulas.tree import (
    Equation,
    Facts,
    Formula,
    Grid,
    Letter,
    Listed,
    Note,
    Number,
    Part,
    Passage,
    Section,
    Sum,
    UnitName,
    Wording,
    columns,
    like,
    number,
    numbers,
)
from mechdae.draw.plans.forces import BodyForces
from mechdae.parts.paper.explanations.subject import Subject
from mechdae.records import dataclass
from mechdae.types import Floats

if TYPE_CHECKING:
    from mechdae.describe.mechanism import Mechanism
    from mechdae.draw.diagram.scene import DrawnScene

NOTHING = 1e-12
"""Share of the largest force of the pose below which a force is left out."""


@dataclass(frozen=True)
class ActingForce:
    """A force on a link: symbol, the letter of its place, force, moment about the link's point."""

    letter: Letter
    at: str
    force: Floats
    moment: Floats

    @property
    def row(self) -> Floats:
        """Force and moment as one vector."""
        return np.concatenate([self.force, self.moment])


class BalanceOfLinks(ABC):
    """What acts on the links of one pose; of a row of the result the forces come first."""

    axes: str
    """Components of a force."""

    def __init__(self, subject: Subject) -> None:
        self.subject: Subject = subject
        self.pose: int = subject.pose
        self.mechanism: Mechanism = subject.scene.mechanism

    # -- what differs between plane and space ----------------------------------------------

    @abstractmethod
    def moment(self, arm: Floats, force: Floats) -> Floats:
        """Return the moment of a force at the end of an arm."""

    @abstractmethod
    def pole(self, body: str) -> tuple[str, Floats]:
        """Return the point about which moments are taken, by the link's first joint."""

    @abstractmethod
    def base(self, body: str) -> Floats:
        """Return the point that load wrenches refer to."""

    @abstractmethod
    def driven(self, body: str, pole: Floats) -> Iterator[ActingForce]:
        """Yield what drivers exert."""

    @abstractmethod
    def centre(self, body: str) -> Floats:
        """Return the place of the centre of mass."""

    @abstractmethod
    def inertia(self, body: str) -> tuple[Floats, Floats]:
        """Return force and couple of inertia."""

    @abstractmethod
    def powers(self) -> tuple[float, float] | None:
        """Return the powers of loads and of inertia; None without speeds."""

    @abstractmethod
    def sizes(self, joint: Joint, row: Floats, series: Mapping[str, Floats]) -> list[str | Part]:
        """Return words and numbers of a reaction on the second body, and of its friction."""

    @abstractmethod
    def moment_heads(self, body: str) -> tuple[str, ...]:
        """Return the heads of the table's moments, without their unit."""

    def table_notes(self, body: str) -> tuple[Note, ...]:
        """Return what stands before the table of forces and moments."""
        return ()

    def balanced(self, body: str) -> bool:
        """Return whether the sum of forces can be written."""
        return True

    def place_of_load(self, load: str, body: str) -> str:
        """Return where a load acts, in words or a letter."""
        return load

    # -- what acts -------------------------------------------------------------------------

    @cached_property
    def size(self) -> float:
        """The largest reaction of the pose [N]."""
        joints = self.subject.result.joints.values()
        rows = [series["reaction"] for series in joints if "reaction" in series]
        sizes = [float(np.linalg.norm(row[self.pose][: len(self.axes)])) for row in rows]
        return max(filter(np.isfinite, sizes), default=0.0)

    def joints(self, body: str) -> list[Joint]:
        """Return the joints whose reaction acts on a body."""
        return [
            joint
            for joint in self.mechanism.joints.values()
            if body in (joint.first_body, joint.second_body)
            and "reaction" in (self.subject.result.joints.get(joint.name) or {})
        ]

    def not_unique(self, body: str) -> list[str]:
        """Return the joints of a link whose reactions the equations do not determine."""
        joints = self.joints(body)
        return [joint.name for joint in joints if not np.isfinite(self.reaction(joint, body)).all()]

    def reaction(self, joint: Joint, body: str) -> Floats:
        """Return force and moment of a joint on one of its bodies, about its second point."""
        series = self.subject.result.joints[joint.name]
        row = np.asarray(series["reaction"][self.pose], dtype=float)
        return row if joint.second_body == body else -row

    def acting(self, body: str) -> list[ActingForce]:
        """Return the forces on a link that do not vanish, with moments about its pole."""
        _, pole = self.pole(body)
        still = NOTHING * self.size
        reach = self.mechanism.scale
        forces = (
            *self._reactions(body, pole),
            *self._loads(body, pole),
            *self.driven(body, pole),
            *self._inertia(body, pole),
        )
        return [
            acting
            for acting in forces
            if float(np.linalg.norm(acting.force)) > still
            or float(np.linalg.norm(acting.moment)) > still * reach
        ]

    def wrench(
        self, letter: Letter, at: str, row: Floats, place: Floats, pole: Floats
    ) -> ActingForce:
        """Return a force with a moment about its place as one about the pole."""
        force, moment = np.split(row, [len(self.axes)])
        return ActingForce(letter, at, force, moment + self.moment(place - pole, force))

    def _reactions(self, body: str, pole: Floats) -> Iterator[ActingForce]:
        subject = self.subject
        for joint in self.joints(body):
            other = joint.first_body if joint.second_body == body else joint.second_body
            ends = [str(subject.numbers[end]) for end in (other, body)]
            index = ("," if max(map(len, ends)) > 1 else "").join(ends)
            at = subject.letter(joint.second)
            at = at if at == joint.name else f"{at} ({joint.name})"
            letter, place = Letter("R", (index,), vector=True), subject.place(joint.second)
            yield self.wrench(letter, at, self.reaction(joint, body), place, pole)

    def _loads(self, body: str, pole: Floats) -> Iterator[ActingForce]:
        say, mark = self.subject.say, str(self.subject.numbers[body])
        for load, wrenches in self.subject.result.loads.items():
            if body in wrenches:
                row = np.asarray(wrenches[body][self.pose], dtype=float)
                weight = load == "gravity"
                letter = Letter("G" if weight else "P", (mark,), "" if weight else load, True)
                at = say("centre") if weight else self.place_of_load(load, body)
                yield self.wrench(letter, at, row, self.base(body), pole)

    def _inertia(self, body: str, pole: Floats) -> Iterator[ActingForce]:
        say, mark = self.subject.say, str(self.subject.numbers[body])
        force, couple = self.inertia(body)
        if force.any():
            moment = self.moment(self.centre(body) - pole, force)
            yield ActingForce(Letter("Φ", (mark,), vector=True), say("centre"), force, moment)
        if couple.any():
            letter = Letter("M", (mark,), "Φ", vector=len(couple) > 1)
            yield ActingForce(letter, say("couple"), 0 * force, couple)


# -- sections --------------------------------------------------------------------------------------


def forces_section(balance: BalanceOfLinks, name: str, bodies: tuple[str, ...]) -> Section:
    """Return the equilibrium of each link of a group, and its reactions."""
    links = tuple(_link(balance, body) for body in reversed(bodies))
    return Section(balance.subject.say("forces of", name), (), links)


def _link(balance: BalanceOfLinks, body: str) -> Section:
    say = balance.subject.say
    title = say("link", balance.subject.numbers[body], body)
    lost = balance.not_unique(body)
    if lost or not balance.balanced(body):
        text = say("not unique", ", ".join(lost)) if lost else say("spins freely")
        return Section(title, (Note((text,)), *_sizes(balance, body)))
    acting = balance.acting(body)
    if not acting:
        return Section(title, (Note((say("unloaded"),)),))
    forces = [force for force in acting if np.any(force.force)]
    blocks: list[Passage] = [Note((say("in sum"),))]
    if forces:
        total = np.sum([force.force for force in forces], axis=0)
        shown = columns(tuple(0 * total), *(tuple(force.force) for force in forces), unit="N")
        letters = Sum(tuple(force.letter for force in forces))
        blocks.append(Formula(Equation((letters, Number("0")))))
        gap = float(np.linalg.norm(total))
        blocks.append(Formula(Equation((Sum(shown[1:]), shown[0])), gap, "N"))
    blocks += [*balance.table_notes(body), _table(balance, body, acting), *_sizes(balance, body)]
    return Section(title, tuple(blocks))


def _table(balance: BalanceOfLinks, body: str, acting: list[ActingForce]) -> Grid:
    """Return the table of forces and moments with their sums."""
    say, first = balance.subject.say, len(balance.axes)
    table = np.array([force.row for force in acting])
    total = table.sum(axis=0)
    moments = table.shape[1] - first
    reach = [1.0] * first + [balance.mechanism.scale] * moments
    still = NOTHING * balance.size * np.array(reach)
    table[np.abs(table) <= still] = 0.0
    total[np.abs(total) <= 1e3 * still] = 0.0
    alike = [(tuple(table[:, :first].ravel().tolist()), "N")] * first
    alike += [(tuple(table[:, first:].ravel().tolist()), "N m")] * moments

    def cells(row: Floats) -> tuple[Part, ...]:
        return tuple(like(float(v), *style) for v, style in zip(row, alike, strict=True))

    rows: list[tuple[str | Part, ...]] = [
        (force.letter, force.at, *cells(row)) for force, row in zip(acting, table, strict=True)
    ]
    rows.append((say("sum"), "", *cells(total)))
    names = [(f"F {axis}", "N") for axis in balance.axes]
    names += [(head, "N m") for head in balance.moment_heads(body)]
    heads = [Listed((Wording(name), UnitName(unit))) for name, unit in names]
    return Grid((say("acts"), say("at"), *heads), tuple(rows))


def _sizes(balance: BalanceOfLinks, body: str) -> Iterator[Passage]:
    """Yield sizes of the reactions in which the link is the second body, their friction."""
    subject, rows = balance.subject, []
    for joint in balance.joints(body):
        row = balance.reaction(joint, body)
        if joint.second_body == body and np.isfinite(row).all():
            words = balance.sizes(joint, row, subject.result.joints[joint.name])
            rows.append((subject.say("reaction", joint.name), tuple(words)))
    if rows:
        yield Note((subject.say("reactions"),))
        yield Facts(tuple(rows))


def spliced(text: str, *parts: Part) -> list[str | Part]:
    """Return words with formulas in the places that are marked."""
    pieces = text.split("\0")
    found: list[str | Part] = [pieces[0]]
    for part, piece in zip(parts, pieces[1:], strict=True):
        found += [part, piece]
    return [piece for piece in found if piece != ""]


def driver_section(subject: Subject) -> Section:
    rows = []
    for text, effort in subject.result.efforts.items():
        unit = subject.result.path_unit(f"efforts/{text}")
        value = number(float(effort[subject.pose]), unit, 8)
        rows.append((text, tuple(spliced(subject.say("effort is", "\0", text), value))))
    return Section(subject.say("effort"), (Facts(tuple(rows)),))


def power_section(balance: BalanceOfLinks) -> Section | None:
    """Return the balance of powers, which no reaction is in; None without speeds."""
    powers, subject = balance.powers(), balance.subject
    if powers is None:
        return None
    say, result, pose = subject.say, subject.result, subject.pose
    drive = sum(
        float(effort[pose]) * float(result.drivers[text].velocity[pose])
        for text, effort in result.efforts.items()
    )
    losses = (subject.value(series, "loss") for series in result.joints.values())
    loss = sum(filter(np.isfinite, losses)) if result.definition.friction == "coupled" else 0.0
    shown = numbers(0.0, drive, *powers, -loss, unit="W")
    words = ("N drive", "N loads", "N inertia", "N loss")
    letters = Sum(tuple(Letter(say("power letter"), (say(word),)) for word in words))
    gap = abs(drive + powers[0] + powers[1] - loss)
    blocks = (
        Note((say("power"),)),
        Formula(Equation((letters, Number("0")))),
        Formula(Equation((Sum(shown[1:]), shown[0])), gap, "W"),
    )
    return Section(say("check"), blocks)


class PlaneBalance(BalanceOfLinks):
    """What acts on the links of one pose: forces (2,), moments (1,)."""

    axes = "xy"

    def __init__(self, subject: Subject) -> None:
        super().__init__(subject)
        self.scene: DrawnScene = subject.scene
        self.forces: BodyForces = BodyForces(subject.result, subject.scene, subject.pose)

    def moment(self, arm: Floats, force: Floats) -> Floats:
        return np.array([arm[0] * force[1] - arm[1] * force[0]])

    def pole(self, body: str) -> tuple[str, Floats]:
        for joint in sorted(self.joints(body), key=lambda joint: not joint.coincide):
            return self.subject.letter(joint.second), self.subject.place(joint.second)
        return "O", self.base(body)

    def base(self, body: str) -> Floats:
        origin: Floats = self.scene.origins[body][self.pose]
        return origin

    def driven(self, body: str, pole: Floats) -> Iterator[ActingForce]:
        for text, place, force in self.forces.pushes(body):
            letter = Letter("F", (str(self.subject.numbers[body]),), vector=True)
            yield ActingForce(letter, text, force, self.moment(place - pole, force))

    def centre(self, body: str) -> Floats:
        return self.forces.centre(body)

    def inertia(self, body: str) -> tuple[Floats, Floats]:
        return self.forces.inertia(body), np.array([self.forces.couple(body)])

    def _inertia(self, body: str, pole: Floats) -> Iterator[ActingForce]:
        """Yield forces of inertia, then the torques of drivers."""
        yield from super()._inertia(body, pole)
        for text, torque in self.forces.twists(body).items():
            letter = Letter("M", (str(self.subject.numbers[body]),))
            yield ActingForce(letter, text, np.zeros(2), np.array([torque]))

    def place_of_load(self, load: str, body: str) -> str:
        value = self.mechanism.loads[load]
        for reference in (getattr(value, "point", None), *(getattr(value, "between", None) or ())):
            if reference and reference.split(".")[0] == body:
                return self.subject.letter(reference)
        return self.subject.say("couple") if getattr(value, "body", None) == body else load

    def moment_heads(self, body: str) -> tuple[str, ...]:
        return (self.subject.say("moment about", self.pole(body)[0]),)

    def sizes(self, joint: Joint, row: Floats, series: Mapping[str, Floats]) -> list[str | Part]:
        subject, rates = self.subject, self.forces.rates
        x, y, couple = (float(value) for value in row)
        angle = number(degrees(float(np.arctan2(y, x))), "°")
        text = subject.say("reaction is", "\0", "\0", subject.title(joint.second_body))
        words = spliced(text, number(float(np.hypot(x, y)), "N"), angle)
        loss, normal = (subject.value(series, name) for name in ("loss", "normal"))
        if not np.isfinite(loss) or not loss:
            return words
        lost = number(loss, "W")
        if joint.coincide:
            second, first = (rates.spins[body][0] for body in (joint.second_body, joint.first_body))
            text = subject.say("pin friction", "\0", "\0", "\0")
            turning = number(second - first, "rad/s")
            return words + spliced(text, number(couple, "N m"), turning, lost)
        if not np.isfinite(normal):
            return words + spliced(subject.say("other friction", "\0"), lost)
        angle_of_guide = self.scene.numbers.get(f"{joint.name}.axis", 0.0)
        axis = self.scene.direction(joint.first_body, angle_of_guide, self.pose)
        along = number(float(row[:2] @ axis), "N")
        sliding = number(subject.value(series, "slide_velocity"), "m/s")
        text = subject.say("slide friction", *"\0\0\0\0")
        return words + spliced(text, number(normal, "N"), along, sliding, lost)

    def powers(self) -> tuple[float, float] | None:
        rates, pose, scene = self.forces.rates, self.pose, self.scene
        bodies = [body for body in self.mechanism.bodies if scene.shown(body, pose)]
        if any(not rates.has(body, "acceleration") for body in bodies):
            return None

        def power(body: str, place: Floats, force: Floats, couple: float) -> float:
            turning = couple * float(rates.spins[body][0])
            return float(force @ rates.at(body, place, "velocity")) + turning

        loads = sum(
            power(body, self.base(body), row[pose][:2], float(row[pose][2]))
            for wrenches in self.subject.result.loads.values()
            for body, row in wrenches.items()
            if body in bodies
        )
        inertia = sum(
            power(body, self.centre(body), self.forces.inertia(body), self.forces.couple(body))
            for body in bodies
        )
        return loads, inertia
