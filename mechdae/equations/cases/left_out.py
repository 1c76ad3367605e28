"""Bodies that constraints are missing for and that nothing asks for are left out of a scene."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace

from mechdae.describe.coordinates import Selection, coordinate
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.describe.named import bodies_of
from mechdae.describe.spinning_links import rollers
from mechdae.describe.values import Table
from mechdae.equations.groups import Group, assur_groups, body_numbers
from mechdae.equations.model import Model, Row


def bodies_asked_for(model: Model, chosen: Selection, loaded: Iterable[str]) -> set[str]:
    """Return the bodies that a selection and loads are about."""
    bodies = set(loaded) | set(chosen.bodies) | {point.split(".")[0] for point in chosen.points}
    for name in chosen.joints:
        bodies |= set(model.mechanism.joints[name].bodies)
    return (bodies | bodies_of(model.mechanism, chosen.named)) - {GROUND}


def _joined(mechanism: Mechanism, out: set[str]) -> set[str]:
    """Return those of the bodies left `out` that joints join to one that is not, over others."""
    joined = {name for name in mechanism.bodies if name not in out}
    links = [set(joint.bodies) - {GROUND} for joint in mechanism.joints.values()]
    front = list(joined)
    while front:
        body = front.pop()
        new = {other for link in links if body in link for other in link} - joined
        joined |= new
        front += new
    return joined & out


def left_out(
    model: Model,
    rows: Sequence[Row],
    chosen: Selection,
    listed: bool,
    held: set[str],
    heavy: set[str],
) -> tuple[Selection, set[str]]:
    """Return the selection, and the bodies left out that constraints are missing for.

    These are bodies that nothing asks for, drives or loads. Where all are asked for, a body that
    hangs on one pin alone, an idle roller, is none of them: what hangs on its turn is taken out of
    the selection. Weight and inertia of `heavy` bodies act on what joints join them to.
    """
    out = set(model.loose_bodies(rows))
    mechanism = model.mechanism
    if not listed:
        idle = out & set(rollers(mechanism))
        chosen = replace(
            chosen,
            bodies=tuple(name for name in chosen.bodies if name not in idle),
            points=tuple(name for name in chosen.points if name.split(".")[0] not in idle),
            joints=tuple(n for n in chosen.joints if not idle & set(mechanism.joints[n].bodies)),
        )
    needed = bodies_asked_for(model, chosen, held) | (heavy & _joined(mechanism, out))
    return chosen, set() if out & needed else out


def groups_without(
    model: Model, rows: Sequence[Row], coarse: bool, out: Collection[str]
) -> list[Group]:
    """Return the groups of a mechanism without some bodies: numbers are those of the whole."""
    mechanism = model.mechanism
    if {*mechanism.bodies} <= {*out}:
        return []
    gone = {name for name, joint in mechanism.joints.items() if set(out) & set(joint.bodies)}
    rest = replace(
        mechanism,
        bodies=Table({n: body for n, body in mechanism.bodies.items() if n not in out}),
        joints=Table({n: joint for n, joint in mechanism.joints.items() if n not in gone}),
        loads=Table(),
        outputs=Table(),
        sketch=Table(),
    )
    indices = [i for i, row in enumerate(rows) if row.owner not in gone]
    drivers = [coordinate(rest, rows[i].owner) for i in indices if rows[i].driver]
    part = model.part(rest)
    own_rows, _ = part.driven(drivers)
    numbers, columns = body_numbers(mechanism), [model.places[key] for key in part.q_names]
    return [
        replace(
            group,
            rows=tuple(indices[i] for i in group.rows),
            columns=tuple(columns[j] for j in group.columns),
            numbers=tuple(numbers[name] for name in group.bodies),
        )
        for group in assur_groups(part, own_rows, coarse)
    ]
