"""Notes on keys without a suffix that look like degrees beside one that ends in ``_deg``."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from mechdae.describe.coordinates import unit_of
from mechdae.describe.dimensions import parameter_units
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.tasks.kinds import Task

PLACES = ("at", "from", "to", "law")
"""Keys of a driver whose values are those of its coordinate."""


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
        tables += [(f"drivers[{k}]", own) for k, own in enumerate(task.get("drivers") or ())]
        for place, table in tables:
            if isinstance(table, Mapping) and "coordinate" in table:
                turns = unit_of(mechanism, table["coordinate"]) == "rad"
                keys = {key for key in PLACES if turns}
                yield from _notes(table, f"tasks.{name}.{place}", keys.__contains__, PLACES)


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


def _shown(value: Any) -> str:
    most = max(filter(_looks, value), key=abs) if isinstance(value, list) else value
    return f"{most:g}"
