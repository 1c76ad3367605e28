"""Kinds of values that few descriptions have: vectors of space, rows, starts, lists by name."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from mechdae.describe.values import (
    Number,
    Table,
    each,
    entries,
    number,
    numbers,
    pair,
    sequence,
    text,
)
from mechdae.errors import InputError, MechdaeError


def direction(value: object) -> tuple[Number, ...]:
    """Return the three numbers of a direction in space."""
    items = sequence(value)
    if len(items) != 3:
        raise InputError(f"three numbers are needed, not {len(items)}", hint="like [0, 0, 1]")
    return numbers(items)


def moment(value: Any) -> Number | tuple[Number, ...]:
    """Return a moment about the normal of the plane, or the three components of one of space."""
    listed = isinstance(value, Sequence) or hasattr(value, "tolist")
    return direction(value) if listed and not isinstance(value, str) else number(value)


def inertia(value: Any) -> Number | tuple[Number, ...]:
    """Return a moment of inertia, or three or six of space."""
    if isinstance(value, str) or not (isinstance(value, Sequence) or hasattr(value, "tolist")):
        return number(value)
    items = sequence(value)
    if len(items) not in (3, 6):
        raise InputError(
            f"[Ixx, Iyy, Izz] or six numbers are needed, not {len(items)}",
            hint="Ixx, Iyy, Izz, Ixy, Ixz, Iyz about the centre",
        )
    return numbers(items)


def numbers_in_rows(value: object, sizes: tuple[int, ...]) -> tuple[tuple[Number, ...], ...]:
    """Return rows of as many numbers or expressions, all of one of the sizes, two at least."""
    words = " or ".join(map(str, sizes))
    counts = sizes

    def row(item: Any) -> tuple[Number, ...]:
        nonlocal counts, words
        items = numbers(item)
        if len(items) not in counts:
            raise InputError(f"{words} numbers are needed, here are {len(items)}")
        counts, words = (len(items),), str(len(items))
        return items

    result = tuple(each(sequence(value), row))
    if len(result) < 2:
        raise InputError(f"2 at least are needed, here are {len(result)}")
    return result


def rows(value: object) -> tuple[tuple[float, float], ...]:
    """Return pairs of finite numbers, two at least."""

    def row(item: object) -> tuple[float, float]:
        first, second = pair(item)
        if isinstance(first, str) or isinstance(second, str):
            raise InputError("plain numbers are needed, not expressions")
        return first, second

    result = tuple(each(sequence(value), row))
    if len(result) < 2:
        raise InputError("two rows at least are needed")
    return result


def numbers_by_place(value: object) -> Table[Number]:
    """Return a sketch in space: rough places ``"rocker.C" = [x, y, z]`` by their components."""
    result: dict[str, Number] = {}
    for entry, item in entries(value, _place, check=text).items():
        named = zip("xyz", item, strict=True) if isinstance(item, tuple) else ()
        for name, one in [(f"{entry}.{axis}", n) for axis, n in named] or [(entry, item)]:
            if name in result:
                raise InputError("the coordinate is given twice", where=name)
            result[name] = one
    return Table(result)


def _place(value: Any) -> Number | tuple[Number, ...]:
    return direction(value) if isinstance(value, list | tuple) else number(value)


def start(value: object) -> Table[Number]:
    """Return coordinate -> number; dotted keys may be nested tables."""
    result: dict[str, Number] = {}
    for entry, item in _flat(value, ""):
        if entry in result:
            raise InputError("the coordinate is given twice", where=entry)
        try:
            result[entry] = number(item)
        except MechdaeError as problem:
            raise problem.inside(entry) from None
    return Table(result)


def _flat(table: object, before: str) -> Iterator[tuple[str, Any]]:
    if not isinstance(table, Mapping):
        raise InputError("a table coordinate = value is needed")
    for entry, item in table.items():
        if isinstance(item, Mapping):
            yield from _flat(item, f"{before}{text(entry)}.")
        else:
            yield before + text(entry), item


def lists_by_name(value: object) -> Table[tuple[Number, ...]]:
    """Return name -> numbers, one at least."""
    result = entries(value, numbers, check=text)
    empty = next((entry for entry, items in result.items() if not items), None)
    if empty is not None:
        raise InputError("a list with a number at least is needed", where=empty)
    return Table(result)


COERCE: dict[str, Callable[[Any], Any]] = {
    "direction": direction,
    "moment": moment,
    "inertia": inertia,
    "pairs": partial(numbers_in_rows, sizes=(2,)),
    "places": partial(numbers_in_rows, sizes=(2, 3)),
    "poses": partial(numbers_in_rows, sizes=(3, 7)),
    "rows": rows,
    "rough places": numbers_by_place,
    "start": start,
    "lists": lists_by_name,
    "grid": lists_by_name,
}
