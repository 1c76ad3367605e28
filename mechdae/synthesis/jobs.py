"""Many starts, each solved once whatever happens to the processes that do it."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from typing import TYPE_CHECKING, Any

from mechdae.errors import SolveError
from mechdae.synthesis.pools import Borrowed, Processes, Supply
from mechdae.synthesis.worker import Failure, Work, solved

if TYPE_CHECKING:
    from mechdae.synthesis.ipopt import Optimum

GRACE = 2.0
"""How long the starts under way may take to end when their pool breaks [s]."""
ATTEMPTS = 5
"""How often a start may be lost with its worker before the job gives up."""

Pool = Processes | Borrowed
Take = Callable[[int, "Optimum"], None]


def distribute(works: Mapping[int, Work], supply: Supply, take: Take, window: int | None) -> None:
    """Solve starts in a pool and give each optimum to `take` as soon as it is there.

    Starts whose worker dies are solved again: in a new pool if the old one broke, after all
    others and one by one, because one of them may be what killed it.

    Parameters
    ----------
    works
        By index.
    supply
        Of the pool.
    take
        Is called with each index, in the order in which they finish.
    window
        Most starts that are handed over at a time; None: all.

    Raises
    ------
    SolveError
        The computation of a start failed, or its worker died too often.
    """
    round_ = _Round(works, take, window or len(works))
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
    """The starts that wait, those that are under way, and how often each was lost."""

    def __init__(self, works: Mapping[int, Work], take: Take, window: int) -> None:
        self.works, self.take, self.window = works, take, window
        self.waiting = deque(works)
        self.flying: dict[Future[Any], int] = {}
        self.lost: Counter[int] = Counter()
        self.broken: BaseException | None = None

    def go(self, pool: Pool) -> None:
        """Solve until nothing is left or the pool breaks."""
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
                future = pool.submit(solved, self.works[first])
            except Exception as error:  # whatever the engine calls it
                self.broken = error
                return
            self.flying[future] = self.waiting.popleft()

    def _land(self, future: Future[Any]) -> None:
        """Take a result; what a pool raises by itself means that the start was lost."""
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
        if isinstance(outcome, Failure):
            del self.flying[future]
            trace = outcome.trace.strip()
            raise SolveError(f"start {index}: {outcome.what}" + (f"\n{trace}" if trace else ""))
        self.take(index, outcome)
        del self.flying[future]

    def _again(self, index: int, error: BaseException) -> None:
        self.lost[index] += 1
        if self.lost[index] == ATTEMPTS:
            reason = " ".join(str(error).split()) or type(error).__name__
            raise SolveError(
                f"start {index} was lost {ATTEMPTS} times with its worker: {reason}",
                hint="run with workers=1 to see why; a script that uses workers needs "
                "`if __name__ == '__main__':`",
            ) from error
        self.waiting.append(index)
