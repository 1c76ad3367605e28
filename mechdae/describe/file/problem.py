"""A problem as a frozen value: a mechanism, its tasks and the values expected of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import field
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar

from mechdae.describe import values
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.tasks.kinds import Task
from mechdae.describe.units import Units, units_of
from mechdae.describe.values import Number, Table, Value
from mechdae.errors import InputError, MechdaeError, UnknownName
from mechdae.records import Record, dataclass, key, optional

if TYPE_CHECKING:
    from mechdae.describe.file.repeat import Pattern
    from mechdae.records import Takes

SETTINGS = "mechdae.describe.file.settings"
"""It knows problems: what sets their numbers."""


@dataclass(frozen=True)
class Expected(Value):
    """A value that `check` verifies: path below the task in the JSON, tolerance, source.

    Examples
    --------
    >>> md.Expected("turn", "summary/swing/rocker", 0.8, rel=1e-9, source="Volmer").what
    'summary/swing/rocker'
    """

    task: str = key("text", doc="name of the task")
    what: str = key("text", doc="path below the task in the JSON, or a named output")
    value: Any = key("free", doc="the value, or an expression over the parameters")
    at: Number | None = optional("number", doc="value of the driver, m or rad")
    time: Number | None = optional("number", doc="in place of at, in s")
    rel: float | None = optional("number", doc="relative tolerance")
    abs: float | None = optional("number", doc="absolute tolerance, in SI")
    source: str = optional("text", "", doc="where the value is from")


@dataclass(frozen=True)
class Problem(Record):
    """One mechanism and any number of named tasks.

    Parameters
    ----------
    mechanism
        A `Mechanism`.
    tasks
        Name -> task.
    expected
        `Expected` values that ``mechdae check`` compares.
    name, title, source
        Its name in results, what it is called, where its numbers are from.
    pattern
        Of a file with repetition: what its sizes are set in.
    notes
        Doubts about what a file says.

    Raises
    ------
    InputError
        A task that does not fit the mechanism; the message names the task and the key.

    Examples
    --------
    >>> problem = md.Problem(md.load("pendulum").mechanism, {"fall": md.Motion(until=1.0)})
    >>> problem.task("fall").until
    1.0
    """

    mechanism: Mechanism
    tasks: Takes[Mapping[str, Task], Table[Task]] = values.empty_table()
    expected: tuple[Expected, ...] = ()
    name: str = "mechanism"
    title: str = ""
    source: str = ""
    pattern: Pattern | None = field(default=None, compare=False, repr=False)
    notes: tuple[str, ...] = field(default=(), compare=False, repr=False)

    shows: ClassVar[str] = "sizes task with_task with_values"

    def __post_init__(self) -> None:
        _check_kind(self.mechanism, Mechanism, "mechanism")
        _check_kind(self.tasks, Mapping, "tasks")
        object.__setattr__(self, "tasks", Table(self.tasks))
        check_parts(self.mechanism)
        _check_tasks(self.mechanism, self.tasks)
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
        from mechdae.describe.file.load_checks import mechanism_lines, tasks_lines

        lines = [f"{self.name}: {self.title}".removesuffix(": ")]
        lines += mechanism_lines(self.mechanism, self.tasks) + tasks_lines(self.tasks)
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        """Return the diagram of the sketch and the screen, for notebooks."""
        from mechdae.describe.file.load_checks import in_notebook

        return in_notebook(self, str(self))

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
        _check_tasks(self.mechanism, {name: task})
        changed = copy(self)
        vars(changed)["tasks"] = self.tasks.with_(name, task)
        return changed

    def with_values(self, changes: Mapping[str, Number]) -> Problem:
        """Return the problem with sizes and parameters set, `changes` by name.

        Sizes come first, whatever the order; keys of parameters may carry a unit
        (``phi1_deg``).
        """
        if not changes:
            return self
        problem: Problem = import_module(SETTINGS).with_values(self, changes)
        return problem

    @property
    def sizes(self) -> Table[int]:
        """The sizes of the file by name."""
        return self.pattern.sizes if self.pattern else Table()

    def blame(self, error: MechdaeError, units: str | Sequence[str] | Units = ()) -> None:
        """Let an error be in the file's units, or others; of a repeated part name where it is."""
        units_of(units, self.mechanism.units).say(error)
        if self.pattern is not None:
            self.pattern.blame(error)


def check_parts(mechanism: Mechanism) -> None:
    """Raise for loads on what does not exist, and for outputs that are no expressions."""
    if mechanism.loads:
        from mechdae.describe.file.load_checks import check_loads

        check_loads(mechanism)
    if mechanism.outputs:
        from mechdae.describe.named import check_outputs

        check_outputs(mechanism)


def check_task(mechanism: Mechanism, name: str, task: Task) -> None:
    """Raise for names and keys of a task that do not fit the mechanism."""
    try:
        task.check(mechanism)
    except MechdaeError as problem:
        raise problem.inside(f"tasks.{name}") from None


def _check_kind(value: Any, kind: type, place: str) -> None:
    """Raise for a value of another type, which only Python can give."""
    if not isinstance(value, kind):
        raise InputError(
            f"a value of type {kind.__name__} is needed, not {values.describe(value)}", where=place
        )


def _check_tasks(mechanism: Mechanism, tasks: Mapping[str, Task]) -> None:
    """Raise for tasks whose name is none, as files are called so, or that do not fit."""
    try:
        for name in tasks:
            values.name(name)
    except MechdaeError as problem:
        raise problem.inside("tasks") from None
    for name, task in tasks.items():
        _check_kind(task, Task, f"tasks.{name}")
        check_task(mechanism, name, task)
