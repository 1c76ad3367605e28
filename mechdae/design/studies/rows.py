"""Rows of a study: some sets of parameters, computed together where that is certified."""

from __future__ import annotations

import tomllib
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from functools import lru_cache
from typing import Any

import numpy as np

from mechdae import __version__
from mechdae.describe.file.load import from_dict
from mechdae.describe.file.problem import Problem
from mechdae.describe.file.writing import alone
from mechdae.describe.tasks.kinds import Sweep, Task
from mechdae.describe.tasks.motion import Reactions
from mechdae.design.derivatives.figures import figure, is_figure
from mechdae.design.jobs.distribute import Failure
from mechdae.design.studies.batches.batch import SERIES, SeriesBatch
from mechdae.design.studies.batches.readings import SPANS, is_of_the_way
from mechdae.design.studies.batches.screening import Screening
from mechdae.errors import InputError, MechanismError, MechdaeError, SolveError, UnknownName
from mechdae.records import dataclass
from mechdae.results import FINE, Result, Status
from mechdae.types import Floats

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
OTHERS = ("limits", "envelope", "centrodes", "axodes", "centres_at_infinity", "undercut", "failed")
"""Further entries that not every sweep has."""
ARCS = ("jammed", "ambiguous")
"""Statuses that a cycle may have between its poses, too."""
FORCES = ("efforts", "efforts_uncoupled")
"""First steps of paths of forces of the drivers."""
FORCED = (Status.OK, Status.JAMMED, Status.AMBIGUOUS)
"""Statuses of sets of which it is said what else is wrong with them."""
KEPT = 4
"""Problems that a process keeps."""
MOST = 32
"""Sets of a portion where none are computed together, at most."""


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


@dataclass
class PortionRows:
    """The rows of some sets: one array (k, ...) for each path, None where no set has a value.

    ``faults`` and ``refused`` are by place in the portion; ``together`` counts the sets that were
    computed at once.
    """

    values: list[Any]
    status: list[str]
    faults: dict[int, str] = field(default_factory=dict)
    refused: dict[int, InputError] = field(default_factory=dict)
    errors: dict[str, float] = field(default_factory=dict)
    together: int = 0


@dataclass(frozen=True)
class Sets:
    """Some sets of a study as they are sent to another process; ``values`` is (k, m)."""

    version: str
    text: str
    name: str
    outputs: tuple[str, ...]
    names: tuple[str, ...]
    certify: bool
    values: Floats


def text_of(problem: Problem, name: str, task: Task) -> str:
    """Return a problem file with all that determines the rows of a study."""
    return alone(problem.mechanism, {name: task})


def computed(work: Sets) -> PortionRows | Failure:
    """Return the rows of some sets; a path that does not exist ends the study."""
    if work.version != __version__:
        return Failure(f"mechdae {__version__} runs there, {work.version} here")
    try:
        content = (work.outputs, work.names, work.certify)
        return _computer(work.text, work.name, *content)(work.values)
    except MechdaeError as error:
        return Failure(str(error), error=error)


@lru_cache(maxsize=KEPT)
def _computer(
    text: str, name: str, outputs: tuple[str, ...], names: tuple[str, ...], certify: bool
) -> Computer:
    return Computer(from_dict(tomllib.loads(text)), name, outputs, names, certify)


class Computer:
    """Computes rows of one study.

    `certify`: whether poses are certified; else dyads are solved in closed form only.
    """

    def __init__(
        self, problem: Problem, name: str, outputs: tuple[str, ...], names: tuple[str, ...],
        certify: bool = True,
    ) -> None:  # fmt: skip
        self.problem, self.name, self.outputs, self.names = problem, name, outputs, names
        self.batch: SeriesBatch | None = None
        self.certify, self.note = certify, ""
        task, reason = problem.tasks[name], "only series of a plain sweep are screened"
        if isinstance(task, Reactions):
            self.certify = True
        if isinstance(task, Sweep) and in_series(task, outputs, self.certify):
            self.batch, reason = _batch(problem, task, names, outputs, self.certify)
        if isinstance(task, Reactions):
            reason = "forces are not screened"
        if not certify and (self.certify or self.batch is None):
            self.note = f"the sets are not screened but computed with certificates: {reason}"
        self.portion: int = self.batch.portion if self.batch is not None else MOST

    def __call__(self, sets: Floats, done: Callable[[int], None] | None = None) -> PortionRows:
        """Return the rows of some sets (k, m); `done` is told how many more are there."""
        rows = PortionRows([None] * len(self.outputs), [str(Status.UNASSEMBLED)] * len(sets))
        left = list(range(len(sets)))
        if self.batch is not None:
            found = self.batch.rows(sets)
            left = np.flatnonzero(found.left).tolist()
            rows.together = len(sets) - len(left)
            if rows.together:
                rows.values, rows.status = list(found.values), found.status
                rows.faults |= found.faults
        tell = done or (lambda count: None)
        tell(len(sets) - len(left))
        single: dict[int, SetRow] = {}
        for k in left:
            values = dict(zip(self.names, sets[k].tolist(), strict=True))
            single[k] = row = row_of(self.problem, self.name, self.outputs, values)
            rows.status[k] = row.status
            if row.fault:
                rows.faults[k] = row.fault
            if row.refused is not None:
                rows.refused[k] = row.refused
            for path, error in row.errors.items():
                rows.errors[path] = max(rows.errors.get(path, 0.0), error)
            tell(1)
        for j in range(len(self.outputs)):
            self._put(rows, j, single, len(sets))
        return rows

    def _put(self, rows: PortionRows, j: int, single: Mapping[int, SetRow], count: int) -> None:
        """Write the values of single sets at a path; those of another shape than most are nan."""
        given = {k: row.values[j] for k, row in single.items() if row.values is not None}
        given = {k: value for k, value in given.items() if value is not None}
        table = rows.values[j]
        if table is None:
            if not given:
                return
            (shape, _), *_ = Counter(np.shape(value) for value in given.values()).most_common(1)
            table = rows.values[j] = np.full((count, *shape), np.nan)
        for k in single:
            value = given.get(k)
            fits = value is not None and np.shape(value) == table.shape[1:]
            table[k] = value if fits else np.nan


def _batch(
    problem: Problem, task: Sweep, names: tuple[str, ...], outputs: tuple[str, ...], certify: bool
) -> tuple[SeriesBatch | None, str]:
    """Return what computes many sets at once, None where that is not possible, and why not."""
    try:
        if isinstance(task, Reactions):
            from mechdae.design.studies.batches.forces import ForcesBatch

            kind: type[SeriesBatch] = ForcesBatch
        else:
            kind = SeriesBatch if certify else Screening
        found = kind(problem, task, names, outputs)
    except (SolveError, MechanismError) as error:  # other sets may be assembled
        return None, str(error.what)
    return (found if found.usable else None), found.why_not


def in_series(task: Sweep, outputs: Sequence[str], certify: bool) -> bool:
    """Return whether all outputs may be computed for many sets of one driver's values at once."""
    heads = (*SERIES, *FORCES) if isinstance(task, Reactions) else SERIES
    if not isinstance(task, Reactions) and type(task) is not Sweep:
        return False
    drivers = task.all_drivers
    plain = len(drivers) == 1 and drivers[0].law is None and drivers[0].range is None
    if not plain or task.mode is not None or task.derivatives > 2:
        return False
    spans = task.derivatives == 2 and drivers[0].at is None

    def known(path: str) -> bool:
        head, _, rest = path.partition("/")
        if head in heads:
            return True
        return certify and is_of_the_way(path, task) and (spans or rest.split("/")[0] not in SPANS)

    return all(known(path) for path in outputs)


def row_of(
    problem: Problem, name: str, outputs: Sequence[str], values: Mapping[str, float]
) -> SetRow:
    from mechdae.tasks.dispatch.solve import solve

    try:
        result = solve(problem.with_values(values), name)
    except SolveError as error:  # of sweeps the status says it
        fault = "" if isinstance(problem.tasks[name], Sweep) else str(error.what)
        return SetRow(None, Status.UNASSEMBLED, fault)
    except InputError as error:
        return SetRow(None, Status.UNASSEMBLED, str(error.what), error)
    words = [str(word) for word in result.status]
    words += [word for word in ARCS if result.summary.get(f"{word}_arcs")]
    worst = next((word for word in words if word not in FINE), Status.OK)
    fault = str(result.fault) if worst in FORCED and result.fault is not None else ""
    row, errors = [], {}
    for path in outputs:
        if is_figure(path):
            value, errors[path] = figure(result, path)
        else:
            value = _missing_ok(result, path)
        row.append(_numbers(value, path))
    return SetRow(row, worst, fault, errors=errors)


def _numbers(value: object, path: str) -> Floats | None:
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
