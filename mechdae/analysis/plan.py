"""The drivers of a task as numbers: values, path, speeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import CURVE_JOINTS, SLIDE_JOINTS, Coordinate, coordinate
from mechdae.describe.expression import build, evaluate
from mechdae.describe.mechanism import Mechanism, evaluate_all
from mechdae.describe.tasks import DEFAULT_POSES, Driven, Driver, Sweep
from mechdae.errors import InputError, MechdaeError
from mechdae.model.model import FUNCTIONS

MAX_POSES = 2_000_000


@dataclass(frozen=True)
class Plan:
    """Driver values of a task.

    ``values`` is (n, nd), None for the whole assembled arc; ``named`` tells that the file
    names each pose (``at``, or a law at given times); ``sketch`` is the drivers' values in
    the sketch, nan without. ``speed``, ``acceleration`` and ``jerk`` are (1, nd), or (n, nd)
    by a law.
    """

    coordinates: tuple[Coordinate, ...]
    values: Any
    poses: int
    named: bool
    speed: Any
    acceleration: Any
    jerk: Any
    sketch: Any

    @property
    def assembled(self) -> bool:
        return self.values is None


def plan(mechanism: Mechanism, task: Driven) -> Plan:
    """Return the plan of a task.

    Raises
    ------
    InputError
        Numbers of poses that do not fit each other, or more than `MAX_POSES`.
    """
    known = evaluate_all(mechanism.parameters)
    drivers = task.all_drivers
    coordinates = tuple(coordinate(mechanism, driver.coordinate) for driver in drivers)
    try:
        poses = _pose_count(task)
        assembled = [driver.range is not None for driver in drivers]
        if any(assembled) and len(drivers) > 1:
            raise InputError('range = "assembled" needs a single driver')
        laws = [_moved(driver, poses, known) for driver in drivers]
        columns = None if any(assembled) else [law[0] for law in laws]
        speed, acceleration, jerk = (
            np.stack(np.broadcast_arrays(*[law[order] for law in laws]), axis=1)
            for order in (1, 2, 3)
        )
    except MechdaeError as problem:
        raise problem.inside("driver") from None
    sketch = [_driver_in_sketch(mechanism, c, known) for c in coordinates]
    values = None if columns is None else np.stack(columns, axis=1)
    named = any(driver.at is not None or driver.law is not None for driver in drivers)
    return Plan(coordinates, values, poses, named, speed, acceleration, jerk, np.array(sketch))


def _pose_count(task: Driven) -> int:
    counts = {
        len(listed)
        for driver in task.all_drivers
        for listed in (driver.at, driver.times)
        if listed is not None
    }
    asked = task.poses if isinstance(task, Sweep) else None
    if len(counts) > 1:
        raise InputError(f"drivers name different numbers of poses: {sorted(counts)}")
    if counts:
        return counts.pop()
    count = asked if asked is not None else DEFAULT_POSES
    if count > MAX_POSES:
        raise InputError(f"{count} poses, at most {MAX_POSES} are computed at once")
    return count


def _moved(driver: Driver, poses: int, known: dict[str, float]) -> tuple[Any, Any, Any, Any]:
    """Return values (n,), speeds, accelerations and jerks (1,) or (n,) of one driver."""
    if driver.law is not None:
        return _law(driver, known)
    speed = evaluate(driver.speed if driver.speed is not None else 1.0, known)
    acceleration = evaluate(driver.acceleration if driver.acceleration is not None else 0.0, known)
    jerk = evaluate(driver.jerk if driver.jerk is not None else 0.0, known)
    values = np.zeros(0) if driver.range is not None else _values(driver, poses, known)
    return values, np.array([speed]), np.array([acceleration]), np.array([jerk])


def _law(driver: Driver, known: dict[str, float]) -> tuple[Any, Any, Any, Any]:
    """Return u(t), u'(t), u''(t), u'''(t) at the times of a law; the last one may be nan."""
    assert driver.law is not None
    if driver.times is None:
        raise InputError("'times' is missing: the law is evaluated there", where="times")
    for entry in ("speed", "acceleration", "jerk"):
        if getattr(driver, entry) is not None:
            raise InputError("a law of time gives its rates itself", where=entry)
    t = ca.SX.sym("t")
    u = ca.SX(build(driver.law, {**known, "t": t}, FUNCTIONS))
    first = ca.jacobian(u, t)
    second = ca.jacobian(first, t)
    function = ca.Function("law", [t], [u, first, second, ca.jacobian(second, t)])
    times = np.array([evaluate(value, known) for value in driver.times])
    rows = [[float(part) for part in function(time)] for time in times]
    values, speed, acceleration, jerk = np.array(rows).T
    if not np.all(np.isfinite([values, speed, acceleration])):
        raise InputError("the law has no finite value at some time", where="law")
    return values, speed, acceleration, np.where(np.isfinite(jerk), jerk, np.nan)


def _values(driver: Driver, poses: int, known: dict[str, float]) -> Any:
    if driver.at is not None:
        return np.array([evaluate(value, known) for value in driver.at])
    assert driver.from_ is not None
    assert driver.to is not None
    first, last = evaluate(driver.from_, known), evaluate(driver.to, known)
    if poses == 1:
        return np.array([first])
    if first == last:
        raise InputError("'from' and 'to' are the same value", hint="use 'at' for a single pose")
    grid = first + (last - first) * (np.arange(poses) / (poses - 1))
    grid[-1] = last
    return grid


def _driver_in_sketch(mechanism: Mechanism, c: Coordinate, known: dict[str, float]) -> float:
    for name in (c.text, c.part if c.kind != "point" else c.text):
        if name in mechanism.sketch:
            return evaluate(mechanism.sketch[name], known)
    return float("nan")


@dataclass(frozen=True)
class Sketch:
    """A rough pose: angles by body [rad], other coordinates with their values [m, rad]."""

    angles: dict[str, float]
    places: dict[Coordinate, float]


def sketched(mechanism: Mechanism) -> Sketch:
    """Return the sketch as numbers.

    Raises
    ------
    UnknownName
        A name that is neither a body nor a coordinate of the mechanism.
    """
    known = evaluate_all(mechanism.parameters)
    angles: dict[str, float] = {}
    places: dict[Coordinate, float] = {}
    for name, number in mechanism.sketch.items():
        try:
            value = evaluate(number, known)
            found = coordinate(mechanism, _coordinate_name(mechanism, name))
            if found.kind == "body angle":
                angles[found.part] = value
            else:
                places[found] = value
        except MechdaeError as problem:
            raise problem.inside(f"sketch.{name}") from None
    return Sketch(angles, places)


def _coordinate_name(mechanism: Mechanism, name: str) -> str:
    """Return the coordinate that a key of the sketch means: a body's angle, a joint's slide."""
    if name in mechanism.bodies:
        return f"{name}.angle"
    if name in mechanism.joints:
        kind = mechanism.joints[name].kind
        if kind in CURVE_JOINTS:
            return f"{name}.s"
        return f"{name}.slide" if kind in SLIDE_JOINTS else f"{name}.angle"
    return name
