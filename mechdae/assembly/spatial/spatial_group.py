"""Which way there is to find all poses of a spatial group at once."""

from __future__ import annotations

from typing import Any

from mechdae.assembly.linkage.rigid_parts import OtherShape
from mechdae.assembly.spatial.hinge_loop import HingeLoop
from mechdae.assembly.spatial.six_legs import SixLegs
from mechdae.model.groups import Group
from mechdae.model.reduction import Scene


def spatial_group(scene: Scene, group: Group, p: Any) -> SixLegs | HingeLoop | None:
    """Return the group as a platform on six legs or as a row of six hinges, None for others."""
    if scene.model.mechanism.dimension != 3:
        return None
    for shape in (SixLegs, HingeLoop):
        try:
            return shape(scene, group, p)
        except OtherShape:
            continue
    return None
