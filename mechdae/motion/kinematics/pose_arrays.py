"""Poses at values of the drivers as arrays, and a single one near a proved path."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import Protocol

import numpy as np

from mechdae.errors import InputError
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import Call
from mechdae.motion.continuation.beyond_ends import HALF_TURN
from mechdae.motion.continuation.evaluate import CARRIED, H_LIMIT, ROUNDS, TINY, Evaluator, Poses
from mechdae.motion.continuation.output_bounds import ILL, spread
from mechdae.motion.kinematics.prepared import Setting
from mechdae.motion.setup.outputs import Outputs
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Integers, Points, Texts, Unknowns


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


STATUSES = np.array(["unassembled", "limit", "ok", "stopped"])
"""What poses are that are not found, limit positions, proved, beyond the limits of a joint."""


class Moves(Protocol):
    """What moves a mechanism on from a pose."""

    def moved(
        self, state: PoseState, u: Floats, speed: Floats | None, acceleration: Floats | None
    ) -> PoseArrays:
        """Return the pose at drivers' values `u` (nd,)."""


@dataclass(frozen=True)
class PoseState:
    """A solved pose: values of the drivers (nd,), unknowns with rates, signs of the blocks.

    ``tracker`` moves the mechanism, with its numbers, on from there.
    """

    values: Floats
    state: Floats
    sign: Floats
    tracker: Moves


@dataclass(frozen=True)
class PoseArrays:
    """Poses at values of the drivers.

    Attributes
    ----------
    u : (n,) or (n, nd) array
        Values of the driver, or of several.
    ok : (n,) array of bool
        Poses that are proved in all groups.
    status : (n,) array of str
        ``ok``, ``limit`` at a limit position, ``unassembled`` where no proved motion leads to,
        ``stopped`` where a joint is beyond its limits.
    error : (n, nx) array
        Bounds of the unknowns' errors.
    condition : (n,) array
    node : PoseState or None
        Of a single pose of several drivers: where the next one begins.
    faults : dict
        Row -> which limit a joint is beyond, or why its numbers make no mechanism.
    """

    u: Floats
    ok: Booleans
    status: Texts
    error: Points
    condition: Floats
    _setting: Setting
    _y: list[Floats]
    _slopes: Callable[[], list[Floats]]
    node: PoseState | None = None
    faults: Mapping[int, str] = field(default_factory=dict)

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

    def jacobian(self, path: str) -> Floats:
        """Return the derivatives (n, k, nd) of a place or an angle by the drivers.

        Raises
        ------
        UnknownName
            Nothing of that path is computed.
        InputError
            A rate, or a task that computes none.
        """
        order, columns = self._setting.outputs.column_of(path)
        if order or (not self._setting.graphs.driven and not self._setting.graphs.single):
            raise InputError(f"{path} has no derivatives by the drivers here", where="path")
        return np.stack([slope[:, columns] for slope in self._slopes()], axis=2)


def of_poses(
    u: Floats,
    poses: Poses,
    setting: Setting,
    y: list[Floats],
    slopes: Callable[[], list[Floats]],
    node: PoseState | None = None,
) -> PoseArrays:
    """Return evaluated poses as arrays; `slopes` gives the outputs' derivatives by each driver."""
    alive = poses.alive.all(axis=1)
    ok = alive & ~poses.at_limit
    status = STATUSES[np.where(ok, 2, 1 * poses.at_limit)]
    condition = np.where(alive, poses.condition, np.nan)
    faults = _stopped(setting, poses.x, u, setting.assembler.p, ok, status)
    return PoseArrays(u, ok, status, poses.error, condition, setting, y, slopes, node, faults)


def of_certified(
    u: Floats,
    found: ProvedPoses,
    setting: Setting,
    y: list[Floats],
    slopes: Callable[[], list[Floats]],
    node: PoseState | None = None,
    p: Floats | None = None,
) -> PoseArrays:
    """Return the arrays of poses that are all certified, `p` are numbers not the setting's."""
    n = len(found.condition)
    ok, status = np.ones(n, bool), STATUSES[np.full(n, 2)]
    faults = _stopped(setting, found.x, u, setting.assembler.p if p is None else p, ok, status)
    return PoseArrays(u, ok, status, found.error, found.condition, setting, y, slopes, node, faults)


def _stopped(
    setting: Setting, x: Unknowns, u: Floats, p: Floats, ok: Booleans, status: Texts
) -> dict[int, str]:
    """Mark poses with a joint beyond its limits; return which limit, by row."""
    faults: dict[int, str] = {}
    for beyond in setting.scene.cases("stops"):
        faults = beyond(setting.scene, x, u.reshape(len(x), -1), p)
        ok[list(faults)], status[list(faults)] = False, STATUSES[3]
    return faults


def of_rows(
    u: Floats,
    parts: Sequence[tuple[Integers, PoseArrays]],
    setting: Setting,
    orders: int,
    faults: Mapping[int, str],
) -> PoseArrays:
    """Return the arrays (n, ...) of poses computed in parts; rows of no part are unassembled."""
    ok, status = np.zeros(len(u), bool), STATUSES[np.zeros(len(u), int)]

    def whole(read: Callable[[PoseArrays], Floats], *shape: int) -> Floats:
        result = np.full((len(u), *shape), np.nan)
        for rows, part in parts:
            result[rows] = read(part)
        return result

    graphs, width = setting.graphs, setting.outputs.expression.numel()
    for rows, part in parts:
        ok[rows], status[rows] = part.ok, part.status
        faults = {**faults, **{int(rows[k]): text for k, text in part.faults.items()}}
    y = [whole(lambda part, k=k: part._y[k], width) for k in range(orders)]  # type: ignore[misc]

    def slopes() -> list[Floats]:
        each = whole(lambda part: np.stack(part._slopes(), axis=1), graphs.nu, width)
        return [each[:, k] for k in range(graphs.nu)]

    error = whole(lambda part: part.error, graphs.nx)
    condition = whole(lambda part: part.condition)
    return PoseArrays(u, ok, status, error, condition, setting, y, slopes, faults=faults)


def floats(values: object, where: str) -> Floats:
    """Return what is given for numbers as an array."""
    try:
        return np.asarray(values, float)
    except (TypeError, ValueError):
        raise InputError(f"numbers are needed, not {values!r}", where=where) from None
