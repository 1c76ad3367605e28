"""Numbers and columns as text."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import Any, overload

import numpy as np

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
    """Numbers as text, written when they are looked at; rounding noise beside `size` is 0."""

    def __init__(self, values: Any, size: float = 0.0) -> None:
        self._values, self._noise = values, 1e-14 * size

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
        if not math.isfinite(value):
            return "-"
        return f"{0.0 if abs(value) < self._noise else value:.6g}"


Column = tuple[str, Sequence[str]]


def cells(values: Any, size: float = 0.0) -> Sequence[str]:
    """Return the numbers as text; what is rounding noise beside `size` as 0."""
    return Cells(values, size)


def moves(values: Any) -> bool:
    """Return whether a driver takes different values."""
    return bool(np.size(values) and np.ptp(values) > 0)


def quantity(value: float, unit: str) -> str:
    return f"{math.degrees(value):.9g} deg" if unit == "angle" else f"{value:.9g} m"


def driver_value(value: Any, unit: str | list[str], digits: int = 12) -> str:
    """Return a driver's value with its unit, of several drivers the list of them."""
    if value is None:
        return "none"
    if isinstance(value, list):
        units = unit if isinstance(unit, list) else [unit] * len(value)
        return ", ".join(driver_value(v, u, digits) for v, u in zip(value, units, strict=True))
    unit = unit[0] if isinstance(unit, list) else unit
    if unit == "rad":
        return f"{math.degrees(value):.{digits}g} deg"
    return f"{value:.{digits}g}" + (" m" if unit == "m" else "")


def rows_of(count: int) -> list[int]:
    """Return the places of the poses that are shown, evenly spread."""
    spread = np.linspace(0, count - 1, min(ROWS, count))
    return sorted({round(place) for place in spread.tolist()})


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
