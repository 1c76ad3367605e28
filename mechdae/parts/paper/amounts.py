"""Numbers and expressions of a problem as texts, in the units that a paper shows."""

from __future__ import annotations

from collections.abc import Mapping
from math import isclose, pi
from typing import Any

from mechdae.describe.units import Units
from mechdae.draw.formulas.notations import RAISED
from mechdae.parts.paper.explanations.localised import named
from mechdae.parts.paper.phrases import Phrases

Given = float | str | tuple["Given", ...] | Mapping[str, "Given"]
SIGNIFICANT = 6
"""Digits of a number that was not drawn."""


def given_text(value: Any) -> str:
    """Return a number or an expression of the file, a place as (x; y)."""
    if isinstance(value, float):
        return signed(f"{value:.{SIGNIFICANT}g}")
    if isinstance(value, str | int):
        return str(value)
    if isinstance(value, Mapping):
        return ", ".join(f"{key} = {given_text(inner)}" for key, inner in value.items())
    return f"({'; '.join(given_text(inner) for inner in value)})"


def shown(value: Given, si: str, units: Units) -> tuple[Given, str]:
    """Return a number, or a list of numbers and expressions, with the unit it is shown in."""
    unit = units.read(si)
    if unit.name == "rad/s" and isinstance(value, float):
        return in_turns(value)
    name = "°" if unit.name == "deg" else named(si, units)
    if isinstance(value, tuple):
        return tuple(shown(inner, si, units)[0] for inner in value), name
    if isinstance(value, Mapping):
        return {key: shown(inner, si, units)[0] for key, inner in value.items()}, name
    return (value if isinstance(value, str) else value * unit.factor), name


def in_turns(speed: float) -> tuple[float, str]:
    """Return an angular speed [rad/s] with its unit: turns a minute where these are rounder."""
    turns = speed * 30 / pi
    found = float(f"{turns:.{SIGNIFICANT}g}")
    exact = isclose(found, turns, rel_tol=1e-12) and float(f"{speed:.{SIGNIFICANT}g}") != speed
    return (found, "rpm") if exact else (speed, "rad/s")


def signed(digits: str) -> str:
    """Return digits with a typographic minus, a power of ten as such: 4e+07 as 4·10⁷."""
    digits, _, power = digits.partition("e")
    return digits.replace("-", "−") + (f"·10{str(int(power)).translate(RAISED)}" if power else "")


def amount(value: float | str, unit: str | None, say: Phrases) -> str:
    """Return a number with its unit; an expression's numbers have their own."""
    if isinstance(value, str) or unit in (None, "", "1"):
        return given_text(value)
    number, name = shown(value, str(unit), say.units)
    return f"{given_text(number)}°" if name == "°" else f"{given_text(number)} {say.unit(name)}"
