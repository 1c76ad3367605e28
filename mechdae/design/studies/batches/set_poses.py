"""Poses of many sets of numbers at once as arrays, each set at one place of the driver."""

from __future__ import annotations

import numpy as np

from mechdae.design.studies.batches.batch import SeriesBatch
from mechdae.design.studies.batches.numbers import numbers_of
from mechdae.design.studies.batches.poses import Asked
from mechdae.motion.continuation.evaluate import in_time
from mechdae.motion.continuation.output_bounds import plain_up_to
from mechdae.motion.kinematics.pose_arrays import PoseArrays, ProvedPoses, of_certified
from mechdae.types import Booleans, Floats, Integers, Matrix


class SetPoses(SeriesBatch):
    """Poses of sets with bounds, each reached from its own sketch by proved steps."""

    def _selected(self) -> Asked:
        count = self.setting.graphs.pose.size1_out(5)
        return Asked(((self.task.derivatives, tuple(range(count))),), bounds=True)

    def at(self, sets: Matrix, u: Floats) -> tuple[PoseArrays | None, Integers, Booleans]:
        """Return poses of sets (k, m) at values `u` (k,), their rows, and rows to do alone (k,).

        Rows that are in neither do not assemble on any mode.
        """
        numbers = numbers_of(self.problem, self.task, self.setting, self.names, sets)
        if numbers is None:
            return None, np.zeros(0, int), np.ones(len(sets), bool)
        s = np.where(np.isnan(numbers.start), self.setting.plan.first[0], numbers.start)
        with np.errstate(all="ignore"):
            starts = self.modes(numbers, s)
        left = numbers.left | ~starts.sure | ~np.isfinite(u)
        lanes = np.flatnonzero(~left & ~starts.open)
        if not lanes.size:
            return None, lanes, left
        g, goal = self.setting.graphs, u[lanes]
        march, trace, ends, lane_numbers, mu = self._begun(numbers, lanes, starts, s[lanes], goal)
        march.go(trace, ends, np.arange(len(lanes)), goal, np.unique(goal))
        up = goal >= s[lanes]
        x = np.where(up, ends.up[: g.nx], ends.down[: g.nx])
        found, good = self.poses.certified(lane_numbers, x, goal)
        error, beta, *y = np.split(found.T, self._splits(found), axis=1)
        share = mu * beta
        plain = np.array([plain_up_to(g, b) for b in range(g.nb)])
        with np.errstate(invalid="ignore"):
            good &= (share <= plain).all(axis=1) & (np.where(up, trace.last, trace.first) == goal)
            good &= ~trace.left & np.isinf([*trace.low, *trace.high]).all(axis=0)
        left[lanes[~good]] = True
        y = [part[good] for part in y]
        rates = (rate[lanes[good], None] for rate in numbers.rates)
        condition = share[good].max(axis=1, initial=1.0)
        proved = ProvedPoses(x.T[good], error[good], condition, y)
        times = in_time(y, *rates)
        return (
            of_certified(goal[good], proved, self.setting, times, lambda: y[1:2]),
            lanes[good],
            left,
        )

    def _splits(self, found: Matrix) -> Integers:
        g, orders = self.setting.graphs, self.asked.order + 1
        outputs = (len(found) - g.nx - g.nb) // orders
        return np.cumsum([g.nx, g.nb, *[outputs] * (orders - 1)])
