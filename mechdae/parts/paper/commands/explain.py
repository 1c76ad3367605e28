"""``mechdae explain P``: a pose on paper."""

from __future__ import annotations

import argparse
import sys

from mechdae.cli.options import problem_arguments, problem_of, units_argument, units_asked

FORMATS = ("text", "html", "typ", "json")


def arguments(parser: argparse.ArgumentParser) -> None:
    problem_arguments(parser)
    parser.add_argument("--task", metavar="T", help="a sweep or a task of reactions; the first one")
    parser.add_argument("--pose", type=int, metavar="K", help="index of the pose, from 0")
    parser.add_argument("--group", metavar="G", help="one group, as the structural formula has it")
    units_argument(parser)
    parser.add_argument("--lang", default="en", metavar="LANG", help="en or ru")
    parser.add_argument("--format", default="text", choices=FORMATS)
    parser.add_argument("--out", metavar="FILE", help="write it there instead of printing it")


def run(options: argparse.Namespace) -> int:
    from mechdae.parts.paper.explanations import explain

    found = explain(
        problem_of(options),
        options.task,
        pose=options.pose,
        group=options.group,
        lang=options.lang,
        units=units_asked(options),
    )
    if options.out is None:
        sys.stdout.write(getattr(found, options.format)())
    else:
        print(found.save(options.out, options.format))
    return 0
