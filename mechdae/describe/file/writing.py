"""Descriptions to TOML: SI and radians, or units of a file; one line per joint.

A problem with repetition is written with its cells, as they were typed, as long as they
still describe it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechdae.describe.coordinates import unit_of, unit_within
from mechdae.describe.dimensions import parameter_units
from mechdae.describe.file.load import SCHEMA
from mechdae.describe.file.problem import Problem
from mechdae.describe.file.reading import split_known, to_si
from mechdae.describe.file.tabulated import write_tables
from mechdae.describe.joints.joint import Joint
from mechdae.describe.loads import TableLoad
from mechdae.describe.mechanism import TOLERANCE, Mechanism
from mechdae.describe.tasks.kinds import Task
from mechdae.describe.units import UNITS
from mechdae.describe.values import NAME, Table, Value
from mechdae.describe.vectors.typed import typed as loops_of
from mechdae.describe.vectors.typed import without_aliases
from mechdae.describe.vectors.values import Closure

if TYPE_CHECKING:
    from mechdae.types import Json


LOOPS = ("vectors", "loops", "nodes")
REST = ("bodies", "joints", "sketch", "loads", "outputs")


def dump(problem: Problem, path: str | Path) -> None:
    """Write the problem to a TOML file that `load` reads back to an equal problem.

    Parameters
    ----------
    problem
        A problem as a value.
    path
        Of the file; CSV files of its loads are written into the same folder.

    Returns
    -------
    None
        The file is whole or as before.

    Examples
    --------
    >>> import tempfile
    >>> problem = md.slider_crank(0.1, 0.3)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     md.dump(problem, f"{folder}/crank.toml")
    ...     md.load(f"{folder}/crank.toml").mechanism == problem.mechanism
    True
    """
    from mechdae.describe.file.atomic_write import whole_file  # only where files are written

    target = Path(path)
    text = dumps(problem)
    write_tables(problem.mechanism, problem.tasks, target.parent)
    with whole_file(target) as file:
        file.write(text.encode())


def alone(mechanism: Mechanism, tasks: Mapping[str, Task]) -> str:
    """Return the TOML text of some tasks that needs no other file: tables stand in it."""
    loads = {
        name: replace(load, file=None, columns=None, rows=load.points)
        if isinstance(load, TableLoad) and load.file is not None
        else load
        for name, load in mechanism.loads.items()
    }
    alone = {name: _with_rows(task) for name, task in tasks.items()}
    return dumps(Problem(replace(mechanism, loads=Table(loads)), Table(alone)))


def task_text(mechanism: Mechanism, name: str, task: Task) -> str:
    """Return the TOML text of a task alone, whatever other tasks it names."""
    lines = [f"[tasks.{name}]", *_entries(given(_with_rows(task)))]
    return without_aliases("\n".join(lines) + "\n", mechanism)


def _with_rows(task: Task) -> Task:
    """Return a task whose drivers' tables hold the rows of their files."""
    drivers: Any = getattr(task, "drivers", None) or ()
    if not any(driver.table is not None and driver.table.file for driver in drivers):
        return task
    written = []
    for driver in drivers:
        table = driver.table
        if table is not None and table.file is not None:
            rows = replace(table, file=None, columns=None, rows=table.points)
            written.append(replace(driver, table=rows))
        else:
            written.append(driver)
    changed: Any = task
    return replace(changed, drivers=tuple(written))  # type: ignore[no-any-return]


def dumps(problem: Problem) -> str:
    """Return the TOML text of the problem.

    Parameters
    ----------
    problem
        A problem as a value.

    Returns
    -------
    str
        What `dump` writes.

    Examples
    --------
    >>> md.dumps(md.slider_crank(0.1, 0.3)).splitlines()[0]
    'schema = 1'
    """
    return _dumps(problem, {})


def in_units(problem: Problem) -> str:
    """Return the TOML text of the problem in the units its file was typed in, as designs are.

    Parameters, sketched values, drivers' values and points that are numbers have them; a number
    is the one that is read back to the same, where there is one, else the nearest.
    """
    words = problem.mechanism.units.split(",")
    units = sorted((u for u in UNITS.values() if u.name in words), key=lambda u: -len(u.si))
    return _dumps(problem, {si: unit.suffix for unit in units for si in unit.si})


def _dumps(problem: Problem, suffixes: Mapping[str, str]) -> str:
    lines = [f"schema = {SCHEMA}"]
    for entry in ("title", "source"):
        if getattr(problem, entry):
            lines.append(f"{entry} = {_text(getattr(problem, entry))}")
    tasks = {name: given(task) for name, task in problem.tasks.items()}
    for table in [table for table in tasks.values() if suffixes and "driver" in table]:
        units = table["driver"].units_by_key(partial(unit_within, problem.mechanism, None))
        table["driver"] = _suffixed(given(table["driver"]), units, suffixes)
    expected = [given(entry) for entry in problem.expected]
    typed, plain = problem.pattern, False
    same = typed.problem(problem.name) if typed and not typed.settings else None
    if typed is not None and same is not None and same.mechanism == problem.mechanism:
        tables = typed.tables
        lines += _typed(tables)
        unchanged = [name for name, task in problem.tasks.items() if same.tasks.get(name) == task]
        tasks |= {name: tables["tasks"][name] for name in unchanged}
        expected = tables.get("expected", ()) if same.expected == problem.expected else expected
    else:
        beside = loops_of(problem.mechanism)
        lines += _mechanism(problem.mechanism, beside, suffixes)
        plain = beside is None
    text = "\n".join(lines) + "\n"
    lines = []
    for name, table in tasks.items():
        lines += ["", f"[tasks.{name}]", *_entries(table)]
    for table in expected:
        lines += ["", "[[expected]]", *_entries(table)]
    rest = "\n".join(lines) + "\n" if lines else ""
    return text + (without_aliases(rest, problem.mechanism) if plain else rest)


def _typed(tables: Mapping[str, Any]) -> list[str]:
    """Return the mechanism of a file with repetition, keys and units as they were typed."""
    heads = ("dimension", "frames", "gravity", TOLERANCE)
    lines = [f"{e} = {_value(tables[e])}" for e in tables if split_known(e, heads)[0] in heads]
    for name in ("sizes", "parameters", *LOOPS, "ground", *REST):
        lines += _section(name, tables.get(name, {}))
    for cell, entries in tables.get("repeat", {}).items():
        plain = {key: value for key, value in entries.items() if not isinstance(value, Mapping)}
        lines += ["", f"[repeat.{_key(cell)}]", *_entries(plain)]
        for section, table in entries.items():
            if section not in plain:
                lines += _section(f"repeat.{_key(cell)}.{section}", table)
    return lines


def _mechanism(
    mechanism: Mechanism, loops: Closure | None, suffixes: Mapping[str, str]
) -> list[str]:
    """Return the lines of a mechanism; with `loops` its bodies are only what those leave out."""
    lines = [] if mechanism.dimension == 2 else [f"dimension = {mechanism.dimension}"]
    lines += [f'frames = "{mechanism.frames}"'] if mechanism.frames else []
    if mechanism.gravity is not None:
        lines.append(f"gravity = {_value(mechanism.gravity)}")
    if mechanism.closure_tolerance is not None:
        lines.append(f"{TOLERANCE} = {_value(mechanism.closure_tolerance)}")
    units = parameter_units(mechanism) if suffixes else {}
    lines += _section("parameters", _suffixed(mechanism.parameters, units, suffixes))
    parts: Mechanism | Closure = mechanism
    if loops is not None:
        parts = loops
        lines += _section("vectors", {n: given(v, ("name",)) for n, v in loops.vectors.items()})
        lines += _section("loops", loops.loops)
        lines += _section("nodes", {n: given(v, ("name",)) for n, v in loops.nodes.items()})
    points = {"points": "m"}
    lines += _section("ground", _suffixed(given(parts.ground), points, suffixes))
    for name, body in parts.bodies.items():
        entries = _suffixed(given(body, skip=("name",)), points, suffixes)
        lines += ["", f"[bodies.{name}]", *_entries(entries)]
    lines += _section("joints", {n: _joint(j) for n, j in parts.joints.items()})
    units = {n: unit_of(mechanism, n) or "" for n in mechanism.sketch} if suffixes else {}
    lines += _section("sketch", _suffixed(mechanism.sketch, units, suffixes))
    loads = {n: given(x, skip=("name",)) for n, x in mechanism.loads.items()}
    outputs = mechanism.outputs
    if mechanism.closure is None or loops is not None:
        return [*lines, *_section("loads", loads), *_section("outputs", outputs)]
    rest = [*_section("loads", loads), *_section("outputs", outputs)]
    return [*lines, *(without_aliases(line, mechanism) for line in rest)]


def given(value: Value, skip: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return the kind and the fields that differ from their default, under their file keys."""
    kind = getattr(value, "kind", "")
    return ({"kind": kind} if kind else {}) | {
        entry.name.rstrip("_"): getattr(value, entry.name)
        for entry in fields(value)
        if entry.name not in skip
        and "kind" in entry.metadata
        and getattr(value, entry.name) is not None
        and getattr(value, entry.name) != entry.default
    }


def _joint(joint: Joint) -> Json:
    rest = given(joint, skip=("name", "first", "second"))
    return {"kind": joint.kind, "between": [joint.first, joint.second], **rest}


def _suffixed(
    entries: Mapping[str, Any], units: Mapping[str, str | None], suffixes: Mapping[str, str]
) -> Mapping[str, Any]:
    """Return a table whose numbers of known units stand under keys that end in a suffix."""
    ends = {name: suffixes.get(units.get(name) or "", "") for name in entries}
    ends |= {name: "" for name, value in entries.items() if not _of_numbers(value)}
    return {f"{n}{ends[n]}": _typed_as(value, ends[n]) for n, value in entries.items()}


def _of_numbers(value: object) -> bool:
    """Whether a value is a number, or a table or list of nothing else."""
    parts = value.values() if isinstance(value, Mapping) else value
    if isinstance(parts, int | float | str):
        return not isinstance(parts, bool | str)
    return isinstance(parts, Iterable) and all(map(_of_numbers, parts))


def _typed_as(value: Any, suffix: str) -> Any:
    """Return what under a key with a suffix means the value."""
    if isinstance(value, Mapping):
        return {name: _typed_as(part, suffix) for name, part in value.items()}
    if not suffix or not isinstance(value, int | float):
        return [_typed_as(part, suffix) for part in value] if suffix else value
    exact = value / UNITS[suffix].factor
    near = [float(f"{exact:.{digits}g}") for digits in (12, 15, 16, 17)]
    near += [math.nextafter(exact, way) for way in (-math.inf, math.inf)]
    return min(near, key=lambda typed: abs(to_si(typed, suffix) - value))


def _section(name: str, entries: Mapping[str, object]) -> list[str]:
    return ["", f"[{name}]", *_entries(entries)] if entries else []


def _entries(entries: Mapping[str, object]) -> list[str]:
    return [f"{_key(name)} = {_value(value)}" for name, value in entries.items()]


def _key(name: str) -> str:
    return name if NAME.match(name) else _text(name)


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, Value):
        value = given(value)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(_entries(value)) + " }" if value else "{}"
    return "[" + ", ".join(_value(item) for item in value) + "]"
