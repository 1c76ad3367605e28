"""Exact goals with as many equations as unknowns: all solutions as starts of the NLP.

Five poses of a coupler, or as many points as dimensions are free, have finitely many four-bars.
All complex ones are followed from generic numbers and certified; where it is not known how many
there are, those are searched by Levenberg-Marquardt in batches. Four-bars within the bounds that
move on one branch are handed on, in the parameters of the mechanism.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.describe.tasks.goals import Visits
from mechdae.design.synthesis.exact.complete import Follow
from mechdae.design.synthesis.exact.four_bars import four_bars_through, guiding_links, with_cognates
from mechdae.design.synthesis.fourbar.exact import exact_path
from mechdae.design.synthesis.fourbar.linkage import Linkage, paired, poses_of
from mechdae.design.synthesis.fourbar.starts import FourBarStarts
from mechdae.errors import InputError
from mechdae.records import dataclass
from mechdae.types import Floats

SEARCHED = 6
"""Points up to which solutions are searched where paths do not tell how many there are."""
STARTS = 6000
NEAR = 1e-6
"""Share of the mechanism by which a solution may miss the bounds."""
TRIES = 40
"""Places within the bounds from which the parameters of a solution are looked for."""
DIMENSIONS = 9
POSES = 5
BOTH, ORDER = (
    "the targets lie on both branches", "the targets are not visited in order within a turn"
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class WithinBounds:
    """Four-bars of an exact goal within the bounds, with parameters and faults."""

    each: list[tuple[Linkage, Floats, tuple[str, ...]]]
    facts: dict[str, Any]


def solutions(
    starts: FourBarStarts, asked: Visits, seed: int, follow: Follow
) -> WithinBounds | None:
    """Return all four-bars of an exact goal."""
    if asked.measure != "exact" or asked.timing not in ("free", "any"):
        return None
    try:
        return _solutions(starts, asked, seed, follow)
    except InputError as error:
        raise error.inside("goal") from None


def freedoms_left(starts: FourBarStarts, asked: Visits) -> int:
    """Return how many numbers an exact goal leaves free: its four-bars are as large a family."""
    if asked.measure != "exact" or asked.timing not in ("free", "any"):
        return 0
    count, given = len(asked.targets), len(starts.given())
    if asked.is_motion:
        # of each of the two guiding links a pin and a pivot, less a length for each further pose
        return max(2 * (POSES - count) - given, 0)
    return max(DIMENSIONS - count - given, 0)


def _solutions(
    starts: FourBarStarts, asked: Visits, seed: int, follow: Follow
) -> WithinBounds | None:
    targets = np.array(asked.targets)
    given = starts.given()
    if asked.is_motion:
        if len(targets) != POSES or given:
            return None
        poses = poses_of(targets)
        links, every = guiding_links(poses, follow=follow)
        found, facts = list(paired(poses, links)), every.facts()
    else:
        if len(targets) + len(given) != DIMENSIONS:
            return None
        counted = four_bars_through(targets, given, follow=follow)
        if counted is None:
            if len(targets) > SEARCHED:
                return None
            found = list(exact_path(targets, given, starts=STARTS, seed=seed).designs)
            facts = {"verdict": "found", "basis": "none", "real": len(found)}
        else:
            found = list(counted.designs) if given else with_cognates(counted)
            facts = counted.every.facts()
    result = []
    for each in found:
        met = NEAR * starts.space.size
        d, miss = starts.fitted(each, each.frame, tries=TRIES, met=met)
        if miss <= met:
            result.append((each, d, _faults(each, asked)))
    faults = [text for *_, reasons in result for text in reasons]
    facts["within"] = len(result)
    facts["faults"] = {text: faults.count(text) for text in dict.fromkeys(faults)}
    facts["faultless"] = sum(not reasons for *_, reasons in result)
    return WithinBounds(result, facts)


def _faults(each: Linkage, asked: Visits) -> tuple[str, ...]:
    """Return what keeps a solution from moving through its targets, as the optimiser asks it."""
    found = []
    if each.branch == 0:
        found.append(BOTH)
    if asked.timing == "free" and each.sense == 0:
        found.append(ORDER)
    return tuple(found)
