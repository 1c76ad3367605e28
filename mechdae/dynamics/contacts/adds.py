"""What contacts of joints add to motions."""

from __future__ import annotations

from mechdae.additions import Added, Adds

HERE = "mechdae.dynamics.contacts"
ADDS: Adds = {
    "unilateral contacts": {"restitution": Added(f"{HERE}.gaps:unilateral")},
    "opened joints": {"restitution": Added(f"{HERE}.gaps:open_joints")},
    "starts in gaps": {"restitution": Added(f"{HERE}.gaps:start_in_gaps")},
    "touching": {"restitution": Added(f"{HERE}.touching:Touching")},
}
