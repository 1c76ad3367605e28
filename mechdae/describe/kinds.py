"""The kinds of joints and loads by the names that files give them.

Each is imported when it is first asked for: most mechanisms have few of them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mechdae.additions import Kinds, added_of

if TYPE_CHECKING:
    from mechdae.describe.joints.joint import Joint
    from mechdae.describe.loads import Load


HOME = "mechdae.describe"
JOINTS: Kinds[type[Joint]] = Kinds(added_of(f"{HOME}.joints", {
    "revolute": "pairs:Revolute", "prismatic": "pairs:Prismatic", "pin-in-slot": "pairs:PinInSlot",
    "weld": "pairs:Weld", "gear": "wheels:Gear", "rack": "wheels:Rack", "belt": "wheels:Belt",
    "friction-wheel": "wheels:FrictionWheel", "distance": "pairs:Distance", "curve": "curve:Curve",
}))  # fmt: skip
SPATIAL_JOINTS: Kinds[type[Joint]] = Kinds(added_of(f"{HOME}.joints", {
    "revolute": "spatial:SpatialRevolute", "prismatic": "spatial:SpatialPrismatic",
    "cylindrical": "spatial:Cylindrical", "spherical": "spatial:Spherical",
    "universal": "spatial:Universal", "planar": "spatial:PlanarPair", "screw": "spatial:Screw",
    "weld": "spatial:SpatialWeld", "distance": "pairs:Distance", "gear": "spatial:SpatialGear",
    "rack": "spatial:SpatialRack",
}))  # fmt: skip
KINDS_OF_JOINTS = {2: JOINTS, 3: SPATIAL_JOINTS}
"""The kinds of joints of a file by its dimension."""
LOADS: Kinds[type[Load]] = Kinds(added_of(HOME, {
    "force": "loads:Force", "torque": "loads:Torque", "resistance": "loads:Resistance",
    "spring": "loads:Spring", "table": "loads:TableLoad",
}))  # fmt: skip
