"""The casadi functions of a scene: besides poses and bounds, one certified step along the path.

Notation and theorem are those of `mechdae.kernels.graphs.pose`.
"""

from __future__ import annotations

from functools import partial

import casadi as ca

from mechdae.equations.structure_cache import structure_property
from mechdae.kernels.graphs.blocks import column, norm, placed
from mechdae.kernels.graphs.folds import PATH_STEP_LIMIT, FoldGraphs, Pair
from mechdae.kernels.run.functions import StepChain
from mechdae.kernels.stored.functions import stored_property
from mechdae.types import Graph, Sym

SX = ca.SX
STRIDE = 64
"""Steps in one call of the sequential kernel."""
NEAR = 0.5
"""Share of a step by which its bounds hold around it where they are not for all poses."""
LEAST = 1e-4
"""The same at least, in the units of the unknowns, where drivers may stand still over a step."""


class Graphs(FoldGraphs):
    """Functions of one scene: poses, bounds, steps along the path, limit positions."""

    @property
    def straight(self) -> Graphs:
        """The same scene moving along straight lines in the drivers' values."""
        if self.course is None and not self.single:
            return self
        made = (self.scene, self.outputs, self.derivatives)
        other: Graphs = self.cache("straight", lambda: Graphs(*made, lines=True))
        return other.at(self.scene)

    @structure_property
    def strides(self) -> StepChain:
        """`STRIDE` steps in one call."""
        return StepChain(self.advance, STRIDE)

    # -- one certified step ----------------------------------------------------------------

    @stored_property
    def advance(self) -> Graph:
        """One step of the path with its certificate.

        (state, [s, step], [consts; u0; d]) -> state, test (nb,), det (nb,), miss (nb,)
        with state = [x; x'; x''; beta] with respect to s. ``test`` <= 1 proves that one
        continuous solution leads from the old pose over the whole step (zero order in the
        block's inputs: see `_tube`), ``miss`` <= 1 that the new pose lies on it.
        """
        n, nb = self.nx, self.nb
        state, step = SX.sym("state", 3 * n + nb), SX.sym("step", 2)
        u0, d = SX.sym("u0", self.nu), SX.sym("d", self.nu)
        x, v, a, beta = (state[:n], state[n : 2 * n], state[2 * n : 3 * n], state[3 * n :])
        s, ds = step[0], step[1]
        u, direction, _ = self._drivers(s, u0, d)
        ahead, du, ddu = self._drivers(s + ds, u0, d)
        drift = self.course.drift(s, ca.fabs(ds)) if self.course else None
        new = x + v * ds + a * ds * ds / 2
        for _ in range(3):
            new, eta, _ = self.newton(new, ahead)
        parts = self.rates(new, ahead, [du, ddu], 2)
        away = ds * ds * ca.fmax(ca.fabs(a), ca.fabs(parts["a"]))
        tests, misses = [], []
        for b in range(nb):
            test, radius, reach = self._tube(
                b, x, v, away, u, direction, beta[b], ca.fabs(ds), drift
            )
            last = self.kappa[b] * parts["beta"][b] * ca.sqrt(eta[b]) / 0.2
            unknowns = self.blocks[b].own
            # where nothing is proved, as of a group that has ended, the rates tell
            away = placed(away, unknowns, ca.if_else(test <= 1, reach, away[unknowns]))
            miss = self._length(b, new[unknowns] - x[unknowns] - v[unknowns] * ds)
            tests.append(ca.fmax(test, last))
            misses.append(miss / (radius * (1 + 1e-6) + 1e-300))
        after = ca.vertcat(new, parts["v"], parts["a"], parts["beta"])
        results = [after, column(tests), parts["det"], column(misses)]
        inputs = [state, step, ca.vertcat(self.consts, u0, d)]
        return self.of_all_blocks("advance", inputs, results)

    def _drivers(self, s: Sym, u0: Sym, d: Sym) -> tuple[Sym, Sym, Sym]:
        """Return the drivers' values and their derivatives with respect to s."""
        if self.course:
            return self.course.at(s)
        return (s if self.single else u0 + s * d), (SX(1) if self.single else d), SX.zeros(self.nu)

    def _tube(
        self,
        b: int,
        x: Sym,
        v: Sym,
        away: Sym,
        u: Sym,
        du: Sym,
        beta: Sym,
        ds: Sym,
        drift: Sym | None,
    ) -> tuple[Sym, Sym, Sym]:
        """Return the test (<= 1 passes), the radius around the tangent over a step, the reach.

        Along x + v t, 0 <= t <= ds, the residual is at most |F| + ds^2 tau / 2 + l, the Jacobian
        differs from its start by at most ds sigma + k; l and k hold the deviation of the
        earlier unknowns from their tangents (`away`, their reach), and that of the
        drivers on a course (`drift`). The reach (size,) says the same as the radius, unknown by
        unknown and closer: see `_reach`.
        """
        graph = self.blocks[b]
        unknowns, used = graph.own, graph.used
        inputs = [
            x[unknowns],
            used(x),
            v[unknowns],
            used(v),
            away[unknowns],
            used(away),
            u,
            du,
            beta,
            ds,
        ]
        inputs += [self.kappa[b], self.rho[b], *([] if drift is None else [drift])]
        test, radius, reach = self._once("tube", b, partial(self._tube_of, b), inputs)
        return test, radius, reach

    def _tube_of(self, b: int, *parts: Sym) -> list[Sym]:
        """Return what `_tube` does from the inputs that it lists, unknowns in two parts."""
        x, v, away = zip(parts[0:6:2], parts[1:6:2], strict=True)
        u, du, beta, ds, kappa, rho, *drift = parts[6:]
        graph, (w, r) = self.blocks[b], self.weights[b]
        shape = graph.shape
        moving = [*shape.moving, shape.vx, shape.vz, shape.vu]
        across = ds * ca.fabs(du) + (drift[0] if drift else 0)
        around = (x, v, away, u, du, across)
        sizes = [ca.fabs(i) + ds * ca.fabs(di) + d for i, di, d in zip(x, v, away, strict=True)]
        limits = [*sizes, ca.fabs(u) + across, *map(ca.fabs, v), ca.fabs(du)]
        if graph.reaches is not None:
            numbers = (ds, rho)
            return self._reached_tube(b, x, v, away[1], u, du, limits, drift, numbers)
        ranges = self._step_ranges(b, *around, ds) if self.contacts else []
        turned = ca.jtimes(ca.vec(shape.J), shape.every, shape.rates)
        tau, _ = self._bound(shape.second, moving, limits, ranges)
        sigma, _ = self._bound(turned, moving, limits, ranges)
        residual = ds * ds * tau / 2 + ca.fabs(shape.at(*x, u)[0])
        change = ds * ca.reshape(sigma, graph.rows, graph.size)
        deviations = [(shape.z, away[1])] if graph.uses else []
        deviations += [(shape.u, drift[0])] if drift else []
        pushed = SX(graph.rows, 1)
        for symbols, deviation in deviations:
            count = symbols.numel()
            slope, _ = self._bound(ca.jacobian(shape.F, symbols), moving, limits, ranges)
            pushed = ca.reshape(slope, graph.rows, count) @ deviation  # the drivers' comes last
            residual += pushed
            cross = ca.jacobian(ca.vec(shape.J), symbols)
            bound, _ = self._bound(cross, moving, limits, ranges)
            moved = ca.reshape(bound, graph.rows * graph.size, count) @ deviation
            change += ca.reshape(moved, graph.rows, graph.size)
        delta = beta * norm(ca.diag(1 / r) @ change @ ca.diag(w))
        grown = beta / ca.fmax(1 - delta, 1e-9)
        eta = grown * (norm(residual / r) + rho)
        everywhere = self.plain(b)
        if not everywhere:  # bounds for all poses are too wide: those near the tangent
            near = NEAR * ca.mmax((ds * ca.fabs(v[0]) + away[0]) / self._sizes(graph.own))
            if not self.single:  # a law may stand still over a step
                near = ca.fmax(near, LEAST)
            wide = self._step_ranges(b, *around, ds, near)
            kappa = self._lipschitz(b, limits[:3], wide[:3])  # of x, z and u
        h = grown * kappa * eta
        radius = 2 * eta / (1 + ca.sqrt(ca.fmax(1 - 2 * h, 0)))
        test = ca.fmax(delta / 0.9, h / PATH_STEP_LIMIT)
        test = test if everywhere else ca.fmax(test, radius / near)
        off = [radius * w, away[1], drift[0] if drift else SX(self.nu, 1)]
        spread = [ds * ca.fabs(i) + d for i, d in zip((*v, du), off, strict=True)]
        sizes = [ca.fabs(i) + d for i, d in zip((*x, u), spread, strict=True)]
        places = self._around(x, u, spread) if self.contacts else []
        bent, _ = self._bound(shape.second, moving, [*sizes, *spread], places)
        return [
            test,
            radius,
            self._reach(b, x, u, off, bent, rho, pushed if drift else SX(graph.rows, 1)),
        ]

    def _reach(
        self, b: int, x: Pair, u: Sym, off: list[Sym], bent: Sym, rho: Sym, pushed: Sym
    ) -> Sym:
        """Return by how much each unknown of a block may leave its tangent over a proved step.

        With Y the inverse of the Jacobian at the step's start, e the deviation of the unknowns,
        e_z that of the earlier ones: e = -Y (F + D2F[w, w] / 2) - Y F_z e_z - Y F_u e_u, where w
        = v t + e holds all that moves. `off` bounds e by the radius, e_z and e_u, `bent` the
        second derivative along w, `pushed` |F_u| e_u.
        """
        graph = self.blocks[b]
        F, J, Fz = graph.shape.at(*x, u)
        inv, _ = self.inverse_of(b, J)
        found = ca.fabs(inv) @ (ca.fabs(F) + bent / 2 + 2 * rho * self.weights[b][1] + pushed)
        if graph.uses:
            found += ca.fabs(inv @ Fz) @ off[1]
        return ca.fmin(found, off[0])
