"""What contacts that are declared one-sided add: where along a task they would have to pull."""

from __future__ import annotations

from mechdae.additions import Added, Adds

HERE = "mechdae.forces.one_sided"
ADDS: Adds = {
    "events of forces": {"one_sided": Added(f"{HERE}.lift_off:along")},
    "notes at rest": {"one_sided": Added(f"{HERE}.lift_off:at_rest")},
    "watchers": {"one_sided": Added(f"{HERE}.lift_off:Lifting")},
    "holding contacts": {"one_sided": Added(f"{HERE}.lift_off:HoldingContacts")},
}
