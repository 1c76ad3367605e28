"""Designs of a task of synthesis as text: ranked, with what holds each back, and the census."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mechdae.results import Result, Units, parameter_units, per
from mechdae.results.tables.text import MOST, fact, fitted_lines, together

Design = Mapping[str, Any]


def designs_text(result: Result, width: int) -> list[str]:
    """Return a row for each design, the dimensions and active limits of each, the census."""
    designs: Sequence[Design] = result.data.get("designs", [])
    objectives = result.summary.get("front", {}).get("objectives", ())
    lines = _ranked(designs, result, objectives, width) if designs else []
    lines += front_facts(result, width)
    units = parameter_units(result.mechanism) | result.summary.get("units", {})
    for rank, design in enumerate(designs, 1):
        sizes = [
            together(_number(k, v, units, result.units)) for k, v in design["parameters"].items()
        ]
        lines += fact(f"design {rank}", ", ".join(sizes), width)
        if design.get("defects"):
            lines += fact("defects", "; ".join(design["defects"]), width)
        if design.get("note"):
            lines += fact("note", design["note"], width)
        if design.get("active"):
            active = design["active"].items()
            prices = [together(_price(name, at, units, result)) for name, at in active]
            lines += fact("active", ", ".join(prices), width)
    return lines + _census(result, width)


def front_facts(result: Result, width: int) -> list[str]:
    """Return how large the front is, and what the searches for its ends met."""
    front, status, lines = result.summary.get("front"), result.summary["status"], list[str]()
    if front:
        shown = [result.units.of(objective["unit"]) for objective in front["objectives"]]
        ends = [f"{v * u.factor:.6g}" for v, u in zip(front["reference"], shown, strict=True)]
        text = f"{len(front['points'])} points, hypervolume {front['hypervolume']:.6g} (SI) up to "
        part = "" if status == "found" else f"{status}: "
        lines += fact("front", f"{part}{text}({', '.join(ends)})", width)
        for k, end in enumerate(front.get("ends", ()), 1):
            words = f"{end['starts']} starts, {end['met']} met all constraints"
            words += f", {end['hits_of_best']} hit the best" if end["found"] else ", end not found"
            lines += fact("alone", f"objective {k}: {words}", width)
    return lines


def _ranked(
    designs: Sequence[Design],
    result: Result,
    objectives: Sequence[Mapping[str, str]],
    width: int,
) -> list[str]:
    units, own_units = result.units, result.summary.get("units", {})
    columns: list[tuple[str, list[str]]] = [
        ("design", [str(rank) for rank in range(1, len(designs) + 1)])
    ]
    for k, objective in enumerate(objectives):
        scale = units.of(objective["unit"])
        title = _titled(objective["name"], scale.name)
        columns.append(
            (title, [f"{design['objectives'][k] * scale.factor:.6g}" for design in designs])
        )
    if not objectives:
        scale = units.of(own_units.get("objective", ""))
        shown = [f"{design['objective'] * scale.factor:.9g}" for design in designs]
        columns.append((_titled("objective", scale.name), shown))
    parts = [[part for part in design.get("robust", ()) if part] for design in designs]
    if all(len(part) == 1 for part in parts):
        for word in ("nominal", "sigma"):
            columns.append((word, [f"{part[0][word]:.6g}" for part in parts]))
    if any(design.get("class", "any") != "any" for design in designs):
        columns.append(("class", [str(design.get("class") or "-") for design in designs]))
    angles = [design.get("transmission_angle_min") for design in designs]
    if any(angle is not None for angle in angles):
        turned = units.read("rad")
        shown = ["-" if angle is None else f"{angle * turned.factor:.4f}" for angle in angles]
        columns.append((f"least transmission [{turned.name}]", shown))
    worst = [float(np.abs(e).max()) if (e := design.get("errors")) else None for design in designs]
    if any(value is not None for value in worst):
        scale = units.of(own_units.get("errors", ""))
        shown = ["-" if value is None else f"{value * scale.factor:.4g}" for value in worst]
        columns.append((_titled("largest error", scale.name), shown))
    if any("sense" in design for design in designs):
        every = [np.atleast_1d(design.get("sense", 0)) for design in designs]
        columns.append(("sense", [" ".join(f"{sense:+d}" for sense in senses) for senses in every]))
    if any("hits" in design for design in designs):
        columns.append(("hits", [str(design.get("hits", "-")) for design in designs]))
    return fitted_columns(columns, width)


def fitted_columns(columns: Sequence[tuple[str, list[str]]], width: int) -> list[str]:
    """Return the lines of a table of designs, by titles and texts of its columns."""
    given = [([title], texts) for title, texts in columns]
    lines, _ = fitted_lines(given, range(len(columns[0][1])), width + 2)
    return [line[2:] for line in lines]


def _titled(title: str, unit: str) -> str:
    return f"{title} [{unit}]" if unit else title


def _number(name: str, value: float, given: Mapping[str, str], units: Units) -> str:
    """Return a dimension with its unit."""
    scale = units.of(given.get(name) or "")
    return f"{name} = {value * scale.factor:.9g} {scale.name}".rstrip()


def _price(name: str, price: float, given: Mapping[str, str], result: Result) -> str:
    """Return what holds a design back, and what the objective gains by a unit of it.

    It is in SI where one of their units is not known, of angles per sine.
    """
    units = [given.get("objective", ""), given.get(name, "")]
    if not all(units):
        return f"{name} (price {price:.4g})"
    scale = per(*map(result.units.of, units))
    return f"{name} (price {price * scale.factor:.4g} {scale.name})".replace(" 1)", ")")


def _exact(facts: Mapping[str, Any], width: int) -> list[str]:
    """Return how many solutions an exact goal has, and how certain that is."""
    if not facts:
        return []
    if "freedoms" in facts:
        family = f"the four-bars are an infinite family of {facts['freedoms']} parameters"
        return fact("verdict", f"{facts['verdict']}: {family}, some of it is reported", width)
    within = f"{facts['within']} four-bars of them within the bounds"
    if facts["within"]:
        within += f", {facts['faultless']} without fault at the targets"
        faults = [f"{text} ({count})" for text, count in facts["faults"].items()]
        within += f"; faults of the others: {', '.join(faults)}" if faults else ""
    if "count" not in facts:
        return fact("verdict", f"{facts['verdict']}: {facts['real']} real, {within}", width)
    words = [f"{facts['certified']} of {facts['count']} solutions certified"]
    words += [
        f"{facts[word]} {text}"
        for word, text in (("infinite", "at infinity"), ("singular", "multiple"), ("lost", "lost"))
        if facts[word]
    ]
    text = f"{', '.join(words)} ({facts['basis']}); {facts['real']} real, {within}"
    return fact("verdict", f"{facts['verdict']}: {text}", width)


def _census(result: Result, width: int) -> list[str]:
    """Return how many starts led where, and why optima were rejected."""
    summary = result.summary
    starts = summary.get("asked", summary["starts"])
    few = f" of the {starts} asked for: no more that differ" if summary["starts"] < starts else ""
    words = [
        f"{summary['starts']} starts{few}", f"{summary['converged']} met all constraints",
        f"{summary['distinct']} distinct",
    ]  # fmt: skip
    if summary.get("hits_of_best"):
        words.append(f"{summary['hits_of_best']} hit the best")
    if summary.get("rejected"):
        words.append(f"{len(summary['rejected'])} rejected by their sweep")
    lines = _exact(summary.get("exact", {}), width)
    lines += fact("census", ", ".join(words) + f"; seed {summary['seed']}", width)
    for entry in summary.get("rejected", [])[:MOST]:
        reasons = "; ".join(entry["reasons"])
        shown = result.units.of(summary.get("units", {}).get("objective", ""))
        value = f"{entry['objective'] * shown.factor:.6g} {shown.name}".rstrip()
        lines += fact("rejected", f"objective {value}: {reasons}", width)
    return lines


def no_facts(result: Result, width: int) -> list[str]:
    """Return nothing more to know: the table says it all."""
    return []


SYNTHESIS = (designs_text, no_facts)
"""The table of a synthesis, which says all there is to know."""
