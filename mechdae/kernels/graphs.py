"""The casadi functions of a scene: bounds, one pose, one certified step along the path.

Naming: x unknowns, u drivers, p parameters, s the path parameter with u = u0 + s d, or
u = u(s) along a course (a law of time).
Every block b has beta = |J_b^-1| (Frobenius), kappa = a Lipschitz constant of J_b.

Newton-Kantorovich: with eta = |last step| and h = beta kappa eta <= 1/2 the block has one
root within 2 eta of the guess, and the distance after the step is at most h eta for
h <= 1/4 (Ortega and Rheinboldt, Iterative Solution of Nonlinear Equations, 1970, 12.6.2).

A redundant block has a left inverse A of its Jacobian in place of the inverse. The theorem
then holds for A F = 0, which every solution of F = 0 solves; that F itself vanishes, to within
`CLOSURE` times its rounding, is checked beside it.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from functools import cached_property
from types import MappingProxyType
from typing import Any

import casadi as ca

from mechdae.kernels.blocks import BlockGraph, inverse, left_inverse, norm
from mechdae.kernels.course import Course
from mechdae.kernels.enclosure import SLOTS, Floors, enclosure, lower_bounds
from mechdae.kernels.majorant import NoMajorant, majorant
from mechdae.kernels.straight import Straight, straight
from mechdae.model.reduction import Scene

SX = ca.SX
ROUNDOFF = 2.0**-53
PATH_STEP_LIMIT = 0.45
CLOSURE = 64
"""Rounding bounds of a redundant block by which its equations may stay open: data that are
consistent in exact arithmetic are not so as float64 numbers."""
OPTIONS = {"cse": True}
NEAR = 0.5
"""Share of a step by which its bounds hold around it where they are not for all poses."""
LEAST = 1e-4
"""The same at least, in the units of the unknowns, where drivers may stand still over a step."""


class Graphs:
    """Functions of one scene; each is built when it is first asked for.

    Parameters
    ----------
    scene
        Unknowns and blocks.
    outputs : SX (ny,)
        Expressions over (x, u, p) to evaluate with their rates at every pose.
    derivatives
        Highest order of rates of the outputs, 0 to 3.
    course
        The curve that the drivers follow; None: straight lines.
    lines
        A single driver too moves along u0 + s d; else s is its value.

    Attributes
    ----------
    first : list of int
        The first unknown of each block; a block's unknowns follow one another in x.
    """

    def __init__(
        self,
        scene: Scene,
        outputs: Any,
        derivatives: int = 2,
        course: Course | None = None,
        lines: bool = False,
    ) -> None:
        self.scene, self.outputs, self.derivatives = scene, outputs, derivatives
        self.course = course
        self.blocks = [BlockGraph(scene, block) for block in scene.blocks]
        self.nx, self.nu, self.nb = scene.x.numel(), scene.u.numel(), len(self.blocks)
        self.first = [graph.own[0] for graph in self.blocks]
        self.np, self.ny = scene.model.p.numel(), outputs.numel()
        self.single = self.nu == 1 and course is None and not lines
        self.x, self.u, self.p = SX.sym("x", self.nx), SX.sym("u", self.nu), scene.model.p
        self.scale = SX.sym("scale")
        self.kappa, self.rho = SX.sym("kappa", self.nb), SX.sym("rho", self.nb)
        self.grain = SX.sym("grain", self.nx)
        owners = {name for group in scene.groups for name in group.joints}
        self.contacts = [c for name, c in scene.model.contacts.items() if name in owners]
        floor = SX.sym("floor", SLOTS if self.contacts else 0)
        self.floors = Floors(floor)
        owned = {contact.joint.name for contact in self.contacts}
        self.places = [
            i for i, (owner, name) in enumerate(scene.x_names) if name == "s" and owner in owned
        ]
        self.low, self.high = (SX.sym(name, len(self.places)) for name in ("low", "high"))
        self.consts = ca.vertcat(self.p, self.scale, self.kappa, self.rho, self.grain, floor)
        if self.single:
            self.driven = [SX(1), SX(0), SX(0)]
        else:
            names = ("du", "ddu", "dddu")[: max(derivatives, 2)]
            self.driven = [SX.sym(name, self.nu) for name in names]

    @property
    def turns(self) -> bool:
        """Whether s is an angle: a whole turn of it leads to the same pose."""
        return self.course.turns if self.course else self.single and self.scene.drivers[0].is_angle

    @cached_property
    def straight(self) -> Graphs:
        """The same scene moving along straight lines in the drivers' values."""
        if self.course is None and not self.single:
            return self
        return Graphs(self.scene, self.outputs, self.derivatives, lines=True)

    # -- weights ---------------------------------------------------------------------------

    def weights(self, b: int) -> tuple[Any, Any]:
        """Return column and row weights that make a block of mixed units dimensionless."""
        block = self.blocks[b].block
        names = [self.scene.x_names[i] for i in block.x]
        kinds = {name if name in ("angle", "s") else "length" for _, name in names}
        if "s" not in kinds and len(kinds) == 1 and len(set(block.units)) == 1:
            return SX.ones(len(names)), SX.ones(len(block.units))
        one = SX(1)
        columns = ca.vertcat(*[self._unit(*name) for name in names])
        rows = ca.vertcat(*[self.scale if unit == "m" else one for unit in block.units])
        return columns, rows

    def _unit(self, owner: str, name: str) -> Any:
        """Return the unit in which an unknown is of the order of one."""
        if name == "s":
            return self.scene.model.contacts[owner].turn
        return SX(1) if name == "angle" else self.scale

    def _solve(self, b: int, x: Any, u: Any, trig: Any) -> tuple[Any, Any, Any, Any, Any]:
        """Return F, F_z, the inverse, the determinant and beta of a block."""
        F, J, Fz = self.blocks[b].value(x, u, self.p, trig)
        inv, det = self._inverse(b, J)
        w, r = self.weights(b)
        beta = norm(ca.diag(1 / w) @ inv @ ca.diag(r))
        return F, Fz, inv, det, beta

    def _inverse(self, b: int, J: Any) -> tuple[Any, Any]:
        """Return the inverse of a block's Jacobian and its determinant."""
        if not self.blocks[b].redundant:
            return inverse(J)
        w, r = self.weights(b)
        return ca.diag(w) @ left_inverse(ca.diag(1 / r) @ J @ ca.diag(w)) @ ca.diag(1 / r), SX(1)

    def _length(self, b: int, step: Any) -> Any:
        return norm(step / self.weights(b)[0])

    # -- Newton and rates ------------------------------------------------------------------

    def newton(
        self, x: Any, u: Any, held: frozenset[int] = frozenset()
    ) -> tuple[Any, list[Any], Any]:
        """Return x after one Newton step block by block, |step|^2 of each, and sin x, cos x.

        Blocks that are `held` keep their unknowns.

        Sine and cosine are carried along to second order in the step, exact to rounding for
        steps below 1e-5: a later block sees its earlier unknowns as they are after the step.
        """
        eta = []
        sines, cosines = ca.sin(x), ca.cos(x)
        for b, graph in enumerate(self.blocks):
            if b in held:
                eta.append(SX(0))
                continue
            F, J, _ = graph.value(x, u, self.p, (sines, cosines))
            step = self._inverse(b, J)[0] @ F
            own = graph.own
            s, c, half = sines[own], cosines[own], step * step / 2
            x = _put(x, own, x[own] - step)
            sines = _put(sines, own, s - (step * c + half * s))
            cosines = _put(cosines, own, c + (step * s - half * c))
            eta.append(ca.sumsqr(step / self.weights(b)[0]))
        return x, eta, (sines, cosines)

    def rates(
        self,
        x: Any,
        u: Any,
        driven: list[Any],
        order: int,
        trig: Any = None,
        eta: list[Any] | None = None,
        held: Mapping[int, tuple[Any, Any, Any]] = MappingProxyType({}),
    ) -> dict[str, Any]:
        """Return x', x'', x''' and the certificate's parts at a solved pose.

        `driven` are the rates of the drivers, as many as `order`. `held` gives x', x'' (None: by
        the equations) and the error of blocks that keep theirs; their x''' is unknown.

        A redundant block has no determinant; in its place stands the share of the rounding
        allowed to its equations that is left, negative where they stay open.
        """
        v, a, j = SX.zeros(self.nx), SX.zeros(self.nx), SX.zeros(self.nx)
        error = SX.zeros(self.nx)
        dets, betas = [], []
        trig = trig if trig is not None else (ca.sin(x), ca.cos(x))
        for b, graph in enumerate(self.blocks):
            F, Fz, inv, det, beta = self._solve(b, x, u, trig)
            own = graph.own
            first, second, known = held.get(b, (None, None, None))
            if order >= 1:
                if first is None:
                    first = inv @ graph.first_rate(x, u, self.p, v, driven[0], trig)
                v = _put(v, own, first)
            if order >= 2:
                if second is None:
                    push = graph.second_rate(x, u, self.p, v, driven[0], a, driven[1], trig)
                    second = inv @ push
                a = _put(a, own, second)
            if order >= 3:
                push = graph.third_rate(x, u, self.p, (v, a, j), driven, trig)
                j = _put(j, own, SX.nan(graph.size) if b in held else inv @ push)
            left = 2 * self.kappa[b] * eta[b] if eta else 0
            if graph.redundant:
                r, noise = self.weights(b)[1], self.rho[b]
                if graph.uses:
                    noise = noise + norm((ca.fabs(Fz) @ error[graph.uses]) / r)
                det = 1 - norm(F / r) / (CLOSURE * noise)
                left += 2 * norm(F / r)
            local = beta * (self.rho[b] + left) * self.weights(b)[0] + self.grain[own]
            if graph.uses:
                local += ca.fabs(inv @ Fz) @ error[graph.uses]
            error = _put(error, own, local if known is None else known)
            dets.append(det)
            betas.append(beta)
        certificate = {"error": error, "det": _column(dets), "beta": _column(betas)}
        return {"v": v, "a": a, "j": j, **certificate}

    @cached_property
    def pose(self) -> Any:
        """One Newton step and everything that is reported at a pose.

        (x, u, consts) -> x, error, det, beta, eta^2, y, y', ... up to the order asked for;
        rates of several drivers (u', u'', with the third order u''') follow u. `error` bounds
        the distance of each unknown from the exact solution, the term h eta included. beta
        is taken after the step: before it, it is at most beta / (1 - h).
        """
        x, eta, trig = self.newton(self.x, self.u)
        parts = self.rates(x, self.u, self.driven, self.derivatives, trig, eta)
        outputs = self.output_rates(x, parts)
        inputs = [self.x, self.u, *([] if self.single else self.driven), self.consts]
        results = [x, parts["error"], parts["det"], parts["beta"], _column(eta), *outputs]
        return ca.Function("pose", inputs, results, OPTIONS)

    @cached_property
    def straight_pose(self) -> Straight | None:
        """`pose` as a straight line of NumPy operations; the last input is shared."""
        return straight(self.pose, [self.pose.n_in() - 1])

    def held(self, blocks: frozenset[int]) -> Any:
        """Return `pose` with the unknowns of some blocks given, not solved for.

        (x, u[, du, ddu[, dddu]], consts, x', x'', error) -> as `pose`; with one driver or a
        course the rates of those blocks are given too. Near a change point their equations lose
        all digits.
        """
        v, a, error = (SX.sym(name, self.nx) for name in ("v", "a", "error"))
        x, eta, trig = self.newton(self.x, self.u, blocks)
        known = {}
        for b in blocks:
            own = self.blocks[b].own
            rates = (v[own], a[own]) if self.single or self.course else (None, None)
            known[b] = (*rates, error[own])
        parts = self.rates(x, self.u, self.driven, self.derivatives, trig, eta, known)
        outputs = self.output_rates(x, parts)
        inputs = [self.x, self.u, *([] if self.single else self.driven), self.consts]
        results = [x, parts["error"], parts["det"], parts["beta"], _column(eta), *outputs]
        return ca.Function("held", [*inputs, v, a, error], results, OPTIONS)

    def output_rates(self, x: Any, parts: dict[str, Any]) -> list[Any]:
        y, scene = self.outputs, self.scene
        old = ca.vertcat(scene.x, scene.u)
        # the total derivative along (v, a, j), as often as asked for
        along = [SX.sym(name, self.nx + self.nu) for name in "vaj"[: self.derivatives]]
        values = [y]
        for order in range(self.derivatives):
            at = ca.vertcat(old, *along[:order])
            values.append(ca.jtimes(values[-1], at, ca.vertcat(*along[: order + 1])))
        function = ca.Function("outputs", [scene.x, scene.u, self.p, *along], values)
        rates = [ca.vertcat(parts[n], du) for n, du in zip("vaj", self.driven, strict=False)]
        found = function(x, self.u, self.p, *rates[: self.derivatives])
        return list(found) if self.derivatives else [found]

    # -- bounds ----------------------------------------------------------------------------

    def _bound(
        self,
        expressions: Any,
        moving: list[Any],
        sizes: list[Any],
        ranges: list[Any],
        rounding: bool = False,
    ) -> tuple[Any, Any]:
        """Return bounds of |expressions| and of their rounding errors.

        `ranges` are tighter than `sizes`, and used by the curves that need it; those give
        errors only with `rounding`.
        """
        try:
            return majorant(expressions, moving, sizes)
        except NoMajorant:
            if not self.contacts:
                raise
            return enclosure(expressions, moving, ranges, self.floors, rounding)

    def _ranges(self, sizes: list[Any]) -> list[Any]:
        """Return where unknowns and drivers lie: contacts in a box, the rest by their sizes."""
        low = _put(-sizes[0], self.places, self.low) if self.places else -sizes[0]
        high = _put(+sizes[0], self.places, self.high) if self.places else +sizes[0]
        return [(low, high), (-sizes[1], sizes[1])]

    @cached_property
    def enclosed(self) -> bool:
        """Whether some bounds hold in boxes of the contacts' places only, see `_ranges`."""
        return bool(self.contacts) and not all(self._plain(b) for b in range(self.nb))

    @cached_property
    def divisors(self) -> tuple[Any, Any]:
        """What curves divide by: its size at a pose, and at least in a whole sweep.

        Functions (x, u, p) -> |divisor| and (|x|, |u|, p, low, high) -> lower bound, 0
        without one.
        """
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

    # -- constants of a sweep --------------------------------------------------------------

    @cached_property
    def constants(self) -> Any:
        """Bounds that hold for a whole sweep.

        (|x|, |u|, p, scale, floors, low, high) -> kappa, rho, mu (nb,): Lipschitz constant of
        J, rounding of F (norm of its rows), bound of |J|. Contacts lie between low and high.
        Raises `NoMajorant` where an operation has no bound.
        """
        sizes = [SX.sym("size_x", self.nx), SX.sym("size_u", self.nu)]
        ranges = self._ranges(sizes)
        kappas, rhos, mus = [], [], []
        for b, graph in enumerate(self.blocks):
            w, r = self.weights(b)
            moving, size, box = self._own(graph, sizes, ranges)
            kappas.append(self._lipschitz(b, moving, size, box))
            _, rounding = self._bound(graph.F, moving, size, box, rounding=True)
            bound, _ = self._bound(graph.J, moving, size, box)
            square = ca.reshape(bound, graph.rows, graph.size)
            if graph.redundant:
                rounding += square @ size[0] + self._data(graph.F, graph.p, moving, size, box)
            rhos.append(ROUNDOFF * norm(rounding / r))
            mus.append(norm(ca.diag(1 / r) @ square @ ca.diag(w)))
        results = [_column(kappas), _column(rhos), _column(mus)]
        inputs = [*sizes, self.p, self.scale, self.floors.symbols, self.low, self.high]
        return ca.Function("constants", inputs, results)

    def _own(self, graph: BlockGraph, sizes: list[Any], ranges: list[Any]) -> Any:
        """Return the symbols that a block's equations hold, with their sizes and ranges."""
        nothing, (low, high) = SX(0, 1), ranges[0]

        def used(vector: Any) -> Any:
            return vector[graph.uses] if graph.uses else nothing

        moving = [graph.x, graph.z, self.scene.u]
        size = [sizes[0][graph.own], used(sizes[0]), sizes[1]]
        box = [(low[graph.own], high[graph.own]), (used(low), used(high)), ranges[1]]
        return moving, size, box

    def _lipschitz(self, b: int, moving: list[Any], sizes: list[Any], ranges: list[Any]) -> Any:
        """Return a Lipschitz constant of a block's weighted Jacobian in its own unknowns."""
        graph = self.blocks[b]
        w, r = self.weights(b)
        bound, _ = self._bound(ca.jacobian(ca.vec(graph.J), graph.x), moving, sizes, ranges)
        square = ca.reshape(bound, graph.rows * graph.size, graph.size) @ ca.diag(w)
        pairs = ca.reshape(square, graph.rows, graph.size * graph.size)
        return norm(ca.diag(1 / r) @ pairs @ ca.diag(ca.kron(SX.ones(graph.size), w)))

    def _data(self, F: Any, p: Any, moving: list[Any], sizes: list[Any], ranges: list[Any]) -> Any:
        """Return how much F changes when each parameter of `p` changes by its own size."""
        if not p.numel():
            return SX.zeros(F.numel())
        slope, _ = self._bound(ca.jacobian(F, p), moving, sizes, ranges)
        return ca.reshape(slope, F.numel(), p.numel()) @ ca.fabs(p)

    def _plain(self, b: int) -> bool:
        """Return whether majorants bound a block for all poses."""
        graph = self.blocks[b]
        try:
            majorant(graph.F, [graph.x], [graph.x])
        except NoMajorant:
            return False
        return True

    @cached_property
    def check_bounds(self) -> Any:
        """Bounds that hold for the scene's checks r, equations without unknowns of their own.

        (|x|, |u|, p, floors, low, high) -> bound of |dr/dx| (nc, nx), change of r by rounding
        (nc,) of its terms and of parameters.
        """
        sizes = [SX.sym("size_x", self.nx), SX.sym("size_u", self.nu)]
        moving, ranges = [self.scene.x, self.scene.u], self._ranges(sizes)
        rows = ca.vertcat(*[check.residual for check in self.scene.checks])
        slope, _ = self._bound(ca.jacobian(rows, self.scene.x), moving, sizes, ranges)
        _, rounding = self._bound(rows, moving, sizes, ranges, rounding=True)
        rounding += self._data(rows, self.p, moving, sizes, ranges)
        shaped = ca.reshape(slope, rows.numel(), self.nx)
        inputs = [*sizes, self.p, self.floors.symbols, self.low, self.high]
        return ca.Function("check_bounds", inputs, [ca.densify(shaped), ROUNDOFF * rounding])

    @cached_property
    def output_bounds(self) -> Any:
        """Bounds that hold for the outputs y of a whole sweep.

        (|x|, |u|, p, floors, low, high) -> bound of |dy/dx| (ny, nx), sparse, and rounding of
        y (ny,).
        """
        sizes = [SX.sym("size_x", self.nx), SX.sym("size_u", self.nu)]
        moving, ranges = [self.scene.x, self.scene.u], self._ranges(sizes)
        jacobian = ca.jacobian(self.outputs, self.scene.x)
        slope, _ = self._bound(_column(jacobian.nonzeros()), moving, sizes, ranges)
        _, rounding = self._bound(self.outputs, moving, sizes, ranges, rounding=True)
        shaped = SX(jacobian.sparsity(), slope)
        inputs = [*sizes, self.p, self.floors.symbols, self.low, self.high]
        return ca.Function("output_bounds", inputs, [shaped, ROUNDOFF * rounding])

    # -- one certified step ----------------------------------------------------------------

    @cached_property
    def advance(self) -> Any:
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
            test, radius = self._tube(b, x, v, away, u, direction, beta[b], ca.fabs(ds), drift)
            last = self.kappa[b] * parts["beta"][b] * ca.sqrt(eta[b]) / 0.2
            own = self.blocks[b].own
            if self.course:
                # second derivatives at the ends do not tell what a law does: the radius does
                away = _put(away, own, ca.fmax(away[own], radius * self.weights(b)[0]))
            miss = self._length(b, new[own] - x[own] - v[own] * ds)
            tests.append(ca.fmax(test, last))
            misses.append(miss / (radius * (1 + 1e-6) + 1e-300))
        after = ca.vertcat(new, parts["v"], parts["a"], parts["beta"])
        results = [after, _column(tests), parts["det"], _column(misses)]
        inputs = [state, step, ca.vertcat(self.consts, u0, d)]
        return ca.Function("advance", inputs, results, OPTIONS)

    def _drivers(self, s: Any, u0: Any, d: Any) -> tuple[Any, Any, Any]:
        """Return the drivers' values and their derivatives with respect to s."""
        if self.course:
            return self.course.at(s)
        return (s if self.single else u0 + s * d), (SX(1) if self.single else d), SX.zeros(self.nu)

    def _tube(
        self, b: int, x: Any, v: Any, away: Any, u: Any, du: Any, beta: Any, ds: Any, drift: Any
    ) -> tuple[Any, Any]:
        """Return the test (<= 1 passes) and the radius around the tangent over a step.

        Along x + v t, 0 <= t <= ds, the residual is at most |F| + ds^2 tau / 2 + l, the Jacobian
        differs from its start by at most ds sigma + k; l and k hold the deviation of the
        earlier unknowns from their tangents (`away`, twice ds^2 |x''| / 2), and that of the
        drivers on a course (`drift`).
        """
        graph = self.blocks[b]
        w, r = self.weights(b)
        moving = [graph.x, graph.z, self.scene.u, graph.vx, graph.vz, graph.vu]
        own, uses = graph.own, graph.uses
        across = ds * ca.fabs(du) + (drift if drift is not None else 0)
        around = (x, v, away, u, du, across)
        size = ca.fabs(x) + ds * ca.fabs(v) + away
        limits = [
            size[own],
            size[uses] if uses else SX(0, 1),
            ca.fabs(u) + across,
            ca.fabs(v[own]),
            ca.fabs(v[uses]) if uses else SX(0, 1),
            ca.fabs(du),
        ]
        ranges = self._step_ranges(b, *around, ds) if self.contacts else []
        every = ca.vertcat(graph.x, graph.z, self.scene.u)
        rates = ca.vertcat(graph.vx, graph.vz, graph.vu)
        turned = ca.jtimes(ca.vec(graph.J), every, rates)
        tau, _ = self._bound(graph.second, moving, limits, ranges)
        sigma, _ = self._bound(turned, moving, limits, ranges)
        residual = ds * ds * tau / 2 + ca.fabs(graph.value(x, u, self.p)[0])
        change = ds * ca.reshape(sigma, graph.rows, graph.size)
        inputs = [(graph.z, away[uses])] if uses else []
        inputs += [(self.scene.u, drift)] if drift is not None else []
        for symbols, deviation in inputs:
            count = symbols.numel()
            slope, _ = self._bound(ca.jacobian(graph.F, symbols), moving, limits, ranges)
            residual += ca.reshape(slope, graph.rows, count) @ deviation
            cross = ca.jacobian(ca.vec(graph.J), symbols)
            bound, _ = self._bound(cross, moving, limits, ranges)
            moved = ca.reshape(bound, graph.rows * graph.size, count) @ deviation
            change += ca.reshape(moved, graph.rows, graph.size)
        delta = beta * norm(ca.diag(1 / r) @ change @ ca.diag(w))
        grown = beta / ca.fmax(1 - delta, 1e-9)
        eta = grown * (norm(residual / r) + self.rho[b])
        kappa, everywhere = self.kappa[b], self._plain(b)
        if not everywhere:  # bounds for all poses are too wide: those near the tangent
            units = ca.vertcat(*[self._unit(*self.scene.x_names[i]) for i in own])
            reach = ds * ca.fabs(v[own]) + away[own]
            near = NEAR * ca.mmax(reach / units)
            if not self.single:  # a law may stand still over a step
                near = ca.fmax(near, LEAST)
            wide = self._step_ranges(b, *around, ds, near)
            kappa = self._lipschitz(b, moving, limits, wide)
        h = grown * kappa * eta
        radius = 2 * eta / (1 + ca.sqrt(ca.fmax(1 - 2 * h, 0)))
        test = ca.fmax(delta / 0.9, h / PATH_STEP_LIMIT)
        return test if everywhere else ca.fmax(test, radius / near), radius

    def _step_ranges(
        self,
        b: int,
        x: Any,
        v: Any,
        away: Any,
        u: Any,
        du: Any,
        across: Any,
        ds: Any,
        near: Any = 0.0,
    ) -> list[tuple[Any, Any]]:
        """Return where unknowns, drivers and rates of a block lie over a step.

        The unknowns leave their tangents by `away`, the drivers their values by `across`; the
        unknowns may lie `near`, in their units, on both sides of that.
        """
        graph = self.blocks[b]

        def parts(vector: Any) -> tuple[Any, Any]:
            return vector[graph.own], vector[graph.uses] if graph.uses else SX(0, 1)

        units = ca.vertcat(*[self._unit(*name) for name in self.scene.x_names])
        reach = ds * ca.fabs(v) + away + near * units
        around = list(zip(parts(x - reach), parts(x + reach), strict=True))
        rates = [(rate, rate) for rate in parts(v)]
        return [*around, (u - across, u + across), *rates, (du, du)]

    # -- limit positions -------------------------------------------------------------------

    def turn(self, b: int) -> Any:
        """Return bounds for a block and its ancestors over a step along a tangent of (x, s).

        (x, x', u, u', |x|, |u|, d, step, p, columns, rows) -> largest |F|, change of the Jacobian
        in (x, s), its Lipschitz constant where unknowns and drivers stay below |x| and |u|; all in
        units of the unknowns and s (`columns`) and of the equations (`rows`).
        """
        blocks = self.ancestors(b)
        chain = [i for k in blocks for i in self.blocks[k].own]
        names = ("v", "du", "size_x", "size_u", "d")
        v, du, size_x, size_u, d = (
            SX.sym(name, self.nu if name in ("du", "size_u", "d") else self.nx) for name in names
        )
        ds, s, x, u = SX.sym("ds"), SX.sym("s"), self.scene.x, self.scene.u
        F = ca.vertcat(*[self.blocks[k].F for k in blocks])
        w, r = SX.sym("columns", len(chain) + 1), SX.sym("rows", F.numel())
        moved, every = ca.substitute(F, u, u + d * s), ca.vertcat(x[chain], s)
        J = ca.jacobian(moved, every)
        row, column = map(list, J.sparsity().get_triplet())
        entries = _column(J.nonzeros())
        bent = ca.substitute(ca.jacobian(entries, every), s, 0)
        entry, other = map(list, bent.sparsity().get_triplet())
        share = _column([w[j] / r[i] for i, j in zip(row, column, strict=True)])
        straight, rates = ca.vertcat(x, u), ca.vertcat(v, du)
        along = ca.jtimes(ca.jtimes(F, straight, rates), straight, rates)
        turned = ca.jtimes(ca.substitute(entries, s, 0), straight, rates)
        moving, sizes = [x, u, v, du, d], [ca.fabs(v), ca.fabs(du), ca.fabs(d)]
        near = [ca.fabs(self.x) + ds * sizes[0], ca.fabs(self.u) + ds * sizes[1], *sizes]
        value = ca.substitute(ca.substitute(F, x, self.x), u, self.u)
        residual = ca.fabs(value) + ds * ds * majorant(along, moving, near)[0] / 2
        change = ds * majorant(turned, moving, near)[0]
        square, _ = majorant(_column(bent.nonzeros()), moving, [size_x, size_u, *sizes])
        unit = _column([share[i] * w[j] for i, j in zip(entry, other, strict=True)])
        kappa = norm(square * unit)
        inputs = [self.x, v, self.u, du, size_x, size_u, d, ds, self.p, w, r]
        results = [ca.densify(part) for part in (norm(residual / r), norm(change * share), kappa)]
        return ca.Function("turn", inputs, results)

    def along(self, b: int) -> Any:
        """Return one block on a curve of what it depends on.

        (x, u, x', u', consts) -> Newton step, rate, determinant, beta, share by which its
        equations are open; x' and u' are those of earlier unknowns and of the drivers.
        """
        v, du = SX.sym("v", self.nx), SX.sym("du", self.nu)
        trig = (ca.sin(self.x), ca.cos(self.x))
        F, _, inv, det, beta = self._solve(b, self.x, self.u, trig)
        rate = inv @ self.blocks[b].first_rate(self.x, self.u, self.p, v, du, trig)
        inputs = [self.x, self.u, v, du, self.consts]
        left = norm(F / self.weights(b)[1]) if self.blocks[b].redundant else SX(0)
        results = [ca.densify(part) for part in (inv @ F, rate, det, beta, left)]
        return ca.Function("along", inputs, results, OPTIONS)

    def tube(self, b: int) -> Any:
        """Return the test of a step of one block on a curve, and its radius: see `_tube`.

        (x, x', away, u, u', drift, [beta, step], consts) -> test, radius.
        """
        v, away, numbers = SX.sym("v", self.nx), SX.sym("away", self.nx), SX.sym("numbers", 2)
        du, drift = SX.sym("du", self.nu), SX.sym("drift", self.nu)
        beta, step = numbers[0], numbers[1]
        results = self._tube(b, self.x, v, away, self.u, du, beta, step, drift)
        inputs = [self.x, v, away, self.u, du, drift, numbers, self.consts]
        return ca.Function("tube", inputs, [ca.densify(part) for part in results], OPTIONS)

    def ancestors(self, b: int) -> list[int]:
        """Return the blocks that block `b` depends on, itself last."""
        wanted = {b}
        for other in range(b, -1, -1):
            if other in wanted:
                wanted |= {bisect_right(self.first, i) - 1 for i in self.blocks[other].uses}
        return sorted(wanted)

    def fold(self, b: int) -> Any:
        """Return the system of a limit position of block `b` and its derivatives.

        (y, [consts; u0; d]) -> G, G_y, J_b, dF_b/ds, F_xx[v, v] with y = (x of the block and
        its ancestors, s, v): G = {F = 0, J_b v = 0, v.v - 1}.
        """
        chain = [i for k in self.ancestors(b) for i in self.blocks[k].own]
        graph = self.blocks[b]
        y = SX.sym("y", len(chain) + 1 + graph.size)
        u0, d = SX.sym("u0", self.nu), SX.sym("d", self.nu)
        x = _put(SX.zeros(self.nx), chain, y[: len(chain)])
        s, v = y[len(chain)], y[len(chain) + 1 :]
        u = self._drivers(s, u0, d)[0]
        w, _ = self.weights(b)
        values = [self.blocks[k].value(x, u, self.p) for k in self.ancestors(b)]
        F, J, _ = values[-1]
        own = [chain.index(i) for i in graph.own]
        system = ca.vertcat(*[value[0] for value in values], J @ (w * v), ca.sumsqr(v) - 1)
        slope = ca.jtimes(F, y[own], w * v)
        bend = ca.jtimes(slope, y[own], w * v)
        whole = ca.vertcat(self.consts, u0, d)
        results = [system, ca.jacobian(system, y), J, ca.jacobian(F, y), bend]
        return ca.Function("fold", [y, whole], [ca.densify(part) for part in results], OPTIONS)


def _put(vector: Any, positions: list[int], values: Any) -> Any:
    """Return the vector with some entries replaced."""
    if not positions:
        return vector
    result = SX(vector)
    result[positions] = ca.densify(values)
    return result


def _column(items: list[Any]) -> Any:
    return ca.vertcat(*items) if items else SX(0, 1)


__all__ = ["Graphs", "NoMajorant"]
