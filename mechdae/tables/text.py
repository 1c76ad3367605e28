"""Numbers and columns as text."""

from __future__ import annotations

import math
import textwrap
from typing import Any

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

Column = tuple[str, list[str]]


def cells(values: Any, size: float = 0.0) -> list[str]:
    """Return the numbers as text; what is rounding noise beside `size` as 0."""
    clean = np.where(np.abs(values) < 1e-14 * size, 0.0, values)
    return [f"{value:.6g}" if np.isfinite(value) else "-" for value in clean]


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
