"""Results in folders: written, and read back without computing anything again.

A result as one NPZ file, to the last bit: what the JSON has, its mechanism and its task.

Arrays are members of the file; all else is a text in JSON, in which they are named. Nothing in it
is executed when it is read.
"""

from __future__ import annotations

import hashlib
import json
import tomllib
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae import __version__
from mechdae.describe.file.atomic_write import whole_file
from mechdae.describe.file.load import from_dict
from mechdae.describe.file.problem import Problem
from mechdae.describe.file.sections import read_task
from mechdae.describe.file.writing import alone, task_text
from mechdae.errors import InputError, MechdaeError, ProblemFileError, SolveError, UnknownName
from mechdae.records import dataclass
from mechdae.results import Named, Result, Series, Summary, events_of, kinds, plain
from mechdae.tasks.export.files import write_files
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


ENDING = ".result.npz"
BLOCK = 1 << 20


class StoredResults(Mapping[str, Result]):
    """The results of a folder by the names of their tasks; of a single one its attributes too.

    Parameters
    ----------
    results
        Task -> result: what `read` returns.

    Examples
    --------
    >>> result = md.solve(md.four_bar(0.1, 0.04, 0.12, 0.08), poses=5)
    >>> list(md.StoredResults({"turn": result}))
    ['turn']
    """

    def __init__(self, results: Mapping[str, Result]) -> None:
        self._results = dict(results)

    def __getitem__(self, task: str) -> Result:
        if task not in self._results:
            raise UnknownName("task", task, self._results)
        return self._results[task]

    def __iter__(self) -> Iterator[str]:
        return iter(self._results)

    def __len__(self) -> int:
        return len(self._results)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or len(self._results) != 1:
            raise AttributeError(
                f"no '{name}' of {len(self._results)} results; choose one by its task"
            )
        return getattr(next(iter(self._results.values())), name)

    def __repr__(self) -> str:
        return "\n".join(map(repr, self._results.values()))


def save(result: Result, folder: str | Path) -> list[Path]:
    """Write ``<task>.json``, ``<task>.csv`` and ``<task>.npz`` into a folder.

    Of a synthesis also each design as a problem file, ``<task>-1.toml`` and so on. Large tables
    are written in pieces. ``<task>.result.npz`` is what `read` makes the result from again.

    Parameters
    ----------
    result
        A result of any kind.
    folder
        Where to; it is made where it is not there.

    Returns
    -------
    list of Path
        What was written.

    Raises
    ------
    InputError
        The folder has a result of another problem under that name, or is a file.

    Examples
    --------
    >>> import tempfile
    >>> result = md.solve(md.four_bar(0.1, 0.04, 0.12, 0.08), poses=5)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     print([path.name for path in md.save(result, folder)])
    ['turn.json', 'turn.csv', 'turn.npz']
    """
    place = Path(folder)
    check_folder(place, result.problem, result.task)
    place.mkdir(parents=True, exist_ok=True)
    written = write_files(result, place)
    arrays = packed(result)
    meta = meta_of(arrays)
    meta["files"] = {path.name: digest(path) for path in written if path.suffix != ".toml"}
    arrays[META] = np.frombuffer(json.dumps(meta, ensure_ascii=False).encode(), dtype=np.uint8)
    path = place / f"{result.task}{ENDING}"
    with whole_file(path) as file:
        np.savez(file, **arrays)
    return written


def check_folder(folder: str | Path, problem: str, task: str) -> None:
    """Raise for a folder whose result of a task is of another problem: it would be lost."""
    place = Path(folder)
    if place.exists() and not place.is_dir():
        raise InputError("is a file, not a folder", where=str(folder))
    path = place / f"{task}{ENDING}"
    if not path.exists():
        return
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
            there = meta_of(file)["fields"]["problem"]
    except (OSError, ValueError, KeyError, zipfile.BadZipFile):
        return  # nothing that could be read is lost
    if there != problem:
        raise InputError(
            f"holds the result of problem '{there}'", where=str(path), hint="give another folder"
        )


def read(folder: str | Path) -> StoredResults:
    """Return the results of a folder, as they were written; nothing is computed.

    Parameters
    ----------
    folder
        Where ``mechdae solve``, ``synthesize`` or ``study`` with ``--out``, or `save`, wrote.

    Returns
    -------
    StoredResults
        Task -> result, with the same arrays, events, summary and designs to the last bit. Of one
        task it has the attributes of the result.

    Raises
    ------
    InputError
        No folder, no results in it, an unfinished job, results of another version, incomplete or
        altered ones; the message names the file.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     paths = md.save(md.solve(md.four_bar(0.1, 0.04, 0.12, 0.08), poses=5), folder)
    ...     again = md.read(folder)
    >>> list(again), len(again["turn"])
    (['turn'], 5)
    """
    place = Path(folder)
    if not place.is_dir():
        raise InputError(
            "is a file, not a folder" if place.exists() else "no such folder", where=str(folder)
        )
    paths = sorted(place.glob(f"*{ENDING}"), key=lambda path: (path.stat().st_mtime_ns, path.name))
    if not paths:
        raise _nothing(place)
    return StoredResults({path.name.removesuffix(ENDING): _read(path) for path in paths})


def _read(path: Path) -> Result:
    again = "solve again with --out, into the same folder"
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
            meta = meta_of(file)
            if meta["format"] != FORMAT or meta["mechdae"] != __version__:
                raise InputError(
                    f"written by mechdae {meta['mechdae']}, this is {__version__}",
                    where=str(path), hint=again,
                )  # fmt: skip
            for name, known in meta["files"].items():
                beside = path.with_name(name)
                if not beside.exists():
                    raise InputError("is missing", where=str(beside), hint=again)
                if digest(beside) != known:
                    raise InputError(
                        "was altered or not written to its end: it is no longer what was computed",
                        where=str(beside), hint=again,
                    )  # fmt: skip
            return unpacked(file)
    except ProblemFileError as error:
        raise _broken(path, again) from error
    except MechdaeError:
        raise
    except (OSError, ValueError, KeyError, TypeError, AttributeError, AssertionError,
            EOFError, zipfile.BadZipFile) as error:  # fmt: skip
        raise _broken(path, again) from error


def _broken(path: Path, hint: str) -> InputError:
    return InputError("is no result, or not all of one", where=str(path), hint=hint)


def _nothing(place: Path) -> InputError:
    """Return the error for a folder without results: what it has instead."""
    for path in sorted(place.glob("*.jsonl")):
        try:
            head, *lines = path.read_text(encoding="utf-8").splitlines()
            known = json.loads(head)
        except (OSError, ValueError):
            continue
        if isinstance(known, dict) and "problem" in known:
            return InputError(
                f"the job in this folder is not finished: {len(lines)} pieces are done",
                where=str(path), hint="the command that began it goes on there",
            )  # fmt: skip
    if any(place.glob("*.json")):
        hint = "results that are read back come from this version: solve again with --out"
        return InputError("holds no results that can be read back", where=str(place), hint=hint)
    return InputError("holds no results", where=str(place), hint="mechdae solve P --out DIR")


def digest(path: Path) -> str:
    """Return a fingerprint of a file."""
    found = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(BLOCK):
            found.update(block)
    return found.hexdigest()
