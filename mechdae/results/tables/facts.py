"""What to know about a result, below its table."""

from __future__ import annotations

import numpy as np

from mechdae.results import Result
from mechdae.results.tables.text import (
    driver_value,
    in_unit,
    moves,
    noises,
    zero,
)

MEASURED = frozenset({
    "transmission", "extremes", "time_ratio", "no_time_ratio", "dwell", "envelope", "curve",
    "centrodes",
})  # fmt: skip
"""Entries of a summary that measures make."""
SIZES = {"length": "m", "angle": "rad", "parameter": "1"}
"""Units of bounds and of left-overs of closures."""


def facts_text(result: Result, width: int) -> list[str]:
    summary, lines, noise, units = result.summary, [], noises(result), result.units
    each = [result.unit("drivers", c, "position") for c in result.drivers]
    moving = [moves(series.position) for series in result.drivers.values()]
    unit = (each[moving.index(True)] if any(moving) else each[0]) if each else "m"
    if summary.get("formula"):
        lines.append(f"  formula   {summary['formula']}")
    if summary.get("mode"):
        lines.append(f"  mode      {summary['mode']}")
    if summary.get("limits"):
        ends = [driver_value(value, unit, 12, units) for value in summary["limits"]]
        lines.append(f"  limits    {ends[0]} .. {ends[1]}")
    for word, si in (("swing", "rad"), ("stroke", "m")):
        for name, value in summary.get(word, {}).items():
            value = zero(value, noise["angle" if word == "swing" else "length"])
            lines.append(f"  {word:9} {name}: {in_unit(value, si, 12, units)}")
    if "bound" in summary and "status" in summary:
        counts = ", ".join(f"{count} {status}" for status, count in summary["status"].items())
        lines.append(f"  status    {counts}")
    if "bound" in summary:
        fine = np.asarray(result.status) == "ok"
        bounds = [
            f"{name} {np.nanmax(array[fine]) * units.of(SIZES[name]).factor:.1e} "
            f"{units.of(SIZES[name]).name}"
            for name, array in result.bound.items()
            if np.isfinite(array[fine]).any()
        ]
        if bounds:
            line = f"  error <=  {', '.join(bounds)} ({summary['bound']})"
            if result.condition is not None:
                worst = np.nanmax(result.condition[np.isfinite(result.condition)], initial=1.0)
                line += f"; condition {worst:.3g}"
            lines.append(line)
    for entry in summary.get("superfluous", []):
        joints = ", ".join(entry["joints"])
        lines.append(f"  redundant {entry['count']} equation(s) among {joints}")
    if summary.get("closure"):
        shown = [(value, units.of(SIZES[word])) for word, value in summary["closure"].items()]
        sizes = [f"{value * unit.factor:.1e} {unit.name}" for value, unit in shown]
        lines.append(f"  closes to {', '.join(sizes)} (largest residual)")
    if result.kind == "reactions":
        from mechdae.results.tables.forces import force_facts

        lines += force_facts(result, width)
    if not MEASURED.isdisjoint(summary.names()):
        from mechdae.results.tables.measures import measured_facts

        lines += measured_facts(result, unit, noise)
    if result.events or "failed" in summary:
        from mechdae.results.tables.events import event_lines, failed_lines

        lines += event_lines(result, each, noise) + failed_lines(result, unit)
    if summary.get("not_in_scene"):
        lines.append(f"  not in the scene, not checked: {', '.join(summary['not_in_scene'])}")
    return lines
