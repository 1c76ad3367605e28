"""Results as text that fits a terminal."""

from __future__ import annotations

import math
import shutil
from typing import Any

import numpy as np

from mechdae.results import KINDS, Result

ROWS = 19
WIDE = 100
MOST = 12
"""Extremes that are shown."""


def table(result: Result, terminal: bool = False) -> str:
    """Return the text of a result: a head, a table of poses, what to know about it."""
    if result.kind == "sensitivity":
        from mechdae.sensitivity_table import table as of_derivatives

        return of_derivatives(result)
    width = shutil.get_terminal_size((WIDE, 40)).columns if terminal else WIDE
    lines = [f"{result.problem} / {result.task} ({result.kind})  {result.title}".rstrip()]
    if result.kind == "modes":
        lines += _modes(result, width)
    elif result.kind == "study":
        lines += _study(result)
    elif len(result) == 1:
        lines += _single(result)
    else:
        lines += _sweep(result, width)
    lines += _facts(result)
    return "\n".join(lines) + "\n"


def _single(result: Result) -> list[str]:
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
    for kind in KINDS:
        for part, series in getattr(result, kind).items():
            if kind == "points" and part not in points:
                continue
            for name, array in series.items():
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
    lines.append(f"  {'status':39} {result.status[0]}")
    for name, array in result.bound.items():
        if np.isfinite(array[0]):
            lines.append(f"  bound {name:33} {array[0]:.2g}")
    return lines


def _sweep(result: Result, width: int) -> list[str]:
    columns = [("status", [str(text) for text in result.status])]
    if result.time is not None:
        columns.append(("t [s]", _cells(result.time)))
    for coordinate, series in result.drivers.items():
        angle = coordinate.endswith(".angle")
        values = np.degrees(series.position) if angle else series.position
        unit = "deg" if angle else result.unit("drivers", coordinate, "position")
        largest = float(np.max(np.abs(values), initial=0.0))
        columns.append((f"{coordinate} [{unit}]", _cells(values, largest)))
    for name, series in result.outputs.items():
        unit = result.unit("outputs", name, "value")
        values = np.degrees(series["value"]) if unit == "rad" else series["value"]
        title = f"{name} [{'deg' if unit == 'rad' else unit}]" if unit else name
        columns.append((title, _cells(values, float(np.nanmax(np.abs(values), initial=0.0)))))
    driven = set(result.drivers)
    points = set(_distinct_points(result))
    for kind in ("points", "joints", "bodies"):
        entries = list(getattr(result, kind).items())
        # the last links are the ones a mechanism is made for
        for part, series in reversed(entries) if kind == "points" else entries:
            if {f"{part}.angle", f"{part}.slide", f"{part}.s"} & driven:
                continue
            if kind == "points" and (part not in points or {f"{part}.x", f"{part}.y"} <= driven):
                continue
            columns += _columns(kind, part, series)
    spread = np.linspace(0, len(result) - 1, min(ROWS, len(result)))
    rows = sorted({round(place) for place in spread.tolist()})
    chosen: list[tuple[str, list[str], int]] = []
    used = 2
    for title, cells in columns:
        size = max(len(title), *(len(cells[k]) for k in rows)) + 2
        if used + size > width and len(chosen) > 3:
            break
        chosen.append((title, cells, size))
        used += size
    lines = ["  " + "".join(f"{title:>{size}}" for title, _, size in chosen)]
    for k in rows:
        lines.append("  " + "".join(f"{cells[k]:>{size}}" for _, cells, size in chosen))
    hidden = len(columns) - len(chosen)
    notes = []
    if len(rows) < len(result):
        notes.append(f"{len(rows)} of {len(result)} poses")
    if hidden > 0:
        notes.append(f"{len(chosen)} of {len(columns)} columns")
    if notes:
        lines.append(f"  ({', '.join(notes)} shown; --out DIR writes all, --json prints all)")
    return lines


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


def _columns(kind: str, part: str, series: Any) -> list[tuple[str, list[str]]]:
    entries = []
    if kind == "points":
        for i, axis in enumerate("xy"):
            size = float(np.nanmax(np.abs(series.position), initial=0.0))
            entries.append((f"{part}.{axis} [m]", _cells(series.position[:, i], size)))
    elif kind == "bodies":
        entries.append((f"{part} [deg]", _cells(np.degrees(series.angle))))
        if "angular_velocity" in series:
            entries.append((f"{part} [rad/s]", _cells(series.angular_velocity)))
    elif "slide" in series:
        entries.append((f"{part}.slide [m]", _cells(series.slide)))
    elif "s" in series:
        entries.append((f"{part}.s", _cells(series.s)))
    return entries


def _cells(values: Any, size: float = 0.0) -> list[str]:
    """Return the numbers as text; what is rounding noise beside `size` as 0."""
    clean = np.where(np.abs(values) < 1e-14 * size, 0.0, values)
    return [f"{value:.6g}" if np.isfinite(value) else "-" for value in clean]


def _modes(result: Result, width: int) -> list[str]:
    summary = result.summary
    how = "proven" if summary["proven"] else "found, not proven"
    lines = [
        f"  {summary['count']} assembly mode(s), {how}; labels of {', '.join(summary['groups'])}"
    ]
    for label, sketch in zip(result.labels or (), summary["sketches"], strict=True):
        text = "  ".join(f"{name} = {value:g}" for name, value in sketch.items())
        lines.append(f"  {','.join(label):8}  {text}"[: max(width, 60) * 3])
    for entry in summary.get("search", []):
        text = f"{entry['found']} found from {entry['starts']} starts"
        lines.append(f"  searched: {entry['group']}: {text}, each by {entry['least_hits']} or more")
    if "free" in summary:
        lines.append(f"  not counted: modes in which {', '.join(summary['free'])} moves by itself")
    return lines


def _study(result: Result) -> list[str]:
    """Return a row for each set of parameters; of a path with many numbers its range."""
    columns = [("status", [str(text) for text in result.status])]
    columns += [(name, _cells(array)) for name, array in result.parameters.items()]
    for whole, array in result.table.items():
        path = whole.split("/", 1)[-1]
        if array.ndim == 1:
            columns.append((path, _cells(array)))
            continue
        flat = array.reshape(len(array), -1)
        seen = np.isfinite(flat).any(axis=1)
        low, high = (np.full(len(flat), np.nan) for _ in range(2))
        low[seen], high[seen] = np.nanmin(flat[seen], axis=1), np.nanmax(flat[seen], axis=1)
        columns += [(f"least {path}", _cells(low)), (f"largest {path}", _cells(high))]
    spread = np.linspace(0, len(result) - 1, min(ROWS, len(result)))
    rows = sorted({round(place) for place in spread.tolist()})
    sizes = [max(len(title), *(len(cells[k]) for k in rows)) + 2 for title, cells in columns]
    while len(columns) > 3 and sum(sizes) > WIDE:
        columns, sizes = columns[:-1], sizes[:-1]
    lines = ["  " + "".join(f"{t:>{n}}" for (t, _), n in zip(columns, sizes, strict=True))]
    for k in rows:
        cells = [f"{cells[k]:>{n}}" for (_, cells), n in zip(columns, sizes, strict=True)]
        lines.append("  " + "".join(cells))
    if len(rows) < len(result):
        lines.append(f"  ({len(rows)} of {len(result)} sets shown; --out DIR writes all)")
    counts = ", ".join(f"{count} {word}" for word, count in result.summary["status"].items())
    lines.append(f"  sets      {counts}")
    return lines


def _facts(result: Result) -> list[str]:
    summary, lines = result.summary, []
    units = [result.unit("drivers", c, "position") for c in result.drivers]
    moves = [bool(np.ptp(series.position) > 0) for series in result.drivers.values()]
    unit = (units[moves.index(True)] if any(moves) else units[0]) if units else "m"
    if summary.get("formula"):
        lines.append(f"  formula   {summary['formula']}")
    if summary.get("mode"):
        lines.append(f"  mode      {summary['mode']}")
    if summary.get("limits"):
        ends = [_driver(value, unit) for value in summary["limits"]]
        lines.append(f"  limits    {ends[0]} .. {ends[1]}")
    for word, suffix in (("swing", "deg"), ("stroke", "m")):
        for name, value in summary.get(word, {}).items():
            value = value if abs(value) > 1e-14 else 0.0
            shown = math.degrees(value) if word == "swing" else value
            lines.append(f"  {word:9} {name}: {shown:.12g} {suffix}")
    if result.kind == "sweep":
        counts = ", ".join(f"{count} {status}" for status, count in summary["status"].items())
        lines.append(f"  status    {counts}")
        fine = np.asarray(result.status) == "ok"
        bounds = [
            f"{name} {array[fine].max():.1e} {'m' if name == 'length' else 'rad'}"
            for name, array in result.bound.items()
            if fine.any()
        ]
        if bounds:
            worst = np.nanmax(result.condition[np.isfinite(result.condition)], initial=1.0)
            lines.append(
                f"  error <=  {', '.join(bounds)} ({summary['bound']}); condition {worst:.3g}"
            )
    for entry in summary.get("superfluous", []):
        joints = ", ".join(entry["joints"])
        lines.append(f"  redundant {entry['count']} equation(s) superfluous among {joints}")
    if summary.get("closure"):
        words = {"length": "m", "angle": "rad", "parameter": "1"}
        sizes = [f"{value:.1e} {words[word]}" for word, value in summary["closure"].items()]
        lines.append(f"  closes to {', '.join(sizes)} (largest residual)")
    lines += _measures(result, unit)
    for event in result.events:
        if event["in_range"]:
            digits = 12 if event["kind"] in ("limit", "end_of_curve") else 6
            word = event["kind"].replace("_", " ")
            place = _driver(event["at"], units, digits)
            if "time" in event:
                place = f"t = {event['time']:.{digits}g} s, {place}"
            lines.append(f"  {word:9} {place}: {_happens(event)}")
    for entry in summary.get("failed", []):
        place = f"{_driver(entry['from'], unit)} .. {_driver(entry['to'], unit)}"
        if "time" in entry:
            place = f"t = {entry['time'][0]:.12g} .. {entry['time'][1]:.12g} s"
        group = (
            f": group {entry['name']} opens at joint {entry['joint']}" if "name" in entry else ""
        )
        group += f" by {entry['gap']:.4g} {entry['unit']}" if "gap" in entry else ""
        lines.append(f"  no pose   {place}{group}")
    if summary.get("not_in_scene"):
        lines.append(f"  not in the scene, not checked: {', '.join(summary['not_in_scene'])}")
    return lines


def _happens(event: dict[str, Any]) -> str:
    """Return what an event is about."""
    if event["kind"] == "stationary":
        kind = "angle" if event["of"].endswith(".angle") else "length"
        return f"{event['of']} {event['extreme']} {_quantity(event['value'], kind)}"
    if "point" in event:  # the cusp of a point's path; that of a motion belongs to a group
        x, y = event["position"]
        return f"{event['point']} comes to rest at ({x:.9g}, {y:.9g}) m"
    return f"group {event['name']}, joint {event['joint']}"


def _measures(result: Result, unit: str) -> list[str]:
    """Return short lines of what the task's measures found."""
    summary, lines = result.summary, []

    def at(value: Any) -> str:
        return _driver(value, unit, 6)

    for joint, found in summary.get("transmission", {}).items():
        low, high = (_quantity(found[word], "angle") for word in ("min", "max"))
        places = f"{low} at {at(found['at'])}, greatest {high} at {at(found['max_at'])}"
        lines.append(f"  transmission angle {joint}: least {places}")
    ranges = summary.get("extremes", {})
    for name, ends in list(ranges.items())[:MOST]:
        kind = "angle" if name.endswith(".angle") else "length"
        texts = [f"{_quantity(e['value'], kind)} at {at(e['at'])}" for e in ends.values()]
        lines.append(f"  extremes  {name}: {' .. '.join(texts)}")
    if len(ranges) > MOST:
        lines.append(f"  extremes  ({MOST} of {len(ranges)} shown)")
    for name, ratio in summary.get("time_ratio", {}).items():
        back = _quantity(summary["return_angle"][name], "angle")
        lines.append(f"  time ratio {name}: {ratio:.12g} (return in {back})")
    for name, reason in summary.get("no_time_ratio", {}).items():
        lines.append(f"  time ratio {name}: none, {reason}")
    for name, entries in summary.get("dwell", {}).items():
        slides = name in result.joints and "slide" in result.joints[name]
        for entry in entries:
            mean, half = (
                _quantity(entry[word], "length" if slides else "angle")
                for word in ("mean", "within")
            )
            cut = ", cut" if entry.get("cut") else ""
            interval = f"{at(entry['from'])} .. {at(entry['to'])}{cut}"
            lines.append(f"  dwell     {name}: {interval} at {mean} +- {half}")
    if summary.get("envelope"):
        x0, x1, y0, y1 = (f"{value:.9g}" for value in summary["envelope"]["all"])
        lines.append(f"  envelope  x {x0} .. {x1} m, y {y0} .. {y1} m")
    for name, found in summary.get("curve", {}).items():
        area = f", closed, area {found['area']:.9g} m2" if "area" in found else ""
        if found["length"] is not None:
            lines.append(f"  curve     {name}: length {found['length']:.12g} m{area}")
    for name, places in summary.get("centrodes", {}).get("at_infinity", {}).items():
        lines.append(f"  centre    {name}: at infinity at {', '.join(map(at, places))}")
    return lines


def _quantity(value: float, unit: str) -> str:
    return f"{math.degrees(value):.9g} deg" if unit == "angle" else f"{value:.9g} m"


def _driver(value: Any, unit: str | list[str], digits: int = 12) -> str:
    """Return a driver's value with its unit, of several drivers the list of them."""
    if value is None:
        return "none"
    if isinstance(value, list):
        units = unit if isinstance(unit, list) else [unit] * len(value)
        return ", ".join(_driver(v, u, digits) for v, u in zip(value, units, strict=True))
    unit = unit[0] if isinstance(unit, list) else unit
    if unit == "rad":
        return f"{math.degrees(value):.{digits}g} deg"
    return f"{value:.{digits}g}" + (" m" if unit == "m" else "")
