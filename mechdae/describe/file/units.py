"""Checks of units: a suffix must be a unit of what the key stands for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from mechdae.describe.coordinates import unit_of
from mechdae.describe.file.reading import check_suffix, split_unit
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.tasks.kinds import Driven, Study, Task
from mechdae.errors import MechdaeError

RATES = {
    **dict.fromkeys(("at", "from", "to", "law"), ""),
    **{"speed": "/s", "acceleration": "/s2", "jerk": "/s3"},
}
"""Keys of a driver whose values have the unit of its coordinate, over powers of the second."""


def check_number(mechanism: Mechanism, name: str, suffix: str) -> None:
    """Raise for an automatic name given in a unit that is not that of its number."""
    part, *rest = name.split(".")
    if not rest or not suffix:
        return  # a parameter has no unit
    if part in mechanism.joints:
        entry = next((f for f in fields(mechanism.joints[part]) if f.name == rest[0]), None)
        unit = entry.metadata.get("unit") if entry else None
    elif part == "loads":
        entry = next((f for f in fields(mechanism.loads[rest[0]]) if f.name == rest[1]), None)
        unit = entry.metadata.get("unit") if entry else None
    else:
        unit = {"mass": "kg", "inertia": "kg m2"}.get(rest[0], "m")
    check_suffix(f"{rest[-1]}{suffix}", unit)


def check_units(mechanism: Mechanism, tasks: Mapping[str, Task], data: Mapping[str, Any]) -> None:
    """Raise for suffixes of sketched and driven values that are not units of their coordinates."""
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
