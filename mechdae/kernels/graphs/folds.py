"""Graphs of limit positions, and what bounds of a step are made of in space and on curves.

Notation and theorem are those of `mechdae.kernels.graphs.pose`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca

from mechdae.additions import of_cases
from mechdae.equations.structure_cache import structure_property
from mechdae.kernels.bounds.walk import majorant
from mechdae.kernels.graphs.blocks import column, norm, placed
from mechdae.kernels.graphs.bounds import BoundGraphs
from mechdae.kernels.run.functions import without_repeats
from mechdae.types import Graph, Sym

SX = ca.SX
Pair = tuple[Any, Any]
"""Of the own unknowns of a block and of the earlier ones that it holds."""
PATH_STEP_LIMIT = 0.45
SPATIAL_NEAR = 1 / 16
"""How far around a step the bounds from reaches hold, in the units of the unknowns."""


class FoldGraphs(BoundGraphs):
    """The part of a scene's functions for limit positions, space and curves; see `Graphs`."""

    advance: Graph
    _tube: Callable[..., tuple[Sym, Sym, Sym]]
    _reach: Callable[..., Sym]
    _drivers: Callable[..., tuple[Sym, Sym, Sym]]

    @structure_property
    def divisors(self) -> tuple[Graph, Graph]:
        """What curves divide by: its size at a pose, and at least in a whole sweep.

        Functions (x, u, p) -> |divisor| and (|x|, |u|, p, low, high) -> lower bound, 0
        without one.
        """
        from mechdae.kernels.bounds.intervals import lower_bounds

        functions = (self.constants, self.advance, self.output_bounds)  # they name them all
        assert all(function is not None for function in functions)
        sizes = [SX.sym("size_x", self.nx), SX.sym("size_u", self.nu)]
        moving = [self.scene.x, self.scene.u]
        stacked = ca.vertcat(*self.floors.divisors) if self.floors.divisors else SX(0, 1)
        least = lower_bounds(stacked, moving, self._ranges(sizes))
        return (
            ca.Function("divisors", [*moving, self.p], [ca.fabs(stacked)]),
            ca.Function("least", [*sizes, self.p, self.low, self.high], [least]),
        )

    def _reached_tube(
        self,
        b: int,
        x: Pair,
        v: Pair,
        away: Sym,
        u: Sym,
        du: Sym,
        limits: list[Sym],
        drift: list[Sym],
        numbers: tuple[Sym, ...],
    ) -> list[Sym]:
        """Return the same for a block in space, from reaches: `away` of earlier unknowns.

        All bounds are of the places within `SPATIAL_NEAR` of the tangent, which the radius must not
        exceed: slides are nowhere near the largest that a sweep may have.
        """
        (ds, rho), graph = numbers, self.blocks[b]
        assert graph.reaches is not None
        (w, r), unknowns = self.weights[b], range(graph.size)
        wide = [limits[0] + SPATIAL_NEAR * w, *limits[1:3]]
        found, rates = graph.reaches.bounds(wide, whole=False), ca.vertcat(*limits[3:])
        F, J, _ = graph.shape.at(*x, u)
        inv, _ = self.inverse_of(b, J)
        size = ca.fabs(ca.diag(1 / w) @ inv)
        off = ca.vertcat(SX(graph.size, 1), away, drift[0] if drift else SX(self.nu, 1))
        bent = [bend @ rates for bend in found.second]
        tau = ca.vertcat(*[ca.dot(rates, bend) for bend in bent])
        residual = ds * ds * tau / 2 + ca.fabs(F) + found.first @ off + rho * r
        rows = [
            ds * one[unknowns] + (bend @ off)[unknowns]
            for one, bend in zip(bent, found.second, strict=True)
        ]
        delta = norm(size @ ca.horzcat(*rows).T @ ca.diag(w))
        left = ca.fmax(1 - delta, 1e-9)
        eta = norm(size @ residual) / left
        turned = [ca.diag(w) @ bend[unknowns, unknowns] @ ca.diag(w) for bend in found.second]
        turned = [sum((size[j, i] * t for i, t in enumerate(turned)), SX(0)) for j in unknowns]
        h = norm(column([norm(t) for t in turned])) * eta / left
        radius = 2 * eta / (1 + ca.sqrt(ca.fmax(1 - 2 * h, 0)))
        off = ca.vertcat(radius * w, off[graph.size :])
        spread = ds * ca.fabs(ca.vertcat(*v, du)) + off
        bent = ca.vertcat(*[ca.dot(spread, bend @ spread) for bend in found.second])
        parts = ca.vertsplit(off, [0, graph.size, graph.size + away.numel(), off.numel()])
        pushed = found.first[:, -self.nu :] @ parts[2]
        reach = self._reach(b, x, u, parts, bent, rho, pushed)
        test = ca.fmax(ca.fmax(delta / 0.9, h / PATH_STEP_LIMIT), radius / SPATIAL_NEAR)
        return [test, radius, reach]

    def _around(self, at: Pair, u: Sym, spread: list[Sym]) -> list[tuple[Sym, Sym]]:
        """Return where unknowns and drivers lie that leave their places by `spread`, and this."""
        places = [(i - d, i + d) for i, d in zip((*at, u), spread, strict=True)]
        return [*places, *[(-d, d) for d in spread]]

    def _sizes(self, unknowns: list[int]) -> Sym:
        return column([self.scene.unknowns[i].size_symbol(self.scale) for i in unknowns])

    def _step_ranges(
        self,
        b: int,
        x: Pair,
        v: Pair,
        away: Pair,
        u: Sym,
        du: Sym,
        across: Sym,
        ds: Sym,
        near: Sym = 0.0,
    ) -> list[tuple[Sym, Sym]]:
        """Return where unknowns, drivers and rates of a block lie over a step.

        The unknowns, its own and earlier ones, leave their tangents by `away`, the drivers their
        values by `across`; the unknowns may lie `near`, in their units, on both sides of that.
        """
        graph, around = self.blocks[b], []
        for i, di, d, places in zip(x, v, away, (graph.own, graph.uses), strict=True):
            reach = ds * ca.fabs(di) + d + near * self._sizes(places)
            around.append((i - reach, i + reach))
        return [*around, (u - across, u + across), *[(rate, rate) for rate in v], (du, du)]

    # -- limit positions -------------------------------------------------------------------

    def turn(self, b: int) -> Graph:
        """Return bounds for a block and its ancestors over a step along a tangent of (x, s).

        (x, x', u, u', |x|, |u|, d, step, p, columns, rows) -> largest |F|, change of the Jacobian
        in (x, s), its Lipschitz constant where unknowns and drivers stay below |x| and |u|; all in
        units of the unknowns and s (`columns`) and of the equations (`rows`).
        """
        blocks = self.ancestors(b)
        if any(self.blocks[k].reaches is not None for k in blocks):
            return self._reached_turn(blocks)
        chain, F, inputs, residual = self._turning(blocks)
        _, v, _, du, size_x, size_u, d, ds, _, w, r = inputs
        s, x, u = SX.sym("s"), self.scene.x, self.scene.u
        moved, every = ca.substitute(F, u, u + d * s), ca.vertcat(x[chain], s)
        J = ca.jacobian(moved, every)
        row, of = map(list, J.sparsity().get_triplet())
        entries = column(J.nonzeros())
        bent = ca.substitute(ca.jacobian(entries, every), s, 0)
        entry, other = map(list, bent.sparsity().get_triplet())
        share = column([w[j] / r[i] for i, j in zip(row, of, strict=True)])
        straight, rates = ca.vertcat(x, u), ca.vertcat(v, du)
        along = ca.jtimes(ca.jtimes(F, straight, rates), straight, rates)
        turned = ca.jtimes(ca.substitute(entries, s, 0), straight, rates)
        moving, sizes = [x, u, v, du, d], [ca.fabs(v), ca.fabs(du), ca.fabs(d)]
        near = [ca.fabs(self.x) + ds * sizes[0], ca.fabs(self.u) + ds * sizes[1], *sizes]
        left = residual(majorant(along, moving, near)[0])
        change = ds * majorant(turned, moving, near)[0]
        square, _ = majorant(column(bent.nonzeros()), moving, [size_x, size_u, *sizes])
        unit = column([share[i] * w[j] for i, j in zip(entry, other, strict=True)])
        results = [left, norm(change * share), norm(square * unit)]
        return ca.Function("turn", inputs, [ca.densify(part) for part in results])

    def _turning(self, blocks: list[int]) -> tuple[list[int], Sym, list[Sym], Callable[[Sym], Sym]]:
        """Return unknowns and equations of blocks, the inputs of `turn`, and what is largest |F|.

        That is a function of the bound of F'' along the tangent.
        """
        chain = [i for k in blocks for i in self.blocks[k].own]
        names = ("v", "du", "size_x", "size_u", "d")
        v, du, size_x, size_u, d = (
            SX.sym(name, self.nu if name in ("du", "size_u", "d") else self.nx) for name in names
        )
        F = ca.vertcat(*[self.blocks[k].F for k in blocks])
        ds, w, r = SX.sym("ds"), SX.sym("columns", len(chain) + 1), SX.sym("rows", F.numel())
        value = ca.substitute(ca.substitute(F, self.scene.x, self.x), self.scene.u, self.u)
        inputs = [self.x, v, self.u, du, size_x, size_u, d, ds, self.p, w, r]
        return chain, F, inputs, lambda bend: norm((ca.fabs(value) + ds * ds * bend / 2) / r)

    def _reached_turn(self, blocks: list[int]) -> Graph:
        """Return the same as `turn` of blocks in space, from reaches."""
        chain, F, inputs, residual = self._turning(blocks)
        _, v, _, du, size_x, size_u, d, ds, _, w, r = inputs
        x, u = self.scene.x, self.scene.u
        reaches = [reach for k in blocks for reach in self.blocks[k].block.reaches]
        (bounds_by_reaches,) = of_cases("reaches")
        known, rates = bounds_by_reaches(self.scene, F, reaches, [x, u]), ca.fabs(ca.vertcat(v, du))
        near = [ca.fabs(self.x) + ds * ca.fabs(v), ca.fabs(self.u) + ds * ca.fabs(du)]
        here, wide = known.bounds(near, whole=False), known.bounds([size_x, size_u], whole=True)
        select = SX(self.nx + self.nu, len(chain) + 1)
        for k, i in enumerate(chain):
            select[i, k] = w[k]
        select[self.nx :, len(chain)] = ca.fabs(d) * w[len(chain)]
        bent = [bend @ rates for bend in here.second]
        left = residual(ca.vertcat(*[ca.dot(rates, bend) for bend in bent]))
        change = ca.vertcat(*[ds * (bend.T @ select) / r[i] for i, bend in enumerate(bent)])
        kappa = column([norm(select.T @ b2 @ select) / r[i] for i, b2 in enumerate(wide.second)])
        results = [ca.densify(part) for part in (left, norm(change), norm(kappa))]
        return ca.Function("turn", inputs, results)

    def along(self, b: int) -> Graph:
        """Return one block on a curve of what it depends on.

        (x, u, x', u', consts) -> Newton step, rate, determinant, beta, share by which its
        equations are open; x' and u' are those of earlier unknowns and of the drivers.
        """
        v, du = SX.sym("v", self.nx), SX.sym("du", self.nu)
        trig = (ca.sin(self.x), ca.cos(self.x))
        at = self.blocks[b].at(self.x, self.u, trig)
        F, _, inv, det, beta = self._solve(b, at)
        rate = inv @ self.blocks[b].first_rate(at, (), [self.blocks[b].used(v)], [du])
        inputs = [self.x, self.u, v, du, self.consts]
        left = norm(F / self.weights[b][1]) if self.blocks[b].redundant else SX(0)
        results = [ca.densify(part) for part in (inv @ F, rate, det, beta, left)]
        return without_repeats("along", inputs, results)

    def tube(self, b: int) -> Graph:
        """Return the test of a step of one block on a curve, and its radius: see `_tube`.

        (x, x', away, u, u', drift, [beta, step], consts) -> test, radius, reach.
        """
        v, away, numbers = SX.sym("v", self.nx), SX.sym("away", self.nx), SX.sym("numbers", 2)
        du, drift = SX.sym("du", self.nu), SX.sym("drift", self.nu)
        beta, step = numbers[0], numbers[1]
        results = self._tube(b, self.x, v, away, self.u, du, beta, step, drift)
        inputs = [self.x, v, away, self.u, du, drift, numbers, self.consts]
        return without_repeats("tube", inputs, [ca.densify(part) for part in results])

    def fold(self, b: int) -> Graph:
        """Return the system of a limit position of block `b` and its derivatives.

        (y, [consts; u0; d]) -> G, G_y, J_b, dF_b/ds, F_xx[v, v] with y = (x of the block and
        its ancestors, s, v): G = {F = 0, J_b v = 0, v.v - 1}.
        """
        chain = [i for k in self.ancestors(b) for i in self.blocks[k].own]
        graph = self.blocks[b]
        y = SX.sym("y", len(chain) + 1 + graph.size)
        u0, d = SX.sym("u0", self.nu), SX.sym("d", self.nu)
        x = placed(SX.zeros(self.nx), chain, y[: len(chain)])
        s, v = y[len(chain)], y[len(chain) + 1 :]
        u = self._drivers(s, u0, d)[0]
        w, _ = self.weights[b]
        values = [self.blocks[k].value(x, u) for k in self.ancestors(b)]
        F, J, _ = values[-1]
        places = [chain.index(i) for i in graph.own]
        system = ca.vertcat(*[value[0] for value in values], J @ (w * v), ca.sumsqr(v) - 1)
        slope = ca.jtimes(F, y[places], w * v)
        bend = ca.jtimes(slope, y[places], w * v)
        whole = ca.vertcat(self.consts, u0, d)
        results = [system, ca.jacobian(system, y), J, ca.jacobian(F, y), bend]
        return without_repeats("fold", [y, whole], [ca.densify(part) for part in results])
