"""Steps of chains of many blocks, proved around polynomials through their two ends.

Deviations from tangents add up from block to block, and so do their bounds. The polynomial of
degree five through values and two derivatives at both ends of a step is so near to the motion that
what adds up is nothing beside what a block can bear: see `mechdae.kernels.graphs.quintic_boxes`.
All steps that wait for a proof are looked at together, in one part each, or in several where
bounds grow too much over the whole of it. All boxes of an unknown have the same width, and at a
node both have the node in their middle: so what neighbouring steps hold is one solution.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from functools import partial
from typing import Any

import casadi as ca
import numpy as np

from mechdae.kernels.bounds.series import NoSeries
from mechdae.kernels.bounds.walk import NoMajorant
from mechdae.kernels.graphs import quintic_boxes
from mechdae.kernels.graphs.quintic_boxes import COUNT
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import Batch, Call
from mechdae.motion.continuation.interpolate import upper_coefficients
from mechdae.motion.setup.scales import Constants
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Matrix

PARTS = (1, 4, 16)
"""Parts of a step that are tried one after the other."""
BOX = 1e-3
"""Half widths of a box in natural sizes of the unknowns."""
FILLED = 0.9
"""Share of its box that a solution may need."""
ROUNDED = 8.0
"""Bounds of the rounding of F at a pose that are allowed to F along a polynomial."""


@dataclass(frozen=True, eq=False)
class Kind:
    """Blocks of one shape: their numbers, and the functions of that shape."""

    blocks: tuple[int, ...]
    along: Batch
    box: Batch


class QuinticSteps:
    """Proves steps between nodes of a path along straight lines in the drivers' values.

    Parameters
    ----------
    graphs, constants
        Functions and numbers of the scene.
    """

    def __init__(self, graphs: Graphs, constants: Constants) -> None:
        self.graphs: Graphs = graphs
        self.constants: Constants = constants
        self.kinds: tuple[Kind, ...] | None = graphs.cache("quintic kinds", lambda: _kinds(graphs))
        self._numbers: tuple[list[Floats], list[Floats], Floats] | None = None

    @property
    def numbers(self) -> tuple[list[Floats], list[Floats], Floats]:
        """Numbers q of each block, noise of its equations, half widths of its box."""
        if self._numbers is None:
            graphs, constants = self.graphs, self.constants
            values: Call = graphs.cache("quintic numbers", lambda: _numbers(graphs))
            ends = np.cumsum([graph.q.numel() for graph in graphs.blocks])[:-1]
            q = np.split(values(constants.p)[0], ends)
            rows = graphs.units(constants.scale, constants.p)[1]
            noise = [ROUNDED * rho * unit for rho, unit in zip(constants.rho, rows, strict=True)]
            width = BOX * graphs.scene.unknowns.sizes(constants.scale)
            self._numbers = q, noise, width
        return self._numbers

    def proved(self, s: Floats, states: Floats, u: Floats) -> Booleans:
        """Return which blocks (m, nb) each step between nodes is proved for, with all before them.

        Parameters
        ----------
        s, states, u : (m, 2), (m, 2, .), (m, 2, nu) arrays
            Places of both ends, nodes there, drivers' values.
        """
        good = np.zeros((len(s), self.graphs.nb), bool)
        if self.kinds is None:
            return good
        left = np.arange(len(s))
        for parts in PARTS:
            c, line = pieces(s[left], states[left], u[left], self.graphs.nx, parts)
            held = self.boxes(c, line)[0]
            good[left] = held.reshape(len(left), parts, -1).all(axis=1)
            left = left[~good[left].all(axis=1)]
            if not left.size:
                break
        return good

    def with_all_before(self, proved: Booleans) -> Booleans:
        """Return which blocks (m, nb) are `proved` with all that they depend on."""
        whole = proved.copy()
        for b, before in enumerate(self.before):
            whole[:, b] &= whole[:, before].all(axis=1)
        return whole

    @property
    def before(self) -> list[list[int]]:
        """The blocks whose unknowns each block holds."""
        graphs = self.graphs

        def find() -> list[list[int]]:
            places = [bisect_right(graphs.first, i) - 1 for i in range(graphs.nx)]
            return [sorted({places[i] for i in graph.uses}) for graph in graphs.blocks]

        return graphs.cache("blocks before", find)

    @np.errstate(all="ignore")
    def boxes(self, c: Floats, line: Floats) -> tuple[Booleans, Floats]:
        """Return which blocks (k, nb) are proved around polynomials, and how far they are off.

        The distances (k, nx) of the unknowns hold for the whole of each part; nan: not proved.

        Parameters
        ----------
        c, line
            As `pieces` gives them.
        """
        graphs, count = self.graphs, len(c)
        size = np.abs(c).sum(axis=2)
        q, noise, width = self.numbers
        reach, whole = size + width, np.abs(line[:, : graphs.nu]) + np.abs(line[:, graphs.nu :])
        given = self._along(c, line)
        away = np.full((count, graphs.nx), np.nan)
        good = np.zeros((count, graphs.nb), bool)
        for b, graph in enumerate(graphs.blocks):
            box, parts = given[b]
            unknowns, uses = graph.own, graph.uses
            more = [away[:, uses], reach[:, unknowns], reach[:, uses], whole]
            same = [_rows(part, count) for part in (noise[b], width[unknowns], q[b])]
            distance, share = box(*parts, *more, *same)
            good[:, b] = share[:, 0] <= FILLED
            away[:, unknowns] = np.where(good[:, b, None], distance, np.nan)
        return good, away

    def _along(self, c: Floats, line: Floats) -> list[tuple[Batch, list[Floats]]]:
        """Return of each block its `box` and what `along` gives, all of a shape at once."""
        blocks, count, q = self.graphs.blocks, len(line), self.numbers[0]
        found: dict[int, tuple[Batch, list[Floats]]] = {}
        assert self.kinds is not None
        for kind in self.kinds:
            inputs = [
                [c[:, blocks[b].own].reshape(count, -1) for b in kind.blocks],
                [c[:, blocks[b].uses].reshape(count, -1) for b in kind.blocks],
                [line] * len(kind.blocks),
                [_rows(q[b], count) for b in kind.blocks],
            ]
            results = kind.along(*[np.concatenate(part) for part in inputs])
            for k, b in enumerate(kind.blocks):
                rows = slice(k * count, (k + 1) * count)
                found[b] = kind.box, [part[rows] for part in results]
        return [found[b] for b in range(len(blocks))]


def _rows(values: Floats, count: int) -> Floats:
    return np.broadcast_to(values, (count, len(values)))


def pieces(s: Floats, states: Floats, u: Floats, nx: int, parts: int) -> tuple[Floats, Floats]:
    """Return polynomials over parts of steps, and the drivers' line, of -1 <= t <= 1.

    Coefficients (m parts, nx, 6), and values in the middle and rates (m parts, 2 nu).
    """
    h = (s[:, 1] - s[:, 0])[:, None]
    (x0, v0, a0), (x1, v1, a1) = (
        (states[:, k, :nx], states[:, k, nx : 2 * nx] * h, states[:, k, 2 * nx : 3 * nx] * h * h)
        for k in (0, 1)
    )
    c = np.stack([x0, v0, a0 / 2, *upper_coefficients(x1 - x0, v0, v1, a0, a1)], axis=2)
    middles = (np.arange(parts) + 0.5) / parts
    shifted = np.einsum("mnj,pjk->mpnk", c, np.stack([_shift(t, 0.5 / parts) for t in middles]))
    rise = u[:, 1] - u[:, 0]
    centre = u[:, :1] + middles[None, :, None] * rise[:, None]
    rate = np.broadcast_to(rise[:, None] * (0.5 / parts), centre.shape)
    line = np.concatenate([centre, rate], axis=2)
    return shifted.reshape(-1, nx, COUNT), line.reshape(len(s) * parts, -1)


def _shift(t: float, h: float) -> Matrix:
    """Return what makes coefficients of polynomials in t those in (t - middle) / h."""
    matrix = np.zeros((COUNT, COUNT))
    for j in range(COUNT):
        for k in range(j + 1):
            matrix[j, k] = _BINOMIAL[j, k] * t ** (j - k) * h**k
    return matrix


_BINOMIAL = np.array([[math.comb(j, k) for k in range(COUNT)] for j in range(COUNT)], float)


def _kinds(graphs: Graphs) -> tuple[Kind, ...] | None:
    """Return the shapes of the blocks with their functions, None where one has none."""
    if graphs.course is not None:
        return None
    by_shape: dict[int, list[int]] = {}
    for b, graph in enumerate(graphs.blocks):
        if not graph.shape.shared:
            return None
        by_shape.setdefault(id(graph.shape), []).append(b)
    kinds = []
    for blocks in by_shape.values():
        shape = graphs.blocks[blocks[0]].shape
        try:
            along, box = shape.cache("quintic", partial(_functions, shape))
        except (NoSeries, NoMajorant):
            return None
        kinds.append(Kind(tuple(blocks), along, box))
    return tuple(kinds)


def _functions(shape: Any) -> tuple[Batch, Batch]:
    return Batch(quintic_boxes.along(shape)), Batch(quintic_boxes.box(shape))


def _numbers(graphs: Graphs) -> Call:
    """Return the numbers of all blocks as a function of p."""
    values = ca.vertcat(ca.SX(0, 1), *[graph.q for graph in graphs.blocks])
    return Call(ca.Function("numbers", [graphs.p], [ca.densify(values)]))
