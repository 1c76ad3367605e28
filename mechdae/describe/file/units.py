"""Units of keys: a suffix must be one of what the key stands for; notes on missing ``_deg``."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from mechdae.describe.coordinates import unit_of
from mechdae.describe.dimensions import SPEEDS, misfit, parameter_units, typed_numbers
from mechdae.describe.file.reading import (
    check_suffix,
    check_suffixes,
    split_keys,
    split_known,
)
from mechdae.describe.mechanism import WHOLE_UNITS, Mechanism
from mechdae.describe.tasks.kinds import Driven, Task
from mechdae.describe.units import UNITS
from mechdae.errors import MechdaeError

if TYPE_CHECKING:
    from mechdae.describe.joints.joint import Joint
    from mechdae.describe.loads import Load


SUFFIXES = sorted(UNITS, key=len, reverse=True)
VARIED = ("vary", "samples")
"""Keys of a study whose tables are numbers by name."""
PLACES = ("at", "from", "to", "law")
"""Keys of a driver whose values are those of its coordinate."""
RATES = dict.fromkeys(PLACES, "") | {"speed": "/s", "acceleration": "/s2", "jerk": "/s3"}
"""Keys of a driver whose values have the unit of its coordinate, over powers of the second."""
QUANTITIES = {
    **{"position": "m", "velocity": "m/s", "acceleration": "m/s2", "length": "m"},
    **{"slide": "m", "slide_velocity": "m/s", "slide_acceleration": "m/s2"},
    **{"angle": "rad", "angular_velocity": "rad/s", "angular_acceleration": "rad/s2"},
    **{"transmission_angle": "rad", "normal": "N", "loss": "W"},
}
"""Units of series of results by the last words of their paths."""


def check_number(mechanism: Mechanism, name: str, suffix: str) -> None:
    """Raise for an automatic name given in a unit that is not that of its number."""
    last = name.split(".")[-1]
    if suffix and last not in mechanism.parameters:  # units of those follow from their uses alone
        check_suffix(f"{last}{suffix}", unit_of_number(mechanism, name), last)


def check_parameter(
    mechanism: Mechanism, tasks: Mapping[str, Task], name: str, suffix: str
) -> None:
    """Raise for a parameter given in a unit that none of its uses has, where these tell."""
    check_parameters(mechanism, tasks, {name: suffix})


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


def unit_of_number(mechanism: Mechanism, name: str) -> str | None:
    """Return the unit of an automatic name."""
    part, *rest = name.split(".")
    if part in mechanism.joints or part == "loads":
        owner: Joint | Load = (
            mechanism.joints[part] if part != "loads" else mechanism.loads[rest.pop(0)]
        )
        entry = next((f for f in fields(owner) if f.name == rest[0]), None)
        return entry.metadata.get("unit") if entry else None
    if part in WHOLE_UNITS:
        return WHOLE_UNITS[part]
    return {"mass": "kg", "inertia": "kg m2"}.get(rest[0], "m")


def _unit_of_path(mechanism: Mechanism, path: str) -> str | None:
    """Return the unit of a path of a result, as far as its words tell."""
    head, _, rest = path.partition("/")
    if head.startswith("efforts"):
        unit = unit_of(mechanism, rest)
        return {"rad": "N m", "m": "N"}.get(unit or "")
    if head == "drivers":
        return unit_of(mechanism, rest.partition("/")[0]) if rest.endswith("/position") else None
    return QUANTITIES.get(path.rpartition("/")[2])


def _units_along(mechanism: Mechanism, tasks: Mapping[str, Task]) -> dict[str, str | None]:
    """Return the units of the coordinates that the tasks move, of those that move one."""
    moving = {n: task.moving_drivers for n, task in tasks.items() if isinstance(task, Driven)}
    single = {name: drivers[0].coordinate for name, drivers in moving.items() if len(drivers) == 1}
    units = {coordinate: unit_of(mechanism, coordinate) for coordinate in {*single.values()}}
    return {name: units[coordinate] for name, coordinate in single.items()}


def check_units(mechanism: Mechanism, tasks: Mapping[str, Task], data: Mapping[str, Any]) -> None:
    """Raise for suffixes of sketched and driven values that are not units of their coordinates."""
    given = split_keys(data.get("parameters", {}), mechanism.parameters)
    typed = {base: suffix for base, suffix in given.values() if suffix}
    if typed:
        try:
            check_parameters(mechanism, tasks, typed)
        except MechdaeError as error:
            raise error.inside("parameters") from None
    along, expected = _units_along(mechanism, tasks), data.get("expected", [])
    values = [_unit_of_path(mechanism, str(table.get("what", ""))) for table in expected]
    for k, (table, value) in enumerate(zip(expected, values, strict=True)):
        at = along.get(table.get("task", ""))
        try:
            check_suffixes(table, {"value": value, "abs": value, "time": "s", "at": at})
        except MechdaeError as error:
            raise error.inside(f"expected[{k}]") from None
    sketch = data.get("sketch", {})
    names = [base for base, _ in split_keys(sketch, ()).values()]
    try:
        check_suffixes(sketch, {name: unit_of(mechanism, name) for name in names})
    except MechdaeError as error:
        raise error.inside("sketch") from None
    for name, task in data.get("tasks", {}).items():
        for word in VARIED if tasks[name].kind == "study" else ():
            for entry in task.get(word, ()):
                base, suffix = split_known(entry, mechanism.parameters)
                try:
                    check_number(mechanism, base, suffix)
                    if suffix and base in mechanism.parameters:
                        check_parameter(mechanism, tasks, base, suffix)
                except MechdaeError as error:
                    raise error.inside(f"tasks.{name}.{word}") from None
        if not isinstance(tasks[name], Driven):
            continue
        tables = [("driver", task["driver"])] if "driver" in task else []
        tables += [(f"drivers[{k}]", item) for k, item in enumerate(task.get("drivers", ()))]
        for place, table in tables:
            try:
                check_suffixes(table, units_of_driver(mechanism, table["coordinate"]))
            except MechdaeError as error:
                raise error.inside(f"tasks.{name}.{place}") from None


def units_of_driver(mechanism: Mechanism, name: str) -> dict[str, str | None]:
    """Return the units of the keys of a driver of a coordinate, None where it has none."""
    unit = unit_of(mechanism, name)
    return {key: f"{unit}{rate}" if unit else None for key, rate in RATES.items()}


def written_units(
    mechanism: Mechanism, tasks: Mapping[str, Task], data: Mapping[str, object]
) -> str:
    """Return the units that most numbers of a file are typed in, ``mm,deg,rpm``; 0 tells nothing.

    Angular speeds are in degrees only where they are typed so.
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
    few = not others or plain <= min(others)
    in_si = Counter() if few else typed_numbers(mechanism, tasks.values(), 2 * min(others))
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
