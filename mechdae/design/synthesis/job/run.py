"""A task of synthesis as a job: its starts in processes, kept on the disk, with progress."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import casadi
import numpy as np

from mechdae import __version__
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.synthesis import Synthesis, demand
from mechdae.design.jobs.call import JobCall, PathProgress, Progress, Workers, blamed
from mechdae.design.jobs.log import JobLog
from mechdae.design.synthesis.designs import FEASIBLE
from mechdae.design.synthesis.exact.complete import PathWork
from mechdae.design.synthesis.exact.complete import followed as ends_of
from mechdae.design.synthesis.ipopt import Optimum
from mechdae.design.synthesis.job.worker import Work, followed, solved, text_of
from mechdae.design.synthesis.nlp import Nlp
from mechdae.design.synthesis.pareto import synthesized as designs_of
from mechdae.design.synthesis.search import Search
from mechdae.design.synthesis.synthesize import Job as Start
from mechdae.results import Result
from mechdae.types import Complexes, Floats, Json

if TYPE_CHECKING:
    from mechdae.design.synthesis.goals.base import Seed

FORMAT = 1
NAME = "starts.jsonl"
"""Starts one after the other in this process, kept nowhere."""
KEYS = (
    "driver", "goal", "objectives", "free", "constraints", "starts", "seed", "robust", "tolerances",
)  # fmt: skip


class Log(JobLog):
    """The log in a folder, held by one process at a time.

    `total`: number of starts that the job has now. A job with more or fewer of them goes on with
    what is there: a start is known by its numbers, not by its place.
    """

    def __init__(self, folder: str | Path, text: str, task: str, total: int = 0) -> None:
        head = {
            "format": FORMAT, "mechdae": __version__, "casadi": casadi.CasadiMeta.version(),
            "task": task, "problem": text,
        }  # fmt: skip
        self.total = total
        self.finished: dict[str, Optimum] = {}
        self.paths: dict[str, object] = {}
        self._drawn: dict[tuple[int, int], str] = {}
        super().__init__(Path(folder) / NAME, head)
        for entry in self.entries:
            self._enter(entry)

    def known(self, starts: Mapping[int, tuple[int, Seed]]) -> dict[int, Optimum]:
        """Return what is finished of some starts; writes the first line if there is none."""
        self.begin()
        drawn = {index: digest(*start) for index, start in starts.items()}
        for index, start in drawn.items():
            if self._drawn.get((self.total, index), start) != start:
                raise self.other(
                    f"start {index} there is not the one that is drawn here, perhaps by another "
                    "version of NumPy or on another kind of processor"
                )
        return {i: self.finished[key] for i, key in drawn.items() if key in self.finished}

    def put(self, index: int, start: tuple[int, Seed], found: Optimum) -> None:
        """Write a finished start; a second time is nothing."""
        drawn = digest(*start)
        if drawn not in self.finished:
            self._drawn[self.total, index] = drawn
            self.add({"start": index, "of": self.total, "drawn": drawn, **_plain(found)})
            self.finished[drawn] = found

    def put_paths(self, drawn: str, ends: Complexes) -> None:
        """Write where paths lead to; a second time is nothing."""
        if drawn not in self.paths:
            rows = [row.view(float).tolist() if np.isfinite(row).all() else None for row in ends]
            self.add({"paths": drawn, "unknowns": ends.shape[1], "ends": rows})
            self.paths[drawn] = ends

    def _enter_paths(self, entry: Json) -> None:
        """Take ends of paths; what cannot be read is followed again."""
        try:
            count = int(entry["unknowns"])
            rows = [[np.nan] * 2 * count if row is None else row for row in entry["ends"]]
            ends = np.array(rows, float).reshape(len(rows), 2 * count).view(complex)
        except (ValueError, KeyError, TypeError):
            return
        self.paths.setdefault(str(entry["paths"]), ends)

    def _enter(self, entry: Json) -> None:
        """Take a finished start; what cannot be read is a start that is solved again."""
        if "paths" in entry:
            self._enter_paths(entry)
            return
        try:
            index, total, drawn = entry.pop("start"), entry.pop("of"), entry.pop("drawn")
            found = _optimum(entry)
        except (ValueError, KeyError, TypeError, AttributeError):
            return
        if isinstance(index, int) and isinstance(total, int) and isinstance(drawn, str):
            self.finished.setdefault(drawn, found)
            self._drawn.setdefault((total, index), drawn)


def digest(kind: int, start: Seed) -> str:
    """Return a fingerprint of a start, to the last bit."""
    found = hashlib.sha256(str(kind).encode())
    for table in (start.values, start.given):
        for name, value in sorted(table.items()):
            array = np.ascontiguousarray(value, dtype="<f8")
            found.update(f"{name}{array.shape}".encode() + array.tobytes())
    return found.hexdigest()[:32]


def fingerprint(work: PathWork) -> str:
    """Return a fingerprint of paths, to the last bit of where they start and lead to."""
    found = hashlib.sha256(type(work.family).__name__.encode())
    for part in (getattr(work.family, "given", ()), work.start, work.target, work.bend, work.z):
        array = np.asarray(part)
        found.update(f"{array.shape}".encode() + array.tobytes())
    return found.hexdigest()[:32]


def _plain(found: Optimum) -> Json:
    return {entry.name: _text(getattr(found, entry.name)) for entry in fields(found)}


def _text(value: Floats | float | str) -> Any:
    if isinstance(value, np.ndarray):
        return [_text(item) for item in value.tolist()]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else str(float(value))
    return value


def _optimum(entry: Mapping[str, Any]) -> Optimum:
    values: dict[str, Any] = {}
    for field in fields(Optimum):
        value = entry[field.name]
        if isinstance(value, list):
            value = np.array([float(item) for item in value])
        elif field.type == "float":
            value = float(value)
        values[field.name] = value
    return Optimum(**values)


def synthesize(problem: Problem, name: str, call: JobCall) -> Result:
    """Return the designs of a task of synthesis, best first; see `mechdae.synthesize`."""
    pool = call.pool()
    chosen = call.task_of(problem, name, Synthesis, _draws)
    text = text_of(problem, name, chosen)
    assert chosen.starts is not None
    log = nullcontext() if call.out is None else Log(call.out, text, name, chosen.starts)
    with blamed(problem, name, KEYS), log as record, pool as workers:
        job = Job(text, name, chosen.starts, workers, record, call.progress, call.paths)
        return designs_of(problem, name, chosen, run=job, follow=job.follow)


def _draws(problem: Problem, task: Synthesis) -> tuple[int, int]:
    required = demand(problem, task)
    return required.starts, required.seed


class Job:
    """Solves the starts of a task that the log does not have, in one round or several."""

    def __init__(
        self,
        text: str,
        name: str,
        total: int,
        workers: Workers,
        log: Log | None,
        progress: Progress | None,
        paths: PathProgress | None = None,
    ) -> None:
        self._text, self._name, self._total = text, name, total
        self._workers, self._log, self._progress = workers, log, progress
        self._paths = paths
        self._parts = [0, 0]
        self._optima: dict[int, Optimum] = {}
        self._begun = 0
        self._best: float | None = None

    def __call__(
        self, search: Search, problems: Sequence[Nlp], jobs: Sequence[Start]
    ) -> list[Optimum]:
        """Return the optima in the order of the starts."""
        places = range(self._begun, self._begun + len(jobs))
        self._begun += len(jobs)
        starts = dict(zip(places, jobs, strict=True))
        if self._log is not None:
            for k, optimum in self._log.known(starts).items():
                self._enter(k, optimum)
        self._tell(search)

        def take(k: int, optimum: Optimum) -> None:
            if k not in self._optima:
                if self._log is not None:
                    self._log.put(k, starts[k], optimum)
                self._enter(k, optimum)
                self._tell(search)

        def here(k: int) -> Optimum:
            kind, start = starts[k]
            nlp = problems[kind]
            return nlp.solve(nlp.point(start.values), start.given)

        works = {
            k: Work(__version__, self._text, self._name, kind, start.values, start.given)
            for k, (kind, start) in starts.items()
            if k not in self._optima
        }
        self._workers.compute(works, take, solved, here=here)
        return [self._optima[k] for k in places]

    def follow(self, works: Sequence[PathWork]) -> list[Complexes]:
        """Return where the paths of exact goals lead to, in the order of the works."""
        ends: dict[int, Any] = {}
        drawn = [fingerprint(work) for work in works]
        if self._log is not None:
            known = self._log.paths
            ends = {k: known[key] for k, key in enumerate(drawn) if key in known}

        def tell(done: int, new: int = 0) -> None:
            self._parts = [self._parts[0] + done, self._parts[1] + new]
            if self._paths is not None:
                self._paths(*self._parts)

        tell(len(ends), len(works))

        def take(k: int, found: Complexes) -> None:
            if k not in ends:
                if self._log is not None:
                    self._log.put_paths(drawn[k], found)
                ends[k] = found
                tell(1)

        missing = {k: work for k, work in enumerate(works) if k not in ends}
        self._workers.compute(missing, take, followed, "part", lambda k: ends_of(works[k]))
        return [ends[k] for k in range(len(works))]

    def _enter(self, k: int, optimum: Optimum) -> None:
        self._optima[k] = optimum
        value = optimum.objective
        if optimum.violation <= FEASIBLE and (self._best is None or value < self._best):
            self._best = value

    def _tell(self, search: Search) -> None:
        if self._progress is not None:
            best = None if self._best is None else search.shown(self._best)
            self._progress(len(self._optima), max(self._total, self._begun), best)
