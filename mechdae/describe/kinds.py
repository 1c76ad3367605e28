"""The kinds of joints and loads by the names that files give them.

Each is imported when it is first asked for: most mechanisms have few of them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mechdae.additions import Added, Kinds

if TYPE_CHECKING:
    from mechdae.describe.joints.joint import Joint
    from mechdae.describe.loads import Load

PAIRS = "mechdae.describe.joints.pairs"
WHEELS = "mechdae.describe.joints.wheels"
SPATIAL = "mechdae.describe.joints.spatial"
ON_LOADS = "mechdae.describe.loads"

JOINTS: Kinds[type[Joint]] = Kinds({
    "revolute": Added(f"{PAIRS}:Revolute"),
    "prismatic": Added(f"{PAIRS}:Prismatic"),
    "pin-in-slot": Added(f"{PAIRS}:PinInSlot"),
    "weld": Added(f"{PAIRS}:Weld"),
    "gear": Added(f"{WHEELS}:Gear"),
    "rack": Added(f"{WHEELS}:Rack"),
    "belt": Added(f"{WHEELS}:Belt"),
    "friction-wheel": Added(f"{WHEELS}:FrictionWheel"),
    "distance": Added(f"{PAIRS}:Distance"),
    "curve": Added("mechdae.describe.joints.curve:Curve"),
})  # fmt: skip
SPATIAL_JOINTS: Kinds[type[Joint]] = Kinds({
    "revolute": Added(f"{SPATIAL}:SpatialRevolute"),
    "prismatic": Added(f"{SPATIAL}:SpatialPrismatic"),
    "cylindrical": Added(f"{SPATIAL}:Cylindrical"),
    "spherical": Added(f"{SPATIAL}:Spherical"),
    "universal": Added(f"{SPATIAL}:Universal"),
    "planar": Added(f"{SPATIAL}:PlanarPair"),
    "screw": Added(f"{SPATIAL}:Screw"),
    "weld": Added(f"{SPATIAL}:SpatialWeld"),
    "distance": Added(f"{PAIRS}:Distance"),
    "gear": Added(f"{SPATIAL}:SpatialGear"),
    "rack": Added(f"{SPATIAL}:SpatialRack"),
})  # fmt: skip
KINDS_OF_JOINTS = {2: JOINTS, 3: SPATIAL_JOINTS}
"""The kinds of joints of a file by its dimension."""
LOADS: Kinds[type[Load]] = Kinds({
    "force": Added(f"{ON_LOADS}:Force"),
    "torque": Added(f"{ON_LOADS}:Torque"),
    "resistance": Added(f"{ON_LOADS}:Resistance"),
    "spring": Added(f"{ON_LOADS}:Spring"),
    "table": Added(f"{ON_LOADS}:TableLoad"),
})  # fmt: skip
