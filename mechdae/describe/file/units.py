"""Checks of units: a suffix must be a unit of what the key stands for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from mechdae.describe.coordinates import unit_of
from mechdae.describe.dimensions import parameter_units
from mechdae.describe.file.reading import check_suffix, split_unit
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.tasks.kinds import Driven, Study, Task
from mechdae.describe.units import UNITS
from mechdae.errors import MechdaeError

RATES = {
    **dict.fromkeys(("at", "from", "to", "law"), ""),
    **{"speed": "/s", "acceleration": "/s2", "jerk": "/s3"},
}
"""Keys of a driver whose values have the unit of its coordinate, over powers of the second."""


PLAIN = ("1", "1/s", "1/s2", "1/s3")
"""Units inferred where an angle is used as a plain number: an arc is a radius times an angle."""


def check_number(mechanism: Mechanism, name: str, suffix: str) -> None:
    """Raise for an automatic name given in a unit that is not that of its number."""
    rest = name.split(".")[1:]
    if rest and suffix:  # units of parameters follow from their uses alone
        check_suffix(f"{rest[-1]}{suffix}", unit_of_number(mechanism, name))


def check_parameter(
    mechanism: Mechanism, tasks: Mapping[str, Task], name: str, suffix: str
) -> None:
    """Raise for a parameter given in a unit that none of its uses has, where these tell."""
    unit = parameter_units(mechanism, tasks.values()).get(name)
    angle = unit in PLAIN and "rad" in UNITS[suffix].si[0]
    if unit is not None and not angle:
        check_suffix(f"{name}{suffix}", unit)


def unit_of_number(mechanism: Mechanism, name: str) -> str | None:
    """Return the unit of an automatic name."""
    part, *rest = name.split(".")
    if part in mechanism.joints or part == "loads":
        owner: Any = mechanism.joints[part] if part != "loads" else mechanism.loads[rest.pop(0)]
        entry = next((f for f in fields(owner) if f.name == rest[0]), None)
        return entry.metadata.get("unit") if entry else None
    if part == "gravity":
        return "m/s2"
    return {"mass": "kg", "inertia": "kg m2"}.get(rest[0], "m")


def _check_direct(mechanism: Mechanism, tasks: Mapping[str, Task], typed: Any) -> None:
    """Raise for a parameter typed in a unit that a number which it is alone does not have."""
    suffixed = {base: key for key in typed for base, end in (split_unit(key),) if end}
    if not suffixed:
        return
    uses = [
        (number, name, unit_of_number(mechanism, name))
        for name, number in mechanism.numbers()
        if isinstance(number, str) and number.strip("- ") in suffixed
    ]
    for name, task in tasks.items():
        for driver in task.all_drivers if isinstance(task, Driven) else ():
            unit = unit_of(mechanism, driver.coordinate)
            uses += [
                (number, f"{word} of the driver in tasks.{name}", f"{unit}{over}")
                for word, over in RATES.items()
                if unit is not None
                and isinstance(number := getattr(driver, word.replace("from", "from_")), str)
                and number.strip("- ") in suffixed
            ]
    for number, use, unit in uses:
        key = suffixed[str(number).strip("- ")]
        try:
            check_suffix(key, unit)
        except MechdaeError as error:
            error.what += f", which is {use}"
            raise error.inside("parameters") from None


def check_units(mechanism: Mechanism, tasks: Mapping[str, Task], data: Mapping[str, Any]) -> None:
    """Raise for suffixes of sketched and driven values that are not units of their coordinates."""
    _check_direct(mechanism, tasks, data.get("parameters", {}))
    for name in data.get("sketch", {}):
        try:
            check_suffix(name, unit_of(mechanism, split_unit(name)[0]))
        except MechdaeError as error:
            raise error.inside("sketch") from None
    for name, task in data.get("tasks", {}).items():
        for word in ("vary", "samples") if isinstance(tasks[name], Study) else ():
            for entry in task.get(word, ()):
                base, suffix = split_unit(entry)
                try:
                    check_number(mechanism, base, suffix)
                except MechdaeError as error:
                    raise error.inside(f"tasks.{name}.{word}") from None
        if not isinstance(tasks[name], Driven):
            continue
        tables = [("driver", task["driver"])] if "driver" in task else []
        tables += [(f"drivers[{k}]", item) for k, item in enumerate(task.get("drivers", ()))]
        for place, table in tables:
            for word in table:
                unit = unit_of(mechanism, table["coordinate"])
                key = split_unit(word)[0]
                try:
                    if unit is not None and key in RATES:
                        check_suffix(word, f"{unit}{RATES[key]}")
                except MechdaeError as error:
                    raise error.inside(f"tasks.{name}.{place}") from None
