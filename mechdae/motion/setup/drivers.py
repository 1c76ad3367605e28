"""The drivers of a task as numbers: values, path, speeds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from mechdae.additions import of_cases
from mechdae.describe.coordinate_names import coordinate_names
from mechdae.describe.coordinates import NamedCoordinate, coordinate, named_coordinate
from mechdae.describe.drawn import drawn_value
from mechdae.describe.expression import evaluate
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.tasks.kinds import DEFAULT_POSES, Driven, Driver, Sweep
from mechdae.errors import InputError, MechdaeError, UnknownName
from mechdae.kernels.graphs.driver_curve import DriverCurve
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats

MAX_POSES = 2_000_000
DECIMALS, DECIMALS_OF_DRIVERS = 3, 9
"""Decimals of the degrees in a sketch that is offered: near a limit position a driver needs all."""
SAMPLES = 1025
"""Places at which corners of a law are looked for, beside the poses."""


@dataclass(frozen=True)
class Timing:
    """The poses of a task whose drivers follow laws of time.

    ``values``, ``speed``, ``acceleration`` and ``jerk`` are (n, nd); rates that differ on the
    two sides of a corner are nan, and a jerk that is not finite. ``corners`` (k,) are the times
    between the poses at which a law has one; ``rough`` tells the poses with a speed or an
    acceleration that is nan.
    """

    course: DriverCurve
    times: Floats
    values: Any
    speed: Floats
    acceleration: Floats
    jerk: Floats
    corners: Floats
    rough: Booleans

    @property
    def dense(self) -> Floats:
        """Times (k,) close enough to see how fast the laws move."""
        return np.linspace(self.times.min(), self.times.max(), SAMPLES)


@dataclass(frozen=True)
class DriverPlan:
    """Driver values of a task.

    ``values`` is (n, nd), None for the whole assembled arc; ``named`` tells that the file
    names each pose (``at``, or a law at given times); ``sketch`` is the drivers' values in
    the sketch, nan without. ``speed``, ``acceleration`` and ``jerk`` are (1, nd), or (n, nd)
    by a law.

    ``course`` is the curve of the drivers where they follow laws of time, or where one
    moves and others are held: ``moving`` is the place of that one. Without it, several
    drivers move along straight lines in their values. ``timing`` is that of laws, ``lead`` the
    first driver that is not held.
    """

    coordinates: tuple[NamedCoordinate, ...]
    values: Any
    poses: int
    named: bool
    speed: Floats
    acceleration: Floats
    jerk: Floats
    sketch: Floats
    course: DriverCurve | None = None
    moving: int | None = None
    held: Any = None
    timing: Timing | None = None
    lead: int = 0

    @property
    def assembled(self) -> bool:
        return self.values is None

    @property
    def by_value(self) -> bool:
        """Whether one driver moves, and is not moved by a law: its value tells the pose."""
        return self.timing is None and (len(self.coordinates) == 1 or self.moving is not None)

    @property
    def first(self) -> Any:
        """The drivers' values (nd,) at the first pose; nan where they are to be found."""
        return self.values[0] if self.values is not None else self.held

    def time_of(self, values: Floats | None = None) -> Any:
        """Return the time of each pose (n,), None for a task that has none.

        Laws give the times; where one driver moves with constant speed it is the time since the
        first of `values` (n, nd). Without `values` only the answer None means something.
        """
        if self.timing is not None:
            return self.timing.times
        k = self.lead
        steady = not (self.acceleration.any() or self.jerk.any()) and self.speed[:, k].all()
        if not (self.by_value and steady):
            return None
        return np.zeros(0) if values is None else (values[:, k] - values[0, k]) / self.speed[0, k]


def plan(mechanism: Mechanism, task: Driven) -> DriverPlan:
    """Return the plan of a task.

    Raises
    ------
    InputError
        Numbers of poses that do not fit each other, or more than `MAX_POSES`.
    """
    known = mechanism.parameter_values
    drivers = task.all_drivers
    coordinates = tuple(coordinate(mechanism, driver.coordinate) for driver in drivers)
    sketch = np.array([_driver_in_sketch(mechanism, c, known) for c in coordinates])
    try:
        moving = [k for k, driver in enumerate(drivers) if driver.at is None or len(driver.at) > 1]
        by_law = any(driver.law is not None for driver in drivers)
        if by_law and any(drivers[k].law is None for k in moving):
            raise InputError(
                "beside a law of time a driver is held or follows a law too",
                hint='at = [value] holds it, law = "..." moves it',
            )
        poses = _pose_count(task, [drivers[k] for k in moving] or list(drivers))
        for k, driver in enumerate(drivers):
            if moving and k not in moving:
                _check_held(driver, known)
        if by_law:
            for make in of_cases("driver plans", {"laws"}):
                found: DriverPlan = make(coordinates, drivers, moving, poses, known, sketch)
                return found
        if len(moving) > 1 and any(driver.range is not None for driver in drivers):
            raise InputError(
                'range = "assembled" needs a single driver that moves',
                hint="hold the others: at = [value]",
            )
        laws = [
            _moved(driver, poses, known, not moving or k in moving)
            for k, driver in enumerate(drivers)
        ]
        speed, acceleration, jerk = (np.array([[w[k] for w in laws]]) for k in (1, 2, 3))
        columns = [law[0] for law in laws]
    except MechdaeError as problem:
        raise problem.inside("driver") from None
    whole = any(driver.range is not None for driver in drivers)
    values = None if whole else np.stack(np.broadcast_arrays(*columns), axis=1)
    named = any(drivers[k].at is not None for k in moving or range(len(drivers)))
    lead = moving[0] if moving else 0
    rates = (speed, acceleration, jerk)
    numbers = DriverPlan(coordinates, values, poses, named, *rates, sketch, lead=lead)
    if len(moving) == 1:
        k = moving[0]
        held = np.array([np.nan if j == k else column[0] for j, column in enumerate(columns)])
        numbers = replace(numbers, held=held)
        if len(drivers) > 1:
            s = ca.SX.sym("s")
            u = ca.vertcat(*[s if j == k else value for j, value in enumerate(held.tolist())])
            numbers = replace(numbers, moving=k, course=DriverCurve(s, u, coordinates[k].is_angle))
    return numbers


def placed(task: Sweep, numbers: DriverPlan) -> Sweep:
    """Return the task at one value of each driver: that of the sketch, else the first one.

    Drivers that follow laws of time have no speed; the others keep theirs.
    """
    first = numbers.first if numbers.first is not None else np.full(len(numbers.sketch), np.nan)
    begin = np.where(np.isnan(numbers.sketch), first, numbers.sketch)
    drivers = []
    for driver, value in zip(task.all_drivers, begin.tolist(), strict=True):
        at = None if math.isnan(value) else (value,)
        speed = 0.0 if driver.law is not None else driver.speed
        drivers.append(
            replace(
                driver, at=at, from_=None, to=None, range=None, law=None, times=None, table=None,
                speed=speed,
            )
        )  # fmt: skip
    return replace(task, drivers=tuple(drivers), driver=None, poses=None, measures=None)


def _pose_count(task: Driven, drivers: Sequence[Driver]) -> int:
    """Return the number of poses that the drivers that move ask for."""
    counts = {
        len(listed)
        for driver in drivers
        for listed in (driver.at, driver.times)
        if listed is not None
    }
    poses = task.poses if isinstance(task, Sweep) else None
    if len(counts) > 1:
        raise InputError(f"drivers name different numbers of poses: {sorted(counts)}")
    if counts:
        return counts.pop()
    count = poses if poses is not None else DEFAULT_POSES
    if count > MAX_POSES:
        raise InputError(f"{count} poses, at most {MAX_POSES} are computed at once")
    return count


def _check_held(driver: Driver, known: Mapping[str, float]) -> None:
    for key in ("speed", "acceleration", "jerk"):
        rate = getattr(driver, key)
        if rate is not None and evaluate(rate, known) != 0:
            raise InputError(
                f"{driver.coordinate} has one value and is held while others move", where=key
            )


def _moved(
    driver: Driver, poses: int, known: Mapping[str, float], moves: bool
) -> tuple[Floats, float, float, float]:
    """Return values (n,), speed, acceleration and jerk of one driver."""
    held = driver.speed is None and not moves
    speed = 0.0 if held else evaluate(driver.usual_speed, known)
    acceleration = evaluate(driver.acceleration if driver.acceleration is not None else 0.0, known)
    jerk = evaluate(driver.jerk if driver.jerk is not None else 0.0, known)
    values = np.zeros(0) if driver.range is not None else _values(driver, poses, known)
    return values, speed, acceleration, jerk


def _values(driver: Driver, poses: int, known: Mapping[str, float]) -> Floats:
    if driver.at is not None:
        return np.array([evaluate(value, known) for value in driver.at])
    assert driver.from_ is not None
    assert driver.to is not None
    return interval(evaluate(driver.from_, known), evaluate(driver.to, known), poses)


def interval(first: float, last: float, count: int) -> Floats:
    """Return `count` equally spaced values, both ends exact."""
    if count == 1:
        return np.array([first])
    if first == last:
        raise InputError("'from' and 'to' are the same value", hint="use 'at' for a single pose")
    grid = first + (last - first) * (np.arange(count) / (count - 1))
    grid[-1] = last
    return grid


def _driver_in_sketch(
    mechanism: Mechanism, c: NamedCoordinate, known: Mapping[str, float]
) -> float:
    for name in (c.text, c.part if c.kind != "point" else c.text):
        if name in mechanism.sketch:
            return evaluate(mechanism.sketch[name], known)
    if mechanism.frames is None:
        return float("nan")
    part, *words = c.text.split(".")
    return drawn_value(mechanism.joints, mechanism.values(), part, words)


@dataclass(frozen=True)
class Sketch:
    """A rough pose: angles by body [rad], other coordinates with their values [m, rad]."""

    angles: dict[str, float]
    places: dict[NamedCoordinate, float]

    def coordinates(self, mechanism: Mechanism) -> dict[NamedCoordinate, float]:
        """Return all of it by coordinate."""
        angles = {coordinate(mechanism, f"{body}.angle"): v for body, v in self.angles.items()}
        return angles | self.places


def sketched(mechanism: Mechanism) -> Sketch:
    """Return the sketch as numbers.

    Raises
    ------
    UnknownName
        A name that is neither a body nor a coordinate of the mechanism.
    """
    known = mechanism.parameter_values
    angles: dict[str, float] = {}
    places: dict[NamedCoordinate, float] = {}
    for name, number in mechanism.sketch.items():
        try:
            value = evaluate(number, known)
            found = named_coordinate(mechanism, name)
            if found.kind == "body angle":
                angles[found.part] = value
            else:
                places[found] = value
        except MechdaeError as problem:
            if isinstance(problem, UnknownName) and problem.what.startswith("unknown coordinate"):
                said = problem.hint if name in mechanism.bodies else ""
                names = [*mechanism.bodies, *mechanism.joints, *coordinate_names(mechanism)]
                problem = UnknownName("body, joint or coordinate", name, names)
                problem.hint = said or problem.hint
            raise problem.inside(f"sketch.{name}") from None
    return Sketch(angles, places)
