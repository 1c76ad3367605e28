"""``mechdae new NAME``: a commented problem file; ``mechdae new --from FILE``: from a drawing."""

from __future__ import annotations

import argparse
from pathlib import Path

from mechdae.cli import message
from mechdae.describe.file.library import families, new
from mechdae.errors import InputError

SCHEMA = "#:schema mechdae.schema.json\n"
"""What editors read to complete a file, where ``mechdae schema`` was written beside it."""


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "family", nargs="?", help=f"{', '.join(families())}, or a predefined problem"
    )
    parser.add_argument("--out", metavar="FILE", help="write it there, in UTF-8")
    parser.add_argument(
        "--from", dest="source", metavar="FILE", help="a DXF sketch or an assembly (.asmt)"
    )
    parser.add_argument("--unit", metavar="UNIT", help="of that file: mm, cm, m, in or ft")
    parser.add_argument(
        "--ground",
        action="append",
        default=[],
        metavar="X,Y",
        help="a fixed pin of a sketch, in its unit",
    )


def run(options: argparse.Namespace) -> int:
    if (options.family is None) == (options.source is None):
        hint = "mechdae new four-bar, or mechdae new --from FILE"
        raise InputError("a family or --from FILE is needed", hint=hint)
    if options.out and Path(options.out).exists():
        raise InputError("exists already", where=options.out, hint="choose another name")
    text = SCHEMA + (_template(options) if options.source is None else _read(options))
    if options.out:
        Path(options.out).write_text(text, encoding="utf-8")
        return 0
    print(text, end="")
    return 0


def _template(options: argparse.Namespace) -> str:
    for word in ("unit", "ground"):
        if getattr(options, word):
            raise InputError("only together with --from", where=f"--{word}")
    return new(options.family)


def _read(options: argparse.Namespace) -> str:
    from mechdae.describe import dumps
    from mechdae.parts.exchange.formats import with_remarks

    given: dict[str, object] = {"unit": options.unit} if options.unit else {}
    if options.ground:
        given["ground"] = tuple(_place(text) for text in options.ground)
    problem, remarks = with_remarks(options.source, **given)
    for remark in remarks:
        message(f"mechdae: {remark}", options.quiet)
    return dumps(problem)


def _place(text: str) -> tuple[float, float]:
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"'{text}' is not X,Y", where="--ground") from None
    return x, y
