"""One pose near unknowns that lie on a proved path, by a handful of kernel calls."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import Call
from mechdae.motion.continuation.beyond_ends import HALF_TURN
from mechdae.motion.continuation.evaluate import CARRIED, H_LIMIT, ROUNDS, TINY, Evaluator
from mechdae.motion.continuation.output_bounds import ILL, spread
from mechdae.motion.setup.outputs import Outputs
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Unknowns


class PoseNumbers(Protocol):
    """What poses are certified with: see `Constants`; ``consts`` are those of the kernel."""

    @property
    def kappa(self) -> Floats: ...

    @property
    def rho(self) -> Floats: ...

    @property
    def mu(self) -> Floats: ...

    @property
    def size_x(self) -> Floats: ...

    @property
    def p(self) -> Floats: ...

    @property
    def scale(self) -> float: ...

    @property
    def consts(self) -> Floats: ...


@dataclass(frozen=True)
class ProvedPoses:
    """Certified poses: unknowns and their bounds (n, nx), conditions (n,), outputs by order."""

    x: Unknowns
    error: Floats
    condition: Floats
    y: list[Floats]


class OnePose:
    """The kernel of one pose of a scene, and what a pose that it gives must pass."""

    def __init__(self, graphs: Graphs, outputs: Outputs) -> None:
        self.graphs, self.evaluator = graphs, Evaluator(graphs, outputs)
        self._tells, self._turning = self.evaluator.sign_tells, self.evaluator.turning
        self._blocks, self._angles = self.evaluator.lengths, self.evaluator.angles
        self._any_angle = bool(self._angles.any())
        self._pose: Call = graphs.cache("pose", lambda: Call(graphs.pose))

    @np.errstate(invalid="ignore", over="ignore")
    def solved(
        self, numbers: PoseNumbers, sign: Floats, guess: Unknowns, *place: Floats
    ) -> ProvedPoses | None:
        """Return the pose near unknowns (nx,), None where it is not certified.

        `place` are the driver's value, or the values of several and their rates; `sign` (nb,) those
        of the blocks' determinants.
        """
        kappa = numbers.kappa
        x, error, det, beta, eta, *y = self._pose(guess, *place, numbers.consts)
        slope = kappa * beta
        first = slope * np.sqrt(eta) <= H_LIMIT
        for _ in range(ROUNDS):
            if not self.again(numbers, slope * eta, eta).any():
                break
            x, error, det, beta, eta, *y = self._pose(x, *place, numbers.consts)
            slope = kappa * beta
        if not self.certified(numbers, sign, guess, x, det, beta, eta, first):
            return None
        condition = np.array([max([1.0, *(numbers.mu * beta).tolist()])])
        return ProvedPoses(x[None, :], error[None, :], condition, [part[None, :] for part in y])

    def again(self, numbers: PoseNumbers, left: Floats, eta: Floats) -> Booleans:
        """Return for which blocks another step of Newton's method brings something."""
        tiny = TINY * np.where(self._blocks, numbers.scale, 1.0)
        return (left > tiny) | (self._turning & (eta > CARRIED))

    def certified(
        self,
        numbers: PoseNumbers,
        sign: Floats,
        guess: Unknowns,
        x: Unknowns,
        det: Floats,
        beta: Floats,
        eta: Floats,
        first: Booleans,
    ) -> bool:
        """Return whether all blocks of all poses are certified to be on the path's branch."""
        slope = numbers.kappa * beta
        good = slope * np.sqrt(eta) + slope * beta * numbers.rho <= H_LIMIT
        good &= (first | self._tells) & (np.sign(det) == sign)
        inside = np.abs(x) <= numbers.size_x
        near = np.abs(x - guess) <= HALF_TURN
        if not (spread(self.graphs, numbers, *map(np.atleast_2d, (det, beta))) <= ILL).all():
            return False
        return bool(good.all() and inside.all() and near[..., self._angles].all())
