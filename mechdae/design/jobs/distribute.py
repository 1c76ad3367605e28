"""Many pieces of work, each done once even when a process that does it dies."""

from __future__ import annotations

import logging
import multiprocessing
import os
import re
import signal
import threading
import traceback
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from typing import Any

from mechdae import __version__
from mechdae.errors import InputError, MechdaeError, SolveError, UnavailableError
from mechdae.records import dataclass

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Variables that libraries read when they are loaded."""
ADDRESS = re.compile(r"(\w+://)?[^\s:/]+:\d+/?")
COMING = 60.0
"""How long its first worker may take to come [s]."""
TALK = ("distributed", "distributed.client", "tornado", "tornado.application", "concurrent.futures")
"""Loggers that tell of lost connections at length; what matters is in the error raised."""


class Processes:
    """A pool of new processes that ends with the process that opened it.

    Each worker holds the reading end of a pipe whose other end is here: when this process is
    killed or leaves the pool in an error, the pipe closes and the workers stop, in the middle
    of a piece of work if need be.
    """

    def __init__(self, workers: int) -> None:
        context = multiprocessing.get_context("spawn")
        reading, self._writing = context.Pipe(duplex=False)
        self._reading = reading
        self._pool = ProcessPoolExecutor(
            workers, mp_context=context, initializer=attend, initargs=(reading,)
        )

    def submit(self, function: Any, *arguments: object) -> Future[Any]:
        """Hand over a call; a worker that is started for it computes on one thread."""
        with one_thread():
            return self._pool.submit(function, *arguments)

    def alive(self) -> bool:
        """Return whether results may still come; a pool of processes tells by itself."""
        return True

    def close(self, at_once: bool) -> None:
        """End the workers, in the middle of a piece if it must be at once."""
        if at_once:
            self._writing.close()
        self._pool.shutdown(cancel_futures=True)
        self._writing.close()
        self._reading.close()


class Borrowed:
    """An executor of somebody else: used, not closed."""

    def __init__(self, executor: Executor) -> None:
        self._executor = executor

    def submit(self, function: Any, *arguments: object) -> Future[Any]:
        """Hand over a call."""
        return self._executor.submit(function, *arguments)

    def alive(self) -> bool:
        """Return whether results may still come: Dask leaves some open when its client ends."""
        client = getattr(self._executor, "_client", None)
        return getattr(client, "status", "running") not in ("closing", "closed")

    def close(self, at_once: bool) -> None:
        """Leave the executor to whom it belongs."""


class Supply:
    """The pool in use, opened when it is needed, another one when it broke."""

    def __init__(self, open_pool: Callable[[], Processes | Borrowed]) -> None:
        self._open = open_pool
        self._pool: Processes | Borrowed | None = None

    def pool(self) -> Processes | Borrowed:
        """Return the pool."""
        if self._pool is None:
            self._pool = self._open()
        return self._pool

    def drop(self, at_once: bool = False) -> None:
        """Close the pool."""
        pool, self._pool = self._pool, None
        if pool is not None:
            pool.close(at_once)

    def __enter__(self) -> Supply:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        self.drop(at_once=kind is not None)


def attend(lifeline: Connection) -> None:
    """Make this process end with the one that holds the other end; Ctrl-C is its business."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        with suppress(EOFError, OSError):
            lifeline.recv()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def one_thread() -> Iterator[None]:
    """Let processes that are started meanwhile load their libraries with one thread each."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@contextmanager
def cluster(address: str) -> Iterator[Executor]:
    """Connect to the scheduler of a Dask cluster (``tcp://host:8786``)."""
    place = f"--cluster {address}"
    try:
        from distributed import Client
    except ImportError:
        raise UnavailableError(
            "Dask distributed is not installed", where=place,
            hint="pip install 'mechdae[cluster]'",
        ) from None  # fmt: skip
    if not ADDRESS.fullmatch(address):
        raise InputError("is no address", where=place, hint="--cluster tcp://HOST:8786")
    with _quiet():
        try:
            client = Client(address, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise InputError(
                f"no scheduler answers ({error})", where=place, hint="start one: dask scheduler"
            ) from None  # fmt: skip
        with client:
            try:
                client.wait_for_workers(1, timeout=COMING)
            except TimeoutError:
                raise InputError(
                    f"the scheduler has no worker after {COMING:.0f} s", where=place,
                    hint=f"start some: dask worker {address} --nthreads 1",
                ) from None  # fmt: skip
            yield client.get_executor(pure=False)


@contextmanager
def _quiet() -> Iterator[None]:
    loggers = [logging.getLogger(name) for name in TALK]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)


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


def elsewhere(version: str, piece: Callable[[], object]) -> Any:
    """Return what a piece gives in a process that may run another version, or a `Failure`."""
    if version != __version__:
        return Failure(f"mechdae {__version__} runs there, {version} here")
    try:
        return piece()
    except Exception as error:  # told to the one who asked, whatever it is
        return Failure(f"{type(error).__name__}: {error}", traceback.format_exc())


def failed(outcome: object, piece: str) -> Any:
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
