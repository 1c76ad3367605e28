"""Loads as frozen values; what they mean is in the documentation of the file format."""

from __future__ import annotations

import itertools
from collections.abc import Hashable, Iterator
from dataclasses import field, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar

from mechdae.describe.values import Number, Value
from mechdae.errors import InputError
from mechdae.records import dataclass, key, optional

if TYPE_CHECKING:
    from mechdae.describe.values import (
        FloatRowsOrNone,
        NamesOrNone,
        NumberOrNumbers,
        Numbers,
        NumbersOrNone,
        UnitOf,
    )
    from mechdae.types import Json


TIME = "t"
"""Abscissa of a table over the time."""
NUMBERS, VECTORS = ("number", "moment"), ("components", "moment", "direction")
"""Kinds of values of a load that are a number, that are components."""

SPRINGS = (
    {"stiffness": "N/m", "damping": "N s/m", "free_length": "m", "preload": "N"},
    {"stiffness": "N m/rad", "damping": "N m s/rad", "free_length": "rad", "preload": "N m"},
)
"""Units of the numbers of springs between points, and on angles."""


@dataclass(frozen=True)
class Load(Value):
    """Base of all loads."""

    name: str = key("name")
    kind: ClassVar[str] = ""

    def numbers(self) -> Iterator[tuple[str, Number]]:
        """Yield the load's plain numbers with the last part of their automatic name."""
        for entry in fields(self):
            value = getattr(self, entry.name)
            if entry.metadata.get("kind") in NUMBERS and isinstance(value, float):
                yield entry.name, value
            elif entry.metadata.get("kind") in VECTORS and isinstance(value, tuple):
                for axis, number in zip("xyz", value, strict=False):
                    if isinstance(number, float):
                        yield f"{entry.name}.{axis}", number

    def settled(self) -> tuple[Hashable, ...]:
        """Return what it is but for its numbers; those of expressions and tables are part of it."""
        numbers = {name.partition(".")[0] for name, _ in self.numbers()}
        rest: list[Any] = [getattr(self, e.name) for e in fields(self) if e.name not in numbers]
        texts = [
            number
            for entry in fields(self)
            if isinstance(getattr(self, entry.name), tuple)
            and entry.metadata.get("kind") in VECTORS
            for number in getattr(self, entry.name)
            if isinstance(number, str)
        ]
        return (self.kind, tuple(rest), tuple(texts), getattr(self, "points", None))

    @property
    def expressions(self) -> bool:
        """Whether one of the load's numbers is an expression."""
        values = [
            getattr(self, e.name)
            for e in fields(self)
            if e.metadata.get("kind") in NUMBERS + VECTORS
        ]
        rows = (value if isinstance(value, tuple) else (value,) for value in values)
        return any(isinstance(number, str) for number in itertools.chain(*rows))

    def with_number(self, entry: str, number: Number) -> Load:
        """Return the load with one of its numbers replaced."""
        name, _, axis = entry.partition(".")
        changes: Json = {name: number}
        if axis:
            vector = list(getattr(self, name))
            vector["xyz".index(axis)] = number
            changes = {name: tuple(vector)}
        return replace(self, **changes)


@dataclass(frozen=True)
class Force(Load):
    """Force at a point.

    Examples
    --------
    >>> md.Force("F", "slider.C", [-100, 0]).value
    (-100.0, 0.0)
    """

    point: str = key("reference", doc="where it acts, BODY.POINT")
    value: Numbers = key("components", doc="components", unit="N")
    frame: str = optional("text", "world")
    kind: ClassVar[str] = "force"


@dataclass(frozen=True)
class Torque(Load):
    """Torque on a body; in space its components in the axes of ``frame``.

    Examples
    --------
    >>> md.Torque("M", "rocker", -5).value
    -5.0
    """

    body: str = key("name", doc="body it acts on")
    value: NumberOrNumbers = key("moment", doc="moment", unit="N m")
    frame: str = optional("text", "world")
    kind: ClassVar[str] = "torque"


@dataclass(frozen=True)
class Resistance(Load):
    """Magnitudes against the motion while the coordinate falls and grows.

    Examples
    --------
    >>> md.Resistance("cut", "guide.slide", negative=20, positive=500).positive
    500.0
    """

    coordinate: str = key("text", doc="coordinate it acts on")
    negative: Number = optional("number", 0.0, doc="while it falls", unit="N or N m")
    positive: Number = optional("number", 0.0, doc="while it grows", unit="N or N m")
    kind: ClassVar[str] = "resistance"

    def units_by_key(self, unit_of: UnitOf) -> dict[str, str]:
        unit = "N m" if unit_of(self.coordinate) == "rad" else "N"
        return {"negative": unit, "positive": unit}


@dataclass(frozen=True)
class Spring(Load):
    """Spring and damper between two points, or on a coordinate.

    Examples
    --------
    >>> md.Spring("s", between=["ground.D", "rocker.P"], stiffness=2000, free_length=0.05).stiffness
    2000.0
    """

    between: NamesOrNone = optional("names", doc="its two points, BODY.POINT")
    coordinate: str | None = optional("text", doc="in place of between")
    stiffness: Number = optional("number", 0.0, unit="N/m or N m/rad")
    free_length: Number = optional("number", 0.0, doc="without a force", unit="m or rad")
    preload: Number = optional("number", 0.0, unit="N or N m")
    damping: Number = optional("number", 0.0, unit="N s/m or N m s/rad")
    kind: ClassVar[str] = "spring"

    def units_by_key(self, unit_of: UnitOf) -> dict[str, str]:
        return SPRINGS[self.coordinate is not None and unit_of(self.coordinate) == "rad"]


@dataclass(frozen=True)
class TableLoad(Load):
    """Values over a coordinate or the time, from a CSV file or ``rows``: a force or a torque.

    A force [N] on the coordinate ``along``, positive in the sense of its growth, or a torque
    [N m] on a ``body``, in space about the direction ``axis``. Tables over the time ``t`` may have
    ``shift``, ``period`` and a spline.

    Examples
    --------
    >>> load = md.TableLoad("p", "guide.slide", rows=[[0, 0], [0.1, 800]], along="guide.slide")
    >>> load.points
    ((0.0, 0.0), (0.1, 800.0))
    """

    coordinate: str = key("text", doc="abscissa: a coordinate, or the time t")
    file: str | None = optional("text", doc="CSV in the folder of the problem file")
    rows: FloatRowsOrNone = optional(
        "rows", doc="[[abscissa, value], ...]", unit="m or rad, and N or N m"
    )
    columns: NamesOrNone = optional("names")
    factor: Number = optional("number", 1.0, unit="N or N m over the unit of the table")
    along: str | None = optional("text", doc="coordinate on which it is a force, in its sense")
    body: str | None = optional("name", doc="body on which it is a torque")
    periodic: bool = optional("flag", False)
    shift: Number = optional("number", 0.0, unit="s")
    period: Number | None = optional("number", unit="s")
    interpolation: str = optional("text", "linear", choices=("linear", "spline"))
    axis: NumbersOrNone = optional("direction", doc="of a torque in space, right-handed", unit="1")
    frame: str = optional("text", "world", doc="in whose axes axis is given: world or a body")
    from_file: tuple[tuple[float, float], ...] | None = field(
        default=None, compare=False, repr=False
    )
    kind: ClassVar[str] = "table"

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.along is None) == (self.body is None):
            both = ", not both" if self.body else ""
            raise InputError(f"a table needs 'along' (a coordinate) or 'body'{both}")
        _check_rows(self)
        if self.axis is not None and all(number == 0 for number in self.axis):
            raise InputError("a direction needs a length", where="axis", hint="like [0, 0, 1]")
        if self.coordinate != TIME:
            given = {"shift": self.shift != 0.0, "period": self.period is not None}
            given["interpolation"] = self.interpolation != "linear"
            for word, there in given.items():
                if there:
                    raise InputError("it belongs to a table over t", where=word)

    @property
    def points(self) -> tuple[tuple[float, float], ...]:
        """The pairs (abscissa, value); none where the file has not been read."""
        return (self.rows if self.file is None else self.from_file) or ()


@dataclass(frozen=True)
class TimeTable(Value):
    """Values over the time, from a CSV file or ``rows``: a measured law of a driver.

    A spline joins the rows where nothing else is given: straight lines would jump in their speed.

    Examples
    --------
    >>> law = md.TimeTable(rows=[[0, 0], [0.5, 0.3], [1, 1.2]])
    >>> md.Driver("crank.angle", table=law).table.points[-1]
    (1.0, 1.2)
    """

    file: str | None = optional("text", doc="CSV in the folder of the problem file")
    rows: FloatRowsOrNone = optional("rows", doc="[[time, value], ...]", unit="s, and m or rad")
    columns: NamesOrNone = optional("names")
    factor: Number = optional("number", 1.0, unit="m or rad over the unit of the table")
    shift: Number = optional("number", 0.0, unit="s")
    period: Number | None = optional("number", unit="s")
    interpolation: str = optional("text", "spline", choices=("spline", "linear"))
    periodic: bool = optional("flag", False)
    from_file: tuple[tuple[float, float], ...] | None = field(
        default=None, compare=False, repr=False
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_rows(self)

    @property
    def points(self) -> tuple[tuple[float, float], ...]:
        """The pairs (time, value); none where the file has not been read."""
        return (self.rows if self.file is None else self.from_file) or ()


def _check_rows(table: TableLoad | TimeTable) -> None:
    """Raise for rows that make no table."""
    if table.file is None and table.rows is None:
        raise InputError("a table needs 'file' or 'rows'")
    if table.file is not None and table.rows is not None:
        raise InputError("a table needs 'file' or 'rows', not both")
    if table.periodic and table.period is not None:
        raise InputError("a table has a 'period' or is 'periodic', not both", where="periodic")
    if len(table.points) == 1:
        raise InputError(
            "two rows at least are needed", where="rows" if table.file is None else "file"
        )
    for k, (before, after) in enumerate(itertools.pairwise(table.points), start=2):
        if after[0] <= before[0]:
            raise InputError(
                f"row {k} does not lie after the one before it ({after[0]:g} after {before[0]:g})",
                where="rows" if table.file is None else "file",
            )
