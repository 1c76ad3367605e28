"""The task of kind study: one task for many sets of parameters.

Series of a sweep with one driver over given values are computed for many sets at once; sets
that are not certified that way, and everything else that a task gives, one by one.
"""

from __future__ import annotations

import hashlib
import itertools
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import casadi
import numpy as np

from mechdae import __version__
from mechdae.describe.coordinate_kinds import KINDS
from mechdae.describe.coordinate_names import coordinate_names
from mechdae.describe.expression import evaluate
from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.tasks.studies import Study
from mechdae.design.derivatives.figures import base_of, prepared, units_of
from mechdae.design.jobs.call import Workers
from mechdae.design.jobs.log import JobLog, kept
from mechdae.design.studies.rows import OF_PARTS, Computer, PortionRows, Sets, computed, text_of
from mechdae.errors import InputError, UnknownName, within
from mechdae.results import Status, StudyResult, Summary
from mechdae.types import Floats

FORMAT = 1
MAX_NUMBERS, MAX_ON_DISK = 50_000_000, 4_000_000_000
"""Numbers of a table in memory, and in a folder."""
SHARES, LARGEST = 16, 2048
"""Portions of a job at least, where there are sets enough, and sets of one at most."""
LEAST = 64
"""Sets that are worth being computed at once."""
Progress = Callable[[int, int], None]
MAX_SETS = 200_000


class StudyFolder(JobLog):
    """What is finished of a study, in a folder."""

    def __init__(
        self, folder: str | Path, name: str, computer: Computer, sets: Floats, size: int
    ) -> None:
        numbers = np.ascontiguousarray(sets, dtype="<f8")
        head = {
            "format": FORMAT, "mechdae": __version__, "casadi": casadi.CasadiMeta.version(),
            "study of": computer.name, "outputs": list(computer.outputs),
            "certify": computer.certify, "names": list(computer.names), "sets": len(sets),
            "portion": size,
            "digest of the sets": hashlib.sha256(numbers.tobytes()).hexdigest()[:32],
            "problem": _text(computer),
        }  # fmt: skip
        self.count, self.size = len(sets), size
        self.rows: Path = Path(folder) / f"{name}.rows"
        super().__init__(Path(folder) / f"{name}.sets.jsonl", head)
        self.rows.mkdir(exist_ok=True)
        self.finished: dict[int, dict[str, Any]] = {}
        for entry in self.entries:
            index = entry.get("portion")
            if isinstance(index, int) and self._whole(index, entry):
                self.finished[index] = entry
        self.begin()

    def put(self, index: int, rows: PortionRows) -> None:
        """Write the rows of a portion, then its line."""
        digests: list[str | None] = []
        for j, values in enumerate(rows.values):
            shape = None if values is None else self._shape(j, values.shape[1:])
            fits = values is not None and shape == values.shape[1:]
            digests.append(self._write(j, index, values) if fits else None)
        entry = {
            "portion": index, "status": rows.status, "together": rows.together,
            "faults": [[k, fault] for k, fault in rows.faults.items()],
            "refused": list(rows.refused), "errors": rows.errors, "digests": digests,
        }  # fmt: skip
        self.add(entry)
        self.finished[index] = entry

    def known(self, index: int) -> PortionRows:
        """Return what is finished of a portion but for its values."""
        entry = self.finished[index]
        faults = dict(entry["faults"])
        refused = {k: InputError(faults[k]) for k in entry["refused"]}
        found = PortionRows([], entry["status"], faults, refused, entry["errors"])
        found.together = entry["together"]
        return found

    def table(self, j: int) -> Any:
        """Return the table (k, ...) of a path, on the disk; None where no set has a value."""
        path = self._path(j)
        if not path.exists():
            return None
        table = np.load(path, mmap_mode="r")
        for index, entry in self.finished.items():
            if entry["digests"][j] is None:
                part = table[self._slice(index)]
                self._write(j, index, np.full(part.shape, np.nan))
        return table

    def _path(self, j: int) -> Path:
        return self.rows / f"{j}.npy"

    def _slice(self, index: int) -> slice:
        return slice(index * self.size, min((index + 1) * self.size, self.count))

    def _shape(self, j: int, shape: tuple[int, ...]) -> tuple[int, ...]:
        """Return the shape of a row of a path; the file is made by the first that is written."""
        path = self._path(j)
        if path.exists():
            return tuple(np.load(path, mmap_mode="r").shape[1:])
        if self.count * int(np.prod(shape, initial=1)) > MAX_ON_DISK:
            raise InputError(f"more than {MAX_ON_DISK} numbers", where=f"outputs[{j}]")
        partial = path.with_suffix(".part")
        header = {"descr": "<f8", "fortran_order": False, "shape": (self.count, *shape)}
        size = 8 * self.count * int(np.prod(shape, initial=1))
        with kept(path):
            with partial.open("wb") as file:
                np.lib.format.write_array_header_1_0(file, header)
                file.truncate(file.tell() + size)
            partial.replace(path)
        return shape

    def _write(self, j: int, index: int, values: Floats) -> str:
        """Write rows of a portion; return their digest."""
        path, content = self._path(j), np.ascontiguousarray(values, dtype="<f8").tobytes()
        table = np.load(path, mmap_mode="r")
        place = table.offset + self._slice(index).start * table.strides[0]
        with kept(path), path.open("r+b") as file:
            file.seek(place)
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        return hashlib.sha256(content).hexdigest()[:32]

    def _whole(self, index: int, entry: dict[str, Any]) -> bool:
        """Return whether the rows of a portion are on the disk as they were written."""
        try:
            for j, digest in enumerate(entry["digests"]):
                if digest is not None:
                    part = np.load(self._path(j), mmap_mode="r")[self._slice(index)]
                    if hashlib.sha256(part.tobytes()).hexdigest()[:32] != digest:
                        return False
            keys = ("status", "together", "faults", "refused", "errors")
            return all(key in entry for key in keys)
        except (OSError, ValueError, KeyError, TypeError):
            return False


class Collector:
    """Fills the table of a study, portion by portion."""

    def __init__(self, computer: Computer, sets: Floats, progress: Progress | None) -> None:
        self.computer, self.sets, self.progress = computer, sets, progress
        self.status: list[str] = [str(Status.UNASSEMBLED)] * len(sets)
        self.table: list[Any] = [None] * len(computer.outputs)
        self.together = self.done = 0
        self.faults: dict[int, str] = {}
        self.refused: dict[int, InputError] = {}
        self.errors: dict[str, float] = {}
        self.folder: StudyFolder | None = None
        shared = min(computer.portion, LARGEST, max(LEAST, -(-len(sets) // SHARES)))
        self.size: int = shared if computer.batch is not None else max(1, min(shared // 8, 32))

    def run(
        self, workers: int, executor: Executor | None = None, out: Any = None, name: str = ""
    ) -> None:
        """Compute all sets, in this process or in several; in a folder go on with what is there."""
        count = len(self.sets)
        if workers == 1 and executor is None and out is None:
            self.size = self.computer.portion
        portions = [range(i, min(i + self.size, count)) for i in range(0, count, self.size)]
        folder = out and StudyFolder(out, name, self.computer, self.sets, self.size)
        with folder or nullcontext() as self.folder:
            done = sorted(folder.finished) if folder else []
            for index in done:
                self._take(portions[index], folder.known(index))
                self._tell(len(portions[index]))
            left = sorted(set(range(len(portions))) - set(done))
            if executor is None and (workers == 1 or len(left) < 2):
                for i in left:
                    self._land(i, portions[i], self.computer(self.sets[portions[i]], self._tell))
            else:
                self._spread(left, portions, workers, executor)
            if len(self.refused) == count:
                raise self.refused[min(self.refused)]
            if folder:
                self.table = [folder.table(j) for j in range(len(self.table))]

    def _spread(
        self, left: Sequence[int], portions: list[range], workers: int, executor: Executor | None
    ) -> None:
        computer = self.computer
        content = (computer.name, computer.outputs, computer.names, computer.certify)
        text = _text(computer)
        works = {i: Sets(__version__, text, *content, self.sets[portions[i]]) for i in left}

        def landed(i: int, found: PortionRows) -> None:
            self._land(i, portions[i], found)
            self._tell(len(portions[i]))

        with Workers(workers, executor) as pool:
            pool.compute(works, landed, computed, "portion")

    def _land(self, i: int, portion: range, rows: PortionRows) -> None:
        if self.folder is not None:
            self.folder.put(i, rows)
            rows.values = []
        self._take(portion, rows)

    def _tell(self, more: int) -> None:
        self.done += more
        if self.progress is not None and more:
            self.progress(self.done, len(self.sets))

    def _take(self, portion: range, rows: PortionRows) -> None:
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

    def _empty(self, j: int, shape: tuple[int, ...]) -> Floats:
        """Return the table of a path without values."""
        if len(self.sets) * int(np.prod(shape, initial=1)) > MAX_NUMBERS:
            raise InputError(
                f"{self.computer.outputs[j]}: more than {MAX_NUMBERS} numbers",
                where="outputs",
                hint="give a folder (mechdae study ... --out DIR): the table is kept there",
            )
        return np.full((len(self.sets), *shape), np.nan)

    def tables(self) -> dict[str, Any]:
        none = np.full(len(self.sets), np.nan)
        pairs = zip(self.computer.outputs, self.table, strict=True)
        return {path: none if table is None else table for path, table in pairs}


def _text(computer: Computer) -> str:
    return text_of(computer.problem, computer.name, computer.problem.tasks[computer.name])


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
    summary = {
        "sets": len(sets),
        "of": base_name,
        "status": {str(word): status.count(word) for word in dict.fromkeys(status)},
        "units": units_of(problem, base_name, names, task.outputs),
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
