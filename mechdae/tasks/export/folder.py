"""Results in folders: written, and read back without computing anything again."""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mechdae import __version__
from mechdae.describe.file.atomic_write import whole_file
from mechdae.errors import InputError, MechdaeError, ProblemFileError, UnknownName
from mechdae.results import Result
from mechdae.tasks.export.files import write_files
from mechdae.tasks.export.packed import FORMAT, META, meta_of, packed, unpacked

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
