"""Which way there is to find all poses of a spatial group at once."""

from __future__ import annotations

from typing import Any

from mechdae.assembly.linkage.rigid_parts import OtherShape
from mechdae.assembly.spatial.arm_and_hub import ArmAndHub
from mechdae.assembly.spatial.hinge_loop import HingeLoop
from mechdae.assembly.spatial.six_legs import SixLegs
from mechdae.assembly.spatial.three_points import ThreePoints
from mechdae.model.groups import Group
from mechdae.model.reduction import Scene


def spatial_group(
    scene: Scene, group: Group, p: Any
) -> ThreePoints | SixLegs | HingeLoop | ArmAndHub | None:
    """Return the group as platform on three points or six legs, row of six hinges, wishbone."""
    if scene.model.mechanism.dimension != 3:
        return None
    for shape in (ThreePoints, SixLegs, HingeLoop, ArmAndHub):
        try:
            return shape(scene, group, p)
        except OtherShape:
            continue
    return None
