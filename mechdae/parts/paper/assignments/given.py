"""What links, joints and loads of a file are given with, in words and units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields
from math import degrees, isclose, pi
from typing import Any

from mechdae.describe import Mechanism
from mechdae.describe.coordinates import coordinate_unit
from mechdae.describe.file.writing import given
from mechdae.describe.loads import Force, Load, Resistance, Spring, TableLoad, Torque
from mechdae.describe.values import Value
from mechdae.parts.paper.phrases import Phrases

SIGNIFICANT = 6
"""Digits of a number that was not drawn."""


def text(value: Any) -> str:
    """Return a number or an expression of the file, a place as (x; y)."""
    if isinstance(value, float):
        return signed(f"{value:.{SIGNIFICANT}g}")
    if isinstance(value, str | int):
        return str(value)
    if isinstance(value, Mapping):
        return ", ".join(f"{key} = {text(inner)}" for key, inner in value.items())
    return f"({'; '.join(text(inner) for inner in value)})"


def in_turns(speed: float) -> tuple[float, str]:
    """Return an angular speed [rad/s] with its unit: turns a minute where these are rounder."""
    turns = speed * 30 / pi
    found = float(f"{turns:.{SIGNIFICANT}g}")
    exact = isclose(found, turns, rel_tol=1e-12) and float(f"{speed:.{SIGNIFICANT}g}") != speed
    return (found, "rpm") if exact else (speed, "rad/s")


def signed(digits: str) -> str:
    """Return digits with a typographic minus."""
    return digits.replace("-", "−")


def amount(value: float | str, unit: str | None, say: Phrases) -> str:
    """Return a number with its unit, angles in degrees; an expression's numbers have their own."""
    if isinstance(value, str) or unit in (None, "", "1"):
        return text(value)
    if unit == "rad" and isinstance(value, int | float):
        return f"{text(float(f'{degrees(value):.{SIGNIFICANT}g}'))}°"
    return f"{text(value)} {say.unit(unit)}"


def facts(value: Value, skip: tuple[str, ...], say: Phrases) -> str:
    """Return what a link or a joint is given with, each number by its word and in its unit."""
    units = {entry.name: entry.metadata.get("unit") for entry in fields(value)}
    found = given(value, skip=skip)
    if getattr(value, "straight", False):  # a guide has a direction, also that which is usual
        found = {"axis": getattr(value, "axis", 0.0)} | found
    parts = [f"{say.kind(key)} = {amount(v, units.get(key), say)}" for key, v in found.items()]
    return ", ".join(parts)


def load_text(mechanism: Mechanism, load: Load, say: Phrases) -> str:
    """Return a load in words: where it acts, in which direction, how large it is."""
    return ", ".join(_load_parts(mechanism, load, say))


def _load_parts(mechanism: Mechanism, load: Load, say: Phrases) -> Iterator[str]:
    if isinstance(load, Force | Torque):
        if isinstance(load, Force):
            yield say("force at", load.point)
        else:
            yield say("torque on", load.body)
        unit = "N" if isinstance(load, Force) else "N m"
        values = load.value if isinstance(load.value, tuple) else (load.value,)
        letter = "F" if isinstance(load, Force) else "M"
        for axis, value in zip(mechanism.axes if len(values) > 1 else [""], values, strict=False):
            yield f"{letter}{axis} = {amount(value, unit, say)}"
        if load.frame != "world":
            yield say("axes of", load.frame)
    elif isinstance(load, Resistance):
        unit = _effort(mechanism, load.coordinate)
        for word, value in (("grows", load.positive), ("falls", load.negative)):
            if value != 0.0:
                yield say(f"against {word}", load.coordinate, amount(value, unit, say))
    elif isinstance(load, Spring):
        yield from _spring(mechanism, load, say)
    else:
        coordinate = getattr(load, "coordinate", "")
        yield say("by table", coordinate, load.file or "") if isinstance(load, TableLoad) else ""


def _spring(mechanism: Mechanism, load: Spring, say: Phrases) -> Iterator[str]:
    of = load.coordinate or " - ".join(load.between or ())
    yield say("spring", of)
    turns = bool(load.coordinate) and coordinate_unit(mechanism, str(load.coordinate)) == "rad"
    force, length = ("N m", "rad") if turns else ("N", "m")
    units = {"stiffness": f"{force}/{length}", "damping": f"{force} s/{length}", "preload": force}
    for key, value in given(load, skip=("name", "between", "coordinate")).items():
        if key != "kind":
            yield f"{say.kind(key)} = {amount(value, units.get(key, length), say)}"


def _effort(mechanism: Mechanism, name: str) -> str:
    return "N m" if coordinate_unit(mechanism, name) == "rad" else "N"
