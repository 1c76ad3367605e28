"""Solutions of one block by Newton's method from many starts: found, not proven.

The starts are an additive recurrence, which fills the cube of the angles more evenly than
random numbers; quaternions have length 1, and lengths that enter linearly follow from the angles
by least squares. Starts are doubled until the last half found nothing new and each solution was
reached several times.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from mechdae.equations.coordinates import quaternions
from mechdae.kernels.run.functions import Batch
from mechdae.motion.assembly.elimination import BlockSolver
from mechdae.motion.assembly.platform import newton_steps
from mechdae.motion.assembly.turns.block_turns import SingleTurns
from mechdae.motion.assembly.turns.winding import turns_at_most
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Integers, Matrices, Matrix, Unknowns

FIRST = 256
NEAR, NEARBY = 32, 0.2
"""Starts around the sketch, and how far they spread, as a share of a turn."""
MOST = 16_384
HITS = 4
"""Starts that must lead to each solution before the search is ended."""
SPREAD = 4.0
"""Interval of lengths that are not fitted, in sizes of the mechanism."""
TURNS = 5
"""Whole turns of wheels on racks and of screws that starts are spread over, where it is not known
how many there can be."""
MOST_TURNS = 64
"""The most that they are spread over."""
ITERATIONS = 60
LARGEST_STEP = 0.7
ROUNDING = 1e-13
"""Largest residual of a solution, in sizes of the mechanism and radians."""
ROUGH = 1e-9
"""The same where equations are redundant: they are met to rounding of the numbers given."""
SAME = 1e-7
APART = 0.01
"""Share of 1/beta within which a solution is the only one: equations of size 1 bend by a few."""
GRAIN, ROUGHEST = 4e-15, 1e-5
"""Rounding of a solution over beta, and the most it is taken for at a fold."""
FAR = 1e6
"""Sizes of the mechanism beyond which a length is at infinity: what is met there is no pose."""
CROWD = 512
"""Solutions above which the search ends: they are no single ones."""


@dataclass(frozen=True)
class BlockSolutions:
    """Distinct solutions ``x`` (k, n), the number of starts that led to each, and of all starts."""

    x: Matrix
    hits: Integers
    starts: int

    def only(self, kept: Booleans) -> BlockSolutions:
        """Return those of the solutions that are `kept` (k,)."""
        return BlockSolutions(self.x[kept], self.hits[kept], self.starts)


class BlockSearch:
    """Looks for the solutions of one block.

    Parameters
    ----------
    solver
        The block: its graph, parameters and periods.
    sizes
        Natural sizes (n,) of the unknowns.
    lattice
        Whole turns of its angles that make no difference.
    """

    def __init__(self, solver: BlockSolver, sizes: Floats, lattice: SingleTurns) -> None:
        graph = solver.graph
        self.solver: BlockSolver = solver
        self.n: int = graph.size
        self.lattice: SingleTurns = lattice
        self.function: Batch = graph.cache("search", self._equations)
        angle = np.array(solver.angle, bool)
        self.lengths: Integers = np.flatnonzero(~angle)
        self.turning: Booleans = angle
        columns = ca.vec(graph.J[:, self.lengths.tolist()])
        bent = ca.jacobian(columns, graph.x)[:, self.lengths.tolist()].nnz() > 0
        self.fitted: Integers = self.lengths[:0] if bent else self.lengths
        """Lengths that follow from the angles: the equations are linear in all of them."""
        self.scale: Floats = np.asarray(sizes, float)
        self.period: Floats = np.array([solver.period(j) for j in range(self.n)])
        self.quaternions: list[list[int]] = quaternions(
            [solver.scene.unknowns[i] for i in graph.own]
        )
        self.row: Floats = np.array(
            [solver.size if unit == "m" else 1.0 for unit in graph.block.units]
        )
        self.rounding: float = ROUNDING
        if graph.redundant:
            open_by = solver.scene.model.mechanism.tolerance
            self.rounding = max(ROUGH, open_by / solver.size)

    def _equations(self) -> Batch:
        scene, graph = self.solver.scene, self.solver.graph
        inputs = [graph.x, graph.z, scene.u, graph.p]
        results = [ca.densify(graph.F), ca.densify(ca.vec(graph.J))]
        return Batch(ca.Function("FJ", inputs, results), shared=[1, 2, 3])

    def __call__(
        self, z: Unknowns, u: Floats, hint: Floats, most: int = MOST, crowd: int = CROWD
    ) -> BlockSolutions:
        """Return the solutions for given earlier unknowns and driver values.

        `hint` (n,) is the first start, nan where nothing is known. The search ends with more than
        `crowd` solutions.
        """
        self._shared = (z, u, self.solver.p)
        distinct, hits = np.zeros((0, self.n)), np.zeros(0, int)
        done, goal = 0, min(FIRST, most)
        while True:
            starts = self._starts(done, goal)
            if done == 0:
                starts[:NEAR] = self._near(hint, starts[:NEAR])
            reached = self._newton(self._with_lengths(starts))
            known = len(distinct)
            distinct, hits = self._merge(distinct, hits, reached)
            settled = done and len(distinct) == known and np.all(hits >= HITS)
            done, goal = goal, 2 * goal
            if settled or goal > most or len(distinct) > crowd:
                return BlockSolutions(distinct, hits, done)

    def _cube(self, first: int, last: int) -> Floats:
        """Return points `first` to `last` of the sequence in a cube of edge 1 around 0."""
        base = 2.0
        for _ in range(60):  # the root of base^(n + 1) = base + 1
            base = (1 + base) ** (1 / (self.n + 1))
        steps = base ** -np.arange(1.0, self.n + 1)
        return np.mod(0.5 + np.arange(first, last)[:, None] * steps, 1.0) - 0.5

    def _starts(self, first: int, last: int) -> Floats:
        """Return points `first` to `last` of the sequence, one row each."""
        whole = np.where(self.period > 0, self.period, 2 * np.pi)
        whole *= self._turns() if self.solver.unwinds else 1
        whole[self.lengths] = SPREAD * self.scale[self.lengths]
        starts = self._cube(first, last) * whole
        for components in self.quaternions:  # from others Newton's method seldom gets anywhere
            size = np.linalg.norm(starts[:, components], axis=1, keepdims=True)
            starts[:, components] = np.where(size > 0, starts[:, components], 1.0) / np.where(
                size > 0, size, 2.0
            )
        return starts

    def _near(self, hint: Floats, starts: Floats) -> Floats:
        """Return starts moved to where there is a hint: it itself, and others around it."""
        offsets = (
            NEARBY * 2 * np.pi * (np.arange(len(starts))[:, None] > 0) * self._cube(0, len(starts))
        )
        return np.where(np.isfinite(hint), hint + offsets, starts)

    def _turns(self) -> float:
        """Return over how many whole turns the angles are spread."""
        period = float(self.period[0])
        if self.n > 1 or not period:
            return TURNS

        def values(x: Unknowns) -> tuple[Floats, Floats]:
            F, J = self._values(x[:, None])
            return F[:, 0], J[:, 0, 0]

        most = 2 * (1 + turns_at_most(values, period))
        return min(most, MOST_TURNS) if np.isfinite(most) else TURNS

    def _values(self, x: Unknowns) -> tuple[Floats, Matrices]:
        """Return F (k, m) in units of the rows and J (k, m, n) in those of rows and unknowns."""
        F, J = self.function(x, *self._shared)
        J = J.reshape(-1, self.n, F.shape[1]).transpose(0, 2, 1)
        return F / self.row, J * self.scale / self.row[:, None]

    def _with_lengths(self, x: Unknowns) -> Floats:
        """Return starts whose lengths fit their angles best."""
        if len(self.fitted):
            F, J = self._values(x)
            step = np.einsum("kij,kj->ki", np.linalg.pinv(J[:, :, self.fitted]), F)
            x[:, self.fitted] -= step * self.scale[self.fitted]
        return x

    def _newton(self, x: Unknowns) -> Any:
        """Return the solutions that Newton's method reaches, one row for each start that does."""
        found = []
        for _ in range(ITERATIONS):
            F, J = self._values(x)
            fine = np.isfinite(F).all(axis=1) & np.isfinite(J).all(axis=(1, 2))
            x, F, J = x[fine], F[fine], J[fine]
            step = newton_steps(J, F)
            size = np.abs(step).max(axis=1, initial=0.0)
            with np.errstate(divide="ignore"):
                x = x - step * self.scale * np.minimum(1.0, LARGEST_STEP / size)[:, None]
            there = size < 1e-11
            found.append(x[there])
            x = x[~there]
            if not len(x):
                break
        reached = np.concatenate(found)
        if not len(reached):
            return reached
        F, J = self._values(reached)
        reached = reached - newton_steps(J, F) * self.scale
        F, _ = self._values(reached)
        far = 1 + np.abs(reached[:, self.lengths] / self.solver.size).max(axis=1, initial=0.0)
        return reached[(np.abs(F).max(axis=1) <= self.rounding * far) & (far <= FAR)]

    def _merge(self, kept: Floats, hits: Integers, reached: Floats) -> tuple[Floats, Integers]:
        """Return the distinct solutions with their hits when `reached` is added."""
        hits = hits.copy()
        for k, known in enumerate(kept):
            same = self._same(reached, known)
            hits[k] += same.sum()
            reached = reached[~same]
        while len(reached):
            same = self._same(reached, reached[0])
            kept = np.vstack([kept, reached[:1]])
            hits = np.append(hits, same.sum())
            reached = reached[~same]
        return kept, hits

    def _same(self, x: Unknowns, y: Floats) -> Any:
        """Return which rows are the solution `y`, but for whole turns that make no difference."""
        gap = (x - y) / np.where(self.turning, 2 * np.pi, 1.0)
        gap = self.lattice.remainder(gap) * np.where(self.turning, 2 * np.pi, 1.0)
        return (np.abs(gap) / self.scale).max(axis=1) < self._reach(y)

    def _reach(self, y: Floats) -> float:
        """Return the distance from a solution within which there is no other distinguishable one.

        Newton and Kantorovich: there is none within 1/(beta kappa); what is nearer than the
        rounding of the solution itself is the same.
        """
        J = self._values(y[None])[1][0]
        beta = 1 / max(float(np.linalg.svd(J, compute_uv=False)[-1]), 1e-100)
        return max(min(SAME, APART / beta), min(GRAIN * beta, ROUGHEST))
