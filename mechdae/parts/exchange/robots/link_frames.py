"""Frames of bodies and axes of joints of one pose, in space also for mechanisms of the plane.

The plane is x, y of the space; bodies of the plane turn about z.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mechdae.describe import GROUND, Body, Joint, Mechanism
from mechdae.describe.joints.spatial import SpatialJoint, largest
from mechdae.describe.mechanism import MOMENTS
from mechdae.errors import UnavailableError
from mechdae.tasks import ExportedMotion, reported
from mechdae.types import Floats

if TYPE_CHECKING:
    from mechdae.describe.values import Table

Z = np.array([0.0, 0.0, 1.0])


def turned(axis: Floats, angle: float) -> Floats:
    """Return the matrix (3, 3) of a turn about a unit axis (3,)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    R: Floats = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * (cross @ cross)
    return R


def of_quaternion(q: Floats) -> Floats:
    """Return the matrix (3, 3) of a unit quaternion (4,), real part first."""
    w, v = float(q[0]), np.asarray(q[1:], float)
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    R: Floats = np.eye(3) + 2 * w * cross + 2 * (cross @ cross)
    return R


def quaternion(R: Floats) -> Floats:
    """Return the unit quaternion (4,) of a matrix (3, 3), real part first and not negative."""
    K = np.array(
        [
            [R[0, 0] + R[1, 1] + R[2, 2], R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]],
            [0, R[0, 0] - R[1, 1] - R[2, 2], R[1, 0] + R[0, 1], R[0, 2] + R[2, 0]],
            [0, 0, R[1, 1] - R[0, 0] - R[2, 2], R[2, 1] + R[1, 2]],
            [0, 0, 0, R[2, 2] - R[0, 0] - R[1, 1]],
        ]
    )
    q = np.linalg.eigh(K + np.triu(K, 1).T)[1][:, -1]
    return q if q[0] >= 0 else -q


def placed(place: Sequence[float] | Floats) -> Floats:
    """Return a point or direction of the plane or of space (3,)."""
    found = np.zeros(3)
    found[: len(place)] = place
    return found


@dataclass(frozen=True)
class BodyFrame:
    """Where a body is: its origin (3,) and the directions of its axes (3, 3)."""

    origin: Floats
    R: Floats

    def world(self, local: Floats) -> Floats:
        """Return the place of a point given in the body's frame."""
        return self.origin + self.R @ local

    def seen_from(self, above: BodyFrame) -> BodyFrame:
        """Return this frame in the axes of another one."""
        return BodyFrame(above.R.T @ (self.origin - above.origin), above.R.T @ self.R)


HOME = BodyFrame(np.zeros(3), np.eye(3))
"""The frame of the ground."""


@dataclass(frozen=True)
class MassOf:
    """Mass [kg], centre (3,) [m] and inertia (3, 3) about it [kg m2], in the body's frame."""

    mass: float
    center: Floats
    inertia: Floats

    def moments(self) -> dict[str, float]:
        """Return the six moments and products of inertia by ixx, ixy, ..."""
        pairs = itertools.combinations_with_replacement(range(3), 2)
        return {f"i{'xyz'[i]}{'xyz'[j]}": self.inertia[i, j] for i, j in pairs}


class Described:
    """A mechanism's points, axes and masses as numbers in space."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism: Mechanism = mechanism
        self.values: Table[float] = mechanism.values()

    def local(self, reference: str) -> Floats:
        """Return a point in the frame of its body (3,)."""
        axes = self.mechanism.axes
        return placed([self.values[f"{reference}.{axis}"] for axis in axes])

    def direction(self, joint: Joint, key: str) -> Floats:
        """Return a unit direction of a joint (3,), in the body that it is given in."""
        given = np.array([self.values[f"{joint.name}.{key}.{axis}"] for axis in "xyz"])
        direction: Floats = given / np.linalg.norm(given)
        return direction

    def axis(self, joint: Joint) -> Floats:
        """Return the axis along which or about which a joint moves, in the first body (3,)."""
        if isinstance(joint, SpatialJoint):
            return self.direction(joint, joint.side(False)[0])
        if joint.straight:
            angle = self.values[f"{joint.name}.axis"]
            return np.array([math.cos(angle), math.sin(angle), 0.0])
        return Z

    def zero(self, joint: SpatialJoint) -> Floats:
        """Return the normal of a joint's axis from which it is counted, in the first body (3,)."""
        axis, key = self.axis(joint), joint.side(False)[1]
        if key is not None:
            given = self.direction(joint, key)
        else:
            given = np.eye(3)[(largest(tuple(axis)) + 1) % 3]
        across = given - axis * (axis @ given)
        return across / np.linalg.norm(across)

    def mass(self, name: str) -> MassOf | None:
        """Return what a body weighs, None where nothing is given."""
        body = self.mechanism.bodies[name]
        if body.mass is None and body.inertia is None:
            return None
        axes, values = self.mechanism.axes, self.values
        center = placed([values.get(f"{name}.center.{axis}", 0.0) for axis in axes])
        return MassOf(values.get(f"{name}.mass", 0.0), center, self._inertia(name, body))

    def _inertia(self, name: str, body: Body) -> Floats:
        if body.inertia is None:
            return np.zeros((3, 3))
        if self.mechanism.dimension == 2:  # of a flat body: Ixx + Iyy = Izz
            moment = self.values[f"{name}.inertia"]
            return np.diag([moment / 2, moment / 2, moment])
        xx, yy, zz, xy, xz, yz = (self.values.get(f"{name}.inertia.{w}", 0.0) for w in MOMENTS)
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def frames_of(motion: ExportedMotion, described: Described, row: int) -> Mapping[str, BodyFrame]:
    """Return the frames of all bodies in one pose, the ground's among them."""
    found = {GROUND: HOME}
    for name, body in motion.mechanism.bodies.items():
        places = [
            (described.local(f"{name}.{point}"), placed(there))
            for point in body.points
            if np.isfinite(there := reported(motion, "points", f"{name}.{point}", "position", row))
            .all()
        ]  # fmt: skip
        R = _turn(motion, name, row, places)
        if R is None or not places:
            raise UnavailableError(
                f"the place of body {name} is not known along the task",
                where=f"tasks.{motion.task}",
            )
        local, there = places[0]
        found[name] = BodyFrame(there - R @ local, R)
    return found


def _turn(
    motion: ExportedMotion, name: str, row: int, places: list[tuple[Floats, Floats]]
) -> Floats | None:
    if motion.mechanism.dimension == 2:
        angle = float(np.ravel(reported(motion, "bodies", name, "angle", row))[0])
        return turned(Z, angle) if math.isfinite(angle) else None
    q = reported(motion, "bodies", name, "orientation", row)
    if len(q) == 4 and np.isfinite(q).all():
        return of_quaternion(q)
    if len(places) < 2:
        return None
    # a link that spins freely between two ball joints: any turn that takes its points there
    (a, A), (b, B) = places[0], places[-1]
    here, there = b - a, B - A
    here, there = here / np.linalg.norm(here), there / np.linalg.norm(there)
    across, cosine = np.cross(here, there), float(here @ there)
    sine = float(np.linalg.norm(across))
    if sine < 1e-12:
        return np.eye(3) if cosine > 0 else turned(_normal(here), math.pi)
    return turned(across / sine, math.atan2(sine, cosine))


def _normal(axis: Floats) -> Floats:
    other = np.eye(3)[int(np.argmin(np.abs(axis)))]
    across = np.cross(axis, other)
    normal: Floats = across / np.linalg.norm(across)
    return normal
