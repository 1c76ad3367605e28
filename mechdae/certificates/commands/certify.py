"""``mechdae certify P``, ``mechdae certify --check FILE``: what was proved, to be checked."""

from __future__ import annotations

import argparse
from pathlib import Path

from mechdae.cli import message
from mechdae.cli.options import problem_of
from mechdae.errors import InputError


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("problem", nargs="?", metavar="P", help="name of a problem, or a file")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="change a parameter or a size",
    )
    parser.add_argument("--task", metavar="T", help="a sweep or modes; default: the first of these")
    parser.add_argument("--out", metavar="FILE", help="write the certificate there")
    parser.add_argument(
        "--check", metavar="FILE", help="check a certificate; with P also that it is of P"
    )


def run(options: argparse.Namespace) -> int:
    from mechdae.certificates import as_json, certify, check_certificate
    from mechdae.describe.file.whole import whole_file

    problem = problem_of(options) if options.problem else None
    if options.check:
        if options.out or options.task:
            raise InputError("not together with --out or --task", where="--check")
        print(f"{options.check}: proved: {check_certificate(options.check, problem)}")
        return 0
    if problem is None or not options.out:
        raise InputError("a problem and --out FILE are needed, or --check FILE")
    path = Path(options.out)
    if path.is_dir() or not path.parent.is_dir():
        raise InputError("is a folder, or in none that exists", where=f"--out {options.out}")
    content = certify(problem, options.task)
    with whole_file(path) as file:
        file.write(as_json(content).encode())
    message(f"certificate of {problem.name}, task {content['task']}, checked", options.quiet)
    print(path)
    return 0
