"""`md.study` and `md.screen`: one task for many sets of numbers, as a job or by the way."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

from mechdae.describe.file.load import Source, given
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.studies import Study
from mechdae.describe.units import SI, Units
from mechdae.describe.values import Number
from mechdae.errors import InputError
from mechdae.records import public
from mechdae.results import StudyResult
from mechdae.tasks.dispatch.solve import solve

if TYPE_CHECKING:
    from mechdae.types import Json


@public
def study(
    problem: Source,
    task: Study | str | None = None,
    *,
    sets: Mapping[str, Sequence[float]] | None = None,
    vary: Mapping[str, Sequence[Number]] | None = None,
    of: str | None = None,
    outputs: Sequence[str] | None = None,
    certify: bool | None = None,
    set: Mapping[str, Number] | None = None,
    units: str | Units = SI,
    workers: int = 1,
    executor: Executor | None = None,
    out: str | Path | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> StudyResult:
    """Return a table of outputs over many sets of numbers.

    Rows depend on the sets alone: not on where they are computed, nor on whether the study was
    broken off and begun again.

    Parameters
    ----------
    problem
        A problem, the name of a predefined one, a file, a mechanism, or a result.
    task
        A study as a value, or the name of one (default: the first of the problem, where nothing
        else says what is varied).
    sets
        name -> values (k,), as many for each name; a set with a nan makes no mechanism.
    vary
        name -> (from, to, count); all combinations.
    of, outputs
        The task that is repeated, and the paths to tabulate, in place of the study's own.
    certify
        False: dyads are solved in closed form, without certificates.
    set, units
        As of `md.solve`.
    workers
        Processes of this machine; 1: this one.
    executor
        Computes in place of own processes; it is not shut down.
    out
        Folder in which a study that was broken off goes on, and where its table is.
    progress
        Called with the number of sets that are done, and of all.

    Returns
    -------
    StudyResult
        Its ``table`` has an array (k, ...) for each path, ``status`` (k,) one of each set.

    Raises
    ------
    InputError
        Something in the description or the call is wrong; the folder is of another study.
    SolveError
        A file cannot be written: what is finished is kept.

    Examples
    --------
    >>> table = md.study(
    ...     md.four_bar(0.1, 0.04, 0.12, 0.08),
    ...     sets={"crank": [0.03, 0.04]}, of="turn", outputs=["summary/swing/rocker"],
    ... ).table
    >>> table["summary/swing/rocker"].round(4).tolist()
    [0.9365, 1.2877]
    """
    if isinstance(workers, bool) or not isinstance(workers, int) or workers < 1:
        raise InputError("a whole number above 0 is needed", where="workers")
    if executor is not None and workers != 1:
        raise InputError("'workers' and 'executor' are given, one is needed", where="executor")
    if sets is not None and vary is not None:
        raise InputError("'sets' and 'vary' are given, one is needed", where="vary")
    value = task if isinstance(task, Study) else None
    whole, named = given(problem, None if isinstance(task, Study) else task, set)
    if task is None and named is not None and not isinstance(whole.task(named), Study):
        named, of = None, of or named  # a result whose task is repeated
    name, study_task = _study(whole, value or named, sets is not None or vary is not None)
    if vary is not None:
        study_task = replace(study_task, vary=vary, samples=None)
    elif sets is not None:
        study_task = replace(study_task, vary=None, samples=None)
    chosen = {"of": of, "outputs": None if outputs is None else tuple(outputs), "certify": certify}
    changes: Json = {key: value for key, value in chosen.items() if value is not None}
    study_task = replace(study_task, **changes)
    if dict(whole.tasks).get(name) != study_task:
        whole = whole.with_task(name, study_task)
    options: Json = {"workers": workers, "progress": progress, "given": sets}
    found = solve(whole, name, executor=executor, out=out, **options).in_units(units)
    return cast("StudyResult", found)


@public(old="problem sets outputs task")
def screen(
    problem: Source,
    task: str | None = None,
    *,
    sets: Mapping[str, Sequence[float]],
    outputs: Sequence[str],
    set: Mapping[str, Number] | None = None,
    units: str | Units = SI,
    workers: int = 1,
    executor: Executor | None = None,
) -> StudyResult:
    """Return a table of series in closed form, without certificates: ``certified`` is false.

    Poses keep the assembly mode that each set starts on; whether a motion leads from pose to pose
    is not asked. Groups that are no dyads are computed with certificates, and a note says so.

    Parameters
    ----------
    problem, sets, outputs, set, units, workers, executor
        As of `study`.
    task
        The sweep that is repeated.

    Returns
    -------
    StudyResult
        Its ``table`` has an array (k, n, ...) for each path: k sets, n poses.

    Examples
    --------
    >>> path = "points/rod.C/position"
    >>> found = md.screen(md.slider_crank(0.1, 0.3), sets={"rod": [0.3, 0.4]}, outputs=[path])
    >>> found.table[path].shape
    (2, 361, 2)
    """
    return study(
        problem, Study(certify=False), sets=sets, of=task, outputs=outputs, set=set, units=units,
        workers=workers, executor=executor,
    )  # fmt: skip


def _study(problem: Problem, task: Study | str | None, sets: bool) -> tuple[str, Study]:
    """Return name and value of the study that is meant."""
    if isinstance(task, Study):
        return "study", task
    if task is None:
        known = [(name, task) for name, task in problem.tasks.items() if isinstance(task, Study)]
        if sets or not known:
            return "study", Study()
        return known[0]
    found = problem.task(task)
    if not isinstance(found, Study):
        raise InputError(
            f"is of kind '{found.kind}', not study",
            where=f"tasks.{task}",
            hint=f"study(..., of={task!r}) repeats it",
        )
    return task, found
