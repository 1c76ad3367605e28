"""Numbers and columns as text."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, overload

import numpy as np

from mechdae.results import SI, Units
from mechdae.types import Floats

if TYPE_CHECKING:
    from mechdae.results import Result

ROUNDING = 1e-14
"""Share of the largest number of a kind below which a number is rounding."""
ROWS = 19
"""Poses that are shown."""
WIDE = 100
MOST = 12
"""Entries of a list that are shown."""
KEY = 12
"""Columns before the text of a fact."""

FIXED = "\xa0"
"""A space at which no line breaks."""


class Cells(Sequence[str]):
    """Numbers as text, written when they are looked at; what is not above the noise is 0."""

    def __init__(self, values: Floats, noise: float, digits: int) -> None:
        self._values, self._noise, self._digits = values, noise, digits

    def __len__(self) -> int:
        return len(self._values)

    @overload
    def __getitem__(self, place: int) -> str: ...
    @overload
    def __getitem__(self, place: slice) -> Sequence[str]: ...
    def __getitem__(self, place: int | slice) -> str | Sequence[str]:
        if isinstance(place, slice):
            return [self[k] for k in range(*place.indices(len(self)))]
        value = float(self._values[place])
        if math.isnan(value):
            return "-"
        return f"{zero(value, self._noise):.{self._digits}g}"


Column = tuple[str, Sequence[str]]


def cells(values: Floats, size: float = 0.0, noise: float = 0.0, digits: int = 6) -> Sequence[str]:
    """Return the numbers as text; what is `noise`, or rounding beside `size`, as 0."""
    return Cells(values, max(noise, ROUNDING * size), digits)


def size_of(array: Floats) -> float:
    """Return the largest of some numbers, 0 without any that is finite."""
    return float(np.max(np.abs(array[np.isfinite(array)]), initial=0.0))


def zero(value: float, noise: float) -> float:
    """Return the value, 0 without a sign where it is not above the noise."""
    return 0.0 if abs(value) <= noise else value


def noises(result: Result) -> dict[str, float]:
    """Return up to which size an angle and a length may be rounding: their bounds at least."""
    points = [np.ravel(p.position) for p in result.points.values()]
    bounds = dict(result.bound)
    found = {}
    for kind, size in (("angle", 1.0), ("length", size_of(np.concatenate([*points, np.zeros(1)])))):
        found[kind] = max(size_of(bounds.get(kind, np.zeros(0))), ROUNDING * size)
    return found


def moves(values: Floats) -> bool:
    """Return whether a driver takes different values."""
    return bool(np.size(values) and np.ptp(values) > 0)


def quantity(value: float, kind: str, noise: float = 0.0, units: Units = SI) -> str:
    """Return an angle or a length with its unit."""
    return in_unit(zero(value, noise), "rad" if kind == "angle" else "m", 9, units)


def in_unit(value: float, si: str, digits: int, units: Units) -> str:
    """Return a number with the unit it is shown in."""
    shown = units.read(si)
    return f"{value * shown.factor:.{digits}g} {shown.name}"


def driver_value(
    value: list[float] | float, unit: str | list[str], digits: int = 12, units: Units = SI
) -> str:
    """Return a driver's value with its unit, of several drivers the list of them."""
    if value is None:
        return "none"
    if isinstance(value, list):
        each = unit if isinstance(unit, list) else [unit] * len(value)
        pairs = zip(value, each, strict=True)
        return ", ".join(driver_value(v, u, digits, units) for v, u in pairs)
    unit = unit[0] if isinstance(unit, list) else unit
    value = zero(value, 0.0)
    return in_unit(value, unit, digits, units) if unit in ("rad", "m") else f"{value:.{digits}g}"


def rows_of(count: int, most: int = ROWS) -> list[int]:
    """Return the places of the poses that are shown, evenly spread."""
    spread = np.linspace(0, count - 1, min(most, count))
    return sorted({round(place) for place in spread.tolist()})


def fitted_lines(
    given: Sequence[tuple[Sequence[str], Sequence[str]]],
    rows: Sequence[int],
    width: int,
    needed: int | None = None,
    lead: int = 1,
) -> tuple[list[str], int]:
    """Return the lines of some rows of columns, heads and texts of each, none wider than `width`.

    The first `needed` columns (all without it) are all shown, where they do not fit in several
    tables that begin with the `lead` first ones; of the others as many as there is room for.

    Returns
    -------
    lines, count
        How many columns are shown.
    """
    columns = [[*heads, *[texts[k] for k in rows]] for heads, texts in given]
    sizes = [max(map(len, texts)) + 2 for texts in columns]
    room = width - 2
    tables: list[list[int]] = [[*range(min(lead, len(columns)))]]
    shown, used = len(tables[0]), sum(sizes[: len(tables[0])])
    for k in range(shown, len(columns)):
        size = min(sizes[k], max(room - sum(sizes[:lead]), 8))
        if used + size > room:
            if needed is not None and k >= needed:
                break
            tables.append(tables[0][:lead])
            used = sum(sizes[:lead])
        tables[-1].append(k)
        sizes[k], used, shown = size, used + size, shown + 1
    lines: list[str] = []
    for places in tables:
        lines += [""] if lines else []
        for row in range(len(columns[0])):
            cells = (_short(columns[k][row], sizes[k] - 2).rjust(sizes[k]) for k in places)
            lines.append("  " + "".join(cells))
    return lines, shown


def _short(text: str, size: int) -> str:
    return text if len(text) <= size else f"{text[: size - 1]}…"


def fact(key: str, text: str, width: int = WIDE) -> list[str]:
    """Return what is known under a key, in lines that fit; they break at plain spaces."""
    head = f"  {key:{KEY - 3}} "
    lines = textwrap.wrap(
        text,
        width,
        initial_indent=head,
        subsequent_indent=" " * KEY,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [line.replace(FIXED, " ") for line in lines]


def together(text: str) -> str:
    """Return a text that is not broken into lines."""
    return text.replace(" ", FIXED)
