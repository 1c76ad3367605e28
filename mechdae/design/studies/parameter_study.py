"""The task of kind study: one task for many sets of parameters.

Series of a sweep with one driver over given values are computed for many sets at once; sets
that are not certified that way, and everything else that a task gives, one by one.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np

from mechdae.describe.coordinate_kinds import KINDS
from mechdae.describe.coordinate_names import coordinate_names
from mechdae.describe.dimensions import parameter_units
from mechdae.describe.expression import evaluate
from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.tasks.studies import Study
from mechdae.design.derivatives.figures import base_of, prepared
from mechdae.design.studies.job import Collector, Progress
from mechdae.design.studies.rows import OF_PARTS, Computer
from mechdae.errors import InputError, UnknownName, within
from mechdae.results import StudyResult, Summary
from mechdae.types import Floats

MAX_SETS = 200_000


def study(
    problem: Problem,
    name: str,
    task: Study,
    workers: int = 1,
    progress: Progress | None = None,
    executor: Executor | None = None,
    out: str | Path | None = None,
    given: Mapping[str, Sequence[float]] | None = None,
) -> StudyResult:
    """Return a result whose rows are sets of parameters.

    Portions of sets are spread over `workers` processes or over an `executor`; `progress` is told
    how many of how many are done. In a folder `out` a study that was broken off goes on, and
    tables are read from there. `given` are sets in the place of the task's own, (k,) by name.

    ``parameters`` holds the sets, ``table`` one array (sets, ...) for each path in `outputs`;
    ``status`` is ok for sets in which all poses are, else the first other status; sets whose
    cycle jams or has several solutions between the poses are not ok either. Other faults
    of sets that are ok (a slack belt) are under ``faults`` in the summary.
    """
    base_name, _ = base_of(problem, task.of, "varied")
    names, sets = _sets(problem, task) if given is None else _given(problem, given)
    if not task.outputs:
        raise InputError(
            "name the paths to tabulate", where="outputs", hint=f'"{_first_path(problem)}"'
        )
    for path in task.outputs:
        _check_summary(problem, path)
    problem = prepared(problem, base_name, tuple(task.outputs))
    computer = Computer(problem, base_name, tuple(task.outputs), tuple(names), task.certify)
    collector = Collector(computer, sets, progress)
    collector.run(workers, executor, out, name)
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
    none = f"none of {len(sets)} sets is assembled at all poses"
    if collector.faults:
        none = "{}; set {}: {}".format(none, *min(collector.faults.items()))
    return StudyResult.of(
        problem,
        name,
        task,
        parameters={key: sets[:, k] for k, key in enumerate(names)},
        table=collector.tables(),
        status=np.array(status),
        summary=Summary(summary),
        fault=None if reached else none,
    )


def _sets(problem: Problem, task: Study) -> tuple[list[str], Floats]:
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
        with within(f"{word}.{key}"):
            columns.append(_column(word, items, known))
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


def _given(problem: Problem, given: Mapping[str, Sequence[float]]) -> tuple[list[str], Floats]:
    """Return names (m,) and values (k, m) of sets given as arrays; nan makes no mechanism."""
    known = {*problem.mechanism.parameter_values, *dict(problem.mechanism.numbers())}
    columns = []
    for name, values in given.items():
        if name not in known:
            raise UnknownName("parameter", name, known, where="sets")
        try:
            columns.append(np.asarray(values, float))
        except (TypeError, ValueError):
            raise InputError("numbers are needed", where=f"sets.{name}") from None
    if not columns or columns[0].ndim != 1 or not len(columns[0]):
        raise InputError("a list of values is needed for each name", where="sets")
    if len({column.shape for column in columns}) > 1:
        raise InputError("the lists have different lengths", where="sets")
    if len(columns[0]) > MAX_SETS:
        raise InputError(f"{len(columns[0])} sets, at most {MAX_SETS} are computed", where="sets")
    return list(given), np.stack(columns, axis=1)


def _column(word: str, items: Any, known: Mapping[str, float]) -> list[float]:
    values = [evaluate(item, dict(known)) for item in items]
    if word == "samples":
        return values
    if len(values) != 3 or values[2] != int(values[2]) or values[2] < 1:
        raise InputError("[from, to, count] is needed, count a whole number above 0")
    count = int(values[2])
    return [values[0]] if count == 1 else np.linspace(values[0], values[1], count).tolist()


def _first_path(problem: Problem) -> str:
    """Return a path that may be meant: the swing of what moves last, else the status."""
    spans = _spans(problem.mechanism, "rad")
    return f"summary/swing/{spans[-1]}" if spans else "summary/status"


def _spans(mechanism: Mechanism, unit: str) -> list[str]:
    """Return the names under which a sweep tells swings (unit "rad") or strokes ("m")."""
    if mechanism.dimension == 2 and unit == "rad":
        return list(mechanism.bodies)
    found = []
    for name, joint in mechanism.joints.items():
        words = [word for word in joint.coordinates if word in KINDS and KINDS[word].unit == unit]
        found += [name] if len(words) == 1 else [f"{name}.{word}" for word in words]
    return found


def _check_summary(problem: Problem, path: str) -> None:
    """Raise for a path like ``summary/swing/rocker`` that names no part of the mechanism.

    A part that is there may have no value, such as a time ratio, and then is nan; what never swings
    or slides is refused.
    """
    head, *rest = path.split("/")
    if head != "summary" or len(rest) < 2 or rest[0] not in OF_PARTS:
        return
    mechanism = problem.mechanism
    if rest[0] in ("swing", "stroke"):
        spans = _spans(mechanism, "rad" if rest[0] == "swing" else "m")
        if rest[1] not in (*spans, *mechanism.aliases):
            raise UnknownName(
                "path", path, [f"summary/{rest[0]}/{n}" for n in spans], where="outputs"
            )
        return
    points = [f"{body}.{point}" for body, part in mechanism.bodies.items() for point in part.points]
    names = [*mechanism.bodies, *mechanism.joints, *points, *coordinate_names(mechanism)]
    if rest[1] not in names:
        known = [f"summary/{rest[0]}/{name}" for name in names]
        raise UnknownName("path", path, known, where="outputs")
