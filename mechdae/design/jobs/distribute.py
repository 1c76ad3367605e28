"""Many pieces of work, each done once even when a process that does it dies."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from typing import Any

from mechdae.design.jobs.executors import Borrowed, Processes, Supply
from mechdae.errors import MechdaeError, SolveError
from mechdae.records import dataclass

GRACE = 2.0
"""How long the pieces under way may take to end when their pool breaks [s]."""
ATTEMPTS = 5
"""How often a piece may be lost with its worker before the job gives up."""

Pool = Processes | Borrowed
Take = Callable[[int, Any], None]


@dataclass(frozen=True)
class Failure:
    """What went wrong in the computation itself, where nothing is gained by trying again."""

    what: str
    trace: str = ""
    error: MechdaeError | None = None
    """What is raised in the place of a `SolveError`."""


def failed(outcome: Any, piece: str) -> Any:
    """Return the outcome of a piece; raise what a `Failure` tells."""
    if not isinstance(outcome, Failure):
        return outcome
    if outcome.error is not None:
        raise outcome.error
    trace = outcome.trace.strip()
    raise SolveError(f"{piece}: {outcome.what}" + (f"\n{trace}" if trace else ""))


def distribute(
    works: Mapping[int, Any],
    supply: Supply,
    take: Take,
    window: int | None,
    call: Callable[[Any], Any],
    word: str = "start",
) -> None:
    """Do pieces of work in a pool and give each outcome to `take` as soon as it is there.

    Those whose worker dies are done again: in a new pool if the old one broke, after all
    others and one by one, because one of them may be what killed it.

    `call`: does a piece: a function of a module; a `Failure` that it returns ends the job.
    """
    round_ = _Round(works, take, window or len(works), call, word)
    while round_.waiting:
        pool = supply.pool()
        try:
            round_.go(pool)
        finally:
            round_.rescue()
        broken = round_.broken
        if broken is None:
            return
        if isinstance(pool, Borrowed) or not isinstance(broken, BrokenExecutor):
            raise SolveError(
                f"the executor broke: {' '.join(str(broken).split())}",
                hint="begin again with a new one; in a folder (`out`) what is finished is kept",
            ) from broken
        supply.drop()


class _Round:
    """The pieces that wait, those that are under way, and how often each was lost."""

    def __init__(
        self,
        works: Mapping[int, Any],
        take: Take,
        window: int,
        call: Callable[[Any], Any],
        word: str,
    ) -> None:
        self.works, self.take, self.window = works, take, window
        self.call, self.word = call, word
        self.waiting = deque(works)
        self.flying: dict[Future[Any], int] = {}
        self.lost: Counter[int] = Counter()
        self.broken: BaseException | None = None

    def go(self, pool: Pool) -> None:
        """Work until nothing is left or the pool breaks."""
        self.broken = None
        while self.waiting or self.flying:
            self._hand_over(pool)
            if self.broken is not None:
                wait(self.flying, timeout=GRACE)
                if isinstance(pool, Borrowed):
                    return
            done, _ = wait(self.flying, timeout=GRACE, return_when=FIRST_COMPLETED)
            if not done and not pool.alive():
                self.broken = ConnectionError("its scheduler is gone")
            for future in done:
                self._land(future)
            if self.broken is not None and not self.flying:
                return

    def rescue(self) -> None:
        """Take what finished while something else went wrong, call back the rest."""
        for future in list(self.flying):
            if self.broken is None:
                future.cancel()
            if future.done() and not future.cancelled() and future.exception() is None:
                outcome = future.result()
                if not isinstance(outcome, Failure):
                    self.take(self.flying.pop(future), outcome)

    def _hand_over(self, pool: Pool) -> None:
        while self.broken is None and self.waiting and len(self.flying) < self.window:
            first = self.waiting[0]
            if self.flying and any(self.lost[index] for index in (first, *self.flying.values())):
                return  # what was lost is solved alone: then it is clear which one kills
            try:
                future = pool.submit(self.call, self.works[first])
            except Exception as error:  # whatever the engine calls it
                self.broken = error
                return
            self.flying[future] = self.waiting.popleft()

    def _land(self, future: Future[Any]) -> None:
        """Take a result; what a pool raises by itself means that the piece was lost."""
        index = self.flying[future]
        try:
            outcome = future.result()
        except (KeyboardInterrupt, SystemExit):
            raise
        except BaseException as error:  # whatever the engine calls it
            del self.flying[future]
            if isinstance(error, BrokenExecutor):
                self.broken = error
            self._again(index, error)
            return
        try:
            outcome = failed(outcome, f"{self.word} {index}")
        except MechdaeError:
            del self.flying[future]
            raise
        self.take(index, outcome)
        del self.flying[future]

    def _again(self, index: int, error: BaseException) -> None:
        self.lost[index] += 1
        if self.lost[index] == ATTEMPTS:
            reason = " ".join(str(error).split()) or type(error).__name__
            raise SolveError(
                f"{self.word} {index} was lost {ATTEMPTS} times with its worker: {reason}",
                hint="run with workers=1 to see why; a script that uses workers needs "
                "`if __name__ == '__main__':`",
            ) from error
        self.waiting.append(index)
