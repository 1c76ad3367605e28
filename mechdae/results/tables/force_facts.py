"""What to know about forces: friction, cycle, jams, several solutions, uniqueness, checks."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

from mechdae.results import Result, Units
from mechdae.results.tables.text import MOST, driver_value, fact, moves, together

FRICTION = {
    "none": "left out",
    "article": "article: losses of the reactions without friction, which it does not change",
    "coupled": "coupled: it acts on the reactions it comes from",
}


def force_facts(result: Result, width: int) -> list[str]:
    """Return lines on friction, the cycle, poses without or with several solutions, checks."""
    task: Any = result.definition
    if result.kind != "reactions":
        return []
    summary, units = result.summary, result.units
    lines = fact("friction", _friction(result), width)
    if task.direction == "load":
        lines += fact("direction", "resistances push along the motion", width)
    lead, single = _lead_unit(result)
    unit = "s" if result.time is not None else lead if single else "1"
    lines += _cycle(summary, unit, width, units)
    lines += _jams(summary, unit, lead, width, units)
    lines += _margin(summary, lead, width, units)
    lines += _several(result, width)
    if "reverse" in summary:
        lines += fact("reverse", "resistances push along the motion", width)
        lines += _cycle(summary["reverse"], unit, width, units)
        lines += _jams(summary["reverse"], unit, lead, width, units)
    if summary.get("not_unique"):
        lines += fact("not unique", f"reactions of {', '.join(summary['not_unique'])}", width)
    for entry in summary.get("unique_sums", []):
        joints = ", ".join(entry["joints"])
        text = f"the sum of forces of {joints} on {entry['body']}"
        if len(result) == 1:
            force = result.units.of("N")
            parts = ", ".join(f"{v * force.factor:.9g}" for v in entry["force"][0])
            text += f" = ({parts}) {force.name}"
        lines += fact("unique", text, width)
    checks = [
        f"{word.replace('_', ' ')} " + ("-" if value is None else f"{value:.1e}" if value else "0")
        for word, value in result.checks.items()
    ]
    lines += fact("checks", f"{', '.join(checks)} (relative)", width)
    return lines


def _margin(summary: dict[str, Any], lead: str, width: int, units: Units) -> list[str]:
    """Return how much more friction would jam a pose."""
    found = summary.get("critical_factor")
    if not found or found["factor"] is None:
        far = found and found.get("up_to")
        return fact("jams", f"not up to {far:.6g} times the friction given", width) if far else []
    text = f"with {found['factor']:.6g} times the friction given, joint {found['joint']} at "
    return fact("jams", text + together(driver_value(found["at"], lead, 6, units)), width)


def _friction(result: Result) -> str:
    task: Any = result.definition
    text = FRICTION[task.friction]
    given = [
        getattr(joint, word, None)
        for joint in result.mechanism.joints.values()
        for word in ("friction", "mesh_loss")
    ]
    if task.friction != "none" and not any(given):
        return "in no joint"
    if task.friction != "none" and task.friction_radius == "article":
        text += "; friction circles r f"
    return text


def _lead_unit(result: Result) -> tuple[str, bool]:
    """Return the unit of the first driver that moves, and whether it is the only one."""
    units = [result.unit("drivers", c, "position") for c in result.drivers]
    moving = [moves(series.position) for series in result.drivers.values()]
    return units[moving.index(True) if any(moving) else 0], sum(moving) <= 1


def _arc(arc: Sequence[float], unit: str, units: Units) -> str:
    return together(" .. ".join(_at(end, unit, units) for end in arc))


def _at(value: float, unit: str, units: Units) -> str:
    value = value if abs(value) > 1e-12 else 0.0
    return f"t = {value:.6g} s" if unit == "s" else driver_value(value, unit, 6, units)


def _cycle(figures: dict[str, Any], unit: str, width: int, units: Units) -> list[str]:
    """Return mean powers, efficiencies, losses by joint and arcs."""
    lines: list[str] = []
    if "kinks" not in figures:
        return lines
    estimates = []
    if "efficiency_formula_10" in figures:
        estimates = [f"formula (10) {figures['efficiency_formula_10']:.6g}"]
        estimates += [f"P/(P + loss) {figures['efficiency_uncoupled']:.6g}"]
    if "useful" in figures:
        powers = [f"{word} {figures[word]:.6g} W" for word in ("input", "useful", "loss")]
        text = ", ".join(powers)
        if "efficiency" in figures:
            text += f"; efficiency {figures['efficiency']:.6g}"
        lines += fact("cycle", text, width)
    elif figures["jammed_arcs"]:
        lines += fact("cycle", "no mean powers with friction: it jams", width)
    if estimates:
        text = f"{', '.join(estimates)}, with reactions without friction"
        lines += fact("", text, width)
    lines += _losses(figures)
    arcs = figures.get("self_locking_arcs", [])
    if arcs:
        shown = ", ".join(_arc(arc, unit, units) for arc in arcs[:MOST])
        more = f", {len(arcs) - MOST} more" if len(arcs) > MOST else ""
        lines += fact(
            "self-lock", f"{shown}{more}: loads drive, and the driver must push too", width
        )
    return lines


def _losses(figures: dict[str, Any]) -> list[str]:
    """Return the mean losses by joint as a small table."""
    free = figures.get("loss_by_joint_uncoupled", {})
    whole = figures.get("loss_by_joint", {})
    columns = [("with feedback", whole)] if whole and whole != free else []
    columns += [("without feedback", free)] if free else []
    if not columns:
        return []
    names = list(columns[0][1])
    size = max(len(name) for name in (*names, "all"))
    lines = [f"  losses    {'[W]':{size}}" + "".join(f"  {title}" for title, _ in columns)]
    for name in (*names, "all"):
        row = f"            {name:{size}}"
        for title, own in columns:
            value = sum(own.values()) if name == "all" else own[name]
            row += f"  {value:>{len(title)}.6g}"
        lines.append(row)
    return lines


def _jams(figures: dict[str, Any], unit: str, lead: str, width: int, units: Units) -> list[str]:
    """Return a line for each arc, or run of poses, without a solution."""
    entries = figures.get("jammed", [])
    arcs = [tuple(arc) for arc in figures.get("jammed_arcs", [])]
    lines: list[str] = []
    if unit == lead:
        cases = [
            (_arc(arc, unit, units), [e for e in entries if _within(e["at"], arc)]) for arc in arcs
        ]
    else:  # arcs are in time, poses are named by the driver
        cases = [(_arc(arc, unit, units), []) for arc in arcs]
    if not arcs or unit != lead:
        cases += [(_span(run, lead, units), run) for run in _runs(entries)]
    for place, run in cases[:MOST]:
        text = f"{place}: no equilibrium with friction"
        text += ", proven" if run and all(entry["proven"] for entry in run) else ""
        joints = list(dict.fromkeys(entry["joint"] for entry in run if entry["joint"]))
        text += f", by joint {', '.join(joints)}" if joints else ""
        known = [entry for entry in run if entry["critical_factor"] is not None]
        if known:
            least = min(known, key=lambda entry: entry["critical_factor"])
            text += f"; there is one up to {least['critical_factor']:.6g} times the friction given"
            text += f" (at {driver_value(least['at'], lead, 6, units)})" if len(run) > 1 else ""
        lines += fact("jammed", text, width)
    return lines + _more("jammed", cases, width)


def _within(value: float, arc: tuple[float, ...]) -> bool:
    return arc[0] <= value <= arc[1]


def _several(result: Result, width: int) -> list[str]:
    """Return a line for each run of poses with several solutions."""
    lines: list[str] = []
    unit = _lead_unit(result)[0]
    found = [
        list(run)
        for _, group in itertools.groupby(result.solutions, key=lambda entry: entry["count"])
        for run in _runs(list(group))
    ]
    for run in found[:MOST]:
        how = "proven" if all(entry["proven"] for entry in run) else "found"
        known = all(any(own["connected"] for own in entry["solutions"]) for entry in run)
        which = "the one that continues from no friction" if known else "the first of them"
        place = _span(run, unit, result.units)
        text = f"{place}: {run[0]['count']} solutions, {how}; given is {which}"
        lines += fact("ambiguous", text, width)
    return lines + _more("ambiguous", found, width)


def _runs(entries: list[dict[str, Any]]) -> list[list[dict[str, Any]]]:
    """Return the entries in runs of poses that follow each other."""
    runs: list[list[dict[str, Any]]] = []
    for entry in entries:
        if runs and runs[-1][-1]["pose"] + 1 == entry["pose"]:
            runs[-1].append(entry)
        else:
            runs.append([entry])
    return runs


def _span(run: list[dict[str, Any]], unit: str, units: Units) -> str:
    first = driver_value(run[0]["at"], unit, 6, units)
    if len(run) == 1:
        return first
    return f"{first} .. {driver_value(run[-1]['at'], unit, 6, units)} ({len(run)} poses)"


def _more(key: str, runs: list[Any], width: int) -> list[str]:
    return fact(key, f"{len(runs) - MOST} more", width) if len(runs) > MOST else []
