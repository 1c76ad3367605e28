"""Draws the graphs of every predefined problem, in every kind that applies.

    python -m tests.scripts.every_graph [NAME ...]

A sample of them is part of the suite. The exit code is 1 where a graph is missing or not readable.
"""

from __future__ import annotations

import sys
import traceback
import warnings

from mechdae.describe.file import library
from tests.shared.graphed import drawn_readably


def main(names: list[str]) -> int:
    """Draw the problems named, all of them by default."""
    failed = []
    warnings.simplefilter("error")
    for name in names or library.names():
        try:
            drawn_readably(name)
        except Exception:
            traceback.print_exc()
            failed.append(name)
        print("NOT READABLE" if name in failed else "readable", name, flush=True)
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
