"""Graphs of predefined problems: every kind that applies is drawn, and is readable."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file import library
from mechdae.describe.file.problem import Problem
from mechdae.errors import InputError
from tests.shared.predefined import predefined
from tests.shared.readable import assert_readable


def along(task) -> bool:
    """Return whether a task goes along an interval, or along laws."""
    return any(own.from_ is not None or own.range or own.law for own in task.all_drivers)


def driven(problem: Problem) -> list[Any]:
    """Return the tasks with drivers."""
    return [task for task in problem.tasks.values() if hasattr(task, "all_drivers")]


def coarse(problem: Problem, name: str, poses: int = 9) -> md.Result:
    """Return a task with a few poses; cycles without their means, which take long."""
    task = problem.tasks[name]
    few = {} if any(own.at or own.times for own in task.all_drivers) else {"poses": poses}
    quick = {"cycle": False} if task.kind == "reactions" else {}
    return md.solve(problem, replace(task, **few, **quick))


def first_of_each_look() -> list[str]:
    """Return the first problem of each dimension with other joints, and with other tasks."""
    found: dict[object, str] = {}
    for name in library.names():
        problem = predefined(name)
        dimension = problem.mechanism.dimension
        kinds = frozenset(task.kind for task in problem.tasks.values())
        if kinds == {"synthesis"}:
            continue
        joints = frozenset(joint.kind for joint in problem.mechanism.joints.values())
        found.setdefault((dimension, "joints", joints), name)
        found.setdefault((dimension, "tasks", kinds), name)
    return list(found.values())


def drawn_readably(name: str) -> None:
    """Draw what there is of a problem; a kind that does not apply is an error that says so."""
    problem = predefined(name)
    kinds = [task.kind for task in problem.tasks.values()]
    sweeps = [n for n, task in problem.tasks.items() if task.kind == "sweep"]
    sweep = next((n for n in sweeps if along(problem.tasks[n])), None)
    drawn = 0
    if sweep is not None:
        result = coarse(problem, sweep)
        assert_readable(md.plot(result, "curves"))
        if problem.mechanism.dimension == 3:
            with pytest.raises(md.UnavailableError, match="spatial"):
                md.plot(result, "plans")
            assert md.plot(result, "diagram").patches
        elif any(np.ptp(own.position, axis=0).max() > 0 for own in result.points.values()):
            assert_readable(md.plot(result, "coupler"))
        drawn += 1
        with pytest.raises(InputError, match="losses"):
            md.plot(result, "losses")
    if "reactions" in kinds:
        result = coarse(problem, list(problem.tasks)[kinds.index("reactions")])
        assert_readable(md.plot(result, "curves"))
        if problem.mechanism.dimension == 3:
            with pytest.raises(InputError, match="no option 'polar'"):
                md.plot(result, "curves", polar=True)
        else:
            assert_readable(md.plot(result, "curves", polar=True))
        if any("loss" in own for own in result.joints.values()):
            assert_readable(md.plot(result, "losses"))
        drawn += 1
    if "motion" in kinds:
        result = md.solve(problem, list(problem.tasks)[kinds.index("motion")], poses=25)
        assert_readable(md.plot(result, "curves"))
        if problem.mechanism.dimension == 3:
            assert md.plot(result, "diagram").patches
        else:
            assert_readable(md.plot(result, "coupler"))
        drawn += 1
    # test_draw_synthesis.py draws designs; poses that are listed have no curves
    assert drawn or set(kinds) == {"synthesis"} or not any(map(along, driven(problem)))
