"""What groups in space add."""

from __future__ import annotations

from mechdae.additions import Added, Adds

HERE = "mechdae.motion.cases.space"
ADDS: Adds = {
    "sketched angles": {"space": Added(f"{HERE}.orientation_checks:angles_from_sketch")},
    "reaches": {"space": Added("mechdae.kernels.graphs.row_reaches:RowReaches")},
    "choosers": {"space": Added(f"{HERE}.orientation_checks:OrientationChecks")},
    "finders by paths": {"space": Added(f"{HERE}.spatial_group:spatial_group")},
    "whole turns": {"space": Added("mechdae.motion.cases.meshes.turn_lattice:GearedTurns")},
}
