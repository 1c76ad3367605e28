"""What contacts on curves add."""

from __future__ import annotations

from mechdae.additions import Added, Adds

HERE = "mechdae.motion.cases.curves"
ADDS: Adds = {
    "block solvers": {"on_curve": Added(f"{HERE}.contacts:contact_solver")},
    "choosers": {"on_curve": Added(f"{HERE}.contacts:Contacts")},
    "curve ends": {"on_curve": Added(f"{HERE}.curve_ends:CurveEnds")},
    "cuts": {"on_curve": Added(f"{HERE}.undercut:cuts")},
    "cut events": {"on_curve": Added(f"{HERE}.undercut:cut_events")},
    "runs": {"on_curve": Added(f"{HERE}.curve_corners:without_two_values")},
}
