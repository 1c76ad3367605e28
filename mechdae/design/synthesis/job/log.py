"""The log of a synthesis: one line for each optimum, and for each part of the paths of exact goals.

Lines hold optima and ends of paths, floats with the digits that give the same float back.
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
from mechdae.design.jobs.log import JobLog
from mechdae.design.synthesis.ipopt import Optimum
from mechdae.types import Json

if TYPE_CHECKING:
    from mechdae.design.synthesis.exact.complete import PathWork
    from mechdae.design.synthesis.goals.base import Seed

FORMAT = 1
NAME = "starts.jsonl"


class Log(JobLog):
    """The log in a folder, held by one process at a time.

    `total`: number of starts that the job has now. A job with more or fewer of them goes on with
    what is there: a start is known by its numbers, not by its place.
    """

    def __init__(self, folder: str | Path, text: str, task: str, total: int = 0) -> None:
        head = {
            "format": FORMAT, "mechdae": __version__, "casadi": casadi.CasadiMeta.version(),
            "task": task, "problem": text,
        }  # fmt: skip
        self.total = total
        self.finished: dict[str, Optimum] = {}
        self.paths: dict[str, Any] = {}
        self._drawn: dict[tuple[int, int], str] = {}
        super().__init__(Path(folder) / NAME, head)
        for entry in self.entries:
            self._enter(entry)

    def known(self, starts: Mapping[int, tuple[int, Seed]]) -> dict[int, Optimum]:
        """Return what is finished of some starts; writes the first line if there is none."""
        self.begin()
        drawn = {index: digest(*start) for index, start in starts.items()}
        for index, start in drawn.items():
            if self._drawn.get((self.total, index), start) != start:
                raise self.other(
                    f"start {index} there is not the one that is drawn here, perhaps by another "
                    "version of NumPy or on another kind of processor"
                )
        return {i: self.finished[key] for i, key in drawn.items() if key in self.finished}

    def put(self, index: int, start: tuple[int, Seed], found: Optimum) -> None:
        """Write a finished start; a second time is nothing."""
        drawn = digest(*start)
        if drawn not in self.finished:
            self._drawn[self.total, index] = drawn
            self.add({"start": index, "of": self.total, "drawn": drawn, **_plain(found)})
            self.finished[drawn] = found

    def put_paths(self, drawn: str, ends: Any) -> None:
        """Write where paths lead to; a second time is nothing."""
        if drawn not in self.paths:
            rows = [row.view(float).tolist() if np.isfinite(row).all() else None for row in ends]
            self.add({"paths": drawn, "unknowns": ends.shape[1], "ends": rows})
            self.paths[drawn] = ends

    def _enter_paths(self, entry: Json) -> None:
        """Take ends of paths; what cannot be read is followed again."""
        try:
            count = int(entry["unknowns"])
            rows = [[np.nan] * 2 * count if row is None else row for row in entry["ends"]]
            ends = np.array(rows, float).reshape(len(rows), 2 * count).view(complex)
        except (ValueError, KeyError, TypeError):
            return
        self.paths.setdefault(str(entry["paths"]), ends)

    def _enter(self, entry: Json) -> None:
        """Take a finished start; what cannot be read is a start that is solved again."""
        if "paths" in entry:
            self._enter_paths(entry)
            return
        try:
            index, total, drawn = entry.pop("start"), entry.pop("of"), entry.pop("drawn")
            found = _optimum(entry)
        except (ValueError, KeyError, TypeError, AttributeError):
            return
        if isinstance(index, int) and isinstance(total, int) and isinstance(drawn, str):
            self.finished.setdefault(drawn, found)
            self._drawn.setdefault((total, index), drawn)


def digest(kind: int, start: Seed) -> str:
    """Return a fingerprint of a start, to the last bit."""
    found = hashlib.sha256(str(kind).encode())
    for table in (start.values, start.given):
        for name, value in sorted(table.items()):
            array = np.ascontiguousarray(value, dtype="<f8")
            found.update(f"{name}{array.shape}".encode() + array.tobytes())
    return found.hexdigest()[:32]


def fingerprint(work: PathWork) -> str:
    """Return a fingerprint of paths, to the last bit of where they start and lead to."""
    found = hashlib.sha256(type(work.family).__name__.encode())
    for part in (getattr(work.family, "given", ()), work.start, work.target, work.bend, work.z):
        array = np.asarray(part)
        found.update(f"{array.shape}".encode() + array.tobytes())
    return found.hexdigest()[:32]


def _plain(found: Optimum) -> Json:
    return {entry.name: _text(getattr(found, entry.name)) for entry in fields(found)}


def _text(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return [_text(item) for item in value.tolist()]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else str(float(value))
    return value


def _optimum(entry: Mapping[str, Any]) -> Optimum:
    values: dict[str, Any] = {}
    for field in fields(Optimum):
        value = entry[field.name]
        if isinstance(value, list):
            value = np.array([float(item) for item in value])
        elif field.type == "float":
            value = float(value)
        values[field.name] = value
    return Optimum(**values)
