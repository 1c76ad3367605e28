"""Poses as text: one quantity per line, or a row for each pose."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from mechdae.results import KINDS, Result
from mechdae.tables.forces import force_columns, is_force, motion_is_aside, single_forces
from mechdae.tables.text import Column, cells, rows_of


def pose_text(result: Result) -> list[str]:
    """Return one quantity per line."""
    lines = []
    if result.time is not None:
        lines.append(f"  {'time':39} {result.time[0]:.15g} s")
    points = set(_distinct_points(result))
    units = {
        (part, name): result.unit(kind, part, name)
        for kind in KINDS
        for part, series in getattr(result, kind).items()
        for name in series
    }
    kinds = ("drivers", "outputs") if motion_is_aside(result) else KINDS
    for kind in kinds:
        for part, series in getattr(result, kind).items():
            if kind == "points" and part not in points:
                continue
            for name, array in series.items():
                if kind == "joints" and is_force(name):
                    continue
                value = array[0]
                unit = units.get((part, name), "")
                text = (
                    f"({value[0]: .12g}, {value[1]: .12g})" if np.ndim(value) else f"{value: .15g}"
                )
                if "nan" in text:
                    text = " -"
                turns = name == "angle" or (name == "position" and part.endswith(".angle"))
                known = turns and np.isfinite(value)
                degrees = f"   {math.degrees(value):.9g} deg" if known else ""
                lines.append(f"  {part:18} {name:20} {text} {unit}{degrees}")
    lines += single_forces(result)
    lines.append(f"  {'status':39} {result.status[0]}")
    for name, array in result.bound.items():
        if np.isfinite(array[0]):
            lines.append(f"  bound {name:33} {array[0]:.2g}")
    return lines


def poses_text(result: Result, width: int) -> list[str]:
    """Return a table with a row for each pose that is shown."""
    columns: list[Column] = [("status", result.status)]
    if result.time is not None:
        columns.append(("t [s]", cells(result.time)))
    for coordinate, series in result.drivers.items():
        angle = coordinate.endswith(".angle")
        values = np.degrees(series.position) if angle else series.position
        unit = "deg" if angle else result.unit("drivers", coordinate, "position")
        largest = float(np.max(np.abs(values), initial=0.0))
        columns.append((f"{coordinate} [{unit}]", cells(values, largest)))
    named, forces = _outputs(result), force_columns(result)
    columns += forces + named if motion_is_aside(result) else named + forces
    driven = set(result.drivers)
    points = set(_distinct_points(result))
    for kind in () if motion_is_aside(result) else ("points", "joints", "bodies"):
        entries = list(getattr(result, kind).items())
        # the last links are the ones a mechanism is made for
        for part, series in reversed(entries) if kind == "points" else entries:
            if {f"{part}.angle", f"{part}.slide", f"{part}.s"} & driven:
                continue
            if kind == "points" and (part not in points or {f"{part}.x", f"{part}.y"} <= driven):
                continue
            columns += _columns(kind, part, series)
    places = rows_of(len(result))
    chosen: list[tuple[str, Sequence[str], int]] = []
    used = 2
    for title, own in columns:
        size = max(len(title), *(len(own[k]) for k in places)) + 2
        if used + size > width and len(chosen) > 3:
            break
        chosen.append((title, own, size))
        used += size
    lines = ["  " + "".join(f"{title:>{size}}" for title, _, size in chosen)]
    for k in places:
        lines.append("  " + "".join(f"{own[k]:>{size}}" for _, own, size in chosen))
    hidden = len(columns) - len(chosen)
    notes = []
    if len(places) < len(result):
        notes.append(f"{len(places)} of {len(result)} poses")
    if hidden > 0:
        notes.append(f"{len(chosen)} of {len(columns)} columns")
    if notes:
        lines.append(f"  ({', '.join(notes)} shown; --out DIR writes all, --json prints all)")
    return lines


def _outputs(result: Result) -> list[Column]:
    """Return the named outputs."""
    columns = []
    for name, series in result.outputs.items():
        unit = result.unit("outputs", name, "value")
        values = np.degrees(series["value"]) if unit == "rad" else series["value"]
        title = f"{name} [{'deg' if unit == 'rad' else unit}]" if unit else name
        columns.append((title, cells(values, float(np.nanmax(np.abs(values), initial=0.0)))))
    return columns


def _distinct_points(result: Result) -> list[str]:
    """Return the points that move, each place once."""
    kept: list[str] = []
    for name, series in result.points.items():
        places = series.position
        span = np.nanmax(np.ptp(places, axis=0), initial=0.0) if len(places) > 1 else np.inf
        size = np.nanmax(np.abs(places), initial=0.0)
        speed = np.nanmax(np.abs(series["velocity"]), initial=0.0) if "velocity" in series else 1.0
        moves = span > 1e-13 * size and speed > 0
        if moves and not any(
            np.array_equal(places, result.points[other].position, equal_nan=True) for other in kept
        ):
            kept.append(name)
    return kept


def _columns(kind: str, part: str, series: Any) -> list[Column]:
    entries: list[Column] = []
    if kind == "points":
        for i, axis in enumerate("xy"):
            size = float(np.nanmax(np.abs(series.position), initial=0.0))
            entries.append((f"{part}.{axis} [m]", cells(series.position[:, i], size)))
    elif kind == "bodies":
        entries.append((f"{part} [deg]", cells(np.degrees(series.angle))))
        if "angular_velocity" in series:
            entries.append((f"{part} [rad/s]", cells(series.angular_velocity)))
    elif "slide" in series:
        entries.append((f"{part}.slide [m]", cells(series.slide)))
    elif "s" in series:
        entries.append((f"{part}.s", cells(series.s)))
    return entries
