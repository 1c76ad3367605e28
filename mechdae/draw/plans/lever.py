"""Zhukovsky's lever: the velocity plan turned by a right angle as a lever about its pole.

Every force is put, as it is, at the end of the turned velocity of the point it acts at; its
moment about the pole is then its power, and all moments together vanish. A couple is two
forces at the images of two points of its link, so is the balancing torque of the driver. The
plan is turned clockwise, so that counter-clockwise moments are positive powers.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechdae.describe.coordinates import coordinate
from mechdae.describe.mechanism import GROUND
from mechdae.draw.plans.forces import Balance
from mechdae.draw.plans.motion import STILL, motion_plan
from mechdae.draw.plans.vectors import Arrow, End, Plan
from mechdae.draw.scene import Array, Scene

ZERO = np.zeros(2)


@dataclass(frozen=True)
class Applied:
    """A force [N] at the end of a turned velocity [m/s]."""

    gid: str
    kind: str
    place: Array
    force: Array
    text: str

    @property
    def power(self) -> float:
        """Moment about the pole [W]."""
        return float(self.place[0] * self.force[1] - self.place[1] * self.force[0])


@dataclass(frozen=True)
class Lever:
    """The turned velocity plan and the forces on it; ``lost`` is the power of friction [W]."""

    plan: Plan
    forces: tuple[Applied, ...]
    lost: float

    @property
    def rest(self) -> float:
        """What the moments about the pole leave, friction's power taken off [W]."""
        return sum(entry.power for entry in self.forces) - self.lost


def turned(vector: Array) -> Array:
    """Return a vector turned clockwise by a right angle."""
    return np.array([vector[1], -vector[0]])


def lever(result: Any, scene: Scene, pose: int) -> Lever:
    """Return Zhukovsky's lever of one pose."""
    plan = motion_plan(result, scene, pose, "velocity")
    arrows = tuple(
        Arrow(entry.gid.replace("velocity", "lever"), entry.kind, turned(entry.start), turned(entry.end))
        for entry in plan.arrows
    )
    ends = tuple(End(e.gid.replace("velocity", "lever"), e.text, turned(e.place)) for e in plan.ends)
    sides = tuple((turned(a), turned(b)) for a, b in plan.sides)
    whole = Plan("lever", "Zhukovsky's lever", "v", "m/s", arrows, ends, sides, gap=plan.gap)
    balance = Balance(result, scene, pose)
    forces = [entry for body in scene.mechanism.bodies for entry in _on(balance, body)]
    forces += _driving(balance)
    names = ("loss",)
    lost = sum(
        float(series[name][pose])
        for series in result.joints.values()
        for name in names
        if name in series and np.isfinite(series[name][pose])
    )
    if getattr(result.definition, "friction", "") == "article":
        lost = 0.0
    return Lever(whole, tuple(forces), lost)


def _on(balance: Balance, body: str) -> Iterator[Applied]:
    """Yield loads, weight and inertia of a body as forces on the lever."""
    if not balance.rates.has(body, "acceleration"):
        return
    mark = balance.numbers[body]
    centre = balance.centre(body)
    spin, turn = balance.rates.spins[body]
    place = turned(balance.rates.at(body, centre, "velocity"))
    rows = [
        ("weight", place, balance.weight(body), rf"\mathbf{{G}}_{{{mark}}}"),
        ("inertia", place, balance.inertia(body), rf"\mathbf{{\Phi}}_{{{mark}}}"),
    ]
    moment = -balance.scene.numbers.get(f"{body}.inertia", 0.0) * turn
    if balance.scene.numbers.get(f"{body}.mass", 0.0) or moment:
        yield from _couple(balance, body, "couple", moment, rf"\mathbf{{M}}_{{{mark}}}", "inertia")
    force, left = balance.load(body)
    at = _acting(balance, body, force, left)
    if body in balance.loaded:
        load = turned(balance.rates.at(body, at, "velocity"))
        rows.append(("load", load, force, rf"\mathbf{{P}}_{{{mark}}}"))
    arm = at - balance.scene.origins[body][balance.pose]
    left -= float(arm[0] * force[1] - arm[1] * force[0])
    if body in balance.turned:
        yield from _couple(balance, body, "torque", left, rf"\mathbf{{T}}_{{{mark}}}", "load")
    for kind, place, force, text in rows:
        if float(np.hypot(*force)) > 0 and np.isfinite(force).all():
            yield Applied(f"lever-{kind}-{body}", kind, place, force, text)


def _acting(balance: Balance, body: str, force: Array, moment: float) -> Array:
    """Return the point of a body nearest to its origin that its load acts through."""
    origin = np.array(balance.scene.origins[body][balance.pose])
    size = float(force @ force)
    if not size or body in balance.turned:
        return origin
    foot: Array = origin + np.array([force[1], -force[0]]) * moment / size
    return foot


def _couple(
    balance: Balance, body: str, word: str, moment: float, text: str, kind: str
) -> Iterator[Applied]:
    """Yield two forces at the images of two points of a body that stand for a couple."""
    spin = balance.rates.spins[body][0]
    points = [f"{body}.{name}" for name in balance.scene.mechanism.bodies[body].points]
    if not moment or not spin or not np.isfinite(moment):
        return
    first = balance.rates.place(points[0])
    second = max(
        (balance.rates.place(entry) for entry in points),
        key=lambda place: round(float(np.hypot(*(place - first))), 12),
    )
    arm = second - first
    if not arm.any():  # any two points of the link will do
        arm = np.array([balance.length, 0.0])
        second = first + arm
    force = moment * np.array([-arm[1], arm[0]]) / float(arm @ arm)
    for number, (place, sign) in enumerate(((first, -1.0), (second, 1.0)), start=1):
        image = turned(balance.rates.at(body, place, "velocity"))
        yield Applied(f"lever-{word}-{body}-{number}", kind, image, sign * force, text)


def _driving(balance: Balance) -> Iterator[Applied]:
    """Yield the balancing forces of the drivers."""
    mechanism = balance.scene.mechanism
    for text, effort in balance.result.efforts.items():
        entry = coordinate(mechanism, text)
        size = float(effort[balance.pose])
        if entry.is_angle:
            joint = mechanism.joints.get(entry.part)
            sides = [(entry.part, 1.0)]
            if joint is not None:
                sides = [(joint.second_body, 1.0), (joint.first_body, -1.0)]
            for body, sign in sides:
                if body != GROUND:
                    name = rf"\mathbf{{F}}_{{b{balance.numbers[body]}}}"
                    yield from _couple(balance, body, "drive", sign * size, name, "drive")
            continue
        for body in mechanism.bodies:
            force = balance.drive(body)
            if float(np.hypot(*force)) > 0:
                joint = mechanism.joints.get(entry.part)
                at = f"{entry.part}.{entry.point}" if joint is None else joint.second
                place = turned(balance.rates.at(body, balance.rates.place(at), "velocity"))
                name = rf"\mathbf{{F}}_{{b{balance.numbers[body]}}}"
                yield Applied(f"lever-drive-{body}", "drive", place, force, name)
