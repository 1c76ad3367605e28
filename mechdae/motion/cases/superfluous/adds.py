"""What redundant equations add."""

from __future__ import annotations

from mechdae.additions import Added, Adds

HERE = "mechdae.motion.cases.superfluous"
ADDS: Adds = {
    "block solvers": {"superfluous": Added(f"{HERE}.redundant:redundant_solver")},
    "choosers": {"superfluous": Added(f"{HERE}.closing:ClosedPoses")},
    "closing": {"superfluous": Added(f"{HERE}.closing:Closing")},
}
