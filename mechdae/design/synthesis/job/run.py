"""A task of synthesis as a job: its starts in processes, kept on the disk, with progress."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

from mechdae import __version__
from mechdae.describe.file.load import load
from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.tasks.synthesis import Synthesis, demand
from mechdae.design.jobs.distribute import distribute
from mechdae.design.jobs.executors import Borrowed, Processes, Supply
from mechdae.design.synthesis.designs import FEASIBLE
from mechdae.design.synthesis.exact.complete import PathWork
from mechdae.design.synthesis.exact.complete import here as followed_here
from mechdae.design.synthesis.ipopt import Optimum
from mechdae.design.synthesis.job.log import Log, fingerprint
from mechdae.design.synthesis.job.worker import Work, followed, solved, text_of
from mechdae.design.synthesis.nlp import Nlp
from mechdae.design.synthesis.pareto import synthesized as designs_of
from mechdae.design.synthesis.search import Search
from mechdae.design.synthesis.synthesize import Job as Start
from mechdae.errors import InputError, MechdaeError
from mechdae.results import Result

AHEAD = 2
"""Starts that are handed over for each worker: the next one lies ready."""
KEYS = (
    "driver", "goal", "objectives", "free", "constraints", "starts", "seed", "robust", "tolerances",
)  # fmt: skip
Progress = Callable[[int, int, float | None], None]
"""Is told how many starts of how many are done, and the best objective so far."""
PathProgress = Callable[[int, int], None]
"""Is told how many parts of the paths of an exact goal are followed, of those known so far."""


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
    paths: PathProgress | None = None,
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
        on there, and so does one with more starts.
    progress
        Called with the number of finished starts, the number asked for, and the best objective so
        far (None as long as no start met all constraints).
    paths
        Called with the number of parts of the paths to all solutions of an exact goal that are
        followed, and of all parts known so far.

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
    text = text_of(whole, name, chosen)
    assert chosen.starts is not None
    try:
        with (
            nullcontext() if out is None else Log(out, text, name, chosen.starts) as log,
            _supply(workers, executor) or nullcontext() as supply,
        ):
            window = None if executor is not None else AHEAD * workers
            job = Job(text, name, chosen.starts, supply, window, log, progress, paths)
            return designs_of(whole, name, chosen, run=job, follow=job.follow)
    except MechdaeError as error:
        if isinstance(error, InputError) and error.where.startswith(KEYS):
            error.inside(f"tasks.{name}")
        whole.blame(error)
        raise


class Job:
    """Solves the starts of a task that the log does not have, in one round or several.

    Parameters
    ----------
    text, name
        The problem as text, the name of the task.
    total
        Number of all starts.
    supply
        Of the pool; None: this process.
    window
        Most starts that are handed to the pool at a time; None: all.
    """

    def __init__(
        self,
        text: str,
        name: str,
        total: int,
        supply: Supply | None,
        window: int | None,
        log: Log | None,
        progress: Progress | None,
        paths: PathProgress | None = None,
    ) -> None:
        self._text, self._name, self._total = text, name, total
        self._supply, self._window, self._log, self._progress = supply, window, log, progress
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
        missing = [k for k in places if k not in self._optima]

        def take(k: int, optimum: Optimum) -> None:
            if k not in self._optima:
                if self._log is not None:
                    self._log.put(k, starts[k], optimum)
                self._enter(k, optimum)
                self._tell(search)

        if self._supply is None:
            for k in missing:
                kind, start = starts[k]
                nlp = problems[kind]
                take(k, nlp.solve(nlp.point(start.values), start.given))
        elif missing:
            works = {}
            for k in missing:
                kind, start = starts[k]
                works[k] = Work(
                    __version__, self._text, self._name, kind, start.values, start.given
                )
            distribute(works, self._supply, take, self._window, solved)
        return [self._optima[k] for k in places]

    def follow(self, works: Sequence[PathWork]) -> list[Any]:
        """Return where the paths of exact goals lead to, in the order of the works."""
        ends: dict[int, Any] = {}
        drawn = [fingerprint(work) for work in works]
        if self._log is not None:
            known = self._log.paths
            ends = {k: known[own] for k, own in enumerate(drawn) if own in known}

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
        if self._supply is None:
            for k, work in missing.items():
                take(k, followed_here([work])[0])
        elif missing:
            distribute(missing, self._supply, take, self._window, followed, "part")
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


def _supply(workers: int, executor: Executor | None) -> Supply | None:
    if executor is not None:
        return Supply(lambda: Borrowed(executor))
    return Supply(lambda: Processes(workers)) if workers > 1 else None


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
