"""Entries of free tables, read with their key paths: lists, numbers, kinds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from mechdae.describe.expression import evaluate
from mechdae.describe.mechanism import Mechanism
from mechdae.errors import InputError, MechdaeError, UnknownName


def kind_of(table: Any, place: str, kinds: Mapping[str, Sequence[str]], word: str) -> str:
    """Return the kind of a table whose other keys are those of its kind."""
    if not isinstance(table, Mapping):
        raise InputError("a table is needed", where=place)
    kind = str(table.get("kind", ""))
    if kind not in kinds:
        raise UnknownName(f"kind of {word}", kind, kinds, where=f"{place}.kind")
    check_keys(table, ("kind", *kinds[kind]), place)
    return kind


def check_keys(table: Mapping[str, Any], keys: Sequence[str], place: str) -> None:
    """Refuse keys that nobody reads."""
    for entry in table:
        if entry not in keys:
            raise UnknownName("key", str(entry), keys, where=place)


def items_of(value: Any, place: str) -> Sequence[Any]:
    """Return a list, empty for None."""
    if value is None:
        return ()
    if isinstance(value, str) or not isinstance(value, Sequence):
        raise InputError("a list is needed", where=place)
    return value


def number(mechanism: Mechanism, value: Any, place: str) -> float:
    """Return the value of a number or of an expression over the parameters."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise InputError("a number or an expression is needed", where=place)
    try:
        return evaluate(value, mechanism.parameter_values)
    except MechdaeError as problem:
        raise problem.inside(place) from None


def numbers(mechanism: Mechanism, value: Any, place: str) -> tuple[float, ...]:
    """Return the values of a list of numbers."""
    return tuple(
        number(mechanism, item, f"{place}[{i}]") for i, item in enumerate(items_of(value, place))
    )


def tuple_of(mechanism: Mechanism, value: Any, size: int, place: str) -> tuple[float, ...]:
    """Return as many numbers as are asked for."""
    found = numbers(mechanism, value, place)
    if len(found) != size:
        raise InputError(f"{size} numbers are needed, here are {len(found)}", where=place)
    return found


def rows_of(
    mechanism: Mechanism, value: Any, size: int, least: int, place: str
) -> tuple[tuple[float, ...], ...]:
    """Return a list of rows of numbers, `least` of them or more."""
    found = [
        tuple_of(mechanism, item, size, f"{place}[{i}]")
        for i, item in enumerate(items_of(value, place))
    ]
    if len(found) < least:
        raise InputError(f"{least} at least are needed, here are {len(found)}", where=place)
    return tuple(found)


def flag(value: Any, place: str) -> bool:
    """Return true or false."""
    if not isinstance(value, bool):
        raise InputError("true or false is needed", where=place)
    return value


def word_of(value: Any, known: Sequence[str], what: str, place: str) -> str:
    """Return a word out of those known."""
    if value not in known:
        raise UnknownName(what, str(value), known, where=place)
    return str(value)
