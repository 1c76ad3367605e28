"""A problem as a frozen value: a mechanism, its tasks and the values expected of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, fields, replace
from typing import Any

from mechdae.describe import values
from mechdae.describe.file.load_checks import check_loads
from mechdae.describe.file.reading import unit_meant
from mechdae.describe.file.repeat import Pattern, expand
from mechdae.describe.file.screen import mechanism_lines, tasks_lines
from mechdae.describe.file.tabulated import with_tables_of
from mechdae.describe.file.task_checks import check_task
from mechdae.describe.file.units import in_si
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.named import check_outputs
from mechdae.describe.table import Table
from mechdae.describe.tasks.kinds import Driven, Task
from mechdae.describe.values import Number, Value, key
from mechdae.errors import InputError, MechdaeError, UnknownName
from mechdae.records import dataclass


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

    ``pattern`` is kept of a file with repetition, so that sizes can be set; ``notes`` are doubts
    about what a file says.
    """

    mechanism: Mechanism
    tasks: Table[Task] = field(default_factory=Table)
    expected: tuple[Expected, ...] = ()
    name: str = "mechanism"
    title: str = ""
    source: str = ""
    pattern: Pattern | None = field(default=None, compare=False, repr=False)
    notes: tuple[str, ...] = field(default=(), compare=False, repr=False)

    def __post_init__(self) -> None:
        _check_kind(self.mechanism, Mechanism, "mechanism")
        _check_kind(self.tasks, Mapping, "tasks")
        object.__setattr__(self, "tasks", Table(self.tasks))
        check_loads(self.mechanism)
        check_outputs(self.mechanism)
        for name, task in self.tasks.items():
            _check_name(name)
            _check_kind(task, Task, f"tasks.{name}")
            check_task(self.mechanism, name, task)
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

    def __str__(self) -> str:
        """Return a screen: parts, numbers and tasks. ``mechdae show`` counts and groups them."""
        lines = [f"{self.name}: {self.title}".removesuffix(": ")]
        lines += mechanism_lines(self.mechanism, self.tasks) + tasks_lines(self.tasks)
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        """Return the screen for notebooks."""
        import html

        return f"<pre>{html.escape(str(self))}</pre>"

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
                    self = self._resized(name, changes[name])
                except MechdaeError as problem:
                    problem.where = f"set {name}: {problem.where}".removesuffix(": ")
                    raise problem from None
        known = self.mechanism.settable
        new: dict[str, Number] = {}
        for name, value in changes.items():
            if name in self.sizes:
                continue
            try:
                base, new[base] = in_si(self.mechanism, self.tasks, known, name, value)
                if base not in known:
                    self.mechanism.with_values({base: new[base]})  # says what there is
            except MechdaeError as problem:
                problem.where = f"set {name}"
                if isinstance(problem, UnknownName) and self.sizes and not problem.hint:
                    problem.hint = f"the sizes are {', '.join(self.sizes)}"
                if isinstance(problem, UnknownName):
                    problem.hint = unit_meant(name, known) or problem.hint
                raise problem from None
        if not new:
            return self
        pattern = self.pattern
        for base, value in new.items():
            pattern = pattern and pattern.with_number(base, value)
        return self._revalued(self._changed(new), pattern)

    def _revalued(self, mechanism: Mechanism, pattern: Pattern | None) -> Problem:
        """Return the problem with a mechanism of the same names: only values are checked."""
        other: Problem = object.__new__(type(self))
        vars(other).update({own.name: getattr(self, own.name) for own in fields(self)})
        vars(other).update(mechanism=mechanism, pattern=pattern)
        check_loads(mechanism)
        check_outputs(mechanism)
        for name, task in self.tasks.items():
            if not isinstance(task, Driven):  # of those names are checked, which are the same
                check_task(mechanism, name, task)
        return other

    def _changed(self, new: Mapping[str, Number]) -> Mechanism:
        """Return the mechanism with numbers set all at once: one by one some may make none."""
        try:
            return self.mechanism.with_values(new)
        except MechdaeError as problem:
            problem.where = f"set {', '.join(new)}"
            for name, value in new.items() if len(new) > 1 else ():
                try:
                    self.mechanism.with_values({name: value})
                except MechdaeError as own:
                    own.where = f"set {name}"
                    raise own from None
            raise problem from None

    @property
    def sizes(self) -> Table[int]:
        """The sizes of the file by name."""
        return self.pattern.sizes if self.pattern else Table()

    def blame(self, error: MechdaeError) -> None:
        """Let an error about a repeated part name the place in the file it was typed at."""
        if self.pattern is not None:
            expand(self.pattern.data()).blame(error)

    def _resized(self, name: str, value: Any) -> Problem:
        """Return the problem expanded anew; tasks put or replaced since it was read are kept."""
        assert self.pattern is not None
        pattern = self.pattern.with_size(name, value)
        old, new = self.pattern.problem(self.name), pattern.problem(self.name)
        if old.mechanism != self.mechanism:
            raise InputError(
                "the mechanism is no longer the one of the file", hint="set the size before"
            )
        tasks = {
            key: new.tasks[key] if task == old.tasks.get(key) and key in new.tasks else task
            for key, task in self.tasks.items()
        }
        resized: Problem = replace(
            new,
            mechanism=with_tables_of(new.mechanism, self.mechanism),
            tasks=Table(tasks),
            expected=new.expected if self.expected == old.expected else self.expected,
            title=self.title,
            source=self.source,
        )
        return resized


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
