"""Poses of several drivers that move along straight lines, from a pose to others near or far."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mechdae.errors import InputError
from mechdae.kernels.run.functions import Call
from mechdae.motion.continuation.evaluate import Poses
from mechdae.motion.continuation.fan import SMALLEST, Fan
from mechdae.motion.continuation.legs import SHORT, largest_step, resized
from mechdae.motion.continuation.path import Path
from mechdae.motion.kinematics.one_pose import OnePose, PoseNumbers
from mechdae.motion.kinematics.pose_arrays import PoseArrays, PoseState, of_certified, of_poses
from mechdae.motion.kinematics.prepared import Setting, covered
from mechdae.motion.setup.scales import Constants
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
