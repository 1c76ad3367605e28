"""``mechdae page P``: a live page."""

from __future__ import annotations

import argparse
from pathlib import Path

from mechdae.cli import message
from mechdae.cli.options import problem_arguments, problem_of, units_argument, units_asked
from mechdae.errors import InputError


def arguments(parser: argparse.ArgumentParser) -> None:
    problem_arguments(parser)
    parser.add_argument("--task", metavar="T", help="sweep, reactions or motion; the first one")
    parser.add_argument("--out", metavar="FILE", help="default: <problem>-<task>.html")
    units_argument(parser)
    parser.add_argument("--lang", default="en", metavar="LANG", help="en or ru")


def run(options: argparse.Namespace) -> int:
    from mechdae.pages import page

    made = page(problem_of(options), options.task, options.lang, units_asked(options))
    data = made.data
    target = Path(options.out or f"{data['problem']}-{data['task']}.html")
    if not target.parent.is_dir():
        raise InputError("no such folder", where=str(target.parent))
    print(made.save(target))
    kind = "live" if data["live"] else f"recorded: {data['reason']}"
    message(f"mechdae: {kind}", options.quiet)
    return 0
