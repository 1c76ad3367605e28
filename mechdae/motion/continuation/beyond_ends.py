"""Poses that are limit positions, and those that are reached by moving the other way round."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import Batch
from mechdae.motion.continuation.any_path import AnyPath, Arc, arc_of
from mechdae.motion.continuation.path import SMALLEST, Path
from mechdae.motion.setup.outputs import Outputs, ReportedQuantity
from mechdae.types import Booleans, Floats, Graph, Integers, Unknowns

if TYPE_CHECKING:
    from mechdae.motion.continuation.limit_positions import Limit

HALF_TURN = 1.5
"""Angle beyond which Newton's method has left the pose that it began at [rad]."""
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
INTO = 12
"""Places looked at between a limit position and the node from which it was proved."""
NEARER, TIMES = 1 / 8, 15
"""Share of the distance to a limit position at which it is looked at next, and how often."""


class BeyondEnds:
    """The part of an evaluator for paths on which groups end; the rest is that of the heir."""

    graphs: Graphs
    outputs: Outputs
    groups: list[int]
    place: dict[int, int]
    column_group: Integers
    block_group: Integers
    angles: Booleans
    _converged: Any

    @cached_property
    def entry_groups(self) -> list[tuple[ReportedQuantity, list[int]]]:
        """The reported quantities, each with the places of the groups it depends on."""
        outputs = self.outputs
        return [
            (entry, [self.groups.index(g) for g in outputs.groups_of(entry)])
            for entry in outputs.entries
        ]

    @staticmethod
    def stops(path: AnyPath, s: Floats) -> Booleans:
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

    def limits(self, path: AnyPath, s: Floats) -> dict[int, list[Limit]]:
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

    def turn_round(
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
            inside = limit | path.follows(there).all(axis=1)
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
        return places, self.limits(path, places) if found.any() else limits

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
        self.carry(~result, result)
        return result

    def carry(self, lost: Booleans, kept: Booleans) -> None:
        """Take groups that are `lost` (n, groups) from those `kept`, and what depends on them."""
        for j, group in enumerate(self.graphs.scene.groups):
            for other in group.after:
                lost[:, j] |= lost[:, self.place[other]]
        kept &= ~lost

    @property
    def recovered(self) -> tuple[Batch, list[list[int]], list[int]]:
        """Values of the coordinates, the unknowns each depends on, places of groups."""
        return self.graphs.cache("recovered", self._recovered)

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

    def put_limit(
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


def before_limits(path: Path) -> list[float]:
    """Return the ends of the arc, and places ever nearer to its limit positions.

    In front of a fold s = s* + c sigma^2 quantities are smooth in sigma: they may turn back within
    a hair of s, and steps of the path see nothing of it.
    """
    arc, found = arc_of(path), []
    nodes = [s for s in path.s if arc.first < s < arc.last]
    for way, end, last in zip((-1, 1), arc.ends, nodes and (nodes[0], nodes[-1]), strict=False):
        if end is not None:
            found += [end + (last - end) * (k / INTO) ** 2 for k in range(INTO)]
            found += [end - way * arc.largest * NEARER**k for k in range(1, TIMES)]
    return [s for s in found if arc.first <= s <= arc.last]
