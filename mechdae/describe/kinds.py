"""The kinds of joints and loads by the names that files give them.

Each is imported when it is first asked for: most mechanisms have few of them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mechdae.additions import Added, Kinds

if TYPE_CHECKING:
    from mechdae.describe.joints.joint import Joint
    from mechdae.describe.loads import Load


def _added(home: str, names: str) -> dict[str, Added]:
    """Return what is in a module by its kind, of ``kind:Class kind:Class``."""
    pairs = (text.split(":") for text in names.split())
    return {kind: Added(f"mechdae.describe.{home}:{name}") for kind, name in pairs}


JOINTS: Kinds[type[Joint]] = Kinds({
    **_added("joints.pairs", "revolute:Revolute prismatic:Prismatic pin-in-slot:PinInSlot "
             "weld:Weld"),
    **_added("joints.wheels", "gear:Gear rack:Rack belt:Belt friction-wheel:FrictionWheel"),
    **_added("joints.pairs", "distance:Distance"),
    **_added("joints.curve", "curve:Curve"),
})  # fmt: skip
SPATIAL_JOINTS: Kinds[type[Joint]] = Kinds({
    **_added("joints.spatial", "revolute:SpatialRevolute prismatic:SpatialPrismatic "
             "cylindrical:Cylindrical spherical:Spherical universal:Universal planar:PlanarPair "
             "screw:Screw weld:SpatialWeld"),
    **_added("joints.pairs", "distance:Distance"),
    **_added("joints.spatial", "gear:SpatialGear rack:SpatialRack"),
})  # fmt: skip
KINDS_OF_JOINTS = {2: JOINTS, 3: SPATIAL_JOINTS}
"""The kinds of joints of a file by its dimension."""
LOADS: Kinds[type[Load]] = Kinds(_added(
    "loads", "force:Force torque:Torque resistance:Resistance spring:Spring table:TableLoad"
))  # fmt: skip
