"""Single poses of a sweep as arrays: the path is kept, and followed on where poses lie beyond."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.kinds import Sweep
from mechdae.errors import InputError
from mechdae.motion.assembly.start import sketched_pose
from mechdae.motion.continuation.evaluate import Evaluator, Poses, in_time
from mechdae.motion.continuation.path import Path
from mechdae.motion.continuation.step_sizes import NODES_PER_TURN
from mechdae.motion.kinematics.prepared import Setting, covered, first_pose, prepare
from mechdae.motion.kinematics.sweep import cover
from mechdae.motion.setup.scales import Constants, driver_size
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Points


@dataclass(frozen=True)
class PoseArrays:
    """Poses at values of the driver.

    Attributes
    ----------
    u : (n,) array
        Values of the driver.
    ok : (n,) array of bool
        Poses that are proved in all groups.
    error : (n, nx) array
        Bounds of the unknowns' errors.
    condition : (n,) array
    """

    u: Any
    ok: Booleans
    error: Points
    condition: Floats
    _setting: Setting
    _y: list[Floats]

    def __getitem__(self, path: str) -> Floats:
        """Return a series: ``points/rod.B/position`` (n, 2), ``bodies/rod/angle`` (n,).

        Raises
        ------
        UnknownName
            Nothing of that path is computed.
        """
        order, columns = self._setting.outputs.column_of(path)
        values = self._y[order][:, columns]
        return values if values.shape[1] > 1 else values[:, 0]


class Posed:
    """The path of a sweep of a single driver, followed as far as poses were asked for.

    Raises
    ------
    InputError
        Several drivers, or one that follows a law.
    """

    def __init__(self, problem: Problem, task: Sweep) -> None:
        self.setting = setting = prepare(problem, task)
        if not setting.graphs.single:
            raise InputError("poses are given for a single driver, by its value", where="task")
        if task.mode is None:
            u, x = sketched_pose(setting.assembler, setting.plan)
        else:
            u, x = first_pose(setting, task)
        self._begin, self._x = float(u[0]), x
        self.evaluator = Evaluator(setting.graphs, setting.outputs)
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
        ok = poses.alive.all(axis=1) & ~poses.at_limit
        return PoseArrays(u, ok, poses.error, _condition(poses), self.setting, y)

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

        def follow(numbers: Constants) -> tuple[Path, Any]:
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


def _condition(poses: Poses) -> Floats:
    return np.where(poses.alive.all(axis=1), poses.condition, np.nan)
