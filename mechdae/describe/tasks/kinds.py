"""What to compute, as frozen values; drivers belong to tasks, not to the mechanism."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from mechdae.additions import Registry
from mechdae.describe.file.reading import Nested, nest, split_unit, to_si
from mechdae.describe.loads import TimeTable
from mechdae.describe.table import Table
from mechdae.describe.tasks.constraints import Constraint, Turned
from mechdae.describe.tasks.goals import GoalDescription
from mechdae.describe.values import Number, Value, key
from mechdae.errors import InputError
from mechdae.records import dataclass

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
)
"""What can be read off a sweep beside its poses."""


@dataclass(frozen=True)
class Driver(Value):
    """An imposed coordinate: named values, an interval, the whole assembled arc, or a law.

    A ``law`` is an expression of the time ``t``, over the interval ``from_``, ``to`` [s] or at
    ``times``; with several laws one of them names the times. Among drivers that move, one
    with a single value ``at`` is held. In a motion a law may be a ``table`` over the time.

    ``coordinate`` is ``body.angle``, ``body.point.x|y``, ``joint.angle`` or ``joint.slide``;
    ``speed``, ``acceleration`` and ``jerk`` are its rates at every pose (default 1, 0 and 0:
    rates per unit of driver speed, the "analogues" of the theory of mechanisms). Without a speed
    ``direction`` "negative" moves it the other way; forces are those of a slow motion then, see
    `Reactions.quasi_static`.
    """

    coordinate: str = key("text")
    at: tuple[Number, ...] | None = key("numbers", None)
    from_: Number | None = key("number", None)
    to: Number | None = key("number", None)
    range: str | None = key("text", None, choices=("assembled",))
    law: str | None = key("law", None)
    times: tuple[Number, ...] | None = key("numbers", None)
    speed: Number | None = key("number", None)
    acceleration: Number | None = key("number", None)
    jerk: Number | None = key("number", None)
    table: TimeTable | None = key("timetable", None, doc="a law by rows, in a motion")
    direction: str | None = key(
        "text", None, choices=("positive", "negative"), doc="sense of the motion, without a speed"
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
        told = (self.speed, self.acceleration, self.law, self.table)
        return any(own is not None for own in told)

    @property
    def rests(self) -> bool:
        """Whether it is told to stand still."""
        told = (self.speed, self.acceleration, self.law, self.table)
        return told in ((0.0, None, None, None), (0.0, 0.0, None, None))

    @property
    def usual_speed(self) -> Number:
        """The speed of a driver that moves: 1 where none is given, -1 in the negative sense."""
        if self.speed is not None:
            return self.speed
        return -1.0 if self.direction == "negative" else 1.0

    @classmethod
    def from_table(cls, table: Mapping[str, Any]) -> Mapping[str, Any]:
        typed = {word: split_unit(word) for word in table}
        by_law = any(base == "law" for base, _ in typed.values())
        for word, (base, suffix) in typed.items():
            if by_law and suffix and base in ("from", "to", "times"):
                raise InputError(
                    "the times of a law are in seconds", where=word, hint=f"{base} = ..."
                )
        return table


nest("driver", Nested("driver", {"": Driver}, HINT, tables=False))
nest("drivers", Nested("driver", {"": Driver}, "'driver' is for one", True, False, one=HINT))
nest("timetable", Nested("table", {"": TimeTable}, '{ file = "law.csv" }'))


@dataclass(frozen=True)
class Watched(Value):
    """An expression of coordinates, speeds and ``t`` crosses a value, in a motion.

    With ``stop`` the motion ends there. ``name`` is that of the expression where it has no other.
    """

    coordinate: str = key("text", doc="a coordinate, a speed, a named output")
    crosses: Number = key("number", 0.0)
    name: str | None = key("text", None)
    direction: str = key("text", "both", choices=("both", "up", "down"))
    stop: bool = key("flag", False, doc="the motion ends there")


nest("events", Nested("event", {"": Watched}, "events = [{...}]", several=True))


@dataclass(frozen=True)
class Task(Value):
    """Base of all tasks.

    ``holds`` says what can be drawn of its result: poses, a path through them, their rates, a
    grid of parameters, designs, small motions.
    """

    kind: ClassVar[str] = ""
    available: ClassVar[bool] = False
    holds: ClassVar[tuple[str, ...]] = ()

    @property
    def way(self) -> int:
        """How much of a way its poses are: 0 one pose, 1 few, 2 many by name, 3 an interval."""
        return 0

    @classmethod
    def bare_mechanism(cls) -> Any:
        """Return the mechanism of files that hold only such tasks, None where one is needed."""
        return None


@dataclass(frozen=True)
class Driven(Task):
    """A task with one driver or several."""

    driver: Driver | None = key("driver", None)
    drivers: tuple[Driver, ...] | None = key("drivers", None)
    outputs: tuple[str, ...] | None = key("names", None)
    mode: str | None = key("text", None, doc="start on this assembly mode")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.driver is None and self.drivers is None:
            raise InputError("the key 'driver' is missing (or 'drivers', for several)")
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
        return tuple(driver for driver, told in timed if told == (None, None, None))

    @property
    def way(self) -> int:
        moving = [own for own in self.all_drivers if own.at is None or len(own.at) > 1]
        named = [len(own) for d in moving for own in (d.at, d.times) if own is not None]
        if not named:
            return 3 if moving else 0
        return 2 if max(named) >= MANY else 1


@dataclass(frozen=True)
class Sweep(Driven):
    """Positions, velocities and accelerations along the driver."""

    poses: int | None = key("whole", None)
    derivatives: int = key("natural", 2)
    on_change_point: str = key("text", "continue", choices=("continue", "stop", "switch"))
    measures: tuple[str, ...] | None = key("names", None, choices=MEASURES)
    dwell_tolerance: Number = key("number", 0.01, doc="share of the swing or stroke")

    kind: ClassVar[str] = "sweep"
    available: ClassVar[bool] = True
    holds: ClassVar[tuple[str, ...]] = ("poses", "path", "rates")


@dataclass(frozen=True)
class Modes(Driven):
    """All assembly modes at one pose of the driver."""

    limit: int | None = key("whole", None)

    kind: ClassVar[str] = "modes"
    available: ClassVar[bool] = True
    holds: ClassVar[tuple[str, ...]] = ("poses",)


@dataclass(frozen=True)
class Reactions(Sweep):
    """Joint reactions, friction losses and efforts along a sweep.

    ``friction`` "coupled" lets friction act on the reactions it comes from, "article" leaves
    them as they are without it, "none" leaves it out. ``direction`` "load" turns resistances
    round, so that they push along the motion and the driver takes the power out.
    """

    friction: str = key("text", "coupled", choices=("none", "article", "coupled"))
    friction_radius: str = key(
        "text", "exact", choices=("exact", "article"), doc="r sin(atan f), or r f"
    )
    cycle: bool = key("flag", False, doc="mean powers and efficiency over the sweep")
    direction: str = key("text", "driver", choices=("driver", "load", "both"))
    parts: tuple[str, ...] | None = key("names", None, choices=("static", "inertial"))
    axes: tuple[str, ...] | None = key("names", None, choices=("body", "radial"))

    kind: ClassVar[str] = "reactions"
    available: ClassVar[bool] = True
    holds: ClassVar[tuple[str, ...]] = ("poses", "path", "rates")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.untimed and not self.quasi_static:
            names = ", ".join(driver.coordinate for driver in self.untimed)
            raise InputError(
                f"no speed of {names} is given, and forces depend on it",
                where="driver" if self.drivers is None else "drivers",
                hint="speed = 0 for a driver that rests; without any speed forces are quasi-static",
            )
        if self.quasi_static and "inertial" in (self.parts or ()):
            raise InputError(
                "inertial parts are asked for and no driver has a speed",
                where="parts",
                hint='driver.speed = ..., or parts = ["static"]',
            )

    @property
    def quasi_static(self) -> bool:
        """Whether no driver is told how fast it moves: forces are the limit of slow motion."""
        return bool(self.untimed) and not any(
            driver.timed and not driver.rests for driver in self.all_drivers
        )


@dataclass(frozen=True)
class Motion(Task):
    """Motion under forces, from t = 0.

    ``start`` and ``start_speed`` hold values of coordinates, what they leave open is taken from
    the sketch and moves as little as it can; ``drivers`` follow laws of time or are held. The
    motion is given at the times ``at``, at ``poses`` equal intervals, or at its own steps.
    ``friction`` "event" (the default) slides and sticks, "smooth" creeps: friction grows like
    tanh(speed / v_s), omega_s for turning pairs; "none" leaves friction in joints out. ``method``
    "bdf" and "radau" are for stiff forces, "auto" turns to "bdf" where they are.
    """

    start: Table[Number] | None = key("start", None, doc="coordinate -> value")
    start_speed: Table[Number] | None = key("start", None, doc="coordinate -> speed")
    drivers: tuple[Driver, ...] | None = key("drivers", None)
    until: Number | None = key("number", None, doc="end [s]")
    at: tuple[Number, ...] | None = key("numbers", None, doc="times of output [s]")
    poses: int | None = key("whole", None, doc="outputs at equal intervals")
    tolerance: Number | None = key("number", None, doc="relative error of a step, 1e-9")
    max_step: Number | None = key("number", None, doc="longest step [s]")
    method: str | None = key("text", None, choices=("explicit", "bdf", "radau", "auto"))
    friction: str | None = key("text", None, choices=("event", "smooth", "none"))
    v_s: Number | None = key("number", None, doc="slope speed of smooth friction [m/s]")
    omega_s: Number | None = key("number", None, doc="the same of pairs that turn [rad/s]")
    events: tuple[Watched, ...] | None = key("events", None)
    outputs: tuple[str, ...] | None = key("names", None)
    linearise: Number | None = key("number", None, doc="time of the linear system A, B, C, D [s]")
    inputs: tuple[str, ...] | None = key("names", None, doc="inputs of the linear system")

    kind: ClassVar[str] = "motion"
    available: ClassVar[bool] = True
    holds: ClassVar[tuple[str, ...]] = ("poses", "path")

    @property
    def way(self) -> int:
        return 3


@dataclass(frozen=True)
class Equilibrium(Task):
    """Static pose under loads, and small motions around it.

    It lies on the assembly mode of the sketch, with the coordinates of ``start`` put to their
    values first, or on the ``mode`` asked for there. ``drivers`` hold coordinates; ``free`` names
    as many independent coordinates as there are freedoms, in which modes and small motions
    are told.
    """

    free: tuple[str, ...] | None = key("names", None)
    start: Table[Number] | None = key("start", None, doc="coordinate -> value near the pose")
    drivers: tuple[Driver, ...] | None = key("drivers", None)
    friction: str | None = key("text", None, choices=("none",))
    mode: str | None = key("text", None, doc="on this assembly mode of the free coordinates")
    linearise: bool = key("flag", False, doc="frequencies, damping, shapes; A, B, C, D")
    inputs: tuple[str, ...] | None = key("names", None, doc="inputs of the linear system")
    outputs: tuple[str, ...] | None = key("names", None)

    kind: ClassVar[str] = "equilibrium"
    available: ClassVar[bool] = True
    holds: ClassVar[tuple[str, ...]] = ("poses", "small motions")


@dataclass(frozen=True)
class Synthesis(Task):
    """Dimensions that do what is asked for."""

    driver: Turned | None = key("turned", None)
    goal: GoalDescription | None = key("goal", None)
    goals: tuple[GoalDescription, ...] | None = key("goals", None)
    objectives: tuple[GoalDescription, ...] | None = key(
        "objectives", None, doc="two or three goals whose best compromises are sought, a front"
    )
    reference: tuple[Number, ...] | None = key(
        "numbers", None, doc="worst value of each objective that a front is measured from"
    )
    free: Table[Any] | None = key(
        "freedoms", None, doc="name -> [low, high], { ratios }, or { point, polygon or disc }"
    )
    constraints: tuple[Constraint, ...] | None = key("constraints", None)
    starts: int | None = key("whole", None)
    seed: int | None = key("natural", None)
    keep: int | None = key("whole", None, doc="designs that are reported, 5; of a front points, 12")
    robust: Number | None = key(
        "number", None, unit="1", doc="standard deviations by tolerances added to what is least"
    )
    tolerances: Mapping[str, Number] | None = key("coordinates", None, doc="name -> half width")

    kind: ClassVar[str] = "synthesis"
    available: ClassVar[bool] = True
    holds: ClassVar[tuple[str, ...]] = ("designs",)


@dataclass(frozen=True)
class Study(Task):
    """A task over a grid of parameters (``vary``) or over sets of them (``samples``)."""

    vary: Mapping[str, Sequence[Number]] | None = key(
        "grid", None, doc="name -> [from, to, count]; all combinations"
    )
    samples: Mapping[str, Sequence[Number]] | None = key(
        "lists", None, doc="name -> [values], as many for each name"
    )
    of: str | None = key("text", None, doc="the sweep, motion or equilibrium repeated")
    outputs: tuple[str, ...] | None = key("names", None, doc="paths below that task in the JSON")
    certify: bool = key("flag", True, doc="false: dyads in closed form, without certificates")

    kind: ClassVar[str] = "study"
    available: ClassVar[bool] = True
    holds: ClassVar[tuple[str, ...]] = ("grid",)

    @classmethod
    def from_table(cls, table: Mapping[str, Any]) -> Mapping[str, Any]:
        if not isinstance(table.get("vary"), Mapping):
            return table
        vary: dict[str, Any] = {}
        for entry, items in table["vary"].items():
            base, suffix = split_unit(entry)
            if not isinstance(items, list) or len(items) != 3:
                raise InputError("[from, to, count] is needed", where=f"vary.{entry}")
            if base in vary:
                raise InputError(f"'{base}' is given twice, with and without a unit", where="vary")
            vary[base] = [*to_si(items[:2], suffix), items[2]]  # a count has no unit
        return {**table, "vary": vary}


@dataclass(frozen=True)
class Sensitivity(Task):
    """Derivatives of outputs with respect to parameters, and what tolerances do to them."""

    of: str | None = key("text", None, doc="the sweep, reactions, motion or equilibrium task")
    outputs: tuple[str, ...] | None = key("names", None, doc="paths below that task in the JSON")
    wrt: tuple[str, ...] | None = key("names", None, doc="parameters and automatic names")
    order: int = key("whole", 1, doc="1, or 2 for second derivatives too")
    tolerances: Mapping[str, Number] | None = key("coordinates", None, doc="name -> half width")

    kind: ClassVar[str] = "sensitivity"
    available: ClassVar[bool] = True


_PLAIN = (Sweep, Modes, Reactions, Motion, Equilibrium, Synthesis, Study, Sensitivity)
TASKS: Registry[type[Task]] = Registry("tasks", {task.kind: task for task in _PLAIN})
"""Kind of task -> its class, those of parts too."""
