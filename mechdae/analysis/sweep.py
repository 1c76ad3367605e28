"""Positions, velocities and accelerations along the drivers, every pose certified."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mechdae.analysis import start
from mechdae.analysis.bounds import output_bounds
from mechdae.analysis.evaluate import Evaluator, Poses
from mechdae.analysis.extremes import ranges
from mechdae.analysis.modes import Assembler
from mechdae.analysis.numbers import Constants, mechanism_scale
from mechdae.analysis.outputs import Outputs
from mechdae.analysis.path import NODES_PER_TURN, Path
from mechdae.analysis.plan import Plan, plan, sketch_angles
from mechdae.describe.problem import Problem
from mechdae.describe.tasks import Sweep
from mechdae.kernels.graphs import Graphs
from mechdae.model.model import Model
from mechdae.model.reduction import Scene, scene
from mechdae.model.structure import Group, formula
from mechdae.results import Named, Result, Series

MAX_TURNS = 1000
STOPS = {
    "change_point": "a change point, two branches meet there",
    "dead_point": "a dead point of the driver, the speed ratio is infinite there",
}


@dataclass
class Setting:
    """A scene with everything that is needed to evaluate it."""

    plan: Plan
    scene: Scene
    outputs: Outputs
    graphs: Graphs
    assembler: Assembler


def prepare(problem: Problem, task: Sweep) -> Setting:
    """Return scene and kernels of a task; nothing is evaluated yet."""
    mechanism = problem.mechanism
    numbers = plan(mechanism, task)
    model = Model(mechanism)
    the_scene = scene(model, numbers.coordinates, task.outputs)
    outputs = Outputs(the_scene)
    graphs = Graphs(the_scene, outputs.expression, min(task.derivatives, 2))
    assembler = Assembler(graphs, sketch_angles(mechanism))
    return Setting(numbers, the_scene, outputs, graphs, assembler)


def sweep(problem: Problem, name: str, task: Sweep) -> Result:
    """Return the result of a sweep.

    The mechanism is assembled at the sketch (or on the mode asked for at the first pose),
    moved to the first pose and on along the drivers. Poses that no certified motion
    reaches are ``unassembled``.

    Raises
    ------
    AssemblyError
        The sketch does not assemble at its own driver value.
    """
    setting = prepare(problem, task)
    return _result(problem, name, task, setting, run(setting, task))


def run(setting: Setting, task: Sweep) -> Run:
    """Evaluate a prepared sweep."""
    return _one_driver(setting, task) if setting.graphs.single else _several_drivers(setting, task)


@dataclass
class Run:
    """Evaluated poses with the driver values they belong to."""

    path: Path
    evaluator: Evaluator
    poses: Poses
    values: Any
    events: list[dict[str, Any]]
    summary: dict[str, Any]


def _start(setting: Setting, task: Sweep) -> tuple[Any, Any]:
    """Return driver values and unknowns of the pose the path starts from."""
    if task.mode is None:
        return start.sketched_pose(setting.assembler, setting.plan)
    first = setting.plan.values[0] if setting.plan.values is not None else None
    u = first if first is not None else start.start_values(setting.plan)
    return u, start.mode_by_label(setting.assembler, u, task.mode).x


def _constants(setting: Setting, span: Any) -> Constants:
    return Constants(setting.graphs, np.max(np.abs(span), axis=0))


def _one_driver(setting: Setting, task: Sweep) -> Run:
    plan, graphs = setting.plan, setting.graphs
    u, x = _start(setting, task)
    is_angle = plan.coordinates[0].is_angle
    scale = mechanism_scale(setting.scene.model.mechanism)
    largest = 2 * np.pi / NODES_PER_TURN * (1.0 if is_angle else scale)
    span = np.array([[u[0]]]) if plan.values is None else np.vstack([plan.values, [u]])
    path = Path(graphs, _constants(setting, span + 4 * np.pi), np.zeros(1), np.ones(1), largest)
    path.begin(x, float(u[0]))
    evaluator = Evaluator(graphs, setting.outputs, plan.speed, plan.acceleration)
    summary: dict[str, Any] = {}
    if plan.values is None:
        values, limits = _assembled(path, float(u[0]), is_angle, scale, plan.poses)
        summary["limits"] = limits
    else:
        values = plan.values[:, 0]
        _cover(path, values, is_angle)
    poses = evaluator.at(path, values)
    low, high = float(np.min(values)), float(np.max(values))
    if not plan.named and task.derivatives >= 2:
        found = ranges(evaluator, setting.outputs, path, poses, low, high)
        summary.update({word: table for word, table in found.items() if table})
    events = _limit_events(setting, path, low, high)
    if "limits" not in summary and events:
        summary["limits"] = _ends(path)
    return Run(path, evaluator, poses, values[:, None], events, summary)


def _cover(path: Path, values: Any, is_angle: bool) -> None:
    """Follow the path over all values, and the other way round where a group is lost."""
    if not path.graphs.nx:
        return
    path.extend(float(np.max(values)))
    path.extend(float(np.min(values)))
    if not is_angle:
        return
    for group, reach in path.reach.items():
        if (reach.low is None) != (reach.high is None) and not reach.contains(values).all():
            anchor = (reach.low or reach.high).s  # type: ignore[union-attr]
            turn = 2 * np.pi if reach.low is not None else -2 * np.pi
            path.extend(anchor + turn, needed=[group])


def _assembled(
    path: Path, s: float, is_angle: bool, scale: float, count: int
) -> tuple[Any, list[float | None]]:
    """Return driver values over the whole assembled arc and its ends (None: turns fully)."""
    turns = 0
    span = 2 * np.pi if is_angle else 4 * scale
    while True:
        turns += 1
        path.extend(s + turns * span, first=True)
        path.extend(s - turns * span, first=True)
        low, high = _ends(path)
        if low is not None and high is not None:
            grid = low + (high - low) * (np.arange(count) / max(count - 1, 1))
            grid[0], grid[-1] = low, high
            return grid, [low, high]
        if is_angle and low is None and high is None and _closed(path, s, turns):
            return 2 * np.pi * turns * np.arange(count) / max(count - 1, 1), [None, None]
        if turns >= (MAX_TURNS if is_angle else 25):
            first = low if low is not None else s - span
            last = high if high is not None else s + span
            return np.linspace(first, last, count), [low, high]


def _closed(path: Path, s: float, turns: int) -> bool:
    """Return whether the mechanism is back at its first pose after so many turns."""
    if not path.graphs.nx:
        return True
    S, X, _, _ = path.arrays()
    ahead = X[np.argmin(np.abs(S - (s + 2 * np.pi * turns)))]
    here = X[np.argmin(np.abs(S - s))]
    angle = np.array([name == "angle" for _, name in path.graphs.scene.x_names])
    moved = ahead - here
    moved = np.where(angle, moved - 2 * np.pi * np.round(moved / (2 * np.pi)), moved)
    return bool(np.abs(moved).max() < 1e-9)


def _ends(path: Path) -> list[float | None]:
    """Return the limits nearest to the start over all groups."""
    lows = [reach.low.s for reach in path.reach.values() if reach.low is not None]
    highs = [reach.high.s for reach in path.reach.values() if reach.high is not None]
    return [max(lows) if lows else None, min(highs) if highs else None]


def _several_drivers(setting: Setting, task: Sweep) -> Run:
    """Sweep several drivers at once: straight lines between the values the file names."""
    plan, graphs = setting.plan, setting.graphs
    u, x = _start(setting, task)
    values = plan.values
    corners = [values[0], values[-1]] if not plan.named else list(values)
    evaluator = Evaluator(graphs, setting.outputs, plan.speed, plan.acceleration)
    scales = [
        1.0 if c.is_angle else mechanism_scale(setting.scene.model.mechanism)
        for c in plan.coordinates
    ]
    parts: list[Poses] = []
    path = None
    for k, corner in enumerate(corners):
        path, here = _leg(setting, u, x, corner, scales, values)
        grid = here
        if not plan.named and k == 1:
            n = len(values)
            grid = np.linspace(0.0, 1.0, n) if np.any(corner != u) else np.zeros(n)
        if plan.named or k == 1 or len(values) == 1:
            parts.append(evaluator.at(path, grid))
        end = evaluator.at(path, here)
        if not end.alive.all():
            if not parts or not plan.named:
                parts = parts or [evaluator.at(path, np.ones(len(values)))]
            break
        x, u = end.x[0], corner
    poses = _joined(parts, len(values))
    assert path is not None
    return Run(path, evaluator, poses, values, _limit_events(setting, path, -1.0, 2.0), {})


def _leg(
    setting: Setting, u: Any, x: Any, to: Any, scales: list[float], values: Any
) -> tuple[Path, Any]:
    d = np.asarray(to, float) - u
    length = float(np.max(np.abs(d) / scales)) or 1.0
    largest = 2 * np.pi / NODES_PER_TURN / length
    span = np.vstack([values, [u]])
    path = Path(setting.graphs, _constants(setting, span), np.array(u, float), d, largest)
    path.begin(x, 0.0)
    if np.any(d):
        path.extend(1.0)
        return path, np.array([1.0])
    return path, np.array([0.0])


def _joined(parts: list[Poses], n: int) -> Poses:
    """Return all parts as one; poses behind a failed leg are lost."""

    def together(arrays: list[Any], fill: Any) -> Any:
        whole = np.concatenate(arrays)
        if len(whole) < n:
            shape = (n - len(whole), *whole.shape[1:])
            whole = np.concatenate([whole, np.full(shape, fill, dtype=whole.dtype)])
        return whole

    first = parts[0]
    return Poses(
        together([p.s for p in parts], np.nan),
        together([p.x for p in parts], np.nan),
        together([p.alive for p in parts], False),
        together([p.at_limit for p in parts], False),
        together([p.uncertain for p in parts], False),
        together([p.singular for p in parts], False),
        together([p.error for p in parts], np.nan),
        together([p.condition for p in parts], np.nan),
        [together([p.y[k] for p in parts], np.nan) for k in range(len(first.y))],
    )


# -- from poses to the result ------------------------------------------------------------------


def _limit_events(setting: Setting, path: Path, low: float, high: float) -> list[dict[str, Any]]:
    events = []
    seen = set()
    groups = {group.index: group for group in setting.scene.groups}
    for reach in path.reach.values():
        for limit in (reach.low, reach.high):
            if limit is None or (limit.s, limit.group) in seen:
                continue
            seen.add((limit.s, limit.group))
            group = groups[limit.group]
            events.append(
                {
                    "kind": limit.kind,
                    "at": limit.s,
                    "group": list(group.bodies),
                    "joint": group.key_joint,
                    "name": group.name,
                    "in_range": bool(low <= limit.s <= high),
                }
            )
    return sorted(events, key=lambda event: event["at"])


def _result(problem: Problem, name: str, task: Sweep, setting: Setting, run: Run) -> Result:
    plan, poses, outputs = setting.plan, run.poses, setting.outputs
    status = _status(poses)
    named: dict[str, Any] = outputs.named(poses.y)
    certified = np.isin(status, ("ok", "limit"))
    bounds = output_bounds(setting.graphs, outputs, run.path.constants, poses)
    for bound in bounds.values():
        bound[~certified] = np.nan
    failed = _failed(setting, run, status)
    summary = dict(run.summary)
    summary["poses"] = len(status)
    summary["status"] = {
        str(k): int(v) for k, v in zip(*np.unique(status, return_counts=True), strict=True)
    }
    summary["formula"] = formula(setting.scene.groups)
    summary["mode"] = _mode(setting, run)
    summary["not_in_scene"] = setting.scene.not_in_scene
    summary["bound"] = "proved"
    if failed:
        summary["failed"] = failed
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
        events=tuple(run.events),
        summary=summary,
        fault=_fault(setting, run, status, failed),
        definition=task,
        **named,
    )


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


def _drivers(plan: Plan, values: Any, task: Sweep) -> Named:
    n = len(values)
    table = {}
    for k, c in enumerate(plan.coordinates):
        series = {"position": values[:, k]}
        if task.derivatives >= 1:
            series["velocity"] = np.full(n, plan.speed[k])
        if task.derivatives >= 2:
            series["acceleration"] = np.full(n, plan.acceleration[k])
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
            entry |= {"group": list(group.bodies), "joint": group.key_joint, "name": group.name}
        intervals.append(entry)
    return intervals


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


def _fault(setting: Setting, run: Run, status: Any, failed: list[dict[str, Any]]) -> str | None:
    """Return what is wrong with the answer in one sentence, None when nothing is."""
    if not failed:
        return None
    entry = failed[0]
    c = setting.plan.coordinates[0]
    lost = int(np.isin(status, ("unassembled", "singular")).sum())
    stopped = any(event["kind"] in STOPS for event in run.events)
    text = f"{lost} of {len(status)} poses {'are not reached' if stopped else 'do not assemble'}"
    if "name" in entry and not stopped:
        text += f": group {entry['name']} opens at joint {entry['joint']}"
    interval = [start.shown(c.is_angle, entry[end]) for end in ("from", "to")]
    text += f", first at {c.text} = {interval[0]}" + (
        f" to {interval[1]}" if interval[0] != interval[1] else ""
    )
    ends = [
        start.shown(c.is_angle, event["at"])
        for event in run.events
        if event["kind"] == "limit" and setting.graphs.single
    ]
    if ends:
        text += f"; limit position{'s' if len(ends) > 1 else ''} at {c.text} = {', '.join(ends)}"
    for event in run.events:
        if event["kind"] in STOPS:
            place = start.shown(c.is_angle, event["at"]) if setting.graphs.single else event["at"]
            text += f"; the motion stops at {place}: {STOPS[event['kind']]}"
    if status[0] == "unassembled":
        text += _modes_at_start(setting, run)
    return text
