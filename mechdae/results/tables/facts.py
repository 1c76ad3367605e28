"""What to know about a result, below its table."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from mechdae.results import Event, Result, Units, kind_of
from mechdae.results.status import why_lost
from mechdae.results.tables.force_facts import force_facts
from mechdae.results.tables.text import (
    MOST,
    driver_value,
    in_unit,
    moves,
    noises,
    quantity,
    zero,
)

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
        lines.append(f"  redundant {entry['count']} equation(s) superfluous among {joints}")
    if summary.get("closure"):
        shown = [(value, units.of(SIZES[word])) for word, value in summary["closure"].items()]
        sizes = [f"{value * own.factor:.1e} {own.name}" for value, own in shown]
        lines.append(f"  closes to {', '.join(sizes)} (largest residual)")
    lines += force_facts(result, width)
    lines += _measures(result, unit, noise)
    wheels = pairs_of_wheels(result)
    for event in result.events:
        if event["in_range"]:
            digits = 12 if event["kind"] in ("limit", "end_of_curve") else 6
            word = event["kind"].replace("_", " ")
            place = driver_value(event["at"], each, digits, units)
            if "time" in event:
                place = f"t = {event['time']:.{digits}g} s, {place}"
            lines.append(f"  {word:9} {place}: {_happens(event, noise, wheels, units)}")
    for entry in summary.get("failed", []):
        ends = [driver_value(entry[end], unit, 12, units) for end in ("from", "to")]
        place = " .. ".join(ends)
        if "time" in entry:
            place = f"t = {entry['time'][0]:.12g} .. {entry['time'][1]:.12g} s"
        group = f": group {entry['name']} {why_lost(entry)}" if "name" in entry else ""
        if entry.get("assembles") and "cause" not in entry:
            group = ": assembles, but no motion from the sketch leads there"
        if "gap" in entry:
            gap = units.of(entry["unit"])
            group += f" by {entry['gap'] * gap.factor:.4g} {gap.name}"
        lines.append(f"  no pose   {place}{group}")
    if summary.get("not_in_scene"):
        lines.append(f"  not in the scene, not checked: {', '.join(summary['not_in_scene'])}")
    return lines


def lift_off(event: Event, wheels: Collection[str], units: Units) -> str:
    """Return what a one-sided contact would have to do; of two `wheels` it is a moment."""
    own = units.of("N m" if event["joint"] in wheels else "N")
    pull = -event["force"] * own.factor
    return f"joint {event['joint']} would have to pull, by up to {pull:.6g} {own.name}"


def pairs_of_wheels(result: Result) -> set[str]:
    """Return the joints between two wheels: what they pass on is a moment."""
    return {name for name, joint in result.mechanism.joints.items() if joint.wheels == 2}


def _happens(event: Event, noise: dict[str, float], wheels: Collection[str], units: Units) -> str:
    """Return what an event is about."""
    if event["kind"] == "stationary":
        kind = kind_of(event["of"]).name
        value = quantity(event["value"], kind, noise[kind], units)
        return f"{event['of']} {event['extreme']} {value}"
    if event["kind"] == "lift_off":
        return lift_off(event, wheels, units)
    if "point" in event:  # the cusp of a point's path; that of a motion belongs to a group
        own = units.of("m")
        x, y = (zero(value, noise["length"]) * own.factor for value in event["position"])
        return f"{event['point']} comes to rest at ({x:.9g}, {y:.9g}) {own.name}"
    return f"group {event['name']}" + (f", joint {event['joint']}" if event["joint"] else "")


def _measures(result: Result, unit: str, noise: dict[str, float]) -> list[str]:
    """Return short lines of what the task's measures found."""
    summary, lines, units = result.summary, [], result.units

    def at(value: Any) -> str:
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
        own = units.of("m")
        ends = (zero(value, noise["length"]) for value in summary["envelope"]["all"])
        told = [f"{value * own.factor:.9g}" for value in ends]
        sides = zip("xyz", told[::2], told[1::2], strict=False)
        box = ", ".join(f"{axis} {low} .. {high} {own.name}" for axis, low, high in sides)
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
