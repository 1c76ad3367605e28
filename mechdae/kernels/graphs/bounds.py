"""Bounds that hold for a whole sweep of a scene, or wherever the caller says, as casadi functions.

Majorants where every operation has one, enclosures in boxes for curves.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import casadi as ca

from mechdae.equations.structure_cache import structure_property
from mechdae.kernels.bounds.walk import ROUNDOFF, NoMajorant, majorant
from mechdae.kernels.graphs.blocks import BlockGraph, column, norm, placed, row_reaches
from mechdae.kernels.graphs.pose import PoseGraphs
from mechdae.kernels.run.functions import Call
from mechdae.kernels.stored.functions import stored_property
from mechdae.types import Graph, Sym

SX = ca.SX
ALLOWANCE = 1 + 2.0**-10
"""By what reported bounds are larger than their formula, which rounding makes uncertain."""


class BoundGraphs(PoseGraphs):
    """Functions of a pose, and bounds of equations and outputs."""

    def _bound(
        self,
        expressions: Sym,
        moving: list[Sym],
        sizes: list[Sym],
        ranges: list[tuple[Sym, Sym]],
        noise: Mapping[int, Sym] | None = None,
    ) -> tuple[Sym, Sym]:
        """Return bounds of |expressions| and, with `noise` of parameters, of their rounding errors.

        `ranges` are tighter than `sizes`, and used by the curves that need it.
        """
        try:
            return majorant(expressions, moving, sizes, noise)
        except NoMajorant:
            if not self.contacts:
                raise
            from mechdae.kernels.bounds.intervals import enclosure

            return enclosure(expressions, moving, ranges, self.floors, noise is not None)

    def _ranges(self, sizes: list[Sym]) -> list[tuple[Sym, Sym]]:
        """Return where unknowns and drivers lie: contacts in a box, the rest by their sizes."""
        low = placed(-sizes[0], self.places, self.low) if self.places else -sizes[0]
        high = placed(+sizes[0], self.places, self.high) if self.places else +sizes[0]
        return [(low, high), (-sizes[1], sizes[1])]

    @structure_property
    def enclosed(self) -> bool:
        """Whether some bounds hold in boxes of the contacts' places only, see `_ranges`."""
        return bool(self.contacts) and not all(self.plain(b) for b in range(self.nb))

    # -- constants of a sweep --------------------------------------------------------------

    @stored_property
    def constants(self) -> Graph:
        """Bounds that hold for a whole sweep.

        (|x|, |u|, p, scale, floors, low, high) -> kappa, rho, mu (nb,): Lipschitz constant of
        J, rounding of F (norm of its rows), bound of |J|. Contacts lie between low and high.
        Raises `NoMajorant` where an operation has no bound.
        """
        sizes = [SX.sym("size_x", self.nx), SX.sym("size_u", self.nu)]
        ranges = self._ranges(sizes)
        kappas: list[Sym] = []
        rhos: list[Sym] = []
        mus: list[Sym] = []
        for b, graph in enumerate(self.blocks):
            size, box = self._own(graph, sizes, ranges)
            if graph.reaches is not None:
                kappa, rho, mu = self._reached(b, size)
            else:
                make = partial(self._constants, b, box)
                kappa, rho, mu = self._once("constants", b, make, [*size, graph.noise])
            kappas.append(kappa)
            rhos.append(rho + self.tolerated / self.scale if graph.redundant else rho)
            mus.append(mu)
        results = [ca.densify(column(parts)) for parts in (kappas, rhos, mus)]
        inputs = [*sizes, self.p, self.scale, self.floor, self.low, self.high]
        return ca.Function("constants", inputs, results)

    def _constants(self, b: int, box: list[tuple[Sym, Sym]], *sizes: Sym) -> list[Sym]:
        """Return kappa, rho and mu of a block for the sizes of x, z, u and the noise of q."""
        graph, (w, r) = self.blocks[b], self.weights[b]
        shape, size = graph.shape, list(sizes[:3])
        noise = {
            q.element_hash(): error
            for q, error in zip(shape.q.elements(), sizes[3].elements(), strict=True)
        }
        _, rounding = self._bound(shape.F, shape.moving, size, box, noise)
        bound, _ = self._bound(shape.J, shape.moving, size, box)
        square = ca.reshape(bound, graph.rows, graph.size)
        if graph.redundant:
            rounding += square @ size[0] + self._data(shape.F, shape.q, shape.moving, size, box)
        rho, mu = ROUNDOFF * norm(rounding / r), norm(ca.diag(1 / r) @ square @ ca.diag(w))
        return [self._lipschitz(b, size, box), rho, mu]

    def _reached(self, b: int, size: list[Sym]) -> list[Sym]:
        """Return the same of a block in space, from reaches; rounding as its terms say if less."""
        graph, (w, r) = self.blocks[b], self.weights[b]
        assert graph.reaches is not None
        bends, unknowns = graph.reaches.bounds(size, whole=True), range(graph.size)
        square = bends.first[:, unknowns]
        rounding = ca.fmin(
            bends.rounding, self._bound(graph.F, graph.shape.moving, size, [], {})[1]
        )
        if graph.redundant:
            rounding += square @ size[0] + bends.data
        kappa = self.lipschitz_of(graph, bends.second, w, r)
        mu = norm(ca.diag(1 / r) @ square @ ca.diag(w))
        return [kappa, ROUNDOFF * norm(rounding / r), mu]

    @staticmethod
    def lipschitz_of(graph: BlockGraph, bends: list[Sym], w: Sym, r: Sym) -> Sym:
        """Return the constant of a block's weighted Jacobian by bounds of second derivatives."""
        unknowns = range(graph.size)
        rows = [norm(ca.diag(w) @ b[unknowns, unknowns] @ ca.diag(w)) for b in bends]
        return norm(column(rows) / r)

    def _own(
        self, graph: BlockGraph, sizes: list[Sym], ranges: list[tuple[Sym, Sym]]
    ) -> tuple[list[Sym], list[tuple[Sym, Sym]]]:
        """Return sizes and ranges of what a block's equations hold: x, z, u."""
        (low, high), unknowns, used = ranges[0], graph.own, graph.used
        size = [sizes[0][unknowns], used(sizes[0]), sizes[1]]
        return size, [(low[unknowns], high[unknowns]), (used(low), used(high)), ranges[1]]

    def _lipschitz(self, b: int, sizes: list[Sym], ranges: list[tuple[Sym, Sym]]) -> Sym:
        """Return a Lipschitz constant of a block's weighted Jacobian in its own unknowns."""
        graph, shape = self.blocks[b], self.blocks[b].shape
        w, r = self.weights[b]
        bent = ca.jacobian(ca.vec(shape.J), shape.x)
        bound, _ = self._bound(bent, shape.moving, sizes, ranges)
        square = ca.reshape(bound, graph.rows * graph.size, graph.size) @ ca.diag(w)
        pairs = ca.reshape(square, graph.rows, graph.size * graph.size)
        return norm(ca.diag(1 / r) @ pairs @ ca.diag(ca.kron(SX.ones(graph.size), w)))

    def bends(self, b: int) -> Graph:
        """Return bounds of a block's second derivatives, entry by entry.

        (|x|, |u|, p) -> |dJ/dx|, |dJ/dz|, |dF/dz|, J column by column.
        """
        graph, sizes = self.blocks[b], [SX.sym("size_x", self.nx), SX.sym("size_u", self.nu)]
        size, box = self._own(graph, sizes, self._ranges(sizes))
        if graph.reaches is not None:
            return ca.Function("bends", [*sizes, self.p], self._bends(graph, size))
        moving = [graph.x, graph.z, self.scene.u]
        results = []
        for value, symbols in ((graph.J, graph.x), (graph.J, graph.z), (graph.F, graph.z)):
            entries = ca.vec(ca.densify(value))
            bound, _ = self._bound(ca.jacobian(entries, symbols), moving, size, box)
            shaped = ca.reshape(bound, entries.numel(), symbols.numel())
            results.append(ca.densify(ca.vec(shaped)))
        return ca.Function("bends", [*sizes, self.p], results)

    def _bends(self, graph: BlockGraph, size: list[Sym]) -> list[Sym]:
        """Return what `bends` does of a block in space."""
        assert graph.reaches is not None
        found = graph.reaches.bounds(size, whole=True)
        unknowns, used = range(graph.size), range(graph.size, graph.size + len(graph.uses))
        columns = [ca.horzcat(*[bend[j, :].T for bend in found.second]).T for j in unknowns]
        whole = ca.vertcat(*columns)  # entries of J column by column, by all that moves
        parts = (whole[:, unknowns], whole[:, used], found.first[:, used])
        return [ca.densify(ca.vec(part)) for part in parts]

    def _data(
        self, F: Sym, p: Sym, moving: list[Sym], sizes: list[Sym], ranges: list[tuple[Sym, Sym]]
    ) -> Sym:
        """Return how much F changes when each parameter of `p` changes by its own size."""
        if not p.numel():
            return SX.zeros(F.numel())
        slope, _ = self._bound(ca.jacobian(F, p), moving, sizes, ranges)
        return ca.reshape(slope, F.numel(), p.numel()) @ ca.fabs(p)

    def plain(self, b: int) -> bool:
        """Return whether majorants bound a block for all poses."""
        shape = self.blocks[b].shape

        def bounded() -> bool:
            try:
                majorant(shape.F, [shape.x], [shape.x])
            except NoMajorant:
                return False
            return True

        return bool(shape.cache("plain", bounded))

    @stored_property
    def check_bounds(self) -> Graph:
        """Bounds that hold for the scene's checks r, equations without unknowns of their own.

        (|x|, |u|, p, scale, floors, low, high) -> bound of |dr/dx| (nc, nx), change of r by
        rounding (nc,) of its terms and of parameters, or as far as it may stay open.
        """
        sizes = [SX.sym("size_x", self.nx), SX.sym("size_u", self.nu)]
        moving, ranges = [self.scene.x, self.scene.u], self._ranges(sizes)
        rows = ca.vertcat(*[check.residual for check in self.scene.checks])
        inputs = [*sizes, self.p, self.scale, self.floor, self.low, self.high]
        also = [self.tolerated / (1 if c.unit == "m" else self.scale) for c in self.scene.checks]
        known = row_reaches(self.scene, rows, [c.reach for c in self.scene.checks], moving)
        if known is not None:
            found = known.bounds(sizes, whole=True)
            rounding = ROUNDOFF * (found.rounding + found.data) + column(also)
            results = [found.first[:, : self.nx], rounding]
            return ca.Function("check_bounds", inputs, [ca.densify(part) for part in results])
        slope, _ = self._bound(ca.jacobian(rows, self.scene.x), moving, sizes, ranges)
        _, rounding = self._bound(rows, moving, sizes, ranges, noise={})
        rounding += self._data(rows, self.p, moving, sizes, ranges)
        shaped = ca.reshape(slope, rows.numel(), self.nx)
        rounding = ROUNDOFF * rounding + column(also)
        return ca.Function("check_bounds", inputs, [ca.densify(shaped), rounding])

    @structure_property
    def output_slopes(self) -> tuple[list[int], list[int], Call]:
        """`output_bounds` in one buffer: rows and columns of the slopes, what gives both."""
        function = self.output_bounds
        at = function.sx_in()
        slope, rounding = function(*at)
        entries = ca.vertcat(SX(0, 1), *slope.nonzeros())
        results = [ca.densify(entries), ca.densify(rounding)]
        rows, columns = slope.sparsity().get_triplet()
        return rows, columns, Call(ca.Function("slopes", at, results))

    @stored_property
    def output_bounds(self) -> Graph:
        """Bounds that hold for the outputs y of a whole sweep.

        (|x|, |u|, p, floors, low, high) -> bound of |dy/dx| (ny, nx), sparse, and rounding of
        y (ny,), both with the `ALLOWANCE`.
        """
        sizes = [SX.sym("size_x", self.nx), SX.sym("size_u", self.nu)]
        moving, ranges = [self.scene.x, self.scene.u], self._ranges(sizes)
        jacobian = ca.jacobian(self.outputs, self.scene.x)
        inputs = [*sizes, self.p, self.floor, self.low, self.high]
        _, rounding = self._bound(self.outputs, moving, sizes, ranges, noise={})
        known = row_reaches(self.scene, self.outputs, self.scene.reaches_of(self.outputs), moving)
        if known is not None:
            found = known.bounds(sizes, whole=True)
            shaped = ca.project(found.first[:, : self.nx], jacobian.sparsity())
            return ca.Function(
                "output_bounds", inputs, self._allowed(shaped, ca.fmin(rounding, found.rounding))
            )
        slope, _ = self._bound(column(jacobian.nonzeros()), moving, sizes, ranges)
        shaped = SX(jacobian.sparsity(), slope)
        return ca.Function("output_bounds", inputs, self._allowed(shaped, rounding))

    @staticmethod
    def _allowed(slope: Sym, rounding: Sym) -> list[Sym]:
        """Return slopes and rounding of outputs with the allowance for all roundings of bounds."""
        return [ALLOWANCE * slope, ALLOWANCE * ROUNDOFF * rounding]
