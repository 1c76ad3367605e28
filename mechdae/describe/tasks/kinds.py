"""What to compute, as frozen values; drivers belong to tasks, not to the mechanism."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from mechdae.additions import Added, Kinds, Registry
from mechdae.describe.coordinates import coordinate, selection
from mechdae.describe.expression import unknown_name
from mechdae.describe.file.reading import Nested, nest, split_unit
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.values import Number, Value
from mechdae.errors import InputError, MechanismError
from mechdae.records import dataclass, key, optional

if TYPE_CHECKING:
    from mechdae.describe.loads import TimeTable
    from mechdae.describe.tasks.finds import Find
    from mechdae.describe.values import NamesOrNone, NumbersOrNone, UnitOf
    from mechdae.records import Takes

    Finds = Takes[
        Sequence["Find"] | Sequence[Mapping[str, object]] | None, tuple["Find", ...] | None
    ]
    Drivers = Takes[Sequence["Driver"] | None, tuple["Driver", ...] | None]

DEFAULT_POSES = 361
MANY = 8
"""Poses that are named one by one are taken for a way from so many on."""
HINT = 'driver = { coordinate = "..." } in a file, Driver("...") in Python'
MEASURES = (
    "transmission",
    "extremes",
    "time-ratio",
    "dwell",
    "envelope",
    "curve",
    "centrodes",
    "instant-centres",
    "axodes",
    "screw-axes",
    "velocity-ratio",
    "mechanical-advantage",
)
"""What can be read off a sweep beside its poses."""


@dataclass(frozen=True)
class Driver(Value):
    """An imposed coordinate: named values, an interval, the whole assembled arc, or a law of time.

    With several laws one of them names the times. Among drivers that move, one with a single
    value ``at`` is held. Without ``speed`` rates are per unit of driver speed, the "analogues" of
    the theory of mechanisms; forces are those of a slow motion then, see `Reactions.quasi_static`.

    Examples
    --------
    >>> turn = md.Driver("crank.angle", from_=0, to=6.28, speed=10)
    >>> law = md.Driver("crank.angle", law="0.4 + sin(3*t)", times=[0, 0.5, 1])
    >>> law.times
    (0.0, 0.5, 1.0)
    """

    coordinate: str = key("text", doc="BODY.angle, BODY.POINT.x, JOINT.angle, JOINT.slide ...")
    at: NumbersOrNone = optional("numbers", doc="its values, m or rad; one alone holds it")
    from_: Number | None = optional("number", doc="first value, m or rad; of a law time in s")
    to: Number | None = optional("number", doc="last value, or time")
    range: str | None = optional("text", choices=("assembled",), doc="all that can be reached")
    law: str | None = optional("law", doc="expression of the time t, over from and to, or at times")
    times: NumbersOrNone = optional("numbers", doc="times of a law in s")
    speed: Number | None = optional("number", doc="1 where absent; of forces: a slow motion")
    acceleration: Number | None = optional("number", doc="0 where absent")
    jerk: Number | None = optional("number", doc="0 where absent")
    table: TimeTable | None = optional("timetable", doc="a law by rows, in a motion")
    direction: str | None = optional(
        "text", choices=("positive", "negative"), doc="sense of the motion, without a speed"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.direction is not None and self.timed:
            raise InputError(
                "a speed or a law tells the sense of the motion itself",
                where="direction",
                hint="leave direction away, or the speed",
            )

    @property
    def timed(self) -> bool:
        """Whether it is told how fast the coordinate moves."""
        rates = (self.speed, self.acceleration, self.law, self.table)
        return any(value is not None for value in rates)

    @property
    def rests(self) -> bool:
        """Whether it is told to stand still."""
        rates = (self.speed, self.acceleration, self.law, self.table)
        return rates in ((0.0, None, None, None), (0.0, 0.0, None, None))

    @property
    def usual_speed(self) -> Number:
        """The speed of a driver that moves: 1 where none is given, -1 in the negative sense."""
        if self.speed is not None:
            return self.speed
        return -1.0 if self.direction == "negative" else 1.0

    def units_by_key(self, unit_of: UnitOf) -> dict[str, str]:
        unit = unit_of(self.coordinate)
        if unit is None:
            return {}
        place = unit if self.law is None else "s"
        rates = {"speed": f"{unit}/s", "acceleration": f"{unit}/s2", "jerk": f"{unit}/s3"}
        return {"at": unit, "from": place, "to": place, "law": unit, "times": "s", **rates}

    @classmethod
    def from_table(cls, table: Mapping[str, Any]) -> Mapping[str, Any]:
        laws = [split_unit(word) for word in table if word.startswith("law")]
        by_law = any(base == "law" for base, _ in laws)
        for word in table if by_law else ():
            base, suffix = split_unit(word)
            if suffix and base in ("from", "to", "times"):
                raise InputError(
                    "the times of a law are in seconds", where=word, hint=f"{base} = ..."
                )
        return table


nest("driver", Nested("driver", {"": Driver}, HINT, tables=False))
nest("drivers", Nested("driver", {"": Driver}, "'driver' is for one", True, False, one=HINT))
TIME_TABLE: Kinds[type[Value]] = Kinds({"": Added("mechdae.describe.loads:TimeTable")})
FIND: Kinds[type[Value]] = Kinds({"": Added("mechdae.describe.tasks.finds:Find")})
nest("finds", Nested("find", FIND, 'find = [{ output = "...", crosses = 0 }]', several=True))
nest("timetable", Nested("table", TIME_TABLE, '{ file = "law.csv" }'))


def _check_way(driver: Driver) -> None:
    """Raise unless a driver is given in one of the ways there are."""
    if driver.table is not None:
        raise InputError(
            "tables over the time drive motions", where="driver.table", hint='law = "..." of t'
        )
    by_time = driver.law is not None
    span = driver.from_ is not None or driver.to is not None
    ways = {
        "at": driver.at is not None,
        "from and to": span and not by_time,
        "range": driver.range is not None,
        "law": by_time,
        "times": driver.times is not None and not by_time,
    }
    given = [way for way, there in ways.items() if there]
    if len(given) != 1 or given == ["times"]:
        raise InputError(
            "a driver needs one of 'at', 'from' and 'to', 'range', "
            f"'law' with 'times' or 'from' and 'to'; not {' and '.join(given) or 'none of them'}",
            where="driver",
        )
    if span and (driver.from_ is None or driver.to is None):
        raise InputError("'from' and 'to' are needed together", where="driver")
    if driver.at is not None and not driver.at:
        raise InputError("the list of values is empty", where="driver.at")


def _check_times(driver: Driver, timed: bool) -> None:
    """Raise for a law without times; `timed`: a law of the task names them."""
    if driver.law is None:
        return
    if driver.from_ is not None and driver.times is not None:
        raise InputError("a law has 'times' or 'from' and 'to', not both", where="driver")
    if driver.times is not None and not driver.times:
        raise InputError("the list of times is empty", where="driver.times")
    if not timed:
        raise InputError(
            "'times' is missing: the law is evaluated there",
            where="driver",
            hint="times = [0, 0.5, 1], or from = 0, to = 1 with poses in the task",
        )


def _check_names(driver: Driver, known: Mapping[str, float]) -> None:
    """Raise for names in the numbers of a driver that are no parameters."""
    if driver.law is not None:
        unknown_name([driver.law], {*known, "t"}, "name", "driver.law")
    numbers = (driver.from_, driver.to, driver.speed, driver.acceleration, driver.jerk)
    unknown_name([*(driver.at or ()), *numbers, *(driver.times or ())], known, place="driver")


@dataclass(frozen=True)
class Task(Value):
    """Base of all tasks.

    ``holds`` says what can be drawn of its result: poses, a path through them, their rates, a
    grid of parameters, designs, small motions.
    """

    kind: ClassVar[str] = ""
    in_space: ClassVar[bool] = True
    """It is computed of spatial mechanisms too."""
    holds: ClassVar[tuple[str, ...]] = ()
    on_mode: ClassVar[bool] = False
    """It can start on an assembly mode."""
    forces: ClassVar[bool] = False
    """It reports joints without a coordinate too, for their reactions."""

    @property
    def way(self) -> int:
        """How much of a way its poses are: 0 one pose, 1 few, 2 many by name, 3 an interval."""
        return 0

    def check(self, mechanism: Mechanism) -> None:
        """Raise for names and keys that do not fit the mechanism."""

    @classmethod
    def bare_mechanism(cls) -> Any:
        """Return the mechanism of files that hold only such tasks, None where one is needed."""
        return None


@dataclass(frozen=True)
class Driven(Task):
    """A task with one driver or several."""

    driver: Driver | None = optional("driver")
    drivers: Drivers = optional("drivers")
    outputs: NamesOrNone = optional("names")
    mode: str | None = optional("text")

    on_mode: ClassVar[bool] = True

    def check(self, mechanism: Mechanism) -> None:
        drivers = self.all_drivers
        coordinates = [coordinate(mechanism, driver.coordinate).text for driver in drivers]
        if len(set(coordinates)) < len(coordinates):
            raise MechanismError("two drivers impose the same coordinate", where="drivers")
        if self.outputs is not None:
            selection(mechanism, self.outputs, self.forces)
        known = mechanism.parameter_values
        timed = any(d.times or d.from_ is not None for d in drivers if d.law is not None)
        for driver in drivers:
            _check_way(driver)
            _check_times(driver, timed)
            _check_names(driver, known)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.driver is None and self.drivers is None:
            raise InputError("the key 'driver' is missing (or 'drivers', for several)", hint=HINT)
        if self.drivers == ():
            raise InputError("the list of drivers is empty", where="drivers")
        if self.driver is not None and self.drivers is not None:
            raise InputError("'driver' and 'drivers' are given, one of them is needed")

    @property
    def all_drivers(self) -> tuple[Driver, ...]:
        """The drivers, one or several."""
        return self.drivers if self.drivers is not None else (self.driver,)  # type: ignore[return-value]

    @property
    def moving_drivers(self) -> tuple[Driver, ...]:
        """Those that are not held at one value while others move."""
        several = tuple(d for d in self.all_drivers if d.at is None or len(d.at) > 1)
        return several or self.all_drivers

    @property
    def untimed(self) -> tuple[Driver, ...]:
        """The drivers that move and have no speed: 1 in the unit of the coordinate."""
        timed = ((d, (d.speed, d.law, d.table)) for d in self.moving_drivers)
        return tuple(driver for driver, rates in timed if rates == (None, None, None))

    @property
    def way(self) -> int:
        moving = [driver for driver in self.all_drivers if driver.at is None or len(driver.at) > 1]
        named = [len(values) for d in moving for values in (d.at, d.times) if values is not None]
        if not named:
            return 3 if moving else 0
        return 2 if max(named) >= MANY else 1


@dataclass(frozen=True)
class Sweep(Driven):
    """Positions, velocities and accelerations along the driver.

    Examples
    --------
    >>> task = md.Sweep(md.Driver("crank.angle", range="assembled"), poses=5)
    >>> result = md.solve(md.slider_crank(0.1, 0.3), task)
    >>> result.points["rod.C"].position[:, 0].round(3).tolist()
    [0.4, 0.283, 0.2, 0.283, 0.4]
    """

    poses: int | None = optional("whole", doc="number of poses over a range; absent: 361")
    derivatives: int = optional("natural", 2, doc="0: poses, 1: speeds, 2: accelerations, 3: jerks")
    on_change_point: str = optional(
        "text", "continue", choices=("continue", "stop", "switch"), doc="which branch follows"
    )
    measures: NamesOrNone = optional("names", choices=MEASURES, doc="what else is read off")
    dwell_tolerance: Number = optional("number", 0.01, doc="share of the swing or stroke")
    find: Finds = optional("finds", doc="where outputs cross a value or are extreme")

    kind: ClassVar[str] = "sweep"
    holds: ClassVar[tuple[str, ...]] = ("poses", "path", "rates")

    def check(self, mechanism: Mechanism) -> None:
        super().check(mechanism)
        if self.find:
            from mechdae.describe.tasks.finds import check_finds

            check_finds(mechanism, self.find, self.way)


@dataclass(frozen=True)
class Modes(Driven):
    """All assembly modes at one pose of the driver.

    Examples
    --------
    >>> task = md.Modes(md.Driver("crank.angle", at=[0.5]))
    >>> len(md.solve(md.four_bar(0.1, 0.04, 0.12, 0.08), task))
    2
    """

    limit: int | None = optional("whole", doc="most modes listed; absent: 1000")

    kind: ClassVar[str] = "modes"
    on_mode: ClassVar[bool] = False
    holds: ClassVar[tuple[str, ...]] = ("poses",)


TASKS: Registry[type[Task]] = Registry("tasks", {"sweep": Sweep, "modes": Modes})
"""Kind of task -> its class."""
