"""Problems: a mechanism, its tasks and the values expected of them; TOML files."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from mechdae.describe import values
from mechdae.describe.coordinates import coordinate, selection, unit_of
from mechdae.describe.expression import names_in
from mechdae.describe.file import library
from mechdae.describe.file.checks import check_loads
from mechdae.describe.file.misplaced import explain
from mechdae.describe.file.reading import check_suffix, plain, read, split_unit, to_si
from mechdae.describe.file.repeat import Pattern, expand, pattern_of
from mechdae.describe.file.tabulated import with_tables, with_tables_of, with_time_tables
from mechdae.describe.joints import JOINTS, SPATIAL, Joint
from mechdae.describe.loads import LOADS
from mechdae.describe.mechanism import Body, Ground, Mechanism, evaluate_all
from mechdae.describe.named import check_outputs
from mechdae.describe.table import Table
from mechdae.describe.tasks.kinds import (
    TASKS,
    Driven,
    Driver,
    Equilibrium,
    Motion,
    Reactions,
    Study,
    Task,
)
from mechdae.describe.tasks.motion import check_equilibrium, check_motion
from mechdae.describe.values import Number, Value, key, number
from mechdae.errors import (
    InputError,
    MechanismError,
    MechdaeError,
    ProblemFileError,
    UnavailableError,
    UnknownName,
    is_control,
)

SCHEMA = 1
ALIASES = {
    **dict.fromkeys(("pin", "hinge", "pivot", "rotary", "turning"), "revolute"),
    **dict.fromkeys(("slider", "sliding", "translation", "piston"), "prismatic"),
    **dict.fromkeys(("fixed", "rigid"), "weld"),
    **dict.fromkeys(("bar", "rod", "link"), "distance"),
    **dict.fromkeys(("slot", "pin_in_slot", "yoke"), "pin-in-slot"),
    **dict.fromkeys(("gears", "mesh"), "gear"),
    **dict.fromkeys(("cam", "roller"), "curve"),
}
RATES = {
    **dict.fromkeys(("at", "from", "to", "law"), ""),
    **{"speed": "/s", "acceleration": "/s2", "jerk": "/s3"},
}
"""Keys of a driver whose values have the unit of its coordinate, over powers of the second."""
MAX_BYTES = 1_000_000
MAX_DEPTH = 12
TOML_HINT = "expressions stand in quotes, decimals have a point, lists end with ]"
TOP = (
    "schema title source dimension gravity parameters sizes ground bodies joints sketch loads "
    "outputs tasks expected repeat"
).split()


@dataclass(frozen=True)
class Expected(Value):
    """A value that `check` verifies: path below the task in the JSON, tolerance, source."""

    task: str = key("text")
    what: str = key("text")
    value: Any = key("free")
    at: Number | None = key("number", None)
    time: Number | None = key("number", None)
    rel: float | None = key("number", None)
    abs: float | None = key("number", None)
    source: str = key("text", "")


@dataclass(frozen=True)
class Problem:
    """One mechanism and any number of named tasks.

    ``pattern`` is kept of a file with repetition, so that sizes can be set.
    """

    mechanism: Mechanism
    tasks: Table[Task] = field(default_factory=Table)
    expected: tuple[Expected, ...] = ()
    name: str = "mechanism"
    title: str = ""
    source: str = ""
    pattern: Pattern | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        _check_kind(self.mechanism, Mechanism, "mechanism")
        _check_kind(self.tasks, Mapping, "tasks")
        object.__setattr__(self, "tasks", Table(self.tasks))
        check_loads(self.mechanism)
        check_outputs(self.mechanism)
        for name, task in self.tasks.items():
            _check_name(name)
            _check_kind(task, Task, f"tasks.{name}")
            _check_task(self.mechanism, name, task)
        for position, entry in enumerate(self.expected):
            _check_kind(entry, Expected, f"expected[{position}]")
            if entry.task not in self.tasks:
                raise UnknownName(
                    "task", entry.task, self.tasks, where=f"expected[{position}].task"
                )
            for word in ("rel", "abs"):
                share = getattr(entry, word)
                if isinstance(share, float) and share < 0:
                    raise InputError(
                        f"a tolerance is not negative ({share:g})",
                        where=f"expected[{position}].{word}",
                    )

    def task(self, name: str | None) -> Task:
        """Return the task of that name; None: the only or first one."""
        if name is None:
            if not self.tasks:
                raise InputError(f"problem '{self.name}' has no tasks", where="tasks")
            return next(iter(self.tasks.values()))
        if not isinstance(name, str):
            raise InputError(
                f"a task or the name of one is needed, not {values.describe(name)}", where="task"
            )
        if name not in self.tasks:
            raise UnknownName("task", name, self.tasks)
        return self.tasks[name]

    def with_task(self, name: str, task: Task) -> Problem:
        """Return the problem with a task put under `name`."""
        return replace(self, tasks=self.tasks.with_(name, task))

    def with_values(self, changes: Mapping[str, Number]) -> Problem:
        """Return the problem with sizes and parameters set.

        Sizes come first, whatever the order; keys of parameters may carry a unit
        (``phi1_deg``).
        """
        for name in changes:
            if not isinstance(name, str):
                raise InputError(f"a name is needed, not {values.describe(name)}", where="set")
        for name in self.sizes:
            if name in changes:
                try:
                    self = _resized(self, name, changes[name])
                except MechdaeError as problem:
                    problem.where = f"set {name}: {problem.where}".removesuffix(": ")
                    raise problem from None
        known = {*self.mechanism.parameters, *dict(self.mechanism.numbers())}
        for name, value in changes.items():
            if name in self.sizes:
                continue
            base, suffix = (name, "") if name in known else split_unit(name)
            try:
                if base in known:
                    check_number(self.mechanism, base, suffix)
                new = number(to_si(number(value), suffix))
                mechanism = self.mechanism.with_values({base: new})
            except MechdaeError as problem:
                problem.where = f"set {name}"
                if isinstance(problem, UnknownName) and self.sizes and not problem.hint:
                    problem.hint = f"the sizes are {', '.join(self.sizes)}"
                raise problem from None
            pattern = self.pattern and self.pattern.with_number(base, new)
            self = replace(self, mechanism=mechanism, pattern=pattern)
        return self

    @property
    def sizes(self) -> Table[int]:
        """The sizes of the file by name."""
        return self.pattern.sizes if self.pattern else Table()

    def blame(self, error: MechdaeError) -> None:
        """Let an error about a repeated part name the place in the file it was typed at."""
        if self.pattern is not None:
            expand(self.pattern.data()).blame(error)


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
        return tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except OSError as problem:
        raise ProblemFileError(
            f"cannot be read: {problem.strerror or problem}", where=str(path)
        ) from None
    except UnicodeDecodeError:
        raise ProblemFileError(
            "not a text file in UTF-8", where=str(path), hint="save it with the encoding UTF-8"
        ) from None
    except tomllib.TOMLDecodeError as problem:
        hint = "a name is given twice" if "Cannot" in str(problem) else TOML_HINT
        raise ProblemFileError(f"not valid TOML: {problem}", where=str(path), hint=hint) from None


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
        if entry not in TOP:
            raise UnknownName("key", entry, TOP)
    if data.get("schema", None) != SCHEMA or isinstance(data["schema"], bool):
        raise InputError(f"schema = {SCHEMA} is needed at the top of the file", where="schema")
    for entry in ("title", "source"):
        text = data.get(entry, "")
        if not isinstance(text, str):
            raise InputError("a text is needed", where=entry)
        if any(map(is_control, text)):
            raise InputError("a text without control characters is needed", where=entry)
    if data.get("dimension", 2) != 2:
        raise UnavailableError("only planar mechanisms (dimension = 2)", where="dimension")
    expanded = expand(data)
    try:
        return _problem(expanded.tables, name, data)
    except MechdaeError as problem:
        expanded.blame(problem)
        raise


def _problem(data: Mapping[str, Any], name: str, typed: Mapping[str, Any]) -> Problem:
    """Return the problem of tables without repetition; `typed` are those with it."""
    mechanism = Mechanism(
        ground=read(Ground, _with_points(_table(data, "ground"), "ground"), "ground"),
        bodies=[_read_body(n, t) for n, t in _table(data, "bodies").items()],  # type: ignore[arg-type]
        joints=[_read_joint(n, t) for n, t in _table(data, "joints").items()],  # type: ignore[arg-type]
        loads=[_read_load(n, t) for n, t in _table(data, "loads").items()],  # type: ignore[arg-type]
        parameters=_plain(data, "parameters"),  # type: ignore[arg-type]
        sketch=_plain(data, "sketch"),  # type: ignore[arg-type]
        outputs=_outputs(_table(data, "outputs")),
        gravity=data.get("gravity"),
    )
    tasks = {n: _read_task(n, t) for n, t in _table(data, "tasks").items()}
    expected = data.get("expected", [])
    if not isinstance(expected, list):
        raise InputError("write [[expected]], a list of tables", where="expected")
    problem = Problem(
        mechanism,
        Table(tasks),
        tuple(read(Expected, t, f"expected[{i}]") for i, t in enumerate(expected)),
        name,
        data.get("title", ""),
        data.get("source", ""),
        pattern_of(typed),
    )
    _check_units(problem, data)
    return problem


def unchanged(pattern: Pattern, name: str) -> Problem:
    """Return the problem as its pattern alone describes it."""
    return from_dict(pattern.data(), name).with_values(pattern.settings)


def _resized(problem: Problem, name: str, value: Any) -> Problem:
    """Return the problem expanded anew; tasks put or replaced since it was read are kept."""
    assert problem.pattern is not None
    pattern = problem.pattern.with_size(name, value)
    old, new = unchanged(problem.pattern, problem.name), unchanged(pattern, problem.name)
    if old.mechanism != problem.mechanism:
        raise InputError(
            "the mechanism is no longer the one of the file", hint="set the size before"
        )
    tasks = {
        key: new.tasks[key] if task == old.tasks.get(key) and key in new.tasks else task
        for key, task in problem.tasks.items()
    }
    expected = new.expected if problem.expected == old.expected else problem.expected
    new = replace(new, mechanism=with_tables_of(new.mechanism, problem.mechanism))
    return replace(
        new, tasks=Table(tasks), expected=expected, title=problem.title, source=problem.source
    )


def _outputs(table: Mapping[str, Any]) -> Table[str]:
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


def _with_points(table: Any, place: str) -> Any:
    """Return a body's table with the units on its points' names resolved."""
    if isinstance(table, Mapping) and isinstance(table.get("points"), Mapping):
        try:
            for name in table["points"]:
                check_suffix(name, "m")
            return {**table, "points": plain(table["points"])}
        except MechdaeError as problem:
            raise problem.inside(f"{place}.points") from None
    return table


def _read_body(name: str, table: Any) -> Body:
    place = f"bodies.{name}"
    return read(Body, _with_points(table, place), place, name=name)


def _kind(table: Any, place: str, kinds: Mapping[str, Any], word: str) -> Any:
    if not isinstance(table, Mapping):
        raise InputError("a table is needed", where=place)
    kind = table.get("kind")
    if not isinstance(kind, str):
        raise InputError(f"the key 'kind' is missing: {', '.join(kinds)}", where=place)
    if kind not in kinds:
        error = UnknownName(f"kind of {word}", kind, kinds, where=f"{place}.kind")
        meant = ALIASES.get(kind.lower())
        if meant in kinds:
            error.hint = f"did you mean {meant}?"
        elif not get_close_matches(kind, kinds, 1):
            error.hint = f"one of {', '.join(kinds)}"
        raise error
    return kinds[kind], {entry: value for entry, value in table.items() if entry != "kind"}


def _read_joint(name: str, table: Any) -> Joint:
    place = f"joints.{name}"
    if isinstance(table, Mapping) and table.get("kind") in SPATIAL:
        raise UnavailableError("spatial joints are not computed by this version", where=place)
    kind, rest = _kind(table, place, JOINTS, "joint")
    between = rest.pop("between", None)
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


def _read_load(name: str, table: Any) -> Any:
    kind, rest = _kind(table, f"loads.{name}", LOADS, "load")
    return read(kind, rest, f"loads.{name}", name=name)


def _read_task(name: str, table: Any) -> Task:
    place = f"tasks.{name}"
    kind, rest = _kind(table, place, TASKS, "task")
    if issubclass(kind, Driven | Motion | Equilibrium):
        if "driver" in rest:
            rest["driver"] = _read_driver(rest["driver"], f"{place}.driver")
        if "drivers" in rest:
            if not isinstance(rest["drivers"], list):
                raise InputError("a list of drivers is needed", where=f"{place}.drivers")
            rest["drivers"] = [
                _read_driver(item, f"{place}.drivers[{i}]")
                for i, item in enumerate(rest["drivers"])
            ]
    if kind is Study and isinstance(rest.get("vary"), Mapping):
        rest["vary"] = _grid(rest["vary"], f"{place}.vary")
    task: Task = read(kind, rest, place)
    return task


def _grid(table: Mapping[str, Any], place: str) -> dict[str, Any]:
    """Return name -> [from, to, count] in SI; a unit belongs to the first two numbers."""
    result = {}
    for entry, items in table.items():
        base, suffix = split_unit(entry)
        if not isinstance(items, list) or len(items) != 3:
            raise InputError("[from, to, count] is needed", where=f"{place}.{entry}")
        if base in result:
            raise InputError(f"'{base}' is given twice, with and without a unit", where=place)
        result[base] = [*to_si(items[:2], suffix), items[2]]
    return result


def check_number(mechanism: Mechanism, name: str, suffix: str) -> None:
    """Raise for an automatic name given in a unit that is not that of its number."""
    part, *rest = name.split(".")
    if not rest or not suffix:
        return  # a parameter has no unit
    if part in mechanism.joints:
        entry = next((f for f in fields(mechanism.joints[part]) if f.name == rest[0]), None)
        unit = entry.metadata.get("unit") if entry else None
    elif part == "loads":
        entry = next((f for f in fields(mechanism.loads[rest[0]]) if f.name == rest[1]), None)
        unit = entry.metadata.get("unit") if entry else None
    else:
        unit = {"mass": "kg", "inertia": "kg m2"}.get(rest[0], "m")
    check_suffix(f"{rest[-1]}{suffix}", unit)


def _read_driver(table: Any, place: str) -> Driver:
    if isinstance(table, Mapping) and any(split_unit(word)[0] == "law" for word in table):
        for word in table:
            base, suffix = split_unit(word)
            if suffix and base in ("from", "to", "times"):
                raise InputError(
                    "the times of a law are in seconds",
                    where=f"{place}.{word}",
                    hint=f"{base} = ...",
                )
    return read(Driver, table, place)


def _check_units(problem: Problem, data: Mapping[str, Any]) -> None:
    """Raise for suffixes of sketched and driven values that are not units of their coordinates."""
    mechanism = problem.mechanism
    for name in _table(data, "sketch"):
        try:
            check_suffix(name, unit_of(mechanism, split_unit(name)[0]))
        except MechdaeError as error:
            raise error.inside("sketch") from None
    for name, task in _table(data, "tasks").items():
        for word in ("vary", "samples") if isinstance(problem.tasks[name], Study) else ():
            for entry in task.get(word, ()):
                base, suffix = split_unit(entry)
                try:
                    check_number(mechanism, base, suffix)
                except MechdaeError as error:
                    raise error.inside(f"tasks.{name}.{word}") from None
        if not isinstance(problem.tasks[name], Driven):
            continue
        tables = [("driver", task["driver"])] if "driver" in task else []
        tables += [(f"drivers[{k}]", item) for k, item in enumerate(task.get("drivers", ()))]
        for place, table in tables:
            for word in table:
                own = unit_of(mechanism, table["coordinate"])
                key = split_unit(word)[0]
                try:
                    if own is not None and key in RATES:
                        check_suffix(word, f"{own}{RATES[key]}")
                except MechdaeError as error:
                    raise error.inside(f"tasks.{name}.{place}") from None


def _check_depth(data: Any) -> None:
    front = [(data, 0)]
    while front:
        item, depth = front.pop()
        if depth > MAX_DEPTH:
            raise InputError(f"tables nested deeper than {MAX_DEPTH}")
        children = item.values() if isinstance(item, Mapping) else item
        front += [(child, depth + 1) for child in children if isinstance(child, dict | list)]


def _check_kind(value: Any, kind: type, place: str) -> None:
    """Raise for a value of another type, which only Python can give."""
    if not isinstance(value, kind):
        raise InputError(
            f"a value of type {kind.__name__} is needed, not {values.describe(value)}", where=place
        )


def _check_name(task: str) -> None:
    """Raise for a task whose name is none: files are called so."""
    try:
        values.name(task)
    except MechdaeError as problem:
        raise problem.inside("tasks") from None


def _check_task(mechanism: Mechanism, name: str, task: Task) -> None:
    place = f"tasks.{name}"
    known = evaluate_all(mechanism.parameters)
    if isinstance(task, Motion | Equilibrium):
        try:
            if isinstance(task, Motion):
                check_motion(mechanism, task)
            else:
                check_equilibrium(mechanism, task)
        except MechdaeError as problem:
            raise problem.inside(place) from None
    if not isinstance(task, Driven):
        return
    try:
        coordinates = [coordinate(mechanism, driver.coordinate).text for driver in task.all_drivers]
        if len(set(coordinates)) < len(coordinates):
            raise MechanismError("two drivers impose the same coordinate", where="drivers")
        if task.available:
            selection(mechanism, task.outputs, forces=isinstance(task, Reactions))
        laws = [driver for driver in task.all_drivers if driver.law is not None]
        for driver in task.all_drivers:
            _check_driver(driver, known, any(law.times or law.from_ is not None for law in laws))
    except MechdaeError as problem:
        raise problem.inside(place) from None


def _check_driver(driver: Driver, known: Mapping[str, float], timed: bool) -> None:
    """Raise for keys that do not make a driver; `timed`: a law of the task names its times."""
    if driver.table is not None:
        raise InputError(
            "tables over the time drive motions", where="driver.table", hint='law = "..." of t'
        )
    span = driver.from_ is not None or driver.to is not None
    by_time = driver.law is not None
    ways = [
        way
        for way, given in (
            ("at", driver.at is not None),
            ("from and to", span and not by_time),
            ("range", driver.range is not None),
            ("law", by_time),
            ("times", driver.times is not None and not by_time),
        )
        if given
    ]
    if len(ways) != 1 or ways[0] == "times":
        given = " and ".join(ways) if ways else "none of them"
        raise InputError(
            "a driver needs one of 'at', 'from' and 'to', 'range', "
            f"'law' with 'times' or 'from' and 'to'; not {given}",
            where="driver",
        )
    if span and (driver.from_ is None or driver.to is None):
        raise InputError("'from' and 'to' are needed together", where="driver")
    if by_time and span and driver.times is not None:
        raise InputError("a law has 'times' or 'from' and 'to', not both", where="driver")
    if driver.times is not None and not driver.times:
        raise InputError("the list of times is empty", where="driver.times")
    if by_time and not timed:
        raise InputError(
            "'times' is missing: the law is evaluated there",
            where="driver",
            hint="times = [0, 0.5, 1], or from = 0, to = 1 with poses in the task",
        )
    for used in sorted(names_in(driver.law)) if driver.law is not None else ():
        if used not in known and used != "t":
            raise UnknownName("name", used, [*known, "t"], where="driver.law")
    if driver.at is not None and not driver.at:
        raise InputError("the list of values is empty", where="driver.at")
    rates = (driver.speed, driver.acceleration, driver.jerk)
    numbers = [*(driver.at or ()), driver.from_, driver.to, *rates]
    for entry in [*numbers, *(driver.times or ())]:
        for used in sorted(names_in(entry)) if isinstance(entry, str) else ():
            if used not in known:
                raise UnknownName("parameter", used, known, where="driver")
