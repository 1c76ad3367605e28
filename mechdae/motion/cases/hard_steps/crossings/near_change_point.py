"""Poses near change points: a block's own equations lose all digits there.

The unknowns of the crossing blocks come from the branch's expansion through the crossing; where
branches are known to pass each other they are solved for in 50 digits, from there. All others are
solved for as usual.

Poses where branches nearly meet, solved in 50 digits: there doubles lose as many as the gap has.

Newton and Kantorovich prove each: with the last step eta, beta = |J^-1| and kappa a Lipschitz
constant of J, beta kappa eta <= 1/4 says that one solution is within 2 eta. Which branch it is on
is told by the sign of its determinant: next to a crossing those of both branches differ.
"""

from __future__ import annotations

from collections.abc import Callable
from decimal import Context, Decimal, localcontext
from typing import Any

import casadi as ca
import numpy as np

from mechdae.kernels.graphs.singular import jets
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import Batch
from mechdae.kernels.run.high_precision import DIGITS, NoDecimals, decimals, exactly
from mechdae.motion.cases.hard_steps.crossings.across_change_point import Zone
from mechdae.motion.continuation.any_path import AnyPath
from mechdae.motion.continuation.step_sizes import PASS
from mechdae.motion.setup.scales import Constants
from mechdae.numerics.null_space import solve
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Graph, Integers, Unknowns

REFINED = 6
"""Newton steps for unknowns of earlier blocks, which are regular: each gives some 14 digits."""
STEPS = 12
SETTLED = 1e-36
"""Share of the natural sizes below which a step is the last one."""
CERTAIN = 0.25
Vector = list[Decimal]


@dataclass(frozen=True, eq=False)
class ExactPose:
    """Unknowns of a block with two rates by s, and a bound of the unknowns' errors, all (n,)."""

    x: Floats
    v: Floats
    a: Floats
    error: Floats


class ExactPoses:
    """Solves for one block, and those it depends on, in 50 digits.

    Parameters
    ----------
    graphs, constants
        Functions and numbers of the scene.
    """

    def __init__(self, graphs: Graphs, constants: Constants) -> None:
        self.graphs, self.constants = graphs, constants
        self.sizes: Floats = graphs.scene.unknowns.sizes(constants.scale)
        self.columns, self.rows = graphs.units(constants.scale, constants.p)

    def at(self, b: int, driven: list[Any], whole: list[Floats], sign: float) -> ExactPose | None:
        """Return the pose of block `b`, None where nothing is proved.

        Parameters
        ----------
        driven
            The drivers' values and three derivatives by s, (nd,) each.
        whole
            Unknowns (nx,), rough for the block, near the pose for earlier ones; of these also
            three derivatives by s.
        sign
            Of the determinant on the branch that is meant.
        """
        try:
            with localcontext(Context(prec=DIGITS)):
                return self._at(b, driven, whole, sign)
        except (NoDecimals, ArithmeticError, np.linalg.LinAlgError):
            return None

    def _at(
        self, b: int, driven: list[Floats], whole: list[Floats], sign: float
    ) -> ExactPose | None:
        graph, u = self.graphs.blocks[b], [exactly(value) for value in driven[0]]
        x = [exactly(value) for value in whole[0]]
        for k in self.graphs.ancestors(b)[:-1]:
            if not self._settled(k, x, u):
                return None
        unknowns, size = graph.own, self.sizes[graph.own]
        for _ in range(STEPS):
            inv, det, step = self._newton(b, x, u)
            for i, change in zip(unknowns, step, strict=True):
                x[i] -= change
            moved = float(max(abs(d / exactly(w)) for d, w in zip(step, size, strict=True)))
            if moved <= SETTLED:
                break
        else:
            return None
        w, r = self.columns[b], self.rows[b]
        scaled = np.array([[float(value) for value in row] for row in inv]) * r / w[:, None]
        h = float(np.linalg.norm(scaled)) * self.constants.kappa[b] * moved * np.sqrt(len(unknowns))
        if not (h <= CERTAIN and np.sign(float(det)) == sign):
            return None
        v, a = self._rates(b, inv, x, driven, whole)
        value = np.array([float(x[i]) for i in unknowns])
        error = np.spacing(np.abs(value)) + 2 * moved * np.sqrt(len(unknowns)) * w
        return ExactPose(value, v, a, error + self._by_drivers(b, x, u, inv))

    def _settled(self, k: int, x: Vector, u: Vector) -> bool:
        """Solve for an earlier block in place; return whether Newton's method came to rest."""
        graph = self.graphs.blocks[k]
        near = np.array([float(value) for value in x])
        J = graph.value_at(near, np.array([float(value) for value in u]), self.constants.p)[1]
        moved = np.inf
        for _ in range(REFINED):
            F = self._value(k, x, u)[: graph.rows]
            scale = max(map(abs, F)) or Decimal(1)  # doubles have no room for 1e-40
            step = solve(J, np.array([float(value / scale) for value in F]))
            for i, change in zip(graph.own, step, strict=True):
                x[i] -= exactly(change) * scale
            moved = float(np.max(np.abs(step) / self.sizes[graph.own])) * float(scale)
        return bool(moved <= SETTLED)

    def _value(self, b: int, x: Vector, u: Vector) -> Vector:
        """Return F and J, column by column, of a block."""
        graph = self.graphs.blocks[b]

        def make() -> Graph:
            inputs = [graph.x, graph.z, self.graphs.scene.u, graph.p]
            return ca.Function("FJ", inputs, [ca.densify(ca.vertcat(graph.F, ca.vec(graph.J)))])

        function = self.graphs.cache(("F and J", b), make)
        parts = [[x[i] for i in graph.own], [x[i] for i in graph.uses]]
        return decimals(function, [*parts, u, self.constants.p[graph.params]])

    def _newton(self, b: int, x: Vector, u: Vector) -> tuple[list[Vector], Decimal, Vector]:
        """Return the inverse of a block's Jacobian, the determinant, and Newton's step."""
        n, values = self.graphs.blocks[b].size, self._value(b, x, u)
        J = [[values[n * (1 + j) + i] for j in range(n)] for i in range(n)]
        inv, det = inverse(J)
        return inv, det, product(inv, values[:n])

    def _rates(
        self, b: int, inv: list[Vector], x: Vector, driven: list[Floats], whole: list[Floats]
    ) -> tuple[Floats, Floats]:
        """Return x' and x'' of a block; those of earlier ones are given in doubles."""
        graph, g = self.graphs.blocks[b], self.graphs

        def make() -> Graph:
            function = jets(g.scene, graph)
            symbols = function.sx_in()
            found = function(*symbols)
            return ca.Function("rates", symbols, [ca.vertcat(found[2], found[3])])

        function, n, nothing = g.cache(("rates", b), make), graph.size, [Decimal(0)] * graph.size
        z = [[x[i] for i in graph.uses], *(part[graph.uses] for part in whole[1:])]
        at = [*z, *driven, self.constants.p]
        values, v = [x[i] for i in graph.own], nothing
        for order in range(2):
            known = decimals(function, [values, v, nothing, *at])[order * n : (order + 1) * n]
            found = [-value for value in product(inv, known)]
            if order == 0:
                v = found
        first, second = (np.array([float(value) for value in part]) for part in (v, found))
        return first, second

    def _by_drivers(self, b: int, x: Vector, u: Vector, inv: list[Vector]) -> Any:
        """Return what the last place of the drivers' values does to the unknowns (n,).

        One driver is at its value; along lines and laws values are rounded.
        """
        if self.graphs.single:
            return 0.0
        graph, g = self.graphs.blocks[b], self.graphs

        def make() -> Graph:
            slope = ca.densify(ca.jacobian(graph.F, g.scene.u))
            return ca.Function("by_u", [graph.x, graph.z, g.scene.u, graph.p], [slope])

        function = g.cache(("by drivers", b), make)
        parts = [[float(x[i]) for i in places] for places in (graph.own, graph.uses)]
        values = [float(value) for value in u]
        slope = np.array(function(*parts, values, self.constants.p[graph.params]))
        Y = np.array([[float(value) for value in row] for row in inv])
        return np.abs(Y @ slope) @ np.spacing(np.abs(values))


def inverse(matrix: list[Vector]) -> tuple[list[Vector], Decimal]:
    """Return the inverse of a small matrix and its determinant, by Gauss and Jordan.

    Raises
    ------
    ArithmeticError
        It is singular.
    """
    n, det = len(matrix), Decimal(1)
    rows = [[*row, *(Decimal(int(i == j)) for j in range(n))] for i, row in enumerate(matrix)]
    for k in range(n):
        best = max(range(k, n), key=lambda i: abs(rows[i][k]))
        if best != k:
            rows[k], rows[best], det = rows[best], rows[k], -det
        pivot = rows[k][k]
        if pivot == 0:
            raise ArithmeticError
        det *= pivot
        rows[k] = [value / pivot for value in rows[k]]
        for i in range(n):
            if i != k:
                share = rows[i][k]
                rows[i] = [a - share * c for a, c in zip(rows[i], rows[k], strict=True)]
    return [row[n:] for row in rows], det


def product(matrix: list[Vector], vector: Vector) -> Vector:
    """Return the product of a matrix and a vector."""
    return [sum((a * c for a, c in zip(row, vector, strict=True)), Decimal(0)) for row in matrix]


Rates = tuple[Any, ...]
PASSES = 2


class ZonePoses:
    """Writes the poses near change points into the results of the pose kernel."""

    def __init__(self, graphs: Graphs) -> None:
        self.graphs = graphs
        self._exact: dict[tuple[Zone, float], ExactPose | None] = {}

    def estimated(self, path: AnyPath, s: Floats, places: Floats) -> bool:
        """Return whether a bound of the poses at `s`, which the path passes at `places`, is none.

        Those of branches that pass each other are proved where the pose was solved in 50 digits.
        """
        index = path.zone_at(places)
        return any(
            path.zones[k].action != PASS or self._exact.get((path.zones[k], at)) is None
            for k, at in zip(index.tolist(), s.tolist(), strict=True)
            if k >= 0
        )

    def _function(self, blocks: frozenset[int]) -> Batch:
        def make() -> Batch:
            function = self.graphs.held(blocks)
            return Batch(function, [function.n_in() - 4])

        return self.graphs.cache(("held", blocks), make)

    def held(self, path: AnyPath, s: Floats) -> Booleans:
        """Return which blocks are given by the expansion at a change point, (n, nb)."""
        held = np.zeros((len(s), self.graphs.nb), bool)
        index = path.zone_at(s)
        for row in np.flatnonzero(index >= 0):
            held[row, sorted(path.zones[index[row]].blocks)] = True
        return held

    def write(
        self,
        path: AnyPath,
        s: Floats,
        places: Floats,
        guess: Unknowns,
        results: list[Floats],
        rates: Rates,
        pose: Callable[[Any, Any, Rates], list[Any]],
    ) -> None:
        """Replace the results at poses whose `places` on the path lie in a zone.

        `s` is the same, or whole turns of the driver away. `pose` is the ordinary kernel
        (x, s, rates) -> results; at the ends of the zones it gives the errors that the expansion
        passes on.
        """
        index = path.zone_at(places)
        rows = np.flatnonzero(index >= 0)
        if not rows.size:
            return
        used = sorted(set(index[rows].tolist()))
        ends = np.array([[path.zones[k].low, path.zones[k].high] for k in used]).ravel()
        corners = np.concatenate([path.zones[k].nodes[1][[0, -1]] for k in used])
        still = (np.zeros((len(ends), self.graphs.nu)),) * len(self.graphs.driven)
        passed = pose(corners, ends, still)[1].reshape(len(used), 2, -1).max(axis=1)
        x, v, a, error = (np.empty((len(rows), self.graphs.nx)) for _ in range(4))
        zones = index[rows]
        for k, inherited in zip(used, passed, strict=True):
            here = np.flatnonzero(zones == k)
            zone = path.zones[k]
            columns = [i for b in sorted(zone.blocks) for i in self.graphs.blocks[b].own]
            x[here], v[here], a[here] = zone.carried(places[rows[here]], columns)
            error[here] = 2 * inherited + zone.remainder
            if zone.action == PASS:
                self._sharpen(path, zone, s[rows[here]], here, (x, v, a, error))
        kinds = [path.zones[k].blocks for k in zones]
        for blocks in dict.fromkeys(kinds):
            here = np.array([i for i, kind in enumerate(kinds) if kind == blocks])
            some = rows[here]
            expanded = [part[here] for part in (x, v, a, error)]
            moving = [] if self.graphs.single else [rate[some] for rate in rates]
            found = self._solved(blocks, path, s[some], guess[some], moving, expanded)
            for whole, new in zip(results, found, strict=True):
                whole[some] = new

    def _sharpen(
        self, path: AnyPath, zone: Zone, s: Floats, rows: Integers, parts: tuple[Any, ...]
    ) -> None:
        """Solve for the crossing block in 50 digits in `rows` of x, x', x'' and error, in place.

        The drivers have their values at `s`. What is not proved stays as it is.
        """
        (crossing,) = zone.crossings
        g, b = self.graphs, crossing.block
        unknowns, n = g.blocks[b].own, g.nx
        _, J, _ = g.blocks[b].value_at(
            zone.nodes[1][0], path.drivers(np.array([zone.low]))[0], path.constants.p
        )
        sign, solver = float(np.sign(np.linalg.det(J))), ExactPoses(g, path.constants)
        for row, at in zip(rows.tolist(), s.tolist(), strict=True):
            key = (zone, at)
            if key not in self._exact:
                whole = [parts[0][row], parts[1][row], parts[2][row], np.zeros(n)]
                self._exact[key] = solver.at(b, path.motion(at), whole, sign)
            found = self._exact[key]
            if found is not None:
                values = (found.x, found.v, found.a, found.error)
                for whole, value in zip(parts, values, strict=True):
                    whole[row, unknowns] = value

    def _solved(
        self,
        blocks: frozenset[int],
        path: AnyPath,
        s: Floats,
        guess: Unknowns,
        rates: list[Floats],
        expanded: list[Floats],
    ) -> list[Floats]:
        """Return the results at poses of a zone: unknowns of `blocks` by their expansion."""
        given = {i for b in blocks for i in self.graphs.blocks[b].own}
        outside = np.array([i for i in range(self.graphs.nx) if i not in given], int)
        start, *terms = expanded
        start[:, outside] = guess[:, outside]
        u, consts, function = path.drivers(s), path.constants.consts, self._function(blocks)
        for _ in range(PASSES):
            part = function(start, u, *rates, consts, *terms)
            start = part[0]
        part[3][~np.isfinite(part[3])] = np.inf
        return part
