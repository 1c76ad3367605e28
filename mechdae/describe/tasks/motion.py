"""What a task of motion names: starts, laws of time, events; checks that need the mechanism."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from mechdae.describe.coordinates import (
    NamedCoordinate,
    coordinate,
    selection,
)
from mechdae.describe.expression import evaluate, names_in
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.named import RATES, check_expression, split_rate
from mechdae.describe.tasks.kinds import Equilibrium, Motion
from mechdae.describe.values import number
from mechdae.errors import InputError, MechdaeError, UnknownName

EVENT_KEYS = ("coordinate", "crosses", "name", "direction", "stop")
DIRECTIONS = ("both", "up", "down")


@dataclass(frozen=True)
class Crossing:
    """An event: an expression of coordinates, speeds and t crosses a value.

    ``direction`` is "both", "up" or "down"; with ``stop`` the motion ends there.
    """

    name: str
    text: str
    value: float
    direction: str = "both"
    stop: bool = False


def named_coordinate(mechanism: Mechanism, name: str) -> NamedCoordinate:
    """Return the coordinate of that name; a body stands for its angle, a joint for its slide."""
    if name in mechanism.bodies:
        name = f"{name}.angle"
    elif name in mechanism.joints:
        name = f"{name}.{mechanism.joints[name].usual}"
    return coordinate(mechanism, name)


def start_values(mechanism: Mechanism, table: Any, key: str) -> dict[NamedCoordinate, float]:
    """Return the numbers of a start by coordinate; dotted keys may be nested tables.

    Raises
    ------
    InputError, UnknownName
        With the key path.
    """
    if table is None:
        return {}
    if not isinstance(table, Mapping):
        raise InputError("a table coordinate = value is needed", where=key)
    known = mechanism.parameter_values
    found: dict[NamedCoordinate, float] = {}
    for name, value in _flat(table):
        try:
            base = name.removesuffix(RATES[0]) if key == "start_speed" else name
            c = named_coordinate(mechanism, base)
            if c in found:
                raise InputError("the coordinate is given twice")
            given = number(value)
            for used in sorted(names_in(given)) if isinstance(given, str) else ():
                if used not in known:
                    raise UnknownName("parameter", used, known)
            found[c] = evaluate(given, known)
        except MechdaeError as problem:
            raise problem.inside(f"{key}.{name}") from None
    return found


def _flat(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{before}{name}.")
        else:
            yield before + name, value


def crossings(mechanism: Mechanism, task: Motion) -> list[Crossing]:
    """Return the events a task asks for.

    ``coordinate`` may be a coordinate, a speed (``crank.angle.speed``) or a named output.

    Raises
    ------
    InputError, UnknownName
        With the key path.
    """
    known = mechanism.parameter_values
    if task.events is None:
        return []
    if not isinstance(task.events, tuple):
        raise InputError("a list of events is needed", where="events", hint="events = [{...}]")
    found = []
    for i, entry in enumerate(task.events):
        try:
            if not isinstance(entry, Mapping):
                raise InputError("a table with the key 'coordinate' is needed")
            for key in entry:
                if key not in EVENT_KEYS:
                    raise UnknownName("key", key, EVENT_KEYS)
            text = entry.get("coordinate")
            if not isinstance(text, str):
                raise InputError("the key 'coordinate' is missing")
            if text in mechanism.bodies or text in mechanism.joints:
                text = named_coordinate(mechanism, text).text
            check_expression(mechanism, text, "coordinate")
            if any(split_rate(used)[1] > 1 for used in names_in(text)):
                raise InputError("events do not depend on accelerations", where="coordinate")
            direction = entry.get("direction", "both")
            if direction not in DIRECTIONS:
                raise UnknownName("value", str(direction), DIRECTIONS, where="direction")
            stop = entry.get("stop", False)
            if not isinstance(stop, bool):
                raise InputError("true or false is needed", where="stop")
            value = evaluate(number(entry.get("crosses", 0.0)), known)
            name = entry.get("name", text)
            if not isinstance(name, str):
                raise InputError("a text is needed", where="name")
            found.append(Crossing(name, text, value, direction, stop))
        except MechdaeError as problem:
            raise problem.inside(f"events[{i}]") from None
    return found


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
    for key, given in [*numbers, *(("at", own) for own in task.at or ())]:
        for used in sorted(names_in(given)) if isinstance(given, str) else ():
            if used not in known:
                raise UnknownName("parameter", used, known, where=key)


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
            ways = [w for w in ("at", "from_", "to", "range", "times") if getattr(driver, w)]
            timed = driver.law is not None or driver.table is not None
            if not timed and (driver.at is None or len(driver.at) != 1):
                raise InputError(
                    "a driver of a motion follows a law of time or is held",
                    hint='law = "..." of t, table = { file = "law.csv" }, or at = [value]',
                )
            if driver.law is not None and driver.table is not None:
                raise InputError("a driver has a law or a table, not both", where="table")
            if timed and ways:
                raise InputError(f"a law of a motion needs no '{ways[0].rstrip('_')}'")
            for word in ("factor", "shift", "period"):
                number = getattr(driver.table, word, None)
                for used in sorted(names_in(number)) if isinstance(number, str) else ():
                    if used not in known:
                        raise UnknownName("parameter", used, known, where=f"table.{word}")
            for key in ("speed", "acceleration", "jerk"):
                if getattr(driver, key) is not None:
                    raise InputError("it follows from the law", where=key)
            for used in sorted(names_in(driver.law)) if driver.law is not None else ():
                if used not in known and used != "t":
                    raise UnknownName("name", used, [*known, "t"], where="law")
        except MechdaeError as problem:
            raise problem.inside(f"drivers[{i}]") from None
    if len(set(driven)) < len(driven):
        raise InputError("two drivers impose the same coordinate", where="drivers")
