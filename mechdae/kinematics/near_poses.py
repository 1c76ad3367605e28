"""Single poses of sets of numbers near those of a mechanism, each by a handful of kernel calls.

The mode nearest to the sketch is known in closed form; from there proved steps lead to the pose,
which is certified like every other. What is not proved so is left to a path.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechdae.assembly.closed_start import ClosedStart, closed_start
from mechdae.continuation.any_path import STRIDE, strides
from mechdae.continuation.change_points import NODES_PER_TURN
from mechdae.continuation.evaluate import (
    CARRIED,
    H_LIMIT,
    HALF_TURN,
    ROUNDS,
    TINY,
    Evaluator,
    in_time,
)
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.kinds import Sweep
from mechdae.describe.values import Number
from mechdae.kernels.graphs.bounds import ROUNDOFF
from mechdae.kernels.run.call import Call
from mechdae.kinematics.near_numbers import NearNumbers
from mechdae.kinematics.poses import PoseArrays
from mechdae.kinematics.prepared import Setting, prepare

STILL = 1e-9
"""Largest step of Newton's method from a closed form that is one but for rounding."""
MOST_STEPS = 2 * NODES_PER_TURN
"""Steps to a pose, at most."""


@dataclass(frozen=True)
class Begun:
    """A set of numbers at its start: where steps begin, and what bounds are proved for.

    ``whole`` are the numbers of a step, ``consts`` those of a pose, ``reach`` the largest value
    of the driver and ``size_x`` (nx,) the largest unknowns that they hold for. ``unit`` is that of
    the driver's value: 1 rad or the mechanism's ``length``.
    """

    numbers: dict[str, Number]
    s: float
    state: Any
    sign: Any
    whole: Any
    consts: Any
    kappa: Any
    rho: Any
    mu: Any
    size_x: Any
    reach: float
    unit: float
    length: float


@dataclass(frozen=True)
class OnePose:
    """A certified pose: unknowns' bounds (nx,), condition, outputs and their rates (ny,)."""

    error: Any
    condition: float
    y: list[Any]


class NearPoses:
    """Single poses of a sweep of one driver whose mechanism has other values of some numbers.

    Attributes
    ----------
    setting : Setting
        That of the mechanism itself; names of outputs are those of all.
    """

    def __init__(self, setting: Setting, start: ClosedStart, numbers: NearNumbers) -> None:
        self.setting, self._start, self._numbers = setting, start, numbers
        graphs = self.graphs = setting.graphs
        self.names = numbers.names
        evaluator = Evaluator(graphs, setting.outputs)
        self._tells, self._turning = evaluator.sign_tells, evaluator.turning
        self._blocks, self._angles = evaluator.lengths, evaluator.angles
        self._one: Call = graphs.kept("step", lambda: Call(graphs.advance))
        self._pose: Call = graphs.kept("pose", lambda: Call(graphs.pose))
        self._bounds: Call = graphs.kept("constants", lambda: Call(graphs.constants))
        plan, self._s = setting.plan, np.array([setting.plan.sketch[0]])
        self._is_angle = plan.coordinates[0].is_angle
        self._lengths = np.where(graphs.scene.unknowns.turns, 0.0, 1.0)
        self._rates = [float(rate[0, 0]) for rate in (plan.speed, plan.acceleration, plan.jerk)]
        self._begun: Begun | None = None

    def at(self, numbers: Mapping[str, Number], u: float) -> OnePose | None:
        """Return the pose at a value of the driver, None where it is not proved in this way.

        `numbers` are those of `names`, in SI units.
        """
        begun = self._begun
        if begun is None or begun.numbers != numbers or abs(u) > begun.reach:
            begun = self._begin(dict(numbers), u)
            if begun is None:
                return None
            self._begun = begun
        x = self._stepped(begun, u)
        return None if x is None else self._solved(begun, x, u)

    def arrays(self, pose: OnePose, u: Any) -> PoseArrays:
        """Return a pose at driver's values `u` (1,) as arrays."""
        condition = np.array([pose.condition])
        return PoseArrays(u, np.ones(1, bool), pose.error, condition, self.setting, pose.y)

    def _begin(self, numbers: dict[str, Number], u: float) -> Begun | None:
        """Return the assembled sketch with other numbers."""
        p = self._numbers(numbers)
        found = None if p is None else self._start(self._s, p)
        if found is None:
            return None
        scale, x, sign = found
        g, s = self.graphs, float(self._s[0])
        size = 1.0 if self._is_angle else scale
        reach = max(abs(u), abs(s)) + 4 * (np.pi if self._is_angle else scale)
        turned = 4 * np.pi + (2 * reach if self._is_angle else 0.0)
        size_x = np.where(self._lengths, 10 * scale, turned)
        none = np.zeros(0)
        kappa, rho, mu = self._bounds(size_x, np.array([reach]), p, scale, none, none, none)
        consts = np.concatenate([p, [scale], kappa, rho, ROUNDOFF * size_x])
        whole = np.concatenate([consts, [0.0, 1.0]])
        state = np.zeros(3 * g.nx + g.nb)
        state[: g.nx] = x
        state, _, det, _ = self._one(state, np.array([s, 0.0]), whole)
        signs = np.sign(det)
        near = np.abs(state[: g.nx] - x) <= STILL * np.where(self._lengths, scale, 1.0)
        branches = self._start.form.branches
        if not (near.all() and np.isfinite(state).all() and signs.all()):
            return None
        if (signs != sign)[branches].any() or (np.abs(x) > size_x).any():
            return None
        return Begun(
            numbers, s, state, signs, whole, consts, kappa, rho, mu, size_x, reach, size, scale
        )

    def _stepped(self, begun: Begun, u: float) -> Any:
        """Return unknowns (nx,) at a value of the driver after proved steps, or None."""
        n, way = self.graphs.nx, u - begun.s
        if not way:
            return begun.state[:n]
        count = int(np.ceil(abs(way) * NODES_PER_TURN / (2 * np.pi * begun.unit)))
        if count > MOST_STEPS:
            return None
        state, s = begun.state, begun.s
        if count == 1:
            after, test, det, miss = self._one(state, np.array([s, way]), begun.whole)
            return after[:n] if self._proved(begun, after[:n], test, det, miss) else None
        ds = way / count
        places = s + ds * np.arange(count)
        for k in range(0, count, STRIDE):
            some = places[k : k + STRIDE]
            states, *tests = strides(self.graphs)(state, some, ds, begun.whole, len(some))
            if not self._proved(begun, states[:, :n], *tests):
                return None
            state = states[-1]
        return state[:n]

    def _proved(self, begun: Begun, x: Any, test: Any, det: Any, miss: Any) -> bool:
        """Return whether steps are proved for all blocks; what is not a number is not."""
        return bool(
            (test <= 1).all()
            and (miss <= 1).all()
            and (det * begun.sign > 0).all()
            and (np.abs(x) <= begun.size_x).all()
        )

    @np.errstate(invalid="ignore", over="ignore")
    def _solved(self, begun: Begun, guess: Any, u: float) -> OnePose | None:
        """Return the pose near unknowns that lie on the path, None where it is not certified."""
        kappa, place = begun.kappa, np.array([u])
        x, error, det, beta, eta, *y = self._pose(guess, place, begun.consts)
        slope = kappa * beta
        first = slope * np.sqrt(eta) <= H_LIMIT
        tiny = TINY * np.where(self._blocks, begun.length, 1.0)
        for _ in range(ROUNDS):
            again = (slope * eta > tiny) | (self._turning & (eta > CARRIED))
            if not again.any():
                break
            x, error, det, beta, eta, *y = self._pose(x, place, begun.consts)
            slope = kappa * beta
        good = slope * np.sqrt(eta) + slope * beta * begun.rho <= H_LIMIT
        good &= (first | self._tells) & (np.sign(det) == begun.sign)
        inside = np.abs(x) <= begun.size_x
        if not (good.all() and inside.all()):
            return None
        if (np.abs(x - guess) > HALF_TURN)[self._angles].any():
            return None
        y = in_time([part[None, :] for part in y], *self._rates)
        return OnePose(error[None, :], max(1.0, *(begun.mu * beta).tolist()), y)


def near_poses(problem: Problem, task: Sweep, names: tuple[str, ...]) -> NearPoses | None:
    """Return what gives poses of a mechanism with other values of some numbers, or None."""
    setting = prepare(problem, task)
    model = setting.scene.model
    plain = setting.graphs.single and task.mode is None and model.mechanism.dimension == 2
    if not plain or not setting.graphs.nx or not np.isfinite(setting.plan.sketch).all():
        return None
    numbers = NearNumbers(model, task, names)
    start = closed_start(setting.assembler) if numbers.usable else None
    return NearPoses(setting, start, numbers) if start is not None else None
