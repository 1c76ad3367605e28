"""``mechdae export P``: another program's format."""

from __future__ import annotations

import argparse

from mechdae.cli.options import problem_arguments, problem_of


def arguments(parser: argparse.ArgumentParser) -> None:
    from mechdae.parts.exchange.formats import FORMATS

    problem_arguments(parser)
    parser.add_argument("--task", metavar="T", help="sweep, reactions or motion; the first one")
    parser.add_argument("--format", required=True, metavar="F", help=", ".join(FORMATS))
    parser.add_argument("--out", required=True, metavar="FILE", help="the file to write")
    parser.add_argument("--overwrite", action="store_true", help="in place of files that are there")
    parser.add_argument("--pose", type=int, metavar="K", help="dxf: pose that is drawn, from 0")
    parser.add_argument(
        "--tolerance",
        type=float,
        metavar="E",
        help="urdf: error of mimic polynomials aimed at, rad or share of the size (1e-6)",
    )


def run(options: argparse.Namespace) -> int:
    from mechdae.parts.exchange import export
    from mechdae.parts.exchange.formats import check_format, places

    check_format(options.format)
    places(options.out, {"": ""}, options.overwrite)
    values = {"pose": options.pose, "tolerance": options.tolerance}
    given = {name: value for name, value in values.items() if value is not None}
    made = export(problem_of(options), options.task, format=options.format, **given)
    for path in made.save(options.out, options.overwrite):
        print(path)
    return 0
