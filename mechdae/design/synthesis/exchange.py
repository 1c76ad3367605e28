"""Optima on the true extremes: nodes move onto them, and the NLP is solved again.

A minimax over nodes, and a limit that is looked at in nodes, are exceeded between them. As in
Remez' algorithm the extremes between the nodes are found, the nearest nodes are put there, and
the optimum is sought again from where it was, until nothing lies between that the nodes do not
see. Where targets may be visited at any time the same is done with the times.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mechdae.design.synthesis.ipopt import Optimum
from mechdae.design.synthesis.nlp import NewValues, Nlp
from mechdae.design.synthesis.search import Search
from mechdae.design.synthesis.starts.spread import Spread
from mechdae.design.synthesis.trace import fallen
from mechdae.types import Floats, Matrix

ROUNDS = 8
KEPT = 1e-7
"""Largest violation of a (dimensionless) constraint after an exchange."""
Change = NewValues
"""Values of variables and parameters of the NLP, by name."""


def exchanged(
    search: Search, nlp: Nlp, found: Optimum, given: dict[str, Any]
) -> tuple[Optimum, dict[str, Any]]:
    """Return the optimum on the true extremes, with the parameters that belong to it."""
    spread = search.spread
    for _ in range(ROUNDS):
        values = nlp.read(found.z)
        change = _change(search, spread, values, given)
        if change is None:
            break
        after = {**given, **change[1]}
        new = nlp.again(nlp.point({**values, **change[0]}), after, found)
        if new.violation > KEPT or not np.isfinite(new.objective):
            break
        count, seconds = found.iterations + new.iterations, found.seconds + new.seconds
        found = replace(new, status=found.status, iterations=count, seconds=seconds)
        given = after
    return found, given


def _change(
    search: Search,
    spread: Spread,
    values: Mapping[str, Floats],
    given: Mapping[str, Floats | float],
) -> Change | None:
    """Return what moves, None where the nodes see all extremes."""
    changes = [goal.refined(spread, values, given) for goal in [*search.goals, *search.limits]]
    changes.append(fallen(spread, values, given))
    unknowns: dict[str, Matrix | list[float]] = {}
    more: dict[str, Floats] = {}
    for change in changes:
        if change is not None:
            unknowns |= change[0]
            more |= change[1]
    return (unknowns, more) if unknowns or more else None
