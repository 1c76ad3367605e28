"""What curves, redundant equations and bodies without constraints add to equations."""

from __future__ import annotations

from mechdae.additions import Added, Adds

HERE = "mechdae.equations.cases"
ADDS: Adds = {
    "contacts": {"on_curve": Added(f"{HERE}.curve_contacts:contacts")},
    "blocks": {"superfluous": Added(f"{HERE}.redundant_constraints:redundant_blocks")},
    "left out": {"loose": Added(f"{HERE}.left_out:left_out")},
    "rollers": {"loose": Added("mechdae.describe.spinning_links:rollers")},
    "groups": {"loose": Added(f"{HERE}.left_out:groups_without")},
    "bodies": {"asked for": Added(f"{HERE}.left_out:bodies_asked_for")},
}
