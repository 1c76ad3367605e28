"""What to know about a result, below its table."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mechdae.results import Event, Result
from mechdae.tables.force_facts import force_facts
from mechdae.tables.text import MOST, driver_value, moves, noises, quantity, zero


def facts_text(result: Result, width: int) -> list[str]:
    summary, lines, noise = result.summary, [], noises(result)
    units = [result.unit("drivers", c, "position") for c in result.drivers]
    moving = [moves(series.position) for series in result.drivers.values()]
    unit = (units[moving.index(True)] if any(moving) else units[0]) if units else "m"
    if summary.get("formula"):
        lines.append(f"  formula   {summary['formula']}")
    if summary.get("mode"):
        lines.append(f"  mode      {summary['mode']}")
    if summary.get("limits"):
        ends = [driver_value(value, unit) for value in summary["limits"]]
        lines.append(f"  limits    {ends[0]} .. {ends[1]}")
    for word, suffix in (("swing", "deg"), ("stroke", "m")):
        for name, value in summary.get(word, {}).items():
            value = zero(value, noise["angle" if word == "swing" else "length"])
            shown = math.degrees(value) if word == "swing" else value
            lines.append(f"  {word:9} {name}: {shown:.12g} {suffix}")
    if "bound" in summary and "status" in summary:
        counts = ", ".join(f"{count} {status}" for status, count in summary["status"].items())
        lines.append(f"  status    {counts}")
    if "bound" in summary:
        fine = np.asarray(result.status) == "ok"
        bounds = [
            f"{name} {np.nanmax(array[fine]):.1e} {'m' if name == 'length' else 'rad'}"
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
        words = {"length": "m", "angle": "rad", "parameter": "1"}
        sizes = [f"{value:.1e} {words[word]}" for word, value in summary["closure"].items()]
        lines.append(f"  closes to {', '.join(sizes)} (largest residual)")
    lines += force_facts(result, width)
    lines += _measures(result, unit, noise)
    for event in result.events:
        if event["in_range"]:
            digits = 12 if event["kind"] in ("limit", "end_of_curve") else 6
            word = event["kind"].replace("_", " ")
            place = driver_value(event["at"], units, digits)
            if "time" in event:
                place = f"t = {event['time']:.{digits}g} s, {place}"
            lines.append(f"  {word:9} {place}: {_happens(event, noise)}")
    for entry in summary.get("failed", []):
        place = f"{driver_value(entry['from'], unit)} .. {driver_value(entry['to'], unit)}"
        if "time" in entry:
            place = f"t = {entry['time'][0]:.12g} .. {entry['time'][1]:.12g} s"
        group = (
            f": group {entry['name']} opens at joint {entry['joint']}" if "name" in entry else ""
        )
        if entry.get("assembles"):
            group = ": assembles, but no motion from the sketch leads there"
        group += f" by {entry['gap']:.4g} {entry['unit']}" if "gap" in entry else ""
        lines.append(f"  no pose   {place}{group}")
    if summary.get("not_in_scene"):
        lines.append(f"  not in the scene, not checked: {', '.join(summary['not_in_scene'])}")
    return lines


def _happens(event: Event, noise: dict[str, float]) -> str:
    """Return what an event is about."""
    if event["kind"] == "stationary":
        kind = "angle" if event["of"].endswith(".angle") else "length"
        return f"{event['of']} {event['extreme']} {quantity(event['value'], kind, noise[kind])}"
    if event["kind"] == "lift_off":
        return f"joint {event['joint']} would have to pull, by up to {-event['force']:.6g}"
    if "point" in event:  # the cusp of a point's path; that of a motion belongs to a group
        x, y = (zero(value, noise["length"]) for value in event["position"])
        return f"{event['point']} comes to rest at ({x:.9g}, {y:.9g}) m"
    return f"group {event['name']}, joint {event['joint']}"


def _measures(result: Result, unit: str, noise: dict[str, float]) -> list[str]:
    """Return short lines of what the task's measures found."""
    summary, lines = result.summary, []

    def at(value: Any) -> str:
        return driver_value(value, unit, 6)

    for joint, found in summary.get("transmission", {}).items():
        low, high = (quantity(found[word], "angle", noise["angle"]) for word in ("min", "max"))
        places = f"{low} at {at(found['at'])}, greatest {high} at {at(found['max_at'])}"
        lines.append(f"  transmission angle {joint}: least {places}")
    ranges = summary.get("extremes", {})
    for name, ends in list(ranges.items())[:MOST]:
        kind = "angle" if name.endswith(".angle") else "length"
        texts = [
            f"{quantity(e['value'], kind, noise[kind])} at {at(e['at'])}" for e in ends.values()
        ]
        lines.append(f"  extremes  {name}: {' .. '.join(texts)}")
    if len(ranges) > MOST:
        lines.append(f"  extremes  ({MOST} of {len(ranges)} shown)")
    for name, ratio in summary.get("time_ratio", {}).items():
        back = quantity(summary["return_angle"][name], "angle")
        lines.append(f"  time ratio {name}: {ratio:.12g} (return in {back})")
    for name, reason in summary.get("no_time_ratio", {}).items():
        lines.append(f"  time ratio {name}: none, {reason}")
    for name, entries in summary.get("dwell", {}).items():
        slides = name in result.joints and "slide" in result.joints[name]
        kind = "length" if slides else "angle"
        for entry in entries:
            mean, half = (quantity(entry[word], kind, noise[kind]) for word in ("mean", "within"))
            cut = ", cut" if entry.get("cut") else ""
            interval = f"{at(entry['from'])} .. {at(entry['to'])}{cut}"
            lines.append(f"  dwell     {name}: {interval} at {mean} +- {half}")
    if summary.get("envelope"):
        ends = (zero(value, noise["length"]) for value in summary["envelope"]["all"])
        x0, x1, y0, y1 = (f"{value:.9g}" for value in ends)
        lines.append(f"  envelope  x {x0} .. {x1} m, y {y0} .. {y1} m")
    for name, found in summary.get("curve", {}).items():
        area = f", closed, area {found['area']:.9g} m2" if "area" in found else ""
        if found["length"] is not None:
            lines.append(f"  curve     {name}: length {found['length']:.12g} m{area}")
    for name, places in summary.get("centrodes", {}).get("at_infinity", {}).items():
        lines.append(f"  centre    {name}: at infinity at {', '.join(map(at, places))}")
    return lines
