"""What laws of time, and several drivers, add."""

from __future__ import annotations

from mechdae.additions import Added, Adds

HERE = "mechdae.motion.cases.laws"
ADDS: Adds = {
    "driver plans": {"laws": Added(f"{HERE}.laws:by_laws")},
    "courses": {"several drivers": Added(f"{HERE}.laws:on_course")},
}
