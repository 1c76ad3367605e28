"""What contacts on curves add."""

from __future__ import annotations

from mechdae.additions import Added, Adds

HERE = "mechdae.motion.cases.curves"
ADDS: Adds = {
    "block solvers": {"curves": Added(f"{HERE}.contacts:contact_solver")},
    "choosers": {"curves": Added(f"{HERE}.contacts:Contacts")},
    "runs": {"curves": Added(f"{HERE}.curve_corners:without_two_values")},
}
