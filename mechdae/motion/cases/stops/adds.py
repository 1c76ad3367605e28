"""What limits of joints add."""

from __future__ import annotations

from mechdae.additions import Added, Adds

HERE = "mechdae.motion.cases.stops"
ADDS: Adds = {
    "arcs": {"limits": Added(f"{HERE}.stops:cut")},
    "runs": {"limits": Added(f"{HERE}.stops:mark")},
    "stops": {"limits": Added(f"{HERE}.stops:beyond")},
    "passed stops": {"limits": Added(f"{HERE}.stops:passed")},
}
