"""Complex poses that paths of whole groups led to, as coordinates that balls begin with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from flint import acb

if TYPE_CHECKING:
    from mechdae.motion.cases.larger_groups.rigid_parts import GroupPoses
    from mechdae.parts.proof.checker.space import SpatialMechanism


def poses_of_group(m: SpatialMechanism, z: list[Any], group: GroupPoses) -> list[list[Any]]:
    """Return poses that differ from a pose in the bodies of one group, solved by paths.

    `z`: one pose, real or complex; last the parameter. `group`: what its paths led to.
    """
    if group.axes is not None:
        return hinge_row_poses(m, z, group.row, group.axes)
    if group.placed is None:
        return []
    reference, places, turns = group.placed
    body, _, point = reference.partition(".")
    found, at = [], m.at[body, "x"]
    for place, e in zip(places, turns, strict=True):
        pose, (w, x, y, v) = list(z), e
        R = np.array(
            [
                [1 - 2 * (y * y + v * v), 2 * (x * y - w * v), 2 * (x * v + w * y)],
                [2 * (x * y + w * v), 1 - 2 * (x * x + v * v), 2 * (y * v - w * x)],
                [2 * (x * v - w * y), 2 * (y * v + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        r = place - R @ _numbers(m.points[body][point])
        pose[at : at + 7] = [acb(complex(value)) for value in (*r, *e)]
        found.append(pose)
    return found


def hinge_row_poses(
    m: SpatialMechanism, z: list[Any], row: Sequence[tuple[str, bool]], axes: Any
) -> list[list[Any]]:
    """Return poses that differ from a pose in the bodies of a row of hinges.

    `z`: one pose, real or complex; last the parameter. `row`: joints from one known body to the
    other, and whether the first body comes first there. `axes` (n, k, 3): directions of the joints'
    axes in the poses.
    """
    joints = [m.joints[name] for name, _ in row]
    base, start = m.placed([v.real for v in z]), joints[0]["ends"][0 if row[0][1] else 1]
    first = np.array([complex(v) for v in m.place(start, base)])
    found = []
    for directions in axes:
        pose, here = list(z), first
        for k in range(len(row) - 1):
            near, far = (1 if row[k][1] else 0), (0 if row[k + 1][1] else 1)
            body, point = joints[k]["ends"][near]
            p, q = (_numbers(m.points[body][w]) for w in (point, joints[k + 1]["ends"][far][1]))
            inner = [_numbers(joints[j]["sides"][s][2]) for j, s in ((k, near), (k + 1, far))]
            R = _frame(*directions[k : k + 2]) @ np.linalg.inv(_frame(*inner))
            at, r = m.at[body, "x"], here - R @ p
            pose[at : at + 7] = [acb(complex(v)) for v in (*r, *_quaternion(R))]
            here = r + R @ q
        found.append(pose)
    return found


def _numbers(values: Any) -> Any:
    return np.array([float(v) for v in values])


def _frame(one: Any, other: Any) -> Any:
    return np.stack([one, other, np.cross(one, other)], axis=1)


def _quaternion(R: Any) -> Any:
    """Return the quaternion (4,) of a complex rotation, from its largest entry."""
    R = R.astype(complex)
    trace = np.trace(R)
    squares = np.array([1 + trace, *(1 + 2 * R[i, i] - trace for i in range(3))]) / 4
    k = int(np.argmax(np.abs(squares)))
    turn = [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]
    products = np.empty((4, 4), complex)
    products[0, 1:] = products[1:, 0] = np.array(turn) / 4
    products[1:, 1:] = (R + R.T) / 4
    np.fill_diagonal(products, squares)
    return products[k] / np.sqrt(squares[k])
