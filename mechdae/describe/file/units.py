"""Units of keys: a suffix must be one of what the key stands for; notes on missing ``_deg``."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import fields
from functools import partial
from typing import Any

from mechdae.describe.coordinates import unit_of, unit_within
from mechdae.describe.dimensions import (
    SPEEDS,
    automatic_units,
    misfit,
    parameter_units,
    typed_numbers,
)
from mechdae.describe.file.reading import (
    NESTED,
    Check,
    check_each,
    check_suffix,
    split_keys,
    split_known,
    split_unit,
)
from mechdae.describe.mechanism import WHOLE_UNITS, Mechanism
from mechdae.describe.series_units import path_unit
from mechdae.describe.tasks.kinds import Driven, Task
from mechdae.describe.units import UNITS
from mechdae.describe.values import UnitOf, Value
from mechdae.errors import MechdaeError

SUFFIXES = sorted(UNITS, key=len, reverse=True)
VARIED = ("vary", "samples")
"""Keys of a study whose tables are numbers by name."""
PLACES = ("at", "from", "to", "law")
"""Keys of a driver whose values are those of its coordinate."""
NAMED = ("freedoms", "grid", "lists", "coordinates")
"""Kinds of values that are numbers by the names of parameters."""


def check_number(mechanism: Mechanism, tasks: Mapping[str, Task], name: str, suffix: str) -> None:
    """Raise for a parameter or an automatic name in a unit that is not that of its number."""
    last = name.split(".")[-1]
    if suffix and name in mechanism.parameters:
        check_parameters(mechanism, tasks, {name: suffix})
    elif suffix:
        unit = (WHOLE_UNITS | dict(automatic_units(mechanism))).get(name)
        check_suffix(f"{last}{suffix}", unit, last)


def check_parameters(
    mechanism: Mechanism, tasks: Mapping[str, Task], typed: Mapping[str, str]
) -> None:
    """Raise for the first of some parameters, given with suffixes, of which a use tells another."""
    found = misfit(mechanism, tasks, typed)
    if found is None:
        return
    name, unit, place = found
    try:
        check_suffix(f"{name}{typed[name]}", unit, name)
    except MechdaeError as error:
        error.what += f", which is {place}"
        raise


def _units_along(mechanism: Mechanism, tasks: Mapping[str, Task]) -> dict[str, str | None]:
    """Return the units of the coordinates that the tasks move, of those that move one."""
    moving = {n: task.moving_drivers for n, task in tasks.items() if isinstance(task, Driven)}
    single = {name: drivers[0].coordinate for name, drivers in moving.items() if len(drivers) == 1}
    units = {coordinate: unit_of(mechanism, coordinate) for coordinate in {*single.values()}}
    return {name: units[coordinate] for name, coordinate in single.items()}


def check_units(mechanism: Mechanism, tasks: Mapping[str, Task], data: Mapping[str, Any]) -> None:
    """Raise for suffixes that are not units of what their keys belong to."""
    given = split_keys(data.get("parameters", {}), mechanism.parameters)
    typed = {base: suffix for base, suffix in given.values() if suffix}
    if typed:
        try:
            check_parameters(mechanism, tasks, typed)
        except MechdaeError as error:
            raise error.inside("parameters") from None
    along, unit_of = _units_along(mechanism, tasks), partial(unit_within, mechanism, None)
    checks: list[Check] = []
    for k, table in enumerate(data.get("expected", ())):
        units = {"time": "s", "at": along.get(table.get("task", ""))}
        if [key for key in table if key.startswith(("value_", "abs_"))]:
            units |= dict.fromkeys(("value", "abs"), path_unit(mechanism, table["what"]) or None)
        checks.append((f"expected[{k}]", table, units))
    sketched = _names(data.get("sketch", {}), "")
    checks.append(("sketch", sketched, {name: unit_of(name) for name in sketched.values()}))
    for section, values in (("loads", mechanism.loads), ("tasks", tasks)):
        for name, table in data.get(section, {}).items():
            unit_of = partial(unit_within, mechanism, values[name])
            checks += _of_table(mechanism, tasks, values[name], table, f"{section}.{name}", unit_of)
    check_each(checks)


def _of_table(
    mechanism: Mechanism, tasks: Mapping[str, Task], value: Value, table: Mapping[str, Any],
    place: str, unit_of: UnitOf,
) -> Iterator[Check]:  # fmt: skip
    """Yield the checks of the table of a load or a task, or of a `value` in it.

    Raises
    ------
    InputError
        A suffix of a parameter that does not fit its uses.
    """
    inner = [(key, given) for key, given in table.items() if isinstance(given, list | Mapping)]
    if "_" in "".join(table):
        units = value.units_by_key(unit_of).items()
        yield place, table, {key: unit for key, unit in units if isinstance(unit, str)}
    known = {entry.name.rstrip("_"): entry for entry in fields(value)}
    for key, given in inner:
        base, above = (key, "") if key in known else split_known(key, known)
        kind = known[base].metadata.get("kind") if base in known else ""
        named = value.units_by_key(unit_of)[base] if kind == "start" else None
        if isinstance(named, Mapping) and isinstance(given, Mapping):
            yield f"{place}.{key}", _names(given, above), named
        elif kind in NAMED and isinstance(given, Mapping):
            try:
                for name, suffix in split_keys(given, mechanism.parameters).values():
                    check_number(mechanism, tasks, name, suffix or above)
            except MechdaeError as error:
                raise error.inside(f"{place}.{key}") from None
        elif kind in NESTED:
            several, content = isinstance(given, list), getattr(value, known[base].name)
            pairs = zip(given, content, strict=True) if several else [(given, content)]
            for k, (part, described) in enumerate(pairs):
                if isinstance(part, Mapping):
                    where = f"{place}.{key}[{k}]" if several else f"{place}.{key}"
                    yield from _of_table(mechanism, tasks, described, part, where, unit_of)


def _names(table: Mapping[str, Any], above: str, before: str = "") -> dict[str, str]:
    """Return the coordinates of a table as they are typed -> without a unit."""
    found: dict[str, str] = {}
    for key, value in table.items():
        typed = f"{before}{key}"
        base, suffix = split_unit(typed) if "_" in typed else (typed, "")
        if isinstance(value, Mapping):
            found |= _names(value, suffix or above, f"{base}.")
        else:
            found[f"{base}{suffix or above}"] = base
    return found


def written_units(
    mechanism: Mechanism | None, tasks: Mapping[str, Task], data: Mapping[str, object]
) -> str:
    """Return the units that most numbers of a file are typed in, ``mm,deg,rpm``; 0 tells nothing.

    Without a mechanism those without a suffix are not counted by what they are. Angular speeds are
    in degrees only where they are typed so.
    """
    typed: Counter[tuple[str, bool]] = Counter()
    plain = 0  # numbers of the mechanism without a suffix
    doubled: Counter[str] = Counter()  # those that are among the numbers of the mechanism too
    front: list[tuple[str, object, str, bool]] = [
        (name, part, "", name != "tasks") for name, part in data.items() if name != "expected"
    ]
    while front:
        key, value, above, counted = front.pop()
        if key in VARIED:
            continue
        counted = counted or key in ("driver", "drivers")
        suffix = next((end for end in SUFFIXES if key.endswith(end)), above)
        if isinstance(value, Mapping):
            front += [(name, part, suffix, counted) for name, part in value.items()]
        elif isinstance(value, list):
            front += [(key, part, suffix, counted) for part in value]
        elif suffix and value:
            rate = suffix == "_deg" and key.removesuffix(suffix) in SPEEDS
            typed[suffix, rate] += 1
            doubled["rad/s" if rate else UNITS[suffix].si[0]] += counted
        elif value and not isinstance(value, str):
            plain += counted
    others = [count for (suffix, _), count in typed.items() if suffix != "_deg"]
    in_si = Counter[str]()
    if mechanism is not None and others and plain > min(others):
        in_si = typed_numbers(mechanism, tasks.values(), 2 * min(others))
    most: dict[str, tuple[int, str]] = {}
    for (suffix, rate), count in typed.items():
        si, name = ("rad/s", "deg/s") if rate else (UNITS[suffix].si[0], UNITS[suffix].name)
        most[si] = max(most.get(si, (0, "")), (count, name))
    in_si -= doubled
    chosen = {si: name for si, (count, name) in most.items() if count >= in_si[si]}
    if "rad" in chosen and "rad/s" not in chosen:
        chosen["rad/s"] = "rad/s"
    return ",".join(chosen.values())


def degrees_beside(
    mechanism: Mechanism, tasks: Mapping[str, Task], data: Mapping[str, Any]
) -> tuple[str, ...]:
    """Return a note for each angle above a turn, a whole number, beside angles in degrees.

    Tables of drivers, the sketch and the parameters are looked at.
    """
    found = list(_of_drivers(mechanism, data.get("tasks", {})))
    sketch = data.get("sketch", {})
    found += _notes(sketch, "sketch", lambda name: unit_of(mechanism, name) == "rad")
    given = data.get("parameters", {})
    if any(key.endswith("_deg") for key in given) and any(map(_looks, given.values())):
        units = parameter_units(mechanism, tasks.values())
        found += _notes(given, "parameters", lambda name: units.get(name) == "rad")
    return tuple(found)


def _of_drivers(mechanism: Mechanism, tasks: Mapping[str, Any]) -> Iterator[str]:
    for name, task in tasks.items():
        tables = [("driver", task.get("driver"))]
        tables += [(f"drivers[{k}]", driver) for k, driver in enumerate(task.get("drivers") or ())]
        for place, table in tables:
            if isinstance(table, Mapping) and "coordinate" in table:

                def is_angle(key: str, of: str = table["coordinate"]) -> bool:
                    return key in PLACES and unit_of(mechanism, of) == "rad"

                yield from _notes(table, f"tasks.{name}.{place}", is_angle, PLACES)


def _notes(
    table: Mapping[str, Any], place: str, is_angle: Any, among: tuple[str, ...] | None = None
) -> list[str]:
    """Return a note for each key of a table."""
    ends = [key for key in table if key.endswith("_deg")]
    beside = [key for key in ends if among is None or key.removesuffix("_deg") in among]
    if not beside:
        return []
    notes = []
    for key, value in table.items():
        if key not in ends and _looks(value) and is_angle(key):
            notes.append(
                f"{place}: {key} = {_shown(value)} is in radians, beside {beside[0]}; did you mean "
                f"{key}_deg?"
            )
    return notes


def _looks(value: Any) -> bool:
    """Return whether a number, or one of a list, is whole and above a turn in radians."""
    if isinstance(value, list):
        return any(map(_looks, value))
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and abs(value) > 2 * math.pi and value == round(value)


def _shown(value: float | str | list[float]) -> str:
    most = max(filter(_looks, value), key=abs) if isinstance(value, list) else value
    return f"{most:g}"
