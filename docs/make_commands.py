"""Writes ``docs/reference/commands.md``: what each command says with ``--help``.

``python docs/make_commands.py`` writes; with ``--check`` the exit code is 1 where the page is old.
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
from pathlib import Path

from mechdae.cli import COMMANDS, main

PAGE = Path(__file__).with_name("reference") / "commands.md"
HEAD = """# All commands and options

Generated from `--help` by `docs/make_commands.py`. Conventions, units, exit codes and examples:
[the command line](command-line.md).
"""


def said(words: list[str]) -> str:
    """Return what a command line prints, on a terminal of 90 columns without colours."""
    out = io.StringIO()
    before = dict(os.environ)
    os.environ |= {"COLUMNS": "90", "NO_COLOR": "1"}
    try:
        with contextlib.redirect_stdout(out), contextlib.suppress(SystemExit):
            main(words)
    finally:
        os.environ.clear()
        os.environ |= before
    return out.getvalue().rstrip()


def page() -> str:
    """Return the page."""
    parts = [f"## {name}\n\n```text\n{said([name, '--help'])}\n```\n" for name in COMMANDS]
    return "\n".join([HEAD, *parts])


def written(arguments: list[str]) -> int:
    """Write the page, or say whether it is current."""
    if "--check" in arguments:
        return int(PAGE.read_text(encoding="utf-8") != page())
    PAGE.write_text(page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(written(sys.argv[1:]))
