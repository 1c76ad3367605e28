"""Results: read-only arrays with names and units, the same content as the JSON."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, fields, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, ClassVar, Self, TypeVar, cast

from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.series_units import path_unit, series_unit, whole_path
from mechdae.describe.tasks.kinds import Task
from mechdae.describe.units import SI, Units, units_of
from mechdae.records import Record, dataclass
from mechdae.results.columns import columns_of
from mechdae.results.events import Event
from mechdae.results.plain import no_collection, plain
from mechdae.results.series import LazyPart, Named, Series, Summary
from mechdae.results.shown import RowsOfResult, Shown
from mechdae.results.status import StatusOfPoses
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


CONTENT = "mechdae.results.content"
"""It knows results: what the JSON has of them."""
NOTHING: Mapping[str, Any] = MappingProxyType({})


class OfOtherKinds:
    """What some kinds of results have as fields; it is empty in all others."""

    centres: Series = Series({})
    efforts: Series = Series({})
    scalars: Series = Series({})
    work: Series = Series({})
    parts: Mapping[str, Series] = NOTHING
    parameters: Mapping[str, Floats] = NOTHING
    table: RowsOfResult = RowsOfResult()
    data: Mapping[str, Any] = NOTHING
    checks: Mapping[str, float] = NOTHING
    labels: tuple[tuple[str, ...], ...] = ()
    solutions: tuple[Json, ...] = ()
    unique: Summary = Summary()


@dataclass(frozen=True, repr=False)
class Result(Record, OfOtherKinds, Shown):
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
        What tables and pictures show numbers in, see `in_units`: those of the file, unless others
        are asked for. Arrays and JSON are SI, CSV and frames in what is asked for.

    Examples
    --------
    >>> result = md.solve(md.four_bar(0.1, 0.04, 0.12, 0.08), poses=5)
    >>> result.status.tolist(), result.fault
    (['ok', 'ok', 'ok', 'ok', 'ok'], None)
    >>> result.points["coupler.C"].velocity.shape, round(result.value("summary/swing/rocker"), 4)
    ((5, 2), 1.2877)
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

    shows: ClassVar[str] = (
        "as_problem columns finer frame in_units path_unit table to_dict to_xarray unit value"
    )
    constructed: ClassVar[bool] = False
    forces: ClassVar[bool] = False
    """Whether such results may have forces."""

    def __post_init__(self) -> None:
        if not isinstance(self.summary, Summary):
            object.__setattr__(self, "summary", Summary(self.summary))
        if self.units is SI and self.mechanism.units:
            object.__setattr__(self, "units", units_of(written=self.mechanism.units))

    @classmethod
    def of(cls, problem: Problem, name: str, task: Task, **parts: Any) -> Self:
        """Return the result of a task of a problem."""
        head = (problem.name, name, task.kind, problem.mechanism, problem.title)
        return cls(*head, definition=task, **parts)

    def as_problem(self) -> Problem:
        """Return a problem with the mechanism and the task that this is the result of."""
        tasks = {} if self.definition is None else {self.task: self.definition}
        return Problem(self.mechanism, tasks, name=self.problem, title=self.title)

    def as_kind(self, kind: type[R], **changes: object) -> R:
        """Return a result of another class with what this one has, some of it changed."""
        names = [entry.name for entry in fields(self) if entry.name not in changes]
        return kind(**{name: getattr(self, name) for name in names} | changes)

    def in_units(self, units: str | Sequence[str] | Units) -> Self:
        """Return the same result, shown in other units: ``"mm,deg"``.

        Tables, CSV, frames and pictures show numbers in them, quantities of which none is named
        as before; arrays and JSON stay SI.

        Raises
        ------
        InputError
            No units, or two of one quantity.
        """
        shown = units_of(units, self.mechanism.units)
        return self if shown == self.units else replace(self, units=shown)

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
    def _content(self) -> dict[str, object]:
        content: dict[str, object] = importlib.import_module(CONTENT).content_of(self)
        return content

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
        return importlib.import_module(CONTENT).value_at(self._content, self.whole_path(path), path)

    def whole_path(self, path: str) -> str:
        """Return the path a named output stands for (``Theta``, ``Theta/rate``), else `path`."""
        return whole_path(self.outputs, path)

    def columns(self) -> Iterator[tuple[str, str, Any]]:
        """Yield (name, unit, (n,) array) for every scalar series, time and drivers first."""
        return columns_of(self)

    def unit(self, kind: str, part: str, name: str) -> str:
        """Return the unit of a series: of "drivers" by the coordinate, else by its `name`.

        `kind` is "drivers", "points" and so on, `part` one of these. The unit of a named output
        is empty where it does not follow from its expression.
        """
        return series_unit(self.mechanism, kind, part, name)

    def path_unit(self, path: str) -> str:
        """Return the unit of what a path of a study names; empty where it is not known."""
        known = self.summary.get("units", {}).get(path)
        return known or path_unit(self.mechanism, path, next(iter(self.drivers), ""))


@dataclass(frozen=True, repr=False)
class SweepResult(Result):
    """Poses along the drivers: a `Result` with measures of the sweep.

    Attributes
    ----------
    centres
        Instant centres (n, 2) [m] of pairs of bodies, ``crank-rocker``; in space screw axes,
        ``crank-rocker.direction`` (n, 3), ``.point`` (n, 3) [m] and ``.pitch`` (n,) [m a turn].

    Examples
    --------
    >>> task = md.Sweep(md.Driver("crank.angle", at=[1.0]), measures=["instant-centres"])
    >>> result = md.solve(md.four_bar(0.1, 0.04, 0.12, 0.08), task)
    >>> result.centres["crank-coupler"].round(4).tolist()
    [[0.0216, 0.0337]]
    """

    centres: Series = field(default_factory=lambda: Series({}))
