"""``mechdae new FAMILY``: a commented template on stdout."""

from __future__ import annotations

import argparse
from pathlib import Path

from mechdae.errors import InputError, UnknownName

FOLDER = Path(__file__).resolve().parent.parent.parent / "templates"


def families() -> list[str]:
    """Return the names of the templates."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("family", help=", ".join(families()))
    parser.add_argument("--out", metavar="FILE", help="write it there, in UTF-8")


def run(options: argparse.Namespace) -> int:
    if options.family not in families():
        raise UnknownName("family", options.family, families())
    text = (FOLDER / f"{options.family}.toml").read_text(encoding="utf-8")
    if options.out:
        if Path(options.out).exists():
            raise InputError("exists already", where=options.out, hint="choose another name")
        Path(options.out).write_text(text, encoding="utf-8")
        return 0
    print(text, end="")
    return 0
