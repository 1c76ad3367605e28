"""casadi's own warnings are for whoever calls casadi: they do not reach the terminal."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

WARNING = ("CasADi - ", "WARNING(")
"""What a line of casadi's warnings begins with, and what is in it."""


class _Sieve:
    """A stream that lets everything through but casadi's warnings, which come in pieces."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream
        self._held = ""

    def write(self, text: str) -> int:
        """Write what cannot be a line of a warning; hold back what may become one."""
        self._held += text
        *lines, self._held = self._held.split("\n")
        for line in lines:
            if not (line.startswith(WARNING[0]) and WARNING[1] in line):
                self._stream.write(line + "\n")
        if not (self._held.startswith(WARNING[0]) or WARNING[0].startswith(self._held)):
            self.release()
        return len(text)

    def release(self) -> None:
        """Write what is held back."""
        if self._held:
            self._stream.write(self._held)
        self._held = ""

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextmanager
def quiet() -> Iterator[None]:
    """Keep casadi's warnings from stderr; everything else written there passes."""
    before = sys.stderr
    if before is None or isinstance(before, _Sieve):
        yield
        return
    sieve: _Sieve = _Sieve(before)
    sys.stderr = sieve
    try:
        yield
    finally:
        sieve.release()
        if sys.stderr is sieve:
            sys.stderr = before
