"""Sweeps of several drivers: straight lines between the values the file names."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.analysis.crossings import NODES_PER_TURN
from mechdae.analysis.evaluate import Evaluator, Poses
from mechdae.analysis.measures.measure import at_poses
from mechdae.analysis.numbers import Constants, driver_size, mechanism_scale
from mechdae.analysis.path import Path
from mechdae.analysis.report import limit_events
from mechdae.analysis.setting import Run, Setting, covered, first_pose
from mechdae.describe.tasks import Sweep


def several_drivers(setting: Setting, task: Sweep) -> Run:
    """Return the poses of a sweep with several drivers.

    The mechanism moves along a straight line in the drivers' values from the sketch to the
    first pose, then along one line through all poses (``from`` and ``to``) or from pose to
    pose (``at``, laws of time). Poses behind a limit position are lost.
    """
    plan = setting.plan
    values, n = plan.values, len(plan.values)
    evaluator = Evaluator(setting.graphs, setting.outputs)
    speed = np.broadcast_to(plan.speed, values.shape)
    acceleration = np.broadcast_to(plan.acceleration, values.shape)
    jerk = np.broadcast_to(plan.jerk, values.shape)
    u, x = first_pose(setting, task)
    lines = list(values) if plan.named or n == 1 else [values[0], values[-1]]
    parts: list[Poses] = []
    first = 0
    for k, corner in enumerate(lines):
        path = _line(setting, u, x, corner)
        through = not plan.named and k == 1
        rows = slice(0, n) if through else slice(first, first + 1)
        grid = np.linspace(0.0, 1.0, n) if through else np.ones(1)
        part = evaluator.at(path, grid, (speed[rows], acceleration[rows], jerk[rows]))
        if plan.named or through or n == 1 or not part.alive.all():
            parts.append(part)
            first += len(grid)
        if not part.alive.all():
            break
        x, u = part.x[-1], corner
    poses = _joined(parts, n)
    events = limit_events(setting, path, -1.0, 2.0)
    return Run(path, evaluator, poses, values, events, {}, at_poses(setting.outputs, task, poses))


def _line(setting: Setting, u: Any, x: Any, to: Any) -> Path:
    """Return the certified path from `u` (s = 0) to the driver values `to` (s = 1)."""
    scale = mechanism_scale(setting.scene.model.mechanism)
    model = setting.scene.model
    scales = np.array([driver_size(model, c, scale) for c in setting.plan.coordinates])
    d = np.asarray(to, float) - u
    length = float(np.max(np.abs(d) / scales)) or 1.0
    largest = 2 * np.pi / NODES_PER_TURN / length

    def follow(numbers: Constants) -> tuple[Path, Any]:
        path = Path(setting.graphs, numbers, np.array(u, float), d, largest)
        path.begin(x, 0.0)
        path.extend(1.0)
        return path, None

    return covered(follow, setting, np.vstack([setting.plan.values, u]), 0.0, (x, u))[0]


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
