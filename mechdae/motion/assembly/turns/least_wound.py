"""Modes in space that differ by whole turns of wheels and screws: the least turned is meant.

A sketch says nothing of most wheels. Where it does not tell modes apart that differ by whole turns
of a wheel on its bearing, or of a screw, the one is taken whose angles are nearest to those that
are sketched, in their absence to zero.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from mechdae.describe.joints.bearings import bearings
from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene

if TYPE_CHECKING:
    from mechdae.types import Floats


WHOLE = 1e-6
"""Share of a turn by which turns may differ from whole ones."""


def wound(scene: Scene, groups: Sequence[Group]) -> list[list[str]]:
    """Return the angles of each mesh and screw of groups: of a mesh those of its bearings."""
    mechanism, found = scene.model.mechanism, []
    for name in (name for group in groups for name in group.joints):
        joint = mechanism.joints[name]
        if joint.winds:
            found.append([f"{name}.angle"])
        elif joint.meshes:
            both = bearings(mechanism, joint)
            found.append([f"{b.joint}.{b.word}" for b in both if b.word.startswith("angle")])
    return found


def least_wound(
    near: list[Floats], angles: list[list[str]], turned: Callable[[str, Any], float]
) -> list[Floats]:
    """Return poses without those that are others turned further.

    Parameters
    ----------
    near
        Poses.
    angles
        Of each mesh and screw; in each of them one has to differ by whole turns.
    turned
        (angle, pose) -> how far it is turned from what is sketched [rad].
    """
    values = [{name: turned(name, x) for names in angles for name in names} for x in near]

    def turns(name: str, i: int, k: int) -> float:
        return (values[i][name] - values[k][name]) / (2 * math.pi)

    def further(i: int, k: int) -> bool:
        found = []
        for names in angles:
            whole = [
                round(turn) for turn in (turns(n, i, k) for n in names)
                if abs(turn - round(turn)) < WHOLE
            ]  # fmt: skip
            if not whole:
                return False
            found += whole
        far, other = (math.hypot(*values[j].values()) for j in (i, k))
        return any(found) and far - other > WHOLE

    every = range(len(near))
    return [x for i, x in enumerate(near) if not any(further(i, k) for k in every)]
