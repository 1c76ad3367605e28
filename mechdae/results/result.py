"""Results: read-only arrays with names and units, the same content as the JSON."""

from __future__ import annotations

import importlib
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import field, fields, replace
from functools import cached_property, partial
from types import MappingProxyType
from typing import Any, ClassVar, Self, TypeVar, cast

import numpy as np

from mechdae.describe.mechanism import Mechanism
from mechdae.describe.tasks.kinds import Task
from mechdae.describe.units import SI, Units
from mechdae.errors import UnknownName
from mechdae.records import dataclass
from mechdae.results.columns import columns_of
from mechdae.results.events import Event
from mechdae.results.lazy import LazyPart, Summary
from mechdae.results.plain import no_collection, plain
from mechdae.results.series import Named, Series
from mechdae.results.shown import Shown
from mechdae.results.status import StatusOfPoses
from mechdae.results.units import HISTORY, KINDS, UNITS_OF_HISTORY, path_unit, series_unit
from mechdae.types import Floats, Json, Texts

R = TypeVar("R", bound="Result")


class Fault:
    """What is wrong with an answer, None for nothing; a `LazyPart` is computed when it is read."""

    def __get__(self, result: Result, owner: type | None = None) -> str | None:
        value = None if result is None else result.__dict__["fault"]
        if isinstance(value, LazyPart):
            value = result.__dict__["fault"] = value.parts()["fault"] or None
        return cast("str | None", value)

    def __set__(self, result: Result, value: str | LazyPart | None) -> None:
        result.__dict__["fault"] = value


NOTHING: Mapping[str, Any] = MappingProxyType({})
OWN_NAMES = frozenset(
    "problem task kind mechanism title drivers bodies points joints outputs centres status bound "
    "condition labels events checks summary fault definition parameters table time efforts parts "
    "solutions unique data scalars work".split()
)
"""First steps of paths that are no named outputs, whatever those are called."""


@dataclass(frozen=True, repr=False)
class Result(Shown):
    """What one task gave; rows are poses (modes, states, sets of parameters, designs).

    Each kind of task has its own class, with what only it has; here that is empty.

    Attributes
    ----------
    drivers, bodies, points, joints, outputs
        Named series, SI and radians; nan where a pose has no value. `outputs` are those that
        the problem names.
    status : (n,) array of str
        Values of `Status`.
    bound
        length (n,) [m] and angle (n,) [rad]: distance to the exact solution at most.
    condition : (n,) array
        Condition number of the worst block; near a limit rates lose that many digits.
    events
        What happens along the way, in its order.
    time : (n,) array
        The times of the poses where the drivers follow laws, else None [s].
    summary
        Facts by name, as in the JSON. Swing and stroke, the critical factor of friction and
        which reactions of a motion are unique are computed when they are read.
    fault
        What is wrong with the answer, None when nothing is; of forces the checks are made when it
        is read.
    units
        What tables, CSV and pictures show numbers in, see `in_units`; arrays and JSON are SI.
    """

    problem: str
    task: str
    kind: str
    mechanism: Mechanism
    title: str = ""
    drivers: Named = field(default_factory=lambda: Named("driver", {}))
    bodies: Named = field(default_factory=lambda: Named("body", {}))
    points: Named = field(default_factory=lambda: Named("point", {}))
    joints: Named = field(default_factory=lambda: Named("joint", {}))
    outputs: Named = field(default_factory=lambda: Named("output", {}))
    status: Texts = StatusOfPoses()  # type: ignore[assignment]
    bound: Series = field(default_factory=lambda: Series({}))
    condition: Floats | None = None
    events: tuple[Event, ...] = ()
    summary: Summary = field(default_factory=Summary)
    fault: Fault = Fault()
    definition: Task | None = None
    time: Floats | None = None
    units: Units = SI

    centres = efforts = scalars = work = Series({})
    parts = parameters = table = data = checks = NOTHING
    labels = cast("tuple[tuple[str, ...], ...]", ())
    solutions = cast("tuple[dict[str, Any], ...]", ())
    forces: ClassVar[bool] = False
    """Whether such results may have forces."""
    unique = Summary()

    def __post_init__(self) -> None:
        if not isinstance(self.summary, Summary):
            object.__setattr__(self, "summary", Summary(self.summary))

    def as_kind(self, kind: type[R], **changes: Any) -> R:
        """Return a result of another class with what this one has, some of it changed."""
        kept = [own.name for own in fields(self) if own.name not in changes]
        return kind(**{name: getattr(self, name) for name in kept} | changes)

    def in_units(self, units: str | Sequence[str] | Units) -> Self:
        """Return the same result, shown in other units: ``"mm,deg"``.

        Tables, CSV, frames and pictures show numbers in them; arrays and JSON stay SI.

        Raises
        ------
        InputError
            No units, or two of one quantity.
        """
        if not isinstance(units, Units):
            from mechdae.describe.shown_units import units_of

            units = units_of(units)
        return self if units == self.units else replace(self, units=units)

    def finer(self, parts: int) -> Result:
        """Return the same task with `parts` steps from each pose to the next, solved again.

        For pictures: curves are drawn of it. Its numbers at the poses asked for are these.

        Raises
        ------
        SolveError
            There is nothing between the poses.
        """
        found: Result = importlib.import_module("mechdae")._finer(self, parts)
        return found.in_units(self.units)

    def _parts(self) -> list[tuple[str, Series]]:
        return [(f"efforts_{word}", series) for word, series in self.parts.items()]

    def __len__(self) -> int:
        return len(self.codes)

    @property
    def codes(self) -> Any:
        """The statuses as bytes (n,), see `among`."""
        return self.__dict__["_codes"]

    def to_dict(self) -> Json:
        """Return plain data, as in the JSON of this task (nan as None)."""
        with no_collection():
            return {name: plain(part) for name, part in self._content.items()}

    @cached_property
    def _content(self) -> dict[str, Any]:
        """What the JSON of this task has, in its order, as arrays, mappings and sequences."""
        content: dict[str, Any] = {"kind": self.kind}
        if self.time is not None:
            content["time"] = self.time
        for name in KINDS:
            table = self._joints() if name == "joints" else getattr(self, name)
            if table:
                content[name] = table
        for word, series in (("efforts", self.efforts), *self._parts()):
            if series:
                content[word] = series
        content |= self.scalars
        if self.work:
            content["work"] = self.work
        for name in ("parameters", "table"):
            if arrays := getattr(self, name):
                content[name] = {key: np.asarray(array) for key, array in arrays.items()}
        content |= self.data
        if self.centres:
            content["centres"] = self.centres
        if self.kind == "modes":
            content["labels"] = self.labels
        content["status"] = np.asarray(self.status, dtype=str)
        content["bound"] = self.bound
        if self.condition is not None:
            content["condition"] = self.condition
        content["events"] = self.events
        if self.solutions:
            content["solutions"] = self.solutions
        if self.checks.names() if isinstance(self.checks, Summary) else self.checks:
            content["checks"] = self.checks
        content["summary"] = self.summary.changed(fault=LazyPart(self._told))
        return content

    def _told(self) -> dict[str, str]:
        return {} if self.fault is None else {"fault": self.fault}

    def _joints(self) -> Summary:
        """Return the series of joints with what is unique of their reactions."""
        joints = Summary({name: Summary(series.open()) for name, series in self.joints.items()})
        for name in self.unique.names():
            if name in self.joints:
                joints[name]["unique"] = LazyPart(partial(self._unique_of, name))
            else:
                joints[name] = LazyPart(partial(self._unlisted, name))
        return joints

    def _unique_of(self, joint: str) -> dict[str, Any]:
        return {"unique": self.unique[joint]} if joint in self.unique else {}

    def _unlisted(self, joint: str) -> dict[str, Any]:
        unique = self._unique_of(joint)
        return {joint: unique} if unique else {}

    def value(self, path: str) -> Any:
        """Return the plain data at a slash path below the task (``points/rod.B/velocity``).

        A named output stands for its value, or is the first step of a path; a number is a place
        in a list (``summary/frequencies/0``), and what follows ``table/`` the output of a study
        (``table/last/points/rod.B/position``). Nothing but what the path names is copied.

        Raises
        ------
        UnknownName
            With the nearest names on that level.
        """
        here: Any = self._content
        steps = self.whole_path(path).split("/")
        if steps[0] == "table":
            table, output = here.get("table", {}), "/".join(steps[1:])
            if output in table:
                return plain(table[output])
        for step in steps:
            if _is_list(here) and step.isdigit() and int(step) < len(here):
                here = here[int(step)]
                continue
            if isinstance(here, Mapping) and step in here:
                here = here[step]
                continue
            known = {str(key): key for key in here} if isinstance(here, Mapping) else {}
            if step not in known:
                raise UnknownName("path", path, known)
            here = here[known[step]]
        return plain(here)

    def whole_path(self, path: str) -> str:
        """Return the path a named output stands for (``Theta``, ``Theta/rate``), else `path`."""
        return whole_path(self.outputs, path)

    def columns(self) -> Iterator[tuple[str, str, Any]]:
        """Yield (name, unit, (n,) array) for every scalar series, time and drivers first."""
        return columns_of(self)

    def unit(self, kind: str, part: str, name: str) -> str:
        """Return the unit of a series: of "drivers" by the coordinate, else by its name.

        That of a named output is empty where it does not follow from its expression.
        """
        return series_unit(self.mechanism, kind, part, name)

    def path_unit(self, path: str) -> str:
        """Return the unit of what a path of a study names; empty where it is not known."""
        word, _, rest = path.partition("/")
        if word in HISTORY:
            return UNITS_OF_HISTORY.get(word) or self.path_unit(rest)
        return path_unit(self.mechanism, whole_path(self.mechanism.outputs, path))


def whole_path(outputs: Container[str], path: str) -> str:
    """Return the path a named output stands for (``Theta``, ``Theta/rate``), else `path`."""
    name, _, rest = path.partition("/")
    if name in outputs and name not in OWN_NAMES:
        return f"outputs/{name}/{rest or 'value'}"
    return path


def _is_list(value: Any) -> bool:
    return isinstance(value, list | tuple) or (isinstance(value, np.ndarray) and value.ndim > 0)
