"""``mechdae edit [FILE]``: the editor."""

from __future__ import annotations

import argparse
from pathlib import Path

from mechdae.errors import InputError


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("problem", nargs="?", metavar="P", help="a problem file or a name")
    parser.add_argument("--out", metavar="FILE", default="editor.html", help="default: editor.html")
    parser.add_argument("--lang", default="en", metavar="LANG", help="en or ru")


def run(options: argparse.Namespace) -> int:
    from mechdae.parts.page.editor import editor

    target = Path(options.out)
    if not target.parent.is_dir():
        raise InputError("no such folder", where=str(target.parent))
    print(editor(options.problem or None, options.lang).save(target))
    return 0
