"""From the tables of a problem file to descriptions: keys, units, types, places of errors."""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import fields
from fractions import Fraction
from importlib import import_module
from typing import TYPE_CHECKING, Any, TypeVar

from mechdae.describe.units import EVERY, UNITS, Unit
from mechdae.describe.values import (
    COERCE,
    WITH_UNIT,
    Value,
    describe,
    each,
    sequence,
)
from mechdae.errors import InputError, MechdaeError
from mechdae.records import dataclass

if TYPE_CHECKING:
    from mechdae.types import Json

HINTS = "mechdae.describe.file.key_hints"
"""It knows keys and their units: what may have been meant by one that is none."""
T = TypeVar("T", bound=Value)


@dataclass(frozen=True)
class Nested:
    """Descriptions inside of others: one class, or several that ``kind`` tells apart.

    Python gives ``tables`` for them too, or must make the values. ``hint`` is for what is none, of
    ``several`` ``one`` for what is none of them.
    """

    what: str
    classes: Mapping[str, type[Value]]
    hint: str = ""
    several: bool = False
    tables: bool = True
    one: str = ""

    def coerce(self, value: object) -> Any:
        """Return the description, or all of them, that Python gave."""
        if not self.several:
            return self._one(value, self.tables)
        if isinstance(value, Value):
            raise InputError(f"a list of {self.what}s is needed, not one", hint=self.hint)
        return tuple(each(sequence(value), lambda item: self._one(item, self.tables)))

    def typed(self, value: object) -> Any:
        """Return the description, or all of them, that a file holds."""
        if not self.several:
            return self._one(value, True)
        if not isinstance(value, Sequence) or isinstance(value, str):
            raise InputError(f"a list of {self.what}s is needed", hint=self.hint)
        return tuple(each(value, lambda item: self._one(item, True)))

    def _one(self, value: Any, tables: bool) -> Any:
        if isinstance(value, tuple(self.classes.values())):
            return value
        if not isinstance(value, Mapping) or not tables:
            hint = self.one or self.hint
            raise InputError(f"a {self.what} is needed, not {describe(value)}", hint=hint)
        if "" in self.classes:
            return read(self.classes[""], value, "")
        return read(*chosen(value, self.classes, self.what), "")


NESTED: dict[str, Nested] = {}
"""Kinds of values that are descriptions."""


def nest(word: str, nested: Nested) -> None:
    """Let `word` be the kind of a field that holds descriptions."""
    NESTED[word], COERCE[word] = nested, nested.coerce


def chosen(table: object, kinds: Mapping[str, Any], word: str) -> tuple[Any, Json]:
    """Return the class of the kind that a table names, and the table's other entries."""
    if not isinstance(table, Mapping):
        raise InputError("a table is needed")
    kind = table.get("kind")
    if not isinstance(kind, str):
        raise InputError(f"the key 'kind' is missing: {', '.join(kinds)}")
    known = kinds.get(kind)
    if known is None:
        raise import_module(HINTS).unknown_kind(kind, kinds, word)
    return known, {entry: value for entry, value in table.items() if entry != "kind"}


def split_unit(key: str) -> tuple[str, str]:
    """Return the name and the unit suffix ('' without) of a key."""
    fitting = [suffix for suffix in UNITS if key.endswith(suffix) and len(key) > len(suffix)]
    suffix = max(fitting, key=len, default="")
    return key[: len(key) - len(suffix)], suffix


def split_known(key: str, known: Container[str]) -> tuple[str, str]:
    """Return the name and the unit suffix of a key, also one of SI where the name is known."""
    if key in known:
        return key, ""
    base, suffix = split_unit(key)
    if base in known:
        return base, suffix
    for end in sorted(EVERY, key=len, reverse=True):
        if key.endswith(end) and key.removesuffix(end) in known:
            return key.removesuffix(end), end
    return base, suffix


def split_keys(table: Iterable[str], known: Container[str]) -> dict[str, tuple[str, str]]:
    """Return the name and the unit suffix of each key of a table, as `split_known` does."""
    return {key: split_known(key, known) for key in table}


def suffixes(unit: str | None, among: Mapping[str, Unit] = UNITS) -> list[str]:
    """Return the suffixes that fit a unit, "m or rad" too; all of them where it is not known."""
    if unit is None:
        return list(among)
    either = [[s for s in among if one in among[s].si] for one in unit.split(" or ")]
    return [s for one in either for s in one] if all(either) else []


def check_suffix(key: str, unit: str | None, base: str = "") -> None:
    """Raise for a key whose suffix cannot be a unit of its numbers, like ``radius_deg``.

    Where the name before it is known, as `base`, the suffix may be one of SI.
    """
    base, suffix = (base, key.removeprefix(base)) if base else split_unit(key)
    if not suffix or suffix in suffixes(unit, EVERY):
        return
    meaning = "plain numbers" if unit == "1" else f"in {unit}"
    fitting = [f"{base}{other}" for other in suffixes(unit)]
    raise InputError(
        f"the unit '{suffix}' does not fit '{base}'",
        where=key,
        hint=f"{' or '.join([base, *fitting])}; values without a suffix are {meaning}",
    )


Check = tuple[str, Iterable[str], Mapping[str, str | None]]
"""A place, keys there, and the units of what they name; None is one that is not known."""


def check_each(checks: Iterable[Check]) -> None:
    """Raise for a key whose suffix is no unit of what it names."""
    for place, keys, units in checks:
        for key, (base, suffix) in split_keys(keys, units).items():
            unit = units.get(base)
            if suffix and unit is not None:
                try:
                    check_suffix(key, unit, base)
                except MechdaeError as error:
                    raise error.inside(place) from None


def to_si(value: object, suffix: str) -> Any:
    """Return a number, expression, list or table of them converted to SI."""
    if not suffix:
        return value
    unit = EVERY[suffix]
    if isinstance(value, bool):
        raise InputError("a number or an expression is needed")
    if isinstance(value, int | float):
        return _number_in_si(value, unit)
    if isinstance(value, str):
        return unit.pattern.format(value)
    if isinstance(value, list):
        return [to_si(item, suffix) for item in value]
    if isinstance(value, Mapping):
        return {key: to_si(item, suffix) for key, item in value.items()}
    raise InputError(f"a number is needed for a key with the unit '{suffix}'")


def _number_in_si(value: float, unit: Unit) -> float:
    """Return a number in SI.

    Of a unit that is no power of ten the result is the float nearest to the decimal number that
    was typed times the exact size: 3.3 in is what 0.08382 is.
    """
    if unit.suffix == "_deg":
        return math.radians(value)
    size = unit.size
    if unit.pi:
        return value * math.pi * size.numerator / size.denominator
    if size == 1:
        return value
    if size.numerator == 1:
        return value / size.denominator
    if size.denominator == 1 and set(str(size)) <= set("10"):
        return value * size.numerator
    return float(Fraction(repr(value)) * size) if math.isfinite(value) else value


def plain(
    table: object, known: Mapping[str, Any] | None = None, unit: str | None = None
) -> dict[str, Any]:
    """Return the table with unit suffixes resolved, nested tables included.

    With `known`, a key is looked up there first as it is, then without its suffix; an
    unknown one is an error. Both forms of one key are an error too. `unit` is that of all numbers.
    """
    if not isinstance(table, Mapping):
        raise InputError("a table is needed")
    for key in table if unit is not None else ():
        check_suffix(key, unit)
    result: dict[str, Any] = {}
    for key, value in table.items():
        base, suffix = split_unit(key) if known is None else split_known(key, known)
        if known is not None and base not in known:
            raise import_module(HINTS).unknown_key(key, known)
        about = getattr(known[base], "metadata", {}) if known is not None else {}
        if suffix and known is not None:
            if about.get("kind", "number") not in WITH_UNIT:
                plain_unit = about.get("unit")
                raise InputError(
                    f"'{base}' is no number, it has no unit", where=key,
                    hint=f"{base} = ..." + (f", in {plain_unit}" if plain_unit else ""),
                )  # fmt: skip
            check_suffix(key, about.get("unit"), base)
        if base in result:
            raise InputError(f"'{base}' is given twice, with and without a unit")
        kind = about.get("kind", "")
        try:
            if kind in NESTED:
                result[base] = NESTED[kind].typed(value)
                continue
            value = to_si(value, suffix)
            points = kind == "points" and isinstance(value, Mapping)
            result[base] = plain(value, unit="m") if points else nested(value)
        except MechdaeError as problem:
            raise problem.inside(key) from None
    return result


def nested(value: object) -> Any:
    """Return the value with the unit suffixes of nested tables resolved."""
    if isinstance(value, Mapping):
        return plain(value)
    if isinstance(value, list):
        return [nested(item) for item in value]
    return value


def keys_of(kind: type[Value]) -> dict[str, Any]:
    """Return the file keys of a description: key -> field."""
    return {entry.name.rstrip("_"): entry for entry in fields(kind) if "kind" in entry.metadata}


def read(kind: type[T], table: object, place: str, **given: str) -> T:
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
        from_table = getattr(kind, "from_table", None)
        if from_table is not None and isinstance(table, Mapping):
            table = from_table(table)
        values = plain(table, known)
        arguments = {known[key].name: value for key, value in values.items()}
        for key, entry in known.items():
            if key not in values and entry.metadata["required"]:
                raise InputError(f"the key '{key}' is missing", where="" if place else key)
        return kind(**given, **arguments)
    except MechdaeError as problem:
        if problem.where in ("first", "second"):
            problem.where = "between"
        raise (problem.inside(place) if place else problem) from None
