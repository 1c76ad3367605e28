"""Poses on a certified path: guesses, one Newton step each, certificates, bounds."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.additions import of_cases
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import MANY, Batch
from mechdae.motion.continuation.any_path import AnyPath
from mechdae.motion.continuation.beyond_ends import HALF_TURN, BeyondEnds
from mechdae.motion.continuation.output_bounds import WORST, bounded, spread, widened
from mechdae.motion.setup.outputs import Outputs
from mechdae.motion.setup.scales import Constants
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Integers, Sym, Unknowns

if TYPE_CHECKING:
    from mechdae.motion.cases.hard_steps.crossings.near_change_point import ZonePoses
    from mechdae.motion.cases.superfluous.closing import Closing
    from mechdae.motion.continuation.limit_positions import Limit

H_LIMIT = 0.2
"""Largest Newton-Kantorovich number of a certified pose."""
ROUNDS = 8
ATTEMPTS = 6
TINY = 1e-17
"""Left-over distance to the solution below which no further Newton step is taken [rad]."""
CARRIED = 1e-11
"""Square of the last step of angles above which another one is taken: the kernel carries their
sines and cosines along to second order in it."""
Rates = tuple[Any, ...]
"""Rates of several drivers in time, (n, nd) arrays."""
Driver = tuple[Any, Any, Any]
"""Speed, acceleration and jerk of the one driver that moves."""


@dataclass
class Poses:
    """Evaluated poses; columns of unknowns or outputs of lost groups are nan.

    ``alive`` (n, groups) tells which groups have a pose, ``at_limit`` (n,) which poses are
    limit positions, ``uncertain`` that a certificate failed, ``singular`` that a group's
    path stops at the pose for another reason than a limit; ``y`` holds outputs and their
    rates with respect to time. ``places`` (n,) are where the poses lie on the path: at ``s``, or
    whole turns of the driver away where it gets there the other way round. ``bounds`` gives the
    largest bounds of what is reported, ``length`` [m] and ``angle`` [rad], when it is called;
    ``fine`` tells that all poses are certified and none is a limit.
    """

    s: Floats
    places: Floats
    x: Any
    alive: Any
    at_limit: Any
    uncertain: Any
    singular: Booleans
    error: Any
    condition: Floats
    y: list[Any]
    bounds: Callable[[], dict[str, Floats]] = dict
    fine: bool = False


def _poses_of(graphs: Graphs) -> Batch:
    """Return the pose kernel for many poses; the numbers are shared."""
    return Batch(graphs.pose, [graphs.pose.n_in() - 1], straight=lambda: graphs.straight_pose)


class Evaluator(BeyondEnds):
    """Evaluates poses of one scene.

    With one driver the rates are with respect to it (see `in_time`); several drivers need
    their own rates in time, and the rates are with respect to time.
    """

    def __init__(self, graphs: Graphs, outputs: Outputs) -> None:
        self.graphs: Graphs = graphs
        self.outputs: Outputs = outputs
        self.pose: Batch = graphs.cache("poses", lambda: _poses_of(graphs)).counting()
        self.groups: list[int] = [group.index for group in graphs.scene.groups]
        self.place: dict[int, int] = {index: j for j, index in enumerate(self.groups)}
        self.column_group: Integers = np.zeros(graphs.nx, int)
        for graph in graphs.blocks:
            self.column_group[graph.own] = self.place[graph.block.group]
        self.block_group: Integers = np.array(
            [self.place[graph.block.group] for graph in graphs.blocks], int
        )
        unknowns = graphs.scene.unknowns
        self.angles: Booleans = unknowns.turns
        self.lengths: Booleans = np.array(
            [unknowns.lengths[g.own].all() for g in graphs.blocks], bool
        )
        self.turning: Booleans = np.array(
            [unknowns.turns[g.own].any() for g in graphs.blocks], bool
        )
        dyads = {group.index for group in graphs.scene.groups if group.is_dyad}
        self.sign_tells: Booleans = np.array([g.block.group in dyads for g in graphs.blocks], bool)
        self.closing: Closing | None = None
        """Redundant equations, where there are any."""
        for make in graphs.scene.cases("closing"):
            self.closing = make(graphs)
        self.refined: int = 0

    @cached_property
    def zones(self) -> ZonePoses:
        """What writes poses near change points."""
        (make,) = of_cases("poses near change points")
        found: ZonePoses = make(self.graphs)
        return found

    def at(self, path: AnyPath, s: object, rates: Rates = ()) -> Poses:
        """Return the poses at path parameters `s` (n,).

        `rates` are speeds, accelerations and jerks (n, nd) of several drivers or of a course,
        zero where they are left out; without any, the drivers' derivatives with respect to s.
        """
        s = np.asarray(s, float)
        rates = self.all_rates(path, s, rates)
        alive = path.follows(s)
        ends = path.ends
        places, limits = s, self.limits(path, s) if ends else {}
        if not alive.all() and path.graphs.turns:
            places, limits = self.turn_round(path, s, alive, limits)
        guess = path.guess(places) if self.graphs.nx else np.zeros((len(s), 0))
        stops = self.stops(path, places) if ends else np.zeros(len(s), bool)
        poses = self._solve(path, s, places, guess, alive, limits, rates)
        poses.singular = stops & ~poses.alive.all(axis=1)
        return poses

    def all_rates(self, path: AnyPath, s: Floats, rates: Rates) -> Rates:
        """Return as many rates as the kernel needs, zero where they are left out."""
        count, nothing = len(self.graphs.driven), np.zeros((len(s), self.graphs.nu))
        return tuple([*(rates or path.rates(s, count)), *[nothing] * count][:count])

    def tiny(self, constants: Constants) -> Floats:
        """Return the left-over distance to the solution that is no more than rounding, (nb,)."""
        return TINY * np.where(self.lengths, constants.scale, 1.0)

    def _solve(
        self,
        path: AnyPath,
        s: Floats,
        places: Floats,
        guess: Unknowns,
        alive: Booleans,
        limits: dict[int, list[Limit]],
        rates: Rates,
    ) -> Poses:
        constants = path.constants
        results, first = self._converged(path, guess, s, places, rates)
        ordinary = np.ones(len(s), bool)
        ordinary[list(limits)] = False
        live = alive[:, self.block_group]
        for _ in range(ATTEMPTS):
            good = self._good(path, guess, results, first, places)
            rows = np.flatnonzero((live & ~good).any(axis=1) & ordinary)
            if not rows.size or not path.insert(places[rows]):
                break
            guess[rows] = path.guess(places[rows])
            part, first[rows] = self._converged(
                path, guess[rows], s[rows], places[rows], _rows(rates, rows)
            )
            for whole, new in zip(results, part, strict=True):
                whole[rows] = new
        uncertain = live & ~good & ordinary[:, None]
        self._drop(alive, uncertain, self._open(path, s, results))
        at_limit = ~ordinary
        for k, found in limits.items():
            self.put_limit(path, k, s[k], found, alive, results)
        return self._poses(s, places, results, alive, at_limit, uncertain, constants)

    def _converged(
        self, path: AnyPath, guess: Unknowns, s: Floats, places: Floats, rates: Rates
    ) -> tuple[list[Floats], Booleans]:
        """Return the pose kernel's results after as many steps as needed.

        `places` are those of the path on which the guesses were made. The second value tells
        which blocks were certified from the guess itself.
        """
        constants = path.constants
        consts = constants.consts
        results = self._call(path, guess, s, rates, consts)
        with np.errstate(invalid="ignore", over="ignore"):
            first = constants.kappa * results[3] * np.sqrt(results[4]) <= H_LIMIT
        tiny = self.tiny(constants)
        for _ in range(ROUNDS):
            with np.errstate(invalid="ignore", over="ignore"):
                left = constants.kappa * results[3] * results[4]
                wide = (results[4] > CARRIED) & self.turning
            again = np.flatnonzero(((left > tiny) | wide).any(axis=1))
            if not again.size:
                break
            self.refined += len(again)
            part = self._call(path, results[0][again], s[again], _rows(rates, again), consts)
            for whole, new in zip(results, part, strict=True):
                whole[again] = new
        if constants.mu.size:
            results[1] = widened(results[1], spread(self.graphs, constants, *results[2:4]))
        if path.zones:
            self.zones.write(
                path,
                s,
                places,
                guess,
                results,
                rates,
                lambda x, at, r: self._call(path, x, at, r, consts),
            )
        return results, first

    def _good(
        self, path: AnyPath, guess: Unknowns, results: list[Floats], first: Booleans, places: Floats
    ) -> Any:
        """Return which blocks are certified to be on the path's branch, (n, nb).

        Newton-Kantorovich from the guess, which lies in the proved neighbourhood of the path;
        in a dyad the sign of the determinant alone tells the two branches apart.
        """
        with np.errstate(invalid="ignore", over="ignore"):
            h = path.constants.kappa * results[3] * np.sqrt(results[4])
            rounding = path.constants.kappa * results[3] ** 2 * path.constants.rho
        good = (h + rounding <= H_LIMIT) & (first | self.sign_tells)
        if path.sign is not None:
            good &= np.sign(results[2]) == path.sign_at(places)
        with np.errstate(invalid="ignore"):
            far = (np.abs(results[0] - guess) > HALF_TURN) & self.angles
            far |= ~(np.abs(results[0]) <= path.constants.size_x)
        if good.shape[1]:
            good &= ~(spread(self.graphs, path.constants, results[2], results[3]) > WORST)
            good &= ~np.logical_or.reduceat(far.T, self.graphs.first, axis=0).T
        return good | self.zones.held(path, places) if path.zones else good

    def _open(self, path: AnyPath, s: Floats, results: list[Floats]) -> Booleans:
        """Return which groups have an equation without unknowns that is not met, (n, groups)."""
        lost = np.zeros((len(s), len(self.groups)), bool)
        if self.closing is not None and self.closing.checks:
            open_ = self.closing.open(results[0], path.drivers(s), results[1], path.constants)
            for k, j in enumerate(self.closing.check_group):
                lost[:, j] |= open_[:, k]
        return lost

    def _drop(self, alive: Booleans, uncertain: Booleans, lost: Booleans) -> None:
        """Take away groups with an uncertified block, and the groups attached to them.

        `lost` (n, groups) are groups to be taken away for another reason.
        """
        if not uncertain.any() and alive.all() and not lost.any():
            return
        for b, j in enumerate(self.block_group):
            lost[:, j] |= uncertain[:, b]
        self.carry(lost, alive)

    def _call(
        self, path: AnyPath, guess: Unknowns, s: Floats, rates: Rates, consts: Floats
    ) -> list[Floats]:
        if self.graphs.single:
            return self.pose(guess, s[:, None], consts)
        return self.pose(guess, path.drivers(s), *rates, consts)

    def _poses(
        self,
        s: Floats,
        places: Floats,
        results: list[Floats],
        alive: Booleans,
        at_limit: Booleans,
        uncertain: Booleans,
        constants: Constants,
    ) -> Poses:
        x, error, beta = results[0], results[1], results[3]
        y = list(results[5:])
        x[~alive[:, self.column_group]] = np.nan
        error[~alive[:, self.column_group]] = np.nan
        for entry, groups in () if alive.all() else self.entry_groups:
            dead = ~alive[:, groups].all(axis=1)
            if dead.any():
                for array in y:
                    array[np.ix_(np.flatnonzero(dead), np.array(entry.columns))] = np.nan
        with np.errstate(invalid="ignore"):
            each = np.where(alive[:, self.block_group], constants.mu * beta, np.nan)
        condition = np.fmax.reduce(each, axis=1, initial=1.0) if each.shape[1] else np.ones(len(s))
        nowhere = np.zeros(len(s), bool)
        lost = uncertain.any(axis=1)
        return Poses(s, places, x, alive, at_limit, lost, nowhere, error, condition, y)


def _rows(rates: Rates, rows: Integers) -> Rates:
    return tuple(rate[rows] for rate in rates)


def in_time(
    values: list[Sym], speed: Sym, acceleration: Sym, jerk: Floats | float = 0.0
) -> list[Sym]:
    """Return y and its rates in time from its derivatives with respect to a single driver.

    `speed`, `acceleration` and `jerk` of the driver are numbers or (n, 1) arrays.
    """
    rates = list(values)
    if len(values) > 3:
        cubic = values[3] * (speed * speed * speed)
        rates[3] = cubic + 3 * values[2] * (speed * acceleration) + values[1] * jerk
    if len(values) > 2:
        rates[2] = values[2] * (speed * speed) + values[1] * acceleration
    if len(values) > 1:
        rates[1] = values[1] * speed + 0.0
    return rates


def swept(
    evaluator: Evaluator,
    path: AnyPath,
    s: Floats,
    rates: Rates = (),
    driver: Driver | None = None,
    plain: bool = False,
) -> Poses:
    """Return the poses at `s` (n,) with their `bounds`, see `Evaluator.at`.

    Parameters
    ----------
    driver
        With them derivatives by the driver become rates in time.
    plain
        Whether y has to be arrays, each column for itself.
    """
    timed = None if driver is None else [float(np.ravel(part)[0]) for part in driver]
    for evaluate in of_cases("poses") if len(s) >= MANY and not plain else ():
        found: Poses | None = evaluate(evaluator, path, s, rates, timed)
        if found is not None:
            return found
    poses = evaluator.at(path, s, rates)
    numbers = (evaluator.graphs, evaluator.outputs, path.constants)
    poses.bounds = partial(bounded, *numbers, poses.error)
    if timed is not None:
        poses.y = in_time(poses.y, *timed)
    return poses
