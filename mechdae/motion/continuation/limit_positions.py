"""Limit positions: folds of a block's equations, and other singular poses told apart.

At a fold {F = 0, J v = 0, v.v = 1} holds with the driver's push outside the range of J; the
path turns back there as s = s* + c sigma^2, x = x* + v sigma + ...
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import Call
from mechdae.kernels.run.high_precision import LONG, NoDecimals, decimals, evaluate, exactly
from mechdae.motion.setup.scales import Constants
from mechdae.numerics.null_space import solve
from mechdae.records import dataclass
from mechdae.types import Floats, Graph, Jacobian, Matrix, Unknowns

if TYPE_CHECKING:
    from mechdae.motion.cases.hard_steps.crossings.change_points import Crossing

ITERATIONS = 30
REFINED = 2
"""Steps with a residual in 80-bit floats at a fold that is found."""
ROUGH_REST = 1e-6
"""Share of the unknowns that such a step may move: more is not what rounding left."""
PRECISE, MOVED = 40, 0.1
"""Most steps in 50 digits at a fold of branches that nearly meet, and the share of its distance
from the place between them by which these may move it."""
SEARCH = 20.0
"""How far ahead a fold may lie, in largest steps of the path."""
REGULAR = 1e-4
"""Share of the largest singular value above which a Jacobian is not singular."""
ROUGH = 0.5
"""Share by which the expansion at a fold may miss the pose from which it was found."""


REACHED = ("change_point", "end_of_curve")
"""Ends whose own pose belongs to the path."""


@dataclass(frozen=True, eq=False)
class Limit:
    """Where a group's motion ends.

    ``kind`` is "limit" (a fold; where its branches nearly meet others their ``gap``),
    "change_point", "ambiguous" (branches too near each other, by ``gap``), "cusp", "dead_point",
    "pole", "end_of_curve", "locked" (redundant equations are not met beyond) or "unproved"; ``x``
    (nx,) the unknowns there; for a fold ``own`` are the unknowns of its block, ``v`` (nx,) and
    ``c`` its expansion. ``reached`` is how far the path was proved where that is short of the end,
    at the end of a curve ``joint`` is its joint. Where branches touch to a higher ``order`` the
    place lies ``within`` a range; those that stay apart are ``nearest`` to each other somewhere
    behind.
    """

    s: float
    block: int
    group: int
    kind: str
    x: Any
    own: tuple[int, ...] = ()
    v: Any = None
    c: float = 0.0
    gap: float = 0.0
    reached: float | None = None
    joint: str = ""
    order: float = 1.0
    within: tuple[float, float] | None = None
    nearest: float | None = None

    @property
    def belongs(self) -> float:
        """How far behind the end poses still count as poses of the path; negative: before it."""
        if self.reached is not None:
            return -abs(self.reached - self.s)
        return 4 * np.spacing(abs(self.s)) if self.kind in REACHED else 0.0

    @property
    def regular(self) -> bool:
        """Whether the pose there is like any other: the end of a curve."""
        return self.kind == "end_of_curve"

    def leads_to(self, x: Unknowns, s: float, tolerance: float) -> bool:
        """Return whether the expansion of the fold's block leads back to the pose `x` at `s`."""
        unknowns = list(self.own)
        offset = (x - self.x)[unknowns]
        sigma = np.sign(offset @ self.v[unknowns]) * np.sqrt(max((s - self.s) / self.c, 0.0))
        far = float(np.max(np.abs(offset)))
        miss = float(np.max(np.abs(offset - self.v[unknowns] * sigma)))
        return far > 0 and miss <= tolerance * far


class LimitFinder:
    """Finds and names singular poses of a scene's blocks.

    Parameters
    ----------
    graphs
        Kernels of the scene.
    whole
        The input [consts; u0; d] of the path's kernels.
    constants
        Numbers and bounds of the scene.
    drivers, unit
        The function s (n,) -> u (n, nd); a radian of the driver, or a length of the mechanism.
    """

    def __init__(
        self, graphs: Graphs, whole: Floats, constants: Constants, drivers: object, unit: float
    ) -> None:
        self.graphs: Graphs = graphs
        self.whole: Floats = whole
        self.drivers: object = drivers
        scale = constants.scale
        self.p: Floats = constants.p
        self.mu: Floats = constants.mu
        self.unit: float = unit
        self.scale: float = scale
        self.sizes: Floats = graphs.scene.unknowns.sizes(scale)
        self.weights: list[Floats] = graphs.units(scale, self.p)[0]

    def chain(self, b: int) -> tuple[list[int], list[int]]:
        """Return the unknowns of a block and its ancestors, and the block's places among them."""
        g = self.graphs
        chain = [i for k in g.ancestors(b) for i in g.blocks[k].own]
        return chain, [chain.index(i) for i in g.blocks[b].own]

    def evaluate(self, b: int, y: Floats) -> list[Floats]:
        """Return what `Graphs.fold` gives of a block at y."""
        call = self.graphs.cache(("fold", b), lambda: Call(self.graphs.fold(b)))
        system, slope, J, F_y, bend = call(y, self.whole)
        return [system, slope, J.reshape(-1, self.graphs.blocks[b].size), F_y, bend]

    def find(self, b: int, s: float, x: Unknowns, sense: float, largest: float) -> Limit | None:
        """Return the fold of block `b` just ahead of a solved pose, None while there is none.

        Unknowns of blocks that it does not depend on stay those of the pose (see `FoldApproach`).
        """
        chain, columns = self.chain(b)
        count, w = len(chain), self.weights[b]
        y = np.concatenate([x[chain], [s], np.zeros(len(columns))])
        y[count + 1 :] = np.linalg.svd(self.evaluate(b, y)[2] * w)[2][-1]
        if not self._solve(b, y, s, count, 50 * largest):
            return None
        found = float(y[count])
        if not -1e-12 * (1 + abs(s)) <= sense * (found - s) <= SEARCH * largest:
            return None
        self._refine(b, y)
        limit = self._fold(b, y, x, sense)
        return limit if limit is not None and limit.leads_to(x, s, ROUGH) else None

    def of_missed(self, crossing: Crossing, x: Unknowns, sense: float) -> Limit | None:
        """Return the fold at which branches turn back that nearly meet, from a pose before it.

        It is improved in 50 digits: its equations lose as many as the distance of the branches has.
        """
        b, missed = crossing.block, crossing.missed
        if missed is None or missed.passes:
            return None
        chain, columns = self.chain(b)
        ds, offset = missed.turning(sense)
        direction = missed.v / self.weights[b]
        y = np.concatenate([x[chain], [crossing.s + ds], direction / np.linalg.norm(direction)])
        y[columns] = crossing.x + offset
        exact, function = [exactly(value) for value in y], self._system(b)
        try:
            for _ in range(PRECISE):
                slope = self.evaluate(b, y)[1]
                size = np.max(np.abs(slope), axis=1)
                size[size == 0] = 1.0
                values = decimals(function, [exact, self.whole])
                change = solve(slope / size[:, None], [float(v) for v in values] / size)
                exact = [a - exactly(step) for a, step in zip(exact, change, strict=True)]
                y = np.array([float(value) for value in exact])
                if np.max(np.abs(change)) <= 1e-15 * (1 + np.max(np.abs(y))):
                    break
            else:
                return None
        except (NoDecimals, np.linalg.LinAlgError):
            return None
        moved = abs(y[len(chain)] - crossing.s - ds)
        limit = self._fold(b, y, x, sense) if moved <= MOVED * abs(ds) else None
        return limit if limit is None else replace(limit, gap=crossing.gap)

    def _fold(self, b: int, y: Floats, x: Unknowns, sense: float) -> Limit | None:
        """Return the fold of a block at y as seen from the pose `x`, None where it is none."""
        g = self.graphs
        chain, unknowns = self.chain(b)
        count, w = len(chain), self.weights[b]
        found = float(y[count])
        _, slope, J, F_y, bend = self.evaluate(b, y)
        left = _left_null(J * w)
        push = left @ _push(slope, F_y, count, unknowns, len(J))
        curve, size = float(push @ (left @ bend.ravel())), float(push @ push)
        if size == 0 or curve == 0 or -curve * sense >= 0:
            return None
        columns = tuple(g.blocks[b].own)
        full, rate = x.copy(), np.zeros(g.nx)
        full[chain], rate[list(columns)] = y[:count], y[count + 1 :] * w
        group = g.blocks[b].block.group
        return Limit(found, b, group, "limit", full, columns, rate, -curve / (2 * size))

    def _system(self, b: int) -> Graph:
        """Return the system of a fold alone as a function."""

        def make() -> Graph:
            function = self.graphs.fold(b)
            symbols = function.sx_in()
            return ca.Function("system", symbols, [function(*symbols)[0]])

        return self.graphs.cache(("fold system", b), make)

    def _solve(self, b: int, y: Floats, s: float, count: int, reach: float) -> bool:
        """Solve the system of a fold by Newton's method in place; return whether it held."""
        moved = np.inf
        for _ in range(ITERATIONS):
            system, slope = self.evaluate(b, y)[:2]
            size = np.max(np.abs(slope), axis=1)
            size[size == 0] = 1.0
            try:
                change = solve(slope / size[:, None], system.ravel() / size)
            except np.linalg.LinAlgError:
                return False
            y -= change
            if not np.all(np.isfinite(y)) or abs(y[count] - s) > reach:
                return False
            before, moved = moved, float(np.max(np.abs(change)))
            if moved <= 1e-15 * (1 + np.max(np.abs(y))) or (moved < 1e-10 and moved >= before):
                return True
        return False

    def _refine(self, b: int, y: Floats) -> None:
        """Improve a fold in place by steps with a residual in 80-bit floats.

        Next to branches that nearly cross, the place is off by the residual's rounding over
        the driver's push, which vanishes at a crossing.
        """
        residual = self._system(b)
        exact, whole = y.astype(LONG), self.whole.astype(LONG)[None]
        for _ in range(REFINED):
            slope = self.evaluate(b, y)[1]
            size = np.max(np.abs(slope), axis=1)
            size[size == 0] = 1.0
            system = evaluate(residual, [exact[None], whole])[0]
            try:
                change = solve(slope / size[:, None], (system / size).astype(float))
            except np.linalg.LinAlgError:
                return
            if not np.max(np.abs(change)) <= ROUGH_REST * (1 + np.max(np.abs(y))):
                return
            exact = exact - change
            y[:] = exact.astype(float)

    def kind(self, b: int, s: float, x: Unknowns) -> str:
        """Return what a singular pose that is no fold is.

        "change_point": the driver's push lies in the range of J, branches meet;
        "dead_point": it does not, the group's speed ratio is infinite there;
        "locked": a redundant block is not singular, but its equations are not met beyond;
        "unproved": a block is not singular at all, such as at the corner of a curve.
        """
        chain, columns = self.chain(b)
        y = np.concatenate([x[chain], [s], np.zeros(len(columns))])
        _, slope, J, F_y, _ = self.evaluate(b, y)
        push = _push(slope, F_y, len(chain), columns, len(J))
        units = self.graphs.blocks[b].block.units
        rows = np.array([self.scale if unit == "m" else 1.0 for unit in units])
        sigma = np.linalg.svd(J * self.weights[b] / rows[:, None])[1]
        if sigma[-1] > REGULAR * sigma[0]:
            return "locked" if self.graphs.blocks[b].redundant else "unproved"
        left = _left_null(J * self.weights[b])
        size = max(float(np.linalg.norm(push)), float(self.mu[b]) / self.unit)
        return "change_point" if np.linalg.norm(left @ push) < 1e-2 * size else "dead_point"


def _left_null(J: Jacobian) -> Floats:
    """Return the left singular vectors of the smallest singular value and of zero, as rows."""
    return np.linalg.svd(J)[0][:, J.shape[1] - 1 :].T


def _push(slope: Matrix, F_y: Floats, count: int, columns: list[int], equations: int) -> Floats:
    """Return dF/ds of a block, its ancestors' unknowns following the path."""
    push = F_y[:, count].copy()
    earlier = [k for k in range(count) if k not in columns]
    if earlier:
        rows = len(slope) - 1 - 2 * equations
        follow = -solve(slope[:rows, earlier], slope[:rows, count])
        push += F_y[:, earlier] @ follow
    return push
