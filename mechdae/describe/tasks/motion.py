"""What a task of motion names: starts, laws of time, events; checks that need the mechanism."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from mechdae.describe.coordinates import (
    NamedCoordinate,
    coordinate,
    selection,
)
from mechdae.describe.expression import evaluate, names_in
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.named import RATES, check_expression, split_rate, unknown_name
from mechdae.describe.tasks.kinds import Driver, Equilibrium, Motion, Watched
from mechdae.describe.values import Number
from mechdae.errors import InputError, MechdaeError


def named_coordinate(mechanism: Mechanism, name: str) -> NamedCoordinate:
    """Return the coordinate of that name; a body stands for its angle, a joint for its slide."""
    if name in mechanism.bodies:
        name = f"{name}.angle"
    elif name in mechanism.joints:
        name = f"{name}.{mechanism.joints[name].usual}"
    return coordinate(mechanism, name)


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


def check_motion(mechanism: Mechanism, task: Motion) -> None:
    """Raise for names and keys of a task of motion that mean nothing."""
    selection(mechanism, task.outputs, forces=True)
    start_values(mechanism, task.start, "start")
    start_values(mechanism, task.start_speed, "start_speed")
    crossings(mechanism, task)
    known = mechanism.parameter_values
    _check_drivers(mechanism, task, known)
    if task.until is None and task.at is None:
        raise InputError("'until' is missing, the end of the motion", hint="or times: at = [...]")
    if task.poses is not None and (task.until is None or task.at is not None):
        raise InputError("equal intervals need 'until', and no times 'at'", where="poses")
    for key in ("v_s", "omega_s"):
        if getattr(task, key) is not None and task.friction != "smooth":
            raise InputError(f"'{key}' belongs to friction = \"smooth\"", where=key)
    keys = ("until", "tolerance", "max_step", "v_s", "omega_s")
    numbers = [(key, getattr(task, key)) for key in keys]
    for key, number in [*numbers, *(("at", time) for time in task.at or ())]:
        unknown_name([number], known, place=key)


def check_equilibrium(mechanism: Mechanism, task: Equilibrium) -> None:
    """Raise for names and keys of a task of equilibrium that mean nothing."""
    selection(mechanism, task.outputs, forces=True)
    start_values(mechanism, task.start, "start")
    for i, name in enumerate(task.free or ()):
        try:
            named_coordinate(mechanism, name)
        except MechdaeError as problem:
            raise problem.inside(f"free[{i}]") from None
    _check_drivers(mechanism, task, mechanism.parameter_values)
    for i, driver in enumerate(task.drivers or ()):
        if driver.law is not None or driver.table is not None:
            word = "law" if driver.law is not None else "table"
            raise InputError(
                "an equilibrium has no time", where=f"drivers[{i}].{word}", hint="at = [value]"
            )


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
            for key in ("speed", "acceleration", "jerk", "direction"):
                if getattr(driver, key) is not None:
                    raise InputError("it follows from the law", where=key)
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
