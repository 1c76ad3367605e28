"""Poses on a certified path: guesses, one Newton step each, certificates, bounds."""

from __future__ import annotations

from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.batch import Batch
from mechdae.motion.assembly.closure import Closing
from mechdae.motion.continuation.any_path import AnyPath
from mechdae.motion.continuation.output_bounds import WORST, spread, widened
from mechdae.motion.continuation.path_end import SMALLEST
from mechdae.motion.continuation.reachable_arc import Arc, arc_of
from mechdae.motion.setup.outputs import Outputs, ReportedQuantity
from mechdae.motion.setup.scales import Constants
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Graph, Integers, Sym, Unknowns

if TYPE_CHECKING:
    from mechdae.motion.continuation.crossings.near_change_point import ZonePoses
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
HALF_TURN = 1.5
FAR_OFF = 1e3
"""Largest steps of which the last bits may be counted where the drivers hardly move."""
RETURN = 1e-7
"""Share of a radian or of the mechanism's length within which two poses are the same one."""
APART = 1e-3
"""Share above which they are not the same one, however badly they are known."""
TURN = 2 * np.pi
MOST_TURNS = 64
"""Whole turns of an arc on which a pose is looked for."""
HARDLY = 1e-9
"""Turns by which a place may miss the arc and be tried."""
INWARDS = 1e-3
"""Share of the arc before a limit at which groups are compared whole turns away: at the limit
itself no group is solved for."""
Rates = tuple[Any, ...]
"""Rates of several drivers in time, (n, nd) arrays."""


@dataclass
class Poses:
    """Evaluated poses; columns of unknowns or outputs of lost groups are nan.

    ``alive`` (n, groups) tells which groups have a pose, ``at_limit`` (n,) which poses are
    limit positions, ``uncertain`` that a certificate failed, ``singular`` that a group's
    path stops at the pose for another reason than a limit; ``y`` holds outputs and their
    rates with respect to time. ``places`` (n,) are where the poses lie on the path: at ``s``, or
    whole turns of the driver away where it gets there the other way round. ``bounds`` has the
    largest bounds of what is reported, ``length`` [m] and ``angle`` [rad], where those are wanted;
    ``fine`` tells that all poses are certified and none is a limit.
    """

    s: Any
    places: Any
    x: Any
    alive: Any
    at_limit: Any
    uncertain: Any
    singular: Booleans
    error: Any
    condition: Floats
    y: list[Any]
    bounds: dict[str, Floats] = field(default_factory=dict)
    fine: bool = False


def _poses_of(graphs: Graphs) -> Batch:
    """Return the pose kernel for many poses; the numbers are shared."""
    return Batch(graphs.pose, [graphs.pose.n_in() - 1], straight=lambda: graphs.straight_pose)


class Evaluator:
    """Evaluates poses of one scene.

    With one driver the rates are with respect to it (see `in_time`); several drivers need
    their own rates in time, and the rates are with respect to time.
    """

    def __init__(self, graphs: Graphs, outputs: Outputs) -> None:
        self.graphs, self.outputs = graphs, outputs
        self.pose: Batch = graphs.cache("poses", lambda: _poses_of(graphs)).counting()
        self.groups = [group.index for group in graphs.scene.groups]
        self.place = {index: j for j, index in enumerate(self.groups)}
        self.column_group = np.zeros(graphs.nx, int)
        for graph in graphs.blocks:
            self.column_group[graph.own] = self.place[graph.block.group]
        self.block_group = np.array([self.place[graph.block.group] for graph in graphs.blocks], int)
        unknowns = graphs.scene.unknowns
        self.angles = unknowns.turns
        self.lengths = np.array([unknowns.lengths[g.own].all() for g in graphs.blocks], bool)
        self.turning = np.array([unknowns.turns[g.own].any() for g in graphs.blocks], bool)
        dyads = {group.index for group in graphs.scene.groups if group.is_dyad}
        self.sign_tells = np.array([g.block.group in dyads for g in graphs.blocks], bool)
        self.closing = Closing(graphs)
        self.refined = 0

    @cached_property
    def zones(self) -> ZonePoses:
        """What writes poses near change points."""
        from mechdae.motion.continuation.crossings.near_change_point import ZonePoses

        return ZonePoses(self.graphs)

    @cached_property
    def entry_groups(self) -> list[tuple[ReportedQuantity, list[int]]]:
        """The reported quantities, each with the places of the groups it depends on."""
        outputs = self.outputs
        return [
            (entry, [self.groups.index(g) for g in outputs.groups_of(entry)])
            for entry in outputs.entries
        ]

    def at(self, path: AnyPath, s: Any, rates: Rates = ()) -> Poses:
        """Return the poses at path parameters `s` (n,).

        `rates` are speeds, accelerations and jerks (n, nd) of several drivers or of a course,
        zero where they are left out; without any, the drivers' derivatives with respect to s.
        """
        s = np.asarray(s, float)
        rates = self.all_rates(path, s, rates)
        alive = np.stack([path.follows(g, s) for g in self.groups], axis=1)
        places, limits = s, self._limits(path, s)
        if not alive.all() and path.graphs.turns:
            places, limits = self._turn_round(path, s, alive, limits)
        guess = path.guess(places) if self.graphs.nx else np.zeros((len(s), 0))
        stops = self._stops(path, places)
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

    @staticmethod
    def _stops(path: AnyPath, s: Floats) -> Booleans:
        """Return which poses are where a path stops at a change or dead point."""
        result = np.zeros(len(s), bool)
        for reach in path.reach.values():
            for end in (reach.low, reach.high):
                if end is not None and end.kind != "limit" and not end.regular:
                    near = abs(end.s - (end.s if end.reached is None else end.reached))
                    middle = end.s if end.reached is None else (end.s + end.reached) / 2
                    slack = 4 * SMALLEST * path.largest
                    result |= np.abs(s - middle) <= near / 2 + slack
        return result

    def _limits(self, path: AnyPath, s: Floats) -> dict[int, list[Limit]]:
        """Return the poses that are limit positions, with their limits."""
        found: dict[int, list[Limit]] = {}
        for reach in path.reach.values():
            for limit in (reach.low, reach.high):
                if limit is None or limit.kind != "limit":
                    continue
                tolerance = 8 * np.finfo(float).eps * self.coarse(path, limit.s)
                for k in np.flatnonzero(np.abs(s - limit.s) <= tolerance):
                    if limit not in found.setdefault(int(k), []):
                        found[int(k)].append(limit)
        return found

    @staticmethod
    def coarse(path: AnyPath, s: float) -> float:
        """Return what the last bits of a place are a share of: its own, or the drivers' values."""
        u, rate, *_ = path.motion(s)
        moving = rate != 0
        known = min(np.abs(u[moving] / rate[moving]).max(initial=0.0), FAR_OFF * path.largest)
        return max(abs(s), path.largest, float(known))

    def _turn_round(
        self, path: AnyPath, s: Floats, alive: Booleans, limits: dict[int, list[Limit]]
    ) -> tuple[Floats, dict[int, list[Limit]]]:
        """Return where the poses lie on the path, and which of them are limit positions.

        What the driver does not reach directly it may reach by moving the other way round: a
        whole turn away it is at the same value. All groups must be on that one way, and be back
        after the turn; `alive` is changed to the groups that are.
        """
        arc = arc_of(path)
        if not arc.turns_back:
            return s, limits
        direct = alive.all(axis=1) | (arc.met(s) != 0)
        rows = np.flatnonzero(~direct)
        if not rows.size:
            return s, limits
        places, found = s.copy(), np.zeros(len(s), bool)
        way = np.where(s[rows] > arc.last, -1.0, 1.0)
        nearest = np.where(way < 0, arc.last - s[rows], arc.first - s[rows]) / TURN
        turns = way * np.ceil(np.abs(nearest) - HARDLY)
        for _ in range(int(min((arc.last - arc.first) / TURN, MOST_TURNS)) + 1):
            there = arc.snapped(s[rows] + TURN * turns)
            limit = arc.met(there) != 0
            inside = limit | np.all([path.follows(group, there) for group in self.groups], axis=0)
            mine, there, limit = rows[inside], there[inside], limit[inside]
            if mine.size:
                back = self._back(path, arc, s[mine], there)
                whole = back.all(axis=1)
                better = whole | ~(found[mine] | limit)
                places[mine[better]], alive[mine[better]] = there[better], back[better]
                found[mine[better]] = True
                left = ~np.isin(rows, mine[whole])
                rows, turns, way = rows[left], turns[left], way[left]
            turns = turns + way
        return places, self._limits(path, places) if found.any() else limits

    def _back(self, path: AnyPath, arc: Arc, s: Floats, places: Floats) -> Booleans:
        """Return which groups are at `s` as they are at places whole turns away, (n, groups)."""
        inner = INWARDS * (arc.last - arc.first)
        inside = np.clip(places, arc.first + inner, arc.last - inner)
        beside = np.where(arc.met(places) != 0, inside, places)
        guess = path.guess(beside) if self.graphs.nx else np.zeros((len(s), 0))
        return self.returns(path, guess, s + (beside - places), beside)

    def returns(self, path: AnyPath, guess: Unknowns, s: Floats, shifted: Floats) -> Booleans:
        """Return which groups are in the same pose at `s` and whole turns away, (n, groups).

        Lengths have to agree, and angles but for whole turns, those of eliminated coordinates
        too: a rack on the crank is elsewhere after a turn, and so is a gear whose ratio is not
        an integer, with all that they carry. What carries them may well be back.

        Parameters
        ----------
        guess : (n, nx) array
            Near the poses at `shifted` (n,), which the path reaches.
        """
        nothing = np.zeros((len(s), self.graphs.nu))
        rates = () if self.graphs.single else tuple([nothing] * len(self.graphs.driven))
        recovered, (coordinates, users, owners) = self.graphs.scene.recovered, self.recovered
        sizes = np.where(self.angles, 1.0, path.constants.scale)
        values, errors, unknowns = [], [], []
        for at in (s, shifted):
            results, _ = self._converged(path, guess, at, shifted, rates)
            unknowns.append(results[0])
            values.append(coordinates(results[0], path.drivers(at), path.constants.p)[0])
            errors.append(results[1] / sizes)
        error = np.maximum(*errors)
        with np.errstate(invalid="ignore"):
            apart = values[0] - values[1]
        apart /= np.where(recovered.turns, 1.0, path.constants.scale)
        turns = 2 * np.pi * np.round(apart / (2 * np.pi))
        apart -= np.where(recovered.turns, turns, 0.0)
        result = np.ones((len(s), len(self.groups)), bool)
        with np.errstate(invalid="ignore"):  # Newton's method may end on another turn
            far = self.angles & ~(np.abs(unknowns[0] - unknowns[1]) <= HALF_TURN)
        for i in np.flatnonzero(far.any(axis=0)):
            result[:, self.column_group[i]] &= ~far[:, i]
        for k in np.flatnonzero(~recovered.places):  # a point on a closed curve may go round it
            known = 4 * error[:, users[k]].max(axis=1, initial=0.0)
            allowed = RETURN + np.minimum(known, APART)
            result[:, owners[k]] &= np.abs(apart[:, k]) <= allowed
        self._carry(~result, result)
        return result

    def _carry(self, lost: Booleans, kept: Booleans) -> None:
        """Take groups that are `lost` (n, groups) from those `kept`, and what depends on them."""
        for j, group in enumerate(self.graphs.scene.groups):
            for other in group.after:
                lost[:, j] |= lost[:, self.place[other]]
        kept &= ~lost

    @property
    def recovered(self) -> tuple[Batch, list[list[int]], list[int]]:
        """Values of the coordinates, the unknowns each depends on, places of groups."""
        found: tuple[Batch, list[list[int]], list[int]] = self.graphs.cache(
            "recovered", self._recovered
        )
        return found

    def _recovered(self) -> tuple[Batch, list[list[int]], list[int]]:
        scene = self.graphs.scene
        coordinates = ca.densify(ca.vertcat(*scene.recover.values()))
        function = ca.Function("c", [scene.x, scene.u, scene.model.p], [coordinates])
        users: list[list[int]] = [[] for _ in scene.recover]
        pattern = ca.jacobian(coordinates, scene.x).sparsity()
        for row, column in zip(*pattern.get_triplet(), strict=True):
            users[row].append(column)
        names = scene.model.q_names
        group_of = {
            names[c]: self.place[group.index] for group in scene.groups for c in group.columns
        }
        owners = [group_of[name] for name in scene.recover]
        return Batch(function, shared=[2]), users, owners

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
            self._put_limit(path, k, s[k], found, alive, results)
        return self._poses(s, places, results, alive, at_limit, uncertain, constants)

    def _converged(
        self, path: AnyPath, guess: Unknowns, s: Floats, places: Floats, rates: Rates
    ) -> tuple[list[Floats], Booleans]:
        """Return the pose kernel's results after as many steps as needed.

        `places` are those of the path on which the guesses were made. The second value tells
        which blocks were certified from the guess itself.
        """
        constants = path.constants
        consts = constants.vector()
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
        if self.closing.checks:
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
        self._carry(lost, alive)

    def _call(
        self, path: AnyPath, guess: Unknowns, s: Floats, rates: Rates, consts: Floats
    ) -> list[Floats]:
        if self.graphs.single:
            return self.pose(guess, s[:, None], consts)
        return self.pose(guess, path.drivers(s), *rates, consts)

    def _put_limit(
        self,
        path: AnyPath,
        k: int,
        s: float,
        limits: list[Limit],
        alive: Booleans,
        results: list[Floats],
    ) -> None:
        """Write the pose at a limit position: positions of all groups, rates of none."""
        g = self.graphs
        ended = g.scene.hanging(*(limit.group for limit in limits))
        columns = [i for i in range(g.nx) if self.groups[self.column_group[i]] in ended]
        x = results[0][k].copy()
        for limit in limits:
            x[columns] = limit.x[columns]
        slack = 8 * np.finfo(float).eps * max(abs(s), path.largest)
        results[1][k, columns] = 0.0
        for limit in limits:
            spread = np.abs(limit.v) * np.sqrt(slack / abs(limit.c))
            results[1][k, columns] = np.maximum(results[1][k, columns], spread[columns])
        results[0][k] = x
        results[3][k, [b for b, j in enumerate(self.block_group) if self.groups[j] in ended]] = (
            np.inf
        )
        u = path.drivers(np.array([s]))[0]
        results[5][k] = np.array(self._value(x, u, path.constants.p)).ravel()
        for order in range(6, len(results)):
            results[order][k] = np.nan
        for j, index in enumerate(self.groups):
            if index in ended:
                alive[k, j] = True

    @property
    def _value(self) -> Graph:
        scene, y = self.graphs.scene, self.outputs.expression
        inputs = [scene.x, scene.u, scene.model.p]
        return self.graphs.cache("outputs", lambda: ca.Function("y", inputs, [y]))

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
