"""Sweeps of several drivers along straight lines, and the way from the sketch to a course."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.analysis.evaluate import Evaluator
from mechdae.analysis.extremes import ranges
from mechdae.analysis.legs import Legs, largest_step
from mechdae.analysis.measures.measure import at_poses
from mechdae.analysis.numbers import Constants, driver_size, mechanism_scale
from mechdae.analysis.path import Path
from mechdae.analysis.report import limit_events
from mechdae.analysis.setting import Run, Setting, covered
from mechdae.describe.tasks import Sweep


def scales(setting: Setting) -> Any:
    """Return the size of each driver, (nd,), see `driver_size`."""
    model = setting.scene.model
    length = mechanism_scale(model.mechanism)
    return np.array([driver_size(model, c, length) for c in setting.plan.coordinates])


def walked(setting: Setting, x: Any, corners: Any) -> Legs:
    """Return the proved straight legs through the drivers' values `corners` (m, nd)."""
    graphs = setting.graphs.straight

    def follow(numbers: Constants) -> tuple[Path, Any]:
        legs = Legs(graphs, numbers, corners, scales(setting))
        legs.on_change_point = setting.on_change_point
        legs.walk(x)
        return legs, legs

    legs: Legs = covered(follow, setting, corners, 0.0, (x, corners[0]), graphs)[1]
    return legs


def approach(setting: Setting, u: Any, x: Any, to: Any) -> Any:
    """Return the unknowns at the drivers' values `to`, moved there straight from `u`.

    None where a limit position lies between.
    """
    if np.array_equal(u, to):
        return x
    legs = walked(setting, x, np.array([u, to]))
    return legs.nodes[-1] if legs.whole_way else None


def from_pose_to_pose(setting: Setting, task: Sweep, u: Any, x: Any) -> Run:
    """Return the poses along straight legs from one to the next, the sketch first.

    Groups that reach a limit position are lost from there on, the others go on.
    """
    plan = setting.plan
    legs = walked(setting, x, np.vstack([u, plan.values]))
    evaluator = Evaluator(legs.graphs, setting.outputs)
    n = len(plan.values)
    places = np.arange(1.0, n + 1)
    poses = evaluator.at(legs, places, _rates(setting))
    events = limit_events(setting, legs, 0.0, float(n))
    measured = at_poses(setting.outputs, task, poses)
    return Run(legs, evaluator, poses, plan.values, places, events, {}, measured)


def along_a_line(setting: Setting, task: Sweep, u: Any, x: Any) -> Run:
    """Return the poses along one straight line from the first to the last values."""
    plan = setting.plan
    values = plan.values
    start = approach(setting, u, x, values[0])
    if start is None:
        return from_pose_to_pose(setting, task, u, x)
    d = values[-1] - values[0]
    largest = largest_step(d, scales(setting))

    def follow(numbers: Constants) -> tuple[Path, Any]:
        path = Path(setting.graphs, numbers, values[0], d, largest)
        path.on_change_point = setting.on_change_point
        path.begin(start, 0.0)
        path.extend(1.0)
        return path, None

    path = covered(follow, setting, values, 0.0, (start, values[0]))[0]
    evaluator = Evaluator(setting.graphs, setting.outputs)
    grid = np.linspace(0.0, 1.0, len(values))
    poses = evaluator.at(path, grid, _rates(setting))
    summary: dict[str, Any] = {}
    if task.derivatives >= 2:
        found = ranges(evaluator, setting.outputs, path, poses, 0.0, 1.0)
        summary.update({word: table for word, table in found.items() if table})
    events = limit_events(setting, path, 0.0, 1.0)
    measured = at_poses(setting.outputs, task, poses)
    return Run(path, evaluator, poses, values, grid, events, summary, measured)


def _rates(setting: Setting) -> tuple[Any, ...]:
    """Return speeds, accelerations and jerks of the drivers, each (n, nd)."""
    plan = setting.plan
    shape = plan.values.shape
    return tuple(np.broadcast_to(r, shape) for r in (plan.speed, plan.acceleration, plan.jerk))
