"""What is wrong with an answer: poses that are lost, where and why, rollers that cut in."""

from __future__ import annotations

import math

import numpy as np

from mechdae.describe.mechanism import TOLERANCE
from mechdae.describe.units import shown
from mechdae.equations.groups import Group
from mechdae.errors import FreedomError
from mechdae.motion.assembly import not_assembled
from mechdae.motion.assembly.assembler import Assembler
from mechdae.motion.assembly.closure import Gap
from mechdae.motion.continuation.any_path import AnyPath, arc_of
from mechdae.motion.kinematics.path_events import begins_singular
from mechdae.motion.kinematics.prepared import Run, Setting
from mechdae.results import CODES, LOST, Status, among
from mechdae.results.status import Cause, stretches, why_lost
from mechdae.types import Booleans, Floats, Integers, Json

SINGULAR_START = (
    "a limit position or a dead point from which it can go two ways: sketch a pose beside it"
)
MOST = 4
"""Intervals named in one sentence."""
GAPS = 9
"""Poses of an interval at which redundant equations are looked at."""
ENDS = ("from", "to")
STOPS = {
    "unproved": "its steps became too small to go on proving the path",
    "pole": "a slide runs away there, its guides become parallel",
    "change_point": "a change point, two branches meet there",
    "ambiguous": "two branches come too near each other to be told apart",
    "cusp": "two branches end there with one tangent, the motion must turn back",
    "end_of_curve": "the contact of joint {joint} is at the end of its curve",
    "dead_point": "a dead point of the driver, the speed ratio is infinite there",
    "locked": "redundant equations hold there, but no further",
}


def failed_intervals(setting: Setting, run: Run, status: Integers) -> list[Json]:
    """Return the intervals of poses that have none: from, to, group and joint."""
    lost = among(status, LOST)

    there = assembled(setting.assembler, run.start, run.values, np.flatnonzero(lost))
    places, plan = run.places, setting.plan
    intervals = []
    for a, b in stretches(lost):
        group = _first_lost(setting, run.poses.alive[a])
        first, last = float(places[a]), float(places[b - 1])
        if not plan.named:
            before = float(places[a - 1]) if a else first
            after = float(places[b]) if b < len(places) else last
            first = _between(run.path, before, first)
            last = _between(run.path, last, after, default=last)
        values = run.path.drivers(np.array([first, last]))[:, plan.lead]
        entry: Json = {"from": float(values[0]), "to": float(values[1])}
        if plan.timing and run.path.graphs.course:
            entry["time"] = [first, last]
        found = [there[k] for k in range(a, b) if k in there]
        if any(found):
            entry["assembles"] = True
            group = _stopping(setting, run, a) or group
        elif None in found or not found:
            entry["assembles"] = None
        if group is not None:
            joint = _left_curve(run.path, group, (first + last) / 2) or group.key_joint
            entry |= {"group": list(group.bodies), "joint": joint, "name": group.name}
            entry |= _gap(setting, run, group, range(a, b)) or _cause(run, status, range(a, b))
        intervals.append(entry)
    return intervals


def _stopping(setting: Setting, run: Run, row: int) -> Group | None:
    """Return the group whose end keeps the driver from reaching a pose."""
    arc = arc_of(run.path)
    end = arc.high if run.poses.s[row] > arc.last else arc.low
    if end is None or arc.holds(run.poses.s[row]):
        return None
    return next(group for group in setting.scene.groups if group.index == end.group)


def _left_curve(path: AnyPath, group: Group, s: float) -> str:
    """Return the joint whose contact left its curve on the way to `s`, '' for none."""
    reach = path.reach[group.index]
    for end, beyond in ((reach.low, -1), (reach.high, 1)):
        if end is not None and end.regular and (s - end.s) * beyond > 0:
            return end.joint
    return ""


def _between(path: AnyPath, a: float, b: float, default: float | None = None) -> float:
    """Return the end of the driver's arc between two of its values, whole turns aside."""
    low, high = min(a, b), max(a, b)
    for end in arc_of(path).ends:
        if end is None:
            continue
        turns = np.ceil((low - end) / (2 * np.pi)) if path.graphs.turns and end < low else 0.0
        if path.graphs.turns and end > high:
            turns = np.floor((high - end) / (2 * np.pi))
        if low <= end + 2 * np.pi * turns <= high:
            return float(end + 2 * np.pi * turns)
    return b if default is None else default


def _gap(setting: Setting, run: Run, group: Group, poses: range) -> Json:
    """Return the joint of a redundant equation that stays open at lost poses, and its gap."""
    if not group.superfluous or run.poses.singular[poses].all():
        return {}
    found: list[Gap] = []
    for k in np.unique(np.linspace(poses[0], poses[-1], GAPS).astype(int)):
        x = np.nan_to_num(run.poses.x[k])
        failure = setting.assembler.candidates(group, x, run.values[k], search=False)[2]
        if failure is not None and failure.at is not None and np.isfinite(failure.gap):
            found.append(failure.at)
    if not found:
        return {}
    entry = {"joint": found[0].joint, "gap": found[0].size, "unit": found[0].unit}
    enough = [gap.tolerance(setting.assembler.size) or math.inf for gap in found]
    return entry | ({TOLERANCE: max(enough)} if max(enough) < math.inf else {})


def _cause(run: Run, status: Integers, poses: range) -> Json:
    """Return why poses that are singular have no values: the worst reason of some of them."""
    from mechdae.motion.kinematics.lost_poses import reason

    singular = [k for k in poses if status[k] == CODES[Status.SINGULAR]]
    if len(singular) < len(poses):
        return {}
    found = []
    for k in {singular[0], singular[len(singular) // 2], singular[-1]}:
        lost = ~run.poses.alive[k][run.evaluator.block_group]
        place = run.poses.places[[k]]
        at = run.path.guess(place)[0], run.path.drivers(place)[0]
        found.append(reason(run.path.graphs, run.path.constants, *at, np.flatnonzero(lost)))
    order = list(Cause)
    return min(found, key=lambda cut: (order.index(cut.cause), cut.least)).entry()


def _first_lost(setting: Setting, alive: Booleans) -> Group | None:
    for j, group in enumerate(setting.scene.groups):
        if not alive[j]:
            return group
    return None


def fault(
    setting: Setting,
    run: Run,
    status: Integers,
    failed: list[Json],
    rollers: list[Json],
) -> str | None:
    """Return what is wrong with the answer in one sentence, None when nothing is."""
    parts = []
    if failed:
        parts.append(_lost(setting, run, status, failed))
    for joint in dict.fromkeys(entry["joint"] for entry in rollers):
        cuts = [entry for entry in rollers if entry["joint"] == joint]
        parts.append(_cutting(setting, joint, cuts))
    return "; ".join(parts) or None


def _cutting(setting: Setting, joint: str, intervals: list[Json]) -> str:
    """Return where a roller cuts into its curve."""
    lead, timed = setting.plan.lead, "time" in intervals[0]
    c = setting.plan.coordinates[lead]
    places = []
    for entry in intervals[:MOST]:
        ends = [np.ravel(entry[end])[0 if np.ndim(entry[end]) == 0 else lead] for end in ENDS]
        first, last = (shown(c.unit, float(value)) for value in ends)
        if timed:
            first, last = (f"{time:.6g} s" for time in entry["time"])
        places.append(first if first == last else f"{first} to {last}")
    more = f" and {len(intervals) - MOST} more" if len(intervals) > MOST else ""
    depth = max(entry["depth"] for entry in intervals)
    return (
        f"the roller of joint {joint} cuts into its curve, by up to {depth:.2g} m, "
        f"at {'t' if timed else c.text} = {', '.join(places)}{more}"
    )


def _lost(setting: Setting, run: Run, status: Integers, failed: list[Json]) -> str:
    """Return which poses are lost and why."""
    entry = failed[0]
    c = setting.plan.coordinates[setting.plan.lead]
    lost = int(among(status, LOST).sum())
    events = [event for event in run.events if event.get("reached", True)]
    stops = [e for e in events if e["kind"] in STOPS and e.get("action", "stop") == "stop"]
    stopped = bool(stops)
    away = stopped or any(one.get("assembles", False) is not False for one in failed)
    words = "are not reached" if away else "do not assemble"
    words = "have no values" if "cause" in entry else words
    text = f"{lost} of {len(status)} poses {words}"
    if "name" in entry and entry.get("assembles") and "cause" not in entry:
        text += f": group {entry['name']} stops the driver before"
    elif "name" in entry and (not stopped or "gap" in entry or "cause" in entry):
        text += f": group {entry['name']} {why_lost(entry)}"
        text += f" by {entry['gap']:.4g} {entry['unit']}" if "gap" in entry else ""
    interval = [shown(c.unit, entry[end]) for end in ENDS]
    if "time" in entry:
        interval = [f"{time:.6g} s" for time in entry["time"]]
    text += f", first at {'t' if 'time' in entry else c.text} = {interval[0]}" + (
        f" to {interval[1]}" if interval[0] != interval[1] else ""
    )
    limits = [event for event in events if event["kind"] == "limit"]
    if limits:
        text += f"; limit position{'s' if len(limits) > 1 else ''} at "
        if setting.graphs.single:
            ends = [shown(c.unit, event["at"]) for event in limits]
            text += f"{c.text} = {', '.join(ends)}"
        else:
            text += "; ".join(_place(setting, event) for event in limits)
    reported = set()
    for event in stops:
        if "together_with" in event and (str(event["at"]) in reported):
            continue  # of groups that meet at one pose the first one names the others
        reported.add(str(event["at"]))
        why = STOPS[event["kind"]].format(joint=event["joint"])
        if begins_singular(setting, run.path, event):
            text += f"; the motion begins at {_place(setting, event)}, {SINGULAR_START}"
            continue
        text += f"; the motion stops at {_place(setting, event)}: {why}{_range(event)}"
        if event.get("action") == "stop" and setting.on_change_point == "switch":
            text += f", and {_not_switched(event)}"
    if enough := [one[TOLERANCE] for one in failed if TOLERANCE in one]:
        text += not_assembled.tolerance_hint(max(enough))
    if status[0] == CODES[Status.UNASSEMBLED]:
        text += _modes_at_start(setting, run)
    return text


def _not_switched(event: Json) -> str:
    """Return why a path that was to switch stops at a change point."""
    if event.get("excluded"):
        return "the other one does not meet the redundant equations"
    if any(other is None for _, other in event["tangents"].values()):
        return "on the other one the driver stands still"
    others = " and ".join(event["together_with"])
    return (
        f"so do two of group {others}: one hangs on the other, which of them is to switch is not "
        "told; sketch the mechanism behind it, on the branches that are meant"
    )


def _range(event: Json) -> str:
    """Return to which order branches touch and how well the place is known, '' for others."""
    if "range" not in event:
        return ""
    low, high = event["range"]
    touch = f" and touch to order {event['order']:.0f}" if event["kind"] == "change_point" else ""
    return f"{touch}, within {(high - low) / 2:.1g} of it"


def _place(setting: Setting, event: Json) -> str:
    """Return where an event is: the time of a law, and the drivers' values."""
    at = event["at"] if isinstance(event["at"], list) else [event["at"]]
    time = f"t = {event['time']:.6g} s, " if "time" in event else ""
    return time + not_assembled.where(setting.scene, at)


def _modes_at_start(setting: Setting, run: Run) -> str:
    """Return the modes at the first pose as sketches, for a start no motion reaches."""
    from mechdae.results.sketch_lines import sketch_line

    u = run.values[0]
    modes = setting.assembler.modes(u).first(8)
    if not modes:
        return "; no assembly mode exists at the first pose"
    text = "\n  it can be assembled there, but no motion from the sketch leads to it; its modes:"
    for mode in modes:
        sketch = not_assembled.as_sketch(setting.assembler, mode, u)
        lines = ", ".join(sketch_line(name, value) for name, value in sketch.items())
        text += f"\n  mode {mode.label}: [sketch] {lines}"
    return text


CHECKED = 24
"""Poses that are looked at, spread over those that are lost."""
TRIED = 256
"""Poses of groups that are tried at one of them."""


def assembles(assembler: Assembler, signs: list[str], u: Floats) -> bool | None:
    """Return whether the mechanism assembles at `u` in the mode with these `signs` of its groups.

    None where it is not known: groups without a closed form are not searched for, and two modes of
    a larger group may have one sign.
    """
    groups = assembler.scene.groups
    wanted = dict(zip(filter(assembler.labelled, groups), signs, strict=True))
    waiting: list[tuple[int, Floats]] = [(0, np.zeros(assembler.graphs.nx))]
    known = True
    for _ in range(TRIED):
        if not waiting:
            return False if known else None
        done, x = waiting.pop()
        if done == len(groups):
            return True if all(map(assembler.labels.signs_tell, wanted)) else None
        group = groups[done]
        try:
            poses, sure, _ = assembler.candidates(group, x, u, search=False, measured=False)
        except FreedomError:
            return None
        known &= sure
        if group in wanted:
            poses = [
                pose for pose in poses if assembler.labels.sign(group, pose, u) == wanted[group]
            ]
        waiting += [(done + 1, pose) for pose in poses]
    return None


def assembled(
    assembler: Assembler, start: tuple[Floats, Floats], values: Floats, rows: Integers
) -> dict[int, bool | None]:
    """Return whether the poses `rows` can be assembled in the mode of the pose `start`, (x, u).

    `values` (n, nd) are the drivers' values; of many rows a sample is tried.
    """
    labels, groups = assembler.labels, assembler.scene.groups
    signs = [labels.sign(group, *start) for group in groups if assembler.labelled(group)]
    chosen = rows[np.linspace(0, len(rows) - 1, min(len(rows), CHECKED)).astype(int)]
    return {int(k): assembles(assembler, signs, values[k]) for k in dict.fromkeys(chosen.tolist())}
