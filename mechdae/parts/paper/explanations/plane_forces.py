"""What acts on the links of a mechanism of the plane."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import degrees

import numpy as np

from mechdae.describe import Joint
from mechdae.draw.formulas import Letter, Part, number
from mechdae.draw.plans.forces import BodyForces
from mechdae.parts.paper.explanations.forces import ActingForce, BalanceOfLinks, spliced
from mechdae.parts.paper.explanations.subject import Subject
from mechdae.types import Floats


class PlaneBalance(BalanceOfLinks):
    """What acts on the links of one pose: forces (2,), moments (1,)."""

    axes = "xy"

    def __init__(self, subject: Subject) -> None:
        super().__init__(subject)
        self.scene = subject.scene
        self.forces = BodyForces(subject.result, subject.scene, subject.pose)

    def moment(self, arm: Floats, force: Floats) -> Floats:
        """Return the moment of a force at the end of an arm."""
        return np.array([arm[0] * force[1] - arm[1] * force[0]])

    def pole(self, body: str) -> tuple[str, Floats]:
        """Return the link's first joint, a pin if there is one, and its letter."""
        for joint in sorted(self.joints(body), key=lambda joint: not joint.coincide):
            return self.subject.letter(joint.second), self.subject.place(joint.second)
        return "O", self.base(body)

    def base(self, body: str) -> Floats:
        """Return the body's origin."""
        origin: Floats = self.scene.origins[body][self.pose]
        return origin

    def driven(self, body: str, pole: Floats) -> Iterator[ActingForce]:
        """Yield the forces of drivers along lines."""
        for text, place, force in self.forces.pushes(body):
            letter = Letter("F", (str(self.subject.numbers[body]),), vector=True)
            yield ActingForce(letter, text, force, self.moment(place - pole, force))

    def centre(self, body: str) -> Floats:
        """Return the place of the centre of mass."""
        return self.forces.centre(body)

    def inertia(self, body: str) -> tuple[Floats, Floats]:
        """Return force and couple of inertia."""
        return self.forces.inertia(body), np.array([self.forces.couple(body)])

    def _inertia(self, body: str, pole: Floats) -> Iterator[ActingForce]:
        """Yield forces of inertia, then the torques of drivers."""
        yield from super()._inertia(body, pole)
        for text, torque in self.forces.twists(body).items():
            letter = Letter("M", (str(self.subject.numbers[body]),))
            yield ActingForce(letter, text, np.zeros(2), np.array([torque]))

    def place_of_load(self, load: str, body: str) -> str:
        """Return the letter of the point that a load acts at, or that it is a couple."""
        value = self.mechanism.loads[load]
        for reference in (getattr(value, "point", None), *(getattr(value, "between", None) or ())):
            if reference and reference.split(".")[0] == body:
                return self.subject.letter(reference)
        return self.subject.say("couple") if getattr(value, "body", None) == body else load

    def moment_heads(self, body: str) -> tuple[str, ...]:
        """Return the head of the moment."""
        return (self.subject.say("moment about", self.pole(body)[0]),)

    def sizes(self, joint: Joint, row: Floats, series: Mapping[str, Floats]) -> list[str | Part]:
        """Return size and direction of a reaction, and the friction in its joint."""
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
        """Return the powers of loads and of inertia; None without speeds."""
        rates, pose, scene = self.forces.rates, self.pose, self.scene
        bodies = [body for body in self.mechanism.bodies if scene.shown(body, pose)]
        if any(not rates.has(body, "acceleration") for body in bodies):
            return None

        def power(body: str, place: Floats, force: Floats, couple: float) -> float:
            return float(force @ rates.at(body, place, "velocity")) + couple * rates.spins[body][0]

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
