"""The log of finished starts: one line each, on the disk before the next one counts.

The first line says which job it is; the others hold optima, floats with the digits that give
the same float back. A line that a killed process left unfinished is cut off.
"""

from __future__ import annotations

import errno
import hashlib
import json
import math
import os
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import casadi
import numpy as np

from mechdae import __version__
from mechdae.errors import InputError, shorten
from mechdae.synthesis.ipopt import Optimum

if TYPE_CHECKING:
    from mechdae.synthesis.goals.base import Seed

FORMAT = 1
NAME = "starts.jsonl"


class Log:
    """The log in a folder, held by one process at a time.

    Parameters
    ----------
    folder
        Is made if it is not there.
    text, task
        What determines the starts: a problem file, the name of its task.

    Attributes
    ----------
    finished : dict of Optimum
        By index of the start.

    Raises
    ------
    InputError
        The log of another job is there, or a process that is running holds it.
    """

    def __init__(self, folder: str | Path, text: str, task: str) -> None:
        self._head = {
            "format": FORMAT, "mechdae": __version__, "casadi": casadi.CasadiMeta.version(),
            "task": task, "problem": text,
        }  # fmt: skip
        self.path = Path(folder) / NAME
        self.finished: dict[int, Optimum] = {}
        self._drawn: dict[int, str] = {}
        self._begun = False
        if self.path.parent.exists() and not self.path.parent.is_dir():
            raise InputError("is a file, not a folder", where=f"out {folder}")
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0), 0o666)
        try:
            if not _held(self._file):
                raise InputError(
                    "another process is working on this job", where=f"out {folder}",
                    hint="wait for it, or give another folder",
                )  # fmt: skip
            self._read()
        except BaseException:
            os.close(self._file)
            raise

    def close(self) -> None:
        """Let others have the log."""
        os.close(self._file)

    def __enter__(self) -> Log:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def known(self, starts: Mapping[int, tuple[int, Seed]]) -> dict[int, Optimum]:
        """Return what is finished of some starts; writes the first line if there is none.

        Raises
        ------
        InputError
            A start of the log is another one than that of the same index.
        """
        if not self._begun:
            self._append(self._head)
            self._begun = True
        for index in starts.keys() & self.finished.keys():
            if self._drawn[index] != digest(*starts[index]):
                raise self._other(
                    f"start {index} there is not the one that is drawn here, perhaps by another "
                    "version of NumPy or on another kind of processor"
                )
        return {index: self.finished[index] for index in starts if index in self.finished}

    def add(self, index: int, start: tuple[int, Seed], found: Optimum) -> None:
        """Write a finished start; a second time is nothing."""
        if index not in self.finished:
            self._drawn[index] = digest(*start)
            self._append({"start": index, "drawn": self._drawn[index], **_plain(found)})
            self.finished[index] = found

    def _append(self, entry: Mapping[str, Any]) -> None:
        line = json.dumps(entry, ensure_ascii=False, allow_nan=False).encode() + b"\n"
        os.lseek(self._file, 0, os.SEEK_END)
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
            for line in lines[1:]:
                self._enter(line)
        elif content and not _might_begin(content):
            raise InputError("is no log of a job", where=str(self.path))
        os.ftruncate(self._file, whole)

    def _compare(self, line: bytes) -> None:
        try:
            found = json.loads(line)
        except ValueError:
            found = None
        if not isinstance(found, dict) or "format" not in found:
            raise InputError("is no log of a job", where=str(self.path))
        for key, mine in self._head.items():
            if found.get(key) != mine and key != "problem":
                raise self._other(f"{key} is {found.get(key)} there, {mine} here")
        if found.get("problem") != self._head["problem"]:
            raise self._other(_difference(str(found.get("problem")), str(self._head["problem"])))
        self._begun = True

    def _enter(self, line: bytes) -> None:
        """Take a finished start; what cannot be read is a start that is solved again."""
        try:
            entry = json.loads(line)
            index, drawn = entry.pop("start"), entry.pop("drawn")
            found = _optimum(entry)
        except (ValueError, KeyError, TypeError, AttributeError):
            return
        if isinstance(index, int) and index not in self.finished:
            self.finished[index], self._drawn[index] = found, drawn

    def _other(self, what: str) -> InputError:
        return InputError(
            f"holds another job: {what}", where=str(self.path), hint="give another folder"
        )


def digest(kind: int, start: Seed) -> str:
    """Return a fingerprint of a start, to the last bit."""
    found = hashlib.sha256(str(kind).encode())
    for table in (start.values, start.given):
        for name, value in sorted(table.items()):
            array = np.ascontiguousarray(value, dtype="<f8")
            found.update(f"{name}{array.shape}".encode() + array.tobytes())
    return found.hexdigest()[:32]


def _plain(found: Optimum) -> dict[str, Any]:
    return {entry.name: _text(getattr(found, entry.name)) for entry in fields(found)}


def _text(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return [_text(item) for item in value.tolist()]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else str(float(value))
    return value


def _optimum(entry: Mapping[str, Any]) -> Optimum:
    values: dict[str, Any] = {}
    for own in fields(Optimum):
        value = entry[own.name]
        if isinstance(value, list):
            value = np.array([float(item) for item in value])
        elif own.type == "float":
            value = float(value)
        values[own.name] = value
    return Optimum(**values)


def _might_begin(content: bytes) -> bool:
    """Return whether an unfinished line is the beginning of a log."""
    return b'{"format":'.startswith(content[:10])


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


def _differences(one: Any, other: Any, place: str = "") -> Iterator[tuple[str, Any, Any]]:
    if isinstance(one, dict) and isinstance(other, dict):
        for key in dict.fromkeys([*one, *other]):
            inner = f"{place}.{key}" if place else key
            yield from _differences(one.get(key), other.get(key), inner)
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for k, pair in enumerate(zip(one, other, strict=True)):
            yield from _differences(*pair, f"{place}[{k}]")
    elif one != other:
        yield place, one, other


def _shown(value: Any) -> str:
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
