"""Spatial groups of which all poses are found at once, each kind by a way of its own.

Wishbones: an arm on a hinge, and a body between its ball and a known one that a rod holds. The
arm's ball runs on a circle and keeps its distance from the known ball; then the body turns
about the line of both balls, and its point of the rod, on a circle too, keeps its distance from the
rod's other end. Each time it is a cos(t) + b sin(t) = c, with two turns or none: 4 poses at most.

Six hinges in a row between known bodies: rings of seven, arms with six axes; at most 16 poses.
The numbers of Denavit and Hartenberg follow from the joints' frames: x_i is the common normal of
the axes i and i + 1 of a body, a_i and alpha_i lead along it and about it, d_i along the axis from
one normal's foot to the next one's.

A body that six distances hold from bodies that are known: at most 40 poses.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.describe.coordinate_kinds import LENGTH, UNIT
from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene
from mechdae.errors import InputError
from mechdae.motion.cases.larger_groups.rigid_parts import (
    Coordinates,
    GroupPoses,
    OtherShape,
    ShapedGroup,
    shaped,
)
from mechdae.motion.cases.space.three_points import KnownSides, RodsAndJoints, ThreePoints, triad
from mechdae.motion.setup.angular_rates import quaternions
from mechdae.numerics.arms.chain import PARALLEL, Arm
from mechdae.numerics.arms.poses import arm_poses_at
from mechdae.numerics.arms.wrists import parallel_at, wrist_at
from mechdae.numerics.homotopy.platforms import MOST, platform_poses
from mechdae.types import Floats, Unknowns

if TYPE_CHECKING:
    from mechdae.describe.joints.joint import Joint

LEGS = 6
ALL_LEGS = f"homotopy: {MOST} complex poses are certified, as many as there can be"
FAR = "homotopy: {} complex poses and {} at infinity are certified, as many as there can be"


class SixLegs(ShapedGroup):
    """A platform on six legs of given lengths: bars, and links that spin between ball joints."""

    def __init__(self, scene: Scene, group: Group, p: Floats) -> None:
        model: Any = scene.model
        parts = RodsAndJoints(model, group)
        if group.superfluous or len(parts.bodies) != 1:
            raise OtherShape
        (self.hub,) = parts.bodies
        self._own = [c for c in model.coordinates if c.owner == self.hub]
        if len(parts.rods) != LEGS or not (self._free and all(j.bar for j in parts.joints)):
            raise OtherShape
        places: dict[str, str] = {}
        for k, rod in enumerate(parts.rods):
            places[f"platform {k}"], places[f"base {k}"] = rod.ends(self.hub, group)
        lengths = {f"length {k}": rod.length for k, rod in enumerate(parts.rods)}
        self._point = places["platform 0"]
        self.sides: KnownSides = KnownSides(scene, group, p, places, {}, lengths)

    @property
    def _free(self) -> bool:
        """Whether place and quaternion of the body are its coordinates."""
        return [c.kind for c in self._own] == [LENGTH] * 3 + [UNIT] * 4

    def solve(self, q: Coordinates, u: Floats) -> GroupPoses:
        at = self.sides.at(q)
        base, platform = (
            [at[f"{word} {k}"].ravel() for k in range(LEGS)] for word in ("base", "platform")
        )
        lengths = [float(at[f"length {k}"].item()) for k in range(LEGS)]
        found = platform_poses(base, platform, lengths)
        poses = [
            self._coordinates(place, e)
            for place, e in zip(found.position, found.quaternion, strict=True)
        ]
        basis = FAR.format(found.regular, found.far) if found.far else ALL_LEGS
        return GroupPoses(
            poses,
            found.proven,
            basis if found.proven else "",
            generic=MOST,
            singular=found.singular + found.far,
            bounded=True,
            placed=(self._point, *found.complex_places(platform[0])),
        )

    def _coordinates(self, place: Floats, e: Floats) -> dict[tuple[str, str], float]:
        """Return the coordinates of a displacement of points given from the body's anchor."""
        values = [*place, *e]
        return {c.key: float(value) for c, value in zip(self._own, values, strict=True)}


AXES = 6
HINGES = "eigenvalues: {} complex poses are certified, as many as there can be"
WRIST = "three axes meet in a point: {} complex poses, as many as there can be"
PARALLELS = "three axes are parallel: {} complex poses, as many as there can be"


class HingeLoop(ShapedGroup):
    """Five bodies in a row on six hinges, whose ends are known."""

    def __init__(self, scene: Scene, group: Group, p: Floats) -> None:
        joints = scene.model.mechanism.joints
        every = [joints[name] for name in group.joints]
        hinges = len(every) == AXES and all(j.turns and len(j.coordinates) == 1 for j in every)
        if not hinges or len(group.bodies) != AXES - 1 or group.superfluous:
            raise OtherShape
        inside = set(group.bodies)
        ends = [joint for joint in every if len(inside & set(joint.bodies)) == 1]
        if len(ends) != 2:
            raise OtherShape
        self.row: list[tuple[str, bool]] = []
        """Joints from one end to the other, and whether the first body comes first there."""
        here, rest = next(b for b in ends[0].bodies if b not in inside), list(every)
        joint = ends[0]
        while True:
            rest.remove(joint)
            forward = joint.first_body == here
            self.row.append((joint.name, forward))
            here = joint.second_body if forward else joint.first_body
            after = [other for other in rest if here in other.bodies]
            if here not in inside:
                break
            if len(after) != 1:
                raise OtherShape
            joint = after[0]
        if rest:
            raise OtherShape
        sides: dict[str, tuple[str, bool]] = {}
        for k, (name, forward) in enumerate(self.row):
            sides |= {f"before {k}": (name, not forward), f"behind {k}": (name, forward)}
        self.sides: KnownSides = KnownSides(scene, group, p, {}, sides, {})

    def solve(self, q: Coordinates, u: Floats) -> GroupPoses | None:
        """Return the joints' angles in all poses, None where axes are one."""
        at = self.sides.at(q)
        before = [at[f"before {k}"] for k in range(AXES)]
        behind = [at[f"behind {k}"] for k in range(AXES)]
        links, shifts = np.zeros((AXES, 3)), np.zeros(AXES)
        for k in range(AXES - 1):  # of the body between two axes
            first, second = behind[k], before[k + 1]
            z, w = first[:, 3], second[:, 3]
            x = np.cross(z, w)
            sine, gap = float(np.linalg.norm(x)), second[:, 0] - first[:, 0]
            if sine < PARALLEL:  # any of the common normals, that at the first axis' own point
                x, sine = gap - (gap @ z) * z, 0.0
                if not np.linalg.norm(x) > PARALLEL * np.linalg.norm(gap):
                    return None  # the axes are one
                along, back = 0.0, -float(gap @ z) * float(z @ w)
            else:
                along, back = _feet(gap, z, w)
            x = x / np.linalg.norm(x)
            links[k, 0] = gap @ x
            links[k, 1] = np.arctan2(sine, z @ w)
            links[k, 2] += along
            links[k + 1, 2] -= back
            shifts[k] += _angle(x, first[:, 1], z)
            shifts[k + 1] -= _angle(x, second[:, 1], w)
        P, n, m, a = before[0].T
        base = np.stack([n, m, a], axis=1)
        hand = base.T @ np.column_stack([behind[-1][:, 1:], behind[-1][:, 0] - P])
        said = WRIST if wrist_at(links) else PARALLELS if parallel_at(links) else HINGES
        try:
            found = arm_poses_at(Arm(links), hand)
        except InputError:  # its hand does not move with six freedoms
            return None
        signs = np.where([forward for _, forward in self.row], 1.0, -1.0)
        angles = signs * (found.angles + shifts)
        poses = [
            {(name, "angle"): float(v) for (name, _), v in zip(self.row, row, strict=True)}
            for row in angles
        ]
        basis = said.format(found.most) if found.proven else ""
        sides = np.abs(np.sin(links[: AXES - 1, 1])).min() >= PARALLEL
        return GroupPoses(
            poses,
            found.proven,
            basis,
            generic=found.most,
            singular=found.singular,
            bounded=True,
            by="eigenvalues",
            row=tuple(self.row),
            axes=found.axes @ base.T if found.axes is not None and sides else None,
        )


def _feet(gap: Floats, z: Floats, w: Floats) -> tuple[float, float]:
    """Return where the common normal of two axes meets them, along each from its own point.

    The second axis begins `gap` from the point of the first.
    """
    c = float(z @ w)
    first, second = float(gap @ z), float(gap @ w)
    square = 1 - c * c
    return (first - c * second) / square, (c * first - second) / square


def _angle(first: Floats, second: Floats, axis: Floats) -> float:
    """Return the angle from one direction to another about an axis normal to both."""
    return float(np.arctan2(axis @ np.cross(first, second), first @ second))


MOST_WISHBONES = 4
BASIS = f"closed form: a circle and a sphere, twice, so at most {MOST_WISHBONES} poses"
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
        return GroupPoses(poses, True, BASIS, generic=MOST_WISHBONES, bounded=True)

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


def spatial_group(scene: Scene, group: Group, p: Floats) -> ShapedGroup | None:
    """Return the group as platform on three points or six legs, row of six hinges, wishbone."""
    if scene.model.mechanism.dimension != 3:
        return None
    return shaped((ThreePoints, SixLegs, HingeLoop, ArmAndHub), scene, group, p)
