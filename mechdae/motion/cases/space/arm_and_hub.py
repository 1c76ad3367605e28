"""An arm on a hinge, and a body between its ball and a known one that a rod holds: a wishbone.

The arm's ball runs on a circle and keeps its distance from the known ball; then the body turns
about the line of both balls, and its point of the rod, on a circle too, keeps its distance from the
rod's other end. Each time it is a cos(t) + b sin(t) = c, with two turns or none: 4 poses at most.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene
from mechdae.motion.cases.larger_groups.rigid_parts import (
    Coordinates,
    GroupPoses,
    OtherShape,
    ShapedGroup,
)
from mechdae.motion.cases.space.known_sides import KnownSides, RodsAndJoints, triad
from mechdae.motion.setup.angular_rates import quaternions
from mechdae.types import Floats, Unknowns

if TYPE_CHECKING:
    from mechdae.describe.joints.joint import Joint

MOST = 4
BASIS = f"closed form: a circle and a sphere, twice, so at most {MOST} poses"
CLEAR = 1e-9
"""Share of its amplitude by which a turn must keep from where both are one."""


class ArmAndHub(ShapedGroup):
    """An arm on a hinge, and a hub on two balls, of the arm and of a known body, with a rod."""

    def __init__(self, scene: Scene, group: Group, p: Floats) -> None:
        parts = RodsAndJoints(scene.model, group)
        chain, inner = parts.joints, set(parts.bodies)
        hinges = [j for j in chain if j.turns and len(j.coordinates) == 1]
        balls = [j for j in chain if j.ball]
        if (len(hinges), len(balls), len(parts.rods), len(inner)) != (
            1,
            2,
            1,
            2,
        ) or group.superfluous:
            raise OtherShape
        if len(chain) - len([j for j in chain if j.bar]) != 3:
            raise OtherShape
        (hinge,), (rod,) = hinges, parts.rods
        (arm,) = inner & set(hinge.bodies) if len(inner & set(hinge.bodies)) == 1 else (None,)
        (hub,) = inner - {arm} if arm else (None,)
        here = [j for j in balls if set(j.bodies) == {arm, hub}]
        there = [j for j in balls if hub in j.bodies and not {arm} & set(j.bodies)]
        if hub is None or not len(here) == len(there) == 1:
            raise OtherShape
        steered, known = rod.ends(hub, group)
        self.hinge, self.forward = hinge.name, hinge.second_body == arm
        owners = {owner for owner, _ in scene.x_names}
        self.turned: list[Joint] = [j for j in (here[0], there[0]) if j.name in owners]
        if len(self.turned) != 1 or hinge.name not in owners:
            raise OtherShape
        self.on_arm: bool = self.turned == here
        self.hub_first: bool = self.turned[0].first_body == hub
        sides = {
            "hinge": (hinge.name, not self.forward),
            "arm": (hinge.name, self.forward),
            "arm ball": (here[0].name, here[0].second_body == arm),
            "hub ball": (here[0].name, here[0].second_body == hub),
            "known ball": (there[0].name, there[0].second_body != hub),
            "hub known": (there[0].name, there[0].second_body == hub),
        }
        places = {"rod": known, "steer": steered}
        self.sides: KnownSides = KnownSides(scene, group, p, places, sides, {"length": rod.length})

    def solve(self, q: Coordinates, u: Floats) -> GroupPoses | None:
        """Return the hinge's angle and the ball's quaternion in all poses, None next to a fold."""
        at = self.sides.at(q)
        frame, C = at["hinge"][:, 1:], at["arm"][:, 1:]
        out = C.T @ (at["arm ball"][:, 0] - at["arm"][:, 0])
        middle = at["hinge"][:, 0] + frame[:, 2] * out[2]
        X, Y = frame[:, :2] @ out[:2], frame[:, :2] @ [-out[1], out[0]]
        known, foot = at["known ball"][:, 0], at["hub known"][:, 0]
        across = at["hub ball"][:, 0] - foot
        first = _turns(middle - known, X, Y, float(across @ across))
        if first is None:
            return None
        rod, steer = at["rod"].ravel(), at["steer"].ravel() - foot
        poses = []
        for turn in first:
            c, s = np.cos(turn), np.sin(turn)
            line = middle + c * X + s * Y - known
            moving, fixed = _frame(across, steer), _frame(line, frame[:, 2])
            if moving is None or fixed is None:
                return None
            local = moving.T @ steer
            centre = known + fixed[:, 0] * local[0]
            second = _turns(
                centre - rod, fixed[:, 1] * local[1], fixed[:, 2] * local[1],
                float(at["length"].item()) ** 2,
            )  # fmt: skip
            if second is None:
                return None
            arm = frame @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ C.T
            for other in second:
                c2, s2 = np.cos(other), np.sin(other)
                hub = fixed @ np.array([[1, 0, 0], [0, c2, -s2], [0, s2, c2]]) @ moving.T
                poses.append(self._coordinates(at, turn, arm, hub))
        return GroupPoses(poses, True, BASIS, generic=MOST, bounded=True)

    def _coordinates(
        self, at: Mapping[str, Floats], turn: float, arm: Floats, hub: Floats
    ) -> dict[tuple[str, str], float]:
        """Return a pose as coordinates, from the arm's turn and the rotations of both bodies."""
        if self.on_arm:
            base, ball = arm @ at["arm ball"][:, 1:], hub @ at["hub ball"][:, 1:]
        else:
            base, ball = at["known ball"][:, 1:], hub @ at["hub known"][:, 1:]
        Q = ball.T @ base if self.hub_first else base.T @ ball
        angle = (turn + np.pi) % (2 * np.pi) - np.pi
        found = {(self.hinge, "angle"): float(angle if self.forward else -angle)}
        for k, value in enumerate(quaternions(Q[None])[0]):
            found[self.turned[0].name, f"e{k}"] = float(value)
        return found


def _turns(middle: Floats, X: Unknowns, Y: Floats, square: float) -> list[float] | None:
    """Return the turns t where middle + X cos t + Y sin t has a length, None next to a fold."""
    a, b = 2 * float(middle @ X), 2 * float(middle @ Y)
    c = square - float(middle @ middle + X @ X)
    size = float(np.hypot(a, b))
    scale = float(middle @ middle + X @ X) + square
    if not size > CLEAR * scale or abs(abs(c) - size) <= CLEAR * max(size, abs(c)):
        return None
    if abs(c) > size:
        return []
    first, off = float(np.arctan2(b, a)), float(np.arccos(c / size))
    return [first + off, first - off]


def _frame(along: Floats, beside: Floats) -> Any:
    """Return the frame of two directions, None where they are one."""
    x = along / np.linalg.norm(along)
    across = np.linalg.norm(beside - (beside @ x) * x)
    return triad(along, beside) if across > CLEAR * np.linalg.norm(beside) else None
