"""How a pose is written as a sketch."""

from __future__ import annotations

import numpy as np

from mechdae.describe.coordinates import unit_of
from mechdae.results.result import Result

ROUNDING = 1e-12
"""Share of the largest component of a place that is shown as zero."""


def sketch_line(name: str, value: list[float] | float) -> str:
    """Return a line of a sketch: a coordinate, or the place of a point."""
    if isinstance(value, list):
        least = ROUNDING * max(map(abs, value))
        shown = [f"{part + 0.0:.5g}" if abs(part) > least else "0" for part in value]
        return f'"{name}" = [{", ".join(shown)}]'
    return f"{name} = {value + 0.0:g}"


def shown_line(result: Result, name: str, value: list[float] | float) -> str:
    """Return a line of a sketch, lengths in the unit of the results."""
    shown, place = result.units.of("m"), isinstance(value, list)
    if shown.factor == 1 or not (place or unit_of(result.mechanism, name) == "m"):
        return sketch_line(name, value)
    return sketch_line(f"{name}_{shown.name}", np.multiply(value, shown.factor).tolist())
