"""From a TOML file to a problem."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from mechdae.describe.file import library
from mechdae.describe.file.misplaced_key_hints import explain
from mechdae.describe.file.problem import Problem
from mechdae.describe.file.reading import split_known
from mechdae.describe.file.repeat import expand
from mechdae.describe.file.sections import read_problem
from mechdae.describe.file.tabulated import with_tables, with_time_tables
from mechdae.describe.mechanism import TOLERANCE
from mechdae.errors import (
    InputError,
    MechdaeError,
    ProblemFileError,
    UnavailableError,
    UnknownName,
    is_control,
)

SCHEMA = 1
MAX_BYTES = 1_000_000
MAX_DEPTH = 12
HEAD = re.compile(r"\s*\[?\[?([^=\[\]]+)[=\]]")
"""A key with its sign of equality, or the head of a table."""
TOML_HINT = "expressions stand in quotes, decimals have a point, lists end with ]"
TOP = (
    "schema title source dimension frames gravity closure_tolerance parameters sizes ground bodies "
    "joints sketch loads outputs tasks expected repeat vectors loops nodes"
).split()


def load(name_or_path: str | Path) -> Problem:
    """Return a predefined problem by name, or the one in a TOML file.

    Raises
    ------
    UnknownName
        No predefined problem of that name.
    ProblemFileError
        The file cannot be read, is too large, is no TOML or breaks the format; the message
        has the file and the key path.
    """
    path = library.find(name_or_path)
    try:
        problem = from_dict(_parse(path), path.stem)
        tabled = with_tables(problem.mechanism, path.parent)
        tasks = with_time_tables(problem.tasks, path.parent)
        if tabled is problem.mechanism and tasks is problem.tasks:
            return problem
        return replace(problem, mechanism=tabled, tasks=tasks)
    except RecursionError:
        raise ProblemFileError("nested too deeply", where=str(path)) from None
    except MechdaeError as problem:
        if isinstance(problem, ProblemFileError) and problem.where == str(path):
            raise
        place = f"{path}: {problem.where}" if problem.where else str(path)
        kind = type(problem) if isinstance(problem, UnavailableError) else ProblemFileError
        raise kind(problem.what, where=place, hint=problem.hint) from None


def _parse(path: Path) -> dict[str, Any]:
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise ProblemFileError(
                f"file of {size / 1e6:.1f} MB, at most {MAX_BYTES / 1e6:.0f} MB is read",
                where=str(path),
            )
        if not path.is_file():
            raise ProblemFileError("not a file", where=str(path))
        text = path.read_bytes().decode("utf-8-sig")
        return tomllib.loads(text)
    except OSError as problem:
        raise ProblemFileError(
            f"cannot be read: {problem.strerror or problem}", where=str(path)
        ) from None
    except UnicodeDecodeError:
        raise ProblemFileError(
            "not a text file in UTF-8", where=str(path), hint="save it with the encoding UTF-8"
        ) from None
    except tomllib.TOMLDecodeError as problem:
        hint = _given_twice(text, str(problem)) if "Cannot" in str(problem) else TOML_HINT
        raise ProblemFileError(f"not valid TOML: {problem}", where=str(path), hint=hint) from None


def _given_twice(text: str, problem: str) -> str:
    """Return which name of a file is given twice, and in which line first."""
    place = re.search(r"at line (\d+)", problem)
    lines = text.splitlines()[: int(place[1])] if place else []
    name = HEAD.match(lines[-1]) if lines else None
    if name is None:
        return "a name is given twice"
    for k in range(len(lines) - 1, 0, -1):
        before = HEAD.match(lines[k - 1])
        if before and before[0].split() == name[0].split():
            return f"{name[1].strip()} is given in line {k} and again in line {len(lines)}"
    return f"{name[1].strip()} is given twice"


def from_dict(data: Mapping[str, Any], name: str = "mechanism") -> Problem:
    """Return the problem described by the tables of a problem file."""
    try:
        return _from_dict(data, name)
    except MechdaeError as problem:
        explain(data, problem)
        raise


def _from_dict(data: Mapping[str, Any], name: str) -> Problem:
    _check_depth(data)
    for entry in data:
        if split_known(entry, (TOLERANCE,))[0] not in TOP:
            raise UnknownName("key", entry, TOP)
    if data.get("schema", None) != SCHEMA or isinstance(data["schema"], bool):
        raise InputError(f"schema = {SCHEMA} is needed at the top of the file", where="schema")
    for entry in ("title", "source"):
        text = data.get(entry, "")
        if not isinstance(text, str):
            raise InputError("a text is needed", where=entry)
        if any(map(is_control, text)):
            raise InputError("a text without control characters is needed", where=entry)
    if isinstance(data.get("dimension", 2), bool) or data.get("dimension", 2) not in (2, 3):
        raise InputError(
            "2 (of the plane, also where it is absent) or 3 is needed", where="dimension"
        )
    expanded = expand(data)
    try:
        return read_problem(expanded.tables, name, data, from_dict)
    except MechdaeError as problem:
        expanded.blame(problem)
        raise


def _check_depth(data: Any) -> None:
    front = [(data, 0)]
    while front:
        item, depth = front.pop()
        if depth > MAX_DEPTH:
            raise InputError(f"tables nested deeper than {MAX_DEPTH}")
        children = item.values() if isinstance(item, Mapping) else item
        front += [(child, depth + 1) for child in children if isinstance(child, dict | list)]
