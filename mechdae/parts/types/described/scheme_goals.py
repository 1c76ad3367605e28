"""Goals of a composition that are goals of a synthesis too: a path by points, a function."""

from __future__ import annotations

import math

from mechdae.describe.tasks.goals import FunctionTargets, GoalDescription, PathGoal, Visits
from mechdae.errors import InputError, MechdaeError, UnknownName
from mechdae.records import dataclass

INPUT = "crank.angle"
OUTPUTS = ("angle", "slide")
"""What the output of a function is: a link on the frame turns, or a block slides on it."""
NODES = 41
"""Places of the input of a function that is given by a formula."""
FEWEST = 3
"""Targets of a path, and of a function: two lie on a line of any scheme."""


@dataclass(frozen=True)
class FunctionNodes:
    """A function by places: input and output (k,) from their starts [rad, rad or m].

    ``slides``: the output is the slide of a block on the frame, not the angle of a link.
    ``input_start``, ``output_start``: values of the coordinates at the first place; None: free.
    ``minimax``: the largest error counts, not the root of the mean square.
    """

    inputs: tuple[float, ...]
    outputs: tuple[float, ...]
    slides: bool
    input_start: float | None
    output_start: float | None
    minimax: bool


def asked_path(goal: PathGoal) -> Visits:
    """Return the targets of a path, of a goal with plain numbers."""
    _no_weight(goal)
    if goal.point is not None:
        raise InputError(
            "a composition chooses the tracing point itself", where="point",
            hint="leave it out; designs call it P",
        )  # fmt: skip
    if goal.measure == "exact":
        raise InputError(
            "errors of schemes are made small, not zero", where="measure",
            hint='"least-squares" or "minimax"; within = { error = ... } is a limit',
        )  # fmt: skip
    found = goal.visits("link.P", "targets", 2)
    if len(set(found.targets)) < FEWEST:
        raise InputError(f"{FEWEST} different points or more are needed", where="targets")
    if found.programme:
        word = "at" if found.timing == "absolute" else "steps"
        _within_turn([angle - found.programme[0] for angle in found.programme], word, found.closed)
    return found


def asked_function(goal: FunctionTargets) -> FunctionNodes:
    """Return the places of a function, of a goal with plain numbers."""
    _no_weight(goal)
    if goal.input not in (None, INPUT):
        raise InputError(
            "the input of a composition is the angle of its crank", where="input",
            hint=f'leave it out, or "{INPUT}"',
        )  # fmt: skip
    output = goal.output or OUTPUTS[0]
    if output not in OUTPUTS:
        raise UnknownName("output", output, OUTPUTS, where="output")
    goal.check_given()
    if goal.measure == "exact" or goal.sense == "free":
        word = "measure" if goal.measure == "exact" else "sense"
        raise InputError(
            "errors of schemes are made small, not zero" if word == "measure"
            else "the output of a composition turns as its values say", where=word,
            hint='"least-squares" or "minimax"' if word == "measure" else "values the other way",
        )  # fmt: skip
    starts = []
    for word in ("input_start", "output_start"):
        value = getattr(goal, word)
        try:
            starts.append(None if value is None else _number(value))
        except MechdaeError as problem:
            raise problem.inside(word) from None
    try:
        inputs, outputs = goal.scales([k / (NODES - 1) for k in range(NODES)])
    except MechdaeError as problem:
        raise problem.inside("function") from None
    if not all(map(math.isfinite, (*inputs, *outputs))):
        raise InputError("has no value somewhere in its range", where="function")
    if goal.targets:
        first = goal.targets[0]
        starts = [start if start is not None else first[k] for k, start in enumerate(starts)]
    where = "targets" if goal.targets else "input_range"
    if len(set(inputs)) < min(FEWEST, len(inputs)) or len(inputs) < FEWEST:
        raise InputError(f"{FEWEST} different inputs or more are needed", where=where)
    if max(outputs) - min(outputs) <= 0:
        raise InputError("the output is the same everywhere", where=where)
    _within_turn(inputs, where, False)
    return FunctionNodes(
        tuple(inputs), tuple(outputs), output == "slide", starts[0], starts[1],
        goal.measure == "minimax",
    )  # fmt: skip


def _number(value: float) -> float:
    from mechdae.describe.expression import evaluate

    return float(evaluate(value, {}))


def _no_weight(goal: GoalDescription) -> None:
    if goal.weight != 1.0:
        raise InputError("a composition has one goal, it needs no weight", where="weight")


def _within_turn(steps: list[float], where: str, closed: bool) -> None:
    """Raise for angles of the crank that spread over more than a turn, or over nothing."""
    spread = max(steps) - min(steps)
    if spread <= 0:
        raise InputError("the crank stands still", where=where)
    if spread > 2 * math.pi * (1 + 1e-9):
        raise InputError(
            f"the crank turns by {math.degrees(spread):.6g} degrees, a composition looks at one "
            "turn", where=where, hint="angles within 360 degrees",
        )  # fmt: skip
    if closed and spread > 2 * math.pi * (1 - 1e-9):
        raise InputError(
            "a closed path has its first target at the end by itself", where=where,
            hint="leave out the target after a whole turn",
        )  # fmt: skip
