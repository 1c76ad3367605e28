"""``mechdae report P``: a course report."""

from __future__ import annotations

import argparse
from pathlib import Path

from mechdae.cli.options import problem_arguments, problem_of, units_argument, units_asked


def arguments(parser: argparse.ArgumentParser) -> None:
    problem_arguments(parser)
    parser.add_argument(
        "--task", metavar="T", help="a sweep or a task of reactions; the first one over an interval"
    )
    parser.add_argument(
        "--positions", type=int, default=12, metavar="N", help="positions in the tables"
    )
    parser.add_argument(
        "--pose", type=int, default=1, metavar="K", help="position explained in full, from 0"
    )
    units_argument(parser)
    parser.add_argument("--lang", default="en", metavar="LANG", help="en or ru")
    parser.add_argument("--out", required=True, metavar="FILE", help=".html, .typ or .pdf")


def run(options: argparse.Namespace) -> int:
    from mechdae.parts.paper.reports.report import report, writable

    target = Path(options.out)
    writable(target)
    made = report(
        problem_of(options),
        options.task,
        positions=options.positions,
        pose=options.pose,
        lang=options.lang,
        units=units_asked(options),
    )
    print(made.save(target))
    return 0
