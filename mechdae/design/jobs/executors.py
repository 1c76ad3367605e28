"""Where work is done: processes of this machine, an executor of the user, a Dask cluster."""

from __future__ import annotations

import logging
import multiprocessing
import os
import re
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from typing import Any

from mechdae.errors import InputError, UnavailableError

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

    def submit(self, function: Any, *arguments: Any) -> Future[Any]:
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

    def submit(self, function: Any, *arguments: Any) -> Future[Any]:
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

    def __exit__(self, kind: Any, *_: Any) -> None:
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
