"""Positions, velocities and accelerations along the drivers, every pose certified."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.analysis.crossings import NODES_PER_TURN
from mechdae.analysis.evaluate import Evaluator, in_time
from mechdae.analysis.extremes import ranges
from mechdae.analysis.laws import Timing
from mechdae.analysis.numbers import Constants, mechanism_scale
from mechdae.analysis.path import Path
from mechdae.analysis.report import ends, limit_events, report
from mechdae.analysis.setting import Run, Setting, covered, first_pose, prepare
from mechdae.analysis.several import along_a_line, approach, from_pose_to_pose, scales
from mechdae.describe.problem import Problem
from mechdae.describe.tasks import Sweep
from mechdae.errors import SolveError
from mechdae.results import Result

MAX_TURNS = 1000
MAX_SPANS = 25
MOST_STEPS = 4096
"""Steps along a law for its fastest moment, beside four times those for its whole way."""


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
    return report(problem, name, task, setting, run(setting, task))


def run(setting: Setting, task: Sweep) -> Run:
    """Evaluate a prepared sweep."""
    plan = setting.plan
    u, x = first_pose(setting, task)
    if setting.graphs.single:
        return _along(setting, task, u, x)
    if plan.course is None:
        straight = from_pose_to_pose if plan.named or plan.poses == 1 else along_a_line
        return straight(setting, task, u, x)
    if task.derivatives and plan.timing and plan.timing.rough.any():
        times = [f"{time:.6g}" for time in plan.timing.times[plan.timing.rough]]
        setting.notes.append(f"a law has a corner at t = {', '.join(times)}: no rates there")
    to = np.where(np.isnan(plan.first), u, plan.first)
    if plan.moving is not None:
        to[plan.moving] = u[plan.moving]
    start = approach(setting, u, x, to)
    if start is not None:
        return _along(setting, task, to, start)
    if plan.values is None:
        raise SolveError(
            "a limit position lies between the sketch and the values of the held drivers",
            hint="sketch a pose with the held drivers at their values",
        )
    return from_pose_to_pose(setting, task, u, x)


def _along(setting: Setting, task: Sweep, u: Any, x: Any) -> Run:
    """Return the poses along one parameter: the value of the driver that moves, or time."""
    plan, graphs, laws = setting.plan, setting.graphs, setting.plan.timing
    moving = plan.lead
    is_angle = graphs.turns
    scale = mechanism_scale(setting.scene.model.mechanism)
    begin = float(laws.times[0] if laws else u[moving])
    if laws:
        largest = _largest(laws, scales(setting))
        span, margin = laws.course.sampled(laws.dense)[0], 0.1 * scales(setting)
    else:
        largest = 2 * np.pi / NODES_PER_TURN * (1.0 if is_angle else scale)
        span = u[None, :] if plan.values is None else np.vstack([plan.values, u])
        margin = np.zeros(len(u))
        margin[moving] = 4 * np.pi if is_angle else 4 * scale
    evaluator = Evaluator(graphs, setting.outputs)
    summary: dict[str, Any] = {}

    def follow(numbers: Constants) -> tuple[Path, Any]:
        path = Path(graphs, numbers, np.zeros(graphs.nu), np.ones(graphs.nu), largest)
        path.on_change_point = setting.on_change_point
        path.begin(x, begin)
        if plan.values is None:
            notes = setting.notes
            places, summary["limits"] = _assembled(path, begin, is_angle, scale, plan.poses, notes)
            return path, places
        places = laws.times if laws else plan.values[:, moving]
        _cover(path, places, is_angle, laws.corners if laws else ())
        return path, places

    path, places = covered(follow, setting, span, margin)
    poses = evaluator.at(path, places, (plan.speed, plan.acceleration) if laws else None)
    low, high = float(np.min(places)), float(np.max(places))
    if not plan.named and task.derivatives >= 2:
        between = [*laws.dense, *laws.corners] if laws and not graphs.nx else []
        found = ranges(evaluator, setting.outputs, path, poses, low, high, between)
        summary.update({word: table for word, table in found.items() if table})
    if not laws:
        poses.y = in_time(poses.y, plan.speed[:, [moving]], plan.acceleration[:, [moving]])
    events = limit_events(setting, path, low, high)
    if "limits" not in summary and not laws and any(end is not None for end in ends(path)):
        summary["limits"] = ends(path)
    values = plan.values if plan.values is not None else path.drivers(places)
    return Run(path, evaluator, poses, values, places, events, summary)


def _largest(laws: Timing, scales: Any) -> float:
    """Return the largest step in time: drivers and their speeds change little over it.

    Unknowns may move faster than the drivers: the interval has at least as many steps as a
    turn. A short burst does not decide, its steps are made smaller when they come.
    """
    values, speed, acceleration = (part / scales for part in laws.course.sampled(laws.dense))
    share, span = 2 * np.pi / NODES_PER_TURN, float(np.ptp(laws.times))
    rate, bend = (
        float(np.max(np.abs(part), initial=0.0, where=np.isfinite(part)))
        for part in (speed, acceleration)
    )
    way = float(np.sum(np.abs(np.diff(values, axis=0))))
    fastest = max(span * rate / share, span * np.sqrt(bend / (2 * share)))
    count = max(NODES_PER_TURN, min(fastest, 4 * way / share + MOST_STEPS))
    return span / count or 1.0


def _cover(path: Path, values: Any, is_angle: bool, corners: Any = ()) -> None:
    """Follow the path over all values, and the other way round where a group is lost."""
    if not path.graphs.nx:
        return
    begin = path.origin[0]
    for place in [*[c for c in corners if c > begin], float(np.max(values))]:
        path.extend(float(place))
    for place in [*[c for c in corners[::-1] if c < begin], float(np.min(values))]:
        path.extend(float(place))
    if not is_angle:
        return
    for group, reach in path.reach.items():
        if (reach.low is None) != (reach.high is None) and not reach.contains(values).all():
            anchor = (reach.low or reach.high).s  # type: ignore[union-attr]
            turn = 2 * np.pi if reach.low is not None else -2 * np.pi
            path.extend(anchor + turn, needed=[group])


def _assembled(
    path: Path, s: float, is_angle: bool, scale: float, count: int, notes: list[str]
) -> tuple[Any, list[float | None]]:
    """Return driver values over the whole assembled arc and its ends (None: turns fully).

    The driver is moved up turn by turn until a group ends or the mechanism is back at its
    first pose, then down to the other end.
    """
    span, most = (2 * np.pi, MAX_TURNS) if is_angle else (4 * scale, MAX_SPANS)
    high = low = None
    for turns in range(1, most + 1):
        path.extend(s + turns * span, first=True)
        high = ends(path)[1]
        if high is not None:
            break
        if is_angle and _closed(path):
            # whole turns from zero, or from the full turn below a sketch further away
            base = 0.0 if abs(s) <= 2 * np.pi else 2 * np.pi * np.floor(s / (2 * np.pi))
            grid = base + 2 * np.pi * turns * np.arange(count) / max(count - 1, 1)
            path.extend(float(grid[-1]))
            path.extend(float(grid[0]))
            return grid, [None, None]
    for turns in range(1, (most if high is not None else 1) + 1):
        path.extend(s - turns * span, first=True)
        low = ends(path)[0]
        if low is not None:
            break
    first = low if low is not None else s - span
    last = high if high is not None else s + span
    if low is None or high is None:
        ways = " and ".join(w for w, end in (("down", low), ("up", high)) if end is None)
        notes.append(f"no end of the assembled arc was found {ways}: one span of it is shown")
    grid = first + (last - first) * (np.arange(count) / max(count - 1, 1))
    grid[0], grid[-1] = first, last
    return grid, [low, high]


def _closed(path: Path) -> bool:
    """Return whether the mechanism is back at its first pose at the path's last node."""
    moved = path.state[-1][: path.graphs.nx] - path.origin[1]
    angle = np.array([name == "angle" for _, name in path.graphs.scene.x_names], bool)
    moved = np.where(angle, moved - 2 * np.pi * np.round(moved / (2 * np.pi)), moved)
    return bool(np.abs(moved).max(initial=0.0) < 1e-9)
