"""What many poses add."""

from __future__ import annotations

from mechdae.additions import Added, Adds

HERE = "mechdae.motion.cases.many"
ADDS: Adds = {
    "poses": {"many": Added(f"{HERE}.many_poses:in_blocks")},
}
