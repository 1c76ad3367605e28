"""The scalar series of a result as columns with names and units: what CSV and NPZ hold."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from mechdae.describe.series_units import (
    IN_SPACE,
    KINDS,
    REACTION,
    UNITS,
    WHOLE,
    centre_unit,
    effort_unit,
    reaction_parts,
)
from mechdae.types import Floats

Column = tuple[str, str, Any]
"""Name, unit, (n,) array."""


def columns_of(result: Any) -> Iterator[Column]:
    """Yield every scalar series of a result, time and drivers first."""
    if result.time is not None:
        yield "time", "s", result.time
    for kind in KINDS:
        for part, series in getattr(result, kind).items():
            for name, array in series.items():
                yield from components(f"{part}.{name}", name, array, result.unit(kind, part, name))
    for word, series in (("effort", result.efforts), *result.parts.items()):
        head = word if word == "effort" else f"effort_{word}"
        for name, array in series.items():
            yield f"{head}.{name}", effort_unit(result.mechanism, name), array
    for name, array in result.scalars.items():
        yield name, UNITS[name], array
    for name, array in result.work.items():
        yield f"work.{name}", "J", array
    if result.parameters:
        units = result.summary.get("units", {})
        for name, array in result.parameters.items():
            yield name, units.get(name, ""), array
    for path, array in result.table.items():
        yield from _flat(path, array, result.path_unit(path))
    for path, slopes in result.data.get("derivatives", {}).items():
        for name, array in slopes.items():
            if np.shape(array)[:1] == np.shape(result.status):
                for word, _, column in _flat(path, np.asarray(array), ""):
                    yield f"d {word} / d {name}", "", column
    yield from _of_designs(result.data.get("designs", ()), result.summary.get("front", {}))
    for pair, array in result.centres.items():
        yield from components(f"centre.{pair}", "centre", array, centre_unit(pair))
    for name, unit in (("length", "m"), ("angle", "rad")):
        if name in result.bound:
            yield f"bound.{name}", unit, result.bound[name]
    if result.condition is not None:
        yield "condition", "1", result.condition


def components(whole: str, name: str, array: Floats, unit: str) -> Iterator[Column]:
    """Yield the components of a series, of a reaction with their own names and units."""
    if array.ndim == 1:
        yield whole, unit, array
    elif name.startswith("reaction"):
        for axis, of_part, column in zip(
            *reaction_parts(name, array.shape[1]), array.T, strict=True
        ):
            yield f"{whole}.{axis}", of_part, column
    else:
        axes = "wxyz" if name == "orientation" else "xyz"
        for axis, column in zip(axes, array.T, strict=False):
            yield f"{whole}.{axis}", unit, column


def _flat(path: str, array: Floats, unit: str) -> Iterator[tuple[str, str, Floats]]:
    """Yield the numbers of each row of a study as columns ``path[i][j]``."""
    word = path.rpartition("/")[2]
    axes: tuple[str, ...] = ()
    if word.startswith("reaction"):
        wide = array.ndim > 1 and array.shape[-1] == len(IN_SPACE[0])
        axes = IN_SPACE[1] if wide else REACTION.get(word[9:], WHOLE)[1]
    for place in np.ndindex(*array.shape[1:]):
        name = path + "".join(f"[{i}]" for i in place)
        shown = axes[place[-1]] if axes and place and place[-1] < len(axes) else unit
        yield name, shown, array[(slice(None), *place)]


def _of_designs(
    designs: Sequence[Mapping[str, Any]], front: Mapping[str, Any]
) -> Iterator[tuple[str, str, Floats]]:
    """Yield objectives, transmission angle, hits and dimensions of the designs of a synthesis."""
    if not designs:
        return
    for k, objective in enumerate(front.get("objectives", ())):
        yield (
            objective["name"],
            objective["unit"],
            np.array([design["objectives"][k] for design in designs]),
        )
    for name, unit in (("objective", ""), ("transmission_angle_min", "rad"), ("hits", "1")):
        values = [design.get(name) for design in designs]
        if any(value is not None for value in values):
            yield name, unit, np.array([np.nan if v is None else float(v) for v in values])
    for name in dict.fromkeys(name for design in designs for name in design["parameters"]):
        yield name, "", np.array([design["parameters"].get(name, np.nan) for design in designs])
