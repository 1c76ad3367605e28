"""Units that are read well: degrees, millimetres, kilonewtons."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from mechdae.describe.units import SI, Units
from mechdae.records import dataclass
from mechdae.types import Floats

PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
PREFIXED = ("m", "N", "N m", "W", "J")
"""Units that take a prefix; all others stay as they are."""
DEGREES = 180.0 / np.pi
POWERS = str.maketrans("23", "²³")


@dataclass(frozen=True)
class Scale:
    """A unit to show, and the factor from SI units and radians to it."""

    unit: str
    factor: float = 1.0

    def __call__(self, values: Floats | float) -> Any:
        """Return values in the unit shown."""
        return np.asarray(values, float) * self.factor

    def named(self, text: str) -> str:
        """Return the label of an axis, with the unit."""
        return f"{text} [{raised(self.unit)}]".strip() if self.unit else text

    def text(self, value: float, digits: int = 4) -> str:
        """Return a value with its unit, as it is shown."""
        return f"{number(float(self(value)), digits)} {raised(self.unit)}".rstrip()


def raised(unit: str) -> str:
    """Return a unit as it is written: ``m/s2`` is m/s²."""
    return unit.translate(POWERS)


def scale_of(unit: str, values: Iterable[object] = (), units: Units = SI) -> Scale:
    """Return what values of an SI unit are shown in: as asked for, or by their largest."""
    if unit in units.by_si:
        shown = units.of(unit)
        return Scale(shown.name, shown.factor)
    if unit.startswith("rad"):
        return Scale("deg" + unit[3:], DEGREES) if unit == "rad" else Scale(unit)
    if unit not in PREFIXED:
        return Scale("" if unit == "1" else unit)
    largest = 0.0
    for array in values:
        found = np.abs(np.asarray(array, float))
        largest = max(largest, float(found[np.isfinite(found)].max(initial=0.0)))
    if largest <= 0:
        return Scale(unit)
    power = int(np.floor(np.log10(largest * (1 + 1e-9)) / 3)) * 3
    if unit != "m" and largest >= 0.1:
        power = max(power, 0)
    power = min(max(power, min(PREFIXES)), max(PREFIXES))
    return Scale(PREFIXES[power] + unit, 10.0**-power)


def number(value: float, digits: int = 4) -> str:
    """Return a number with so many digits, with a true minus sign."""
    value = 0.0 if abs(value) < 1e-13 else value
    return f"{value:.{digits}g}".replace("-", "\N{MINUS SIGN}")


def step_of(span: float, most: int) -> float:
    """Return a step for ticks in degrees that divides a turn well."""
    for step in (0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 45, 60, 90, 180, 360, 720, 1440):
        if span / step <= most:
            return float(step)
    return 360.0 * float(np.ceil(span / most / 360.0))
