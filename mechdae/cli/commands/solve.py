"""``mechdae solve P``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from mechdae.cli import message
from mechdae.cli.options import (
    column_names,
    columns_argument,
    problem_arguments,
    problem_of,
    units_argument,
    units_asked,
)
from mechdae.cli.progress import clear, progress, remarks
from mechdae.errors import InputError, SolveError


def arguments(parser: argparse.ArgumentParser) -> None:
    problem_arguments(parser)
    parser.add_argument("--task", action="append", metavar="T", help="run this task only")
    parser.add_argument("--mode", metavar="LABEL", help="start on this assembly mode: +,-,+")
    parser.add_argument("--poses", type=int, metavar="N", help="number of poses of a sweep")
    parser.add_argument(
        "--workers", type=int, metavar="W", help="processes that a study is spread over"
    )
    units_argument(parser)
    columns_argument(parser)
    parser.add_argument("--out", metavar="DIR", help="write CSV, JSON and NPZ there")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")


def run(options: argparse.Namespace) -> int:
    from mechdae.results.tables import table
    from mechdae.tasks.dispatch.solve import KINDS
    from mechdae.tasks.solve import solve

    units = units_asked(options)
    problem = problem_of(options)
    if options.task is None:
        names = list(problem.tasks)
        if not names:
            raise InputError("no task that this version computes", where=f"{problem.name}: tasks")
    else:
        names = list(dict.fromkeys(options.task))
        for name in names:
            problem.task(name)
    if options.poses is not None and options.poses < 1:
        raise InputError("a whole number above 0 is needed", where="--poses")
    check_workers(options.workers, {problem.tasks[name].kind for name in names})
    if options.out:
        from mechdae.tasks.export import check_folder, save

        for name in names:
            check_folder(options.out, problem.name, name)
    for note in problem.notes:
        message(f"mechdae: note: {note}", options.quiet)
    code = 0
    results = []
    for name in names:
        kind = problem.tasks[name].kind
        spread = kind in KINDS and KINDS[kind].spread
        show = progress(f"task {name}: sets", options.quiet) if spread else None
        try:
            result = solve(
                problem,
                name,
                mode=options.mode if kind != "modes" or options.task else None,
                poses=options.poses if kind == "sweep" or options.task else None,
                workers=options.workers or 1 if spread else 1,
                units=units,
                progress=show,
            )
        except SolveError as error:
            if spread:
                clear(show)
            message(f"mechdae: task {name}: {error}", False)
            code = 1
            continue
        if spread:
            clear(show)
        results.append(result)
        if not options.json:
            columns = column_names(options) if options.columns else None
            print(table(result, sys.stdout.isatty(), columns))
        if result.fault or "notes" in result.summary:
            code = max(code, remarks(result, options.quiet, problem.notes))
    if options.json:
        from mechdae.tasks.export import json_text

        print(json_text(results) if results else _empty(problem.name))
    if options.out:
        for result in results:
            for path in save(result, Path(options.out)):
                message(f"written: {path}", options.quiet)
    return code


def check_workers(workers: int | None, kinds: set[str]) -> None:
    """Refuse a number of processes that is none, or that no task uses."""
    if workers is None:
        return
    if workers < 1:
        raise InputError("a whole number above 0 is needed", where="--workers")
    if "study" not in kinds:
        hint = "mechdae synthesize P --workers W" if "synthesis" in kinds else ""
        raise InputError("only studies are spread over processes", where="--workers", hint=hint)


def _empty(name: str) -> str:
    import json

    from mechdae import __version__

    return json.dumps({"mechdae": __version__, "problem": name, "tasks": {}})
