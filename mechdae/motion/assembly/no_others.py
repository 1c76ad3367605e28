"""Whether a block has other solutions than those found: all places are looked at, box by box.

Lengths that enter as polynomials of degree two at most are made homogeneous, s = S m_k / m_0, and
the largest of |m_0|, |m_1| ... is 1: a chart for each of them, so that nothing is out of sight. A
box of angles and of the other m, with middle c and half widths h, has no solution where an
equation, or a row of Y F with Y = J(c)^-1, is further from zero in the middle than it can change,

    |F(c)| > |J(c)| h + M[h, h] / 2   or   |Y F(c)| > h + |Y| M[h, h] / 2,

M being majorants of the second derivatives for all poses. Around a solution x found no other one
lies within r where |Y| M r < 1 with Y = J(x)^-1. Boxes of which neither is known are halved in all
directions. What gears make of a turn has a period of whole turns, so finitely many boxes are all.

Where equations are redundant all of them are looked at, Y being the inverse by least squares.
They count as met where they are off by `MET` or less; what meets them so near a known solution is
that solution. Boxes in which an axis has the other sense than its joint needs hold nothing.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import casadi as ca
import numpy as np

from mechdae.kernels.bounds.walk import NoMajorant, majorant
from mechdae.kernels.run.functions import Batch, Call
from mechdae.motion.assembly.mode_labels import Chooser
from mechdae.motion.assembly.multistart import BlockSearch
from mechdae.motion.assembly.turns.winding import turns_at_most
from mechdae.records import dataclass
from mechdae.types import Floats, Jacobians, Matrices, Sym, Unknowns

SX = ca.SX
LARGEST = 4
"""Unknowns of a block up to which they are looked at."""
MOST = 400_000
"""Boxes after which it is left open."""
FIRST = 0.8
"""Half width of the first boxes of angles, at most [rad]."""
WIDEST = 2.0
"""Bound of a chart's coordinates, which are looked at from -1 to 1."""
TURNS = 64
"""Whole turns of a wheel or screw that are looked at."""
FURTHEST = 500.0
"""Bound of all angles that are looked at [rad]."""
UNIQUE = 0.9
"""Bound of |Y| M r within which a solution is the only one."""
ROUNDED = 1e-12
"""Share of the sizes of an equation's terms that rounding may make of it."""
MET = 1e-9
"""Most that redundant equations are off where they are met, by the size of the mechanism."""


def no_others(
    search: BlockSearch,
    found: Floats,
    z: Unknowns,
    u: Floats,
    senses: tuple[Chooser, int] | None = None,
) -> int:
    """Return after how many boxes it is known that a block has no other solutions, 0: it is not.

    Parameters
    ----------
    search
        The block, and whole turns that make no difference.
    found : (k, n) array
        Its solutions, one of each class of whole turns.
    z, u : arrays
        Earlier unknowns and drivers' values.
    senses
        What axes must point to, and the number of the block.
    """
    solver = search.solver
    turns = search.period[search.turning]
    if not 0 < search.n <= LARGEST or not (turns > 0).all():
        return 0
    if solver.unwinds and search.n > 1:
        return 0
    charts: list[ProjectiveChart] | None = solver.graph.cache("charts", lambda: _charts(search))
    if charts is None:
        return 0
    total = 0
    positive = None
    if solver.graph.redundant and senses is not None and not len(search.lengths):
        positive = solver.graph.cache("senses", lambda: _positive(search, *senses))
    for chart in charts:
        count = _Boxes(search, chart, positive, found, z, u).looked_at(MOST - total)
        if not count:
            return 0
        total += count
    return total


@dataclass(frozen=True, eq=False)
class ProjectiveChart:
    """Functions of a block where one coordinate is 1: of m_0 (``one`` is 0), m_1, ...

    ``values`` gives F and J column by column, ``bends`` bounds of the second derivatives.
    """

    one: int
    values: Batch
    bends: Call


@dataclass(frozen=True, eq=False)
class PositiveSenses:
    """What is positive in a block where axes have their senses: values with slopes, bends."""

    values: Batch
    bends: Call


def _positive(search: BlockSearch, senses: Chooser, b: int) -> PositiveSenses | None:
    """Return the senses that a block tells of, None where it tells of none."""
    graph, scene = search.solver.graph, search.solver.scene
    positive = [scene.expression(value) for value in senses.positive(b)]
    if not positive:
        return None
    given = [graph.z, scene.u, scene.model.p]
    found = _bounded(ca.vertcat(*positive), graph.x, given, np.full(search.n, FURTHEST))
    return None if found is None else PositiveSenses(*found)


def _bounded(rows: Sym, x: Sym, given: list[Sym], largest: Floats) -> tuple[Batch, Call] | None:
    """Return values with slopes by x, and bounds of the bends where |x| stays below `largest`.

    `given`: what the rows hold beside x, first earlier unknowns and drivers, of whose sizes the
    bounds are functions. None: no bound is known.
    """
    F = ca.densify(rows)
    J = ca.densify(ca.vec(ca.jacobian(F, x)))
    moving, others = given[:2], given[2:]
    sizes = [SX.sym(f"size{k}", part.numel()) for k, part in enumerate(moving)]
    bent = ca.vec(ca.densify(ca.jacobian(J, x)))
    try:
        bound, _ = majorant(bent, [x, *moving], [ca.DM(largest), *sizes])
    except NoMajorant:
        return None
    values = ca.Function("FJ", [x, *given], [F, J])
    bends = ca.Function("bends", [*sizes, *others], [ca.densify(bound)])
    return Batch(values, shared=[*range(1, len(given) + 1)]), Call(bends)


def _charts(search: BlockSearch) -> list[ProjectiveChart] | None:
    """Return the charts of a block, None where its equations are not of that form."""
    solver, lengths = search.solver, search.lengths.tolist()
    graph, u, p = solver.graph, solver.scene.u, solver.graph.p
    slid = graph.x[lengths] if lengths else SX(0, 1)
    A = ca.jacobian(graph.F, slid)
    H = [ca.jacobian(A[i, :].T, slid) for i in range(graph.rows)]
    if any(ca.depends_on(slope, slid) for slope in H if slope.nnz()):
        return None
    nothing = SX.zeros(len(lengths))
    free, slope = (ca.substitute(part, slid, nothing) for part in (graph.F, A))
    scale, charts = SX.sym("scale", len(lengths)), []
    for one in range(len(lengths) + 1):
        m = [SX(1), *graph.x[lengths].elements()] if lengths else [SX(1)]
        if one:
            m[0], m[one] = m[one], SX(1)
        s = scale * ca.vertcat(SX(0, 1), *m[1:])
        rows = []
        for i in range(graph.rows):
            bent, straight = H[i].nnz() > 0, A[i, :].nnz() > 0
            row = free[i] * (m[0] ** 2 if bent else m[0] if straight else 1)
            row += (slope[i, :] @ s) * (m[0] if bent else 1) if straight else 0
            rows.append(row + (s.T @ H[i] @ s / 2 if bent else 0))
        largest = np.where(search.turning, FURTHEST, WIDEST)
        found = _bounded(ca.vertcat(*rows), graph.x, [graph.z, u, p, scale], largest)
        if found is None:
            return None
        charts.append(ProjectiveChart(one, *found))
    return charts


class _Boxes:
    """Boxes of the unknowns of one block in one chart."""

    def __init__(
        self, search: BlockSearch, chart: ProjectiveChart, positive: PositiveSenses | None,
        found: Floats, z: Unknowns, u: Floats,
    ) -> None:  # fmt: skip
        self.search, self.chart, n = search, chart, search.n
        graph, scene = search.solver.graph, search.solver.scene
        met = max(MET, scene.model.mechanism.tolerance / search.solver.size)
        self.met = met * search.row if graph.redundant else 0.0
        self.positive = positive
        if positive is not None:
            self._told = (z, u, scene.model.p_values)
            values = positive.bends(np.abs(z), np.abs(u), scene.model.p_values)[0]
            self.turned = values.reshape(n, n, -1).transpose(2, 1, 0)
        scale, p = search.scale[search.lengths], search.solver.p
        self._known = (z, u, p, scale)
        values = chart.bends(np.abs(z), np.abs(u), p, scale)[0]
        # entries of J column by column, by x: (row, column, other)
        self.bends = values.reshape(n, n, -1).transpose(2, 1, 0)
        self.found = self._seen(found, scale)
        turned = np.abs(_inverses(self._values(self.found)[1]))
        norms = np.einsum("kij,jlm->kilm", turned, self.bends).sum(axis=(2, 3))
        with np.errstate(divide="ignore"):
            alone = UNIQUE / norms.max(axis=1, initial=0.0)
        self.alone = np.minimum(np.nan_to_num(alone, nan=0.0), WIDEST - 1)
        """Half widths of boxes around the solutions that hold no other one."""

    def _seen(self, found: Floats, scale: Floats) -> Any:
        """Return the solutions (k, n) in the chart that lie in its part, nearly."""
        lengths, one = self.search.lengths, self.chart.one
        seen = found.copy()
        seen[:, lengths] /= scale
        if one:
            first = seen[:, lengths[one - 1]].copy()
            with np.errstate(all="ignore"):
                seen[:, lengths] /= first[:, None]
                seen[:, lengths[one - 1]] = 1 / first
        within = np.abs(seen[:, lengths]).max(axis=1, initial=0.0) <= 1 + 1e-9
        return seen[within]

    def _values(self, x: Unknowns) -> tuple[Floats, Matrices]:
        n = self.search.n
        F, J = self.chart.values(x, *self._known)
        return F, J.reshape(-1, n, F.shape[1]).transpose(0, 2, 1)

    def looked_at(self, most: int) -> int:
        """Return how many boxes it took to exclude all other solutions, 0 if it did not."""
        turning = self.search.turning
        width = np.where(turning, self.search.period, 2.0)
        start = np.where(turning, 0.0, -1.0)
        if self.search.solver.unwinds:
            start, width = self._wound()
        if not (width <= TURNS * 2 * np.pi).all():
            return 0
        parts = np.ceil(width / (2 * np.where(turning, FIRST, 0.5))).astype(int)
        half = width / (2 * parts)
        grid = np.meshgrid(*[np.arange(count) for count in parts], indexing="ij")
        x = start + (np.stack([axis.ravel() for axis in grid], axis=1) * 2 + 1) * half
        corners, count = np.array(list(product((-0.5, 0.5), repeat=len(half)))), 0
        while len(x):
            count += len(x)
            if count > most:
                return 0
            x = x[self._open(x, half)]
            x = (x[:, None] + corners * half).reshape(-1, len(half))
            half = half / 2
        return count

    @np.errstate(all="ignore")
    def _wound(self) -> tuple[Floats, Floats]:
        """Return where one angle of a wheel on a rack or of a screw has to be, and how far on."""
        period = float(self.search.period[0])

        def values(x: Unknowns) -> tuple[Floats, Floats]:
            F, J = self._values(x[:, None])
            return F[:, 0], J[:, 0, 0]

        # a solution is in one of the turns [k P, (k + 1) P] with |k| at most that
        most = (1 + turns_at_most(values, period, float(self.bends[0, 0, 0]))) * period
        return np.array([-most]), np.array([2 * most])

    @np.errstate(all="ignore")
    def _open(self, x: Unknowns, half: Floats) -> Any:
        """Return which boxes (k,) may hold a solution that is not known."""
        F, J = self._values(x)
        bent = np.einsum("ijk,j,k->i", self.bends, half, half) / 2
        reach = np.abs(J) @ half + bent
        noise = ROUNDED * (np.abs(F) + np.abs(J).max(axis=(1, 2))[:, None] * WIDEST) + self.met
        left = ~((np.abs(F) - noise) > reach).any(axis=1)
        if self.positive is not None:
            S, turns = self.positive.values(x, *self._told)
            turns = turns.reshape(-1, len(half), S.shape[1]).transpose(0, 2, 1)
            bent_back = np.einsum("ijk,j,k->i", self.turned, half, half) / 2
            left &= ~((S + np.abs(turns) @ half + bent_back) < -ROUNDED).any(axis=1)
        rows = np.flatnonzero(left)
        Y = _inverses(J[rows])
        away = np.abs(np.einsum("kij,kj->ki", Y, F[rows]))
        moved = half + np.einsum("kij,kj->ki", np.abs(Y), bent + noise[rows])
        left[rows[(away > moved).any(axis=1)]] = False
        turning = self.search.turning
        for solution, alone in zip(self.found, self.alone, strict=True):
            rows = np.flatnonzero(left)
            gaps = (x[rows] - solution) / np.where(turning, 2 * np.pi, 1.0)
            gaps[:, turning] = self.search.lattice.remainder(gaps)[:, turning]
            off = np.abs(gaps) * np.where(turning, 2 * np.pi, 1.0) + half
            left[rows[off.max(axis=1, initial=0.0) < alone]] = False
        return left


def _inverses(J: Jacobians) -> Jacobians:
    """Return inverses (k, n, m) of small matrices (k, m, n), nan where there are none."""
    if J.shape[1] > J.shape[2]:
        across = J.transpose(0, 2, 1)
        return _inverses(across @ J) @ across
    result = np.full(J.shape, np.nan)
    det = np.linalg.det(J)
    size = np.prod(np.linalg.norm(J, axis=2), axis=1)
    regular = np.abs(det) > 1e-12 * size
    if regular.any():
        result[regular] = np.linalg.inv(J[regular])
    return result
