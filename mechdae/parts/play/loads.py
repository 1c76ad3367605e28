"""Which side of its gap each joint lies on under load.

A reaction holds a joint at the point of its gap where reaction times offset is least: it acts
against the offset. To first order outputs move by their linear forms there. The reactions are
those of the pose without play; the angle of friction in a pin is not counted.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from mechdae.equations.model import Model
from mechdae.parts.play.gaps import JointGap
from mechdae.results import Named
from mechdae.types import Booleans, Floats, Sym

SX = ca.SX


def multipliers(model: Model, joint: str, parts: Sequence[str]) -> Sym:
    """Return what of the reaction (Fx, Fy, M) on the second body opens each row, (rows, 3)."""
    ends = model.ends[joint]

    def along(direction: Sym) -> Sym:
        return ca.horzcat(direction.T, SX(1, 1))

    def of(part: str) -> Sym:
        if part in "xy":
            return SX.eye(3)["xy".index(part), :]
        if part == "n":
            return along(ends.normal())
        if part == "turn":
            return SX.eye(3)[2, :]
        if ends.joint.wheels == 2:
            return SX.eye(3)[2, :] / ends.number("ratio")
        a = ends.number("axis")
        return along(ends.second.direction(ca.vertcat(ca.cos(a), ca.sin(a))))

    return ca.densify(ca.vertcat(*[of(part) for part in parts]))


def offsets(gaps: Sequence[JointGap], directions: Sequence[Floats], joints: Named) -> list[Floats]:
    """Return where the reactions hold each joint, (n, rows) by gap.

    Parameters
    ----------
    directions
        By gap, (n, 3 rows), what `multipliers` gives.
    joints
        Of a result with reactions.
    """
    found = []
    for gap, direction in zip(gaps, directions, strict=True):
        reaction = joints[gap.joint].reaction
        matrix = direction.reshape(len(direction), 3, -1).transpose(0, 2, 1)
        found.append(gap.pressed((matrix @ reaction[..., None])[..., 0]))
    return found


def reversals(offset: Floats) -> Booleans:
    """Return where offsets (n, rows) change sides from one pose to the next, (n,)."""
    turned = np.zeros(len(offset), bool)
    with np.errstate(invalid="ignore"):
        turned[1:] = (offset[1:] * offset[:-1]).sum(axis=1) < 0
    return turned
