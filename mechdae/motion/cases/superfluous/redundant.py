"""All solutions of a block with more equations than unknowns.

As many equations as unknowns are chosen so that they fall into small blocks, which are solved
one after the other for all of their solutions; the other equations sort out those at which
they do not hold. No equation is preferred: solutions are refined on all of them.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import casadi as ca
import numpy as np

from mechdae.equations.reduction import Block, Scene
from mechdae.kernels.graphs.blocks import BlockGraph
from mechdae.motion.assembly.closure import MEANT, Gap, bar_lengths, straight, worst
from mechdae.motion.assembly.elimination import BlockSolver
from mechdae.motion.assembly.least_gap import opening
from mechdae.motion.assembly.other_forms import Solutions
from mechdae.motion.assembly.turns.block_turns import put
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Unknowns

SEED = 5
PROBES = 3
ZERO = 1e-9
"""Size of an entry of the Jacobian, all lengths in parts of the mechanism, that counts as zero."""
ROUGH = 1e-6
"""Residual, in lengths of the mechanism, with which a solution is worth refining."""
ITERATIONS = 12
NOISE = 1e-12
"""Residual, in lengths of the mechanism, below which a refining step need not lessen it."""
SAMPLES = 360


@dataclass(frozen=True)
class Step:
    """A part of the block: its unknowns, and all equations that hold no later ones."""

    columns: list[int]
    rows: list[int]
    solver: BlockSolver


def redundant_solver(
    scene: Scene, graph: BlockGraph, p: Floats, size: float, slopes: dict[int, list[float]]
) -> RedundantSolver | None:
    """Return what solves a block with more equations than unknowns, None for others."""
    return RedundantSolver(scene, graph, p, size, slopes) if graph.redundant else None


class RedundantSolver(BlockSolver):
    """Finds all solutions of one redundant block."""

    def __init__(
        self,
        scene: Scene,
        graph: BlockGraph,
        p: Floats,
        size: float,
        slopes: dict[int, list[float]],
    ) -> None:
        super().__init__(scene, graph, p, size, slopes)
        self.slopes = slopes
        self.row_size: Floats = np.array(
            [size if unit == "m" else 1.0 for unit in graph.block.units]
        )
        self.x_size: Floats = np.where(self.angle, 1.0, size)
        self.rough: float = max(ROUGH, scene.model.mechanism.tolerance / size)
        self._chains: dict[bytes, list[list[Step]]] = {}

    def _chain(self, pattern: Booleans) -> list[list[Step]]:
        """Return two choices of steps for a pattern (m, n) of the Jacobian."""
        key = pattern.tobytes()
        if key not in self._chains:
            rows = range(self.graph.rows)
            self._chains[key] = [self._steps(pattern, rows), self._steps(pattern, rows[::-1])]
        return self._chains[key]

    def _pattern(self, start: Floats, u: Floats) -> Booleans:
        """Return which entries of the Jacobian are not zero for all unknowns of the block.

        An equation that repeats another one may hold symbols that cancel.
        """
        random = np.random.default_rng(SEED)
        found = np.zeros((self.graph.rows, self.n), bool)
        for _ in range(PROBES):
            x = start.copy()
            x[self.graph.own] = random.uniform(-np.pi, np.pi, self.n) * self.x_size
            J = self.graph.value_at(x, u, self.values)[1] / self.row_size[:, None] * self.x_size
            found |= np.abs(J) > ZERO
        return found

    def _steps(self, pattern: Booleans, order: range) -> list[Step]:
        """Return the steps, each as small as can be, with equations that come first in an order.

        One equation for one unknown, else two for two; what is left then is one step. Empty
        where the equations do not fix all unknowns.
        """
        held = {i: set(np.flatnonzero(pattern[i]).tolist()) for i in order}
        steps, known = [], set[int]()
        while len(known) < self.n:
            square = _smallest_square({i: unknowns - known for i, unknowns in held.items()})
            columns = sorted(set().union(*[held[i] for i in square]) - known)
            if not columns or len(columns) != len(square):
                return []
            known |= set(columns)
            others = [i for i, unknowns in held.items() if unknowns <= known and i not in square]
            steps.append(Step(columns, [*square, *others], self._solver(columns, square)))
            held = {i: unknowns for i, unknowns in held.items() if not unknowns <= known}
        return steps

    def _solver(self, columns: list[int], rows: list[int]) -> BlockSolver:
        block = self.graph.block
        x = tuple(self.graph.own[j] for j in columns)
        others = (*self.graph.uses, *(i for i in self.graph.own if i not in x))
        units = tuple(block.units[i] for i in rows)
        owners = tuple(block.owners[i] for i in rows)
        reaches = tuple(block.reaches[i] for i in rows) if block.reaches else ()
        part = Block(block.group, x, others, block.residual[rows], units, owners, reaches)
        key = (tuple(columns), tuple(rows))
        graph = self.graph.cache(key, lambda: BlockGraph(self.scene, part))
        return BlockSolver(self.scene, graph, self.values, self.size, self.slopes)

    def solve(self, z: Unknowns, u: Floats) -> Solutions | None:
        """Return all solutions, None where the steps do not decide.

        Without a solution ``gap`` is the least residual of a step that does not close, with
        either choice of equations. ``free`` tells that some step has infinitely many
        solutions which the other equations may allow or not.
        """
        start = np.zeros(self.scene.x.numel())
        start[self.graph.uses] = z
        steps, others = self._chain(self._pattern(start, u))
        if not steps or not others:
            return None
        first = self._chained(steps, start, u, self.rough)
        if len(first.x) and not first.free:
            return first
        second = self._chained(others, start, u, self.rough)
        if not first.free or not second.free:
            sure = [one for one in (first, second) if not one.free]
            sure += [self._nearly(steps, start, u)] if len(sure) == 2 else []
            return min(sure, key=lambda one: one.gap)
        found = list(first.x)
        found += [x for x in second.x if not any(self._same(x, other) for other in found)]
        return Solutions(np.array(found), False, free=True) if found else None

    def _nearly(self, steps: list[Step], start: Floats, u: Floats) -> Solutions:
        """Return no solution, and how far all equations stay open where dimensions hardly agree."""
        near = self._chained(steps, start, u, MEANT)
        gaps = [self._refined(put(start, self.graph.own, x), u)[1] for x in near.x]
        least = min(gaps, key=_size, default=Gap(np.inf, "m", ""))
        return replace(near, x=near.x[:0], gap=least.size, gap_at=least)

    def _chained(self, steps: list[Step], start: Floats, u: Floats, rough: float) -> Solutions:
        """Return the solutions by some steps, which may miss other equations by `rough` sizes.

        ``free`` tells that a step does not decide.
        """
        found, proven, free = [start], True, False
        for step in steps:
            ahead: list[Floats] = []
            nearest = Gap(np.inf, "m", self.graph.block.owners[step.rows[0]])
            for x in found:
                result = step.solver.solve(x[step.solver.graph.uses], u)
                if result is None or result.infinite or result.free or _undecided(result):
                    free = True
                    continue
                proven &= result.proven
                if not len(result.x):
                    nearest = min(nearest, self._missed(step, x, u), key=_size)
                for solution in result.x:
                    new = x.copy()
                    new[[self.graph.own[j] for j in step.columns]] = solution
                    new, gap = self._refined(new, u, step.columns, step.rows)
                    if gap.size > rough * (self.size if gap.unit == "m" else 1.0):
                        nearest = min(nearest, gap, key=_size)
                    elif not any(self._same(new[self.graph.own], a[self.graph.own]) for a in ahead):
                        ahead.append(new)
            found = ahead
            if not found:
                return Solutions(
                    np.zeros((0, self.n)), proven, nearest.size, free=free, gap_at=nearest
                )
        refined = [self._refined(x, u)[0][self.graph.own] for x in found]
        sure = proven and not free and not self.scene.model.mechanism.tolerance
        return Solutions(np.array(refined), sure, free=free)

    def _missed(self, step: Step, x: Unknowns, u: Floats) -> Gap:
        """Return what stays open where the step's own equations have no solution.

        With a single angle it is the least over all equations of the step, and redundant
        ones are to blame where one of them alone could be met.
        """
        if len(step.columns) > 1 or not self.angle[step.columns[0]] or len(step.rows) == 1:
            return opening(step.solver, self.scene.model, x, u)
        places = np.repeat(x[None], SAMPLES, axis=0)
        angles = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
        places[:, self.graph.own[step.columns[0]]] = angles
        F = np.array([self.graph.value_at(place, u, self.values)[0][step.rows] for place in places])
        best = places[int(np.argmin(np.linalg.norm(F / self.row_size[step.rows], axis=1)))]
        found = self._refined(best, u, step.columns, step.rows)[1]
        met = np.any((F.min(axis=0) < 0) & (F.max(axis=0) > 0))
        return replace(found, superfluous=bool(met))

    def _same(self, a: Floats, b: Floats) -> bool:
        gaps = (a - b) / self.x_size
        for j in range(self.n):
            period = self.period(j)
            gaps[j] = np.remainder(gaps[j] + period / 2, period) - period / 2 if period else gaps[j]
        return bool(np.abs(gaps).max() < 1e-7)

    def _refined(
        self,
        x: Unknowns,
        u: Floats,
        columns: list[int] | None = None,
        rows: list[int] | None = None,
    ) -> tuple[Floats, Gap]:
        """Return x after steps of Gauss and Newton on some equations, or all, and what is left."""
        columns = list(range(self.n)) if columns is None else columns
        rows = list(range(self.graph.rows)) if rows is None else rows
        unknowns = [self.graph.own[j] for j in columns]
        row_size, x_size = self.row_size[rows], self.x_size[columns]
        before, last, left = x, np.inf, np.inf
        for _ in range(ITERATIONS):
            F, J, _ = self.graph.value_at(x, u, self.values)
            here = float(np.linalg.norm(F[rows] / row_size))
            if here > max(left, NOISE):
                x = before
                break
            slope = J[np.ix_(rows, columns)] / row_size[:, None] * x_size
            step = np.linalg.lstsq(slope, F[rows] / row_size)[0]
            size = float(np.abs(step).max())
            if not size < last:
                break
            last, left, before = size, here, x
            x = x.copy()
            x[unknowns] -= step * x_size
        F = np.zeros(self.graph.rows)
        F[rows] = self.graph.value_at(x, u, self.values)[0][rows]
        whole = float(np.linalg.norm(F / self.row_size)) * self.size
        F = straight(F, bar_lengths(self.scene.model.mechanism, self.graph.block.owners))[0]
        return x, replace(worst(F / self.row_size, self.graph.block, self.size), whole=whole)


def _undecided(result: Solutions) -> bool:
    """Return whether there may be roots so close that they were taken for one."""
    return not len(result.x) and not result.proven


def _size(gap: Gap) -> float:
    return gap.size


def _smallest_square(held: dict[int, set[int]]) -> list[int]:
    """Return the rows of one unknown, of two, or as many as there are unknowns.

    `held` are the unknowns of each row.
    """
    for i, unknowns in held.items():
        if len(unknowns) == 1:
            return [i]
    for i, k in combinations(held, 2):
        if len(held[i] | held[k]) == 2:
            return [i, k]
    rows = list(held)
    columns = sorted(set().union(*held.values()))
    if not columns:
        return []
    entries = [(r, columns.index(j)) for r, i in enumerate(rows) for j in sorted(held[i])]
    shape = (len(rows), len(columns))
    pattern = ca.Sparsity.triplet(*shape, [r for r, _ in entries], [c for _, c in entries])
    _, rowperm, _, _, _, coarse, _ = pattern.btf()
    return sorted((rows[r] for r in rowperm[coarse[1] :]), key=rows.index)
