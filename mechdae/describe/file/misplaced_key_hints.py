"""Explains errors about keys that TOML puts into another table than their author meant.

A line belongs to the last header above it. A key of the whole file that stands below the first
header, or one of a task below a header of its own, is read as a key of that table.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mechdae.describe.file.reading import keys_of, split_unit
from mechdae.describe.tasks.kinds import TASKS
from mechdae.errors import MechdaeError, UnknownName

WHOLE = ("schema", "title", "source", "dimension", "frames", "gravity", "closure_tolerance")
"""Keys of the whole file that are no tables."""
MOST = 4


def explain(data: Mapping[str, Any], error: MechdaeError) -> None:
    """Let an error about a key that landed in a wrong table say so."""
    place = error.where.split(".") if error.where else []
    if isinstance(error, UnknownName) and "unknown key" in error.what:
        key = error.name
    elif len(place) > 1:
        *place, key = place
    else:
        if error.where == "schema" and "schema" not in data:
            _say(error, "schema", _tables_with(data, "schema"))
        return
    if place and place[0].startswith("expected["):
        place, held = ["[expected]"], True
    else:
        held = bool(place) and _is_table(data, place)
    if not held:
        return
    if key in WHOLE and key not in data:
        _say(error, key, [place])
    elif place[0] == "tasks" and len(place) > 2:
        task = data["tasks"][place[1]]
        kind = TASKS.get(str(task.get("kind")))
        if kind is not None and split_unit(key)[0] in keys_of(kind):
            header, section = ".".join(place), ".".join(place[:2])
            error.hint = (
                f"'{key}' is a key of [{section}]; below the header [{header}] it belongs to that: "
                "move it above"
            )


def _say(error: MechdaeError, key: str, places: list[list[str]]) -> None:
    for place in places[:1]:
        header = ".".join(place)
        error.hint = (
            f"'{key}' is a key of the whole file and stands above the first [table]; below the "
            f"header [{header}] TOML makes it a key of that"
        )


def _is_table(data: Any, place: list[str]) -> bool:
    for key in place:
        if not isinstance(data, Mapping) or key not in data:
            return False
        data = data[key]
    return isinstance(data, Mapping)


def _tables_with(data: Mapping[str, Any], key: str, depth: int = 0) -> list[list[str]]:
    """Return the paths of tables that hold a key."""
    result = []
    for name, value in data.items():
        if isinstance(value, Mapping) and depth < MOST:
            if key in value and not isinstance(value[key], Mapping):
                result.append([name])
            result += [[name, *rest] for rest in _tables_with(value, key, depth + 1)]
    return result
