"""What a command says and returns where it cannot go on."""

from __future__ import annotations

import argparse
import io
import os
import sys
from itertools import pairwise
from typing import TextIO

from mechdae.cli import message
from mechdae.errors import MechdaeError, SolveError


def failure(error: BaseException, arguments: argparse.Namespace) -> int:
    """Print what went wrong and return the exit code; raise it where tracebacks are asked for."""
    if isinstance(error, KeyboardInterrupt):
        print("mechdae: interrupted", file=sys.stderr)
        return 130
    if isinstance(error, BrokenPipeError):
        _silence(sys.stdout)
        return 0
    if arguments.debug:
        raise error
    if isinstance(error, OSError):
        place = f"{error.filename}: " if error.filename else ""
        message(f"mechdae: {place}{error.strerror or error}", False)
        return 2
    assert isinstance(error, MechdaeError)
    named = str(getattr(arguments, "problem", None) or "")
    place = f"{named}: " if named.endswith(".toml") and named not in str(error) else ""
    message(f"mechdae: {place}{error}", False)
    return 1 if isinstance(error, SolveError) else 2


def _silence(stream: TextIO) -> None:
    """Lead what is printed from now on nowhere: the reader of the pipe has gone."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


class Unread(io.TextIOBase):
    """A stream whose reader may stop reading (``| head``) while the command still works."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        try:
            return int(self._stream.write(text))
        except BrokenPipeError:
            _silence(self._stream)
            return len(text)

    def flush(self) -> None:
        try:
            self._stream.flush()
        except BrokenPipeError:
            _silence(self._stream)

    def isatty(self) -> bool:
        return bool(self._stream.isatty())


def refused(words: list[str], code: int) -> int:
    """Say what is usually meant by words that are not understood; return the exit code."""
    from mechdae.draw.catalogue import OPTIONS

    if not code:
        return code
    if any("=" not in w for s, w in pairwise(words) if s == "--set"):
        print("  try: --set NAME=VALUE, without blanks: --set a_mm=30", file=sys.stderr)
    for flag, first, second in zip(words, words[1:], words[2:], strict=False):
        option = OPTIONS.get(flag.removeprefix("--"))
        if option and option.what == "names" and "-" not in (first[:1], second[:1]):
            print(f"  try: {flag} {first} {flag} {second}, one for each", file=sys.stderr)
            break
    return code
