"""The first pose of a task: from the sketch, or on an assembly mode asked for."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE
from mechdae.describe.mechanism import TOLERANCE
from mechdae.describe.structure import cylinders
from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene
from mechdae.errors import AssemblyError, MechanismError, SketchError, UnknownName
from mechdae.motion.assembly.assembler import Assembler
from mechdae.motion.assembly.closure import NoPose
from mechdae.motion.assembly.nearest_mode import MOST_BEGUN, Nearest
from mechdae.motion.setup.drivers import DECIMALS, DECIMALS_OF_DRIVERS, DriverPlan
from mechdae.motion.setup.likely_typos import MANY, long_length, odd_lengths
from mechdae.types import Floats, Json, Unknowns

if TYPE_CHECKING:
    from mechdae.motion.assembly.mode_tree import Mode

TRIES = 8
"""Asked values that are tried where a sketched slide does not close: next, 2nd, 4th, 8th, ..."""
CLOSE = 1e-4
"""Share of 60 degrees, or of the mechanism, to which it is told from where on a sketch closes."""
MOST_NAMED = 64
"""Assembly modes that a message names."""


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
        other = _asked_pose(assembler, plan, u)
        if other is None:
            searched = found.failure.starts or found.failure.group.superfluous
            hint = "" if searched else _where_it_closes(assembler, plan, u)
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


def _asked_pose(
    assembler: Assembler, plan: DriverPlan, u: Floats
) -> tuple[Unknowns, Nearest] | None:
    """Return the values asked for that are nearest to sketched slides that do not close.

    And the pose there that is nearest to the rest of the sketch; None where none is found.
    """
    slides = not any(c.is_angle for c in plan.coordinates) and np.isfinite(plan.sketch).all()
    if plan.values is None or plan.timing or not slides:
        return None
    order = np.argsort(np.linalg.norm(plan.values - u, axis=1), kind="stable")
    tried = dict.fromkeys(min(2**k, len(order)) - 1 for k in range(TRIES))
    for row in (plan.values[order[k]] for k in tried):
        found = assembler.from_sketch(row)
        if found.failure is None:
            return row, found
    return None


def _where_it_closes(assembler: Assembler, plan: DriverPlan, u: Floats) -> str:
    """Return from which value of a single driver on the sketch closes, "" where none is near."""
    if len(u) > 1 or plan.timing:
        return ""
    c = plan.coordinates[0]
    size = math.radians(60) if c.is_angle else assembler.size

    def closes(value: float) -> bool:
        return assembler.from_sketch(np.array([value])).failure is None

    for share, way in itertools.product((1 / 64, 1 / 16, 1 / 4, 1.0), (1.0, -1.0)):
        low, high = float(u[0]), float(u[0]) + way * share * size
        if closes(high):
            while abs(high - low) > CLOSE * size:
                middle = (low + high) / 2
                low, high = (low, middle) if closes(middle) else (middle, high)
            text = shown(c.unit, high + way * CLOSE * size)
            return f"it closes from {c.text} = {text} {'on' if way > 0 else 'down'}"
    return ""


def _check_near(assembler: Assembler, x: Unknowns, u: Floats) -> None:
    """Raise where angles that look like degrees chose between modes a right angle off or more.

    Other sketches so far off have a note: they may be those of another value of the driver.
    """
    for group, own in _turned(assembler, x, u).items():
        plain = [body for body, (wanted, _) in own.items() if abs(wanted) > MANY]
        body = max(own, key=lambda name: abs(own[name][1]))
        off = math.hypot(*[gap for _, gap in own.values()])
        if not plain or group.driven or off <= math.pi / 2:
            continue
        if len(assembler.candidates(group, x, u, nearby=True)[0]) < 2:
            continue
        near = ", ".join(
            f"{name}_deg = {math.degrees(math.remainder(wanted + gap, 2 * math.pi)):.6g}"
            for name, (wanted, gap) in own.items()
        )
        slips = [f"{name} = {v:g}" for name, v in assembler.sketch.items() if abs(v) > MANY]
        slip = f"in radians are {', '.join(slips)}; did you mean {slips[0].split()[0]}_deg? Else "
        raise SketchError(
            f"chooses no assembly mode of group {group.name}: the nearest one is "
            f"{math.degrees(off):.0f} degrees away, {body} most of all",
            where="sketch",
            hint=f"{slip}sketch the mode that is meant; the nearest one has {near}",
        )


def _turned(assembler: Assembler, x: Any, u: Floats) -> dict[Group, dict[str, tuple[float, float]]]:
    """Return by group and body the sketched angle, and by how much the pose is off it."""
    angles: dict[Group, dict[str, tuple[float, float]]] = {}
    for entry in assembler.sketched.entries:
        if entry.coordinate.kind == "body angle":
            group = assembler.scene.groups[entry.stage]
            gap = entry.gap(x, u, assembler.p)
            angles.setdefault(group, {})[entry.coordinate.part] = (entry.wanted, gap)
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
    assembler: Assembler, plan: DriverPlan, x: Unknowns, u: Floats, slips: Sequence[str] = ()
) -> list[str]:
    """Return what looks like a slip of the pen: degrees without a suffix, a far-off sketch.

    `slips` are those of the drivers' values.
    """
    notes = list(slips)
    for c, wanted, value in zip(plan.coordinates, plan.sketch, u, strict=True):
        if math.isfinite(wanted) and wanted != value and not c.is_angle:
            texts = (f"{c.text} = {shown(c.unit, own)}" for own in (wanted, value))
            notes.append(
                "sketch: {} does not close; begun at {}, which is asked for".format(*texts)
            )
    for body, angle in assembler.sketch.items():
        if abs(angle) > MANY:
            notes.append(f"sketch: {body} = {angle:g} is in radians; did you mean {body}_deg?")
    notes += odd_lengths(assembler.scene.model.mechanism)
    if not slips and plan.values is not None and plan.coordinates[0].is_angle:
        turns = float(np.ptp(plan.values[:, 0])) / (2 * math.pi)
        if turns > 5 and len(plan.values) < 20 * turns:
            notes.append(
                f"{plan.coordinates[0].text} turns {turns:.1f} times in {len(plan.values)} poses; "
                f"numbers without a suffix are radians"
            )
    notes += assembler.contacts.corners()
    entries = [entry.coordinate for entry in assembler.sketched.entries]
    told = {c.part for c in (*entries, *plan.coordinates) if not c.is_angle}
    mechanism = assembler.scene.model.mechanism
    pushed, names = cylinders(mechanism), {text: name for name, text in mechanism.aliases.items()}
    for group in assembler.scene.groups:
        for name, slide in assembler.slides(group, x, u).items():
            if name in pushed and slide < 0 and name not in told:
                text = names.get(f"{name}.slide", f"{name}.slide")
                notes.append(f"{text} is negative at first: {slide:.6g} m, a length backwards")
    if assembler.sketched.ended:
        notes.append(
            f"the sketch is too rough to compare all modes: {MOST_BEGUN} were begun, another may "
            f"be nearer to it"
        )
    if assembler.sketched.turned:
        notes.append(
            f"the sketch does not tell how links at {', '.join(assembler.sketched.turned)} are "
            f"turned about themselves, and no point does: the pose of the least angles is taken"
        )
    for group in assembler.scene.groups:
        off = assembler.sketched.distance(group, x, u)
        if off > math.pi / 4 and not group.driven:
            away = f"is {math.degrees(off):.0f} degrees away from it"
            if len(own := _turned(assembler, x, u).get(group, {})) > 1:
                body, (wanted, gap) = max(own.items(), key=lambda each: abs(each[1][1]))
                angle = math.degrees(math.remainder(wanted + gap, 2 * math.pi))
                away += f", {body} most of all, at {angle:.0f} deg"
            if assembler.scene.model.space.behind:  # places count as shares of the size
                away = "lies far from it"
            notes.append(f"the pose of group {group.name} nearest to the sketch {away}")
    return notes


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


def mode_by_label(assembler: Assembler, u: Floats, label: str) -> Mode:
    """Return the assembly mode with that label at `u`.

    Raises
    ------
    UnknownName
        No such mode; the message lists those there are.
    """
    modes = assembler.modes(u, by_paths=True)
    wanted = label.replace(" ", "")
    for mode in modes.having(wanted.split(",")):
        if mode.label == wanted:
            return mode
    if modes.failure is not None:
        raise not_assembled(assembler.scene, modes.failure, u)
    there = [mode.label for mode in modes.first(MOST_NAMED)]
    more = f"  and {modes.count - MOST_NAMED} more" if modes.count > MOST_NAMED else ""
    error = UnknownName("assembly mode", label, there)
    error.hint = "the modes here are " + "  ".join(there) + more
    raise error


def not_assembled(scene: Scene, failure: NoPose, u: Floats, hint: str = "") -> AssemblyError:
    """Return the error for a group that has no pose at `u`; `hint` tells where it has one."""
    group, at = failure.group, failure.at
    joint, unit = (at.joint, at.unit) if at is not None else (group.key_joint, "m")
    gap = f" by {failure.gap:.4g} {unit}" if 0 < failure.gap < math.inf else ""
    what = f"group {group.name} cannot be assembled: joint {joint} stays open{gap}"
    hint = long_length(scene.model.mechanism) or "; ".join(
        filter(None, (hint, at.reach if at is not None else ""))
    )
    hint = hint or "check the lengths, or give the sketch with a driver value at which it closes"
    if group.superfluous and scene.model.space.behind:
        hint = (
            f"{group.superfluous} of the equations of its joints are superfluous: it holds "
            f"together for special dimensions only; a joint with more freedoms, or dimensions that "
            f"depend on each other as expressions"
        )
    if failure.starts:
        what = (
            f"group {group.name}: no pose was found by Newton's method from {failure.starts} starts"
        )
        if gap:
            what += f"; where its equations are met best, joint {joint} stays open{gap}"
    if failure.infinite:
        what = f"group {group.name} has infinitely many modes: a gear ratio is not rational"
        hint = (
            "give the ratio as numbers of teeth; a sweep starts on the mode nearest to the sketch"
        )
    if failure.free:
        what = f"group {group.name} moves by itself at this pose"
        if group.is_dyad:
            what += ": its outer pins coincide"
            hint = "sketch a pose, or give a value of the driver, at which they do not"
        else:
            what += ", in all that were found: its dimensions are special"
            hint = "drive or hold its bodies, or change a dimension"
    if at is not None and at.superfluous:
        owners = list(dict.fromkeys(scene.rows[i].owner for i in group.rows))
        what += (
            f"; of the equations of {', '.join(owners)} {group.superfluous} "
            f"{'is' if group.superfluous == 1 else 'are'} superfluous and must be met exactly"
        )
        freedoms = len(scene.model.q_names) - len(scene.model.rows)
        count = f"{len(scene.drivers)} drivers, {freedoms} freedom(s) by the count"
        hint = f"{count}: leave a driver out, " if len(scene.drivers) > max(freedoms, 1) else ""
        hint += (
            "give dimensions that depend on each other as expressions, or with all their digits; "
            f"or remove a joint{' or a driver' if len(scene.drivers) > 1 else ''}"
        )
        enough = at.tolerance(scene.model.mechanism.scale)
        hint += tolerance_hint(enough) if enough else ""
    return AssemblyError(what, where=where(scene, u), hint=hint)


def tolerance_hint(enough: float) -> str:
    """Return what lets superfluous equations stay open by so much."""
    return f"; or let superfluous equations stay open: {TOLERANCE} = {enough:g}"


def where(scene: Scene, u: Floats | list[float]) -> str:
    """Return the driver values for a message."""
    return ", ".join(
        f"{c.text} = {shown(c.unit, v)}" for c, v in zip(scene.drivers, u, strict=True)
    )


def shown(unit: str, value: float) -> str:
    """Return a driver's value with its unit for people."""
    if unit == "rad":
        return f"{math.degrees(value):.6g} deg"
    return f"{value:.6g} m" if unit == "m" else f"{value:.6g}"


def as_sketch(assembler: Assembler, mode: Mode, u: Floats) -> Json:
    """Return the angles of all bodies [deg], in space coordinates and points, for [sketch]."""
    q = assembler.coordinates(mode.x, u)
    angles = {}
    scene = assembler.scene
    if scene.model.mechanism.dimension == 3:
        from mechdae.motion.assembly.spatial.sketch_places import in_space

        return in_space(assembler, mode, u, q)
    driven = {c.part for c in scene.drivers if c.kind == "body angle"}
    for own in scene.recovered:
        if own.kind is ANGLE and own.owner in scene.model.mechanism.bodies:
            digits = DECIMALS_OF_DRIVERS if own.owner in driven else DECIMALS
            angles[f"{own.owner}_deg"] = round(math.degrees(q[own.key]), digits) + 0.0
    for group in scene.groups:
        places = [i for b in assembler.blocks_of(group) for i in assembler.graphs.blocks[b].own]
        if not scene.unknowns.turns[places].all() or assembler.contacts.of(group):
            angles |= assembler.slides(group, mode.x, u)
    for c, value in zip(assembler.scene.drivers, u, strict=True):
        if c.kind != "body angle":
            angles[c.part if c.kind == "slide" or c.on_curve else c.text] = float(value)
    return angles
