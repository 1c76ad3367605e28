"""The log of the starts of a synthesis: one line for each optimum.

Lines hold optima, floats with the digits that give the same float back.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import casadi
import numpy as np

from mechdae import __version__
from mechdae.jobs.log import JobLog
from mechdae.synthesis.ipopt import Optimum

if TYPE_CHECKING:
    from mechdae.synthesis.goals.base import Seed

FORMAT = 1
NAME = "starts.jsonl"


class Log(JobLog):
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
        head = {
            "format": FORMAT, "mechdae": __version__, "casadi": casadi.CasadiMeta.version(),
            "task": task, "problem": text,
        }  # fmt: skip
        self.finished: dict[int, Optimum] = {}
        self._drawn: dict[int, str] = {}
        super().__init__(Path(folder) / NAME, head)
        for entry in self.entries:
            self._enter(entry)

    def known(self, starts: Mapping[int, tuple[int, Seed]]) -> dict[int, Optimum]:
        """Return what is finished of some starts; writes the first line if there is none.

        Raises
        ------
        InputError
            A start of the log is another one than that of the same index.
        """
        self.begin()
        for index in starts.keys() & self.finished.keys():
            if self._drawn[index] != digest(*starts[index]):
                raise self.other(
                    f"start {index} there is not the one that is drawn here, perhaps by another "
                    "version of NumPy or on another kind of processor"
                )
        return {index: self.finished[index] for index in starts if index in self.finished}

    def put(self, index: int, start: tuple[int, Seed], found: Optimum) -> None:
        """Write a finished start; a second time is nothing."""
        if index not in self.finished:
            self._drawn[index] = digest(*start)
            self.add({"start": index, "drawn": self._drawn[index], **_plain(found)})
            self.finished[index] = found

    def _enter(self, entry: dict[str, Any]) -> None:
        """Take a finished start; what cannot be read is a start that is solved again."""
        try:
            index, drawn = entry.pop("start"), entry.pop("drawn")
            found = _optimum(entry)
        except (ValueError, KeyError, TypeError, AttributeError):
            return
        if isinstance(index, int) and index not in self.finished:
            self.finished[index], self._drawn[index] = found, drawn


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
