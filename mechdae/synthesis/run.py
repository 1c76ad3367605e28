"""A task of synthesis as a job: its starts in processes, kept on the disk, with progress."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path

from mechdae import __version__
from mechdae.describe.demand import demand
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.problem import Problem, load
from mechdae.describe.tasks import Synthesis
from mechdae.errors import InputError, MechdaeError
from mechdae.results import Result
from mechdae.synthesis.designs import FEASIBLE
from mechdae.synthesis.ipopt import Optimum
from mechdae.synthesis.jobs import distribute
from mechdae.synthesis.log import Log
from mechdae.synthesis.nlp import Nlp
from mechdae.synthesis.pools import Borrowed, Processes
from mechdae.synthesis.search import Search
from mechdae.synthesis.synthesize import Job as Start
from mechdae.synthesis.synthesize import synthesize as designs_of
from mechdae.synthesis.worker import Work, text_of

AHEAD = 2
"""Starts that are handed over for each worker: the next one lies ready."""
KEYS = ("driver", "goal", "free", "constraints", "starts", "seed")
Progress = Callable[[int, int, float | None], None]
"""Is told how many starts of how many are done, and the best objective so far."""


def synthesize(
    problem: Problem | Mechanism | str | Path,
    task: Synthesis | str | None = None,
    *,
    starts: int | None = None,
    seed: int | None = None,
    workers: int = 1,
    executor: Executor | None = None,
    out: str | Path | None = None,
    progress: Progress | None = None,
) -> Result:
    """Return the designs of a task of synthesis, best first.

    The answer depends on the problem, the number of starts and the seed alone: not on where the
    starts are solved, nor on whether the job was broken off and begun again.

    Parameters
    ----------
    problem
        A problem, the name of a predefined one, a file, or a mechanism.
    task
        Name of a task (default: the first of kind synthesis), or a task as a value.
    starts, seed
        In place of the task's own.
    workers
        Processes of this machine; 1: this one.
    executor
        Solves the starts in place of own processes; it is not shut down.
    out
        Folder with the log of finished starts, ``starts.jsonl``: a job that was broken off goes
        on there.
    progress
        Called with the number of finished starts, the number of all, and the best objective so
        far (None as long as no start met all constraints).

    Raises
    ------
    InputError
        Something in the description or the call is wrong; the folder is of another job.
    SolveError
        A start could not be solved: its worker died again and again.
    """
    if isinstance(workers, bool) or not isinstance(workers, int) or workers < 1:
        raise InputError("a whole number above 0 is needed", where="workers")
    if executor is not None and workers != 1:
        raise InputError("'workers' and 'executor' are given, one is needed", where="executor")
    whole, name, chosen = _chosen(problem, task, starts, seed)
    try:
        log = Log(out, text_of(whole, name, chosen), name) if out is not None else None
        with log or nullcontext():
            job = Job(whole, name, chosen, workers, executor, log, progress)
            return designs_of(whole, name, chosen, run=job)
    except MechdaeError as error:
        if isinstance(error, InputError) and error.where.startswith(KEYS):
            error.inside(f"tasks.{name}")
        whole.blame(error)
        raise


@dataclass(frozen=True)
class Job:
    """Solves the starts of a task that the log does not have."""

    problem: Problem
    name: str
    task: Synthesis
    workers: int = 1
    executor: Executor | None = None
    log: Log | None = None
    progress: Progress | None = None

    def __call__(
        self, search: Search, problems: Sequence[Nlp], jobs: Sequence[Start]
    ) -> list[Optimum]:
        """Return the optima in the order of the starts."""
        if self.log is not None:
            self.log.begin(jobs)
        found = _Found(search, len(jobs), self.log, self.progress)
        missing = [k for k in range(len(jobs)) if k not in found.optima]
        if self.executor is None and self.workers == 1:
            for k in missing:
                kind, start = jobs[k]
                nlp = problems[kind]
                found.take(k, nlp.solve(nlp.point(start.values), start.given))
        elif missing:
            text = text_of(self.problem, self.name, self.task)
            works = {}
            for k in missing:
                kind, start = jobs[k]
                works[k] = Work(__version__, text, self.name, kind, start.values, start.given)
            distribute(works, self._pool(len(missing)), found.take, self._window())
        return [found.optima[k] for k in range(len(jobs))]

    def _pool(self, count: int) -> Callable[[], Processes | Borrowed]:
        executor = self.executor
        if executor is not None:
            return lambda: Borrowed(executor)
        return lambda: Processes(min(self.workers, count))

    def _window(self) -> int | None:
        return None if self.executor is not None else AHEAD * self.workers


class _Found:
    """The optima so far, each taken once, written before it counts."""

    def __init__(
        self, search: Search, total: int, log: Log | None, progress: Progress | None
    ) -> None:
        self.optima: dict[int, Optimum] = {}
        self._search, self._total, self._log, self._progress = search, total, log, progress
        self._best: float | None = None
        for index, optimum in (log.finished if log is not None else {}).items():
            self._enter(index, optimum)
        self._tell()

    def take(self, index: int, optimum: Optimum) -> None:
        """Enter an optimum."""
        if index in self.optima:
            return
        if self._log is not None:
            self._log.add(index, optimum)
        self._enter(index, optimum)
        self._tell()

    def _enter(self, index: int, optimum: Optimum) -> None:
        self.optima[index] = optimum
        value = optimum.objective
        if optimum.violation <= FEASIBLE and (self._best is None or value < self._best):
            self._best = value

    def _tell(self) -> None:
        if self._progress is not None:
            best = None if self._best is None else self._search.claimed(self._best)
            self._progress(len(self.optima), self._total, best)


def _chosen(
    problem: Problem | Mechanism | str | Path,
    task: Synthesis | str | None,
    starts: int | None,
    seed: int | None,
) -> tuple[Problem, str, Synthesis]:
    """Return a problem, the name of its task, and the task with its number of starts and seed."""
    if isinstance(problem, Mechanism):
        problem = Problem(problem)
    whole = problem if isinstance(problem, Problem) else load(problem)
    if isinstance(task, Synthesis):
        name = next((n for n, known in whole.tasks.items() if known == task), "synthesis")
        whole = whole.with_task(name, task)
    else:
        name = _name(whole, task)
    own = whole.tasks[name]
    assert isinstance(own, Synthesis)
    for word, value, least in (("starts", starts, 1), ("seed", seed, 0)):
        if value is not None and (isinstance(value, bool) or int(value) != value or value < least):
            raise InputError(f"a whole number, {least} or more, is needed", where=word)
    try:
        asked = demand(whole, own)
    except MechdaeError as error:
        error.inside(f"tasks.{name}")
        whole.blame(error)
        raise
    return whole, name, replace(
        own,
        starts=asked.starts if starts is None else starts,
        seed=asked.seed if seed is None else seed,
    )  # fmt: skip


def _name(problem: Problem, asked: str | None) -> str:
    if asked is not None:
        task = problem.task(asked)
        if not isinstance(task, Synthesis):
            raise InputError(
                f"is of kind '{task.kind}', not synthesis", where=f"tasks.{asked}",
                hint=f"mechdae solve {problem.name} --task {asked}",
            )  # fmt: skip
        return asked
    for name, task in problem.tasks.items():
        if isinstance(task, Synthesis):
            return name
    raise InputError("no task of kind synthesis", where=f"{problem.name}: tasks")
