"""Exact goals with as many equations as unknowns: all solutions as starts of the NLP.

Five poses of a coupler, or as many points as dimensions are free, have finitely many four-bars;
they are found by Levenberg-Marquardt in batches. Those within the bounds that move on one
branch are handed on, in the parameters of the mechanism.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.describe.tasks.goals import Visits
from mechdae.synthesis.fourbar.dyads import dyads, paired, poses_of
from mechdae.synthesis.fourbar.exact import exact_path
from mechdae.synthesis.fourbar.linkage import Linkage
from mechdae.synthesis.fourbar.starts import FourBarStarts

SEARCHED = 6
"""Points up to which all solutions are searched; beyond, starts come from the screening."""
STARTS = 6000
NEAR = 1e-6
"""Share of the mechanism by which a solution may miss the bounds."""
TRIES = 40
"""Places within the bounds from which the parameters of a solution are looked for."""
DIMENSIONS = 9
POSES = 5


def solutions(
    starts: FourBarStarts, asked: Visits, seed: int
) -> list[tuple[Linkage, Any, tuple[str, ...]]] | None:
    """Return all four-bars of an exact goal within the bounds, their parameters and faults.

    None where there are not as many equations as unknowns.
    """
    targets = np.array(asked.targets)
    given = starts.given()
    if asked.measure != "exact" or asked.timing not in ("free", "any"):
        return None
    if asked.is_motion:
        if len(targets) != POSES or given:
            return None
        poses = poses_of(targets)
        found = paired(poses, dyads(poses, seed=seed))
    else:
        if len(targets) > SEARCHED or len(targets) + len(given) != DIMENSIONS:
            return None
        found = exact_path(targets, given, starts=STARTS, seed=seed).designs
    result = []
    for each in found:
        met = NEAR * starts.space.size
        d, miss = starts.fitted(each, each.frame, tries=TRIES, met=met)
        if miss <= met:
            result.append((each, d, _faults(each, asked)))
    return result


def _faults(each: Linkage, asked: Visits) -> tuple[str, ...]:
    """Return what keeps a solution from moving through its targets, as the optimiser asks it."""
    found = []
    if each.branch == 0:
        found.append("the targets lie on both branches")
    if asked.timing == "free" and each.sense == 0:
        found.append("the targets are not visited in order within a turn")
    return tuple(found)
