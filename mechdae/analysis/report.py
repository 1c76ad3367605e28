"""From evaluated poses to a result: status, events, what failed and where."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.analysis import start
from mechdae.analysis.bounds import output_bounds
from mechdae.analysis.bridge import Zone
from mechdae.analysis.evaluate import Poses
from mechdae.analysis.measures.measure import sorted_events
from mechdae.analysis.named import time_of
from mechdae.analysis.path import Path
from mechdae.analysis.plan import Plan
from mechdae.analysis.setting import Run, Setting
from mechdae.analysis.undercut import cuts
from mechdae.analysis.zones import zone_of
from mechdae.describe.problem import Problem
from mechdae.describe.tasks import Sweep
from mechdae.model.structure import Group, formula
from mechdae.results import Named, Result, Series

WORDS = ("ok", "limit", "singular", "ambiguous", "unassembled")
MOST = 4
"""Intervals named in one sentence."""
STOPS = {
    "unproved": "its steps became too small to go on proving the path",
    "pole": "a slide runs away there, its guides become parallel",
    "change_point": "a change point, two branches meet there",
    "ambiguous": "two branches come too near each other to be told apart",
    "cusp": "two branches end there with one tangent, the motion must turn back",
    "end_of_curve": "the contact of joint {joint} is at the end of its curve",
    "dead_point": "a dead point of the driver, the speed ratio is infinite there",
}


def ends(path: Path) -> list[float | None]:
    """Return the limits nearest to the start over all groups."""
    lows = [reach.low.s for reach in path.reach.values() if reach.low is not None]
    highs = [reach.high.s for reach in path.reach.values() if reach.high is not None]
    return [max(lows) if lows else None, min(highs) if highs else None]


def limit_events(setting: Setting, path: Path, low: float, high: float) -> list[dict[str, Any]]:
    """Return the ends of the path's groups as events, in the order of s.

    ``at`` is the driver's value, with several drivers the list of their values.
    """
    found: list[tuple[float, dict[str, Any]]] = []
    seen = set()
    crossed = {zone.s for zone in path.zones}
    groups = {group.index: group for group in setting.scene.groups}
    for reach in path.reach.values():
        for limit in (reach.low, reach.high):
            if limit is None or (limit.s, limit.group) in seen:
                continue
            if limit.s in crossed:
                continue
            seen.add((limit.s, limit.group))
            group = groups[limit.group]
            near = {"gap": limit.gap} if limit.kind == "ambiguous" else {}
            found.append(
                (
                    limit.s,
                    {
                        "kind": limit.kind,
                        "at": limit.s
                        if setting.graphs.single
                        else list(path.u0 + limit.s * path.d),
                        "group": list(group.bodies),
                        "joint": limit.joint or group.key_joint,
                        "name": group.name,
                        "in_range": bool(low <= limit.s <= high),
                        **near,
                    },
                )
            )
    found += [pair for zone in path.zones for pair in _crossed(setting, path, zone, low, high)]
    return [event for _, event in sorted(found, key=lambda pair: pair[0])]


def _crossed(
    setting: Setting, path: Path, zone: Zone, low: float, high: float
) -> list[tuple[float, dict[str, Any]]]:
    """Return the change points of a zone as events, with the tangents of both branches.

    ``tangents`` has the rates of the unknowns of the group over the path parameter on the
    branch the path came on and on the other one; None where the driver stands still there.
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
        at = crossing.s if setting.graphs.single else list(path.u0 + crossing.s * path.d)
        event = {
            "kind": "change_point",
            "at": at,
            "group": list(group.bodies),
            "joint": group.key_joint,
            "name": group.name,
            "in_range": bool(low <= crossing.s <= high),
            "action": zone.action,
            "tangents": tangents,
            "exact": crossing.exact,
            "gap": crossing.gap,
        }
        events.append((crossing.s, event))
    return events


def report(problem: Problem, name: str, task: Sweep, setting: Setting, run: Run) -> Result:
    plan, poses, outputs = setting.plan, run.poses, setting.outputs
    status = _status(poses)
    doubtful = _ambiguous(run.path, poses.s) & (status == "ok")
    status[doubtful] = "ambiguous"
    found = run.found
    named: dict[str, Any] = outputs.named(poses.y, found.series)
    named["centres"] = Series(found.centres)
    certified = np.isin(status, ("ok", "limit"))
    columns = outputs.columns(setting.expressions.coordinates)
    time = time_of(problem.mechanism, task, plan, run.values)
    there = [array[:, columns] for array in poses.y]
    named["outputs"], lost = setting.expressions.evaluate(there, time, certified)
    bounds = output_bounds(setting.graphs, outputs, run.path.constants, poses)
    for bound in bounds.values():
        bound[~certified] = np.nan
    failed = _failed(setting, run, status)
    summary = dict(run.summary)
    summary["poses"] = len(status)
    summary["status"] = {
        word: count for word in WORDS if (count := int(np.count_nonzero(status == word)))
    }
    summary["formula"] = formula(setting.scene.groups)
    summary["mode"] = _mode(setting, run)
    summary["not_in_scene"] = setting.scene.not_in_scene
    near = (zone_of(run.path.zones, poses.s) >= 0).any()
    summary["bound"] = "estimated" if near or run.path.constants.estimated else "proved"
    summary |= found.summary
    if failed:
        summary["failed"] = failed
    notes = setting.notes + _near_crossings(setting, run.path)
    notes += setting.expressions.notes + lost + found.notes
    if notes:
        summary["notes"] = notes
    events, rollers = _undercut(setting, run)
    if rollers:
        summary["undercut"] = rollers
    counts = run.path.counts
    summary["work"] = {
        "unknowns": setting.graphs.nx,
        "blocks": [graph.size for graph in setting.graphs.blocks],
        "path_steps": counts.steps,
        "rejected_steps": counts.rejected,
        "pose_evaluations": run.evaluator.pose.evaluations,
        "refined_poses": run.evaluator.refined,
    }
    return Result(
        problem.name,
        name,
        task.kind,
        problem.mechanism,
        problem.title,
        drivers=_drivers(plan, run.values, task),
        status=status,
        bound=Series(bounds),
        condition=_condition(poses, certified),
        events=tuple(sorted_events([*run.events, *events, *found.events])),
        summary=summary,
        fault=_fault(setting, run, status, failed, rollers),
        definition=task,
        **named,
    )


def _undercut(setting: Setting, run: Run) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return events and intervals of the poses in which a roller cuts into its curve."""
    if not setting.graphs.contacts:
        return [], []
    groups = {name: group for group in setting.scene.groups for name in group.joints}
    events, intervals = [], []
    x, values = run.poses.x, run.values
    if setting.graphs.single and not setting.plan.named:  # between the poses as well
        nodes, places = run.path.on_curves()
        between = (places[:, 0] > values.min()) & (places[:, 0] < values.max())
        x, values = np.vstack([x, nodes[between]]), np.vstack([values, places[between]])
        order = np.argsort(values[:, 0], kind="stable")
        x, values = x[order], values[order]
    for cut in cuts(setting.scene, x, values):
        ends = [values[k] for k in (cut.first, cut.last)]
        first, last = (u.tolist() if len(u) > 1 else float(u[0]) for u in ends)
        group = groups[cut.joint]
        named = {"group": list(group.bodies), "joint": cut.joint, "name": group.name}
        events.append({"kind": "undercut", "at": first, **named, "in_range": True})
        intervals.append({"from": first, "to": last, "joint": cut.joint, "depth": cut.depth})
    return events, intervals


def _modes_at_start(setting: Setting, run: Run) -> str:
    """Return the modes at the first pose as sketches, for a start no motion reaches."""
    u = run.values[0]
    modes, _, _ = setting.assembler.modes(u, limit=8)
    if not modes:
        return "; no assembly mode exists at the first pose"
    text = "\n  it can be assembled there, but no motion from the sketch leads to it; its modes:"
    for mode in modes:
        sketch = start.as_sketch(setting.assembler, mode, u)
        lines = ", ".join(f"{name} = {value:g}" for name, value in sketch.items())
        text += f"\n  mode {mode.label}: [sketch] {lines}"
    return text


def _condition(poses: Poses, certified: Any) -> Any:
    condition = poses.condition.copy()
    condition[~certified] = np.nan
    return condition


def _status(poses: Poses) -> Any:
    status = np.full(len(poses.s), "ok", dtype="<U11")
    dead = ~poses.alive.all(axis=1)
    status[dead] = "unassembled"
    status[poses.uncertain | poses.singular] = "singular"
    status[poses.at_limit & ~dead] = "limit"
    return status


def _near_crossings(setting: Setting, path: Path) -> list[str]:
    notes = []
    for zone in path.zones[:8]:
        for crossing in zone.crossings:
            if crossing.exact:
                continue
            at = [zone.s] if setting.graphs.single else path.u0 + zone.s * path.d
            notes.append(
                f"at {start.where(setting.scene, at)} two branches come within "
                f"{crossing.gap:.1g} of each other, as near as rounding of the numbers given: "
                f"poses beyond are ambiguous"
            )
    return notes


def _ambiguous(path: Path, s: Any) -> Any:
    """Return which poses lie behind branches that come too near each other to be told apart."""
    result = np.zeros(len(s), bool)
    for zone in path.zones:
        if not all(crossing.exact for crossing in zone.crossings):
            result |= (s >= zone.s) if zone.s > path.origin[0] else (s <= zone.s)
    return result


def _drivers(plan: Plan, values: Any, task: Sweep) -> Named:
    n = len(values)
    table = {}
    for k, c in enumerate(plan.coordinates):
        series = {"position": values[:, k]}
        if task.derivatives >= 1:
            series["velocity"] = np.broadcast_to(plan.speed[:, k], n).copy()
        if task.derivatives >= 2:
            series["acceleration"] = np.broadcast_to(plan.acceleration[:, k], n).copy()
        if task.derivatives >= 3:
            series["jerk"] = np.broadcast_to(plan.jerk[:, k], n).copy()
        table[c.text] = Series(series)
    return Named("driver", table)


def _mode(setting: Setting, run: Run) -> str:
    """Return the label of the assembly mode the path starts on."""
    s, x = run.path.origin
    u = np.array([s]) if setting.graphs.single else run.path.u0 + s * run.path.d
    return setting.assembler.label(x, u)


def _failed(setting: Setting, run: Run, status: Any) -> list[dict[str, Any]]:
    """Return the intervals of poses that have none: from, to, group and joint."""
    lost = np.isin(status, ("unassembled", "singular"))
    if not lost.any():
        return []
    edges = np.flatnonzero(np.diff(np.concatenate([[0], lost.astype(int), [0]])))
    values = run.values[:, 0]
    intervals = []
    for a, b in zip(edges[::2], edges[1::2], strict=True):
        group = _first_lost(setting, run.poses.alive[a])
        first, last = float(values[a]), float(values[b - 1])
        if setting.graphs.single and not setting.plan.named:
            before = float(values[a - 1]) if a else first
            after = float(values[b]) if b < len(values) else last
            first = _between(run.path, before, first)
            last = _between(run.path, last, after, default=last)
        entry: dict[str, Any] = {"from": first, "to": last}
        if group is not None:
            joint = _left_curve(run.path, group, (first + last) / 2) or group.key_joint
            entry |= {"group": list(group.bodies), "joint": joint, "name": group.name}
        intervals.append(entry)
    return intervals


def _left_curve(path: Path, group: Group, s: float) -> str:
    """Return the joint whose contact left its curve on the way to `s`, '' for none."""
    reach = path.reach[group.index]
    for end, beyond in ((reach.low, -1), (reach.high, 1)):
        if end is not None and end.regular and (s - end.s) * beyond > 0:
            return end.joint
    return ""


def _between(path: Path, a: float, b: float, default: float | None = None) -> float:
    """Return the limit position between two driver values, whole turns aside."""
    low, high = min(a, b), max(a, b)
    for reach in path.reach.values():
        for limit in (reach.low, reach.high):
            if limit is None:
                continue
            for s in (limit.s, limit.s + 2 * np.pi, limit.s - 2 * np.pi):
                if low <= s <= high:
                    return float(s)
    return b if default is None else default


def _first_lost(setting: Setting, alive: Any) -> Group | None:
    for j, group in enumerate(setting.scene.groups):
        if not alive[j]:
            return group
    return None


def _fault(
    setting: Setting,
    run: Run,
    status: Any,
    failed: list[dict[str, Any]],
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
    c, several = setting.plan.coordinates[0], not setting.graphs.single
    places = []
    for entry in intervals[:MOST]:
        ends = [entry[end][0] if several else entry[end] for end in ("from", "to")]
        first, last = (start.shown(c.unit, value) for value in ends)
        places.append(first if first == last else f"{first} to {last}")
    more = f" and {len(intervals) - MOST} more" if len(intervals) > MOST else ""
    depth = max(entry["depth"] for entry in intervals)
    return (
        f"the roller of joint {joint} cuts into its curve, by up to {depth:.2g} m, "
        f"at {c.text} = {', '.join(places)}{more}"
    )


def _lost(setting: Setting, run: Run, status: Any, failed: list[dict[str, Any]]) -> str:
    """Return which poses are lost and why."""
    entry = failed[0]
    c = setting.plan.coordinates[0]
    lost = int(np.isin(status, ("unassembled", "singular")).sum())
    stops = [e for e in run.events if e["kind"] in STOPS and e.get("action", "stop") == "stop"]
    stopped = bool(stops)
    text = f"{lost} of {len(status)} poses {'are not reached' if stopped else 'do not assemble'}"
    if "name" in entry and not stopped:
        text += f": group {entry['name']} opens at joint {entry['joint']}"
    interval = [start.shown(c.unit, entry[end]) for end in ("from", "to")]
    text += f", first at {c.text} = {interval[0]}" + (
        f" to {interval[1]}" if interval[0] != interval[1] else ""
    )
    ends = [
        start.shown(c.unit, event["at"])
        for event in run.events
        if event["kind"] == "limit" and setting.graphs.single
    ]
    if ends:
        text += f"; limit position{'s' if len(ends) > 1 else ''} at {c.text} = {', '.join(ends)}"
    for event in stops:
        at = [event["at"]] if setting.graphs.single else event["at"]
        place = start.where(setting.scene, at)
        why = STOPS[event["kind"]].format(joint=event["joint"])
        text += f"; the motion stops at {place}: {why}"
        if event.get("action") == "stop" and setting.on_change_point == "switch":
            text += ", and on the other one the driver stands still"
    if status[0] == "unassembled":
        text += _modes_at_start(setting, run)
    return text
