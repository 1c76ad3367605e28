"""From the tables of a problem file to descriptions: keys, units, types, places of errors."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any, TypeVar

from mechdae.describe.values import WITH_UNIT, Value, required
from mechdae.errors import InputError, MechdaeError, UnknownName

UNITS: dict[str, tuple[Callable[[float], float], str]] = {
    "_deg": (math.radians, "({})*pi/180"),
    "_rpm": (lambda x: x * math.pi / 30, "({})*pi/30"),
    "_mm": (lambda x: x / 1000, "({})/1000"),
}
MEASURES = {
    "_deg": ("rad", "rad/s", "rad/s2", "rad/s3"),
    "_rpm": ("rad/s",),
    "_mm": ("m", "m/s", "m/s2", "m/s3"),
}
"""Units that a suffix may stand for."""
T = TypeVar("T", bound=Value)


def split_unit(key: str) -> tuple[str, str]:
    """Return the name and the unit suffix ('' without) of a key."""
    for suffix in UNITS:
        if key.endswith(suffix) and len(key) > len(suffix):
            return key[: -len(suffix)], suffix
    return key, ""


def suffixes(unit: str | None) -> list[str]:
    """Return the suffixes that fit a unit; all of them where it is not known."""
    return [suffix for suffix in UNITS if unit is None or unit in MEASURES[suffix]]


def check_suffix(key: str, unit: str | None) -> None:
    """Raise for a key whose suffix cannot be a unit of its numbers, like ``radius_deg``."""
    base, suffix = split_unit(key)
    if not suffix or suffix in suffixes(unit):
        return
    own = "plain numbers" if unit == "1" else f"in {unit}"
    fitting = [f"{base}{other}" for other in suffixes(unit)]
    raise InputError(
        f"the unit '{suffix}' does not fit '{base}'",
        where=key,
        hint=f"{' or '.join([base, *fitting])}; values without a suffix are {own}",
    )


def to_si(value: Any, suffix: str) -> Any:
    """Return a number, expression, list or table of them converted to SI."""
    if not suffix:
        return value
    convert, pattern = UNITS[suffix]
    if isinstance(value, bool):
        raise InputError("a number or an expression is needed")
    if isinstance(value, int | float):
        return convert(value)
    if isinstance(value, str):
        return pattern.format(value)
    if isinstance(value, list):
        return [to_si(item, suffix) for item in value]
    if isinstance(value, Mapping):
        return {key: to_si(item, suffix) for key, item in value.items()}
    raise InputError(f"a number is needed for a key with the unit '{suffix}'")


def plain(table: Any, known: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return the table with unit suffixes resolved, nested tables included.

    With `known`, a key is looked up there first as it is, then without its suffix; an
    unknown one is an error. Both forms of one key are an error too.
    """
    if not isinstance(table, Mapping):
        raise InputError("a table is needed")
    result: dict[str, Any] = {}
    for key, value in table.items():
        base, suffix = (key, "") if known is not None and key in known else split_unit(key)
        if known is not None and base not in known:
            error = UnknownName("key", key, known)
            if "_" in key and key.rsplit("_", 1)[0] in known:
                error.hint = f"units are {', '.join(UNITS)}"
            raise error
        if suffix and known is not None:
            about = getattr(known[base], "metadata", {})
            if about.get("kind", "number") not in WITH_UNIT:
                unit = about.get("unit")
                raise InputError(
                    f"'{base}' is no number, it has no unit", where=key,
                    hint=f"{base} = ..." + (f", in {unit}" if unit else ""),
                )  # fmt: skip
            check_suffix(key, about.get("unit"))
        if base in result:
            raise InputError(f"'{base}' is given twice, with and without a unit")
        try:
            result[base] = nested(to_si(value, suffix))
        except MechdaeError as problem:
            raise problem.inside(key) from None
    return result


def nested(value: Any) -> Any:
    """Return the value with the unit suffixes of nested tables resolved."""
    if isinstance(value, Mapping):
        return plain(value)
    if isinstance(value, list):
        return [nested(item) for item in value]
    return value


def keys_of(kind: type[Value]) -> dict[str, Any]:
    """Return the file keys of a description: key -> field."""
    return {entry.name.rstrip("_"): entry for entry in fields(kind)}


def read(kind: type[T], table: Any, place: str, **given: Any) -> T:
    """Return the description that a table of the file holds.

    Parameters
    ----------
    kind
        The class of the description.
    table
        Parsed TOML.
    place
        Key path, for messages.
    given
        Fields that do not come from the table.
    """
    try:
        known = {key: entry for key, entry in keys_of(kind).items() if entry.name not in given}
        values = plain(table, known)
        arguments = {known[key].name: value for key, value in values.items()}
        for key, entry in known.items():
            if required(entry) and key not in values:
                raise InputError(f"the key '{key}' is missing")
        return kind(**given, **arguments)
    except MechdaeError as problem:
        if problem.where in ("first", "second"):
            problem.where = "between"
        raise problem.inside(place) from None
