"""What steps that are not proved add."""

from __future__ import annotations

from mechdae.additions import Added, Adds

HERE = "mechdae.motion.cases.hard_steps"
ADDS: Adds = {
    "finders of obstacles": {"all": Added(f"{HERE}.finders:Finders")},
    "poses near change points": {"all": Added(f"{HERE}.crossings.near_change_point:ZonePoses")},
    "steps of long chains": {"all": Added(f"{HERE}.quintic_steps:QuinticSteps")},
    "past a step": {
        "change points": Added(f"{HERE}.obstacles:past_change_point"),
        "limit positions": Added(f"{HERE}.obstacles:past_limit"),
        "power series": Added(f"{HERE}.obstacles:by_series"),
        "ends": Added(f"{HERE}.obstacles:to_end"),
    },
}
