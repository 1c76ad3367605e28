"""What wheels that mesh add."""

from __future__ import annotations

from mechdae.additions import Added, Adds

HERE = "mechdae.motion.cases.meshes"
ADDS: Adds = {
    "whole turns": {"meshes": Added(f"{HERE}.turn_lattice:GearedTurns")},
}
