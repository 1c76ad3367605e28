"""Which way there is to find all poses of a spatial group at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene
from mechdae.motion.cases.larger_groups.rigid_parts import ShapedGroup, shaped
from mechdae.motion.cases.space.arm_and_hub import ArmAndHub
from mechdae.motion.cases.space.hinge_loop import HingeLoop
from mechdae.motion.cases.space.six_legs import SixLegs
from mechdae.motion.cases.space.three_points import ThreePoints

if TYPE_CHECKING:
    from mechdae.types import Floats


def spatial_group(scene: Scene, group: Group, p: Floats) -> ShapedGroup | None:
    """Return the group as platform on three points or six legs, row of six hinges, wishbone."""
    if scene.model.mechanism.dimension != 3:
        return None
    return shaped((ThreePoints, SixLegs, HingeLoop, ArmAndHub), scene, group, p)
