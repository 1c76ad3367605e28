"""Bands to first order as expressions of the pose, for derivatives by any number of the mechanism.

The linear forms y_q Phi_q^-1 are what the multipliers of the constraints say; the support function
of each gap along them is what its clearance adds.
"""

from __future__ import annotations

import casadi as ca

from mechdae.describe.joints.joint import GAPS
from mechdae.equations.gaps import opened
from mechdae.equations.reduction import Scene
from mechdae.parts.play.bands import BandGraphs
from mechdae.parts.play.gaps import support
from mechdae.parts.play.run import TURNS, WIDEST
from mechdae.types import Sym

SX = ca.SX
TINY = 1e-60
"""Below roots, so that they have a derivative where no clearance moves the output."""


def band(scene: Scene, path: str) -> Sym:
    """Return the band of a ``path`` like ``points/rod.P/distance_band`` over (x, u, p)."""
    graphs = BandGraphs(scene, [path.removesuffix("_band").replace("/distance", "/position")])
    jacobian = ca.jacobian(graphs.phi, graphs.q)
    forms = ca.solve(jacobian.T, graphs.y_q.T).T
    if path.endswith("/distance_band"):
        found = WIDEST * ca.mmax(_sizes(graphs, ca.DM(TURNS).T @ forms))
    else:
        found = _sizes(graphs, forms)
    return scene.expression(found)


def _sizes(graphs: BandGraphs, forms: Sym) -> Sym:
    """Return the largest values of linear forms (k, rows) of the offsets in the equations, (k,)."""
    model, total = graphs.model, SX.zeros(forms.size1())
    for name, joint in model.mechanism.joints.items():
        rows = {row.part: k for k, row in enumerate(graphs.rows) if row.owner == name}
        for key in GAPS:
            if f"{name}.{key}" in model.numbers and rows:
                centres = ca.norm_2(model.ends[name].gap) if joint.wheels == 2 else None
                reach = opened(joint, key, model.numbers, centres)
                parts = [forms[:, rows[part]] for part in reach]
                total += support(joint.hinge, parts, list(reach.values()), TINY)
    return total
