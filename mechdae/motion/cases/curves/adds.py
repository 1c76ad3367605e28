"""What contacts on curves add."""

from __future__ import annotations

from mechdae.additions import Added, Adds

HERE = "mechdae.motion.cases.curves"
ADDS: Adds = {
    "block solvers": {"curves": Added(f"{HERE}.contacts:contact_solver")},
    "choosers": {"curves": Added(f"{HERE}.contacts:Contacts")},
    "curve ends": {"curves": Added(f"{HERE}.curve_ends:CurveEnds")},
    "cuts": {"curves": Added(f"{HERE}.undercut:cuts")},
    "cut events": {"curves": Added(f"{HERE}.undercut:cut_events")},
    "runs": {"curves": Added(f"{HERE}.curve_corners:without_two_values")},
}
