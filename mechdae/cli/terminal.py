"""Text on a terminal: no line is wider than it, statuses and errors are in colour."""

from __future__ import annotations

import argparse
import io
import os
import re
import shutil
import textwrap
from typing import TextIO

PROGRAMS = ("schema", "new")
"""Commands whose output is a file: it is printed as it is."""
RED, YELLOW, END = "\033[31m", "\033[33m", "\033[0m"
COLOURS = {
    **dict.fromkeys(("unassembled", "singular", "ambiguous", "jammed", "stopped"), RED),
    "limit": YELLOW,
}
"""Statuses that need a look."""
STATUS = re.compile(rf"^( +)({'|'.join(COLOURS)})(?= )")
SAID = re.compile(r"^mechdae: (?P<task>task \S+: |\S+: )?(?P<note>note:)?")
HEAD = re.compile(r"\s*\S+(?: \S+)*\s{2,}|\s*")
"""What a line begins with before a wide gap: further lines are indented as far."""


def width_of(stream: TextIO) -> int:
    """Return how many columns a terminal has, 0 of what is none."""
    return shutil.get_terminal_size((80, 24)).columns if stream.isatty() else 0


def coloured() -> bool:
    """Return whether colours are wanted: not with NO_COLOR, nor on a terminal without them."""
    return not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def fitted(text: str, width: int) -> str:
    """Return lines that fit a width, broken at spaces; paths are left whole."""
    return "\n".join(_folded(line, width) for line in text.split("\n"))


def _folded(line: str, width: int) -> str:
    if len(line) <= width:
        return line
    head = HEAD.match(line)
    indent = head.end() if head and head.end() <= width // 3 else 4
    return textwrap.fill(
        line, width, subsequent_indent=" " * indent, break_long_words=False,
        break_on_hyphens=False, replace_whitespace=False, drop_whitespace=True,
    )  # fmt: skip


def said(text: str, stream: TextIO) -> str:
    """Return a message as it is shown there: folded, what it is about in colour."""
    width = width_of(stream)
    if not width:
        return text
    text = fitted(text, width)
    head = SAID.match(text)
    if head is None or not coloured():
        return text
    return (
        f"{YELLOW if head['note'] else RED}{head[0].rstrip()}{END}{text[len(head[0].rstrip()) :]}"
    )


class Terminal(io.TextIOBase):
    """A stream to a terminal."""

    def __init__(self, stream: TextIO, width: int) -> None:
        self._stream, self._width, self._open = stream, width, ""

    def write(self, text: str) -> int:
        *lines, self._open = (self._open + text).split("\n")
        for line in lines:
            shown = fitted(line, self._width)
            if coloured():
                shown = STATUS.sub(lambda found: _in_colour(found[1], found[2]), shown)
            self._stream.write(f"{shown}\n")
        return len(text)

    def flush(self) -> None:
        self._stream.write(self._open)
        self._open = ""
        self._stream.flush()

    def isatty(self) -> bool:
        return True


def _in_colour(indent: str, status: str) -> str:
    return f"{indent}{COLOURS[status]}{status}{END}"


def is_text(arguments: argparse.Namespace) -> bool:
    """Return whether a command prints for people, not for programs."""
    form = getattr(arguments, "format", None)
    data = getattr(arguments, "json", False) or arguments.command in PROGRAMS
    return not data and form in (None, "text")
