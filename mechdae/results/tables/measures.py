"""What the measures of a sweep found, as text."""

from __future__ import annotations

import numpy as np

from mechdae.results import UNITS, Result, kind_of
from mechdae.results.tables.text import (
    MOST,
    Column,
    cells,
    driver_value,
    in_unit,
    quantity,
    size_of,
    zero,
)
from mechdae.types import Floats

RATIOS = ("_ratio", "_advantage", "_per_angle", "_per_slide", "_per_force", "_per_torque")
"""Ends of the names of velocity ratios and mechanical advantages."""


def measured_facts(result: Result, unit: str, noise: dict[str, float]) -> list[str]:
    """Return short lines of what the task's measures found."""
    summary, lines, units = result.summary, [], result.units

    def at(value: float) -> str:
        return driver_value(value, unit, 6, units)

    for joint, found in summary.get("transmission", {}).items():
        low, high = (
            quantity(found[word], "angle", noise["angle"], units) for word in ("min", "max")
        )
        places = f"{low} at {at(found['at'])}, greatest {high} at {at(found['max_at'])}"
        lines.append(f"  transmission angle {joint}: least {places}")
    ranges = summary.get("extremes", {})
    for name, ends in list(ranges.items())[:MOST]:
        kind = kind_of(name).name
        texts = [
            f"{quantity(e['value'], kind, noise[kind], units)} at {at(e['at'])}"
            for e in ends.values()
        ]
        lines.append(f"  extremes  {name}: {' .. '.join(texts)}")
    if len(ranges) > MOST:
        lines.append(f"  extremes  ({MOST} of {len(ranges)} shown)")
    for name, ratio in summary.get("time_ratio", {}).items():
        back = quantity(summary["return_angle"][name], "angle", 0.0, units)
        lines.append(f"  time ratio {name}: {ratio:.12g} (return in {back})")
    for name, reason in summary.get("no_time_ratio", {}).items():
        lines.append(f"  time ratio {name}: none, {reason}")
    for name, entries in summary.get("dwell", {}).items():
        slides = name in result.joints and "slide" in result.joints[name]
        slides |= "." in name and kind_of(name).unit == "m"
        kind = "length" if slides else "angle"
        for entry in entries:
            mean, half = (
                quantity(entry[word], kind, noise[kind], units) for word in ("mean", "within")
            )
            cut = ", cut" if entry.get("cut") else ""
            interval = f"{at(entry['from'])} .. {at(entry['to'])}{cut}"
            lines.append(f"  dwell     {name}: {interval} at {mean} +- {half}")
    if summary.get("envelope"):
        shown = units.of("m")
        ends = (zero(value, noise["length"]) for value in summary["envelope"]["all"])
        values = [f"{value * shown.factor:.9g}" for value in ends]
        sides = zip("xyz", values[::2], values[1::2], strict=False)
        box = ", ".join(f"{axis} {low} .. {high} {shown.name}" for axis, low, high in sides)
        lines.append(f"  envelope  {box}")
    for name, found in summary.get("curve", {}).items():
        area = ", closed" if found["closed"] else ""
        area += f", area {in_unit(found['area'], 'm2', 9, units)}" if "area" in found else ""
        if found["length"] is not None:
            length = in_unit(found["length"], "m", 12, units)
            lines.append(f"  curve     {name}: length {length}{area}")
    for name, places in summary.get("centrodes", {}).get("at_infinity", {}).items():
        lines.append(f"  centre    {name}: at infinity at {', '.join(map(at, places))}")
    return lines


def ratio_columns(result: Result) -> list[Column]:
    """Return the velocity ratios and mechanical advantages of what moves."""
    found: list[Column] = []
    for kind in ("joints", "bodies"):
        for name, series in reversed(getattr(result, kind).items()):
            words = [word for word in series if word.endswith(RATIOS)]
            if any(np.any(np.isfinite(series[word]) & (series[word] != 0)) for word in words):
                found += [_ratio(result, name, word, series[word]) for word in words]
    return found


def _ratio(result: Result, part: str, word: str, values: Floats) -> Column:
    unit = result.units.read(UNITS.get(word, "1"))
    shown = values * unit.factor
    title = f"{part} {word.replace('_', ' ')}"
    return f"{title} [{unit.name}]" if word in UNITS else title, cells(shown, size_of(shown))
