"""``mechdae certify P``, ``mechdae certify --check FILE``: what was proved, to be checked.

``mechdae certify --checker FILE`` writes the program that checks, as one text.
"""

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
    parser.add_argument(
        "--checker",
        metavar="FILE",
        help="write the checker as one file, to be run by itself",
    )


def run(options: argparse.Namespace) -> int:
    from mechdae.parts.proof import as_json, certify, check_certificate
    from mechdae.parts.proof.single_text import checker_text

    if options.checker:
        if options.problem or options.check or options.out or options.task:
            raise InputError("not together with P, --check, --out or --task", where="--checker")
        return _written(options.checker, checker_text(), "--checker")
    problem = problem_of(options) if options.problem else None
    if options.check:
        if options.out or options.task:
            raise InputError("not together with --out or --task", where="--check")
        print(f"{options.check}: proved: {check_certificate(options.check, problem)}")
        return 0
    if problem is None or not options.out:
        raise InputError("a problem and --out FILE are needed, or --check FILE")
    _check_place(options.out, "--out")
    content = certify(problem, options.task)
    message(f"certificate of {problem.name}, task {content['task']}, checked", options.quiet)
    return _written(options.out, as_json(content), "--out")


def _check_place(name: str, option: str) -> None:
    """Refuse a file that is a folder, or is in none."""
    path = Path(name)
    if path.is_dir() or not path.parent.is_dir():
        raise InputError("is a folder, or in none that exists", where=f"{option} {name}")


def _written(name: str, text: str, option: str) -> int:
    """Write a text, print its file, and return the exit code."""
    from mechdae.describe import whole_file

    _check_place(name, option)
    with whole_file(Path(name)) as file:
        file.write(text.encode())
    print(Path(name))
    return 0
