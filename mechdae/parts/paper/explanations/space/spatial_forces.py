"""What acts on the links of a mechanism in space.

The force of inertia is -m a of the centre of mass, its couple -(J e + w x J w) with the tensor J
about it (Newton and Euler), of accelerations of the result.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from mechdae.describe import Joint, coordinate
from mechdae.describe.coordinates import NamedCoordinate
from mechdae.draw.formulas.tree import Letter, Note, Part, number
from mechdae.parts.paper.explanations.forces import ActingForce, BalanceOfLinks, spliced
from mechdae.parts.paper.explanations.space.spatial_group import SpatialSubject
from mechdae.types import Floats

if TYPE_CHECKING:
    from mechdae.draw.space.spatial_scene import SpatialScene


class SpatialBalance(BalanceOfLinks):
    """What acts on the links of one pose: forces and moments (3,)."""

    subject: SpatialSubject
    axes = "xyz"

    def __init__(self, subject: SpatialSubject) -> None:
        super().__init__(subject)
        self.scene: SpatialScene = subject.scene
        self.numbers: Mapping[str, float] = subject.scene.numbers

    def moment(self, arm: Floats, force: Floats) -> Floats:
        return np.cross(arm, force)

    def pole(self, body: str) -> tuple[str, Floats]:
        for joint in sorted(self.joints(body), key=lambda joint: not joint.coincide):
            near, _ = joint.ends_at(body)
            return self.subject.letter(near), self.subject.place(near)
        reference = self.scene.points(body)[0]
        return self.subject.letter(reference), self.subject.place(reference)

    def driven(self, body: str, pole: Floats) -> Iterator[ActingForce]:
        for text, effort in self.subject.result.efforts.items():
            entry = coordinate(self.mechanism, text)
            found = self._effort(entry, body, float(effort[self.pose]))
            if found is not None:
                mark = str(self.subject.numbers[body])
                letter = Letter("F" if entry.unit == "m" else "M", (mark,), vector=True)
                yield self.wrench(letter, text, *found, pole)

    def moment_heads(self, body: str) -> tuple[str, ...]:
        return tuple(f"M {axis}" for axis in self.axes)

    def table_notes(self, body: str) -> tuple[Note, ...]:
        return (Note((self.subject.say("moments about", self.pole(body)[0]),)),)

    def sizes(self, joint: Joint, row: Floats, series: Mapping[str, Floats]) -> list[str | Part]:
        subject = self.subject
        force, moment = (float(np.linalg.norm(part)) for part in (row[:3], row[3:]))
        text = subject.say("reaction in space", "\0", "\0", subject.title(joint.second_body))
        words = spliced(text, number(force, "N"), number(moment, "N m"))
        loss = subject.value(series, "loss")
        if np.isfinite(loss) and loss:
            words += spliced(subject.say("other friction", "\0"), number(loss, "W"))
        return words

    def base(self, body: str) -> Floats:
        if self.subject.turn(body) is not None:
            origin: Floats = self.scene.origin(body)[self.pose]
            return origin
        balls = [
            joint.ends_at(body)[0]
            for joint in self.mechanism.joints.values()
            if body in joint.bodies and joint.ball
        ]
        return self.scene.place((balls or self.scene.points(body))[0], self.pose)

    def _effort(
        self, entry: NamedCoordinate, body: str, effort: float
    ) -> tuple[Floats, Floats] | None:
        """Return force and moment (6,) of a driver on a body, and where it acts."""
        nothing = np.zeros(3)
        joint = self.mechanism.joints.get(entry.part)
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
        row: Floats = sign * effort * np.concatenate([push, twist])
        return row, self.scene.place(joint.second, self.pose)

    def mass(self, body: str) -> float:
        return self.numbers.get(f"{body}.mass", 0.0)

    def balanced(self, body: str) -> bool:
        known = self.subject.spin(body, "acceleration") is not None
        tensor = self._tensor(body)
        return known or (not self.mass(body) and tensor is None)

    def centre(self, body: str) -> Floats:
        turn = self.subject.turn(body)
        assert turn is not None
        local = np.array([self.numbers.get(f"{body}.center.{axis}", 0.0) for axis in self.axes])
        place: Floats = self.scene.origin(body)[self.pose] + turn @ local
        return place

    def rate_at(self, body: str, place: Floats, word: str) -> Floats | None:
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

    def _tensor(self, body: str) -> Floats | None:
        """Return the tensor of inertia (3, 3) about the centre in the body's axes."""
        names = [f"{body}.inertia.{word}" for word in ("xx", "yy", "zz", "xy", "xz", "yz")]
        if names[0] not in self.numbers:
            return None
        xx, yy, zz, xy, xz, yz = (self.numbers.get(name, 0.0) for name in names)
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    def inertia(self, body: str) -> tuple[Floats, Floats]:
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

    def powers(self) -> tuple[float, float] | None:
        result, pose = self.subject.result, self.pose
        loads = inertia = 0.0
        for body in self.mechanism.bodies:
            rows = [wrenches[body][pose] for wrenches in result.loads.values() if body in wrenches]
            if not self.scene.shown(body, pose) or (not rows and not self.mass(body)):
                continue
            spin, speed = self.subject.spin(body), self.rate_at(body, self.base(body), "velocity")
            if speed is None or spin is None or not self.balanced(body):
                return None
            loads += sum(float(row[:3] @ speed + row[3:] @ spin) for row in rows)
            force, couple = self.inertia(body)
            central = self.rate_at(body, self.centre(body), "velocity")
            inertia += float(couple @ spin) + (0.0 if central is None else float(force @ central))
        return loads, inertia
