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


def plotted(options: argparse.Namespace) -> int:
    """Write the page that ``mechdae plot --kind page`` asks for."""
    from mechdae.draw.catalogue import OPTIONS
    from mechdae.parts.page import page

    given = [name for name in OPTIONS if name != "lang" and getattr(options, name) is not None]
    if given or options.mode is not None or options.format not in (None, "html"):
        raise InputError("a page has no options but --lang", where="--kind page")
    made = page(
        problem_of(options), options.task, lang=options.lang or "en", units=units_asked(options)
    )
    out = Path(options.out)
    named = out.suffix == ".html" and not out.is_dir()
    path = out if named else out / f"{made.data['problem']}-{made.data['task']}.html"
    path.parent.mkdir(parents=True, exist_ok=True)
    print(made.save(path))
    return 0


def run(options: argparse.Namespace) -> int:
    from mechdae.parts.page import page

    made = page(problem_of(options), options.task, lang=options.lang, units=units_asked(options))
    data = made.data
    target = Path(options.out or f"{data['problem']}-{data['task']}.html")
    if not target.parent.is_dir():
        raise InputError("no such folder", where=str(target.parent))
    print(made.save(target))
    kind = "live" if data["live"] else f"recorded: {data['reason']}"
    message(f"mechdae: {kind}", options.quiet)
    return 0
