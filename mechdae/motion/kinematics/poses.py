"""Single poses as arrays: on a path that is kept, or on straight lines of several drivers."""

from __future__ import annotations

import numpy as np

from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.kinds import Sweep
from mechdae.errors import InputError
from mechdae.motion.assembly.start import sketched_pose
from mechdae.motion.continuation.evaluate import Evaluator, in_time
from mechdae.motion.continuation.path import Path
from mechdae.motion.continuation.step_sizes import NODES_PER_TURN
from mechdae.motion.kinematics.pose_arrays import PoseArrays, of_poses
from mechdae.motion.kinematics.prepared import Setting, covered, first_pose, prepare
from mechdae.motion.kinematics.sweep import cover
from mechdae.motion.kinematics.tracker import Tracker
from mechdae.motion.setup.drivers import placed, plan
from mechdae.motion.setup.scales import Constants, driver_size
from mechdae.types import Floats


class Posed:
    """The path of a sweep of a single driver, followed as far as poses were asked for."""

    def __init__(self, setting: Setting, task: Sweep) -> None:
        self.setting = setting
        if task.mode is None:
            u, x = sketched_pose(setting.assembler, setting.plan)
        else:
            u, x = first_pose(setting, task)
        self._begin, self._x = float(u[0]), x
        self.evaluator: Evaluator = Evaluator(setting.graphs, setting.outputs)
        self._low = self._high = self._begin
        self._path: Path | None = None

    def at(self, u: Floats) -> PoseArrays:
        """Return the poses at driver values `u` (n,).

        Raises
        ------
        InputError
            No values, or some that are not finite.
        """
        if u.ndim != 1 or not u.size or not np.isfinite(u).all():
            raise InputError("one or more finite values of the driver are needed", where="u")
        low, high = float(np.min(u)), float(np.max(u))
        path = self._path
        if path is None or low < self._low or high > self._high:
            path = self._followed(min(low, self._low), max(high, self._high))
        poses = self.evaluator.at(path, u)
        plan = self.setting.plan
        y = in_time(poses.y, plan.speed, plan.acceleration, plan.jerk)
        return of_poses(u, poses, self.setting, y, lambda: poses.y[1:2])

    def _followed(self, low: float, high: float) -> Path:
        """Return the path over all values from `low` to `high`."""
        setting, graphs = self.setting, self.setting.graphs
        model, c = setting.scene.model, setting.plan.coordinates[0]
        scale = model.mechanism.scale
        size = driver_size(model, c, scale)
        margin = np.array([4 * (scale if c.unit == "m" else np.pi * size)])
        largest = 2 * np.pi / NODES_PER_TURN * size
        if self._path is not None:  # others will lie beside
            low, high = low - largest, high + largest

        def follow(numbers: Constants) -> tuple[Path, None]:
            path = Path(graphs, numbers, np.zeros(1), np.ones(1), largest)
            path.on_change_point = setting.on_change_point
            path.begin(self._x, self._begin)
            cover(path, self.evaluator, np.array([low, high]), graphs.turns)
            return path, None

        span = np.array([[low], [high], [self._begin]])
        start = (self._x, np.array([self._begin]))
        path, _ = covered(follow, setting, span, margin, start)
        self._path, self._low, self._high = path, low, high
        return path


def tracker(problem: Problem, task: Sweep) -> Tracker:
    """Return what moves the mechanism of a task by its drivers' values; laws do not count."""
    numbers = plan(problem.mechanism, task)
    alone = numbers.held if numbers.moving is not None else None
    task = placed(task, numbers)
    setting = prepare(problem, task)
    return Tracker(setting, *first_pose(setting, task), alone)


def posed(problem: Problem, task: Sweep) -> Posed | Tracker:
    """Return what gives poses of a task by the values of its drivers."""
    numbers = plan(problem.mechanism, task)
    if len(numbers.coordinates) == 1 and numbers.timing is None:
        return Posed(prepare(problem, task), task)
    return tracker(problem, task)
