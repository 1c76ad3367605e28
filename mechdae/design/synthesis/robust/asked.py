"""Which goals of a task are robust, and what of it is refused."""

from __future__ import annotations

from collections.abc import Sequence

from mechdae.describe.tasks.goals import FunctionTargets
from mechdae.describe.tasks.synthesis import Demand
from mechdae.design.synthesis.goals.base import Goal
from mechdae.design.synthesis.poses import FreePoses
from mechdae.design.synthesis.robust.deviations import Deviations
from mechdae.errors import InputError, UnavailableError


def robust_goals(asked: Demand, poses: FreePoses, goals: Sequence[Goal]) -> Deviations | None:
    """Give goals the deviations by the tolerances of a task; None where none are asked for."""
    if asked.robust is None:
        return None
    found = Deviations(poses, asked.tolerances, asked.robust)
    counted = [goal for goal in goals if not goal.exact]
    for goal, (term, _) in zip(goals, asked.goals, strict=True):
        if not any(goal.deviates for goal in counted):
            raise UnavailableError(
                f"deviations of {counted[0].words} by tolerances are not computed",
                where="robust",
                hint="robust is for paths, motions, functions, straight lines and quantities at "
                "the poses of sweeps and reactions",
            )  # fmt: skip
        if goal.exact or not goal.deviates:
            continue
        starts = (term.input_start, term.output_start) if isinstance(term, FunctionTargets) else ()
        for name in starts:
            if name in asked.tolerances:
                raise InputError(
                    f"'{name}' is where a scale starts: it is set, it does not deviate",
                    where=f"tolerances.{name}",
                )
        goal.deviations = found
    robust = [goal for goal in goals if goal.deviations is not None]
    for name in found.unmoved:
        if any(goal.moved_by(name) for goal in robust):
            continue
        raise InputError(
            f"no goal depends on '{name}'", where=f"tolerances.{name}",
            hint="leave it out, or give the tolerance of what the goal depends on",
        )  # fmt: skip
    return found


def nominal_notes(goals: Sequence[Goal]) -> list[str]:
    """Return notes on goals of a robust task to which nothing is added."""
    return [
        f"{goal.words}: the value of the dimensions as they are named, without their tolerances"
        for goal in goals if not goal.exact and goal.deviations is None
    ]  # fmt: skip
