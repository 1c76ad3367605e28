"""What `show` says of a task of composition."""

from __future__ import annotations

from typing import Any

from mechdae.describe import Problem
from mechdae.errors import MechdaeError
from mechdae.parts.types.described.composition import asked_of
from mechdae.parts.types.described.task import Composition


def scheme_structure(problem: Problem, task: Composition, _model: object = None) -> dict[str, Any]:
    entry = {"kind": task.kind, "available": True}
    try:
        demand = asked_of(task, problem.mechanism.parameter_values)
    except MechdaeError as error:
        return {**entry, "error": str(error)}
    return {
        **entry,
        "goals": [demand.kind],
        "objectives": list(demand.objectives),
        "chains": list(demand.chains or [f"{number} links" for number in demand.links]),
        "starts": demand.starts,
        "seed": demand.seed,
    }
