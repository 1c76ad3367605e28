"""Poses of sets of numbers near those of a mechanism, each set by a handful of kernel calls.

The mode nearest to the sketch is known in closed form; from there proved steps lead to the pose,
which is certified like every other. What is not proved so is left to a path.

Only where these numbers change nothing but the values of parameters: not its structure, its sketch
or its drivers. Everything else is left to `Problem.with_values`, and so is every refusal.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from mechdae.describe.expression import evaluate, names_in
from mechdae.describe.file.problem import Problem
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.describe.tasks.kinds import Sweep
from mechdae.describe.values import Number
from mechdae.equations.model import Model
from mechdae.errors import MechdaeError
from mechdae.kernels.bounds.walk import ROUNDOFF
from mechdae.kernels.graphs.steps import STRIDE
from mechdae.kernels.run.functions import Call
from mechdae.motion.assembly.closed_start import ClosedStart, closed_start
from mechdae.motion.continuation.evaluate import H_LIMIT, ROUNDS, in_time
from mechdae.motion.continuation.interpolate import quintic
from mechdae.motion.continuation.step_sizes import NODES_PER_TURN
from mechdae.motion.kinematics.pose_arrays import OnePose, PoseArrays, ProvedPoses, of_certified
from mechdae.motion.kinematics.prepared import Setting, prepare
from mechdae.records import dataclass
from mechdae.types import Floats, Points, Unknowns


class NearNumbers:
    """What some numbers of a mechanism change.

    Parameters
    ----------
    model
        Symbols of the mechanism, which is planar.
    task
        Its drivers.
    names
        The numbers that change.

    Attributes
    ----------
    usable : bool
        Whether they change values of parameters only.
    """

    def __init__(self, model: Model, task: Sweep, names: Iterable[str]) -> None:
        mechanism = self.mechanism = model.mechanism
        self.names, self._base = tuple(names), dict(mechanism.parameter_values)
        self._numbers = dict(mechanism.numbers())
        self._changed = set(self.names)
        self._parameters = self._expressions(mechanism)
        self._expressed = [
            (name, number)
            for name, number in self._numbers.items()
            if isinstance(number, str) and names_in(number) & self._changed
        ]
        self._changed |= {name for name, _ in self._expressed}
        self._p, places = model.p_values, {name: i for i, name in enumerate(model.p_names)}
        self._places = [(name, places[name]) for name in self._changed if name in places]
        joints = mechanism.joints.values()
        self._joints = [(joint, touched) for joint in joints if (touched := self._touched(joint))]
        self._links = [
            pins for name in mechanism.bodies for pins in self._pins(mechanism, name) if pins
        ]
        self.usable: bool = all(name in places for name in self.names) and self._alone(
            mechanism, task
        )

    def _expressions(self, mechanism: Mechanism) -> list[tuple[str, str]]:
        """Return parameters that are expressions of what changes, each after those it needs."""
        found: list[tuple[str, str]] = []
        left = {n: text for n, text in mechanism.parameters.items() if isinstance(text, str)}
        while True:
            ready = [n for n, text in left.items() if names_in(text) & self._changed]
            ready = [n for n in ready if not names_in(left[n]) & (left.keys() - {n})] or ready
            if not ready:
                return found
            found.append((ready[0], str(left.pop(ready[0]))))
            self._changed.add(ready[0])

    def _touched(self, joint: Joint) -> dict[str, str]:
        """Return the numbers of a joint by their entries, none where no one changes."""
        names = {entry: f"{joint.name}.{entry}" for entry, _ in joint.numbers()}
        return names if self._changed.intersection(names.values()) else {}

    def _pins(self, mechanism: Mechanism, body: str) -> list[tuple[list[str], list[str]]]:
        """Return the coordinates of pairs of pins of a body that change."""
        hinges = [joint for joint in mechanism.joints.values() if joint.hinge]
        sides = {side for joint in hinges for side in (joint.first, joint.second)}
        references = sorted(side for side in sides if side.split(".")[0] == body != GROUND)
        places = [[f"{pin}.{axis}" for axis in mechanism.axes] for pin in references]
        return [
            (first, second)
            for k, first in enumerate(places)
            for second in places[:k]
            if self._changed.intersection((*first, *second))
        ]

    def _alone(self, mechanism: Mechanism, task: Sweep) -> bool:
        """Return whether nothing changes but the values of parameters."""
        literal = {**mechanism.parameters, **self._numbers}
        if any(isinstance(literal[n], str) or n.startswith("loads.") for n in self.names):
            return False
        if any(joint.meshes or joint.on_curve for joint, _ in self._joints):
            return False
        if any(name.split(".")[1] in ("mass", "inertia") for name, _ in self._expressed):
            return False
        numbers: list[Any] = [*mechanism.sketch.values()]
        for driver in task.all_drivers:
            numbers += [driver.from_, driver.to, *(driver.at or ())]
            numbers += [driver.speed, driver.acceleration, driver.jerk]
        return not any(
            isinstance(number, str) and names_in(number) & self._changed for number in numbers
        )

    def __call__(self, numbers: Mapping[str, Number]) -> Any:
        """Return the parameters (np,), None where they are another structure's or no mechanism's.

        `numbers` are those of `names`, in SI units.
        """
        known, values = dict(self._base), self._values(numbers)
        if values is None:
            return None
        try:
            known.update((n, v) for n, v in values.items() if n in known)
            for name, text in self._parameters:
                known[name] = values[name] = evaluate(text, known)
            for name, text in self._expressed:
                values[name] = evaluate(text, known)
            base = self.mechanism.values() if self._joints or self._links else {}
            every = base | values
            for joint, touched in self._joints:
                joint.check({entry: every[name] for entry, name in touched.items()})
        except MechdaeError:
            return None
        for first, second in self._links:
            if all(every[a] == every[b] for a, b in zip(first, second, strict=True)):
                return None
        p = self._p.copy()
        for name, place in self._places:
            p[place] = values[name]
        return p

    def _values(self, numbers: Mapping[str, Number]) -> dict[str, float] | None:
        """Return the numbers as floats, None where one is none, or is zero or of another sign."""
        values: dict[str, float] = {}
        for name in self.names:
            number = numbers[name]
            if type(number) is not float and not isinstance(number, (float, int, np.number)):
                return None
            value = values[name] = float(number)
            if not math.isfinite(value) or (name in self._numbers and not self._like(name, value)):
                return None
        return values

    def _like(self, name: str, value: float) -> bool:
        """Return whether a number has the sign that it has in the mechanism."""
        number = self._numbers[name]
        return not isinstance(number, str) and number * value > 0


STILL = 1e-9
"""Largest step of Newton's method from a closed form that is one but for rounding."""
MOST_STEPS = 2 * NODES_PER_TURN
"""Steps to a single pose, at most."""
SMALLEST = 1 / 32
"""Share of the largest step below which a path is left to find out what lies ahead."""
MOST_NODES = 16 * NODES_PER_TURN
"""Steps each way to several poses, at most."""


@dataclass(frozen=True)
class StartState:
    """A set of numbers at its start: where steps begin, and what bounds are proved for.

    ``whole`` are the numbers of a step, ``consts`` those of a pose, ``reach`` the largest value
    of the driver and ``size_x`` (nx,) the largest unknowns that they hold for. ``unit`` is that of
    the driver's value: 1 rad or the mechanism's ``scale``.
    """

    numbers: dict[str, Number]
    s: float
    state: Floats
    sign: Floats
    whole: Floats
    consts: Floats
    kappa: Floats
    rho: Floats
    mu: Floats
    size_x: Floats
    reach: float
    unit: float
    scale: float
    p: Floats


class NearPoses:
    """Poses of a sweep of one driver whose mechanism has other values of some numbers.

    Attributes
    ----------
    setting : Setting
        That of the mechanism itself; names of outputs are those of all.
    """

    def __init__(self, setting: Setting, start: ClosedStart, numbers: NearNumbers) -> None:
        self.setting, self._start, self._numbers = setting, start, numbers
        graphs = self.graphs = setting.graphs
        self.names: tuple[str, ...] = numbers.names
        self._one_pose = OnePose(graphs, setting.outputs)
        self._one: Call = graphs.cache("step", lambda: Call(graphs.advance))
        self._poses = self._one_pose.evaluator.pose
        self._bounds: Call = graphs.cache("constants", lambda: Call(graphs.constants))
        plan, self._s = setting.plan, np.array([setting.plan.sketch[0]])
        self._is_angle = plan.coordinates[0].is_angle
        self._lengths = np.where(graphs.scene.unknowns.turns, 0.0, 1.0)
        self._rates = [float(rate[0, 0]) for rate in (plan.speed, plan.acceleration, plan.jerk)]
        self._begun: StartState | None = None

    def at(self, numbers: Mapping[str, Number], places: Any) -> PoseArrays | None:
        """Return the poses at driver's values `places` (n,), None where one is not proved so.

        `numbers` are those of `names`, in SI units.
        """
        one = len(places) == 1
        far = abs(float(places[0])) if one else float(np.abs(places).max())
        begun = self._begun
        if begun is None or begun.numbers != numbers or far > begun.reach:
            begun = self._begin(dict(numbers), far)
            if begun is None:
                return None
            self._begun = begun
        if one:
            u = float(places[0])
            x = self._stepped(begun, u)
            found = x
            if x is not None:
                found = self._one_pose.solved(begun, begun.sign, x, np.array([u]))
        else:
            found = self._several(begun, places)
        if found is None:
            return None
        y = in_time(found.y, *self._rates)
        return of_certified(places, found, self.setting, y, lambda: found.y[1:2], p=begun.p)

    def _begin(self, numbers: dict[str, Number], u: float) -> StartState | None:
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
        return StartState(
            numbers, s, state, signs, whole, consts, kappa, rho, mu, size_x, reach, size, scale, p
        )

    def _stepped(self, begun: StartState, u: float) -> Any:
        """Return unknowns (nx,) at a value of the driver after proved steps, or None."""
        n, way = self.graphs.nx, u - begun.s
        if not way:
            return begun.state[:n]
        if abs(way) <= self._largest(begun):
            after, *tests = self._one(begun.state, np.array([begun.s, way]), begun.whole)
            return after[:n] if self._proved(begun, after[None, :n], *tests).all() else None
        nodes = self._nodes(begun, u, MOST_STEPS)
        return None if nodes is None else nodes[1][-1][-1, :n]

    @staticmethod
    def _largest(begun: StartState) -> float:
        """Return the largest step, in the driver's unit."""
        return 2 * np.pi / NODES_PER_TURN * begun.unit

    def _nodes(
        self, begun: StartState, to: float, most: int
    ) -> tuple[list[Floats], list[Floats]] | None:
        """Return places and states (., k) of proved steps from the start; None: not proved.

        Steps that are not proved are halved.
        """
        s, state, n = begun.s, begun.state, self.graphs.nx
        sense, largest = np.sign(to - s), self._largest(begun)
        step, places, found = largest, [], []
        while (rest := abs(to - s)) > 0:
            left = math.ceil(rest / step)
            count = min(left, STRIDE, most)
            if not count:
                return None
            ds = sense * min(step, rest / left)
            some = s + ds * np.arange(count + 1)
            if count == left:
                some[-1] = to
            states, *tests = self.graphs.strides(
                state, some[:-1], np.diff(some), begun.whole, count
            )
            good = count
            if not self._all_proved(begun, states[:, :n], *tests):
                held = self._proved(begun, states[:, :n], *tests)
                good = count if held.all() else int(np.argmin(held))
            most -= count
            if good:
                places.append(some[1 : good + 1])
                found.append(states[:good])
                s, state = float(some[good]), states[good - 1]
            step = min(2 * step, largest) if good == count else step / 2
            if step < SMALLEST * largest:
                return None
        return places, found

    def _several(self, begun: StartState, places: Floats) -> ProvedPoses | None:
        """Return poses at several places, None where one is not proved."""
        nodes = self._all_nodes(begun, places)
        if nodes is None:
            return None
        alone = len(nodes[0]) == 1
        guess = np.repeat(nodes[1], len(places), axis=0) if alone else quintic(*nodes, places)
        return self._all_solved(begun, guess, places)

    def _all_nodes(
        self, begun: StartState, places: Floats
    ) -> tuple[Floats, Points, Points, Points] | None:
        """Return s (m,), x, x', x'' (m, nx) of proved steps over all places, or None."""
        low = self._nodes(begun, min(float(places.min()), begun.s), MOST_NODES)
        high = low and self._nodes(begun, max(float(places.max()), begun.s), MOST_NODES)
        if not low or not high:
            return None
        n = self.graphs.nx
        S = [*(steps[::-1] for steps in low[0][::-1]), np.array([begun.s]), *high[0]]
        states = [*(steps[::-1] for steps in low[1][::-1]), begun.state[None, :], *high[1]]
        whole = np.concatenate(states)
        X, V, A = (whole[:, k * n : (k + 1) * n] for k in range(3))
        return np.concatenate(S), X, V, A

    def _all_proved(
        self, begun: StartState, x: Unknowns, test: Floats, det: Floats, miss: Floats
    ) -> bool:
        """Return whether all steps are plainly proved, told by the largest of all alone."""
        largest = np.maximum.reduce
        if not (largest(test, axis=None) <= 1 and largest(miss, axis=None) <= 1):
            return False
        ahead = np.minimum.reduce(det * begun.sign, axis=None) > 0
        return bool(ahead and largest(np.abs(x) - begun.size_x, axis=None) <= 0)

    def _proved(
        self, begun: StartState, x: Unknowns, test: Floats, det: Floats, miss: Floats
    ) -> Any:
        """Return which steps (k,) are proved for all blocks; what is not a number is not."""
        blocks = (test <= 1) & (miss <= 1) & (det * begun.sign > 0)
        return np.atleast_2d(blocks).all(axis=1) & (np.abs(x) <= begun.size_x).all(axis=1)

    @np.errstate(invalid="ignore", over="ignore")
    def _all_solved(self, begun: StartState, guess: Points, places: Floats) -> ProvedPoses | None:
        """Return the poses near unknowns (n, nx) on the path, None where one is not certified."""
        kappa, u = begun.kappa, places[:, None]
        results = self._poses(guess, u, begun.consts)
        first = kappa * results[3] * np.sqrt(results[4]) <= H_LIMIT
        for _ in range(ROUNDS):
            eta = results[4]
            rows = np.flatnonzero(
                self._one_pose.again(begun, kappa * results[3] * eta, eta).any(axis=1)
            )
            if not rows.size:
                break
            part = self._poses(results[0][rows], u[rows], begun.consts)
            for whole, new in zip(results, part, strict=True):
                whole[rows] = new
        x, error, det, beta, eta, *y = results
        if not self._one_pose.certified(begun, begun.sign, guess, x, det, beta, eta, first):
            return None
        condition = (begun.mu * beta).max(axis=1, initial=1.0)
        return ProvedPoses(x, error, condition, y)


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
