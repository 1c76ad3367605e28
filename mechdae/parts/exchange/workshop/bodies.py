"""Bodies that are one part because they are welded, and where they are in the poses."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

import numpy as np

from mechdae.describe import GROUND
from mechdae.parts.exchange.workshop.outlines import turned
from mechdae.tasks import ExportedMotion
from mechdae.types import Floats, Points

T = TypeVar("T")


def connected(items: Iterable[T], joined: Callable[[T, T], bool]) -> list[list[T]]:
    """Return items in groups: those that are joined, directly or through others."""
    groups: list[list[T]] = []
    for item in items:
        group = [item]
        for known in list(groups):
            if any(joined(item, member) for member in known):
                groups.remove(known)
                group = known + group
        groups.append(group)
    return groups


class Rigid:
    """Places in the frame of the body that others are welded to, over the poses of a motion."""

    def __init__(self, motion: ExportedMotion) -> None:
        self.motion, self.values = motion, motion.mechanism.values()
        mechanism = motion.mechanism
        self.welds = [name for name, j in mechanism.joints.items() if j.coincide and j.keeps_angle]
        self._frames: dict[str, tuple[str, float, Floats]] = {}
        for body in (GROUND, *mechanism.bodies):
            if body not in self._frames:
                self._frames[body] = body, 0.0, np.zeros(2)
                self._hold(body)

    def _hold(self, body: str) -> None:
        """Put what is welded to a body into the frame of its root."""
        root, angle, shift = self._frames[body]
        for name in self.welds:
            joint = self.motion.mechanism.joints[name]
            turn = self.values[f"{name}.turn"]
            for here, there, sense in (
                (joint.first, joint.second, 1),
                (joint.second, joint.first, -1),
            ):
                mate = there.partition(".")[0]
                if here.partition(".")[0] == body and mate not in self._frames:
                    way = angle + sense * turn
                    place = turned(angle) @ self._written(here) + shift
                    self._frames[mate] = root, way, place - turned(way) @ self._written(there)
                    self._hold(mate)

    def _written(self, reference: str) -> Floats:
        return np.array([self.values[f"{reference}.{axis}"] for axis in "xy"])

    def root(self, body: str) -> str:
        """Return the body whose frame a body's places are in."""
        return self._frames[body][0]

    def turn(self, body: str) -> float:
        """Return the angle of a body in the frame of its root."""
        return self._frames[body][1]

    def local(self, reference: str) -> Floats:
        """Return a point in the frame of its body's root."""
        _, angle, shift = self._frames[reference.partition(".")[0]]
        return turned(angle) @ self._written(reference) + shift

    def angle(self, body: str) -> Floats:
        """Return the angle of a body in the poses that are there."""
        if body == GROUND:
            return np.zeros(len(self.motion.rows))
        return np.asarray(self.motion.result.bodies[body].angle, float)[self.motion.rows]

    def place(self, reference: str) -> Points:
        """Return a point in the poses that are there."""
        if reference.partition(".")[0] != GROUND:
            found = np.asarray(self.motion.result.points[reference].position, float)
            return found[self.motion.rows]
        return np.tile(self._written(reference), (len(self.motion.rows), 1))

    def seen(self, reference: str, other: str) -> Points:
        """Return a point in the frame of the root of another one's body, in the poses."""
        way, root = self.place(reference) - self.place(other), self.root(other.partition(".")[0])
        inside: Points = (way[:, None] @ turned(self.angle(root)))[:, 0]
        return inside + self.local(other)
