"""Sensitivities as text that fits a terminal."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from mechdae.results import Result, ShownUnit, per
from mechdae.results.columns import components
from mechdae.results.tables.text import Column, cells, fitted_lines, in_unit, size_of
from mechdae.types import Floats

ROWS = 13


def derivatives_text(result: Result, width: int) -> str:
    """Return derivatives of each path by each parameter, and what tolerances do to it."""
    lines = [f"{result.problem} / {result.task} (sensitivity of {result.summary['of']})"]
    for path, value in result.data["values"].items():
        lines += ["", f"  {path}"]
        scale = _Scale(result, path)
        named = [scale("value", value)]
        slopes = result.data["derivatives"][path].items()
        named += [scale(f"d/d {name}", slope, name) for name, slope in slopes]
        for pair, second in result.data.get("second", {}).get(path, {}).items():
            first, other = pair.split(",")
            word = f"{first}2" if first == other else f"{first} d {other}"
            named.append(scale(f"d2/d {word}", second, first, other))
        lines += _columns(result, path, named, width)
        lines += ["    (SI where no unit is named)"] if scale.unknown else []
        errors = result.data.get("estimated_error", {}).get(path)
        if errors:
            worst = max(
                float(np.max(scale(name, error, name)[1])) for name, error in errors.items()
            )
            lines.append(f"    by differences, error about {worst:.1g}")
        spread = result.data.get("tolerances", {}).get(path)
        if spread:
            lines += _spread(result, path, spread, scale.own)
    return "\n".join(lines) + "\n"


class _Scale:
    """Brings values of a path and their derivatives to the units that results are shown in."""

    def __init__(self, result: Result, path: str) -> None:
        self.units = result.units
        self.own = result.units.of(result.path_unit(path))
        self._given, self.unknown = result.summary.get("units", {}), False

    def __call__(self, title: str, values: Floats | float, *by: str) -> tuple[str, Floats | float]:
        """Return title with unit, and values; ``by`` are the parameters of a derivative.

        They stay in SI, without a unit, where one of the units is not known.
        """
        below = [self.units.of(self._given.get(name, "")) for name in by]
        if not all(unit.name for unit in (self.own, *below)):
            self.unknown = self.unknown or bool(self.units)
            return title, values
        scale = per(self.own, *below)
        unit = f" [{scale.name}]" if scale.name != "1" else ""
        return title + unit, np.asarray(values) * scale.factor


def _columns(
    result: Result, path: str, named: list[tuple[str, Floats | float]], width: int
) -> list[str]:
    """Return a table whose rows are poses (or numbers of a list), columns the values."""
    for_poses = path in result.summary["exact"]
    head: list[Column] = []
    count = len(result.status) if for_poses else 0
    if for_poses:
        for coordinate, series in result.drivers.items():
            shown = result.units.read(result.unit("drivers", coordinate, "position"))
            values = series.position * shown.factor
            head.append((f"{coordinate} [{shown.name}]", cells(values, size_of(values))))
    columns = []
    for title, array in named:
        whole = np.asarray(array)
        for word, column in _parts(title, whole, for_poses, path.rpartition("/")[2]):
            columns.append((word, cells(column, size_of(whole), digits=9)))
    rows = list(range(len(columns[0][1])))
    if for_poses and count > ROWS:
        rows = sorted({round(k) for k in np.linspace(0, count - 1, ROWS).tolist()})
    given = [([title], cells) for title, cells in [*head, *columns]]
    lines, _ = fitted_lines(given, rows, width, lead=len(head))
    if for_poses and count > ROWS:
        lines.append(f"    ({ROWS} of {count} poses shown; --out DIR writes all)")
    return lines


def _parts(title: str, array: Floats, for_poses: bool, word: str) -> Iterator[tuple[str, Floats]]:
    if not for_poses:
        yield title, array.reshape(-1)
        return
    name, bracket, unit = title.partition(" [")
    for part, _, column in components(name, word, array, ""):
        yield f"{part}{bracket}{unit}", column


def _spread(result: Result, path: str, spread: dict[str, Any], own: ShownUnit) -> list[str]:
    """Return the three estimates side by side, at the pose where they are largest."""
    sampled = spread["monte_carlo"]
    size = np.abs(np.asarray(spread["worst_case"]))
    place = np.unravel_index(int(np.nanargmax(size)), size.shape) if size.ndim else ()

    def at(values: Floats | float) -> float:
        return float(np.asarray(values)[place]) * own.factor

    where = f" [{own.name}]" if result.units and own.name not in ("", "1") else ""
    if place and path in result.summary["exact"]:
        for coordinate, series in result.drivers.items():
            si = result.unit("drivers", coordinate, "position")
            shown = in_unit(series.position[place[0]], si, 6, result.units)
            where += f" (largest, at {coordinate} = {shown})"
    return [
        f"    tolerances{where}:",
        f"      first order       +- {at(spread['first_order']):.6g} (standard deviation)",
        f"      worst case        +- {at(spread['worst_case']):.6g} (all at their ends)",
        f"      {sampled['samples']} sampled      +- {at(sampled['std']):.6g} (standard "
        f"deviation), {at(sampled['min']):.9g} .. {at(sampled['max']):.9g}",
    ]
