"""``mechdae assign P``: variants of a problem for a class, with sheets and answer keys."""

from __future__ import annotations

import argparse
from math import radians
from pathlib import Path

from mechdae.cli import message
from mechdae.cli.options import problem_arguments, problem_of, units_argument, units_asked
from mechdae.errors import InputError


def arguments(parser: argparse.ArgumentParser) -> None:
    problem_arguments(parser)
    parser.add_argument(
        "--vary",
        action="append",
        default=[],
        metavar="NAME=LOW:HIGH",
        help="a number that is drawn, with round values; NAME=LOW:HIGH:STEP",
    )
    parser.add_argument("--count", type=int, metavar="N", help="variants (30, or all there are)")
    parser.add_argument(
        "--students", metavar="FILE", help="names, one to a line: a variant for each"
    )
    parser.add_argument(
        "--task",
        action="append",
        metavar="T",
        help="a sweep or a task of reactions; again for a further part of the sheet",
    )
    parser.add_argument(
        "--transmission-deg", type=float, metavar="A", help="least transmission angle (30)"
    )
    parser.add_argument(
        "--positions", type=int, default=12, metavar="N", help="positions in the tables"
    )
    parser.add_argument(
        "--pose", type=int, default=1, metavar="K", help="position explained in the key, from 0"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="of the numbers")
    units_argument(parser)
    parser.add_argument("--lang", default="en", metavar="LANG", help="en or ru")
    parser.add_argument("--format", default="html", choices=("html", "typ", "pdf"))
    parser.add_argument("--out", required=True, metavar="DIR", help="a folder that is not there")


def run(options: argparse.Namespace) -> int:
    from mechdae.parts.paper.assignments.assign import USUAL, assign, free_folder

    free_folder(options.out, options.format)
    angle = options.transmission_deg
    made = assign(
        problem_of(options),
        task=options.task,
        vary=_ranges(options.vary),
        count=options.count,
        transmission_angle=None if angle is None else radians(angle),
        positions=options.positions,
        pose=options.pose,
        seed=options.seed,
        lang=options.lang,
        units=units_asked(options),
        students=_students(options.students),
    )
    print(made.save(options.out, options.format))
    fewer = "" if options.count or len(made) == USUAL else f": no {USUAL} in these ranges"
    sets = "set" if made.tried == 1 else "sets"
    variants = "variant" if len(made) == 1 else "variants"
    counts = f"{len(made)} {variants} of {made.tried} {sets} of numbers"
    message(f"mechdae: {counts}{fewer}", options.quiet)
    return 0


def _students(path: str | None) -> list[str]:
    """Return the names of a file, one to a line."""
    if path is None:
        return []
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError("cannot be read as text", where=path) from error
    names = [line.strip() for line in text.splitlines() if line.strip()]
    if not names:
        raise InputError("holds no names", where=path, hint="one to a line")
    return names


def _ranges(pairs: list[str]) -> dict[str, tuple[str, ...]]:
    """Return name -> (low, high) or (low, high, step), digits as they were typed."""
    if not pairs:
        raise InputError("name a number and its range", where="--vary", hint="--vary a=0.1:0.2")
    found: dict[str, tuple[str, ...]] = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        if not equals or not name.strip() or not text.strip():
            raise InputError(f"'{pair}' is not NAME=LOW:HIGH", where="--vary")
        if name.strip() in found:
            raise InputError("is varied twice", where=f"--vary {name.strip()}")
        found[name.strip()] = tuple(part.strip() for part in text.split(":"))
    return found
