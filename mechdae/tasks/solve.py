"""From a problem to results: every kind of task."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from mechdae.describe.file.load import Source, chosen
from mechdae.describe.tasks.kinds import Task
from mechdae.describe.units import SI, Units
from mechdae.describe.values import Number
from mechdae.errors import InputError, MechdaeError
from mechdae.records import public
from mechdae.results import Result
from mechdae.tasks.dispatch.solve import KINDS, run


@public
def solve(
    problem: Source,
    task: Task | str | None = None,
    *,
    set: Mapping[str, Number] | None = None,
    mode: str | None = None,
    poses: int | None = None,
    units: str | Units = SI,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> Result:
    """Return the result of one task.

    Parameters
    ----------
    problem
        A problem, the name of a predefined one, a file, a mechanism, or a result.
    task
        Name of a task of the problem (default: its first), or a task as a value.
    set
        Sizes, parameters and automatic names to change; a suffix such as ``_deg`` or ``_mm`` is
        a unit.
    mode
        Label of the assembly mode to start on, in place of the sketch.
    poses
        Number of poses, in place of the task's own.
    units
        What the result is shown in, such as ``"mm,deg"``; its arrays stay SI.
    workers
        Processes of this machine that a study is spread over; 1: this one.
    progress
        Called with the number of sets of a study that are done, and of all.

    Returns
    -------
    Result
        Of the class of its task: a `SweepResult`, `ReactionsResult`, `MotionResult`, ...

    Raises
    ------
    InputError
        Something in the description or the call is wrong.
    SolveError
        The mechanism cannot be assembled at its sketch.

    Examples
    --------
    >>> result = md.solve("four-bar-crank-rocker", "turn", poses=5)
    >>> result.points["coupler.P"].position.shape
    (5, 2)
    >>> round(result.value("summary/swing/rocker"), 4)
    1.2877
    """
    whole, name = chosen(problem, task, set)
    meant = whole.tasks[name]
    try:
        wanted = _changed(meant, mode, poses)
        _check_workers(workers, meant)
    except MechdaeError as error:
        if isinstance(error, InputError):
            error.inside(f"tasks.{name}")
        whole.blame(error)
        raise
    options = {"workers": workers, "progress": progress} if _spreads(meant) else {}
    if wanted is not meant:
        whole = whole.with_task(name, wanted)
    return run(whole, name, units, **options).in_units(units)


def _spreads(task: Task) -> bool:
    """Return whether a task consists of many computations."""
    return task.kind in KINDS and KINDS[task.kind].spread


def _check_workers(workers: int, task: Task) -> None:
    if isinstance(workers, bool) or not isinstance(workers, int) or workers < 1:
        raise InputError("a whole number above 0 is needed", where="workers")
    if workers > 1 and not _spreads(task):
        hint = "synthesize(..., workers=...)" if task.kind == "synthesis" else ""
        raise InputError(
            f"only studies are spread over processes, this is a task of kind '{task.kind}'",
            where="workers",
            hint=hint,
        )


def _changed(task: Task, mode: str | None, poses: int | None) -> Task:
    changes: dict[str, object] = {}
    if mode is not None:
        if not task.on_mode:
            raise InputError(f"a task of kind '{task.kind}' does not start on a mode")
        changes["mode"] = mode
    if poses is not None:
        if not hasattr(task, "poses"):
            raise InputError(f"a task of kind '{task.kind}' has no number of poses")
        changes["poses"] = poses
    return replace(task, **changes) if changes else task
