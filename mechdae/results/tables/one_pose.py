"""A single pose as text: one quantity per line."""

from __future__ import annotations

import numpy as np

from mechdae.results import DEGREES, KINDS, TURNS, Result
from mechdae.results.tables.forces import is_force, motion_is_aside, single_forces
from mechdae.results.tables.moving import Quantities
from mechdae.types import Floats


def _vector(values: Floats, room: int) -> str:
    """Return components with as many digits as there is room for."""
    for digits in (12, 9, 6):
        text = "(" + ", ".join(f"{value: .{digits}g}" for value in values) + ")"
        if len(text) <= room:
            break
    return text


def pose_text(result: Result, width: int) -> list[str]:
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
                scale = result.units.of(units.get((part, name), ""))
                shown = value * scale.factor
                room = width - 42 - len(scale.name) - len(part[18:] + name[20:])
                text = f"{shown: .15g}" if not np.ndim(value) else _vector(shown, room)
                if "nan" in text:
                    text = " -"
                turns = name in TURNS or name == "position"
                known = turns and scale.name == "rad" and np.isfinite(value)
                degrees = f"   {value * DEGREES.factor:.9g} deg" if known else ""
                lines.append(f"  {part:18} {name:20} {text} {scale.name}{degrees}")
    lines += single_forces(result)
    lines.append(f"  {'status':39} {result.status[0]}")
    for name, array in result.bound.items():
        if np.isfinite(array[0]):
            si = "m" if name == "length" else "rad"
            scale = result.units.of(si)
            unit = f" {scale.name}" if scale.name != si else ""
            lines.append(f"  bound {name:33} {array[0] * scale.factor:.2g}{unit}")
    return lines
