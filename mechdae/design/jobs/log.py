"""The log of a job: one line for each finished piece, on the disk before the next one counts.

The first line says which job it is. A line that a killed process left unfinished is cut off.
"""

from __future__ import annotations

import errno
import json
import os
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from mechdae.errors import InputError, SolveError, shorten

if TYPE_CHECKING:
    from mechdae.types import Json


class JobLog:
    """A log in a folder, held by one process at a time."""

    def __init__(self, path: str | Path, head: Mapping[str, object]) -> None:
        self._head = dict(head)
        self.path: Path = Path(path)
        self.folder: Path = self.path.parent
        self.entries: list[dict[str, object]] = []
        self._begun = False
        if self.folder.exists() and not self.folder.is_dir():
            raise InputError("is a file, not a folder", where=f"out {self.folder}")
        self.folder.mkdir(parents=True, exist_ok=True)
        self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0), 0o666)
        try:
            if not _held(self._file):
                raise InputError(
                    "another process is working on this job", where=f"out {self.folder}",
                    hint="wait for it, or give another folder",
                )  # fmt: skip
            self._read()
        except BaseException:
            os.close(self._file)
            raise

    def close(self) -> None:
        """Let others have the log."""
        os.close(self._file)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def begin(self) -> None:
        """Write the first line if there is none."""
        if not self._begun:
            self._append(self._head)
            self._begun = True

    def add(self, entry: Mapping[str, object]) -> None:
        """Write a finished piece."""
        self.begin()
        self._append(entry)

    def _append(self, entry: Mapping[str, object]) -> None:
        line = json.dumps(entry, ensure_ascii=False, allow_nan=False).encode() + b"\n"
        os.lseek(self._file, 0, os.SEEK_END)
        with kept(self.path):
            while line:
                line = line[os.write(self._file, line) :]
            os.fsync(self._file)

    def _read(self) -> None:
        os.lseek(self._file, 0, os.SEEK_SET)
        content = b"".join(iter(lambda: os.read(self._file, 1 << 20), b""))
        whole = content.rfind(b"\n") + 1
        lines = content[:whole].split(b"\n")[:-1]
        if lines:
            self._compare(lines[0])
            self.entries = [entry for entry in map(_entry, lines[1:]) if entry is not None]
        elif content and not b'{"format":'.startswith(content[:10]):
            raise InputError("is no log of a job", where=str(self.path))
        os.ftruncate(self._file, whole)

    def _compare(self, line: bytes) -> None:
        found = _entry(line)
        if found is None or "format" not in found:
            raise InputError("is no log of a job", where=str(self.path))
        for key, mine in self._head.items():
            if found.get(key) != mine and key != "problem":
                raise self.other(f"{key} is {found.get(key)} there, {mine} here")
        if found.get("problem") != self._head["problem"]:
            raise self.other(_difference(str(found.get("problem")), str(self._head["problem"])))
        self._begun = True

    def other(self, what: str) -> InputError:
        return InputError(
            f"holds another job: {what}", where=str(self.path), hint="give another folder"
        )


@contextmanager
def kept(path: Path) -> Iterator[None]:
    """Tell of a file that cannot be written as what it is for a job: an end, nothing lost."""
    try:
        yield
    except OSError as error:
        raise SolveError(
            f"{path} cannot be written: {error.strerror or error}",
            hint=f"what is finished is kept in {path.parent}: make room, and begin again",
        ) from error


def _entry(line: bytes) -> Json | None:
    try:
        found = json.loads(line)
    except ValueError:
        return None
    return found if isinstance(found, dict) else None


def _difference(there: str, here: str) -> str:
    """Return the first place at which two problem files differ."""
    try:
        tables = tomllib.loads(there), tomllib.loads(here)
    except tomllib.TOMLDecodeError:
        return "the problem is another one"
    for place, one, other in _differences(*tables):
        if place.startswith("tasks.") and place.count(".") == 1 and None in (one, other):
            continue
        return f"{place} is {_shown(one)} there, {_shown(other)} here"
    return "the problem is another one"


def _differences(one: object, other: object, place: str = "") -> Iterator[tuple[str, Any, Any]]:
    if isinstance(one, dict) and isinstance(other, dict):
        for key in dict.fromkeys([*one, *other]):
            inner = f"{place}.{key}" if place else key
            yield from _differences(one.get(key), other.get(key), inner)
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for k, pair in enumerate(zip(one, other, strict=True)):
            yield from _differences(*pair, f"{place}[{k}]")
    elif one != other:
        yield place, one, other


def _shown(value: int) -> str:
    return "not given" if value is None else shorten(json.dumps(value))


def _held(file: int) -> bool:
    """Lock a file for this process; return False where another process has it.

    The system takes the lock back when the file is closed or the process ends, however it ends.
    """
    try:
        import fcntl
    except ImportError:  # Windows
        import msvcrt

        try:
            os.lseek(file, 1 << 30, os.SEEK_SET)
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
        except OSError:
            return False
        return True
    try:
        fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:  # others: a file system without locks
        return error.errno not in (errno.EACCES, errno.EAGAIN)
    return True
