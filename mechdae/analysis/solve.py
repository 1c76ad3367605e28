"""From a problem to results: dispatch on the kind of the task."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from mechdae.describe.mechanism import Mechanism
from mechdae.describe.problem import Problem, load
from mechdae.describe.table import Table
from mechdae.describe.tasks import (
    Driven,
    Equilibrium,
    Modes,
    Motion,
    Reactions,
    Sensitivity,
    Study,
    Sweep,
    Task,
)
from mechdae.describe.values import Number
from mechdae.errors import InputError, MechdaeError, UnavailableError
from mechdae.results import Result

ELSEWHERE = {"synthesis": ("mechdae.synthesis.synthesize", "synthesize")}
"""Kinds of tasks computed in rooms that build on this one: loaded by name when one is asked."""


def solve(
    problem: Problem | Mechanism | str | Path,
    task: Task | str | None = None,
    *,
    set: Mapping[str, Number] | None = None,
    mode: str | None = None,
    poses: int | None = None,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> Result:
    """Return the result of one task.

    Parameters
    ----------
    problem
        A problem, the name of a predefined one, a file, or a mechanism.
    task
        Name of a task of the problem (default: its first), or a task as a value.
    set
        Sizes, parameters and automatic names to change; a suffix ``_deg``, ``_rpm`` or ``_mm`` is
        a unit.
    mode
        Label of the assembly mode to start on, in place of the sketch.
    poses
        Number of poses, in place of the task's own.
    workers
        Processes of this machine that a study is spread over; 1: this one.
    progress
        Called with the number of sets of a study that are done, and of all.

    Raises
    ------
    InputError
        Something in the description or the call is wrong.
    SolveError
        The mechanism cannot be assembled at its sketch.
    """
    whole = _problem(problem, task)
    if set is not None and not isinstance(set, Mapping):
        raise InputError(f"names and their numbers are needed, not {set!r}", where="set")
    if set:
        whole = whole.with_values(set)
    name, chosen = _task(whole, task)
    try:
        chosen = _changed(chosen, mode, poses)
        _check_workers(workers, chosen)
        if type(chosen) is Sweep:
            from mechdae.analysis.sweep import sweep

            return sweep(whole, name, chosen)
        if isinstance(chosen, Reactions):
            from mechdae.analysis.reactions import reactions

            return reactions(whole, name, chosen)
        if isinstance(chosen, Modes):
            from mechdae.analysis.assembly import modes

            return modes(whole, name, chosen)
        if isinstance(chosen, Motion):
            from mechdae.analysis.motion.task import motion

            return motion(whole, name, chosen)
        if isinstance(chosen, Equilibrium):
            from mechdae.analysis.motion.equilibrium import equilibrium

            return equilibrium(whole, name, chosen)
        if isinstance(chosen, Study):
            from mechdae.analysis.study import study

            return study(whole, name, chosen, workers, progress)
        if isinstance(chosen, Sensitivity):
            from mechdae.analysis.sensitivity import sensitivity

            return sensitivity(whole, name, chosen)
        if chosen.kind in ELSEWHERE:
            module, function = ELSEWHERE[chosen.kind]
            found: Result = getattr(importlib.import_module(module), function)(whole, name, chosen)
            return found
    except MechdaeError as error:
        if isinstance(error, InputError) and not error.where.startswith(
            ("mechanism", "bodies", "joints", "loads", "sketch", "parameters", "outputs.")
        ):
            error.inside(f"tasks.{name}")
        whole.blame(error)
        raise
    raise UnavailableError(
        f"tasks of kind '{chosen.kind}' are not computed by this version",
        where=f"tasks.{name}.kind",
        hint="available: sweep, modes, reactions, motion, equilibrium, study, sensitivity, "
        "synthesis",
    )


def _problem(problem: Problem | Mechanism | str | Path, task: Task | str | None) -> Problem:
    if isinstance(problem, Mechanism):
        if not isinstance(task, Task):
            raise InputError("a mechanism needs a task: solve(mechanism, Sweep(...))")
        return Problem(problem, Table({task.kind: task}))
    return problem if isinstance(problem, Problem) else load(problem)


def _task(problem: Problem, task: Task | str | None) -> tuple[str, Task]:
    if isinstance(task, Task):
        name = next((n for n, known in problem.tasks.items() if known == task), task.kind)
        checked = Problem(problem.mechanism, Table({name: task}))
        return name, checked.tasks[name]
    found = problem.task(task)
    name = next(n for n, known in problem.tasks.items() if known is found)
    return name, found


def _check_workers(workers: int, task: Task) -> None:
    if isinstance(workers, bool) or not isinstance(workers, int) or workers < 1:
        raise InputError("a whole number above 0 is needed", where="workers")
    if workers > 1 and not isinstance(task, Study):
        hint = "synthesize(..., workers=...)" if task.kind == "synthesis" else ""
        raise InputError(
            f"only studies are spread over processes, this is a task of kind '{task.kind}'",
            where="workers",
            hint=hint,
        )


def _changed(task: Task, mode: str | None, poses: int | None) -> Task:
    if mode is not None:
        if not isinstance(task, Driven | Equilibrium) or isinstance(task, Modes):
            raise InputError(f"a task of kind '{task.kind}' does not start on a mode")
        task = replace(task, mode=mode)
    if poses is not None:
        if not isinstance(task, Sweep | Motion):
            raise InputError(f"a task of kind '{task.kind}' has no number of poses")
        task = replace(task, poses=poses)
    return task
