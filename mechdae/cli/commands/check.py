"""``mechdae check P...``."""

from __future__ import annotations

import argparse

from mechdae.cli import message
from mechdae.errors import MechdaeError, SolveError


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("problems", nargs="*", metavar="P", help="names or files (default: all)")


def run(options: argparse.Namespace) -> int:
    from mechdae.describe.file import library
    from mechdae.describe.file.load import load
    from mechdae.tasks.check import check, doubts, validate

    code = 0
    for name in options.problems or library.names():
        try:
            problem = load(name)
        except MechdaeError as error:
            message(f"mechdae: {error}", False)
            code = 2
            continue
        for note in doubts(problem):
            message(f"mechdae: {problem.name}: note: {note}", options.quiet)
        errors = validate(problem)
        for found in errors:
            message(f"mechdae: {problem.name}: {found}", False)
            code = max(code, 1 if isinstance(found, SolveError) else 2)
        verdicts = check(problem)
        missed = [verdict for verdict in verdicts if not verdict.met]
        met = f"{len(verdicts) - len(missed)} of {len(verdicts)} expected values met"
        if errors:
            print(f"{problem.name}: not valid")
        else:
            print(f"{problem.name}: {met if verdicts else 'valid, no expected values'}")
        for verdict in missed if not errors else []:
            entry = verdict.expected
            print(f"  {entry.task} {entry.what}: {verdict.note or _difference(verdict)}")
            code = max(code, 2 if verdict.note else 1)
    return code


def _difference(verdict) -> str:  # type: ignore[no-untyped-def]
    return (
        f"ours {verdict.value}, expected {verdict.expected.value}, "
        f"deviation {verdict.deviation:.3g}, allowed {verdict.allowed:.3g}"
    )
