"""What happens along the way as text: events, and stretches without poses."""

from __future__ import annotations

from collections.abc import Collection

from mechdae.results import Event, Result, Units, kind_of
from mechdae.results.status import why_lost
from mechdae.results.tables.text import driver_value, quantity, zero


def event_lines(result: Result, each: list[str], noise: dict[str, float]) -> list[str]:
    """Return a line for each event within the poses; `each` are the units of the drivers."""
    lines, units = [], result.units
    wheels = pairs_of_wheels(result)
    for event in result.events:
        if event["in_range"]:
            digits = 12 if event["kind"] in ("limit", "end_of_curve", "crossing", "stop") else 6
            word = event["kind"].replace("_", " ")
            place = driver_value(event["at"], each, digits, units)
            if "time" in event:
                place = f"t = {event['time']:.{digits}g} s, {place}"
            lines.append(f"  {word:9} {place}: {_happens(event, noise, wheels, units)}")
    return lines


def failed_lines(result: Result, unit: str) -> list[str]:
    """Return a line for each stretch of the driver, in its unit, without a pose."""
    summary, lines, units = result.summary, [], result.units
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
    return lines


def lift_off(event: Event, wheels: Collection[str], units: Units) -> str:
    """Return what a one-sided contact would have to do; of two `wheels` it is a moment."""
    shown = units.of("N m" if event["joint"] in wheels else "N")
    pull = -event["force"] * shown.factor
    return f"joint {event['joint']} would have to pull, by up to {pull:.6g} {shown.name}"


def pairs_of_wheels(result: Result) -> set[str]:
    """Return the joints between two wheels: what they pass on is a moment."""
    return {name for name, joint in result.mechanism.joints.items() if joint.wheels == 2}


def _happens(event: Event, noise: dict[str, float], wheels: Collection[str], units: Units) -> str:
    """Return what an event is about."""
    if event["kind"] == "stationary":
        kind = kind_of(event["of"]).name
        value = quantity(event["value"], kind, noise[kind], units)
        return f"{event['of']} {event['extreme']} {value}"
    if event["kind"] in ("crossing", "extreme"):
        word = f"crosses {event['value']:.9g}, going {event.get('direction')}"
        if event["kind"] == "extreme":
            word = f"{event['extreme']} {event['value']:.9g}"
        return f"{event['name']} {word}"
    if event["kind"] == "stop":
        shown = units.of("rad" if event["of"].endswith("angle") else "m")
        return f"{event['of']} is at its limit of {event['value'] * shown.factor:.9g} {shown.name}"
    if event["kind"] == "lift_off":
        return lift_off(event, wheels, units)
    if "point" in event:  # the cusp of a point's path; that of a motion belongs to a group
        shown = units.of("m")
        x, y = (zero(value, noise["length"]) * shown.factor for value in event["position"])
        return f"{event['point']} comes to rest at ({x:.9g}, {y:.9g}) {shown.name}"
    return f"group {event['name']}" + (f", joint {event['joint']}" if event["joint"] else "")
