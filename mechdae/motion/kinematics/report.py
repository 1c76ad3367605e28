"""From evaluated poses to a result: status, events, what failed and where."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import TOLERANCE
from mechdae.describe.tasks.kinds import Sweep
from mechdae.equations.groups import Group, formula
from mechdae.motion.assembly import start
from mechdae.motion.assembly.closure import Gap
from mechdae.motion.continuation.any_path import AnyPath
from mechdae.motion.continuation.evaluate import Poses
from mechdae.motion.continuation.reachable_arc import arc_of
from mechdae.motion.continuation.step_sizes import PASS
from mechdae.motion.kinematics.prepared import Run, Setting
from mechdae.motion.measures.measure import sorted_events
from mechdae.motion.setup.drivers import DriverPlan
from mechdae.motion.setup.named_outputs import time_of
from mechdae.results import (
    CODES,
    FINE,
    LOST,
    Event,
    LazyPart,
    Named,
    Series,
    Status,
    SweepResult,
    among,
    counts,
    events_of,
)
from mechdae.results.status import Cause, why_lost
from mechdae.types import Booleans, Floats, Integers, Json

if TYPE_CHECKING:
    from mechdae.motion.continuation.crossings.across_change_point import Zone

SINGULAR_START = (
    "a limit position or a dead point from which it can go two ways: sketch a pose beside it"
)
MOST = 4
"""Intervals named in one sentence."""
GAPS = 9
"""Poses of an interval at which superfluous equations are looked at."""
ENDS = ("from", "to")
STOPS = {
    "unproved": "its steps became too small to go on proving the path",
    "pole": "a slide runs away there, its guides become parallel",
    "change_point": "a change point, two branches meet there",
    "ambiguous": "two branches come too near each other to be told apart",
    "cusp": "two branches end there with one tangent, the motion must turn back",
    "end_of_curve": "the contact of joint {joint} is at the end of its curve",
    "dead_point": "a dead point of the driver, the speed ratio is infinite there",
    "locked": "superfluous equations hold there, but no further",
}


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
    for reach in path.reach.values():
        for limit in (reach.low, reach.high):
            if limit is None or (limit.s, limit.group) in seen:
                continue
            if limit.s in crossed:
                continue
            seen.add((limit.s, limit.group))
            group = groups[limit.group]
            event = _event(setting, path, limit.s, group, low <= limit.s <= high)
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
    doubtful = _ambiguous(path, np.array([s for s, _ in found]), at_them=False).tolist()
    for (s, event), unsure in zip(found, doubtful, strict=True):
        if not arc.holds(s):
            event["reached"] = False
        if unsure:
            event["ambiguous"] = True
    return [event for _, event in sorted(found, key=lambda pair: pair[0])]


def _event(setting: Setting, path: AnyPath, s: float, group: Group, inside: bool) -> Json:
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
    where the other one does not meet the superfluous equations (``excluded``).
    """
    events = []
    for crossing in zone.crossings:
        group = next(g for g in setting.scene.groups if g.index == crossing.group)
        own = path.graphs.blocks[crossing.block].own
        other = crossing.other.slope if crossing.other is not None else [None] * len(own)
        names = [".".join(setting.scene.x_names[i]) for i in own]
        tangents = {
            name: [float(a), None if b is None else float(b)]
            for name, a, b in zip(names, crossing.own.slope, other, strict=True)
        }
        event = _event(setting, path, crossing.s, group, low <= crossing.s <= high)
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


def report(problem: Problem, name: str, task: Sweep, setting: Setting, run: Run) -> SweepResult:
    plan, poses, outputs = setting.plan, run.poses, setting.outputs
    status = _status(run.path, poses)
    found = run.found
    named: dict[str, Any] = outputs.named(poses.y, found.series)
    named["centres"] = Series(found.centres)
    certified = np.broadcast_to(True, len(status)) if poses.fine else among(status, FINE)
    columns = outputs.columns(setting.expressions.coordinates)
    time = time_of(plan, run.values)
    there = [array[:, columns] for array in poses.y]
    named["outputs"], lost = setting.expressions.evaluate(there, time, certified)
    if not poses.fine:
        for numbers in (*poses.bounds.values(), poses.condition):
            numbers[~certified] = np.nan
    failed = _failed(setting, run, status)
    summary = run.summary.copy()
    summary["poses"] = len(status)
    summary["status"] = counts(status)
    summary["formula"] = formula(setting.scene.groups)
    summary["groups"] = [
        {"name": group.name, "bodies": list(group.bodies)} for group in setting.scene.groups
    ]
    summary["mode"] = _mode(setting, run)
    summary["not_in_scene"] = setting.scene.not_in_scene
    near = bool(run.path.zones) and run.evaluator.zones.estimated(run.path, poses.s, poses.places)
    summary["bound"] = "estimated" if near or run.path.constants.estimated else "proved"
    if setting.scene.redundant:
        summary["superfluous"] = setting.assembler.superfluous(*_start(run))
        poses_x, p = poses.x[certified], run.path.constants.p
        summary["closure"] = run.evaluator.closing.largest(poses_x, run.values[certified], p)
    summary |= found.summary
    if failed:
        summary["failed"] = failed
    notes = setting.notes + _near_crossings(setting, run.path)
    notes += setting.expressions.notes + lost + found.notes
    if notes:
        summary["notes"] = notes
    opened = bool(setting.scene.redundant) and problem.mechanism.tolerance > 0
    if opened or (task.derivatives and task.untimed):
        from mechdae.describe.assumed import about_closure, about_speeds

        assumed = about_speeds(problem.mechanism, task) if task.derivatives else []
        summary["assumptions"] = assumed + (about_closure(problem.mechanism) if opened else [])
    events, rollers = _undercut(setting, run)
    fault: str | LazyPart | None
    if len(status) and status[0] == CODES[Status.UNASSEMBLED]:  # its modes are looked for
        fault = LazyPart(lambda: {"fault": _fault(setting, run, status, failed, rollers)})
    else:
        fault = _fault(setting, run, status, failed, rollers)
    if rollers:
        summary["undercut"] = rollers
    summary["work"] = _work(setting, run)
    return SweepResult(
        problem.name,
        name,
        task.kind,
        problem.mechanism,
        problem.title,
        drivers=_drivers(plan, run.values, task),
        status=status,
        bound=Series(poses.bounds),
        condition=poses.condition,
        events=_in_order(setting, run, [*run.events, *events, *found.events]),
        summary=summary,
        fault=fault,
        definition=task,
        time=plan.timing.times if plan.timing else None,
        **named,
    )


def _work(setting: Setting, run: Run) -> LazyPart:
    """Return what the poses cost, with what is still to be computed when it is read."""
    counts, evaluator, spans = run.path.counts, run.evaluator, run.spans
    work = {
        "unknowns": setting.graphs.nx,
        "blocks": [graph.size for graph in setting.graphs.blocks],
        "path_steps": counts.steps,
        "rejected_steps": counts.rejected,
        "pose_evaluations": evaluator.pose.evaluations,
        "refined_poses": evaluator.refined,
    }

    def whole() -> dict[str, Json]:
        if spans is None:
            return {"work": work}
        spans.later.parts()
        evaluations = work["pose_evaluations"] + spans.evaluations
        refined = work["refined_poses"] + spans.refined
        return {"work": work | {"pose_evaluations": evaluations, "refined_poses": refined}}

    return LazyPart(whole)


def _undercut(setting: Setting, run: Run) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return events and intervals of the poses in which a roller cuts into its curve."""
    if not setting.graphs.contacts:
        return [], []
    from mechdae.motion.kinematics.undercut import cuts, refined

    groups = {name: group for group in setting.scene.groups for name in group.joints}
    events, intervals = [], []
    x, values, s = run.poses.x, run.values, run.places
    between_poses = not setting.plan.named
    if between_poses:
        nodes, X, U = run.path.on_curves()
        between = (nodes > s.min()) & (nodes < s.max())
        s = np.concatenate([s, nodes[between]])
        order = np.argsort(s, kind="stable")
        x, values = np.vstack([x, X[between]])[order], np.vstack([values, U[between]])[order]
        s = s[order]

    def at(places: Any) -> tuple[Any, Any]:
        return run.evaluator.at(run.path, places).x, run.path.drivers(places)

    for cut in cuts(setting.scene, x, values):
        begins, stops = float(s[cut.first]), float(s[cut.last])
        ends = [values[k] for k in (cut.first, cut.last)]
        if between_poses:
            begins, stops = refined(setting.scene, cut, s, at).ends or (begins, stops)
            ends = list(run.path.drivers(np.array([begins, stops])))
        first, last = (u.tolist() if len(u) > 1 else float(u[0]) for u in ends)
        event = _event(setting, run.path, begins, groups[cut.joint], True)
        events.append(event | {"kind": "undercut", "at": first, "joint": cut.joint})
        interval = {"from": first, "to": last, "joint": cut.joint, "depth": cut.depth}
        if "time" in event:
            interval["time"] = [begins, stops]
        intervals.append(interval)
    return events, intervals


def _in_order(setting: Setting, run: Run, events: list[Json]) -> tuple[Event, ...]:
    """Return events in the order of the motion; along lines they are in that order."""
    graphs = run.path.graphs
    if not (graphs.single or graphs.course):
        return events_of(events)
    return events_of(sorted_events(events, setting.plan.lead))


def _modes_at_start(setting: Setting, run: Run) -> str:
    """Return the modes at the first pose as sketches, for a start no motion reaches."""
    from mechdae.results.sketch_lines import sketch_line

    u = run.values[0]
    modes = setting.assembler.modes(u).first(8)
    if not modes:
        return "; no assembly mode exists at the first pose"
    text = "\n  it can be assembled there, but no motion from the sketch leads to it; its modes:"
    for mode in modes:
        sketch = start.as_sketch(setting.assembler, mode, u)
        lines = ", ".join(sketch_line(name, value) for name, value in sketch.items())
        text += f"\n  mode {mode.label}: [sketch] {lines}"
    return text


def _status(path: AnyPath, poses: Poses) -> Any:
    """Return the statuses of the poses, one byte each."""
    status = np.zeros(len(poses.s), np.uint8)
    if poses.fine:
        return status
    dead = ~poses.alive.all(axis=1)
    status[dead] = CODES[Status.UNASSEMBLED]
    status[poses.uncertain | poses.singular] = CODES[Status.SINGULAR]
    status[poses.at_limit & ~dead] = CODES[Status.LIMIT]
    if path.zones:
        doubtful = _ambiguous(path, poses.s) | _ambiguous(path, poses.places)
        status[doubtful & (status == CODES[Status.OK])] = CODES[Status.AMBIGUOUS]
    return status


def _near_crossings(setting: Setting, path: AnyPath) -> list[str]:
    notes = []
    ends = [end for reach in path.reach.values() for end in (reach.low, reach.high) if end]
    for s, gap in sorted({(end.s, end.gap) for end in ends if end.kind == "limit" and end.gap}):
        at = start.where(setting.scene, path.drivers(np.array([s]))[0])
        notes.append(
            f"just beyond {at} two branches come within {gap:.1g} of each other; for the numbers "
            f"given they turn back"
        )
    for zone in path.zones[:8]:
        for crossing in zone.crossings:
            if crossing.exact:
                continue
            at = start.where(setting.scene, path.drivers(np.array([zone.s]))[0])
            near = f"at {at} two branches come within {crossing.gap:.1g} of each other"
            if zone.decided:
                notes.append(f"{near} and do not meet for the numbers given")
                continue
            notes.append(
                f"{near}, as near as rounding of the numbers given: poses beyond are ambiguous"
            )
    return notes


def _ambiguous(path: AnyPath, s: Floats, at_them: bool = True) -> Booleans:
    """Return which places lie behind branches that come too near each other to be distinguished."""
    result = np.zeros(len(s), bool)
    for zone in path.zones:
        if not zone.decided:
            sense = 1.0 if zone.s > path.origin[0] else -1.0
            result |= (sense * (s - zone.s) >= 0) & (at_them | (s != zone.s))
    return result


def _drivers(plan: DriverPlan, values: Floats, task: Sweep) -> Named:
    n = len(values)
    table = {}
    for k, c in enumerate(plan.coordinates):
        series = {"position": values[:, k]}
        if task.derivatives >= 1:
            series["velocity"] = np.broadcast_to(plan.speed[:, k], n)
        if task.derivatives >= 2:
            series["acceleration"] = np.broadcast_to(plan.acceleration[:, k], n)
        if task.derivatives >= 3:
            series["jerk"] = np.broadcast_to(plan.jerk[:, k], n)
        table[c.text] = Series(series)
    return Named("driver", table)


def _mode(setting: Setting, run: Run) -> LazyPart:
    """Return the label of the assembly mode the path starts on, which may need a search."""
    labels, begin = setting.assembler.labels, _start(run)
    return LazyPart(lambda: {"mode": labels.of_pose(*begin)})


def _start(run: Run) -> tuple[Floats, Floats]:
    """Return unknowns and driver values of the pose the path starts from."""
    s, x = run.path.origin
    return x, run.path.drivers(np.array([s]))[0]


def _failed(setting: Setting, run: Run, status: Integers) -> list[Json]:
    """Return the intervals of poses that have none: from, to, group and joint."""
    lost = among(status, LOST) if status.any() else np.zeros(0, bool)
    if not lost.any():
        return []
    from mechdae.motion.assembly.beyond_reach import assembled

    there = assembled(setting.assembler, _start(run), run.values, np.flatnonzero(lost))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], lost.astype(int), [0]])))
    places, plan = run.places, setting.plan
    intervals = []
    for a, b in zip(edges[::2], edges[1::2], strict=True):
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
    """Return the joint of a superfluous equation that stays open at lost poses, and its gap."""
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
    return min(found, key=lambda own: (order.index(own.cause), own.least)).entry()


def _first_lost(setting: Setting, alive: Booleans) -> Group | None:
    for j, group in enumerate(setting.scene.groups):
        if not alive[j]:
            return group
    return None


def _fault(
    setting: Setting,
    run: Run,
    status: Integers,
    failed: list[Json],
    rollers: list[dict[str, Any]],
) -> str | None:
    """Return what is wrong with the answer in one sentence, None when nothing is."""
    parts = []
    if failed:
        parts.append(_lost(setting, run, status, failed))
    for joint in dict.fromkeys(entry["joint"] for entry in rollers):
        own = [entry for entry in rollers if entry["joint"] == joint]
        parts.append(_cutting(setting, joint, own))
    return "; ".join(parts) or None


def _cutting(setting: Setting, joint: str, intervals: list[dict[str, Any]]) -> str:
    """Return where a roller cuts into its curve."""
    lead, timed = setting.plan.lead, "time" in intervals[0]
    c = setting.plan.coordinates[lead]
    places = []
    for entry in intervals[:MOST]:
        ends = [np.ravel(entry[end])[0 if np.ndim(entry[end]) == 0 else lead] for end in ENDS]
        first, last = (start.shown(c.unit, float(value)) for value in ends)
        if timed:
            first, last = (f"{time:.6g} s" for time in entry["time"])
        places.append(first if first == last else f"{first} to {last}")
    more = f" and {len(intervals) - MOST} more" if len(intervals) > MOST else ""
    depth = max(entry["depth"] for entry in intervals)
    return (
        f"the roller of joint {joint} cuts into its curve, by up to {depth:.2g} m, "
        f"at {'t' if timed else c.text} = {', '.join(places)}{more}"
    )


def begins_singular(setting: Setting, path: AnyPath, event: Json) -> bool:
    """Return whether the path comes no further than its first pose, which is singular."""
    alone = setting.graphs.single and event["kind"] == "dead_point"
    return alone and bool(event["at"] == path.origin[0])


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
    interval = [start.shown(c.unit, entry[end]) for end in ENDS]
    if "time" in entry:
        interval = [f"{time:.6g} s" for time in entry["time"]]
    text += f", first at {'t' if 'time' in entry else c.text} = {interval[0]}" + (
        f" to {interval[1]}" if interval[0] != interval[1] else ""
    )
    limits = [event for event in events if event["kind"] == "limit"]
    if limits:
        text += f"; limit position{'s' if len(limits) > 1 else ''} at "
        if setting.graphs.single:
            ends = [start.shown(c.unit, event["at"]) for event in limits]
            text += f"{c.text} = {', '.join(ends)}"
        else:
            text += "; ".join(_place(setting, event) for event in limits)
    told = set()
    for event in stops:
        if "together_with" in event and (str(event["at"]) in told):
            continue  # of groups that meet at one pose the first one names the others
        told.add(str(event["at"]))
        why = STOPS[event["kind"]].format(joint=event["joint"])
        if begins_singular(setting, run.path, event):
            text += f"; the motion begins at {_place(setting, event)}, {SINGULAR_START}"
            continue
        text += f"; the motion stops at {_place(setting, event)}: {why}{_range(event)}"
        if event.get("action") == "stop" and setting.on_change_point == "switch":
            text += f", and {_not_switched(event)}"
    if enough := [one[TOLERANCE] for one in failed if TOLERANCE in one]:
        text += start.tolerance_hint(max(enough))
    if status[0] == CODES[Status.UNASSEMBLED]:
        text += _modes_at_start(setting, run)
    return text


def _not_switched(event: Json) -> str:
    """Return why a path that was to switch stops at a change point."""
    if event.get("excluded"):
        return "the other one does not meet the superfluous equations"
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
    return time + start.where(setting.scene, at)
