"""Numbers and verdicts as text, for the page of articles."""

from __future__ import annotations

from typing import Any

import numpy as np

NOISE = 1e-14
"""Relative change of a number that must not change the page."""


def text(value: float, digits: int = 12, noise: float = NOISE) -> str:
    """Return a number to so many significant digits, fewer where noise would change them."""
    value = float(value)
    if abs(value) < 1e-13:
        return "0"
    while digits > 1 and len({f"{value * (1 + s * noise):.{digits}g}" for s in (-1, 1)}) > 1:
        digits -= 1
    return f"{value:.{digits}g}".replace("-", "−")


def fixed(value: float, places: int) -> str:
    """Return a number to so many decimal places."""
    return f"{value:.{places}f}".replace("-", "−")


def percent(printed: float, true: float) -> str:
    """Return a signed deviation in per cent with three decimals."""
    shown = f"{100 * (printed - true) / true:+.3f}"
    return "0.000" if float(shown) == 0 else shown.replace("-", "−")


def sign(printed: str) -> str:
    """Return a printed number with a true minus sign."""
    return printed.replace("-", "−")


def below(value: float, limit: float) -> str:
    """Return the limit a residual stays below; it is an error when it does not.

    Raises
    ------
    ArithmeticError
        The residual is larger.
    """
    if not value < limit:
        raise ArithmeticError(f"{value} is not below {limit}")
    return f"below 10⁻{superscript(round(-np.log10(limit)))}"


def superscript(number: int) -> str:
    return str(number).translate(str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹"))


def table(head: str, rows: list[list[str]]) -> list[str]:
    """Return the lines of a table; `head` has the titles separated by bars."""
    titles = [title.strip() for title in head.split("|")]
    lines = ["| " + " | ".join(titles) + " |", "|" + "---|" * len(titles)]
    return lines + ["| " + " | ".join(row) + " |" for row in rows] + [""]


def unit_of(printed: str) -> float:
    """Return the unit of the last printed digit."""
    return 10.0 ** -(len(printed.split(".")[1]) if "." in printed else 0)


def verdict(printed: str, true: float) -> str:
    """Return the verdict on a printed number by the rule stated on the page."""
    gap = abs(float(printed) - true)
    if gap <= 0.5 * unit_of(printed) * (1 + 1e-9):
        return "exact to print"
    if gap <= 2 * unit_of(printed) and gap <= 0.01 * abs(true):
        return "rounding"
    return "**deviates**"


def cosd(angle: float) -> float:
    return float(np.cos(np.radians(angle)))


def sind(angle: float) -> float:
    return float(np.sin(np.radians(angle)))


def unit(angle: float) -> Any:
    """Return the unit vector at an angle in degrees."""
    return np.array([cosd(angle), sind(angle)])


def places(rows: list[tuple[str, ...]]) -> list[str]:
    """Return the lines that say where each part of an article is found: name, place, pictures."""
    found = []
    for what, where, *plots in rows:
        links = [f"[{plot}](../../../plots/{plot}.svg)" for plot in plots]
        found.append([what, where, ", ".join(links) or "–"])
    return ["### Where everything is", "", *table("in the article | here | picture", found)]
