"""``mechdae study P``."""

from __future__ import annotations

import argparse
import csv
import os
from contextlib import nullcontext
from typing import TYPE_CHECKING, Any

from mechdae.cli import message
from mechdae.cli.options import (
    check_processes,
    columns_argument,
    problem_arguments,
    problem_of,
    process_arguments,
    units_argument,
    units_asked,
)
from mechdae.cli.progress import check_out, clear, progress, reported
from mechdae.errors import InputError

if TYPE_CHECKING:
    from mechdae.describe.file.problem import Problem
    from mechdae.results import Result


def arguments(parser: argparse.ArgumentParser) -> None:
    problem_arguments(parser)
    parser.add_argument("--task", metavar="T", help="a study of the file; default: the first")
    parser.add_argument("--of", metavar="T", help="the task that is repeated")
    parser.add_argument(
        "--vary",
        action="append",
        metavar="NAME=FROM:TO:COUNT",
        help="a grid over these numbers, all combinations; NAME_mm and so on are units",
    )
    parser.add_argument(
        "--sets", metavar="FILE", help="CSV with a column for each name, a row for each set"
    )
    parser.add_argument(
        "--outputs", action="append", metavar="PATH", help="path below the task to tabulate"
    )
    parser.add_argument(
        "--screen", action="store_true", help="closed form without certificates, very fast"
    )
    process_arguments(parser)
    units_argument(parser)
    columns_argument(parser)
    parser.add_argument(
        "--out", metavar="DIR", help="write results there; a study that was broken off goes on"
    )
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")


def run(options: argparse.Namespace) -> int:
    check_processes(options)
    if options.vary and options.sets:
        raise InputError("not together with --vary", where=f"--sets {options.sets}")
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    units = units_asked(options)
    return reported(_result(options).in_units(units), options)


def _result(options: argparse.Namespace) -> Result:
    from mechdae.design.jobs.distribute import cluster
    from mechdae.tasks.parameter_studies import study

    problem = problem_of(options)
    check_out(options.out, problem, options.task, "study")
    show = progress("sets", options.quiet)
    done = [0, 0]

    def tell(count: int, total: int) -> None:
        done[:] = count, total
        if show is not None:
            show(count, total)

    place: Any = cluster(options.cluster) if options.cluster else nullcontext()
    try:
        with place as executor:
            return study(
                problem,
                options.task,
                vary=_grid(problem, options.vary) if options.vary else None,
                sets=_sets(problem, options.sets) if options.sets else None,
                of=options.of,
                outputs=options.outputs,
                certify=False if options.screen else None,
                workers=options.workers,
                executor=executor,
                out=options.out,
                progress=tell,
            )
    except BaseException:
        clear(show)
        if done[0] and options.out:
            text = f"of {done[1]} sets {done[0]} were computed, finished portions are kept"
            message(f"mechdae: {text} in {options.out}; the same command goes on", options.quiet)
        raise
    finally:
        clear(show)


def _grid(problem: Problem, pairs: list[str]) -> dict[str, list[float | str]]:
    """Return name -> [from, to, count] of ``--vary NAME=FROM:TO:COUNT``."""
    from mechdae.describe.file.reading import to_si

    grid: dict[str, list[float | str]] = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        parts = text.split(":")
        if not equals or len(parts) != 3:
            raise InputError(f"'{pair}' is not NAME=FROM:TO:COUNT", where="--vary")
        base, suffix = _named(problem, name.strip())
        numbers = [_number(part, f"--vary {pair}") for part in parts]
        grid[base] = [*to_si(numbers[:2], suffix), numbers[2]]
    return grid


def _sets(problem: Problem, place: str) -> dict[str, list[float]]:
    """Return the columns of a CSV file; an empty field is no number, nan."""
    from mechdae.describe.file.reading import to_si

    try:
        with open(place, newline="", encoding="utf-8-sig") as file:
            head, *rows = [row for row in csv.reader(file) if row]
    except (UnicodeDecodeError, csv.Error, ValueError):
        raise InputError("a line with names is needed, then rows of numbers", where=place) from None
    for k, row in enumerate(rows, 2):
        if len(row) != len(head):
            what = f"row {k} has {len(row)} fields, the line with names {len(head)}"
            raise InputError(what, where=place)
    columns = {}
    for j, name in enumerate(head):
        base, suffix = _named(problem, name.strip())
        numbers = [_number(row[j] or "nan", f"{place}, row {k}") for k, row in enumerate(rows, 2)]
        columns[base] = [to_si(number, suffix) for number in numbers]
    return columns


def _named(problem: Problem, name: str) -> tuple[str, str]:
    """Return a name without its unit, and the unit."""
    from mechdae.describe.file.reading import split_unit

    known = {*problem.mechanism.parameters, *dict(problem.mechanism.numbers())}
    return (name, "") if name in known else split_unit(name)


def _number(text: str, where: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"'{text.strip()}' is no number", where=where) from None
