"""A point along a straight line: largest deviation by the stroke, the way that it goes."""

from __future__ import annotations

import numpy as np

from mechdae.describe.tasks.goals import StraightLine
from mechdae.describe.tasks.kinds import Driver, Sweep
from mechdae.design.synthesis.robust.values import of_largest
from mechdae.design.synthesis.verification.claims import Claim, Stated, Worth
from mechdae.design.synthesis.verification.design_file import DesignFile

FINE = 721
"""Places at which a line is looked at."""
BACK = 1e-5
"""Share of the stroke by which the point may move back between the nodes."""
STROKE = 1e-7
"""Share by which the stroke may differ from the one that is asked for."""


def measured(stated: Stated, claim: Claim, design: DesignFile) -> Worth:
    """Return deviations from a line, and the largest of them by the stroke."""
    asked = stated.asked
    assert isinstance(asked, StraightLine)
    fine = np.linspace(0, 1, FINE)
    shares = np.unique([*fine, *claim.between])
    at = float(claim.at[0]) + asked.arc * shares
    found, defects = design.swept(at, (asked.point,))
    if found is None:
        return Worth(np.inf, np.full(FINE, np.nan), defects)
    places = found.points[asked.point].position
    along = places @ np.array([np.cos(claim.direction), np.sin(claim.direction)])
    normal = np.array([-np.sin(claim.direction), np.cos(claim.direction)])
    errors = places @ normal - claim.offset
    stroke = float(along[-1] - along[0])
    back = float(np.max(np.maximum.accumulate(along) - along))
    if back > BACK * stroke:
        defects.append(f"the point moves back by {back:.3g} within the stroke")
    if asked.stroke is not None and not abs(stroke - asked.stroke) <= STROKE * asked.stroke:
        defects.append(f"the stroke is {stroke:.6g} m, not {asked.stroke:.6g} m")
    value, parts = float(np.abs(errors).max()) / stroke, None
    if stated.robust is not None:
        task = Sweep(Driver(design.driver, at=tuple(float(u) for u in at)))
        path = f"points/{asked.point}/position"
        slopes = design.slopes(task, (path,), stated.robust.names)[path][1]
        slopes = normal @ slopes * stated.robust.sigmas
        value, parts = of_largest(np.abs(errors), slopes[:, None], stated.robust.factor, stroke)
    return Worth(value, errors[np.isin(shares, fine)], defects, parts)
