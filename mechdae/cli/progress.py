"""Progress of long work, on a terminal only."""

from __future__ import annotations

import sys
from collections.abc import Callable


def progress(word: str, quiet: bool = False) -> Callable[[int, int], None] | None:
    """Return what shows how many of all are done, None where stderr is no terminal."""
    if quiet or not sys.stderr.isatty():
        return None

    def show(done: int, total: int) -> None:
        end = "\r\033[K" if done == total else ""
        print(f"\r{word} {done} of {total}{end}", end="", file=sys.stderr, flush=True)

    return show
