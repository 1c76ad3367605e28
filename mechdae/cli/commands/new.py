"""``mechdae new FAMILY``: a commented template on stdout."""

from __future__ import annotations

import argparse
from pathlib import Path

from mechdae.errors import UnknownName

FOLDER = Path(__file__).resolve().parent.parent.parent / "templates"


def families() -> list[str]:
    """Return the names of the templates."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("family", help=", ".join(families()))


def run(options: argparse.Namespace) -> int:
    if options.family not in families():
        raise UnknownName("family", options.family, families())
    print((FOLDER / f"{options.family}.toml").read_text(encoding="utf-8"), end="")
    return 0
