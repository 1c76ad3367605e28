"""Progress of long work on a terminal, long lines folded; what a job says when it is done."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from mechdae.cli import message
from mechdae.cli.options import column_names

if TYPE_CHECKING:
    from mechdae.describe.file.problem import Problem
    from mechdae.results import Result


def say(text: str, hang: int | None = None) -> None:
    """Print a text; on a terminal long lines go on below, `hang` columns in, or 4 more."""
    if sys.stdout.isatty():
        import shutil
        import textwrap

        room, lines = shutil.get_terminal_size().columns, list[str]()
        for line in text.splitlines():
            inner = len(line) - len(line.lstrip()) + 4 if hang is None else hang
            folded = textwrap.wrap(
                line, room, subsequent_indent=" " * inner, break_long_words=False,
                break_on_hyphens=False,
            )  # fmt: skip
            lines += folded or [""]
        text = "\n".join(lines)
    print(text)


def progress(word: str, quiet: bool = False) -> Callable[[int, int], None] | None:
    """Return what shows how many of all are done, None where stderr is no terminal."""
    if quiet or not sys.stderr.isatty():
        return None

    def show(done: int, total: int) -> None:
        end = "\r\033[K" if done == total else ""
        print(f"\r{word} {done} of {total}{end}", end="", file=sys.stderr, flush=True)

    return show


def starts_progress(
    quiet: bool = False, word: str = "starts"
) -> Callable[[int, int, float | None], None] | None:
    """Return what shows starts done, the best so far and the time left; None as above."""
    if quiet or not sys.stderr.isatty():
        return None
    began: list[tuple[float, int]] = []

    def show(done: int, total: int, best: float | None) -> None:
        if not began:
            began.append((time.monotonic(), done))
        words = [f"{word} {done} of {total}"]
        if best is not None:
            words.append(f"best so far {best:.6g}")
        spent, new = time.monotonic() - began[0][0], done - began[0][1]
        if new and done < total:
            words.append(f"{_duration(spent / new * (total - done))} left")
        line = "" if done == total else ", ".join(words)
        print(f"\r\033[K{line}", end="", file=sys.stderr, flush=True)

    return show


def clear(show: object) -> None:
    """Empty the line that `show` wrote, if there is one."""
    if show is not None:
        print("\r\033[K", end="", file=sys.stderr, flush=True)


def _duration(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.0f} s"
    minutes = seconds / 60
    return f"{minutes:.0f} min" if minutes < 100 else f"{minutes / 60:.0f} h"


def check_out(out: str | None, problem: Problem, task: str | None, kind: str) -> None:
    """Raise for a folder whose results a job would overwrite, before it is done."""
    from mechdae.tasks.export import check_folder

    names = [name for name, task in problem.tasks.items() if task.kind == kind]
    for name in ([task] if task else names[:1] or [kind]) if out else ():
        check_folder(str(out), problem.name, name)


def reported(result: Result, options: argparse.Namespace) -> int:
    """Print the result, write it where ``--out`` says, and return the exit code."""
    from mechdae.results.tables import table
    from mechdae.tasks.export import json_text, save

    if options.json:
        print(json_text([result]))
    else:
        columns = column_names(options) if getattr(options, "columns", None) else None
        print(table(result, sys.stdout.isatty(), columns), end="")
    code = remarks(result, options.quiet)
    if options.out:
        for path in save(result, Path(options.out)):
            message(f"written: {path}", options.quiet)
    return code


def remarks(result: Result, quiet: bool, said: Sequence[str] = ()) -> int:
    """Print notes but those `said` of the file, and the fault; return the exit code."""
    start, in_text = f"mechdae: task {result.task}:", result.units.in_text
    for note in result.summary.get("notes", ()):
        if not any(note.split(" is in")[0] in text for text in said):
            message(f"{start} note: {in_text(note)}", quiet)
    if result.fault:
        message(f"{start} {in_text(result.fault)}", False)
    return int(bool(result.fault))
