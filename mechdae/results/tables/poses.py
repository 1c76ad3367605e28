"""Poses as text, a row for each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdae.results import Result, mixed_units
from mechdae.results.tables.moving import Quantities
from mechdae.results.tables.text import Column, cells, rows_of


def poses_columns(result: Result) -> list[Column]:
    """Return the columns of a table with a row for each pose, what matters most first."""
    columns: list[Column] = [("status", result.status.tolist())]
    if result.time is not None:
        columns.append(("t [s]", cells(result.time)))
    for coordinate, series in result.drivers.items():
        shown = result.units.read(result.unit("drivers", coordinate, "position"))
        values = series.position * shown.factor
        largest = float(np.max(np.abs(values), initial=0.0))
        columns.append((f"{coordinate} [{shown.name}]", cells(values, largest)))
    moving = Quantities(result)
    named = moving.outputs()
    if result.forces:
        from mechdae.results.tables.forces import force_columns, motion_is_aside

        if motion_is_aside(result):
            return columns + force_columns(result) + named
        named += force_columns(result)
    return columns + named + moving.columns()


def poses_text(result: Result, width: int) -> list[str]:
    """Return a table with a row for each pose that is shown."""
    columns = poses_columns(result)
    places = rows_of(len(result))
    chosen: list[tuple[str, Sequence[str], int]] = []
    used = 2
    for title, texts in columns:
        shown = [texts[k] for k in places]
        size = max(len(title), *map(len, shown)) + 2
        if used + size > width and len(chosen) > 3:
            break
        chosen.append((title, shown, size))
        used += size
    lines = ["  " + "".join(f"{title:>{size}}" for title, _, size in chosen)]
    for k in range(len(places)):
        lines.append("  " + "".join(f"{shown[k]:>{size}}" for _, shown, size in chosen))
    hidden = len(columns) - len(chosen)
    notes = []
    if len(places) < len(result):
        notes.append(f"{len(places)} of {len(result)} poses")
    if hidden > 0:
        notes.append(f"{len(chosen)} of {len(columns)} columns")
    if result.units.asked and (mixed := mixed_units([title for title, _, _ in chosen])):
        lines.append(f"  (units mixed: {mixed})")
    if notes:
        lines.append(f"  ({', '.join(notes)} shown; --out DIR writes all, --json prints all)")
    return lines


def pose_lines(result: Result, width: int) -> list[str]:
    """Return a row for each pose, of a single one a line for each quantity."""
    if len(result) != 1:
        return poses_text(result, width)
    from mechdae.results.tables.one_pose import pose_text

    return pose_text(result)
