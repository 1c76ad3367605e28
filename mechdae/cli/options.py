"""Options that several commands share."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from mechdae.errors import InputError

if TYPE_CHECKING:
    from mechdae.describe.file.problem import Problem
    from mechdae.describe.units import Units


def process_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of jobs in several processes."""
    parser.add_argument(
        "--workers", type=int, default=1, metavar="W", help="processes of this machine"
    )
    parser.add_argument(
        "--cluster", metavar="ADDRESS", help="scheduler of a Dask cluster: tcp://host:8786"
    )


def check_processes(options: argparse.Namespace) -> None:
    """Raise for numbers of processes that there are none of, or two ways at once."""
    if options.workers < 1:
        raise InputError("a whole number, 1 or more, is needed", where="--workers")
    if options.cluster and options.workers != 1:
        raise InputError("not together with --workers", where=f"--cluster {options.cluster}")


def units_argument(parser: argparse.ArgumentParser) -> None:
    """Add ``--units``."""
    parser.add_argument(
        "--units", metavar="U", help="what numbers are shown in: mm,deg,kN (JSON and NPZ stay SI)"
    )


def units_asked(options: argparse.Namespace) -> Units:
    """Return the units of ``--units``; SI without it."""
    from mechdae.describe.units import SI, units_of

    if options.units is None:
        return SI
    try:
        return units_of(options.units)
    except InputError as error:
        error.where = "--units"
        raise


def columns_argument(parser: argparse.ArgumentParser) -> None:
    """Add ``--columns``."""
    parser.add_argument(
        "--columns",
        nargs="+",
        action="extend",
        metavar="C",
        help="columns of the table: effort,rod.B.velocity or with blanks (names as there)",
    )


def column_names(options: argparse.Namespace) -> list[str]:
    """Return the names of ``--columns``."""
    return [name.strip() for names in options.columns for name in names.strip(",").split(",")]


def problem_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the problem and ``--set``."""
    parser.add_argument("problem", metavar="P", help="name of a predefined problem, or a file")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="change a parameter or a size",
    )


def problem_of(options: argparse.Namespace) -> Problem:
    """Return the problem with the values of ``--set`` put in."""
    from mechdae.describe.file.load import load

    return load(options.problem).with_values(settings(options.set))


def settings(pairs: list[str], option: str = "--set") -> dict[str, float | str]:
    """Return the values of ``--set NAME=VALUE``; a value may be an expression."""
    values: dict[str, float | str] = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        if not equals or not name.strip() or not text.strip():
            raise InputError(f"'{pair}' is not NAME=VALUE", where=option)
        try:
            values[name.strip()] = float(text)
        except ValueError:
            values[name.strip()] = text.strip()
    return values
