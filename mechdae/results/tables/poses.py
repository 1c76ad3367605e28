"""Poses as text: one quantity per line, or a row for each pose."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mechdae.results import DEGREES, KINDS, KNOWN, TURNS, Result
from mechdae.results.tables.forces import force_columns, is_force, motion_is_aside, single_forces
from mechdae.results.tables.moving import Quantities
from mechdae.results.tables.text import Column, cells, rows_of


def _vector(values: Any) -> str:
    return "(" + ", ".join(f"{value: .12g}" for value in values) + ")"


def pose_text(result: Result) -> list[str]:
    """Return one quantity per line."""
    lines = []
    if result.time is not None:
        lines.append(f"  {'time':39} {result.time[0]:.15g} s")
    moving = Quantities(result)
    points = set(moving.distinct_points())
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
                noise = moving.noise(kind, part, name)
                value = np.where(np.abs(array[0]) <= noise, 0.0, array[0])
                own = result.units.of(units.get((part, name), ""))
                shown = value * own.factor
                text = f"{shown: .15g}" if not np.ndim(value) else _vector(shown)
                if "nan" in text:
                    text = " -"
                turns = name in TURNS or name == "position"
                known = turns and own.name == "rad" and np.isfinite(value)
                degrees = f"   {value * DEGREES.factor:.9g} deg" if known else ""
                lines.append(f"  {part:18} {name:20} {text} {own.name}{degrees}")
    lines += single_forces(result)
    lines.append(f"  {'status':39} {result.status[0]}")
    for name, array in result.bound.items():
        if np.isfinite(array[0]):
            si = "m" if name == "length" else "rad"
            own = result.units.of(si)
            unit = f" {own.name}" if own.name != si else ""
            lines.append(f"  bound {name:33} {array[0] * own.factor:.2g}{unit}")
    return lines


def poses_columns(result: Result) -> list[Column]:
    """Return the columns of a table with a row for each pose, what matters most first."""
    columns: list[Column] = [("status", result.status.tolist())]
    if result.time is not None:
        columns.append(("t [s]", cells(result.time)))
    for coordinate, series in result.drivers.items():
        own = result.units.read(result.unit("drivers", coordinate, "position"))
        values = series.position * own.factor
        largest = float(np.max(np.abs(values), initial=0.0))
        columns.append((f"{coordinate} [{own.name}]", cells(values, largest)))
    moving = Quantities(result)
    named, forces = moving.outputs(), force_columns(result)
    columns += forces + named if motion_is_aside(result) else named + forces
    if not motion_is_aside(result):
        columns += moving.columns()
    return columns


def poses_text(result: Result, width: int) -> list[str]:
    """Return a table with a row for each pose that is shown."""
    columns = poses_columns(result)
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
    if mixed := mixed_units(result, [title for title, _, _ in chosen]):
        lines.append(f"  (units mixed: {mixed})")
    if notes:
        lines.append(f"  ({', '.join(notes)} shown; --out DIR writes all, --json prints all)")
    return lines


def mixed_units(result: Result, titles: Sequence[str]) -> str:
    """Return which units of one quantity stand side by side, where units were asked for."""
    if not result.units.asked:
        return ""
    seen = dict.fromkeys(title[:-1].rpartition("[")[2] for title in titles if title[-1:] == "]")
    kinds: dict[str, list[str]] = {}
    for name in seen:
        base = name.split("/")[0]
        if base in KNOWN:
            quantity, own, _, _ = KNOWN[base]
            kinds.setdefault({"rad/s": "rad"}.get(quantity, quantity), []).append(own)
    several = [dict.fromkeys(names) for names in kinds.values() if len(set(names)) > 1]
    return "; ".join(" and ".join(names) for names in several)
