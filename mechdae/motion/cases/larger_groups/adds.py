"""What groups without a closed form add."""

from __future__ import annotations

from mechdae.additions import Added, Adds

HERE = "mechdae.motion.cases.larger_groups"
ADDS: Adds = {
    "finders": {"plane": Added(f"{HERE}.three_legs:truss")},
    "finders by paths": {"plane": Added(f"{HERE}.linkage_group:linkage_group")},
}
