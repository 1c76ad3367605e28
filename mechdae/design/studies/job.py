"""A study as a job: portions of its sets in processes, on the disk as they are finished.

In a folder a job that was broken off goes on: its log says which portions are finished, their rows
are in one file for each path. Rows depend on the portions, not on where they are computed: the
table is the same to the last bit, however often the job was broken off.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import casadi
import numpy as np

from mechdae import __version__
from mechdae.design.jobs.call import Workers
from mechdae.design.jobs.log import JobLog, kept
from mechdae.design.studies.rows import Computer, PortionRows, Sets, computed, text_of
from mechdae.errors import InputError
from mechdae.results import Status
from mechdae.types import Floats

FORMAT = 1
MAX_NUMBERS, MAX_ON_DISK = 50_000_000, 4_000_000_000
"""Numbers of a table in memory, and in a folder."""
SHARES, LARGEST = 16, 2048
"""Portions of a job at least, where there are sets enough, and sets of one at most."""
LEAST = 64
"""Sets that are worth being computed at once."""
Progress = Callable[[int, int], None]


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
        self.rows = Path(folder) / f"{name}.rows"
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
    """Fills the table of a study, portion by portion.

    `sets`: the parameter sets (k, m).
    """

    def __init__(self, computer: Computer, sets: Floats, progress: Progress | None) -> None:
        self.computer, self.sets, self.progress = computer, sets, progress
        self.status = [str(Status.UNASSEMBLED)] * len(sets)
        self.table: list[Any] = [None] * len(computer.outputs)
        self.together = self.done = 0
        self.faults: dict[int, str] = {}
        self.refused: dict[int, InputError] = {}
        self.errors: dict[str, float] = {}
        self.folder: StudyFolder | None = None
        shared = min(computer.portion, LARGEST, max(LEAST, -(-len(sets) // SHARES)))
        self.size = shared if computer.batch is not None else max(1, min(shared // 8, 32))

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
        asked = (computer.name, computer.outputs, computer.names, computer.certify)
        text = _text(computer)
        works = {i: Sets(__version__, text, *asked, self.sets[portions[i]]) for i in left}

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
        """Return the table of each path."""
        none = np.full(len(self.sets), np.nan)
        pairs = zip(self.computer.outputs, self.table, strict=True)
        return {path: none if table is None else table for path, table in pairs}


def _text(computer: Computer) -> str:
    return text_of(computer.problem, computer.name, computer.problem.tasks[computer.name])
