"""Positions, velocities and accelerations along the drivers, every pose certified."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.analysis.evaluate import Evaluator, in_time
from mechdae.analysis.extremes import ranges
from mechdae.analysis.numbers import Constants, mechanism_scale
from mechdae.analysis.path import NODES_PER_TURN, Path
from mechdae.analysis.report import ends, limit_events, report
from mechdae.analysis.setting import Run, Setting, covered, first_pose, prepare
from mechdae.analysis.several import several_drivers
from mechdae.describe.problem import Problem
from mechdae.describe.tasks import Sweep
from mechdae.results import Result

MAX_TURNS = 1000


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
    return _one_driver(setting, task) if setting.graphs.single else several_drivers(setting, task)


def _one_driver(setting: Setting, task: Sweep) -> Run:
    plan, graphs = setting.plan, setting.graphs
    u, x = first_pose(setting, task)
    is_angle = plan.coordinates[0].is_angle
    scale = mechanism_scale(setting.scene.model.mechanism)
    largest = 2 * np.pi / NODES_PER_TURN * (1.0 if is_angle else scale)
    evaluator = Evaluator(graphs, setting.outputs)
    summary: dict[str, Any] = {}

    def follow(numbers: Constants) -> tuple[Path, Any]:
        path = Path(graphs, numbers, np.zeros(1), np.ones(1), largest)
        path.begin(x, float(u[0]))
        if plan.values is None:
            values, summary["limits"] = _assembled(path, float(u[0]), is_angle, scale, plan.poses)
        else:
            values = plan.values[:, 0]
            _cover(path, values, is_angle)
        return path, values

    span = u[None, :] if plan.values is None else np.vstack([plan.values, u])
    path, values = covered(follow, setting, span, 4 * np.pi if is_angle else 4 * scale)
    poses = evaluator.at(path, values)
    low, high = float(np.min(values)), float(np.max(values))
    if not plan.named and task.derivatives >= 2:
        found = ranges(evaluator, setting.outputs, path, poses, low, high)
        summary.update({word: table for word, table in found.items() if table})
    poses.y = in_time(poses.y, plan.speed, plan.acceleration)
    events = limit_events(setting, path, low, high)
    if "limits" not in summary and events:
        summary["limits"] = ends(path)
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
        low, high = ends(path)
        if low is not None and high is not None:
            grid = low + (high - low) * (np.arange(count) / max(count - 1, 1))
            grid[0], grid[-1] = low, high
            return grid, [low, high]
        if is_angle and low is None and high is None and _closed(path, s, turns):
            # whole turns from zero, or from the full turn below a sketch further away
            base = 0.0 if abs(s) <= 2 * np.pi else 2 * np.pi * np.floor(s / (2 * np.pi))
            grid = base + 2 * np.pi * turns * np.arange(count) / max(count - 1, 1)
            path.extend(float(grid[-1]))
            path.extend(float(grid[0]))
            return grid, [None, None]
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
