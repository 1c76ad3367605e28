"""One set of parameters of a study, computed by itself: here, or in another process."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from mechdae.derivatives.figures import figure, is_figure
from mechdae.describe.file.load import from_dict
from mechdae.describe.file.problem import Problem
from mechdae.describe.file.writing import alone
from mechdae.describe.tasks.kinds import Task
from mechdae.errors import InputError, MechdaeError, SolveError, UnknownName
from mechdae.jobs.distribute import Failure
from mechdae.results import FINE, Result, Status

OF_PARTS = (
    "swing",
    "stroke",
    "time_ratio",
    "return_angle",
    "no_time_ratio",
    "transmission",
    "extremes",
    "dwell",
    "curve",
)
"""Entries of the summary with one value for each of some parts."""
OTHERS = ("limits", "envelope", "centrodes", "centres_at_infinity", "undercut", "failed")
"""Further entries that not every sweep has."""
ARCS = ("jammed", "ambiguous")
"""Statuses that a cycle may have between its poses, too."""
KEPT = 4
"""Problems that a process keeps."""


@dataclass(frozen=True)
class SetRow:
    """What a set gives: a value for each path (None: not assembled), its status.

    ``fault`` is what else is wrong with it; ``refused`` that the set is no valid mechanism;
    ``errors`` how far figures of time histories may be off, by path.
    """

    values: list[Any] | None
    status: str
    fault: str = ""
    refused: InputError | None = None
    errors: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Sets:
    """Some sets of a study as they are sent to another process."""

    text: str
    name: str
    outputs: tuple[str, ...]
    sets: tuple[Mapping[str, float], ...]


def text_of(problem: Problem, name: str, task: Task) -> str:
    """Return a problem file with all that determines the rows of a study."""
    return alone(problem.mechanism, {name: task})


def computed(work: Sets) -> list[SetRow] | Failure:
    """Return the rows of some sets; a path that does not exist ends the study."""
    try:
        problem = _problem(work.text)
        return [row_of(problem, work.name, work.outputs, values) for values in work.sets]
    except MechdaeError as error:
        return Failure(str(error), error=error)


@lru_cache(maxsize=KEPT)
def _problem(text: str) -> Problem:
    return from_dict(tomllib.loads(text))


def row_of(
    problem: Problem, name: str, outputs: Sequence[str], values: Mapping[str, float]
) -> SetRow:
    """Return the row of one set of parameters.

    Raises
    ------
    InputError
        A path that does not exist, or is no number.
    """
    from mechdae.solver.solve import solve

    try:
        result = solve(problem.with_values(values), name)
    except SolveError:
        return SetRow(None, Status.UNASSEMBLED)
    except InputError as error:
        return SetRow(None, Status.UNASSEMBLED, str(error.what), error)
    words = [str(word) for word in result.status]
    words += [word for word in ARCS if result.summary.get(f"{word}_arcs")]
    worst = next((word for word in words if word not in FINE), Status.OK)
    fault = str(result.fault) if worst == Status.OK and result.fault is not None else ""
    row, errors = [], {}
    for path in outputs:
        if is_figure(path):
            value, errors[path] = figure(result, path)
        else:
            value = _missing_ok(result, path)
        row.append(_numbers(value, path))
    return SetRow(row, worst, fault, errors=errors)


def _numbers(value: Any, path: str) -> Any:
    """Return an array, None for a value that is not there."""
    try:
        array = None if value is None else np.array(value, float)
    except (TypeError, ValueError):
        raise InputError(f"{path} is no number and no series", where="outputs") from None
    return None if array is None or not array.size else array


def _missing_ok(result: Result, path: str) -> Any:
    """Return the value at a path; None for a summary that this set does not have."""
    try:
        return result.value(path)
    except UnknownName:
        head, _, rest = path.partition("/")
        word = rest.split("/")[0]
        if head != "summary":
            raise
        if result.fault is None and word not in {*result.summary.names(), *OF_PARTS, *OTHERS}:
            names = [f"summary/{name}" for name in (*result.summary, *OF_PARTS, *OTHERS)]
            raise UnknownName("path", path, names) from None
        return None
