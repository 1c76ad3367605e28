"""What was meant by a key or a kind that there is not.

TOML may put a key into another table than its author meant: a line belongs to the last header
above it. A key of the whole file that stands below the first header, or one of a task below a
header of its own, is read as a key of that table.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any

from mechdae.describe.file.reading import keys_of, split_unit, suffixes
from mechdae.describe.file.units import written_units
from mechdae.describe.kinds import JOINTS
from mechdae.describe.tasks.kinds import TASKS
from mechdae.describe.units import nearest_suffixes, units_of
from mechdae.errors import MechdaeError, UnknownName, close_matches

WHOLE = ("schema", "title", "source", "dimension", "frames", "gravity", "closure_tolerance")
"""Keys of the whole file that are no tables."""
MOST = 4
ALIASES = {
    **dict.fromkeys(("pin", "hinge", "pivot", "rotary", "turning"), "revolute"),
    **dict.fromkeys(("slider", "sliding", "translation", "piston"), "prismatic"),
    **dict.fromkeys(("fixed", "rigid"), "weld"),
    **dict.fromkeys(("bar", "rod", "link"), "distance"),
    **dict.fromkeys(("slot", "pin_in_slot", "yoke"), "pin-in-slot"),
    **dict.fromkeys(("gears", "mesh"), "gear"),
    **dict.fromkeys(("cam", "roller"), "curve"),
}
"""Other names of kinds of joints."""


def explain(data: Mapping[str, Any], error: MechdaeError) -> None:
    """Let an error be in the units of the file, and say of a key that its table is wrong."""
    units_of(written=written_units(None, {}, data)).say(error)
    place = error.where.split(".") if error.where else []
    if isinstance(error, UnknownName) and "unknown name" in error.what:
        hints = [unit_meant(key, [error.name]) for key in data.get("parameters", ())]
        error.hint = next((hint for hint in hints if "did you mean" in hint), error.hint)
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


def _is_table(data: object, place: list[str]) -> bool:
    for key in place:
        if not isinstance(data, Mapping) or key not in data:
            return False
        data = data[key]
    return isinstance(data, Mapping)


def _tables_with(data: Mapping[str, object], key: str, depth: int = 0) -> list[list[str]]:
    """Return the paths of tables that hold a key."""
    result = []
    for name, value in data.items():
        if isinstance(value, Mapping) and depth < MOST:
            if key in value and not isinstance(value[key], Mapping):
                result.append([name])
            result += [[name, *rest] for rest in _tables_with(value, key, depth + 1)]
    return result


def unknown_kind(kind: str, kinds: Collection[str], word: str) -> UnknownName:
    """Return the error for a kind that there is not, with what may have been meant."""
    error = UnknownName(f"kind of {word}", kind, kinds, where="kind")
    meant = ALIASES.get(kind.lower(), "")
    if meant in kinds:
        error.hint = f"did you mean {meant}?"
    elif not close_matches(kind, kinds, 1):
        error.hint = f"one of {', '.join(kinds)}"
    return error


def unknown_key(key: str, known: Collection[str]) -> UnknownName:
    """Return the error for a key that there is not, with the units where it ends like none."""
    error = UnknownName("key", key, known)
    if not close_matches(key, known, 1, 0.9):
        error.hint = unit_meant(key, known) or error.hint
    base = split_unit(key)[0]
    if not error.hint or not close_matches(base, known, 1, 0.75):
        owners = [kind for kind, joint in JOINTS.items() if base in keys_of(joint)]
        error.hint = f"{base} is a key of {', '.join(owners)}" if owners else error.hint
    return error


def unit_meant(key: str, known: Iterable[str]) -> str:
    """Return what to try for a key that ends like no unit.

    It is "" where no known name stands before the end, or another known name is nearer.
    """
    names = set(known)
    bases = [name for name in names if key.startswith(f"{name}_")]
    if not bases:
        return ""
    base = max(bases, key=len)
    about = getattr(known[base], "metadata", {}) if isinstance(known, Mapping) else {}
    fitting = suffixes(about.get("unit"))
    meant = [f"{base}{end}" for end in nearest_suffixes(key[len(base) :]) if end in fitting]
    if not {*close_matches(key, [*(names - {base}), *meant], 1)} <= {*meant}:
        return ""
    advice = f"did you mean {' or '.join(meant)}? " if meant else ""
    return advice + f"units are {', '.join(fitting)}" if fitting else advice
