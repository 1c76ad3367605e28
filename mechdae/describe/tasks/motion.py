"""Tasks of forces: reactions along a sweep, motions and equilibria, starts, laws, events."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar

from mechdae.describe.coordinates import (
    RATES,
    NamedCoordinate,
    coordinate,
    named_coordinate,
    selection,
    split_rate,
)
from mechdae.describe.expression import evaluate, names_in, unknown_name
from mechdae.describe.file.reading import Nested, nest
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.named import check_expression
from mechdae.describe.tasks.kinds import Driver, Sweep, Task
from mechdae.describe.values import Number, Value
from mechdae.errors import InputError, MechdaeError
from mechdae.records import dataclass, key, optional

if TYPE_CHECKING:
    from mechdae.describe.tasks.kinds import Drivers
    from mechdae.describe.values import (
        KeyUnit,
        NamesOrNone,
        NumbersOrNone,
        NumberTableOrNone,
        UnitOf,
    )
    from mechdae.records import Takes


@dataclass(frozen=True)
class Watched(Value):
    """An expression of coordinates, speeds and ``t`` crosses a value, in a motion.

    With ``stop`` the motion ends there. ``name`` is that of the expression where it has no other.
    """

    coordinate: str = key("text", doc="a coordinate, a speed, a named output")
    crosses: Number = optional("number", 0.0)
    name: str | None = optional("text", doc="of the event; absent: the coordinate")
    direction: str = optional("text", "both", choices=("both", "up", "down"))
    stop: bool = optional("flag", False, doc="the motion ends there")

    def units_by_key(self, unit_of: UnitOf) -> dict[str, str | None]:
        return {"crosses": unit_of(self.coordinate)}


nest("events", Nested("event", {"": Watched}, "events = [{...}]", several=True))


@dataclass(frozen=True)
class Motion(Task):
    """Motion under forces, from t = 0.

    What ``start`` and ``start_speed`` leave open is taken from the sketch and moves as little as it
    can; ``drivers`` follow laws of time or are held. The motion is given at the times ``at``, at
    ``poses`` equal intervals, or at its own steps. Smooth friction grows like tanh(speed / v_s).

    Examples
    --------
    >>> task = md.Motion(start={"rod.angle": -1.5}, until=1.0, poses=3)
    >>> md.solve(md.load("pendulum"), task).bodies["rod"].angle.round(3).tolist()
    [-1.5, -1.57, -1.642]
    """

    start: NumberTableOrNone = optional("start", doc="coordinate -> value; absent: the sketch")
    start_speed: NumberTableOrNone = optional("start", doc="coordinate -> speed; absent: at rest")
    drivers: Drivers = optional("drivers")
    until: Number | None = optional("number", doc="time of the end", unit="s")
    at: NumbersOrNone = optional("numbers", doc="times of output", unit="s")
    poses: int | None = optional("whole", doc="outputs at equal intervals")
    tolerance: Number | None = optional("number", doc="relative error of a step, 1e-9")
    max_step: Number | None = optional("number", doc="longest step", unit="s")
    method: str | None = optional(
        "text",
        choices=("explicit", "bdf", "radau", "auto"),
        doc="bdf and radau: of stiff forces",
    )
    friction: str | None = optional(
        "text", choices=("event", "smooth", "none"), doc="slides and sticks, creeps, or is left out"
    )
    clearance: str | None = optional(
        "text", choices=("contact",), doc="joints with a gap and a restitution move in their gaps"
    )
    impact: str | None = optional(
        "text", choices=("newton", "poisson"), doc="law of joints that hit their stops"
    )
    v_s: Number | None = optional("number", doc="slope speed of smooth friction", unit="m/s")
    omega_s: Number | None = optional("number", doc="the same of pairs that turn", unit="rad/s")
    events: Takes[Sequence[Watched] | None, tuple[Watched, ...] | None] = optional(
        "events", doc="crossings: coordinate, crosses, name, direction, stop"
    )
    outputs: NamesOrNone = optional("names")
    linearise: Number | None = optional(
        "number", doc="time of the linear system A, B, C, D", unit="s"
    )
    inputs: NamesOrNone = optional("names", doc="inputs of the linear system")

    kind: ClassVar[str] = "motion"
    holds: ClassVar[tuple[str, ...]] = ("poses", "path")

    @property
    def way(self) -> int:
        return 3

    def units_by_key(self, unit_of: UnitOf) -> dict[str, KeyUnit]:
        speeds = {n: unit_of(f"{n.removesuffix('.speed')}.speed") for n in self.start_speed or ()}
        return {"start": {name: unit_of(name) for name in self.start or ()}, "start_speed": speeds}

    def check(self, mechanism: Mechanism) -> None:
        selection(mechanism, self.outputs, forces=True)
        start_values(mechanism, self.start, "start")
        start_values(mechanism, self.start_speed, "start_speed")
        crossings(mechanism, self)
        known = mechanism.parameter_values
        _check_drivers(mechanism, self, known)
        if self.until is None and self.at is None:
            raise InputError(
                "'until' is missing, the end of the motion", hint="or times: at = [...]"
            )
        if self.poses is not None and (self.until is None or self.at is not None):
            raise InputError("equal intervals need 'until', and no times 'at'", where="poses")
        for word in ("v_s", "omega_s"):
            if getattr(self, word) is not None and self.friction != "smooth":
                raise InputError(f"'{word}' belongs to friction = \"smooth\"", where=word)
        if self.clearance is not None:
            _check_gaps(mechanism)
        keys = ("until", "tolerance", "max_step", "v_s", "omega_s")
        numbers = [(word, getattr(self, word)) for word in keys]
        for word, number in [*numbers, *(("at", time) for time in self.at or ())]:
            unknown_name([number], known, place=word)


@dataclass(frozen=True)
class Equilibrium(Task):
    """Static pose under loads, and small motions around it.

    It lies on the assembly mode of the sketch, with the coordinates of ``start`` put to their
    values first, or on the ``mode`` that is given. ``drivers`` hold coordinates; modes and small
    motions are in the coordinates ``free``.

    Examples
    --------
    >>> task = md.Equilibrium(free=["rod.angle"], start={"rod.angle": -1.5})
    >>> md.solve(md.load("pendulum"), task).bodies["rod"].angle.round(3).tolist()
    [-1.571]
    """

    free: NamesOrNone = optional("names", doc="independent coordinates, as many as freedoms")
    start: NumberTableOrNone = optional("start", doc="coordinate -> value near the pose")
    drivers: Drivers = optional("drivers")
    friction: str | None = optional("text", choices=("none",), doc="left out")
    mode: str | None = optional("text")
    linearise: bool = optional("flag", False, doc="frequencies, damping, shapes; A, B, C, D")
    inputs: NamesOrNone = optional("names", doc="inputs of the linear system")
    outputs: NamesOrNone = optional("names")

    kind: ClassVar[str] = "equilibrium"
    holds: ClassVar[tuple[str, ...]] = ("poses", "small motions")
    on_mode: ClassVar[bool] = True

    def units_by_key(self, unit_of: UnitOf) -> dict[str, KeyUnit]:
        return {"start": {name: unit_of(name) for name in self.start or ()}}

    def check(self, mechanism: Mechanism) -> None:
        selection(mechanism, self.outputs, forces=True)
        start_values(mechanism, self.start, "start")
        for i, name in enumerate(self.free or ()):
            try:
                named_coordinate(mechanism, name)
            except MechdaeError as problem:
                raise problem.inside(f"free[{i}]") from None
        _check_drivers(mechanism, self, mechanism.parameter_values)
        for i, driver in enumerate(self.drivers or ()):
            if driver.law is not None or driver.table is not None:
                word = "law" if driver.law is not None else "table"
                raise InputError(
                    "an equilibrium has no time", where=f"drivers[{i}].{word}", hint="at = [value]"
                )


def _check_gaps(mechanism: Mechanism) -> None:
    """Raise where no joint has a gap to move in."""
    from mechdae.describe.joints.limits import in_gaps, with_gaps

    values = mechanism.values()
    ideal = with_gaps(mechanism.joints, values)
    if not in_gaps(mechanism.joints, values):
        text = f"joint {ideal[0]} has a gap but no restitution" if ideal else "no joint has a gap"
        raise InputError(
            f"{text}: nothing moves in a gap", where="clearance",
            hint="clearance or backlash, and a restitution, of a joint",
        )  # fmt: skip


def start_values(
    mechanism: Mechanism, table: Mapping[str, Number] | None, key: str
) -> dict[NamedCoordinate, float]:
    """Return the numbers of a start by coordinate.

    Raises
    ------
    InputError, UnknownName
        With the key path.
    """
    known = mechanism.parameter_values
    result: dict[NamedCoordinate, float] = {}
    for name, value in (table or {}).items():
        try:
            base = name.removesuffix(RATES[0]) if key == "start_speed" else name
            c = named_coordinate(mechanism, base)
            if c in result:
                raise InputError("the coordinate is given twice")
            unknown_name([value], known)
            result[c] = evaluate(value, known)
        except MechdaeError as problem:
            raise problem.inside(f"{key}.{name}") from None
    return result


def crossings(mechanism: Mechanism, task: Motion) -> list[Watched]:
    """Return the events of a task, each with its name and an expression of coordinates.

    Raises
    ------
    InputError, UnknownName
        With the key path.
    """
    result = []
    for i, event in enumerate(task.events or ()):
        try:
            text = event.coordinate
            if text in mechanism.bodies or text in mechanism.joints:
                text = named_coordinate(mechanism, text).text
            check_expression(mechanism, text, "coordinate")
            if any(split_rate(used)[1] > 1 for used in names_in(text)):
                raise InputError("events do not depend on accelerations", where="coordinate")
            plain = event.evaluated(mechanism.parameter_values)
            result.append(replace(plain, coordinate=text, name=event.name or text))
        except MechdaeError as problem:
            raise problem.inside(f"events[{i}]") from None
    return result


def _check_drivers(
    mechanism: Mechanism, task: Motion | Equilibrium, known: Mapping[str, float]
) -> None:
    """Raise for drivers that neither follow a law of time nor are held."""
    driven = []
    for i, driver in enumerate(task.drivers or ()):
        try:
            driven.append(coordinate(mechanism, driver.coordinate).text)
            _check_timed(driver)
            for word in ("factor", "shift", "period"):
                unknown_name([getattr(driver.table, word, None)], known, place=f"table.{word}")
            for rate in ("speed", "acceleration", "jerk", "direction"):
                if getattr(driver, rate) is not None:
                    raise InputError("it follows from the law", where=rate)
            unknown_name([driver.law], [*known, "t"], "name", "law")
        except MechdaeError as problem:
            raise problem.inside(f"drivers[{i}]") from None
    if len(set(driven)) < len(driven):
        raise InputError("two drivers impose the same coordinate", where="drivers")


def _check_timed(driver: Driver) -> None:
    """Raise for a driver that is neither held nor follows one law of time alone."""
    timed = driver.law is not None or driver.table is not None
    if not timed and (driver.at is None or len(driver.at) != 1):
        raise InputError(
            "a driver of a motion follows a law of time or is held",
            hint='law = "..." of t, table = { file = "law.csv" }, or at = [value]',
        )
    if driver.law is not None and driver.table is not None:
        raise InputError("a driver has a law or a table, not both", where="table")
    ways = [way for way in ("at", "from_", "to", "range", "times") if getattr(driver, way)]
    if timed and ways:
        raise InputError(f"a law of a motion needs no '{ways[0].rstrip('_')}'")


@dataclass(frozen=True)
class Reactions(Sweep):
    """Joint reactions, friction losses and efforts along a sweep.

    Examples
    --------
    >>> result = md.solve("slider-crank-friction", "cycle", poses=5)
    >>> result.efforts["crank.angle"].round(2).tolist()
    [4.32, 108.43, 3.32, 21.66, 0.86]
    """

    friction: str = optional(
        "text", "coupled", choices=("none", "article", "coupled"),
        doc="left out, or on reactions as they are without it, or with it",
    )  # fmt: skip
    friction_radius: str = optional(
        "text",
        "exact",
        choices=("exact", "article"),
        doc="r sin(atan f), or r f",
    )
    cycle: bool = optional("flag", False, doc="mean powers and efficiency over the sweep")
    direction: str = optional(
        "text",
        "driver",
        choices=("driver", "load", "both"),
        doc="load: resistances push",
    )
    parts: NamesOrNone = optional(
        "names", choices=("static", "inertial"), doc="efforts that are given apart too"
    )
    axes: NamesOrNone = optional(
        "names", choices=("body", "radial"), doc="further axes that reactions are given in"
    )

    kind: ClassVar[str] = "reactions"
    holds: ClassVar[tuple[str, ...]] = ("poses", "path", "rates")
    forces: ClassVar[bool] = True

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
