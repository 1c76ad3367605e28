"""The sections of a problem file as descriptions: bodies, joints, loads, tasks."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any

from mechdae.describe.file.problem import Expected, Problem
from mechdae.describe.file.reading import (
    HINTS,
    chosen,
    keys_of,
    plain,
    read,
    split_known,
    split_unit,
)
from mechdae.describe.file.units import check_units, degrees_beside, written_units
from mechdae.describe.joints.joint import Joint
from mechdae.describe.kinds import JOINTS, KINDS_OF_JOINTS, LOADS, SPATIAL_JOINTS
from mechdae.describe.mechanism import TOLERANCE, Body, Ground, Mechanism
from mechdae.describe.tasks.kinds import TASKS, Task
from mechdae.describe.units import UNITS
from mechdae.describe.values import Table
from mechdae.errors import InputError, MechdaeError, UnavailableError, UnknownName

if TYPE_CHECKING:
    from mechdae.describe.file.repeat import Pattern
    from mechdae.types import Json

TEXTS = ("title", "source")
"""Keys of texts for people."""
WORD = re.compile(r"[A-Za-z_]\w*")


def read_problem(
    data: Mapping[str, Any], name: str, pattern: Callable[[], Pattern | None] = lambda: None
) -> Problem:
    """Return the problem of tables without repetition; `pattern` gives those with it."""
    dimension = data.get("dimension", 2)
    parts: dict[str, Any] = {
        "ground": read(Ground, _table(data, "ground"), "ground"),
        "bodies": [read(Body, t, f"bodies.{n}", name=n) for n, t in _table(data, "bodies").items()],
        "joints": [_read_joint(n, t, dimension) for n, t in _table(data, "joints").items()],
        "loads": [_read_load(n, t) for n, t in _table(data, "loads").items()],
        "parameters": _parameters(data),
        "sketch": _plain(data, "sketch"),
        "outputs": _outputs(_table(data, "outputs")),
        "gravity": data.get("gravity"),
        "dimension": dimension,
        **({"frames": data["frames"]} if "frames" in data else {}),
        **_tolerance(data),
    }
    loops = [entry for entry in ("vectors", "loops", "nodes") if _table(data, entry)]
    if loops:
        from mechdae.describe.vectors.expand import from_loops
        from mechdae.describe.vectors.values import Node, Vector

        mechanism = from_loops(
            [read(Vector, t, f"vectors.{n}", name=n) for n, t in _table(data, "vectors").items()],
            _table(data, "loops"),
            [read(Node, t, f"nodes.{n}", name=n) for n, t in _table(data, "nodes").items()],
            **parts,
        )
    elif not parts["bodies"] and not parts["joints"] and (bare := _bare_mechanism(data)):
        mechanism = replace(bare, parameters=Table(parts["parameters"]))
    else:
        mechanism = Mechanism(**parts)
    tasks = {n: read_task(n, t) for n, t in _table(data, "tasks").items()}
    expected = data.get("expected", [])
    if not isinstance(expected, list):
        raise InputError("write [[expected]], a list of tables", where="expected")
    problem = Problem(
        mechanism,
        Table(tasks),
        tuple([read(Expected, t, f"expected[{i}]") for i, t in enumerate(expected)]),
        name,
        data.get("title", ""),
        data.get("source", ""),
        pattern(),
    )
    check_units(problem.mechanism, problem.tasks, data)
    vars(problem.mechanism)["units"] = written_units(problem.mechanism, problem.tasks, data)
    notes = degrees_beside(problem.mechanism, problem.tasks, data)
    return replace(problem, notes=notes) if notes else problem


def _bare_mechanism(data: Mapping[str, int | str | dict[str, Json]]) -> Mechanism | None:
    """Return what a file begins with all of whose tasks look for a mechanism, None for others."""
    tasks = _table(data, "tasks").values()
    kinds = [str(table.get("kind")) if isinstance(table, Mapping) else "" for table in tasks]
    bare = [TASKS[kind].bare_mechanism() if kind in TASKS else None for kind in kinds]
    return bare[0] if bare and all(bare) else None


def _tolerance(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the tolerance of redundant equations, whatever length it is typed in."""
    known = {TOLERANCE: next(entry for entry in fields(Mechanism) if entry.name == TOLERANCE)}
    return plain({word: data[word] for word in data if split_known(word, known)[0] in known}, known)


def _outputs(table: Mapping[str, str]) -> Table[str]:
    for name, expression in table.items():
        if not isinstance(expression, str):
            raise InputError("an expression in quotes is needed", where=f"outputs.{name}")
    return Table(table)


def _table(data: Mapping[str, Any], entry: str) -> Mapping[str, Any]:
    table = data.get(entry, {})
    if not isinstance(table, Mapping):
        raise InputError("a table is needed", where=entry)
    return table


def _plain(data: Mapping[str, Any], entry: str) -> dict[str, Any]:
    try:
        return plain(_table(data, entry))
    except MechdaeError as problem:
        raise problem.inside(entry) from None


def _parameters(data: Mapping[str, Any]) -> Json:
    """Return the parameters by name, units of SI at their ends left out where these are not used.

    Raises
    ------
    InputError
        A name that ends like another unit and is used with it: ``r_in`` where inches are meant by
        nobody.
    """
    table, used = _table(data, "parameters"), used_names(data)
    found: Json = {}
    for key, value in table.items():
        base, suffix = split_known(key, used)
        if base == key and split_unit(key)[1] and split_unit(key)[0] not in used:
            base, suffix = split_unit(key)
            raise InputError(
                f"{suffix} is {UNITS[suffix].word}: the parameter is called {base}",
                where=f"parameters.{key}",
                hint=f"write {base} where '{key}' stands, or give it a name that ends like no unit",
            )
        in_si = bool(suffix) and suffix not in UNITS and base not in table
        found[base if in_si else key] = value
    try:
        return plain(found)
    except MechdaeError as problem:
        raise problem.inside("parameters") from None


def used_names(data: Mapping[str, Any]) -> set[str]:
    """Return the words of all texts of a file that may be expressions."""
    found, front = set[str](), [part for name, part in data.items() if name not in TEXTS]
    while front:
        part = front.pop()
        if isinstance(part, str):
            found.update(WORD.findall(part))
        elif isinstance(part, Mapping):
            front += [content for name, content in part.items() if name not in TEXTS]
        elif isinstance(part, list):
            front += part
    return found


def _chosen(table: Json, place: str, kinds: Mapping[str, Any], word: str) -> Any:
    try:
        return chosen(table, kinds, word)
    except MechdaeError as problem:
        raise problem.inside(place) from None


def _read_joint(name: str, table: object, dimension: int) -> Joint:
    place = f"joints.{name}"
    try:
        kind, rest = chosen(table, KINDS_OF_JOINTS[dimension], "joint")
    except MechdaeError as problem:
        _check_dimension(table, dimension, place)
        raise problem.inside(place) from None
    for entry in rest:
        lacking = kind.lacking.get(split_unit(entry)[0])
        if lacking is not None:
            raise UnavailableError(
                lacking, where=f"{place}.{entry}", hint="leave it out, or take other joints"
            )
    for entry in ("axis", "axis2", "zero", "zero2"):
        if dimension == 2 and isinstance(rest.get(entry), list):
            raise InputError(
                "directions belong to joints of space",
                where=f"{place}.{entry}",
                hint=f"{entry}_deg = 0, an angle in the plane; in space dimension = 3 at the top",
            )
    between, known = rest.pop("between", None), keys_of(kind)
    for entry in rest if between is None else ():
        if split_known(entry, known)[0] not in known:
            raise import_module(HINTS).unknown_key(entry, [*known, "between"]).inside(place)
    if not isinstance(between, list) or len(between) != 2:
        raise InputError(
            'between = ["body.point", "body.point"] is needed', where=f"{place}.between"
        )
    for side, text in zip(("first", "second"), between, strict=True):
        if side in rest:
            raise UnknownName("key", side, ["between"], where=place)
        if not isinstance(text, str):
            raise InputError("a reference 'body.point' is needed", where=f"{place}.between")
    joint: Joint = read(kind, rest, place, name=name, first=between[0], second=between[1])
    return joint


def _check_dimension(table: object, dimension: int, place: str) -> None:
    """Raise for a kind of joint that mechanisms of the other dimension have."""
    word = str(table.get("kind")) if isinstance(table, Mapping) else ""
    if dimension == 2 and word in SPATIAL_JOINTS:
        raise InputError(
            f"a {word} joint is one of space", where=place, hint="dimension = 3 above the tables"
        )
    if dimension == 3 and word in JOINTS:
        raise UnavailableError(
            f"joints of kind '{word}' are not computed in space by this version",
            where=place,
            hint=f"available: {', '.join(KINDS_OF_JOINTS[3])}",
        )


def _read_load(name: str, table: Any) -> Any:
    kind, rest = _chosen(table, f"loads.{name}", LOADS, "load")
    return read(kind, rest, f"loads.{name}", name=name)


def read_task(name: str, table: Any) -> Task:
    """Return the task that a table of a file describes, not compared with a mechanism."""
    kind, rest = _chosen(table, f"tasks.{name}", TASKS, "task")
    task: Task = read(kind, rest, f"tasks.{name}")
    return task
