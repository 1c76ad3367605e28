"""Limit positions, change points and ends of a path as events, and what is said of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mechdae.equations.groups import Group
from mechdae.motion.assembly import not_assembled
from mechdae.motion.continuation.any_path import AnyPath, arc_of
from mechdae.motion.continuation.step_sizes import PASS
from mechdae.motion.kinematics.prepared import Setting
from mechdae.types import Booleans, Floats, Json

if TYPE_CHECKING:
    from mechdae.motion.cases.hard_steps.crossings.across_change_point import Zone


def limit_events(setting: Setting, path: AnyPath, low: float, high: float) -> list[Json]:
    """Return the ends of the path's groups as events, in the order of s.

    ``at`` is the driver's value, with several drivers the list of their values; ``time`` is
    added where they follow laws. Those beyond the limit of another group are not ``reached``.
    """
    found: list[tuple[float, Json]] = []
    seen = set()
    crossed = {zone.s for zone in path.zones}
    arc = arc_of(path)
    groups = {group.index: group for group in setting.scene.groups}
    for limit in path.ends:
        if (limit.s, limit.group) in seen or limit.s in crossed:
            continue
        seen.add((limit.s, limit.group))
        group = groups[limit.group]
        event = event_at(setting, path, limit.s, group, low <= limit.s <= high)
        event |= {"kind": limit.kind, "joint": limit.joint or group.key_joint}
        if limit.kind == "ambiguous" or (limit.kind == "limit" and limit.gap):
            event["gap"] = limit.gap
        if limit.nearest is not None:
            event["nearest"] = limit.nearest
        if limit.within is not None:
            event |= {"order": limit.order, "range": list(limit.within), "gap": limit.gap}
        found.append((limit.s, event))
    zones = [zone for zone in path.zones if zone.action != PASS]
    found += [pair for zone in zones for pair in _crossed(setting, path, zone, low, high)]
    doubtful = ambiguous(path, np.array([s for s, _ in found]), at_them=False).tolist()
    for (s, event), unsure in zip(found, doubtful, strict=True):
        if not arc.holds(s):
            event["reached"] = False
        if unsure:
            event["ambiguous"] = True
    return [event for _, event in sorted(found, key=lambda pair: pair[0])]


def event_at(setting: Setting, path: AnyPath, s: float, group: Group, inside: bool) -> Json:
    """Return an event at `s`: the drivers' values and the time, the group and its joint."""
    at = path.drivers(np.array([s]))[0].tolist()
    event = {
        "kind": "",
        "at": at if len(at) > 1 else at[0],
        "group": list(group.bodies),
        "joint": group.key_joint,
        "name": group.name,
        "in_range": bool(inside),
    }
    if setting.plan.timing and path.graphs.course:
        event["time"] = s
    return event


def _crossed(
    setting: Setting, path: AnyPath, zone: Zone, low: float, high: float
) -> list[tuple[float, Json]]:
    """Return the change points of a zone as events, with the tangents of both branches.

    ``tangents`` has the rates of the unknowns of the group over the path parameter on the
    branch the path came on and on the other one; None where the driver stands still there, or
    where the other one does not meet the redundant equations (``excluded``).
    """
    events = []
    for crossing in zone.crossings:
        group = next(g for g in setting.scene.groups if g.index == crossing.group)
        unknowns = path.graphs.blocks[crossing.block].own
        other = crossing.other.slope if crossing.other is not None else [None] * len(unknowns)
        names = [".".join(setting.scene.x_names[i]) for i in unknowns]
        tangents = {
            name: [float(a), None if b is None else float(b)]
            for name, a, b in zip(names, crossing.own.slope, other, strict=True)
        }
        event = event_at(setting, path, crossing.s, group, low <= crossing.s <= high)
        event |= {
            "kind": "change_point",
            "action": zone.action,
            "tangents": tangents,
            "exact": crossing.exact,
            "gap": crossing.gap,
            **({"excluded": True} if crossing.excluded else {}),
        }
        if others := [c.group for c in zone.crossings if c is not crossing]:
            named = [g.name for g in setting.scene.groups if g.index in others]
            event["together_with"] = named
        events.append((crossing.s, event))
    return events


def near_crossings(setting: Setting, path: AnyPath) -> list[str]:
    notes = []
    for s, gap in sorted(
        {(end.s, end.gap) for end in path.ends if end.kind == "limit" and end.gap}
    ):
        at = not_assembled.where(setting.scene, path.drivers(np.array([s]))[0])
        notes.append(
            f"just beyond {at} two branches come within {gap:.1g} of each other; for the numbers "
            f"given they turn back"
        )
    for zone in path.zones[:8]:
        for crossing in zone.crossings:
            if crossing.exact:
                continue
            at = not_assembled.where(setting.scene, path.drivers(np.array([zone.s]))[0])
            near = f"at {at} two branches come within {crossing.gap:.1g} of each other"
            if zone.decided:
                notes.append(f"{near} and do not meet for the numbers given")
                continue
            notes.append(
                f"{near}, as near as rounding of the numbers given: poses beyond are ambiguous"
            )
    return notes


def ambiguous(path: AnyPath, s: Floats, at_them: bool = True) -> Booleans:
    """Return which places lie behind branches that come too near each other to be distinguished."""
    result = np.zeros(len(s), bool)
    for zone in path.zones:
        if not zone.decided:
            sense = 1.0 if zone.s > path.origin[0] else -1.0
            result |= (sense * (s - zone.s) >= 0) & (at_them | (s != zone.s))
    return result


def begins_singular(setting: Setting, path: AnyPath, event: Json) -> bool:
    """Return whether the path comes no further than its first pose, which is singular."""
    alone = setting.graphs.single and event["kind"] == "dead_point"
    return alone and bool(event["at"] == path.origin[0])
