"""The task of kind study: one task for many sets of parameters.

Series of a sweep with one driver over given values are computed for many sets at once; sets
that are not certified that way, and everything else that a task gives, one by one.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mechdae import __version__
from mechdae.derivatives.figures import base_of, prepared
from mechdae.describe.coordinates import coordinate_names
from mechdae.describe.dimensions import parameter_units
from mechdae.describe.expression import evaluate
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.kinds import Study
from mechdae.errors import InputError, MechdaeError, UnknownName
from mechdae.jobs.distribute import distribute
from mechdae.jobs.executors import Processes, Supply
from mechdae.results import Status, StudyResult, Summary
from mechdae.studies.rows import OF_PARTS, Computer, PortionRows, Sets, computed, text_of

MAX_SETS = 200_000
MAX_NUMBERS = 50_000_000
SHARES, LARGE_SHARES = 8, 2
"""Portions for each process at least: of sets computed one by one, and of those at once."""
AHEAD = 2
"""Portions that are handed over for each process: the next one lies ready."""
Progress = Callable[[int, int], None]


def study(
    problem: Problem, name: str, task: Study, workers: int = 1, progress: Progress | None = None
) -> StudyResult:
    """Return a result whose rows are sets of parameters.

    Sets that are computed one by one are spread over `workers` processes; `progress` is told how
    many of how many are done.

    ``parameters`` holds the sets, ``table`` one array (sets, ...) for each path in `outputs`;
    ``status`` is ok for sets in which all poses are, else the first other status; sets whose
    cycle jams or has several solutions between the poses are not ok either. Other faults
    of sets that are ok (a slack belt) are under ``faults`` in the summary.

    Raises
    ------
    InputError
        Unknown parameters, paths or tasks, too many sets.
    """
    base_name, _ = base_of(problem, task.of, "varied")
    names, sets = _sets(problem, task)
    if not task.outputs:
        raise InputError(
            "name the paths to tabulate", where="outputs", hint='"summary/swing/rocker"'
        )
    for path in task.outputs:
        _check_summary(problem, path)
    problem = prepared(problem, base_name, tuple(task.outputs))
    computer = Computer(problem, base_name, tuple(task.outputs), tuple(names), task.certify)
    collector = _Collector(computer, sets, progress)
    collector.run(workers)
    status = collector.status
    units = parameter_units(problem.mechanism, problem.tasks.values())
    summary = {
        "sets": len(sets),
        "of": base_name,
        "status": {str(word): status.count(word) for word in dict.fromkeys(status)},
        "units": {key: units[key] for key in names if key in units},
        "work": {"together": collector.together, "alone": len(sets) - collector.together},
    }
    summary["certified"] = bool(computer.certify or computer.batch is None)
    if computer.note:
        summary["notes"] = [computer.note]
    if collector.faults:
        faults = sorted(collector.faults.items())
        summary["faults"] = [{"set": k, "fault": fault} for k, fault in faults]
    if collector.errors:
        summary["estimated_error"] = collector.errors
    reached = any(word == "ok" for word in status)
    return StudyResult(
        problem.name,
        name,
        task.kind,
        problem.mechanism,
        problem.title,
        parameters={key: sets[:, k] for k, key in enumerate(names)},
        table=collector.tables(),
        status=np.array(status),
        summary=Summary(summary),
        fault=None if reached else f"none of {len(sets)} sets is assembled at all poses",
        definition=task,
    )


def _sets(problem: Problem, task: Study) -> tuple[list[str], Any]:
    """Return names (m,) and values (k, m) of the parameter sets."""
    if (task.vary is None) == (task.samples is None):
        raise InputError("give either 'vary' or 'samples'", where="vary")
    word = "vary" if task.vary is not None else "samples"
    table = task.vary if task.vary is not None else task.samples
    if not table:
        raise InputError("a table name = [...] is needed", where=word)
    known = problem.mechanism.parameter_values
    automatic = {*known, *dict(problem.mechanism.numbers())}
    columns = []
    for key, items in table.items():
        if key not in automatic:
            raise UnknownName("parameter", key, automatic, where=word)
        try:
            columns.append(_column(word, items, known))
        except MechdaeError as error:
            raise error.inside(f"{word}.{key}") from None
    if word == "samples":
        if len({len(column) for column in columns}) > 1:
            raise InputError("the lists have different lengths", where=word)
        sets = np.array(columns, float).T
    else:
        count = int(np.prod([len(column) for column in columns]))
        if count > MAX_SETS:
            raise InputError(f"{count} sets, at most {MAX_SETS} are computed", where=word)
        sets = np.array(list(itertools.product(*columns)), float)
    if len(sets) > MAX_SETS:
        raise InputError(f"{len(sets)} sets, at most {MAX_SETS} are computed", where=word)
    return list(table), sets


def _column(word: str, items: Any, known: Mapping[str, float]) -> list[float]:
    values = [evaluate(item, dict(known)) for item in items]
    if word == "samples":
        return values
    if len(values) != 3 or values[2] != int(values[2]) or values[2] < 1:
        raise InputError("[from, to, count] is needed, count a whole number above 0")
    count = int(values[2])
    return [values[0]] if count == 1 else np.linspace(values[0], values[1], count).tolist()


class _Collector:
    """Fills the table of a study, portion by portion.

    Parameters
    ----------
    computer
        Computes rows.
    sets
        The parameter sets (k, m).
    """

    def __init__(self, computer: Computer, sets: Any, progress: Progress | None) -> None:
        self.computer, self.sets, self.progress = computer, sets, progress
        self.status = [str(Status.UNASSEMBLED)] * len(sets)
        self.table: list[Any] = [None] * len(computer.outputs)
        self.together = self.done = 0
        self.faults: dict[int, str] = {}
        self.refused: dict[int, InputError] = {}
        self.errors: dict[str, float] = {}

    def run(self, workers: int) -> None:
        """Compute all sets, in this process or in several."""
        count, size = len(self.sets), self.computer.portion
        if workers > 1:
            shares = SHARES if self.computer.batch is None else LARGE_SHARES
            size = min(size, max(1, -(-count // (shares * workers))))
        portions = [range(i, min(i + size, count)) for i in range(0, count, size)]
        if workers == 1 or len(portions) < 2:
            for portion in portions:
                self._take(portion, self.computer(self.sets[portion], self._tell))
        else:
            self._spread(portions, workers)
        if len(self.refused) == count:
            raise self.refused[min(self.refused)]

    def _spread(self, portions: list[range], workers: int) -> None:
        own = self.computer
        task = own.problem.tasks[own.name]
        text = text_of(own.problem, own.name, task)
        works = {
            i: Sets(
                *(__version__, text, own.name, own.outputs, own.names, own.certify),
                self.sets[portion],
            )
            for i, portion in enumerate(portions)
        }

        def landed(i: int, found: PortionRows) -> None:
            self._take(portions[i], found)
            self._tell(len(portions[i]))

        with Supply(lambda: Processes(workers)) as supply:
            distribute(works, supply, landed, AHEAD * workers, computed, "portion")

    def _tell(self, more: int) -> None:
        self.done += more
        if self.progress is not None and more:
            self.progress(self.done, len(self.sets))

    def _take(self, portion: range, rows: PortionRows) -> None:
        """Enter the rows of a portion."""
        first = portion.start
        self.status[first : portion.stop] = rows.status
        self.together += rows.together
        self.faults |= {first + k: fault for k, fault in rows.faults.items()}
        self.refused |= {first + k: error for k, error in rows.refused.items()}
        for path, error in rows.errors.items():
            self.errors[path] = max(self.errors.get(path, 0.0), error)
        for j, values in enumerate(rows.values):
            if values is None:
                continue
            if self.table[j] is None:
                self.table[j] = self._empty(j, values.shape[1:])
            if self.table[j].shape[1:] == values.shape[1:]:
                self.table[j][first : portion.stop] = values

    def _empty(self, j: int, shape: tuple[int, ...]) -> Any:
        """Return the table of a path without values."""
        if len(self.sets) * int(np.prod(shape, initial=1)) > MAX_NUMBERS:
            path = self.computer.outputs[j]
            raise InputError(f"{path}: more than {MAX_NUMBERS} numbers", where="outputs")
        return np.full((len(self.sets), *shape), np.nan)

    def tables(self) -> dict[str, Any]:
        """Return the table of each path."""
        none = np.full(len(self.sets), np.nan)
        pairs = zip(self.computer.outputs, self.table, strict=True)
        return {path: none if table is None else table for path, table in pairs}


def _check_summary(problem: Problem, path: str) -> None:
    """Raise for a path like ``summary/swing/rocker`` that names no part of the mechanism.

    A part that is there may have no value, such as a time ratio, and then is nan.
    """
    head, *rest = path.split("/")
    if head != "summary" or len(rest) < 2 or rest[0] not in OF_PARTS:
        return
    mechanism = problem.mechanism
    points = [f"{body}.{point}" for body, part in mechanism.bodies.items() for point in part.points]
    names = [*mechanism.bodies, *mechanism.joints, *points, *coordinate_names(mechanism)]
    if rest[1] not in names:
        known = [f"summary/{rest[0]}/{name}" for name in names]
        raise UnknownName("path", path, known, where="outputs")
