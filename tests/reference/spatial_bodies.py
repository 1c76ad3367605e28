"""Forces in space by free bodies: Newton and Euler for each of them, least squares for all joints.

Nothing is shared with the package: places, orientations and accelerations come from the caller, the
directions in which a joint can push from its kind and axes. Bodies without a turn of their own
(bars between ball joints) have their ends' accelerations.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

EYE = np.eye(3)


def rotation(e: Any) -> Any:
    """Return the matrix of a unit quaternion, its real part first."""
    w, x, y, z = e
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


@dataclass
class FreeBody:
    """What a body needs to move as it does at one pose: force, and moment about its `centre`."""

    centre: Any
    force: Any
    moment: Any


def rigid(mass: float, J: Any, R: Any, centre: Any, acceleration: Any, w: Any, dw: Any) -> FreeBody:
    """Return a rigid body: J (3, 3) about the centre in its own axes, all else in world axes."""
    world = R @ J @ R.T
    return FreeBody(centre, mass * acceleration, world @ dw + np.cross(w, world @ w))


def bar(mass: float, across: float, share: float, ends: Any, accelerations: Any) -> FreeBody:
    """Return a bar: its moment of inertia across, the share of its centre between the ends."""
    (p, q), (a, b) = ends, accelerations
    length = np.linalg.norm(q - p)
    along = (q - p) / length
    return FreeBody(
        p + share * (q - p),
        mass * (a + share * (b - a)),
        across * np.cross(along, (b - a) / length),
    )


@dataclass
class Contact:
    """A joint: the wrenches (6, k) on the second body that it can exert, about `place`."""

    first: str
    second: str
    place: Any
    wrenches: Any


def across(a: Any) -> Any:
    """Return two directions (3, 2) across a direction."""
    return np.linalg.svd(a.reshape(1, 3))[2][1:].T


def wrenches(kind: str, a: Any = None, a2: Any = None, lead: float = 0.0, gap: Any = None) -> Any:
    """Return a basis of what a joint with axes `a`, `a2`, or a bar along `gap`, can exert."""
    none = np.zeros((3, 3))
    forces, moments = np.vstack([EYE, none]), np.vstack([none, EYE])
    if kind == "spherical":
        return forces
    if kind == "weld":
        return np.eye(6)
    if kind == "distance":
        return np.concatenate([gap / np.linalg.norm(gap), np.zeros(3)])[:, None]
    a = a / np.linalg.norm(a)
    if kind == "universal":
        cross = np.cross(a, a2)
        return np.hstack([forces, moments @ (cross / np.linalg.norm(cross))[:, None]])
    two = across(a)
    if kind == "revolute":
        return np.hstack([forces, moments @ two])
    if kind == "prismatic":
        return np.hstack([forces @ two, moments])
    if kind == "planar":
        return np.hstack([forces @ a[:, None], moments @ two])
    found = np.hstack([forces @ two, moments @ two])
    return found if kind == "cylindrical" else np.hstack([
        found, np.concatenate([a, -lead * a])[:, None]
    ])  # fmt: skip


@dataclass
class Pose:
    """A mechanism at one pose.

    ``loads`` are (body, place, force, moment), ``drives`` (first, second, place, wrench) of a unit
    of each effort.
    """

    bodies: Mapping[str, FreeBody]
    contacts: Mapping[str, Contact]
    loads: Sequence[tuple[str, Any, Any, Any]] = ()
    drives: Sequence[tuple[str, str, Any, Any]] = ()
    known: Any = field(default=None)

    def solve(self) -> tuple[dict[str, Any], Any, float, Any]:
        """Return reactions (6,) of joints, efforts, what is left of the equations, self-stresses.

        The shortest of all solutions; self-stresses (joints, 6, k) and the efforts' share of them.
        """
        rows = {name: 6 * k for k, name in enumerate(self.bodies)}
        right = np.zeros(6 * len(rows))
        for name, body in self.bodies.items():
            right[rows[name] :][:6] = [*body.force, *body.moment]
        for name, place, force, moment in self.loads:
            right[rows[name] :][:6] -= self._moved(name, place, np.concatenate([force, moment]))
        columns = []
        for contact in self.contacts.values():
            for w in contact.wrenches.T:
                columns.append(self._column(rows, contact.first, contact.second, contact.place, w))
        for first, second, place, w in self.drives:
            columns.append(self._column(rows, first, second, place, np.asarray(w)))
        matrix = np.array(columns).T
        found, *_ = np.linalg.lstsq(matrix, right, rcond=1e-12)
        left = float(np.abs(matrix @ found - right).max() / np.abs(right).max())
        values, vectors = np.linalg.svd(matrix)[1:]
        rank = int((values > 1e-9 * values[0]).sum())
        null = vectors[rank:].T
        reactions, stresses, start = {}, {}, 0
        for name, contact in self.contacts.items():
            count = contact.wrenches.shape[1]
            reactions[name] = contact.wrenches @ found[start : start + count]
            stresses[name] = contact.wrenches @ null[start : start + count]
            start += count
        return reactions, found[start:], left, (stresses, null[start:])

    def _moved(self, name: str, place: Any, wrench: Any) -> Any:
        arm = place - self.bodies[name].centre
        return np.concatenate([wrench[:3], wrench[3:] + np.cross(arm, wrench[:3])])

    def _column(self, rows: Any, first: str, second: str, place: Any, wrench: Any) -> Any:
        column = np.zeros(6 * len(rows))
        for name, sign in ((second, 1), (first, -1)):
            if name in rows:
                column[rows[name] :][:6] += sign * self._moved(name, place, wrench)
        return column
