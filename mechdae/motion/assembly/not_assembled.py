"""What is said of groups that have no pose where they should; modes by their names."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE
from mechdae.describe.mechanism import TOLERANCE
from mechdae.describe.units import shown
from mechdae.equations.reduction import Scene
from mechdae.errors import AssemblyError, UnknownName
from mechdae.motion.assembly.assembler import Assembler
from mechdae.motion.assembly.closure import NoPose
from mechdae.motion.assembly.nearest_mode import Nearest
from mechdae.motion.setup.drivers import DECIMALS, DECIMALS_OF_DRIVERS, DriverPlan
from mechdae.motion.setup.likely_typos import long_length
from mechdae.types import Floats, Json, Unknowns

if TYPE_CHECKING:
    from mechdae.motion.assembly.mode_tree import Mode

TRIES = 8
"""Asked values that are tried where a sketched slide does not close: next, 2nd, 4th, 8th, ..."""
CLOSE = 1e-4
"""Share of 60 degrees, or of the mechanism, to which it is told from where on a sketch closes."""
MOST_NAMED = 64
"""Assembly modes that a message names."""


def nearest_asked_pose(
    assembler: Assembler, plan: DriverPlan, u: Floats
) -> tuple[Unknowns, Nearest] | None:
    """Return the values asked for that are nearest to sketched ones that do not close.

    And the pose there that is nearest to the rest of the sketch; None where none is found. Sketched
    are slides, or some of several drivers, which the first values of the others need not suit.
    """
    known, slides = np.isfinite(plan.sketch), not any(c.is_angle for c in plan.coordinates)
    if plan.values is None or plan.timing or not known.any() or (known.all() and not slides):
        return None
    order = np.argsort(np.linalg.norm(plan.values - u, axis=1), kind="stable")
    tried = dict.fromkeys(min(2**k, len(order)) - 1 for k in range(TRIES))
    for row in (plan.values[order[k]] for k in tried):
        found = assembler.from_sketch(row)
        if found.failure is None:
            return row, found
    return None


def where_it_closes(assembler: Assembler, plan: DriverPlan, u: Floats) -> str:
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
            f"{group.superfluous} of the equations of its joints are redundant: it holds "
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
            f"{'is' if group.superfluous == 1 else 'are'} redundant and must be met exactly"
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
    """Return what lets redundant equations stay open by so much."""
    return f"; or let redundant equations stay open: {TOLERANCE} = {enough:g}"


def where(scene: Scene, u: Floats | list[float]) -> str:
    """Return the driver values for a message."""
    return ", ".join(
        f"{c.text} = {shown(c.unit, v)}" for c, v in zip(scene.drivers, u, strict=True)
    )


def as_sketch(assembler: Assembler, mode: Mode, u: Floats) -> Json:
    """Return the angles of all bodies [deg], in space coordinates and points, for [sketch]."""
    q = assembler.coordinates(mode.x, u)
    angles = {}
    scene = assembler.scene
    if scene.model.mechanism.dimension == 3:
        from mechdae.motion.assembly.spatial.sketch_places import in_space

        return in_space(assembler, mode, u, q)
    driven = {c.part for c in scene.drivers if c.kind == "body angle"}
    for coordinate in scene.recovered:
        if coordinate.kind is ANGLE and coordinate.owner in scene.model.mechanism.bodies:
            digits = DECIMALS_OF_DRIVERS if coordinate.owner in driven else DECIMALS
            angles[f"{coordinate.owner}_deg"] = round(math.degrees(q[coordinate.key]), digits) + 0.0
    for group in scene.groups:
        places = [i for b in assembler.blocks_of(group) for i in assembler.graphs.blocks[b].own]
        if not scene.unknowns.turns[places].all() or any(
            c.places(group, mode.x, u) for c in assembler.choosers
        ):
            angles |= assembler.slides(group, mode.x, u)
    for c, value in zip(assembler.scene.drivers, u, strict=True):
        if c.kind != "body angle":
            angles[c.part if c.kind == "slide" or c.on_curve else c.text] = float(value)
    return angles
