"""Forces and moments on the links of a group in space: equilibrium with its numbers, reactions.

Reactions and efforts are those of the result, weights and loads its load wrenches, which follow
from the loads alone. The force of inertia is -m a of the centre of mass, its couple
-(J e + w x J w) with the tensor J about it (Newton and Euler), of accelerations of the result. So
a sum that closes is a check.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np

from mechdae.describe.coordinates import NamedCoordinate, coordinate
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
from mechdae.draw.formulas.tree import columns, decimals, number, rounded
from mechdae.draw.space.viewpoint import Array
from mechdae.parts.paper.explanations.forces import spliced, sum_of_powers
from mechdae.parts.paper.explanations.space.spatial_subject import SpatialSubject
from mechdae.records import dataclass

NOTHING = 1e-12
"""Share of the largest force of the pose below which a force is left out."""
AXES = "xyz"


@dataclass(frozen=True)
class SpatialActing:
    """A force on a link: symbol, the letter of its place, force, moment about the link's point."""

    letter: Letter
    at: str
    force: Array
    moment: Array

    @property
    def row(self) -> Array:
        """Force and moment as one vector (6,)."""
        return np.concatenate([self.force, self.moment])


class SpatialBalance:
    """What acts on the links of one pose."""

    def __init__(self, subject: SpatialSubject) -> None:
        self.subject, self.scene, self.pose = subject, subject.scene, subject.pose
        self.numbers = subject.scene.numbers

    @cached_property
    def size(self) -> float:
        """The largest reaction of the pose [N]."""
        forces = [
            own["reaction"][self.pose][:3]
            for own in self.subject.result.joints.values()
            if "reaction" in own
        ]
        sizes = [float(np.linalg.norm(own)) for own in forces]
        return max([own for own in sizes if np.isfinite(own)], default=0.0)

    def joints(self, body: str) -> list[str]:
        """Return the joints whose reaction acts on a body."""
        return [
            joint.name
            for joint in self.scene.mechanism.joints.values()
            if body in (joint.first_body, joint.second_body)
            and "reaction" in (self.subject.result.joints.get(joint.name) or {})
        ]

    def not_unique(self, body: str) -> list[str]:
        """Return the joints of a link whose reactions the equations do not determine."""
        series = self.subject.result.joints
        return [
            name
            for name in self.joints(body)
            if not np.isfinite(series[name].reaction[self.pose]).all()
        ]

    def pole(self, body: str) -> tuple[str, Array]:
        """Return the point about which moments are taken: the link's first joint, its letter."""
        joints = [self.scene.mechanism.joints[name] for name in self.joints(body)]
        joints.sort(key=lambda joint: not joint.coincide)
        for joint in joints:
            mine = joint.second if joint.second_body == body else joint.first
            return self.subject.letter(mine), self.subject.scene.place(mine, self.pose)
        reference = self.scene.points(body)[0]
        return self.subject.letter(reference), self.scene.place(reference, self.pose)

    def acting(self, body: str) -> list[SpatialActing]:
        """Return the forces on a link that do not vanish, with moments about its pole."""
        _, pole = self.pole(body)
        still = NOTHING * self.size
        reach = self.scene.mechanism.scale
        every = (*self._reactions(body, pole), *self._given(body, pole), *self._inertia(body, pole))
        return [
            own
            for own in every
            if float(np.linalg.norm(own.force)) > still
            or float(np.linalg.norm(own.moment)) > still * reach
        ]

    def reaction(self, name: str, body: str) -> Array:
        """Return force and moment (6,) of a joint on one of its bodies, about the second point."""
        joint = self.scene.mechanism.joints[name]
        row = np.asarray(self.subject.result.joints[name].reaction[self.pose], dtype=float)
        return row if joint.second_body == body else -row

    def _reactions(self, body: str, pole: Array) -> Iterator[SpatialActing]:
        subject = self.subject
        for name in self.joints(body):
            joint = self.scene.mechanism.joints[name]
            row = self.reaction(name, body)
            other = joint.first_body if joint.second_body == body else joint.second_body
            ends = [str(subject.numbers[own]) for own in (other, body)]
            index = ("," if max(map(len, ends)) > 1 else "").join(ends)
            place, at = self.scene.place(joint.second, self.pose), subject.letter(joint.second)
            moment = row[3:] + np.cross(place - pole, row[:3])
            at = at if at == name else f"{at} ({name})"
            yield SpatialActing(Letter("R", (index,), vector=True), at, row[:3], moment)

    def _given(self, body: str, pole: Array) -> Iterator[SpatialActing]:
        """Yield weights, loads, and the efforts of drivers."""
        subject, mark = self.subject, str(self.subject.numbers[body])
        for load, wrenches in subject.result.loads.items():
            if body in wrenches:
                row = np.asarray(wrenches[body][self.pose], dtype=float)
                weight = load == "gravity"
                letter = Letter("G" if weight else "P", (mark,), "" if weight else load, True)
                moment = row[3:] + np.cross(self.base(body) - pole, row[:3])
                where = subject.say("centre") if weight else load
                yield SpatialActing(letter, where, row[:3], moment)
        for text, effort in subject.result.efforts.items():
            entry = coordinate(self.scene.mechanism, text)
            found = self._effort(entry, body, float(effort[self.pose]))
            if found is not None:
                row, place = found
                moment = row[3:] + np.cross(place - pole, row[:3])
                letter = Letter("F" if entry.unit == "m" else "M", (mark,), vector=True)
                yield SpatialActing(letter, text, row[:3], moment)

    def base(self, body: str) -> Array:
        """Return the point that load wrenches refer to: the body's origin, of a bar its end."""
        if self.subject.turn(body) is not None:
            origin: Array = self.scene.origin(body)[self.pose]
            return origin
        balls = [
            joint.second if joint.second_body == body else joint.first
            for joint in self.scene.mechanism.joints.values()
            if body in joint.bodies and joint.ball
        ]
        return self.scene.place((balls or self.scene.points(body))[0], self.pose)

    def _effort(
        self, entry: NamedCoordinate, body: str, effort: float
    ) -> tuple[Array, Array] | None:
        """Return force and moment (6,) of a driver on a body, and where it acts."""
        nothing = np.zeros(3)
        joint = self.scene.mechanism.joints.get(entry.part)
        if joint is None:
            if entry.part != body:
                return None
            place = self.scene.place(f"{body}.{entry.point}", self.pose)
            return np.concatenate([effort * np.eye(3)[entry.axis], nothing]), place
        sign = (joint.second_body == body) - (joint.first_body == body)
        axis = self.subject.axis(joint, second=entry.word == "angle2")
        if entry.word in ("x", "y"):
            frame = self.scene.frame(joint, self.pose)
            axis = None if frame is None else frame["xy".index(entry.word)]
        if not sign or axis is None:
            return None
        push, twist = (nothing, axis) if entry.is_angle else (axis, nothing)
        row: Array = sign * effort * np.concatenate([push, twist])
        return row, self.scene.place(joint.second, self.pose)

    # -- inertia ---------------------------------------------------------------------------

    def mass(self, body: str) -> float:
        return self.numbers.get(f"{body}.mass", 0.0)

    def balanced(self, body: str) -> bool:
        """Return whether the sum of forces can be written: a bar that spins freely has no mass."""
        known = self.subject.spin(body, "acceleration") is not None
        tensor = self._tensor(body)
        return known or (not self.mass(body) and tensor is None)

    def centre(self, body: str) -> Array:
        """Return the place of the centre of mass."""
        turn = self.subject.turn(body)
        assert turn is not None
        local = np.array([self.numbers.get(f"{body}.center.{axis}", 0.0) for axis in AXES])
        place: Array = self.scene.origin(body)[self.pose] + turn @ local
        return place

    def rate_at(self, body: str, place: Array, word: str) -> Array | None:
        """Return velocity or acceleration of the point of a body at a place."""
        spin, gain = self.subject.spin(body), self.subject.spin(body, word)
        for reference in self.scene.points(body):
            known = self.subject.rate(reference, word)
            if known is not None and spin is not None and gain is not None:
                arm = place - self.scene.place(reference, self.pose)
                if word == "velocity":
                    return np.asarray(known + np.cross(spin, arm))
                bent = np.cross(spin, np.cross(spin, arm))
                return np.asarray(known + np.cross(gain, arm) + bent)
        return None

    def _tensor(self, body: str) -> Array | None:
        """Return the tensor of inertia (3, 3) about the centre in the body's axes."""
        names = [f"{body}.inertia.{word}" for word in ("xx", "yy", "zz", "xy", "xz", "yz")]
        if names[0] not in self.numbers:
            return None
        xx, yy, zz, xy, xz, yz = (self.numbers.get(name, 0.0) for name in names)
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    def inertia(self, body: str) -> tuple[Array, Array]:
        """Return force and couple of inertia; nothing where the result has no accelerations."""
        force, couple = np.zeros(3), np.zeros(3)
        spin, gain = self.subject.spin(body), self.subject.spin(body, "acceleration")
        if spin is None or gain is None or self.subject.result.definition.quasi_static:
            return force, couple
        if self.mass(body):
            found = self.rate_at(body, self.centre(body), "acceleration")
            force = force if found is None else -self.mass(body) * found
        tensor, turn = self._tensor(body), self.subject.turn(body)
        if tensor is not None and turn is not None:
            world = turn @ tensor @ turn.T
            couple = -(world @ gain + np.cross(spin, world @ spin))
        return force, couple

    def _inertia(self, body: str, pole: Array) -> Iterator[SpatialActing]:
        mark = str(self.subject.numbers[body])
        force, couple = self.inertia(body)
        if force.any():
            moment = np.cross(self.centre(body) - pole, force)
            letter = Letter("Φ", (mark,), vector=True)
            yield SpatialActing(letter, self.subject.say("centre"), force, moment)
        if couple.any():
            letter = Letter("M", (mark,), "Φ", vector=True)
            yield SpatialActing(letter, self.subject.say("couple"), np.zeros(3), couple)


def spatial_forces_section(
    subject: SpatialSubject, balance: SpatialBalance, name: str, bodies: tuple[str, ...]
) -> Section:
    """Return the equilibrium of each link of a group, and its reactions."""
    links = tuple(_link(subject, balance, body) for body in reversed(bodies))
    return Section(subject.say("forces of", name), (), links)


def _link(subject: SpatialSubject, balance: SpatialBalance, body: str) -> Section:
    say = subject.say
    title, lost = say("link", subject.numbers[body], body), balance.not_unique(body)
    if lost or not balance.balanced(body):
        text = say("not unique", ", ".join(lost)) if lost else say("spins freely")
        return Section(title, (Note((text,)), *_sizes(subject, balance, body)))
    acting = balance.acting(body)
    if not acting:
        return Section(title, (Note((say("unloaded"),)),))
    forces = [own for own in acting if np.any(own.force)]
    blocks: list[Passage] = [Note((say("in sum"),))]
    if forces:
        total = np.sum([own.force for own in forces], axis=0)
        shown = columns((0.0, 0.0, 0.0), *(tuple(own.force) for own in forces), unit="N")
        blocks.append(Formula(Equation((Sum(tuple(own.letter for own in forces)), Number("0")))))
        gap = float(np.linalg.norm(total))
        blocks.append(Formula(Equation((Sum(shown[1:]), shown[0])), gap, "N"))
    blocks.append(Note((say("moments about", balance.pole(body)[0]),)))
    blocks.append(_table(subject, balance, acting))
    blocks += _sizes(subject, balance, body)
    return Section(title, tuple(blocks))


def _table(subject: SpatialSubject, balance: SpatialBalance, acting: list[SpatialActing]) -> Grid:
    """Return the table of forces and moments with their sums."""
    say = subject.say
    table = np.array([own.row for own in acting])
    total = table.sum(axis=0)
    still = NOTHING * balance.size * np.repeat([1.0, subject.scene.mechanism.scale], 3)
    table[np.abs(table) <= still] = 0.0
    total[np.abs(total) <= 1e3 * still] = 0.0
    styles = [decimals(*table[:, :3].ravel())] * 3 + [decimals(*table[:, 3:].ravel())] * 3

    def cells(row: Array) -> tuple[Part, ...]:
        pairs = zip(row, styles, strict=True)
        return tuple(Number(rounded(float(value), *own), own[1]) for value, own in pairs)

    rows: list[tuple[str | Part, ...]] = [
        (own.letter, own.at, *cells(row)) for own, row in zip(acting, table, strict=True)
    ]
    rows.append((say("sum"), "", *cells(total)))
    forces = tuple(f"F {axis}, {say.unit('N')}" for axis in AXES)
    moments = tuple(f"M {axis}, {say.unit('N m')}" for axis in AXES)
    heads = (say("acts"), say("at"), *forces, *moments)
    return Grid(heads, tuple(rows))


def _sizes(subject: SpatialSubject, balance: SpatialBalance, body: str) -> Iterator[Passage]:
    """Yield sizes of the reactions in which the link is the second body, and what they lose."""
    rows = []
    for joint in subject.scene.mechanism.joints.values():
        series = subject.result.joints.get(joint.name) or {}
        if joint.second_body != body or "reaction" not in series:
            continue
        row = balance.reaction(joint.name, body)
        if not np.isfinite(row).all():
            continue
        force, moment = (float(np.linalg.norm(own)) for own in (row[:3], row[3:]))
        text = subject.say("reaction in space", "\0", "\0", subject.title(body))
        parts = spliced(text, number(force, "N"), number(moment, "N m"))
        loss = subject.value(series, "loss")
        if np.isfinite(loss) and loss:
            parts += spliced(subject.say("other friction", "\0"), number(loss, "W"))
        rows.append((subject.say("reaction", joint.name), tuple(parts)))
    if rows:
        yield Note((subject.say("reactions"),))
        yield Facts(tuple(rows))


def spatial_power_section(subject: SpatialSubject, balance: SpatialBalance) -> Section | None:
    """Return the balance of powers, which no reaction is in; None without speeds."""
    result, pose = subject.result, subject.pose
    bodies = [body for body in subject.scene.mechanism.bodies if subject.scene.shown(body, pose)]
    loads = inertia = 0.0
    for body in bodies:
        spin, place = subject.spin(body), balance.base(body)
        rows = [own[body][pose] for own in result.loads.values() if body in own]
        if not rows and not balance.mass(body):
            continue
        speed = balance.rate_at(body, place, "velocity")
        if speed is None or spin is None or not balance.balanced(body):
            return None
        loads += sum(float(row[:3] @ speed + row[3:] @ spin) for row in rows)
        force, couple = balance.inertia(body)
        central = balance.rate_at(body, balance.centre(body), "velocity")
        inertia += float(couple @ spin) + (0.0 if central is None else float(force @ central))
    drive = sum(
        float(effort[pose]) * float(result.drivers[text].velocity[pose])
        for text, effort in result.efforts.items()
    )
    return sum_of_powers(subject, drive, loads, inertia)
