"""The first pose of a task: from the sketch, or on an assembly mode asked for."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import numpy as np

from mechdae.describe.structure import cylinders
from mechdae.describe.units import shown
from mechdae.errors import MechanismError, SketchError
from mechdae.motion.assembly.assembler import Assembler
from mechdae.motion.assembly.nearest_mode import MOST_BEGUN
from mechdae.motion.assembly.not_assembled import (
    nearest_asked_pose,
    not_assembled,
    where_it_closes,
)
from mechdae.motion.setup.drivers import DriverPlan
from mechdae.motion.setup.likely_typos import MANY, odd_lengths
from mechdae.types import Floats, Unknowns


def sketched_pose(
    assembler: Assembler, plan: DriverPlan, labelled: bool = True
) -> tuple[Unknowns, Unknowns]:
    """Return driver values (nd,) and unknowns (nx,) of the assembled sketch.

    `labelled` tells that the task may name the mode by its label.

    Raises
    ------
    AssemblyError
        A group does not close at the sketch's driver value.
    MechanismError
        The sketch does not tell which of several modes is meant.
    """
    u = start_values(plan)
    found = assembler.from_sketch(u)
    if found.failure is not None:
        other = nearest_asked_pose(assembler, plan, u)
        if other is None:
            searched = found.failure.starts or found.failure.group.superfluous
            hint = "" if searched else where_it_closes(assembler, plan, u)
            raise not_assembled(assembler.scene, found.failure, u, hint)
        u, found = other
    if found.doubtful:
        keys, lines = assembler.sketched.undecided.hint(found.tied, u)
        error = SketchError if keys else MechanismError
        raise error(
            f"does not tell which assembly mode of group {found.doubtful[0].name} is meant",
            where="sketch",
            hint=(
                f"add {' and '.join(keys)} to [sketch], like {' and '.join(lines)}"
                f"{', or choose a mode with --mode' if labelled else ''}"
                if keys
                else "the modes meet at this pose: sketch another one"
            ),
        )
    _check_near(assembler, found.x, u)
    return u, found.x


def _check_near(assembler: Assembler, x: Unknowns, u: Floats) -> None:
    """Raise where angles that look like degrees chose between modes a right angle off or more.

    Other sketches so far off have a note: they may be those of another value of the driver.
    """
    entries = assembler.sketched.entries
    if not any(abs(e.wanted) > MANY for e in entries if e.coordinate.kind == "body angle"):
        return
    for stage, angles in _turned(assembler, x, u).items():
        group = assembler.scene.groups[stage]
        plain = [body for body, (wanted, _) in angles.items() if abs(wanted) > MANY]
        body = max(angles, key=lambda name: abs(angles[name][1]))
        off = math.hypot(*[gap for _, gap in angles.values()])
        if not plain or group.driven or off <= math.pi / 2:
            continue
        if len(assembler.candidates(group, x, u, nearby=True)[0]) < 2:
            continue
        near = ", ".join(
            f"{name}_deg = {math.degrees(math.remainder(wanted + gap, 2 * math.pi)):.6g}"
            for name, (wanted, gap) in angles.items()
        )
        slips = [f"{name} = {v:g}" for name, v in assembler.sketch.items() if abs(v) > MANY]
        slip = f"in radians are {', '.join(slips)}; did you mean {slips[0].split()[0]}_deg? Else "
        raise SketchError(
            f"chooses no assembly mode of group {group.name}: the nearest one is "
            f"{math.degrees(off):.0f} degrees away, {body} most of all",
            where="sketch",
            hint=f"{slip}sketch the mode that is meant; the nearest one has {near}",
        )


def _turned(
    assembler: Assembler, x: Floats, u: Floats
) -> dict[int, dict[str, tuple[float, float]]]:
    """Return by place of the group and body the sketched angle, how far the pose is off it."""
    angles: dict[int, dict[str, tuple[float, float]]] = {}
    for entry in assembler.sketched.entries:
        if entry.coordinate.kind == "body angle":
            gap = entry.gap(x, u, assembler.p)
            angles.setdefault(entry.stage, {})[entry.coordinate.part] = (entry.wanted, gap)
    return angles


def try_redundant(assembler: Assembler, plan: DriverPlan) -> None:
    """Assemble the sketch of a scene with redundant groups.

    Raises
    ------
    FreedomError
        A group has a freedom of its own.
    """
    if assembler.scene.redundant:
        assembler.from_sketch(start_values(plan))


def doubts(
    assembler: Assembler, plan: DriverPlan, x: Unknowns, u: Floats, ended: bool, turned: list[str],
    slips: Callable[[], list[str]] = list,
) -> list[str]:  # fmt: skip
    """Return what looks like a slip of the pen: degrees without a suffix, a far-off sketch.

    `ended` and `turned` are what the search for the pose has noted (`Sketched`), `slips` gives
    notes on the drivers' values.
    """
    slipped = slips()
    notes = [*slipped]
    for c, wanted, value in zip(plan.coordinates, plan.sketch, u, strict=True):
        if math.isfinite(wanted) and wanted != value:
            texts = (f"{c.text} = {shown(c.unit, number)}" for number in (wanted, value))
            notes.append(
                "sketch: {} does not close; begun at {}, which is asked for".format(*texts)
            )
    for body, angle in assembler.sketch.items():
        if abs(angle) > MANY:
            notes.append(f"sketch: {body} = {angle:g} is in radians; did you mean {body}_deg?")
    notes += odd_lengths(assembler.scene.model.mechanism)
    if not slipped and plan.values is not None and plan.coordinates[0].is_angle:
        turns = float(np.ptp(plan.values[:, 0])) / (2 * math.pi)
        if turns > 5 and len(plan.values) < 20 * turns:
            notes.append(
                f"{plan.coordinates[0].text} turns {turns:.1f} times in {len(plan.values)} poses; "
                f"numbers without a suffix are radians"
            )
    for chooser in assembler.choosers:
        notes += chooser.notes()
    entries = [entry.coordinate for entry in assembler.sketched.entries]
    parts = {c.part for c in (*entries, *plan.coordinates) if not c.is_angle}
    mechanism = assembler.scene.model.mechanism
    pushed, names = cylinders(mechanism), {text: name for name, text in mechanism.aliases.items()}
    for group in assembler.scene.groups if pushed else ():
        for name, slide in assembler.slides(group, x, u).items():
            if name in pushed and slide < 0 and name not in parts:
                text = names.get(f"{name}.slide", f"{name}.slide")
                notes.append(f"{text} is negative at first: {slide:.6g} m, a length backwards")
    if ended:
        notes.append(
            f"the sketch is too rough to compare all modes: {MOST_BEGUN} were begun, another may "
            f"be nearer to it"
        )
    if turned:
        notes.append(
            f"the sketch does not tell how links at {', '.join(turned)} are "
            f"turned about themselves, and no point does: the pose of the least angles is taken"
        )
    for stage, group in enumerate(assembler.scene.groups):
        off = assembler.sketched.distance(group, x, u)
        if off > math.pi / 4 and not group.driven:
            away = f"is {math.degrees(off):.0f} degrees away from it"
            if len(angles := _turned(assembler, x, u).get(stage, {})) > 1:
                body, (wanted, gap) = max(angles.items(), key=lambda each: abs(each[1][1]))
                angle = math.degrees(math.remainder(wanted + gap, 2 * math.pi))
                away += f", {body} most of all, at {angle:.0f} deg"
            if assembler.scene.model.space.behind:  # places count as shares of the size
                away = "lies far from it"
            notes.append(f"the pose of group {group.name} nearest to the sketch {away}")
    return notes


def noted(
    left_out: Iterable[str], doubts: Callable[[], list[str]], more: list[str]
) -> dict[str, list[str]]:
    """Return the notes on the scene, on the first pose, and more, where there are any."""
    every = [*left_out, *doubts(), *more]
    return {"notes": every} if every else {}


def start_values(plan: DriverPlan) -> Floats:
    """Return the drivers' values in the sketch, in their absence those of the first pose."""
    u = plan.sketch.copy()
    if np.isnan(u).any():
        u = np.where(np.isnan(u), plan.first, u)
        if np.isnan(u).any():
            c = plan.coordinates[int(np.argmax(np.isnan(u)))]
            key = f"{c.part}_deg = 30" if c.kind == "body angle" else f"{c.part} = 0.1"
            raise MechanismError(
                f"the sketch must give the driver {c.text}",
                where="sketch",
                hint=f"a line like {key} in [sketch]" if c.kind != "point" else f'"{c.text}" = 0.1',
            )
    return u
