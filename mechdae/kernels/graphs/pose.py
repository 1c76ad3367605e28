"""The casadi functions of a pose of a scene: Newton's method, rates, what certifies it.

Naming: x unknowns, u drivers, p parameters, s the path parameter with u = u0 + s d, or
u = u(s) along a course (a law of time).
Every block b has beta = |J_b^-1| (Frobenius), kappa = a Lipschitz constant of J_b.

Newton-Kantorovich: with eta = |last step| and h = beta kappa eta <= 1/2 the block has one
root within 2 eta of the guess, and the distance after the step is at most h eta for
h <= 1/4 (Ortega and Rheinboldt, Iterative Solution of Nonlinear Equations, 1970, 12.6.2).

A redundant block has a left inverse A of its Jacobian in place of the inverse. The theorem
then holds for A F = 0, which every solution of F = 0 solves; that F itself vanishes, to within
`CLOSURE` times its rounding or the mechanism's tolerance, is checked beside it.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Self

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import ANGLE, PLACE
from mechdae.describe.mechanism import TOLERANCE
from mechdae.equations.reduction import Block, Scene
from mechdae.equations.structure_cache import StructureCache, structure_property
from mechdae.kernels.bounds.walk import with_trig
from mechdae.kernels.graphs.blocks import (
    ADJUGATE_LIMIT,
    BlockGraph,
    column,
    inverse,
    left_inverse,
    norm,
)
from mechdae.kernels.graphs.driver_curve import DriverCurve
from mechdae.kernels.run.functions import Call, without_repeats
from mechdae.kernels.run.numpy_backend import NumpyFunction, straight
from mechdae.kernels.stored.functions import fingerprint, stored_property
from mechdae.types import Floats, Graph, Sym

if TYPE_CHECKING:
    from mechdae.equations.cases.curve_contacts import Contact
    from mechdae.kernels.bounds.intervals import Floors

SX = ca.SX
CLOSURE = 64
"""Rounding bounds of a redundant block by which its equations may stay open: data that are
consistent in exact arithmetic are not so as float64 numbers."""
FEW = 8
"""Blocks up to which what several of them share is looked for: it takes longer than all else."""


class PoseGraphs:
    """Functions of a pose of one scene; each is built when it is first asked for.

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

    low: Sym
    high: Sym

    def __init__(
        self,
        scene: Scene,
        outputs: Sym,
        derivatives: int = 2,
        course: DriverCurve | None = None,
        lines: bool = False,
    ) -> None:
        self.scene: Scene = scene
        self.outputs: Sym = outputs
        self.derivatives: int = derivatives
        self.course = course
        self.cache: StructureCache = StructureCache()
        self.blocks: list[BlockGraph] = [BlockGraph(scene, block) for block in scene.blocks]
        self.nx: int = scene.x.numel()
        self.nu: int = scene.u.numel()
        self.nb: int = len(self.blocks)
        self.first: list[int] = [graph.own[0] for graph in self.blocks]
        self.np: int = scene.model.p.numel()
        self.ny: int = outputs.numel()
        self.single: bool = self.nu == 1 and course is None and not lines
        self.x: Sym = SX.sym("x", self.nx)
        self.u: Sym = SX.sym("u", self.nu)
        self.p: Sym = scene.model.p
        self.scale: Sym = SX.sym("scale")
        self.kappa: Sym = SX.sym("kappa", self.nb)
        self.rho: Sym = SX.sym("rho", self.nb)
        self.grain: Sym = SX.sym("grain", self.nx)
        owners = {name for group in scene.groups for name in group.joints}
        self.contacts: list[Contact] = [
            c for name, c in scene.model.contacts.items() if name in owners
        ]
        self.floor: Sym = SX(0, 1)
        if self.contacts:
            from mechdae.kernels.bounds.intervals import SLOTS

            self.floor = SX.sym("floor", SLOTS)
        owned = {contact.joint.name for contact in self.contacts}
        self.places: list[int] = [
            i for i, c in enumerate(scene.unknowns) if c.kind is PLACE and c.owner in owned
        ]
        self.low, self.high = (SX.sym(name, len(self.places)) for name in ("low", "high"))
        self.consts: Sym = ca.vertcat(
            self.p, self.scale, self.kappa, self.rho, self.grain, self.floor
        )
        if self.single:
            self.driven: list[Sym] = [SX(1), SX(0), SX(0)]
        else:
            names = ("du", "ddu", "dddu")[: max(derivatives, 2)]
            self.driven = [SX.sym(name, self.nu) for name in names]

    def at(self, scene: Scene) -> Self:
        """Return the same functions for the scene with other numbers."""
        other = copy(self)
        other.scene = scene
        return other

    @property
    def turns(self) -> bool:
        """Whether s is an angle: a whole turn of it leads to the same pose."""
        return self.course.turns if self.course else self.single and self.scene.drivers[0].is_angle

    def of_all_blocks(self, name: str, inputs: list[Sym], results: list[Sym]) -> Graph:
        """Return a function of all blocks; what one block repeats is shared in any case."""
        make = without_repeats if self.nb <= FEW else ca.Function
        return make(name, inputs, results)

    @structure_property
    def floors(self) -> Floors:
        """What curves divide by."""
        from mechdae.kernels.bounds.intervals import Floors

        return Floors(self.floor)

    @structure_property
    def adjugates(self) -> list[int]:
        """The blocks of three and more unknowns that are inverted by their adjugates."""
        sizes = [0 if graph.redundant else graph.size for graph in self.blocks]
        return [b for b, size in enumerate(sizes) if 2 < size <= ADJUGATE_LIMIT]

    @structure_property
    def depths(self) -> list[int]:
        """How many blocks stand one behind the other up to each block, itself included."""
        found: list[int] = []
        for graph in self.blocks:
            before = (found[bisect_right(self.first, i) - 1] for i in graph.uses)
            found.append(1 + max(before, default=0))
        return found

    def ancestors(self, b: int) -> list[int]:
        """Return the blocks that block `b` depends on, itself last."""
        wanted = {b}
        for other in range(b, -1, -1):
            if other in wanted:
                wanted |= {bisect_right(self.first, i) - 1 for i in self.blocks[other].uses}
        return sorted(wanted)

    # -- weights ---------------------------------------------------------------------------

    @structure_property
    def weights(self) -> list[tuple[Sym, Sym]]:
        """Column and row weights that make each block of mixed units dimensionless."""
        return [self._weights(graph.block) for graph in self.blocks]

    def _weights(self, block: Block) -> tuple[Sym, Sym]:
        unknowns = [self.scene.unknowns[i] for i in block.x]
        kind = unknowns[0].kind
        alike = kind is not PLACE and all(c.kind is kind for c in unknowns)
        if alike and len(set(block.units)) == 1:
            return SX.ones(len(unknowns)), SX.ones(len(block.units))
        one = SX(1)
        columns = ca.vertcat(*[c.size_symbol(self.scale) for c in unknowns])
        rows = ca.vertcat(*[self.scale if unit == "m" else one for unit in block.units])
        return columns, rows

    @structure_property
    def _units(self) -> Call:
        """All column and all row weights of blocks as a function of scale and p."""
        results = [column([pair[k] for pair in self.weights]) for k in (0, 1)]
        inputs = [self.scale, self.p]
        return Call(ca.Function("units", inputs, [ca.densify(part) for part in results]))

    def units(self, scale: float, p: Floats) -> tuple[list[Floats], list[Floats]]:
        """Return the column and the row weights of each block as numbers."""
        columns, rows = self._units(scale, p)
        if not self.nb:
            return [], []
        ends = np.cumsum([graph.rows for graph in self.blocks])[:-1]
        return np.split(columns, self.first[1:]), np.split(rows, ends)

    def _once(
        self, name: str, b: int, make: Callable[..., list[Any]], inputs: list[Sym]
    ) -> list[Sym]:
        """Return make(*inputs), made once for all blocks of one shape.

        `make` holds no other symbols of the scene but the scale, and of the shape its q.
        """
        shape = self.blocks[b].shape
        if not shape.shared:
            return make(*inputs)

        def function() -> Graph:
            symbols = [SX.sym(f"i{k}", part.sparsity()) for k, part in enumerate(inputs)]
            return without_repeats(name, [*symbols, self.scale, shape.q], make(*symbols))

        made = self.cache((name, shape, len(inputs)), function)
        results: list[Sym] = made.call([*inputs, self.scale, self.blocks[b].q])
        return results

    @property
    def tolerated(self) -> Sym:
        """What redundant equations may stay open by because the user says so, as rounding [m]."""
        return self.scene.model.numbers.get(TOLERANCE, SX(0)) / CLOSURE

    def _solve(self, b: int, at: Sequence[Sym]) -> tuple[Sym, Sym, Sym, Sym, Sym]:
        """Return F, F_z, the inverse, the determinant and beta of a block."""
        F, J, Fz = self.blocks[b].shape.value(*at)
        inv, det = self.inverse_of(b, J)
        w, r = self.weights[b]
        return F, Fz, inv, det, norm(ca.diag(1 / w) @ inv @ ca.diag(r))

    def inverse_of(self, b: int, J: Sym) -> tuple[Sym, Sym]:
        """Return the inverse of a block's Jacobian and its determinant."""
        if not self.blocks[b].redundant:
            return inverse(J)
        w, r = self.weights[b]
        return ca.diag(w) @ left_inverse(ca.diag(1 / r) @ J @ ca.diag(w)) @ ca.diag(1 / r), SX(1)

    def _length(self, b: int, step: Sym) -> Sym:
        return norm(step / self.weights[b][0])

    # -- Newton and rates ------------------------------------------------------------------

    def newton(
        self, x: Sym, u: Sym, held: frozenset[int] = frozenset()
    ) -> tuple[Sym, list[Sym], tuple[Sym, Sym]]:
        """Return x after one Newton step block by block, |step|^2 of each, and sin x, cos x.

        Blocks that are `held` keep their unknowns.

        Sine and cosine of angles are carried along to second order in the step, exact to rounding
        for steps below 1e-5: a later block sees its earlier unknowns as they are after the step.
        """
        eta = []
        x, sines, cosines = SX(x), ca.sin(x), ca.cos(x)
        for b, graph in enumerate(self.blocks):
            if b in held:
                eta.append(SX(0))
                continue
            at = graph.at(x, u, (sines, cosines))
            new, s, c, square = self._once("newton", b, partial(self._newton, b), at)
            x[graph.own] = new
            if graph.turning:
                sines[graph.turning], cosines[graph.turning] = s, c
            eta.append(square)
        return x, eta, (sines, cosines)

    def _newton(self, b: int, *at: Sym) -> list[Sym]:
        """Return new unknowns of a block, sine and cosine of its angles, |step|^2."""
        graph = self.blocks[b]
        F, J, _ = graph.shape.value(*at)
        step = ca.densify(self.inverse_of(b, J)[0] @ F)
        new, square = at[0] - step, ca.sumsqr(step / self.weights[b][0])
        if not graph.turning:
            return [new, SX(0, 1), SX(0, 1), square]
        turn = step[[graph.own.index(i) for i in graph.turning]]
        s, c, half = at[4][: turn.numel()], at[5][: turn.numel()], turn * turn / 2
        return [new, s - (turn * c + half * s), c + (turn * s - half * c), square]

    def rates(
        self,
        x: Sym,
        u: Sym,
        driven: list[Sym],
        order: int,
        trig: tuple[Sym, Sym] | None = None,
        eta: list[Sym] | None = None,
        held: Mapping[int, tuple[Sym, Sym, Sym]] = MappingProxyType({}),
    ) -> dict[str, Sym]:
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
        name = f"rates_{order}_{eta is None}"
        for b, graph in enumerate(self.blocks):
            unknowns, used = graph.own, graph.used
            inputs = [*graph.at(x, u, trig), used(error), self.kappa[b], self.rho[b]]
            inputs += [self.grain[unknowns], SX(0) if eta is None else eta[b]]
            inputs += [used(v), used(a), used(j), *driven[:order]]
            found = self._once(name, b, partial(self._rates, b), inputs)
            local, det, beta, *rates = found
            if b in held:
                first, second, local = held[b]
                if first is not None:
                    rates[:2] = [first, second][:order]
                rates[2:] = [SX.nan(graph.size)] * (order - 2)
            for vector, rate in zip((v, a, j), rates, strict=False):
                vector[unknowns] = ca.densify(rate)
            error[unknowns] = ca.densify(local)
            dets.append(det)
            betas.append(beta)
        certificate = {"error": error, "det": column(dets), "beta": column(betas)}
        return {"v": v, "a": a, "j": j, **certificate}

    def _rates(self, b: int, *parts: Sym) -> list[Sym]:
        """Return error, determinant, beta and rates of a block from the inputs of `rates`."""
        at, (before, kappa, rho, grain, eta, *used), driven = parts[:6], parts[6:14], parts[14:]
        graph = self.blocks[b]
        F, Fz, inv, det, beta = self._solve(b, at)
        known: list[Sym] = []
        for k, make in enumerate((graph.first_rate, graph.second_rate, graph.third_rate)):
            if k < len(driven):
                known.append(inv @ make(at, known, used, driven))
        off = beta * rho  # the step is off by so much: 1.25 (eta + off)^2 <= 2 eta^2 + 4 off^2
        left = 2 * kappa * (eta + 2 * off * off)
        if graph.redundant:
            r, noise = self.weights[b][1], rho
            if graph.uses:
                noise = noise + norm((ca.fabs(Fz) @ before) / r)
            det = 1 - norm(F / r) / (CLOSURE * noise)
            left += 2 * norm(F / r)
        error = (off + beta * left) * self.weights[b][0] + grain
        if graph.uses:
            error += ca.fabs(inv @ Fz) @ before
        return [error, det, beta, *known]

    @structure_property
    def fingerprint(self) -> str | None:
        """What names these kernels on disk: everything they are built from; None: not kept."""
        if self.contacts:
            return None
        scene = self.scene
        sizes = [c.size_symbol(self.scale) for c in scene.unknowns]
        parts = [*(graph.F for graph in self.blocks), *(c.residual for c in scene.checks), *sizes]
        parts += [self.tolerated] if scene.redundant else []
        results = [column(parts), self.outputs]
        inputs = [scene.x, scene.u, self.p, self.scale]
        equations = ca.Function("equations", inputs, [ca.densify(part) for part in results])
        blocks = [(g.own, g.uses, g.block.units, g.redundant, g.params) for g in self.blocks]
        course = self.course and (self.course.text, self.course.turns)
        kinds = [c.kind.name for c in scene.unknowns]
        numbers = (self.derivatives, self.single, self.nu, len(scene.checks), course)
        return fingerprint(equations, blocks, kinds, numbers)

    @stored_property
    def pose(self) -> Graph:
        """One Newton step and everything that is reported at a pose.

        (x, u, consts) -> x, error, det, beta, eta^2, y, y', ... up to the order asked for;
        rates of several drivers (u', u'', with the third order u''') follow u. `error` bounds
        the distance of each unknown from the exact solution, the term h eta included. beta
        is taken after the step: before it, it is at most beta / (1 - h).
        """
        x, eta, trig = self.newton(self.x, self.u)
        parts = self.rates(x, self.u, self.driven, self.derivatives, trig, eta)
        outputs = self.output_rates(x, trig, parts)
        inputs = [self.x, self.u, *([] if self.single else self.driven), self.consts]
        results = [x, parts["error"], parts["det"], parts["beta"], column(eta), *outputs]
        return self.of_all_blocks("pose", inputs, results)

    @structure_property
    def straight_pose(self) -> NumpyFunction | None:
        """`pose` as a straight line of NumPy operations; the last input is shared."""
        return straight(self.pose, [self.pose.n_in() - 1])

    def held(self, blocks: frozenset[int]) -> Graph:
        """Return `pose` with the unknowns of some blocks given, not solved for.

        (x, u[, du, ddu[, dddu]], consts, x', x'', error) -> as `pose`; with one driver or a
        course the rates of those blocks are given too. Near a change point their equations lose
        all digits.
        """
        v, a, error = (SX.sym(name, self.nx) for name in ("v", "a", "error"))
        x, eta, trig = self.newton(self.x, self.u, blocks)
        known = {}
        for b in blocks:
            unknowns = self.blocks[b].own
            rates = (v[unknowns], a[unknowns]) if self.single or self.course else (None, None)
            known[b] = (*rates, error[unknowns])
        parts = self.rates(x, self.u, self.driven, self.derivatives, trig, eta, known)
        outputs = self.output_rates(x, trig, parts)
        inputs = [self.x, self.u, *([] if self.single else self.driven), self.consts]
        results = [x, parts["error"], parts["det"], parts["beta"], column(eta), *outputs]
        return self.of_all_blocks("held", [*inputs, v, a, error], results)

    def output_rates(self, x: Sym, trig: tuple[Sym, Sym], parts: dict[str, Sym]) -> list[Sym]:
        """Return y, y', ... at solved unknowns with the sines and cosines of all of them."""
        y, scene = self.outputs, self.scene
        old = ca.vertcat(scene.x, scene.u)
        # the total derivative along (v, a, j), as often as asked for
        along = [SX.sym(name, self.nx + self.nu) for name in "vaj"[: self.derivatives]]
        values = [y]
        for order in range(self.derivatives):
            at = ca.vertcat(old, *along[:order])
            values.append(ca.jtimes(values[-1], at, ca.vertcat(*along[: order + 1])))
        turning = [i for i, c in enumerate(scene.unknowns) if c.kind is ANGLE]
        angles, (sines, cosines) = scene.x[turning], (part[turning] for part in trig)
        symbols = [SX.sym(name, len(turning)) for name in ("sin", "cos")]
        values = with_trig(values, angles, *symbols)
        inputs = [scene.x, scene.u, self.p, *symbols, *along]
        rates = [ca.vertcat(parts[n], du) for n, du in zip("vaj", self.driven, strict=False)]
        function = ca.Function("outputs", inputs, values)
        known = (x, self.u, self.p, sines, cosines, *rates[: self.derivatives])
        return function.call(known)
