"""A result as one NPZ file, to the last bit: what the JSON has, its mechanism and its task.

Arrays are members of the file; all else is a text in JSON, in which they are named. Nothing in it
is executed when it is read.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae import __version__
from mechdae.describe.file.load import from_dict
from mechdae.describe.file.problem import Problem
from mechdae.describe.file.sections import read_task
from mechdae.describe.file.writing import alone, task_text
from mechdae.errors import MechdaeError, SolveError
from mechdae.records import dataclass
from mechdae.results import Named, Result, Series, Summary, events_of, kinds, plain
from mechdae.types import Integers, Json, Texts

if TYPE_CHECKING:
    from mechdae.describe.mechanism import Mechanism
    from mechdae.results.result import SweepResult


FORMAT = 1
META = "meta"
ARRAY = "@array"
"""Key of the name of an array in the text."""
SEPARATE = ("mechanism", "definition", "units", "motions")
"""Fields that are not written as they are."""
NAMED = {
    "drivers": "driver", "bodies": "body", "points": "point", "joints": "joint",
    "outputs": "output",
}  # fmt: skip
SERIES = ("bound", "centres", "efforts", "scalars", "work")
OF_SERIES = ("parts", "loads")
SUMMARIES = ("summary", "unique")
PARTS = ("whole", "smooth", "at_targets", "between")
"""Results that a design's motion has."""
SEVERAL = ("smooth",)
"""Those that are several, in a tuple."""


@dataclass(frozen=True)
class StoredMotion:
    """The motions of a design as they were computed; see ``DesignMotion`` for what they are."""

    problem: Problem
    parts: dict[str, tuple[SweepResult] | SweepResult]

    def __getattr__(self, name: str) -> tuple[SweepResult] | SweepResult:
        if name not in PARTS:
            raise AttributeError(name)
        found = self.parts[name]
        if isinstance(found, str):
            raise SolveError(found)
        return found


def packed(result: Result) -> dict[str, Any]:
    """Return the arrays of a file that `unpacked` makes the result from again."""
    arrays: dict[str, Any] = {}
    meta = _of_result(result, arrays) | {"format": FORMAT, "mechdae": __version__}
    motions = getattr(result, "motions", {})
    meta["motions"] = [_of_motion(text, motion, arrays) for text, motion in motions.items()]
    return {META: _bytes(meta), **arrays}


def _bytes(meta: Json) -> Integers:
    return np.frombuffer(json.dumps(meta, ensure_ascii=False).encode(), dtype=np.uint8)


def meta_of(file: Mapping[str, Any]) -> Json:
    """Return the text of a file as data."""
    found: Json = json.loads(bytes(file[META]).decode())
    return found


def unpacked(file: Mapping[str, Any]) -> Result:
    """Return the result of which a file was written."""
    meta = meta_of(file)
    result = _result(meta, file)
    motions = {
        meta_motion["problem"]: _motion(meta_motion, file, result)
        for meta_motion in meta["motions"]
    }
    return result.as_kind(type(result), motions=motions) if motions else result


def _of_result(result: Result, arrays: dict[str, Any]) -> Json:
    """Return a result as text, its arrays entered into `arrays`."""
    task = result.definition
    return {
        "class": type(result).__name__,
        "mechanism": alone(result.mechanism, {}),
        "units": result.mechanism.units,
        "definition": None if task is None else task_text(result.mechanism, result.task, task),
        "fields": _fields(result, arrays),
    }


def _fields(result: Result, arrays: dict[str, Any]) -> Json:
    names = [entry.name for entry in fields(result) if entry.name not in SEPARATE]
    return {name: _packed(getattr(result, name), arrays) for name in names}


def _of_motion(text: str, motion: object, arrays: dict[str, Texts]) -> Json:
    """Return the motions of a design; one that cannot be computed as what is wrong with it."""
    parts: Json = {}
    for name in PARTS:
        try:
            found = getattr(motion, name)
            several = found if isinstance(found, tuple) else (found,)
            parts[name] = [
                {"class": type(result).__name__, "fields": _fields(result, arrays)}
                for result in several
            ]
        except MechdaeError as error:
            parts[name] = str(error)
    return {"problem": text, "parts": parts}


def _motion(meta: Mapping[str, Any], file: Mapping[str, Any], result: Result) -> StoredMotion:
    """Return the motions of a design: they are those of its mechanism, not of the task's."""
    problem = from_dict(tomllib.loads(meta["problem"]), result.problem)
    mechanism = replace(problem.mechanism, units=result.mechanism.units)
    problem = replace(problem, mechanism=mechanism)
    parts: Json = {}
    for name, part in meta["parts"].items():
        if isinstance(part, str):
            parts[name] = part
        else:
            found = tuple(_made(item, file, problem.mechanism) for item in part)
            parts[name] = found if name in SEVERAL else found[0]
    return StoredMotion(problem, parts)


def _packed(value: object, arrays: dict[str, Any]) -> Any:
    if value is None or isinstance(value, bool | int | float):
        return value
    if isinstance(value, str):
        return str(value)
    if isinstance(value, np.ndarray) and value.dtype.kind in "biufU":
        name = f"a{len(arrays)}"
        arrays[name] = value
        return {ARRAY: name}
    if isinstance(value, Mapping):
        return {str(key): _packed(item, arrays) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_packed(item, arrays) for item in value]
    if isinstance(value, np.generic):
        return value.item()
    return plain(value)


def _unpacked(value: float | str | Json, file: Mapping[str, Any]) -> Any:
    if isinstance(value, dict):
        if value.keys() == {ARRAY}:
            return file[value[ARRAY]]
        return {key: _unpacked(item, file) for key, item in value.items()}
    return [_unpacked(item, file) for item in value] if isinstance(value, list) else value


def _result(meta: Mapping[str, Any], file: Mapping[str, Any]) -> Result:
    name = meta["fields"]["problem"]
    mechanism = from_dict(tomllib.loads(meta["mechanism"]), name).mechanism
    return _made(meta, file, replace(mechanism, units=meta.get("units", "")))


def _made(meta: Mapping[str, Any], file: Mapping[str, Any], mechanism: Mechanism) -> Result:
    """Return the result of a class of this package."""
    known = {kind.__name__: kind for kind in vars(kinds).values() if isinstance(kind, type)}
    kind = known[meta["class"]]
    assert issubclass(kind, Result)
    values = {key: _unpacked(item, file) for key, item in meta["fields"].items()}
    for key, value in values.items():
        if key in NAMED:
            values[key] = Named(NAMED[key], {n: Series(arrays) for n, arrays in value.items()})
        elif key in SERIES:
            values[key] = Series(value)
        elif key in OF_SERIES:
            values[key] = {n: Series(arrays) for n, arrays in value.items()}
        elif key in SUMMARIES:
            values[key] = Summary(value)
    values["events"] = events_of(values["events"])
    if "labels" in values:
        values["labels"] = tuple(tuple(row) for row in values["labels"])
    if "solutions" in values:
        values["solutions"] = tuple(values["solutions"])
    if meta.get("definition"):
        ((task, table),) = tomllib.loads(meta["definition"])["tasks"].items()
        values["definition"] = read_task(task, table)
    return kind(mechanism=mechanism, **values)
