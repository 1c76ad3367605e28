"""Positions, velocities and accelerations along the drivers, every pose certified."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.analysis.crossings import NODES_PER_TURN
from mechdae.analysis.evaluate import Evaluator, in_time
from mechdae.analysis.extremes import ranges
from mechdae.analysis.measures.measure import along_path, at_poses
from mechdae.analysis.numbers import Constants, driver_size, mechanism_scale, natural_sizes, periods
from mechdae.analysis.path import Path
from mechdae.analysis.report import ends, limit_events, report
from mechdae.analysis.setting import Run, Setting, covered, first_pose, prepare
from mechdae.analysis.several import several_drivers
from mechdae.describe.problem import Problem
from mechdae.describe.tasks import Sweep
from mechdae.results import Result

MAX_TURNS = 1000
MAX_SPANS = 25


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
    result = (_one_driver if setting.graphs.single else several_drivers)(setting, task)
    result.poses.y = result.poses.y[: task.derivatives + 1]
    return result


def _one_driver(setting: Setting, task: Sweep) -> Run:
    plan, graphs = setting.plan, setting.graphs
    u, x = first_pose(setting, task)
    is_angle = plan.coordinates[0].is_angle
    contact = setting.scene.model.contacts.get(plan.coordinates[0].part)
    closed = contact is not None and contact.closed
    scale = mechanism_scale(setting.scene.model.mechanism)
    size = driver_size(setting.scene.model, plan.coordinates[0], scale)
    largest = 2 * np.pi / NODES_PER_TURN * size
    evaluator = Evaluator(graphs, setting.outputs)
    summary: dict[str, Any] = {}

    def follow(numbers: Constants) -> tuple[Path, Any]:
        path = Path(graphs, numbers, np.zeros(1), np.ones(1), largest)
        path.on_change_point = setting.on_change_point
        path.begin(x, float(u[0]))
        if plan.values is None:
            notes = setting.notes
            turn = 2 * np.pi * size if is_angle or closed else None
            values, summary["limits"] = _assembled(
                path, float(u[0]), turn, 4 * scale, plan.poses, notes
            )
        else:
            values = plan.values[:, 0]
            _cover(path, values, is_angle)
        return path, values

    span = u[None, :] if plan.values is None else np.vstack([plan.values, u])
    margin = 4 * (scale if plan.coordinates[0].unit == "m" else np.pi * size)
    path, values = covered(follow, setting, span, margin, (x, u))
    poses = evaluator.at(path, values)
    low, high = float(np.min(values)), float(np.max(values))
    if not plan.named and task.derivatives >= 2:
        found = ranges(evaluator, setting.outputs, path, poses, low, high)
        summary.update({word: table for word, table in found.items() if table})
    events = limit_events(setting, path, low, high)
    if "limits" not in summary and any(end is not None for end in ends(path)):
        summary["limits"] = ends(path)
    measured = at_poses(setting.outputs, task, poses, 1.0 if is_angle else scale)
    along_path(setting.outputs, task, evaluator, path, values, measured)
    poses.y = in_time(poses.y, plan.speed, plan.acceleration, plan.jerk)
    return Run(path, evaluator, poses, values[:, None], events, summary, measured)


def _cover(path: Path, values: Any, is_angle: bool) -> None:
    """Follow the path over all values, and the other way round where a group is lost."""
    if not path.followed:
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
    path: Path, s: float, turn: float | None, length: float, count: int, notes: list[str]
) -> tuple[Any, list[float | None]]:
    """Return driver values over the whole assembled arc and its ends (None: turns fully).

    The driver is moved up turn by turn (or, where it has no `turn`, by `length`) until a
    group ends or the mechanism is back at its first pose, then down to the other end.
    """
    span, most = (turn, MAX_TURNS) if turn else (length, MAX_SPANS)
    high = low = None
    for turns in range(1, most + 1):
        path.extend(s + turns * span, first=True)
        high = ends(path)[1]
        if high is not None:
            break
        if turn and _closed(path):
            # whole turns from zero, or from the full turn below a sketch further away
            base = 0.0 if abs(s) <= turn else turn * np.floor(s / turn)
            grid = base + turn * turns * np.arange(count) / max(count - 1, 1)
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
    scene = path.graphs.scene
    moved = path.state[-1][: path.graphs.nx] - path.origin[1]
    period = periods(scene)
    whole = np.where(period > 0, period, 1.0)
    moved = np.where(period > 0, moved - whole * np.round(moved / whole), moved)
    size = natural_sizes(scene, path.constants.scale)
    return bool(np.abs(moved / size).max(initial=0.0) < 1e-9)
