"""From guesses of a pose to outputs as one casadi graph, to be differentiated by parameters.

At a solved pose x the step x - J^-1 F(x, p) does not move, and its derivative by p is that of
the solution (implicit function theorem); a second step makes second derivatives exact too.
Speeds, accelerations, reactions and friction follow from it without iteration, or with steps
of the same kind.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import casadi as ca

from mechdae.additions import Added, Registry
from mechdae.describe.file.problem import Problem
from mechdae.equations.parameters import parameters_of
from mechdae.errors import UnknownName
from mechdae.forces.inverse_dynamics import InverseDynamics
from mechdae.forces.poses import unknown_columns
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import without_repeats
from mechdae.motion.continuation.evaluate import in_time
from mechdae.motion.kinematics.prepared import Setting
from mechdae.types import Graph, Sym

SX = ca.SX
STEPS = 2
"""Newton steps of a pose: derivatives up to the second are exact."""
FAR = 5
"""The same from a guess that belongs to other parameters."""
SMOOTH_STEPS = 3
"""Steps for the sizes of friction where they are optimised: a sweep judges the result."""
INPUT = "input"
"""The power of all drivers."""
FORCES = ("reaction", "reaction_uncoupled", "loss", "loss_uncoupled", "normal")


SERIES: Registry[Added] = Registry("series", {}, made=lambda added: added)
"""Further series of poses: of a scene and a path an expression over (x, u, p)."""


class Composed:
    """Outputs of a setting over guesses, drivers and some parameters.

    `apart`: whether the parameters may be apart from those the guess belongs to: more Newton steps
    then, signs of sliding speeds and friction solved again, and a last output `miss` that tells how
    far a step still moved. Inputs have the parameters' own values (`origin`) last. `smooth`: take
    the guess as the solved pose, and signs of sliding speeds as smooth functions of them over this
    share of the drivers' speed: for optimisation. Friction is solved again. `solved`: take the
    guess as the solved pose, which depends on the parameters: for first derivatives. `numbers`,
    `dependent`: whether p is an input; whether the drivers' values and rates depend on the
    parameters: their first and second derivatives are the last inputs then. ``spans``: the rows of
    the stacked outputs that belong to each path.
    """

    def __init__(
        self,
        setting: Setting,
        paths: Sequence[str],
        names: Sequence[str],
        statics: InverseDynamics | None = None,
        apart: bool = False,
        smooth: float | None = None,
        solved: bool = False,
        numbers: bool = False,
        dependent: bool = False,
    ) -> None:
        self.setting, self.paths, self.names, self.statics = setting, list(paths), names, statics
        self.apart, self.smooth, self.solved, self.miss = apart, smooth, solved, SX(0)
        g = self.graphs = setting.graphs
        self.guess, self.u = SX.sym("guess", g.nx), SX.sym("u", g.nu)
        self.du, self.ddu = SX.sym("du", g.nu), SX.sym("ddu", g.nu)
        self.free: Sym = SX.sym("free", len(names))
        self.time: Sym = SX.sym("t")
        model = setting.scene.model
        given = [SX.sym("p", model.p.numel())] if numbers else []
        self.p = parameters_of(model, names, self.free, *given)
        count = len(statics.balance.feedbacks) if statics else 0
        self.pieces: Sym = SX.sym("pieces", statics.balance.pieces.numel() if statics else 0)
        self.signs: Sym = SX.sym("signs", statics.balance.signs.numel() if statics else 0)
        self.sizes: Sym = SX.sym("m", count)
        self.inputs: list[Sym] = [
            self.guess, self.u, self.du, self.ddu, self.time, self.pieces, self.signs,
            self.sizes, self.free, *given,
        ]  # fmt: skip
        self._origin: Sym | None = None
        if dependent:
            self._follow_drivers()
        parts = [self._output(path) for path in self.paths]
        self.spans: list[slice] = []
        start = 0
        for part in parts:
            self.spans.append(slice(start, start + part.numel()))
            start += part.numel()
        self.expression: Sym = ca.densify(ca.vertcat(*parts)) if parts else SX(0, 1)

    # -- kinematics ------------------------------------------------------------------------

    @property
    def values(self) -> list[Sym]:
        """The outputs y and their rates in time."""
        return self._solved[1]

    @cached_property
    def _solved(self) -> tuple[Sym, list[Sym]]:
        """The unknowns of the pose, the outputs and their rates in time."""
        g = self.graphs
        eta: list[Sym] = []
        x, trig = g.x, None
        for _ in range(0 if self.smooth or self.solved else FAR if self.apart else STEPS):
            x, eta, trig = g.newton(x, g.u)
        parts = g.rates(x, g.u, g.driven, g.derivatives, trig)
        found = [x, *g.output_rates(x, (ca.sin(x), ca.cos(x)), parts), sum(eta, SX(0))]
        driven = [] if g.single else g.driven
        function = ca.Function("kinematics", [g.x, g.u, *driven, g.consts], found)
        rest = SX.ones(g.consts.numel() - self.p.numel())
        rates = [] if g.single else [self.du, self.ddu, *[SX.zeros(g.nu)]][: len(driven)]
        results = list(function.call([self.guess, self.u, *rates, ca.vertcat(self.p, rest)]))
        self.miss = ca.sqrt(results.pop())
        pose = results.pop(0)
        return pose, in_time(results, self.du, self.ddu) if g.single else list(results)

    @cached_property
    def coordinates(self) -> tuple[Sym, Sym, Sym]:
        """w, dw, ddw of the balance: unknowns and drivers' values with their rates in time."""
        columns = unknown_columns(self.setting)
        parts = zip(self.values, (self.u, self.du, self.ddu), strict=False)
        w, dw, ddw = (ca.vertcat(value[columns], driven) for value, driven in parts)
        return w, dw, ddw

    # -- forces ----------------------------------------------------------------------------

    @cached_property
    def _forces(self) -> tuple[list[Sym], list[Sym]]:
        """What `Balance.report` gives with friction, and without it."""
        assert self.statics is not None
        balance = self.statics.balance
        signs = self.signs
        if signs.numel() and (self.apart or self.smooth):
            speeds = balance.slipping.call([*self.coordinates[:2], self.p])[0]
            signs = self._smoothed(speeds) if self.smooth else ca.sign(speeds)
        inputs = [*self.coordinates, self.time, self.pieces, signs, self.p, SX(1)]
        free = balance.report(friction=False).call([*inputs, balance.solve.call(inputs)[0]])
        if not self.statics.coupled:
            return free, free
        if self.smooth:
            law = balance.solve.call(inputs)[0]
            sizes = balance.refined(SMOOTH_STEPS).call([*inputs, law])[0]
        elif self.apart:
            _, sizes, misses, _ = balance.solve.call(inputs)
            for miss in ca.vertsplit(misses):
                self.miss = ca.fmax(self.miss, miss)
        else:
            sizes = balance.refined(1 if self.solved else STEPS).call([*inputs, self.sizes])[0]
        return balance.report().call([*inputs, sizes]), free

    def _smoothed(self, speeds: Any) -> Any:
        """Return signs that pass through zero smoothly."""
        assert self.statics is not None
        assert self.smooth is not None
        fast = ca.norm_2(self.du)
        units = [slip.unit for slip in self.statics.balance.slips]
        sizes = [self.statics.length if unit == "m" else 1.0 for unit in units]
        return speeds / ca.sqrt(speeds**2 + (self.smooth * fast * ca.DM(sizes)) ** 2)

    def _output(self, path: str) -> Sym:
        head, _, tail = path.partition("/")
        if path == INPUT:
            assert self.statics is not None
            return self._forces[0][1].T @ self.du
        if head in ("efforts", "efforts_uncoupled"):
            drivers = [c.text for c in self.setting.scene.drivers]
            if tail not in drivers:
                raise UnknownName("driver", tail, drivers)
            whole, free = self._forces
            results = free if head.endswith("uncoupled") else whole
            return results[1][drivers.index(tail)]
        part, _, quantity = tail.rpartition("/")
        if head == "joints" and quantity in FORCES and self.statics is not None:
            return self._of_joint(part, quantity)
        if head == "outputs":
            return self._named(part, quantity)
        if quantity in SERIES.added():
            scene = self.setting.scene
            known = ca.vertcat(scene.x, scene.u, scene.model.p)
            found = SERIES[quantity].load()(scene, path)
            return ca.substitute(found, known, ca.vertcat(self._solved[0], self.u, self.p))
        order, columns = self.setting.outputs.column_of(path)
        return self.values[order][list(columns)]

    def _of_joint(self, name: str, quantity: str) -> Sym:
        assert self.statics is not None
        balance = self.statics.balance
        if name not in balance.joints:
            raise UnknownName("joint", name, balance.joints)
        whole, free = self._forces
        results = free if quantity.endswith("uncoupled") else whole
        k = balance.joints.index(name)
        if quantity.startswith("reaction"):
            width = self.setting.scene.model.space.freedoms
            return results[0][width * k : width * (k + 1)]
        if quantity.startswith("loss"):
            return results[2][balance.lossy.index(name)] if name in balance.lossy else SX(0)
        if name not in balance.guides:
            raise UnknownName("guide", name, balance.guides)
        return results[3][balance.guides.index(name)]

    def _named(self, name: str, quantity: str) -> Sym:
        """Return a named output's value or one of its rates."""
        named = self.setting.expressions
        assert named is not None
        columns = self.setting.outputs.columns(named.coordinates)
        stacked = ca.vertcat(*[value[columns] for value in self.values[: named.derivatives + 1]])
        return named.row(name, quantity, stacked, self.time, self.p)

    # -- drivers ---------------------------------------------------------------------------

    def _follow_drivers(self) -> None:
        """Let the drivers' values and rates depend on the parameters."""
        k, nu = self.free.numel(), self.u.numel()
        slopes, bends = SX.sym("slopes", 3 * nu * k), SX.sym("bends", 3 * nu * k * k)
        self._origin = SX.sym("origin", k)
        away = self.free - self._origin
        moved = ca.reshape(slopes, 3 * nu, k) @ away
        moved += ca.reshape(bends, 3 * nu, k * k) @ ca.vec(away @ away.T) / 2
        # `origin` is the value of the parameters itself: only derivatives see the difference
        whole = ca.vertcat(self.u, self.du, self.ddu) + moved
        self.u, self.du, self.ddu = ca.vertsplit(whole, [0, nu, 2 * nu, 3 * nu])
        self.inputs = [*self.inputs, slopes, bends]

    def _at_origin(self, expression: Sym) -> Sym:
        if self._origin is None:
            return expression
        return ca.substitute(expression, self._origin, self.free)

    # -- functions -------------------------------------------------------------------------

    @cached_property
    def function(self) -> Graph:
        """(guess, u, du, ddu, t, pieces, signs, m, free) -> outputs, stacked."""
        return without_repeats("outputs", self.inputs, [self._at_origin(self.expression)])

    @cached_property
    def sampled(self) -> Graph:
        """The same inputs and the origin -> outputs with `miss` as the last one."""
        origin = SX.sym("none", len(self.names)) if self._origin is None else self._origin
        stacked = ca.vertcat(self.expression, self.miss)
        return without_repeats("sampled", [*self.inputs, origin], [stacked])

    def derivatives(self, order: int) -> Graph:
        """Return (inputs) -> outputs and their derivatives by names, by columns, up to `order`."""
        y, free = self.expression, self.free
        if self.solved:
            seeds = ca.vertcat(self._slopes, SX.eye(free.numel()))
            results = [y, ca.jtimes(y, ca.vertcat(self.guess, free), seeds)]
        else:
            results = [y, ca.jacobian(y, free)]
        if order == 2:
            results.append(ca.jacobian(ca.vec(ca.densify(results[1])), free))
        flat = [self._at_origin(ca.vec(ca.densify(result))) for result in results]
        return without_repeats("derivatives", self.inputs, flat)

    @property
    def _slopes(self) -> Sym:
        """Derivatives of the solved unknowns by the free parameters."""
        point = ca.vertcat(self.guess, self.u, self.p, 1)
        return slopes_of_unknowns(self.graphs, point, self.free)


def slopes_of_unknowns(graphs: Graphs, point: Any, free: Any) -> Any:
    """Return the derivatives (nx, k) of the unknowns of a pose by parameters (k,).

    By the theorem of implicit functions, block by block; `point` holds x, u, p and the scale, p
    over the parameters.
    """
    slopes = SX.zeros(graphs.nx, free.numel())
    symbols = ca.vertcat(graphs.x, graphs.u, graphs.p, graphs.scale)
    for b, graph in enumerate(graphs.blocks):
        F, J, Fz = graph.value(graphs.x, graphs.u)
        parts = [ca.densify(F), ca.densify(Fz), ca.densify(graphs.inverse_of(b, J)[0])]
        F, Fz, inverse = ca.substitute(parts, [symbols], [point])
        push = ca.jacobian(F, free)
        if graph.uses:
            push += Fz @ slopes[graph.uses, :]
        slopes[graph.own, :] = -inverse @ push
    return slopes


def is_series(path: str) -> bool:
    """Return whether a path has a value at each pose that `Composed` computes."""
    head = path.split("/")[0]
    return head in ("bodies", "points", "joints", "efforts", "efforts_uncoupled", "outputs")


def without_expressions(problem: Problem, names: Sequence[str]) -> Problem:
    """Return the problem with numbers in place of expressions, which hide them from derivatives."""
    mechanism = problem.mechanism
    numbers, values = {**dict(mechanism.numbers()), **mechanism.parameters}, mechanism.values()
    return problem.with_values({n: values[n] for n in names if isinstance(numbers[n], str)})
