"""Repetition: cells of a problem file that stand once for k = 1, 2, ..., count.

The tables of a file are expanded before anything else reads them, so that a repeated part
is a part like any other. Braces hold a whole number: ``{k}``, ``{k-1}``, ``{2*k}`` inside of
a cell, sizes (``{N}``) everywhere.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any

from mechdae.describe.expression import evaluate, names_in
from mechdae.describe.file.reading import plain, split_unit
from mechdae.describe.mechanism import MAX_BODIES
from mechdae.describe.values import NAME, NAME_RULE, Number, Table, describe, free
from mechdae.errors import InputError, MechdaeError, UnknownName, shorten
from mechdae.records import dataclass

if TYPE_CHECKING:
    from mechdae.types import Json


INDEX = "k"
MAX_COUNT = 2000
"""Copies of one cell."""
MAX_TEXT = 10_000_000
"""Characters that all copies of all cells may have together."""
NAMED = ("bodies", "joints", "loads", "outputs", "vectors", "loops", "nodes")
"""Sections of a cell whose keys are names as they stand; keys of the others may carry units."""
SECTIONS = ("ground", *NAMED, "sketch", "parameters")
Read = Callable[[Mapping[str, Any], str], Any]
"""Makes a problem of the tables of a file and a name."""
KEYS = ("count", "from", *SECTIONS)
TEXTS = {"expected": "source", "loads": "file"}
"""Texts in which a brace is a brace; title and source of the whole file too."""
BRACES = re.compile(r"\{([^{}]*)\}")


# -- what a problem keeps of its file ------------------------------------------------------------


@dataclass(frozen=True)
class Pattern:
    """The tables of a file with repetition as they were typed, and what was set since.

    ``settings`` are numbers that no table holds, such as the length of a single copy; ``read``
    makes a problem of tables and a name.
    """

    tables: Table[Any]
    read: Read = field(compare=False, repr=False)
    settings: Table[Number] = field(default_factory=Table)

    @property
    def sizes(self) -> Table[int]:
        """The sizes by name."""
        sizes: Table[int] = self.tables.get("sizes", Table())
        return sizes

    def data(self) -> dict[str, Any]:
        """Return the tables as the parser of TOML gives them."""
        result: Json = _thawed(self.tables)
        return result

    def problem(self, name: str) -> Any:
        """Return the problem as the pattern alone describes it."""
        return self.read(self.data(), name).with_values(self.settings)

    def blame(self, error: MechdaeError) -> None:
        """Let an error about a copy name the cell it was typed in, and k."""
        expand(self.data()).blame(error)

    def with_size(self, name: str, value: object) -> Pattern:
        """Return the pattern with a size set to a whole number, or an expression over sizes."""
        sizes = self.sizes.with_(name, _whole(value, self.sizes))
        return replace(self, tables=self.tables.with_("sizes", sizes))

    def with_number(self, name: str, number: Number) -> Pattern:
        """Return the pattern with a parameter, or a number of one part, set."""
        parameters = self.tables.get("parameters", {})
        typed = next((key for key in parameters if split_unit(key)[0] == name), None)
        if typed is None:
            return replace(self, settings=self.settings.with_(name, number))
        changed = [(name, number) if key == typed else (key, v) for key, v in parameters.items()]
        return replace(self, tables=self.tables.with_("parameters", Table(changed)))


def pattern_of(data: Mapping[str, Any], read: Read) -> Pattern | None:
    """Return the pattern of a file that repeats or has sizes, None for any other."""
    return Pattern(free(data), read) if data.get("repeat") or data.get("sizes") else None


def _thawed(value: object) -> Any:
    if isinstance(value, Mapping):
        return {key: _thawed(item) for key, item in value.items()}
    return [_thawed(item) for item in value] if isinstance(value, tuple) else value


# -- expansion -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Expanded:
    """Tables without repetition, and the key paths in the file of what was copied."""

    tables: Json
    sizes: Mapping[str, int]
    origins: Mapping[tuple[str, str], tuple[str, str]]

    def blame(self, error: MechdaeError) -> None:
        """Let an error about a copy name the cell it was typed in, and k."""
        section, _, rest = error.where.partition(".")
        rest = rest.removeprefix("points.") if section == "ground" else rest
        for name in (rest, rest.partition(".")[0]):
            if (section, name) in self.origins:
                place, turn = self.origins[section, name]
                error.where = f"{place}{rest.removeprefix(name)} {turn}"
                break
        else:
            for part in ("bodies", "joints"):  # an automatic name, rocker3.C.x
                place, turn = self.origins.get((part, section), ("", ""))
                error.where += f" ({place} {turn})" if place else ""
        for name in (*self.sizes, INDEX):
            if error.what in (f"unknown parameter '{name}'", f"unknown name '{name}'"):
                word = "the number of the copy" if name == INDEX else "a size"
                error.hint = f"{word} is written in braces: {{{name}}}"


def expand(data: Mapping[str, Any]) -> Expanded:
    """Return the tables of a file with its cells written out.

    Raises
    ------
    InputError
        An unknown size, a count that is no whole number from 0 to `MAX_COUNT`, braces that
        hold no whole number, names made twice; with the key path and k.
    """
    sizes = _sizes(data)
    tables = {
        section: value
        if section in ("title", "source")
        else Filling(sizes, TEXTS.get(section)).value(value, section)
        for section, value in data.items()
        if section not in ("sizes", "repeat")
    }
    origins: dict[tuple[str, str], tuple[str, str]] = {}
    room = MAX_TEXT
    for name, cell in _table(data.get("repeat", {}), "repeat").items():
        place = f"repeat.{name}"
        turns = _turns(_table(cell, place), sizes, place)
        room -= len(turns) * len(repr(cell))
        if room < 0:
            raise InputError(
                f"the copies have more than {MAX_TEXT} characters together", where=place
            )
        for section in SECTIONS:
            if section in cell:
                _copy(tables, origins, section, cell[section], turns, sizes, place)
    return Expanded(tables, sizes, origins)


def _sizes(data: Mapping[str, Any]) -> dict[str, int]:
    known = {split_unit(key)[0] for key in _table(data.get("parameters", {}), "parameters")}
    sizes: dict[str, int] = {}
    for name, value in _table(data.get("sizes", {}), "sizes").items():
        try:
            if not NAME.match(name):
                raise InputError(f"'{shorten(name, 30)}' is not a name", hint=NAME_RULE)
            if name == INDEX:
                raise InputError(f"'{name}' is the number of the copy", hint="rename the size")
            if name in known:
                raise InputError(f"'{name}' is a parameter too", hint="rename one of them")
            if isinstance(value, str):
                raise InputError(f"a whole number is needed, not {describe(value)}")
            sizes[name] = _whole(value, {})
        except MechdaeError as problem:
            raise problem.inside(f"sizes.{shorten(name, 30)}") from None
    return sizes


def _turns(cell: Mapping[str, int | str | Json], sizes: Mapping[str, int], place: str) -> range:
    """Return the values of k."""
    for key in cell:
        if key not in KEYS:
            raise UnknownName("key", key, KEYS, where=place)
    if "count" not in cell:
        raise InputError("the key 'count' is missing", where=place, hint='count = "N"')
    key = "count"
    try:
        count = _whole(cell["count"], sizes)
        if count < 0:
            raise InputError(f"{count} copies: the count must not be negative")
        if count > MAX_COUNT:
            raise InputError(f"{count} copies, at most {MAX_COUNT} are made")
        bodies = count * len(_table(cell.get("bodies", {}), "bodies"))
        if bodies > MAX_BODIES:
            raise InputError(f"{count} copies have {bodies} bodies, at most {MAX_BODIES} may be")
        key = "from"
        first = _whole(cell.get("from", 1), sizes)
    except MechdaeError as problem:
        raise problem.inside(f"{place}.{key}") from None
    return range(first, first + count)


def _copy(
    tables: Json,
    origins: dict[tuple[str, str], tuple[str, str]],
    section: str,
    entries: Any,
    turns: range,
    sizes: Mapping[str, int],
    cell: str,
) -> None:
    """Put all copies of one section of a cell into the tables."""
    place = f"{cell}.{section}"
    into = dict(_table(tables.get(section, {}), section))
    if section == "ground":
        entries, place = _points(entries, place), f"{place}.points"
        rest = {key: value for key, value in into.items() if split_unit(key)[0] != "points"}
        into = _points(into, "ground")
        tables[section] = {**rest, "points": into}
    else:
        entries = _table(entries, place)
        tables[section] = into

    def base(key: str) -> str:
        return key if section in NAMED else split_unit(key)[0]

    taken = {base(key): f"{section}.{key}" for key in into}
    for k in turns:
        turn = f"({INDEX} = {k})"
        filling = Filling({**sizes, INDEX: k}, TEXTS.get(section), turn)
        for key, value in entries.items():
            here = f"{place}.{key}"
            new = filling.key(key, here)
            if base(new) in taken:
                raise InputError(
                    f"the name '{base(new)}' is made twice, also by {taken[base(new)]}",
                    where=f"{here} {turn}",
                    hint=f"copies need different names: put {{{INDEX}}} into this one",
                )
            taken[base(new)] = f"{here} {turn}"
            into[new] = filling.value(value, here)
            origins[section, new] = origins[section, base(new)] = (here, turn)


def _points(ground: dict[str, dict[str, list[int | str]]], place: str) -> dict[str, Any]:
    """Return the points of a ground with units resolved."""
    try:
        points = plain(ground, {"points": None}).get("points", {})
        return dict(_table(points, "points"))
    except MechdaeError as problem:
        raise problem.inside(place) from None


def _table(value: object, place: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise InputError("a table is needed", where=place)
    return value


# -- braces --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Filling:
    """Puts the numbers of `names` in the place of braces; `text` is a key that keeps its own."""

    names: Mapping[str, int]
    text: str | None = None
    turn: str = ""

    def value(self, value: object, place: str) -> Any:
        """Return the value with its braces filled, keys of tables included."""
        if isinstance(value, str):
            alone = BRACES.fullmatch(value)
            return self._number(alone[1], place) if alone else self._text(value, place)
        if isinstance(value, Mapping):
            result: Json = {}
            for key, item in value.items():
                here = f"{place}.{key}"
                new = self.key(key, here)
                if new in result:
                    raise InputError(f"the name '{new}' is made twice", where=self._at(here))
                is_text = key == self.text and isinstance(item, str)
                result[new] = item if is_text else self.value(item, here)
            return result
        if isinstance(value, list):
            return [self.value(item, f"{place}[{i}]") for i, item in enumerate(value)]
        return value

    def key(self, key: str, place: str) -> str:
        """Return a key with its braces filled."""
        result = self._text(key, place)
        if "(-" in result and "(-" not in key:
            raise InputError(
                f"'{result}' is no name: the number in braces is negative", where=self._at(place)
            )
        return result

    def _text(self, text: str, place: str) -> str:
        """Return the text with each brace replaced; negative numbers get parentheses."""
        if "{" not in text and "}" not in text:
            return text

        def put(found: re.Match[str]) -> str:
            number = self._number(found[1], place)
            return str(number) if number >= 0 else f"({number})"

        result = BRACES.sub(put, text)
        if "{" in result or "}" in result:
            raise InputError(
                f"'{shorten(text, 40)}' has a brace without its partner", where=self._at(place)
            )
        return result

    def _number(self, text: str, place: str) -> int:
        """Return the whole number that stands in braces."""
        try:
            if INDEX not in self.names and INDEX in names_in(text or "0"):
                raise InputError(
                    f"{{{shorten(text, 30)}}} stands outside of a repetition",
                    hint=f"{INDEX} counts the copies inside of [repeat.NAME]; sizes may be used "
                    "everywhere",
                )
            return _whole(text, self.names)
        except MechdaeError as problem:
            problem.where = self._at(place)
            raise

    def _at(self, place: str) -> str:
        return f"{place} {self.turn}" if self.turn else place


def _whole(value: Any, names: Mapping[str, int]) -> int:
    """Return a whole number, or the one that an expression over `names` gives."""
    shown = describe(value)
    if isinstance(value, str):
        inside = BRACES.fullmatch(value.strip())
        text = (inside[1] if inside else value).strip()
        if not text:
            raise InputError("the braces are empty", hint=f"{{{INDEX}}} or {{{INDEX}-1}}")
        for used in sorted(names_in(text)):
            if used not in names:
                raise UnknownName("size", used, names)
        value = evaluate(text, {name: float(number) for name, number in names.items()})
        shown = f"{shorten(text, 30)} = {value:g}"
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"a whole number is needed, not {shown}")
    if not abs(value) < 2**53 or value != int(value):
        raise InputError(f"a whole number is needed, not {shown}")
    return int(value)
