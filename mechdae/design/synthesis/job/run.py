"""A task of synthesis as a job: its starts in processes, kept on the disk, with progress."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from mechdae import __version__
from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.tasks.kinds import Task
from mechdae.describe.tasks.synthesis import Synthesis, demand
from mechdae.design.jobs.call import JobCall, PathProgress, Progress, Workers, blamed
from mechdae.design.synthesis.designs import FEASIBLE
from mechdae.design.synthesis.exact.complete import PathWork
from mechdae.design.synthesis.exact.complete import followed as ends_of
from mechdae.design.synthesis.ipopt import Optimum
from mechdae.design.synthesis.job.log import Log, fingerprint
from mechdae.design.synthesis.job.worker import Work, followed, solved, text_of
from mechdae.design.synthesis.nlp import Nlp
from mechdae.design.synthesis.pareto import synthesized as designs_of
from mechdae.design.synthesis.search import Search
from mechdae.design.synthesis.synthesize import Job as Start
from mechdae.results import Result

ALONE = JobCall()
"""Starts one after the other in this process, kept nowhere."""
KEYS = (
    "driver", "goal", "objectives", "free", "constraints", "starts", "seed", "robust", "tolerances",
)  # fmt: skip


def synthesize(
    problem: Problem | Mechanism | str | Path, task: Task | str | None = None, call: JobCall = ALONE
) -> Result:
    """Return the designs of a task of synthesis, best first; see `mechdae.synthesize`."""
    pool = call.pool()
    whole, name, chosen = call.task_of(problem, task, Synthesis, _draws)
    text = text_of(whole, name, chosen)
    assert chosen.starts is not None
    log = nullcontext() if call.out is None else Log(call.out, text, name, chosen.starts)
    with blamed(whole, name, KEYS), log as kept, pool as workers:
        job = Job(text, name, chosen.starts, workers, kept, call.progress, call.paths)
        return designs_of(whole, name, chosen, run=job, follow=job.follow)


def _draws(problem: Problem, task: Synthesis) -> tuple[int, int]:
    asked = demand(problem, task)
    return asked.starts, asked.seed


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

    def follow(self, works: Sequence[PathWork]) -> list[Any]:
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

        def take(k: int, found: Any) -> None:
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
