"""Poses by values of the drivers: on a path that is kept, or along straight lines of several."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.kinds import Sweep
from mechdae.errors import InputError
from mechdae.kernels.run.functions import Call
from mechdae.motion.assembly.start import sketched_pose
from mechdae.motion.continuation.evaluate import Evaluator, Poses, in_time
from mechdae.motion.continuation.legs import SHORT, SMALLEST, Fan, largest_step, resized
from mechdae.motion.continuation.path import Path
from mechdae.motion.continuation.step_sizes import NODES_PER_TURN
from mechdae.motion.kinematics.pose_arrays import (
    OnePose,
    PoseArrays,
    PoseNumbers,
    PoseState,
    of_certified,
    of_poses,
)
from mechdae.motion.kinematics.prepared import Setting, covered, first_pose, prepare
from mechdae.motion.kinematics.sweep import cover
from mechdae.motion.setup.drivers import placed, plan
from mechdae.motion.setup.scales import Constants, driver_size
from mechdae.types import Booleans, Floats, Unknowns

MOST_STEPS = 256
"""Steps to one pose that are taken alone, at most."""


class _Numbers(Constants):
    """Bounds for a range of the drivers with what the kernels take."""

    def __init__(self, setting: Setting, far: Floats) -> None:
        graphs = setting.graphs.straight
        angles = np.array([c.is_angle for c in setting.plan.coordinates])
        self.reach = far + np.where(angles, 4 * np.pi, 1.0) * setting.driver_sizes
        super().__init__(graphs, self.reach)
        self.whole = np.concatenate([self.consts, np.zeros(2 * graphs.nu)])


class Tracker:
    """Moves a mechanism from pose to pose on straight lines in the values of its drivers.

    `held` are the drivers' values where one of them moves alone, whose value is nan.
    """

    def __init__(
        self, setting: Setting, values: Floats, x: Unknowns, held: Floats | None = None
    ) -> None:
        self.setting, self.graphs = setting, setting.graphs.straight
        self._held = np.array([np.nan]) if self.graphs.nu == 1 else held
        self._one = OnePose(self.graphs, setting.outputs)
        self._step: Call = self.graphs.cache("step", lambda: Call(self.graphs.advance))
        plan, count = setting.plan, len(self.graphs.driven)
        self.usual = [part[0] for part in (plan.speed, plan.acceleration, plan.jerk)][:count]
        closing = self._one.evaluator.closing
        self._plain = not self.graphs.contacts and closing is None
        self._numbers: _Numbers | None = None
        self.first: PoseState = self._begun(values, x, Constants(self.graphs, values))
        """The pose that it begins with."""

    def _begun(self, values: Floats, x: Unknowns, numbers: Constants) -> PoseState:
        """Return a solved pose from which steps are taken."""
        path = Path(self.graphs, numbers, values, 0 * values, 1.0)
        path.begin(x, 0.0)
        return PoseState(values, path.state[0], path.sign, self)

    def at(self, u: Floats) -> PoseArrays:
        """Return the poses at drivers' values `u` (n, nd), each straight from the first pose.

        One pose (nd,) has one row; rows that are not finite have no pose. Where one driver alone
        moves, `u` (n,) are its values.

        Raises
        ------
        InputError
            Values of another number of drivers.
        """
        rows = self.rows(u)
        return self.to(self.first, rows[0]) if len(rows) == 1 else self.fan(self.first, rows)

    def rows(self, u: Floats) -> Floats:
        """Return values of all drivers (n, nd), of those of the one that moves alone (n,) too.

        Raises
        ------
        InputError
            Values of another number of drivers.
        """
        rows = np.atleast_2d(u)
        if u.ndim < 2 and self._held is not None:
            rows = np.where(np.isnan(self._held), np.reshape(u, (-1, 1)), self._held)
        if rows.ndim != 2 or rows.shape[1] != self.graphs.nu or not len(rows):
            names = ", ".join(c.text for c in self.setting.plan.coordinates)
            raise InputError(f"values of {names} are needed, not of shape {u.shape}", where="u")
        return rows

    def moved(
        self, state: PoseState, u: Floats, speed: Floats | None, acceleration: Floats | None
    ) -> PoseArrays:
        """Return the pose that a motion straight in the drivers leads to, one row.

        `u` (nd,) may be the value of the one that moves alone. Rates are those of the task
        where they are None.

        Raises
        ------
        InputError
            Values or rates of another number of drivers.
        """
        count, rates = self.graphs.nu, []
        for name, given in (("speed", speed), ("acceleration", acceleration)):
            if given is not None and given.shape != (count,):
                raise InputError(f"{count} values are needed, one for each driver", where=name)
            rates.append(given)
        known = [w if g is None else g for g, w in zip(rates, self.usual, strict=False)]
        rows = self.rows(u[None, :] if u.shape == (count,) else u)
        if len(rows) > 1:
            raise InputError("one value of each driver is needed", where="u")
        return self.to(state, rows[0], known)

    def to(self, node: PoseState, values: Floats, rates: Sequence[Floats] = ()) -> PoseArrays:
        """Return the pose at drivers' values (nd,), reached straight from another one.

        Parameters
        ----------
        rates
            Speeds, accelerations and jerks (nd,) of the drivers; by default those of the task.
        """
        usual = self.usual
        rates = [*rates, *usual[len(rates) :]][: len(usual)]
        reached = self.reached(node, values)
        if reached is None:
            return self.fan(node, values[None, :], rates)
        after, numbers = reached
        x = after.state[: self.graphs.nx]
        pose = self._one.solved(numbers, node.sign, x, values, *rates)
        if pose is None:
            return self.fan(node, values[None, :], rates)

        def slopes() -> list[Floats]:
            rest = [np.zeros(self.graphs.nu)] * (len(rates) - 1)
            found = []
            for direction in np.eye(self.graphs.nu):
                given = (numbers, node.sign, pose.x[0], values, direction, *rest)
                found += [each.y[1] for each in (self._one.solved(*given),) if each is not None]
            return found

        found = of_certified(values[None, :], pose, self.setting, pose.y, slopes, after)
        return found if found.ok[0] else replace(found, node=node)

    def reached(self, node: PoseState, values: Floats) -> tuple[PoseState, PoseNumbers] | None:
        """Return the node at drivers' values (nd,) after a few proved steps, None without.

        What it is certified with is beside it. Contacts on curves have no such steps.
        """
        far = np.abs(values)
        if not self._plain or not np.isfinite(far).all():
            return None
        numbers = self._numbers
        if numbers is None or (far > numbers.reach).any():
            numbers = self._numbers = _Numbers(self.setting, far)
        state = self._stepped(node, values, numbers) if self.graphs.nx else node.state
        return None if state is None else (PoseState(values, state, node.sign, self), numbers)

    def _stepped(self, node: PoseState, values: Floats, numbers: _Numbers) -> Floats | None:
        """Return the state at drivers' values (nd,) after proved steps, None without.

        The first step has no length: it turns the state into the line's direction.
        """
        graphs, n, state = self.graphs, self.graphs.nx, node.state
        d = values - node.values
        whole = numbers.whole.copy()
        whole[-2 * graphs.nu : -graphs.nu], whole[-graphs.nu :] = node.values, d
        largest = float(largest_step(d, self.setting.driver_sizes))
        place, step, length = 0.0, SHORT * largest, 0.0
        for _ in range(MOST_STEPS):
            after, test, det, miss = self._step(state, np.array([place, length]), whole)
            held = ((test <= 1) & (miss <= 1) & (det * node.sign > 0)).all()
            if held and (np.abs(after[:n]) <= numbers.size_x).all():
                state, place = after, place + length
                if place >= 1.0:
                    return state
            elif length <= SMALLEST * largest:
                return None
            worst = test.max()
            if length:
                step = float(resized(length, worst if held or worst > 1 else np.inf))
            length = (place + min(step, 1.0 - place)) - place
        return None

    def fan(self, node: PoseState, rows: Floats, rates: Sequence[Floats] = ()) -> PoseArrays:
        """Return the poses at rows (n, nd) of drivers' values, each straight from one pose.

        A single one is a pose from which the next is reached, or `node` where it is not proved.
        """
        setting, graphs = self.setting, self.graphs
        rates = [*rates, *self.usual[len(rates) :]]
        finite: Booleans = np.logical_and.reduce(np.isfinite(rows), axis=1)
        corners = np.vstack([node.values, np.where(finite[:, None], rows, node.values)])
        x = node.state[: graphs.nx]

        def follow(numbers: Constants) -> tuple[Fan, None]:
            fan = Fan(graphs, numbers, corners, setting.driver_sizes)
            fan.leg.on_change_point = setting.on_change_point
            fan.walk(x)
            return fan, None

        fan, _ = covered(follow, setting, corners, 0.0, (x, node.values), graphs)
        fan.reached[1:] &= finite[:, None]
        places = np.arange(1.0, len(corners))

        def evaluated(given: Sequence[Floats]) -> Poses:
            every = tuple(np.broadcast_to(rate, rows.shape) for rate in given)
            return self._one.evaluator.at(fan, places, every)

        def slopes() -> list[Floats]:
            return [evaluated([d]).y[1] for d in np.eye(graphs.nu)]

        poses = evaluated(rates)
        if len(rows) == 1 and poses.alive.all() and not poses.at_limit.any():
            reached = self._begun(rows[0], fan.nodes[1], fan.constants)
            found = of_poses(rows, poses, setting, poses.y, slopes, reached)
            return found if found.ok[0] else replace(found, node=node)
        return of_poses(rows, poses, setting, poses.y, slopes, node if len(rows) == 1 else None)


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
