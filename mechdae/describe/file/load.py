"""From a TOML file, or what else stands for a problem, to a problem."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from mechdae.describe.file import library
from mechdae.describe.file.problem import Problem
from mechdae.describe.file.reading import split_known
from mechdae.describe.file.sections import read_problem
from mechdae.describe.mechanism import TOLERANCE, Mechanism
from mechdae.describe.tasks.kinds import Task
from mechdae.describe.values import Number
from mechdae.errors import (
    CONTROL,
    InputError,
    MechdaeError,
    ProblemFileError,
    UnavailableError,
    UnknownName,
)

if TYPE_CHECKING:
    from mechdae.types import Json


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


class HasProblem(Protocol):
    """A result, which has the problem and the task that it is of."""

    def as_problem(self) -> Problem: ...


Source = Problem | Mechanism | HasProblem | str | Path
"""What stands for a problem: its name or file, a mechanism, a result."""


def given(
    source: Source, task: Task | str | None = None, set: Mapping[str, Number] | None = None
) -> tuple[Problem, str | None]:
    """Return the problem that is meant and the name of its task, None where none is named.

    Parameters
    ----------
    task
        A name, or a task as a value, which the problem has after that; a result has its own.
    set
        Sizes, parameters and automatic names to change; a suffix (``_mm``) is a unit.
    """
    if isinstance(source, Mechanism):
        whole = Problem(source)
    elif isinstance(source, Problem):
        whole = source
    elif hasattr(source, "as_problem"):
        whole = source.as_problem()
        task = next(iter(whole.tasks), None) if task is None else task
    else:
        whole = load(source)
    if set is not None and not isinstance(set, Mapping):
        raise InputError(f"names and their numbers are needed, not {set!r}", where="set")
    if set:
        whole = whole.with_values(set)
    if not isinstance(task, Task):
        return whole, task
    for name, known in whole.tasks.items():
        if known == task:
            return whole, name
    return whole.with_task(task.kind, task), task.kind


def chosen(
    source: Source, task: Task | str | None = None, set: Mapping[str, Number] | None = None
) -> tuple[Problem, str]:
    """Return the problem and the name of the task that is meant: without any its first one."""
    whole, name = given(source, task, set)
    if name is None and not whole.tasks and isinstance(source, Mechanism):
        raise InputError("a mechanism needs a task: solve(mechanism, Sweep(...))")
    if not isinstance(name, str) or name not in whole.tasks:
        whole.task(name)  # raises, but of None
    return whole, next(iter(whole.tasks)) if name is None else name


def load(name_or_path: str | Path) -> Problem:
    """Return a predefined problem by name, or the one in a TOML file.

    Parameters
    ----------
    name_or_path
        A name of ``mechdae list``, or a path.

    Returns
    -------
    Problem
        With its mechanism, tasks and expected values.

    Raises
    ------
    UnknownName
        No predefined problem of that name.
    ProblemFileError
        The file cannot be read, is too large, is no TOML or breaks the format; the message
        has the file and the key path.

    Examples
    --------
    >>> list(md.load("four-bar-crank-rocker").tasks)
    ['turn', 'modes']
    """
    path = library.find(name_or_path)
    try:
        problem = from_dict(_parse(path), path.stem)
        return _with_tables(problem, path.parent) if _names_files(problem) else problem
    except RecursionError:
        raise ProblemFileError("nested too deeply", where=str(path)) from None
    except MechdaeError as problem:
        if isinstance(problem, ProblemFileError) and problem.where == str(path):
            raise
        place = f"{path}: {problem.where}" if problem.where else str(path)
        kind = type(problem) if isinstance(problem, UnavailableError) else ProblemFileError
        raise kind(problem.what, where=place, hint=problem.hint) from None


def _names_files(problem: Problem) -> bool:
    """Return whether a load or a driver has a table that is in a file of its own."""
    tasks = problem.tasks.values()
    drivers = [driver for task in tasks for driver in getattr(task, "drivers", None) or ()]
    tables = [*problem.mechanism.loads.values(), *(driver.table for driver in drivers)]
    return any(getattr(table, "file", None) for table in tables)


def _with_tables(problem: Problem, folder: Path) -> Problem:
    from mechdae.describe.file.tabulated import with_tables, with_time_tables

    mechanism = with_tables(problem.mechanism, folder)
    return replace(problem, mechanism=mechanism, tasks=with_time_tables(problem.tasks, folder))


def _parse(path: Path) -> Json:
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


def from_dict(data: Mapping[str, object], name: str = "mechanism") -> Problem:
    """Return the problem described by the tables of a problem file."""
    try:
        return _from_dict(data, name)
    except MechdaeError as problem:
        from mechdae.describe.file.key_hints import explain

        explain(data, problem)
        raise


def _from_dict(data: Mapping[str, object], name: str) -> Problem:
    repeated = _repeats(data)
    for entry in data:
        if split_known(entry, (TOLERANCE,))[0] not in TOP:
            raise UnknownName("key", entry, TOP)
    if data.get("schema", None) != SCHEMA or isinstance(data["schema"], bool):
        raise InputError(f"schema = {SCHEMA} is needed at the top of the file", where="schema")
    for entry in ("title", "source"):
        text = data.get(entry, "")
        if not isinstance(text, str):
            raise InputError("a text is needed", where=entry)
        if CONTROL.search(text):
            raise InputError("a text without control characters is needed", where=entry)
    if isinstance(data.get("dimension", 2), bool) or data.get("dimension", 2) not in (2, 3):
        raise InputError(
            "2 (of the plane, also where it is absent) or 3 is needed", where="dimension"
        )
    if not repeated:
        return read_problem(data, name)
    from mechdae.describe.file.repeat import expand, pattern_of

    expanded = expand(data)
    try:
        return read_problem(expanded.tables, name, lambda: pattern_of(data, from_dict))
    except MechdaeError as problem:
        expanded.blame(problem)
        raise


def _repeats(data: Mapping[str, object]) -> bool:
    """Return whether a file has cells that are repeated, sizes, or braces for them.

    Raises
    ------
    InputError
        It is nested too deeply.
    """
    found = "repeat" in data or "sizes" in data
    front: list[tuple[Any, int]] = [(data, 0)]
    while front:
        item, depth = front.pop()
        if depth > MAX_DEPTH:
            raise InputError(f"tables nested deeper than {MAX_DEPTH}")
        children = [*item, *item.values()] if isinstance(item, Mapping) else item
        front += [(child, depth + 1) for child in children if isinstance(child, dict | list)]
        texts = (child for child in children if isinstance(child, str))
        found = found or any("{" in text or "}" in text for text in texts)
    return found
