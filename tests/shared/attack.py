"""What attacks share on the command line: how many cases, in which processes, where figures go."""

from __future__ import annotations

import argparse
import itertools
import json
import multiprocessing
import os
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

STARTED = time.perf_counter()


def parser(about: str, count: int, cases: str = "cases") -> argparse.ArgumentParser:
    """Return a parser of --count, --seed, --workers and --out; an attack may add its own."""
    made = argparse.ArgumentParser(description=about.split("\n", maxsplit=1)[0])
    made.add_argument("--count", type=int, default=count, help=f"{cases} ({count})")
    made.add_argument("--seed", type=int, default=0, help="first seed (0)")
    made.add_argument("--workers", type=int, default=1, help="processes, where there may be more")
    made.add_argument("--out", type=Path, help="JSON file for the figures")
    return made


@contextmanager
def processes(count: int) -> Iterator[Callable[..., Iterator[Any]]]:
    """Give a function that yields ``f(*job)`` of each job in order, in so many processes."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    if count == 1:
        yield lambda function, jobs, chunk=1: itertools.starmap(function, jobs)
        return
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(count, mp_context=context) as pool:
        yield (
            lambda function, jobs, chunk=1: (
                pool.map(function, *zip(*jobs, strict=True), chunksize=chunk) if jobs else iter(())
            )
        )


def kept(figures: dict[str, Any], out: Path | None) -> str:
    """Return figures as text, written to a file if there is one."""
    text = json.dumps(figures, indent=1)
    if out:
        out.write_text(text + "\n", encoding="utf-8")
    return text


def ended(figures: dict[str, Any], out: Path | None, wrong: Any) -> int:
    """Print and write the figures; return its exit code: 1 where something is wrong."""
    print(kept(figures, out))
    print(f"{time.perf_counter() - STARTED:.0f} s", file=sys.stderr)
    return int(bool(wrong))
