"""Bands as text that fits a terminal."""

from __future__ import annotations

from mechdae.results import Result
from mechdae.results.tables.facts import facts_text
from mechdae.results.tables.poses import pose_lines
from mechdae.results.tables.text import fact, in_unit

MOST = 5
"""Bands in the table."""
NOTHING = 1e-12
"""Rounding, of angles and of lengths as shares of the mechanism's size: no band."""


def band_lines(result: Result, width: int) -> list[str]:
    """Return a table of the widest bands, a row for each pose that is shown."""
    paths = [path.split("/") for path in result.summary["play"]["largest"]]
    names = [
        f"{part}.{'distance' if kind == 'points' else name}_band" for kind, part, name in paths
    ]
    return pose_lines(result, width, names[:MOST])


def band_facts(result: Result, width: int) -> list[str]:
    """Return the widest band of each quantity with the joint that has most of it."""
    lines, units = facts_text(result, width), result.units
    driver = next(iter(result.drivers))
    unit = result.unit("drivers", driver, "position")
    play = result.summary["play"]
    for path, entry in play["largest"].items():
        kind, part, name = path.split("/")
        if entry["band"] <= NOTHING * (1.0 if name == "angle" else result.mechanism.scale):
            continue
        share = "all of it of second order"
        if entry["joint"]:
            most = entry["shares"][entry["joint"]] / sum(entry["shares"].values())
            share = f"most of it ({most:.0%}) by {entry['joint']}"
        text = (
            f"{part} {name} +- {in_unit(entry['band'], result.unit(kind, part, name), 4, units)} "
            f"at {driver} = {in_unit(entry['at'], unit, 6, units)}, {share}"
        )
        lines += fact("band", text, width)
    for arc in play["unbounded"]:
        ends = [in_unit(arc[end], unit, 6, units) for end in ("from", "to")]
        text = (
            f"no band is proved from {driver} = {ends[0]} to {ends[1]}: the clearances are too "
            "large there, or it is near a limit position"
        )
        lines += fact("band", text, width)
    for entry in play.get("reversals", ()):
        ends = [in_unit(entry[end], unit, 6, units) for end in ("from", "to")]
        text = f"{entry['joint']} changes sides between {driver} = {ends[0]} and {ends[1]}"
        moved = [path for path in entry["lost"] if not path.endswith("angle")] or entry["lost"]
        path = max(moved, key=lambda path: entry["lost"][path], default=None)
        if path is not None:
            kind, part, name = path.split("/")
            lost = in_unit(entry["lost"][path], result.unit(kind, part, name), 4, units)
            text += f": {part} loses {lost}"
        lines += fact("reversal", text, width)
    return lines


TEXTS = (band_lines, band_facts)
