"""Force polygons, one for each Assur group, in the reverse of the order of kinematics.

The forces on the links of a group are loads, weights, forces of inertia, reactions of the joints
that connect it with the rest, and the force of a driver along a line. Reactions and efforts are
those of the result; weights and forces of inertia are masses times gravity and times
accelerations of the result. The load on a link is what its balance leaves, which the result's
check of the balance has gone over; the forces on a link without load have to close by themselves.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from mechdae.describe.coordinates import NamedCoordinate, coordinate
from mechdae.describe.loads import Force, Resistance, Spring, TableLoad, Torque
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.draw.diagram.places import numbers_of
from mechdae.draw.diagram.scene import DrawnScene
from mechdae.draw.plans.board import Arrow, Plan
from mechdae.draw.plans.rates import Rates
from mechdae.draw.plans.relations import STILL, groups_of
from mechdae.draw.primitives import Array
from mechdae.results.kinds import ReactionsResult

ZERO = np.zeros(2)


class BodyForces:
    """The forces on the bodies in one pose of a result of kind reactions."""

    def __init__(self, result: ReactionsResult, scene: DrawnScene, pose: int) -> None:
        self.result, self.scene, self.pose = result, scene, pose
        self.rates: Rates = Rates(result, scene, pose)
        self.slow: bool = bool(getattr(result.definition, "quasi_static", False))
        self.numbers: dict[str, int] = {**numbers_of(scene.mechanism), GROUND: 0}
        self.loaded, self.turned = loaded_bodies(scene.mechanism)

    def reaction(self, joint: str, body: str) -> Array:
        """Return the force of a joint on one of its two bodies."""
        entry = self.scene.mechanism.joints[joint]
        series = self.result.joints.get(joint) or {}
        if "reaction" not in series:
            return ZERO
        force = np.array(series["reaction"][self.pose][:2], dtype=float)
        return force if entry.second_body == body else -force

    def joints(self, body: str) -> list[str]:
        """Return the joints whose reaction acts on a body."""
        return [
            joint.name
            for joint in self.scene.mechanism.joints.values()
            if body in (joint.first_body, joint.second_body)
            and "reaction" in (self.result.joints.get(joint.name) or {})
        ]

    def weight(self, body: str) -> Array:
        values = self.scene.numbers
        if self.scene.mechanism.gravity is None:
            return ZERO
        gravity = np.array([values[f"gravity.{axis}"] for axis in "xy"])
        return values.get(f"{body}.mass", 0.0) * gravity

    def inertia(self, body: str) -> Array:
        """Return the force of inertia: mass times the acceleration of its centre, reversed."""
        values = self.scene.numbers
        mass = values.get(f"{body}.mass", 0.0)
        if self.slow or not mass or not self.rates.has(body, "acceleration"):
            return ZERO
        return -mass * self.rates.at(body, self.centre(body), "acceleration")

    def centre(self, body: str) -> Array:
        """Return the place of the centre of mass."""
        x, y = (self.scene.numbers.get(f"{body}.center.{axis}", 0.0) for axis in "xy")
        return self.scene.carried(body, np.array([x, y]), self.pose)

    def efforts(self, body: str) -> Iterator[tuple[NamedCoordinate, float]]:
        """Yield the coordinates of drivers that act on a body, and their efforts on it."""
        for text, effort in self.result.efforts.items():
            entry = coordinate(self.scene.mechanism, text)
            joint = self.scene.mechanism.joints.get(entry.part)
            sign = int(entry.part == body)
            if joint is not None:
                sign = (joint.second_body == body) - (joint.first_body == body)
            if sign:
                yield entry, sign * float(effort[self.pose])

    def pushes(self, body: str) -> Iterator[tuple[str, Array, Array]]:
        """Yield driver, place and force of the drivers along lines on a body."""
        for entry, force in self.efforts(body):
            joint = self.scene.mechanism.joints.get(entry.part)
            if entry.unit == "m" and joint is not None:
                axis = self.scene.axis(joint, self.pose)
                yield entry.text, self.rates.place(joint.second), force * axis
            elif entry.unit == "m":
                place = self.rates.place(f"{body}.{entry.point}")
                yield entry.text, place, force * np.eye(2)[entry.axis]

    def drive(self, body: str) -> Array:
        """Return the force of the drivers along lines on a body."""
        return sum((force for *_, force in self.pushes(body)), np.zeros(2))

    def rest(self, body: str) -> Array:
        """Return what the other forces on a body leave: its loads, or nothing."""
        parts = [self.reaction(joint, body) for joint in self.joints(body)]
        parts += [self.weight(body), self.inertia(body), self.drive(body)]
        left: Array = -np.sum(parts, axis=0)
        return left

    def load(self, body: str) -> tuple[Array, float]:
        """Return force and moment about the body's origin of the loads on a body."""
        origin = self.scene.origins[body][self.pose]

        def moment(place: Array, force: Array) -> float:
            arm = place - origin
            return float(arm[0] * force[1] - arm[1] * force[0])

        total = 0.0
        for name in self.joints(body):
            joint = self.scene.mechanism.joints[name]
            torque = float(self.result.joints[name].reaction[self.pose][2])
            total += torque if joint.second_body == body else -torque
            total += moment(self.rates.place(joint.second), self.reaction(name, body))
        centre = self.centre(body)
        total += moment(centre, self.weight(body) + self.inertia(body)) + self.couple(body)
        total += sum(moment(place, force) for _, place, force in self.pushes(body))
        total += sum(self.twists(body).values())
        return self.rest(body), -total

    def couple(self, body: str) -> float:
        """Return the couple of inertia of a body."""
        inertia = self.scene.numbers.get(f"{body}.inertia", 0.0)
        return -inertia * self.rates.spins[body][1] if inertia and not self.slow else 0.0

    def twists(self, body: str) -> dict[str, float]:
        """Return the torques of the drivers on a body."""
        return {entry.text: effort for entry, effort in self.efforts(body) if entry.is_angle}

    def parts(self, body: str, inside: tuple[str, ...]) -> Iterator[tuple[str, str, Array, str]]:
        """Yield kind, name, force and mathtext of what acts on a body from outside its group."""
        load = self.rest(body) if body in self.loaded else ZERO
        forces = {"load": load, "drive": self.drive(body), "weight": self.weight(body)}
        forces["inertia"] = self.inertia(body)
        for (kind, force), name in zip(forces.items(), ("P", "F", "G", r"\Phi"), strict=True):
            if kind != "load" or body in self.loaded:
                yield kind, kind, force, rf"\mathbf{{{name}}}_{{{self.numbers[body]}}}"
        for joint in self.joints(body):
            other = self.other(joint, body)
            if other not in inside:
                yield "reaction", joint, self.reaction(joint, body), self.name(joint, body)

    def other(self, joint: str, body: str) -> str:
        entry = self.scene.mechanism.joints[joint]
        return entry.second_body if entry.first_body == body else entry.first_body

    def name(self, joint: str, body: str) -> str:
        """Return the mathtext of the action of a joint on a body: ``R_12``, of 1 on 2."""
        first, second = self.numbers[self.other(joint, body)], self.numbers[body]
        gap = r"\,," if max(first, second) > 9 else ""
        return rf"\mathbf{{R}}_{{{first}{gap}{second}}}"


def loaded_bodies(mechanism: Mechanism) -> tuple[set[str], set[str]]:
    """Return the bodies on which loads have a resultant force, and those with a torque."""
    forces: set[str] = set()
    torques: set[str] = set()
    for load in mechanism.loads.values():
        if isinstance(load, Force):
            forces.add(load.point.split(".")[0])
        elif isinstance(load, Torque):
            torques.add(load.body)
        elif isinstance(load, Spring) and load.between is not None:
            forces |= {entry.split(".")[0] for entry in load.between}
        elif isinstance(load, TableLoad) and load.body is not None:
            torques.add(load.body)
        elif isinstance(load, TableLoad | Resistance | Spring):
            text = load.along if isinstance(load, TableLoad) else load.coordinate
            entry = coordinate(mechanism, str(text))
            joint = mechanism.joints.get(entry.part)
            bodies = {entry.part} if joint is None else {joint.first_body, joint.second_body}
            if entry.is_angle:
                torques |= bodies
            else:
                forces |= bodies
    return forces - {GROUND}, torques - {GROUND}


def force_plans(result: Any, scene: DrawnScene, pose: int) -> list[Plan]:
    """Return the force polygon of each group in one pose, the last group first."""
    balance = BodyForces(result, scene, pose)
    groups = groups_of(result, scene)
    plans = [_polygon(balance, k, name, bodies) for k, (name, bodies) in enumerate(groups)]
    return plans[::-1]


def _polygon(balance: BodyForces, index: int, group: str, bodies: tuple[str, ...]) -> Plan:
    word, title = f"force-{index}", f"Forces on {group}" if group else "Forces"
    ordered = sorted(bodies, key=lambda body: body not in balance.loaded)
    rows = [(body, *part) for body in ordered for part in balance.parts(body, bodies)]
    if not all(np.isfinite(row[3]).all() for row in rows):
        return Plan(word, title, "F", "N", note="its reactions are not unique")
    size = max((float(np.hypot(*force)) for _, _, _, force, _ in rows), default=0.0)
    here, corners = ZERO, dict[str, Array]()
    arrows: list[Arrow] = []
    for body, kind, name, force, text in rows:
        corners.setdefault(body, here)
        if float(np.hypot(*force)) > STILL * size:
            arrows.append(Arrow(f"{word}-{body}-{name}", kind, here, here + force, text))
            here = here + force
    relation = " + ".join(arrow.text for arrow in arrows)
    relations = ((group, (f"{relation} = 0",)),) if arrows else ()
    gap = float(np.hypot(*here))
    for arrow in _inner(balance, word, bodies, corners, size):
        gap = max(gap, float(np.hypot(*(arrow.end - corners[ordered[1]]))))
        arrows.append(arrow)
    return Plan(word, title, "F", "N", tuple(arrows), relations=relations, gap=gap)


def _inner(
    balance: BodyForces, word: str, bodies: tuple[str, ...], corners: dict[str, Array], size: float
) -> Iterator[Arrow]:
    """Yield the inner reaction of a dyad: it closes the forces of either link."""
    joints = balance.scene.mechanism.joints.values()
    between = [j.name for j in joints if set(bodies) == {j.first_body, j.second_body}]
    between = [name for name in between if name in balance.joints(bodies[0])]
    if len(bodies) != 2 or len(between) != 1 or len(corners) != 2:
        return
    second = list(corners)[1]
    force = balance.reaction(between[0], second)
    # the forces on the first link lead from the start to the corner: it hands them on
    if np.isfinite(force).all() and float(np.hypot(*force)) > STILL * size:
        text = balance.name(between[0], second)
        yield Arrow(f"{word}-{second}-{between[0]}", "inner", ZERO, force, text)
