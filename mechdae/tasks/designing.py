"""Tasks that look for designs, as jobs: dimensions of one mechanism, or schemes with dimensions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from pathlib import Path

from mechdae.additions import at_home
from mechdae.describe.file.load import Source, given
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.kinds import Task
from mechdae.describe.units import SI, Units
from mechdae.describe.values import Number
from mechdae.design.jobs.call import JobCall, task_named
from mechdae.records import public
from mechdae.results import SynthesisResult
from mechdae.tasks.dispatch.solve import KINDS


def _looks_for_designs(task: Task) -> bool:
    return task.kind in KINDS and bool(KINDS[task.kind].design)


def designing_task(problem: Problem, task: str | None) -> tuple[str, Task]:
    """Return name and task that is meant: the one named, or the first that looks for designs."""
    name = task_named(problem, task, _looks_for_designs)
    return name, problem.tasks[name]


@public
def synthesize(
    problem: Source,
    task: Task | str | None = None,
    *,
    set: Mapping[str, Number] | None = None,
    units: str | Units = SI,
    starts: int | None = None,
    seed: int | None = None,
    workers: int = 1,
    executor: Executor | None = None,
    out: str | Path | None = None,
    progress: Callable[[int, int, float | None], None] | None = None,
    paths: Callable[[int, int], None] | None = None,
) -> SynthesisResult:
    """Return the designs of a task of synthesis, or of composition, best first.

    The answer depends on the problem, the number of starts and the seed alone: not on where the
    starts are solved, nor on whether the job was broken off and begun again.

    Parameters
    ----------
    problem
        A problem, the name of a predefined one, a file, a mechanism, or a result.
    task
        Name of a task (default: the first of kind synthesis or composition), or a task as a value.
    set, units
        As of `md.solve`.
    starts, seed
        In place of the task's own.
    workers
        Processes of this machine; 1: this one.
    executor
        Solves the starts in place of own processes; it is not shut down.
    out
        Folder with the log of finished starts, ``starts.jsonl`` (of a composition
        ``pieces.jsonl``): a job that was broken off goes on there, and so does one with more.
    progress
        Called with the number of finished starts, the number asked for, and the best objective so
        far (None as long as no start met all constraints).
    paths
        Called with the number of parts of the paths to all solutions of an exact goal that are
        followed, and of all parts known so far.

    Returns
    -------
    SynthesisResult
        Its ``data`` has the designs, each of them a problem file that is verified.

    Raises
    ------
    InputError
        Something in the description or the call is wrong; the folder is of another job.
    SolveError
        A start could not be solved: its worker died again and again.

    Examples
    --------
    >>> goal = {"kind": "rocker", "body": "rocker", "swing": 0.8}
    >>> turned = {"coordinate": "crank.angle"}
    >>> task = md.Synthesis(turned, goal, free={"crank": [0.02, 0.035]}, starts=2)
    >>> found = md.synthesize(md.four_bar(0.1, 0.03, 0.12, 0.08), task)
    >>> round(found.value("designs/0/parameters/crank"), 4)
    0.0259
    """
    call = JobCall(starts, seed, workers, executor, out, progress, paths)
    whole, named = given(problem, task, set)
    name, meant = designing_task(whole, named)
    found: SynthesisResult = at_home(KINDS[meant.kind].design)(whole, name, call)
    return found.in_units(units)
