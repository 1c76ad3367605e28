"""Frozen descriptions whose fields say what they hold, and immutable mappings of them.

Each field of a description carries in its metadata the kind of value it takes. That one
statement serves the check of Python arguments, the reading of problem files and the JSON
Schema.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, fields, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, NoReturn, Self, TypeVar

from mechdae.describe.expression import evaluate, parse
from mechdae.errors import InputError, MechdaeError, UnknownName, shorten
from mechdae.records import Record, dataclass

V = TypeVar("V")


class Table(dict[str, V]):
    """A frozen dict with string keys; the order of entry is kept."""

    __slots__ = ()

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(frozenset(self.items()))

    def __repr__(self) -> str:
        return f"Table({super().__repr__()})"

    def __reduce__(self) -> tuple[type[Table[V]], tuple[dict[str, V]]]:
        return type(self), (dict(self),)

    def with_(self, key: str, value: V) -> Table[V]:
        """Return a copy in which `key` has `value`."""
        return Table({**self, key: value})

    def _refuse(self, *_: object, **__: object) -> NoReturn:
        raise TypeError("a Table does not change; `with_` returns a changed copy")

    if not TYPE_CHECKING:  # which know of a dict what it cannot do as little
        __setitem__ = __delitem__ = __ior__ = _refuse
        clear = pop = popitem = setdefault = update = _refuse


Number = float | str
UnitOf = Callable[[str], str | None]
"""The unit of a coordinate, of an output, or of a path of a result; "" is the task's driver."""
KeyUnit = str | Mapping[str, str | None] | None
"""The unit of a key, of a table by its names; None where it is not known."""

if TYPE_CHECKING:
    from mechdae.records import Takes
    from mechdae.types import Floats, Json

    Numbers = Takes[Sequence[Number] | Floats, tuple[Number, ...]]
    NumbersOrNone = Takes[Sequence[Number] | Floats | None, tuple[Number, ...] | None]
    EvaluatedOrNone = Takes[Sequence[Number] | Floats | None, tuple[float, ...] | None]
    NumberOrNumbers = Takes[Number | Sequence[Number] | Floats, Number | tuple[Number, ...]]
    Names = Takes[Sequence[str], tuple[str, ...]]
    NamesOrNone = Takes[Sequence[str] | None, tuple[str, ...] | None]
    NumberTable = Takes[Mapping[str, Number], Table[Number]]
    NumberTableOrNone = Takes[Mapping[str, Number] | None, Table[Number] | None]
    PointTable = Takes[Mapping[str, Sequence[Number] | Floats], Table[tuple[Number, ...]]]
    NumberRows = Takes[Sequence[Sequence[Number]] | Floats, tuple[tuple[Number, ...], ...]]
    FloatRowsOrNone = Takes[
        Sequence[Sequence[float]] | Floats | None, tuple[tuple[float, float], ...] | None
    ]

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")
NAME_RULE = "letters, digits and underscores, not starting with a digit"


def empty_table() -> Any:
    """Return a field that is an empty table where nothing is given."""
    return field(default_factory=Table)


WITH_UNIT = (
    "number", "expression", "law", "numbers", "pair", "pairs", "places", "points", "free", "start",
    "freedoms", "lists", "coordinates", "components", "inertia", "moment",
)  # fmt: skip
"""Kinds of values whose keys may end in a unit."""


@dataclass(frozen=True)
class Value(Record):
    """Base of the descriptions: coerces and checks its fields when made.

    One whose tables in files have other keys has ``from_table``, which returns such a table under
    the keys of the description, units still on them.
    """

    def __post_init__(self) -> None:
        for entry in fields(self):
            kind = entry.metadata.get("kind")
            value = getattr(self, entry.name)
            if kind is None or (value is None and entry.default is None):
                continue
            try:
                value = COERCE[kind](value)
                choices = entry.metadata["choices"]
                for item in value if isinstance(value, tuple) else (value,):
                    if choices and item not in choices:
                        raise UnknownName(entry.name.rstrip("_"), str(item), choices)
            except MechdaeError as problem:
                raise problem.inside(entry.name.rstrip("_")) from None
            object.__setattr__(self, entry.name, value)

    def units_by_key(self, unit_of: UnitOf) -> Mapping[str, KeyUnit]:
        """Return the units of keys whose unit depends on what they belong to."""
        return {}

    @classmethod
    def documented(cls, text: str) -> str:
        """Return the docstring with what the fields say."""
        return str(import_module("mechdae.describe.field_docs").with_parameters(cls, text))

    def evaluated(self, known: Mapping[str, float]) -> Self:
        """Return the description with its numbers evaluated over the parameters' values."""
        changes: Json = {}
        for entry in fields(self):
            value = getattr(self, entry.name)
            if entry.metadata.get("kind") in EVALUATED and value is not None:
                try:
                    changes[entry.name] = evaluated(value, known)
                except MechdaeError as problem:
                    raise problem.inside(entry.name.rstrip("_")) from None
        return replace(self, **changes)


def evaluated(value: Any, known: Mapping[str, float]) -> Any:
    """Return a number, or rows of numbers, evaluated over the parameters' values."""
    if isinstance(value, tuple):
        return tuple(each(value, lambda item: evaluated(item, known)))
    return evaluate(value, known)


EVALUATED = ("number", "numbers", "pair", "pairs", "places", "poses")
"""Kinds of values that are numbers, or expressions over the parameters."""
LARGEST = 1e100
"""Largest number in a description: squares and products of numbers stay finite."""


def number(value: float | str) -> Number:
    """Return a finite float, or the text of a checked expression."""
    if isinstance(value, str):
        parse(value)
        return value
    if isinstance(value, bool) or not hasattr(value, "__float__"):
        raise InputError(f"a number or an expression is needed, not {describe(value)}")
    try:
        result = float(value)
    except (OverflowError, TypeError, ValueError):
        text = "one too large" if isinstance(value, int) else describe(value)
        raise InputError(f"a number is needed, not {text}") from None
    if not math.isfinite(result):
        raise InputError(f"a finite number is needed, not {result}")
    if abs(result) > LARGEST:
        raise InputError(f"a number up to {LARGEST:g} is needed, not {result:g}")
    return result


def name(value: str) -> str:
    """Return a valid name."""
    if not isinstance(value, str) or not NAME.match(value) or len(value) > 64:
        raise InputError(f"'{shorten(str(value), 30)}' is not a name", hint=NAME_RULE)
    return value


def text(value: Any) -> str:
    if not isinstance(value, str):
        raise InputError(f"a text is needed, not {describe(value)}")
    return value


def law(value: str) -> str:
    """Return the text of a checked expression of the time."""
    parse(text(value))
    return str(value)


def whole(value: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value <= 0:
        raise InputError(f"a whole number above 0 is needed, not {describe(value)}")
    return value


def natural(value: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise InputError(f"0 or a whole number above it is needed, not {describe(value)}")
    return value


def flag(value: bool) -> bool:
    if not isinstance(value, bool):
        raise InputError(f"true or false is needed, not {describe(value)}")
    return value


def numbers(value: Sequence[float | str]) -> tuple[Number, ...]:
    return tuple(each(sequence(value), number))


def pair(value: object) -> tuple[Number, ...]:
    items = sequence(value)
    if len(items) != 2:
        raise InputError(f"two numbers are needed, not {len(items)}")
    return numbers(items)


def components(value: Sequence[float | str]) -> tuple[Number, ...]:
    """Return two or three numbers: a vector of the plane or of space."""
    items = sequence(value)
    return numbers(items) if len(items) == 3 else pair(items)


def names(value: Sequence[str]) -> tuple[str, ...]:
    return tuple(each(sequence(value), text))


def points(value: object) -> Table[tuple[Number, ...]]:
    """Return a table of points: name -> coordinates in the body's frame."""
    return Table(entries(value, lambda item: numbers(sequence(item))))


def numbers_by_name(value: object) -> Table[Number]:
    return Table(entries(value, number))


def numbers_by_coordinate(value: object) -> Table[Number]:
    """Return a table whose keys may be dotted (``slider.C.x``)."""
    return Table(entries(value, number, check=text))


def reference(value: str) -> str:
    """Return ``body.point``."""
    parts = text(value).split(".")
    if len(parts) != 2 or not all(NAME.match(part) for part in parts):
        raise InputError(f"'{shorten(str(value), 40)}' is not a reference 'body.point'")
    return str(value)


def free(value: object) -> Any:
    """Return nested plain data as immutable values (tables and tuples)."""
    if isinstance(value, Mapping):
        return Table({text(k): free(v) for k, v in value.items()})
    if isinstance(value, Sequence) and not isinstance(value, str):
        return tuple(free(item) for item in value)
    if isinstance(value, float) and not math.isfinite(value):
        raise InputError(f"a finite number is needed, not {value}")
    return value


def sequence(value: Any) -> Sequence[Any]:
    if isinstance(value, str) or not isinstance(value, Sequence):
        if hasattr(value, "tolist"):
            return sequence(value.tolist())
        raise InputError(
            f"a list is needed, not {describe(value)}", hint="square brackets, also for one value"
        )
    return value


def each(items: Sequence[object], coerce: Callable[[Any], Any]) -> list[Any]:
    """Return what `coerce` makes of each item; errors name its place."""
    result = []
    for position, item in enumerate(items):
        try:
            result.append(coerce(item))
        except MechdaeError as problem:
            raise problem.inside(f"[{position}]") from None
    return result


def entries(value: Any, coerce: Callable[[Any], Any], check: Callable[[Any], str] = name) -> Json:
    """Return a table of what `coerce` makes of each entry; errors name the key."""
    if not isinstance(value, Mapping):
        raise InputError(f"a table is needed, not {describe(value)}")
    result = {}
    for entry, item in value.items():
        try:
            result[check(entry)] = coerce(item)
        except MechdaeError as problem:
            raise problem.inside(shorten(str(entry), 30)) from None
    return result


def describe(value: float | str | list[float]) -> str:
    """Return what a wrong value is, for a message."""
    if isinstance(value, Mapping):
        return "a table"
    if isinstance(value, list | tuple):
        return "a list"
    return shorten(repr(value), 30)


RARE = "mechdae.describe.rare_values"
"""It knows kinds of values: those that few descriptions have."""


class Coercions(dict[str, Callable[[Any], Any]]):
    """What makes a value of a kind; the rare ones enter themselves when one is asked for."""

    def __missing__(self, kind: str) -> Callable[[Any], Any]:
        self.update(import_module(RARE).COERCE)
        if kind not in self:
            raise KeyError(kind)
        return self[kind]


COERCE = Coercions(
    {
        "number": number,
        "expression": number,
        "name": name,
        "text": text,
        "law": law,
        "whole": whole,
        "natural": natural,
        "flag": flag,
        "numbers": numbers,
        "pair": pair,
        "components": components,
        "names": names,
        "points": points,
        "outline": names,
        "table": numbers_by_name,
        "coordinates": numbers_by_coordinate,
        "reference": reference,
        "free": free,
    }
)
