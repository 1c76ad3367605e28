"""Forces as text: efforts, reactions, losses by poses, and what to know about them."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from mechdae.results import WEAR, Result, ShownUnit, Units, effort_unit, reaction_parts
from mechdae.results.series import Summary
from mechdae.results.tables.text import (
    MOST,
    Column,
    cells,
    driver_value,
    fact,
    moves,
    size_of,
    together,
    zero,
)
from mechdae.types import Floats, Json, Matrix, Points, Reactions

FRICTION = {
    "none": "left out",
    "article": "article: losses of the reactions without friction, which it does not change",
    "coupled": "coupled: it acts on the reactions it comes from",
}
PARTS = {"uncoupled": "no friction"}
"""Titles of the parts of an effort; others are called by their word."""
FORCES = ("normal", "pressure", "sliding_speed", "pv")
SPATIAL = 6
"""Components of a reaction in space."""
NOISE = 1e-14
"""Share of the largest force, moment or power below which a number is rounding."""


def is_force(name: str) -> bool:
    """Return whether a series of a joint is about forces, not about motion."""
    return name in FORCES or name.startswith(("reaction", "loss"))


def motion_is_aside(result: Result) -> bool:
    """Return whether only forces are shown: nothing of the motion was asked for by name."""
    return result.kind == "reactions" and getattr(result.definition, "outputs", None) is None


# -- a row for each pose -----------------------------------------------------------------------


def force_columns(result: Result) -> list[Column]:
    """Return efforts, losses, reactions and normal forces over the poses."""
    columns: list[Column] = []
    several = len(result.efforts) > 1
    for name, effort in result.efforts.items():
        suffix = f" {name}" if several else ""
        shares = {PARTS.get(word, word): series[name] for word, series in result.parts.items()}
        most = max(size_of(array) for array in (effort, *shares.values()))
        for title, array in {"effort": effort, **shares}.items():
            shown = result.units.of(effort_unit(result.mechanism, name))
            numbers = cells(array * shown.factor, most * shown.factor)
            columns.append((f"{title}{suffix} [{shown.name}]", numbers))
    losses = [series["loss"] for series in result.joints.values() if "loss" in series]
    if losses:
        columns.append(("loss [W]", _numbers(np.sum(losses, axis=0))))
    loaded = {name: series for name, series in result.joints.items() if "reaction" in series}
    largest = max((size_of(_force(each["reaction"])) for each in loaded.values()), default=0.0)
    force = result.units.of("N")
    order = sorted(loaded, key=lambda name: "loss" not in loaded[name])
    for name in order:
        if "normal" not in loaded[name] and np.isfinite(loaded[name]["reaction"]).any():
            size = _size(loaded[name]["reaction"]) * force.factor
            columns.append((f"|{name}| [{force.name}]", _numbers(size)))
    for name in order:
        if "normal" in loaded[name]:
            normal = loaded[name]["normal"] * force.factor
            columns.append((f"{name} N [{force.name}]", cells(normal, largest * force.factor)))
    return columns


def _numbers(values: Floats) -> Sequence[str]:
    return cells(values, size_of(values))


def _force(reaction: Reactions) -> Points:
    """Return the components of the force of a reaction, (n, 2) or (n, 3)."""
    return reaction[:, : 3 if reaction.shape[1] == SPATIAL else 2]


def _size(reaction: Reactions) -> Floats:
    force = _force(reaction)
    return (
        np.hypot(force[:, 0], force[:, 1]) if force.shape[1] == 2 else np.linalg.norm(force, axis=1)
    )


# -- a single pose -----------------------------------------------------------------------------


def single_forces(result: Result) -> Iterator[str]:
    """Yield one quantity per line: efforts, then joint by joint."""
    units = result.units
    words = [("effort", result.efforts)]
    words += [(f"effort_{word}", series) for word, series in result.parts.items()]
    for name in result.efforts:
        for word, series in words:
            effort = units.of(effort_unit(result.mechanism, name))
            yield _line(name, word, f"{series[name][0] * effort.factor: .12g}", effort.name)
    loaded = [series["reaction"] for series in result.joints.values() if "reaction" in series]
    moments = [float(m) for reaction in loaded for m in reaction[0, _force(reaction).shape[1] :]]
    forces = [float(_size(o["reaction"])[0]) for o in result.joints.values() if "reaction" in o]
    least = (NOISE * size_of(np.array(forces)), NOISE * size_of(np.array(moments)))
    for name, series in result.joints.items():
        for word, array in series.items():
            if word.startswith("reaction"):
                if word == "reaction" and name in result.summary.get("not_unique", ()):
                    yield f"  {name:18} {word:20}  not unique"
                    continue
                yield _line(name, word, *_vector(array[0], word, least, units))
                if word == "reaction" and np.isfinite(array).all():
                    force = units.of("N")
                    size = zero(_size(array)[0], least[0]) * force.factor
                    yield _line(name, "|reaction|", f"{size: .10g}", force.name)
            elif is_force(word):
                si = result.unit("joints", name, word)
                shown = units.of(si)
                value = zero(array[0], {"N": least[0], "N m": least[1]}.get(si, 0.0))
                yield _line(name, word, f"{value * shown.factor: .10g}", shown.name)
        if name in result.summary.get("not_unique", ()):
            yield from _unique(name, result.unique.get(name, {}), units)
    for entry in result.solutions:
        how = "proven" if entry["proven"] else "found, there may be more"
        yield f"  {entry['count']} solutions, {how}"
        for k, found in enumerate(entry["solutions"], start=1):
            for name, value in found["efforts"].items():
                shown = units.of(effort_unit(result.mechanism, name))
                text = f"{value * shown.factor: .12g} {shown.name}"
                mark = "   continues from no friction" if found["connected"] else ""
                yield f"  {name:18} {f'effort, solution {k}':20} {text}{mark}"


def _line(part: str, name: str, text: str, unit: str) -> str:
    return f"  {part:18} {name:20}  -" if "nan" in text else f"  {part:18} {name:20} {text} {unit}"


def _vector(value: Floats, name: str, least: tuple[float, float], units: Units) -> tuple[str, str]:
    """Return force and moment as text with their units."""
    si = reaction_parts(name, len(value))[1]
    rounded = [
        0.0 if abs(v) < least[u == "N m"] else v * units.of(u).factor
        for v, u in zip(value, si, strict=True)
    ]
    n, nm = units.of("N").name, units.of("N m").name
    if len(rounded) == SPATIAL:
        force, moment = (", ".join(f"{v:.9g}" for v in part) for part in (rounded[:3], rounded[3:]))
        return f"({force}) {n}, ({moment})", nm
    text = f"({rounded[0]: .9g}, {rounded[1]: .9g})"
    return (text, n) if len(si) == 2 else (f"{text} {n}, {rounded[2]:.9g}", nm)


def _along(facts: Mapping[str, Matrix | str]) -> tuple[Any, Any]:
    """Return the unique directions and the values along them at the first pose."""
    return (facts["directions"], facts["values"][0]) if facts else ((), ())


def _unique(name: str, facts: dict[str, Any], units: Units) -> Iterator[str]:
    """Yield a line for each unique direction of a reaction that is not unique as a whole."""
    for direction, value in zip(*_along(facts), strict=True):
        if len(direction) == SPATIAL:
            yield _unique_in_space(name, direction, value, facts["frame"], units)
            continue
        x, y, turn = (f"{v:.6g}" for v in direction)
        along = "about it" if (direction[:2] == 0).all() else f"along ({x}, {y}, {turn})"
        si = "N m" if along == "about it" else "N" if direction[2] == 0 else "N, N m"
        unit = units.of(si)  # one of force and moment together has no other
        frame = "" if facts["frame"] == "world" else f" of {facts['frame']}"
        text = f"{_amount(value, unit)} {along}{frame}"
        yield f"  {name:18} {'reaction, unique':20} {text}"


def _amount(value: float, unit: ShownUnit) -> str:
    """Return a value with its unit; of pairs that stick together there may be none."""
    return " -" if np.isnan(value) else f"{value * unit.factor: .9g} {unit.name}"


def _unique_in_space(name: str, direction: Any, value: float, frame: str, units: Units) -> str:
    """Return the line of a unique direction (6,) of force and moment."""
    force, moment = (", ".join(f"{v:.6g}" for v in part) for part in (direction[:3], direction[3:]))
    parts = [f"along ({force})"] if direction[:3].any() else []
    parts += [f"about ({moment})"] if direction[3:].any() else []
    si = "N m" if not direction[:3].any() else "N" if not direction[3:].any() else "N, N m"
    unit = units.of(si)
    of = "" if frame == "world" else f" of {frame}"
    text = f"{_amount(value, unit)} {' and '.join(parts)}{of}"
    return f"  {name:18} {'reaction, unique':20} {text}"


# -- below the table --------------------------------------------------------------------------


def force_facts(result: Result, width: int) -> list[str]:
    """Return lines on friction, the cycle, poses without or with several solutions, checks."""
    task: Any = result.definition
    summary, units = result.summary, result.units
    lines = fact("friction", _friction(result), width)
    if task.direction == "load":
        lines += fact("direction", "resistances push along the motion", width)
    lead, single = _lead_unit(result)
    unit = "s" if result.time is not None else lead if single else "1"
    lines += _cycle(summary, unit, width, units)
    if "wear" in summary:
        lines += wear_lines(summary["wear"])
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


def _margin(summary: Summary, lead: str, width: int, units: Units) -> list[str]:
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


def _cycle(figures: Summary, unit: str, width: int, units: Units) -> list[str]:
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


def _losses(figures: Summary) -> list[str]:
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
        for title, numbers in columns:
            value = sum(numbers.values()) if name == "all" else numbers[name]
            row += f"  {value:>{len(title)}.6g}"
        lines.append(row)
    return lines


def _jams(figures: Summary, unit: str, lead: str, width: int, units: Units) -> list[str]:
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
        cases += [(_places(run, lead, units), run) for run in _runs(entries)]
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
        known = all(any(solution["connected"] for solution in entry["solutions"]) for entry in run)
        which = "the one that continues from no friction" if known else "the first of them"
        place = _places(run, unit, result.units)
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


def _places(run: list[dict[str, Any]], unit: str, units: Units) -> str:
    first = driver_value(run[0]["at"], unit, 6, units)
    if len(run) == 1:
        return first
    return f"{first} .. {driver_value(run[-1]['at'], unit, 6, units)} ({len(run)} poses)"


def _more(key: str, runs: Sequence[object], width: int) -> list[str]:
    return fact(key, f"{len(runs) - MOST} more", width) if len(runs) > MOST else []


TITLES = {word: f"{word.replace('_', ' ')} [{unit}]" for word, unit in WEAR.items()}


def wear_lines(contacts: dict[str, Json]) -> list[str]:
    """Return a line for each contact, with a title."""
    size = max(map(len, contacts))
    lines = [f"  wear      {'':{size}}  " + "  ".join(TITLES.values())]
    for name, wear in contacts.items():
        cells = (f"{wear[word]:>{len(title)}.6g}" for word, title in TITLES.items())
        lines.append(f"            {name:{size}}  " + "  ".join(cells))
    return lines
