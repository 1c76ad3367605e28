"""Instantaneous screw axes of bodies in space, and axodes: the ruled surfaces they run through.

The twist of one body relative to another is an angular velocity w and a velocity v of the point at
X. It is a turn about the line through X + w x v / w^2 along w together with a shift along it, the
pitch of which is w v / w^2 a radian (Ball 1900). A line is told by its direction and by its point
nearest to the origin of the frame it is seen in.
"""

from __future__ import annotations

import itertools
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.mechanism import GROUND
from mechdae.equations.reduction import Scene
from mechdae.errors import InputError
from mechdae.motion.measures.along_sweep_extremes import AT_REST
from mechdae.motion.measures.centres import FAR, MOST, bodies_of
from mechdae.motion.setup.outputs import Outputs, Request
from mechdae.records import dataclass
from mechdae.types import Floats, Matrix

PLACEMENT = "placement of "
TURN = 2 * np.pi


def solid_bodies(scene: Scene) -> list[str]:
    """Return the bodies that have an orientation: not links that spin freely."""
    return [name for name in bodies_of(scene) if name not in scene.model.spinning]


def requests(scene: Scene) -> list[Request]:
    """Return the rotation matrix and the place of the anchor of each body."""
    found: list[Request] = []
    for name in solid_bodies(scene):
        frame: Any = scene.model.frame(name)
        found.append((PLACEMENT + name, ca.vertcat(ca.vec(frame.R), frame.r), (name,)))
    return found


@dataclass(frozen=True)
class Axes:
    """Screw axes at poses: ``direction``, ``point`` (n, 3) and ``pitch`` (n,) [m a turn].

    All are nan where there is none, the direction is that of the turning.
    """

    direction: Floats
    point: Matrix
    pitch: Floats


class Twists:
    """Orientations, places and twists of all bodies at poses.

    `values` are y, y' of the poses, derivatives by a driver whose value of 1 is `unit` radians.
    """

    def __init__(self, outputs: Outputs, values: list[Floats], scale: float, unit: float) -> None:
        n = self.count = len(values[0])
        self.scale, self.unit = scale, unit
        model = outputs.scene.model
        numbers = model.mechanism.values()
        self.anchors: dict[str, object] = {GROUND: np.zeros(3)}
        still, nothing = np.broadcast_to(np.eye(3), (n, 3, 3)), np.zeros((n, 3))
        self.turn, self.place = {GROUND: still}, {GROUND: nothing}
        self.spin, self.speed = {GROUND: nothing}, {GROUND: nothing}
        for entry in outputs.entries:
            if not (entry.kind == "hidden" and entry.part.startswith(PLACEMENT)):
                continue
            name = entry.part.removeprefix(PLACEMENT)
            point = model.anchor(name)
            local = [numbers[f"{name}.{point}.{axis}"] if point else 0.0 for axis in "xyz"]
            self.anchors[name] = np.array(local)
            here, rate = (array[:, list(entry.columns)] for array in values)
            R, dR = (array[:, :9].reshape(-1, 3, 3).transpose(0, 2, 1) for array in (here, rate))
            W = dR @ R.transpose(0, 2, 1)
            self.turn[name], self.place[name], self.speed[name] = R, here[:, 9:], rate[:, 9:]
            self.spin[name] = np.stack(
                [W[:, 2, 1] - W[:, 1, 2], W[:, 0, 2] - W[:, 2, 0], W[:, 1, 0] - W[:, 0, 1]], axis=1
            ) / 2  # fmt: skip

    @property
    def bodies(self) -> list[str]:
        return [name for name in self.turn if name != GROUND]

    def axis(self, first: str, second: str) -> Axes:
        """Return the axis of the motion of the second body relative to the first, in space."""
        arm = self.place[second] - self.place[first]
        spin = self.spin[second] - self.spin[first]
        speed = self.speed[second] - self.speed[first] - np.cross(self.spin[first], arm)
        size = np.linalg.norm(spin, axis=1, keepdims=True)
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            way = np.linalg.norm(speed, axis=1, keepdims=True)
            there = (size * self.unit > AT_REST) & (size * self.scale > way / FAR)
            direction = spin / size
            pitch = TURN * np.sum(direction * speed, axis=1) / size[:, 0]
            point = self.place[second] + np.cross(direction, speed) / size
        direction, point = (np.where(there, array, np.nan) for array in (direction, point))
        return Axes(direction, _foot(point, direction), np.where(there[:, 0], pitch, np.nan))

    def seen_from(self, body: str, axis: Axes) -> Axes:
        """Return an axis in the body's own frame, that of the file."""
        back = self.turn[body].transpose(0, 2, 1)
        direction = np.einsum("nij,nj->ni", back, axis.direction)
        point = np.einsum("nij,nj->ni", back, axis.point - self.place[body]) + self.anchors[body]
        return Axes(direction, _foot(point, direction), axis.pitch)


def _foot(point: Floats, direction: Floats) -> Any:
    """Return the point of a line that is nearest to the origin."""
    return point - direction * np.sum(point * direction, axis=1, keepdims=True)


def axodes(
    twists: Twists, wanted: tuple[str, ...]
) -> tuple[dict[str, dict[str, Floats]], dict[str, list[str]]]:
    """Return the axodes of bodies that ever turn, and which ``never_turn``."""
    found, still = {}, []
    for body in wanted:
        if body not in twists.turn:
            continue
        axis = twists.axis(GROUND, body)
        if not np.isfinite(axis.pitch).any():
            still.append(body)
            continue
        moving = twists.seen_from(body, axis)
        found[body] = {
            "axode_fixed_direction": axis.direction,
            "axode_fixed_point": axis.point,
            "axode_moving_direction": moving.direction,
            "axode_moving_point": moving.point,
            "screw_pitch": axis.pitch,
        }
    return found, {"never_turn": still} if still else {}


def screw_axes(twists: Twists) -> tuple[dict[str, Floats], list[str]]:
    """Return the axes of all pairs of bodies, and the pairs that never turn to each other.

    Of each pair there are ``A-B.direction``, ``A-B.point`` (n, 3) and ``A-B.pitch`` (n,).

    Raises
    ------
    InputError
        More numbers than `MOST`.
    """
    pairs = list(itertools.combinations([GROUND, *twists.bodies], 2))
    if 7 * len(pairs) * twists.count > MOST:
        raise InputError(
            f"{len(pairs)} pairs of bodies at {twists.count} poses are too many screw axes",
            where="measures",
            hint="name the bodies that matter in 'outputs', or take fewer poses",
        )
    found, far = {}, []
    for first, second in pairs:
        axis, pair = twists.axis(first, second), f"{first}-{second}"
        if not np.isfinite(axis.pitch).any():
            far.append(pair)
            continue
        found[f"{pair}.direction"] = axis.direction
        found[f"{pair}.point"] = axis.point
        found[f"{pair}.pitch"] = axis.pitch
    return found, far
