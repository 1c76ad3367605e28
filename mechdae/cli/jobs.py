"""What a job of many computations says when it is done."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from mechdae.cli import message
from mechdae.cli.options import column_names

if TYPE_CHECKING:
    from mechdae.describe.file.problem import Problem
    from mechdae.results import Result


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
    for note in result.summary.get("notes", []):
        message(f"mechdae: note: {note}", options.quiet)
    if options.out:
        for path in save(result, Path(options.out)):
            message(f"written: {path}", options.quiet)
    if result.fault:
        message(f"mechdae: task {result.task}: {result.fault}", False)
        return 1
    return 0
