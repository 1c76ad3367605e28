"""Efforts, reactions, losses and normal forces as text, by poses."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from mechdae.results import Result, ShownUnit, Units, effort_unit, reaction_parts
from mechdae.results.tables.text import Column, cells

PARTS = {"uncoupled": "no friction"}
"""Titles of the parts of an effort; others are called by their word."""
SPATIAL = 6
"""Components of a reaction in space."""
NOISE = 1e-14
"""Share of the largest force, moment or power below which a number is rounding."""


def is_force(name: str) -> bool:
    """Return whether a series of a joint is about forces, not about motion."""
    return name == "normal" or name.startswith(("reaction", "loss"))


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
        shares = {PARTS.get(word, word): own[name] for word, own in result.parts.items()}
        most = max(_most(array) for array in (effort, *shares.values()))
        for title, array in {"effort": effort, **shares}.items():
            own = result.units.of(effort_unit(result.mechanism, name))
            numbers = cells(array * own.factor, most * own.factor)
            columns.append((f"{title}{suffix} [{own.name}]", numbers))
    losses = [series["loss"] for series in result.joints.values() if "loss" in series]
    if losses:
        columns.append(("loss [W]", _numbers(np.sum(losses, axis=0))))
    loaded = {name: own for name, own in result.joints.items() if "reaction" in own}
    largest = max(
        (float(np.nanmax(np.abs(_force(own["reaction"])), initial=0.0)) for own in loaded.values()),
        default=0.0,
    )
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


def _numbers(values: Any) -> Sequence[str]:
    return cells(values, _most(values))


def _most(values: Any) -> float:
    return float(np.nanmax(np.abs(values), initial=0.0))


def _force(reaction: Any) -> Any:
    """Return the components of the force of a reaction, (n, 2) or (n, 3)."""
    return reaction[:, : 3 if reaction.shape[1] == SPATIAL else 2]


def _size(reaction: Any) -> Any:
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
    loaded = [own["reaction"] for own in result.joints.values() if "reaction" in own]
    moments = [float(m) for own in loaded for m in own[0, _force(own).shape[1] :]]
    forces = [float(_size(o["reaction"])[0]) for o in result.joints.values() if "reaction" in o]
    least = (_noise(forces), _noise(moments))
    for name, series in result.joints.items():
        for word, array in series.items():
            if word.startswith("reaction"):
                if word == "reaction" and name in result.summary.get("not_unique", ()):
                    yield f"  {name:18} {word:20}  not unique"
                    continue
                yield _line(name, word, *_vector(array[0], word, least, units))
                if word == "reaction" and np.isfinite(array).all():
                    force = units.of("N")
                    size = _size(array)[0] * force.factor
                    yield _line(name, "|reaction|", f"{size: .10g}", force.name)
            elif is_force(word):
                own = units.of(result.unit("joints", name, word))
                yield _line(name, word, f"{array[0] * own.factor: .10g}", own.name)
        if name in result.summary.get("not_unique", ()):
            yield from _unique(name, result.unique.get(name, {}), units)
    for entry in result.solutions:
        how = "proven" if entry["proven"] else "found, there may be more"
        yield f"  {entry['count']} solutions, {how}"
        for k, found in enumerate(entry["solutions"], start=1):
            for name, value in found["efforts"].items():
                own = units.of(effort_unit(result.mechanism, name))
                text = f"{value * own.factor: .12g} {own.name}"
                mark = "   continues from no friction" if found["connected"] else ""
                yield f"  {name:18} {f'effort, solution {k}':20} {text}{mark}"


def _line(part: str, name: str, text: str, unit: str) -> str:
    return f"  {part:18} {name:20}  -" if "nan" in text else f"  {part:18} {name:20} {text} {unit}"


def _noise(values: list[float]) -> float:
    return NOISE * float(np.nanmax(np.abs(values), initial=0.0))


def _vector(value: Any, name: str, least: tuple[float, float], units: Units) -> tuple[str, str]:
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


def _along(own: dict[str, Any]) -> tuple[Any, Any]:
    """Return the unique directions and the values along them at the first pose."""
    return (own["directions"], own["values"][0]) if own else ((), ())


def _unique(name: str, own: dict[str, Any], units: Units) -> Iterator[str]:
    """Yield a line for each unique direction of a reaction that is not unique as a whole."""
    for direction, value in zip(*_along(own), strict=True):
        if len(direction) == SPATIAL:
            yield _unique_in_space(name, direction, value, own["frame"], units)
            continue
        x, y, turn = (f"{v:.6g}" for v in direction)
        along = "about it" if (direction[:2] == 0).all() else f"along ({x}, {y}, {turn})"
        si = "N m" if along == "about it" else "N" if direction[2] == 0 else "N, N m"
        unit = units.of(si)  # one of force and moment together has no other
        frame = "" if own["frame"] == "world" else f" of {own['frame']}"
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
