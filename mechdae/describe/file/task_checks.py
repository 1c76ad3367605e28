"""Checks of tasks that need the whole mechanism: what drivers name, what they give."""

from __future__ import annotations

from collections.abc import Mapping

from mechdae.describe.coordinates import coordinate, selection
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.named import unknown_name
from mechdae.describe.tasks.kinds import Driven, Driver, Equilibrium, Motion, Reactions, Task
from mechdae.describe.tasks.motion import check_equilibrium, check_motion
from mechdae.errors import InputError, MechanismError, MechdaeError


def check_task(mechanism: Mechanism, name: str, task: Task) -> None:
    """Raise for names and keys of a task that do not fit the mechanism."""
    try:
        if isinstance(task, Motion):
            check_motion(mechanism, task)
        elif isinstance(task, Equilibrium):
            check_equilibrium(mechanism, task)
        elif isinstance(task, Driven):
            _check_driven(mechanism, task)
    except MechdaeError as problem:
        raise problem.inside(f"tasks.{name}") from None


def _check_driven(mechanism: Mechanism, task: Driven) -> None:
    drivers = task.all_drivers
    coordinates = [coordinate(mechanism, driver.coordinate).text for driver in drivers]
    if len(set(coordinates)) < len(coordinates):
        raise MechanismError("two drivers impose the same coordinate", where="drivers")
    if task.available:
        selection(mechanism, task.outputs, forces=isinstance(task, Reactions))
    known = mechanism.parameter_values
    timed = any(d.times or d.from_ is not None for d in drivers if d.law is not None)
    for driver in drivers:
        _check_way(driver)
        _check_times(driver, timed)
        _check_names(driver, known)


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
