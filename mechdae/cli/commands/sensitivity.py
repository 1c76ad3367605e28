"""``mechdae sensitivity P --of PATH --wrt NAME...``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from mechdae.cli import message
from mechdae.cli.options import problem_arguments, problem_of, settings, units_argument, units_asked
from mechdae.errors import InputError


def arguments(parser: argparse.ArgumentParser) -> None:
    problem_arguments(parser)
    parser.add_argument(
        "--task",
        metavar="T",
        help="the sweep, reactions, motion or equilibrium task, or one of kind sensitivity",
    )
    parser.add_argument(
        "--of", action="append", metavar="PATH", help="path below the task in the JSON"
    )
    parser.add_argument(
        "--wrt", nargs="+", action="extend", metavar="NAME", help="parameters, automatic names"
    )
    parser.add_argument(
        "--tolerance",
        action="append",
        default=[],
        metavar="NAME=HALF",
        help="half width of a parameter: spread to first order, worst case, Monte Carlo",
    )
    parser.add_argument("--order", type=int, choices=(1, 2), help="2: second derivatives too")
    units_argument(parser)
    parser.add_argument("--out", metavar="DIR", help="write CSV, JSON and NPZ there")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")


def run(options: argparse.Namespace) -> int:
    from mechdae.describe.tasks.studies import Sensitivity
    from mechdae.results.tables import table
    from mechdae.tasks.export import json_text, save
    from mechdae.tasks.solve import solve

    units = units_asked(options)
    problem = problem_of(options)
    chosen = problem.tasks.get(options.task) if options.task else None
    if options.task:
        chosen = problem.task(options.task)
    elif not options.of:
        sensitivities = [task for task in problem.tasks.values() if isinstance(task, Sensitivity)]
        chosen = sensitivities[0] if len(sensitivities) == 1 else None
    if isinstance(chosen, Sensitivity):
        if options.of or options.wrt or options.tolerance or options.order:
            raise InputError("the task says what is differentiated", where=f"--task {options.task}")
        task = chosen
    else:
        if not options.of:
            raise InputError("name a path", where="--of", hint="--of efforts/crank.angle")
        if not options.wrt and not options.tolerance:
            raise InputError("name parameters", where="--wrt", hint="--wrt r l")
        task = Sensitivity(
            of=options.task,
            outputs=tuple(options.of),
            wrt=tuple(options.wrt or ()),
            order=options.order or 1,
            tolerances=settings(options.tolerance, "--tolerance") or None,
        )
    result = solve(problem, task).in_units(units)
    print(json_text([result]) if options.json else table(result), end="\n" if options.json else "")
    if options.out:
        if Path(options.out).exists() and not Path(options.out).is_dir():
            raise InputError("is a file, not a folder", where=f"--out {options.out}")
        for path in save(result, Path(options.out)):
            message(f"written: {path}", options.quiet)
    if result.fault:
        print(f"mechdae: {result.fault}", file=sys.stderr)
        return 1
    return 0
