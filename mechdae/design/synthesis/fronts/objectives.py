"""Names and units of objectives, as fronts report them."""

from __future__ import annotations

from mechdae.describe.coordinates import unit_of
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.goals import (
    Asked,
    Extreme,
    FunctionTargets,
    Rocker,
    StraightLine,
    Visits,
)
from mechdae.results.units import path_unit


def objective_name(goal: Asked) -> str:
    if isinstance(goal, Extreme):
        single = goal.path.startswith("summary/")
        return goal.of if single else f"{goal.reduce} of {goal.of}"
    if isinstance(goal, Visits):
        return f"error of {goal.what}"
    if isinstance(goal, FunctionTargets):
        return f"error of {goal.output}"
    assert isinstance(goal, StraightLine | Rocker)
    return f"deviation of {goal.point}" if isinstance(goal, StraightLine) else goal.coordinate


def objective_unit(problem: Problem, goal: Asked) -> str:
    """Return the unit of an objective's value; empty where it is not known."""
    if isinstance(goal, Extreme):
        return path_unit(problem.mechanism, goal.path)
    if isinstance(goal, Visits):
        return "m" if goal.measure == "minimax" else "m2"
    if isinstance(goal, FunctionTargets):
        unit = unit_of(problem.mechanism, goal.output) or ""
        return unit if goal.measure == "minimax" or not unit else f"{unit}2"
    return "1"


def error_unit(problem: Problem, goal: Asked) -> str:
    """Return the unit of the errors that a goal's designs list."""
    if isinstance(goal, FunctionTargets):
        return unit_of(problem.mechanism, goal.output) or ""
    if isinstance(goal, Rocker):
        return "m" if goal.slides else "rad"
    return "" if isinstance(goal, Extreme) else "m"
