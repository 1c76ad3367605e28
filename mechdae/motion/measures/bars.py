"""Transmission angles in space: between a bar and the way of the point that it drives.

A bar between two ball joints carries a force along its line. It drives a link that a hinge, a guide
or a screw holds: the force and the velocity of the ball's centre enclose the pressure angle, and
the transmission angle is what it lacks of a right angle. For a rocker it is the angle between the
bar and the plane through the ball's centre and the rocker's axis; its sine is the transmission
index, the virtual coefficient of both screws over its largest value for a force at that centre
(Sutherland and Roth 1973).
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.mechanism import GROUND
from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene
from mechdae.motion.measures.along_sweep_extremes import AT_REST
from mechdae.motion.measures.track import Sample, Track
from mechdae.motion.measures.transmission import PREFIX, angles_of, summary_of
from mechdae.motion.setup.outputs import Outputs, Request
from mechdae.records import dataclass
from mechdae.types import Floats, Sym


@dataclass(frozen=True)
class DrivenByBar:
    """Where a group has a transmission angle: a joint, and the two directions that enclose it.

    ``bodies`` are those that the joint joins, ``held`` those that the angle depends on. ``bar`` is
    the way between the ball joints, ``way`` the velocity of the driven one's centre relative to
    what holds the link; both (3,) over the coordinates of the scene.
    """

    joint: str
    bodies: tuple[str, str]
    group: Group
    held: tuple[str, ...]
    bar: Sym
    way: Sym

    @property
    def dot(self) -> Sym:
        """Dot product of both directions."""
        return ca.dot(self.bar, self.way)

    @property
    def sine(self) -> Sym:
        """Sine of the angle, with the sign of the side that the bar pushes to."""
        return self.dot / ca.sqrt(ca.sumsqr(self.bar) * ca.sumsqr(self.way))


def driven_by_bars(scene: Scene) -> list[DrivenByBar]:
    """Return the groups of one link on a known one and of one bar, in the order of solving."""
    found = []
    for group in scene.groups:
        model = scene.model
        links = [body for body in group.bodies if body not in model.spinning]
        bars = _bars(scene, group)
        if len(links) != 1 or len(bars) != 1:
            continue
        name, ends = bars[0]
        holding = [
            model.mechanism.joints[joint]
            for joint in group.joints
            if links[0] in model.mechanism.joints[joint].bodies
            and not model.mechanism.joints[joint].ball
            and not model.mechanism.joints[joint].bar
        ]
        if len(holding) != 1 or links[0] not in [end.split(".")[0] for end in ends]:
            continue
        way = _way(model, holding[0], links[0], ends)
        if way is None:
            continue
        other = holding[0].bodies[holding[0].bodies[0] == links[0]]
        far = next(end.split(".")[0] for end in ends if end.split(".")[0] != links[0])
        held = tuple(dict.fromkeys(b for b in (links[0], other, far) if b != GROUND))
        bar, joint = model.point(ends[1]) - model.point(ends[0]), model.mechanism.joints[name]
        bodies = (joint.first_body, joint.second_body)
        found.append(DrivenByBar(name, bodies, group, held, bar, way))
    return found


def _bars(scene: Scene, group: Group) -> list[tuple[str, tuple[str, str]]]:
    """Return the bars of a group: the joint an angle belongs to, and the points of its ends.

    That of a link with two balls is the ball on the link of the group.
    """
    model: Any = scene.model
    joints = model.mechanism.joints
    found = [(name, (joints[name].first, joints[name].second)) for name in group.joints
             if joints[name].bar]  # fmt: skip
    for body in group.bodies:
        link = model.idle.get(body) if body in model.spinning else None
        if link is None:
            continue
        names = [name for name in (link.joint, *link.others)
               if set(joints[name].bodies) & (set(group.bodies) - {body})]  # fmt: skip
        found.append((names[0] if names else link.joint, link.ends))
    return found


def _way(model: Any, joint: Any, link: str, ends: tuple[str, str]) -> Sym:
    """Return the velocity (3,) of the driven end per unit of the joint's coordinate, or None."""
    point = next(end for end in ends if end.split(".")[0] == link)
    axis = model.axes_of(joint.name)[0][:, 2]
    if joint.guide:
        return axis
    if not (joint.hinge or f"{joint.name}.pitch" in model.numbers):
        return None
    around = ca.cross(axis, model.point(point) - model.point(joint.first))
    if joint.hinge:
        return around
    return around + axis * model.numbers[f"{joint.name}.pitch"] / (2 * ca.pi)


def requests(scene: Scene) -> list[Request]:
    """Return dot and vector product of both directions of each driven link."""
    return [
        (PREFIX + bar.joint, ca.vertcat(bar.dot, ca.cross(bar.bar, bar.way)), bar.held)
        for bar in driven_by_bars(scene)
    ]  # fmt: skip


def angles(outputs: Outputs, values: Floats) -> dict[str, dict[str, Floats]]:
    """Return ``transmission_angle`` [rad] by joint at given poses, 0 to pi/2."""
    return angles_of(outputs, values, _folded)


def _folded(products: Floats) -> Any:
    across = np.linalg.norm(products[:, 1:], axis=1)
    return np.arctan2(np.abs(products[:, 0]), across)


def summary(track: Track, outputs: Outputs) -> dict[str, dict[str, float]]:
    """Return joint -> {"min", "at", "max", "max_at"} over the sweep, refined."""
    return summary_of(track, outputs, _Family, _folded)


class _Family:
    """What vanishes where the angle of some columns is stationary or zero, with derivatives."""

    def __init__(self, columns: list[int]) -> None:
        self.columns = columns

    def __call__(self, sample: Sample) -> tuple[Floats, Floats]:
        """Return the rate of the squared sine over its size, and the dot product."""
        y = [array[:, self.columns] for array in sample.y[:3]]
        (d, c), (d1, c1), (d2, c2) = ((array[:, 0], array[:, 1:]) for array in y)

        def dot(a: Floats, b: Floats) -> Any:
            return np.sum(a * b, axis=1)

        turn = d1 * dot(c, c) - d * dot(c, c1)
        rate = d2 * dot(c, c) + d1 * dot(c, c1) - d * (dot(c1, c1) + dot(c, c2))
        return np.stack([turn, d], axis=1), np.stack([rate, d1], axis=1)

    def moving(self, sample: Sample, unit: float) -> Any:
        """Return which of both are no rounding noise."""
        size = np.linalg.norm(sample.y[0][:, self.columns], axis=1)
        with np.errstate(invalid="ignore"):
            largest = np.abs(self(sample)[0])
            largest[:, 0] *= unit / size**3
            largest[:, 1] /= size
            return (largest > AT_REST).any(axis=0)
