"""Six hinges in a row between known bodies: rings of seven, arms with six axes; at most 16 poses.

The numbers of Denavit and Hartenberg follow from the joints' frames: x_i is the common normal of
the axes i and i + 1 of a body, a_i and alpha_i lead along it and about it, d_i along the axis from
one normal's foot to the next one's.
"""

from __future__ import annotations

import numpy as np

from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene
from mechdae.errors import InputError
from mechdae.motion.cases.larger_groups.rigid_parts import (
    Coordinates,
    GroupPoses,
    OtherShape,
    ShapedGroup,
)
from mechdae.motion.cases.space.known_sides import KnownSides
from mechdae.numerics.arms.chain import PARALLEL, Arm
from mechdae.numerics.arms.parallel import parallel_at
from mechdae.numerics.arms.poses import arm_poses_at
from mechdae.numerics.arms.wrists import wrist_at
from mechdae.types import Floats

AXES = 6
BASIS = "eigenvalues: {} complex poses are certified, as many as there can be"
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
        said = WRIST if wrist_at(links) else PARALLELS if parallel_at(links) else BASIS
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
