"""A job as it is called: which task is meant, and where its pieces are computed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.kinds import Task
from mechdae.design.jobs.distribute import Borrowed, Processes, Supply, Take, distribute, failed
from mechdae.errors import InputError, MechdaeError
from mechdae.records import dataclass

AHEAD = 2
"""Pieces that are handed over for each process: the next one lies ready."""
Chosen = TypeVar("Chosen", bound=Task)
Work = TypeVar("Work")
Progress = Callable[[int, int, float | None], None]
"""Is told how many pieces of how many are done, and the best objective so far."""
PathProgress = Callable[[int, int], None]
"""Is told how many parts of the paths of an exact goal are followed, of those known so far."""


@dataclass(frozen=True)
class JobCall:
    """The options of a job that looks for designs, see `mechdae.synthesize`."""

    starts: int | None = None
    seed: int | None = None
    workers: int = 1
    executor: Executor | None = None
    out: str | Path | None = None
    progress: Progress | None = None
    paths: PathProgress | None = None

    def pool(self) -> Workers:
        """Return where the pieces are computed."""
        if isinstance(self.workers, bool) or not isinstance(self.workers, int) or self.workers < 1:
            raise InputError("a whole number above 0 is needed", where="workers")
        if self.executor is not None and self.workers != 1:
            raise InputError("'workers' and 'executor' are given, one is needed", where="executor")
        return Workers(self.workers, self.executor)

    def task_of(
        self,
        problem: Problem,
        name: str,
        kind: type[Chosen],
        draws: Callable[[Problem, Chosen], tuple[int | None, int | None]],
    ) -> Chosen:
        """Return the task of that name with its number of starts and seed."""
        chosen = problem.tasks[name]
        assert isinstance(chosen, kind)
        for key, value, least in (("starts", self.starts, 1), ("seed", self.seed, 0)):
            if value is not None and (
                isinstance(value, bool) or int(value) != value or value < least
            ):
                raise InputError(f"a whole number, {least} or more, is needed", where=key)
        with blamed(problem, name):
            starts, seed = draws(problem, chosen)
        given: dict[str, object] = {
            "starts": starts if self.starts is None else self.starts,
            "seed": seed if self.seed is None else self.seed,
        }
        return replace(chosen, **given)


def task_named(
    problem: Problem, name: str | None, meant: Callable[[Task], bool], kind: str = "synthesis"
) -> str:
    """Return the name of the task that is meant: the one named, or the first that may be."""
    if name is not None and not meant(problem.task(name)):
        raise InputError(
            f"is of kind '{problem.task(name).kind}', not {kind}", where=f"tasks.{name}",
            hint=f"mechdae solve {problem.name} --task {name}",
        )  # fmt: skip
    names = [name] if name is not None else [n for n, task in problem.tasks.items() if meant(task)]
    if not names:
        raise InputError(f"no task of kind {kind}", where=f"{problem.name}: tasks")
    return names[0]


@contextmanager
def blamed(problem: Problem, name: str, keys: tuple[str, ...] | None = None) -> Iterator[None]:
    """Say of errors in which file and, where they begin with some keys, in which task they are."""
    try:
        yield
    except MechdaeError as error:
        if keys is None or (isinstance(error, InputError) and error.where.startswith(keys)):
            error.inside(f"tasks.{name}")
        problem.blame(error)
        raise


class Workers:
    """Computes pieces: here, in processes of its own, or in an executor of the user."""

    def __init__(self, count: int = 1, executor: Executor | None = None) -> None:
        self._supply: Supply | None = None
        self._window = None if executor is not None else AHEAD * count
        if executor is not None:
            self._supply = Supply(lambda: Borrowed(executor))
        elif count > 1:
            self._supply = Supply(lambda: Processes(count))

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        if self._supply is not None:
            self._supply.drop(at_once=kind is not None)

    def compute(
        self,
        works: Mapping[int, Work],
        take: Take,
        call: Callable[[Any], Any],
        word: str = "start",
        here: Callable[[int], Any] | None = None,
    ) -> None:
        """Compute pieces and give each outcome to `take` as soon as it is there."""
        if self._supply is not None:
            if works:
                distribute(works, self._supply, take, self._window, call, word)
            return
        for index, work in works.items():
            take(index, failed(call(work), f"{word} {index}") if here is None else here(index))
