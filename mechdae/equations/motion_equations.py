"""The model with its drivers released: free coordinates x, what is left of the constraints.

Constant pivots are eliminated from all joint equations and laws of time at once, q = q(x, t),
so that few coordinates and constraints remain,

    M(x) x'' + J^T lambda = f(x, x', t),    J x'' = gamma(x, x', t),    J = d phi / dx,

with M = V^T M_q V and f = V^T (Q - M_q V' x' - h), V = dq/dx. The multipliers of the constraints
that are left are those of the whole set; the eliminated ones follow from the balance of
the eliminated coordinates (`kernels.recovery`).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import NamedCoordinate, coordinate
from mechdae.describe.expression import names_in
from mechdae.describe.loads import Spring
from mechdae.equations.forces.dry_friction import Rubbing
from mechdae.equations.forces.feedback import Feedback, Slip, Unilateral
from mechdae.equations.forces.generalised import (
    Wrench,
    add,
    inertia,
    kinetic_energy,
    of_coordinates,
    power,
)
from mechdae.equations.forces.joint_reactions import JointReactions
from mechdae.equations.forces.loads import Loads, Signal
from mechdae.equations.model import Model, Row
from mechdae.equations.reduction import eliminate, with_unknowns
from mechdae.equations.structure_cache import StructureCache
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Sym

SX = ca.SX


@dataclass(frozen=True)
class Law:
    """A coordinate that follows an expression of the time."""

    coordinate: NamedCoordinate
    value: Sym


AUXILIARY = ("norm", "spin", "angle", "angle2")
"""Equations in space that hold nothing: of unit quaternions, and of angles of cut joints."""


class Released:
    """Equations of motion of a mechanism in the coordinates that constant pivots leave.

    Parameters
    ----------
    model
        Symbols of the mechanism.
    loads
        What acts on it; its time is the time of the laws.
    laws
        Coordinates that follow the time.
    held
        Coordinates, (owner, name), that keep a value since nothing moves them; their values are
        among ``signs``.
    rubbing
        Dry friction; without it that of resistances.
    unilateral
        Contacts that push only; which of them are closed is among ``signs``, as the last.

    Attributes
    ----------
    rows : list of Row
        Equations of the joints, then those of the laws and of what is held.
    t, x, v : SX
        Time, free coordinates and their rates.
    coordinates : Coordinates
        What x are.
    left, gone : list of int
        Rows that are left as constraints, and rows that were eliminated.
    empty : list of int
        Rows without a free coordinate: they hold or they do not.
    solved : list of int
        Positions in q of the eliminated coordinates.
    q, qd : SX (nq,)
        Absolute coordinates and their rates over (x, v, t, p).
    """

    def __init__(
        self,
        model: Model,
        loads: Loads,
        laws: Sequence[Law] = (),
        held: Sequence[tuple[str, str]] = (),
        rubbing: Rubbing | None = None,
        unilateral: Sequence[Unilateral] = (),
    ) -> None:
        self.unilateral: list[Unilateral] = list(unilateral)
        self.closed: Sym = SX.sym("closed", len(unilateral))
        self.rubbing: Rubbing = rubbing or Rubbing(model, loads, friction=False)
        self.model: Model = model
        self.loads: Loads = loads
        self.laws: list[Law] = list(laws)
        self.t: Sym = loads.time
        self.cache: StructureCache = StructureCache()
        self.values: Sym = SX.sym("held", len(held))
        self.rows: list[Row] = list(model.rows)
        for law in laws:
            c = law.coordinate
            residual = model.coordinate(c) - law.value
            self.rows.append(Row(c.text, "law", residual, c.unit, driver=True))
        for i, key in enumerate(held):
            coordinate = model.coordinates[model.places[key]]
            residual = coordinate.symbol - self.values[i]
            self.rows.append(
                Row(coordinate.owner, coordinate.name, residual, coordinate.unit, True)
            )
        nonzero = [
            model.numbers[f"{name}.{entry}"]
            for name, joint in model.mechanism.joints.items()
            for entry in joint.pivots
        ]
        equations = [(row.expression, row.unit, str(i)) for i, row in enumerate(self.rows)]
        symbols = model.q.elements()
        solved, rest, left = eliminate(equations, symbols, nonzero)
        rest, without = with_unknowns(rest, left)
        self.left: list[int] = [int(tag) for _, _, tag in rest]
        self.empty: list[int] = [int(tag) for _, _, tag in without]
        left_over = {*self.left, *self.empty}
        self.gone: list[int] = [i for i in range(len(self.rows)) if i not in left_over]
        self.x: Sym = ca.vertcat(*left) if left else SX(0, 1)
        self.v: Sym = SX.sym("rate", len(left))
        self.coordinates = model.coordinates_among(left)
        places = {symbol.element_hash(): j for j, symbol in enumerate(symbols)}
        self.free: list[int] = [places[symbol.element_hash()] for symbol in left]
        self.solved: list[int] = [places[symbol.element_hash()] for symbol, _, _ in solved]
        expressions = dict(zip(self.free, left, strict=True))
        expressions |= {j: equation[1] for j, equation in zip(self.solved, solved, strict=True)}
        self.q: Sym = ca.vertcat(*[expressions[j] for j in range(len(symbols))])
        self.phi: Sym = _column([expression for expression, _, _ in rest])
        self.residue: Sym = _column([expression for expression, _, _ in without])
        self.units: list[str] = [self.rows[i].unit for i in self.left]

    def tells(self, row: Row) -> bool:
        """Return whether the multiplier of an equation is a force or a moment that holds."""
        return row.driver or not self.model.space.behind or row.part not in AUXILIARY

    # -- kinematics --------------------------------------------------------------------------

    def rate(self, expression: Sym) -> Sym:
        """Return the derivative in time of an expression over (x, t), or (x, v, t) at x'' = 0."""
        at, along = ca.vertcat(self.x, self.t), ca.vertcat(self.v, SX(1))
        return ca.jtimes(expression, at, along)

    @cached_property
    def V(self) -> Sym:
        """dq/dx, (nq, n)."""
        return ca.jacobian(self.q, self.x)

    @cached_property
    def qd(self) -> Sym:
        return self.rate(self.q)

    @cached_property
    def bias(self) -> Sym:
        """The acceleration of q at x'' = 0."""
        return self.rate(self.qd)

    @cached_property
    def J(self) -> Sym:
        """Jacobian of the constraints that are left, (m, n)."""
        return ca.jacobian(self.phi, self.x)

    @cached_property
    def phi_t(self) -> Sym:
        """Explicit derivative of the constraints in time, (m,)."""
        return ca.jacobian(self.phi, self.t) if self.laws else SX.zeros(self.phi.numel())

    @cached_property
    def gamma(self) -> Sym:
        """Right-hand side of J x'' = gamma, (m,)."""
        return -self.rate(self.rate(self.phi))

    # -- dynamics ----------------------------------------------------------------------------

    @property
    def signs(self) -> Sym:
        """Inputs that are fixed between events.

        Those of dry friction, pieces of tables over the time, values of what is held, contacts
        that are closed.
        """
        pieces = [table.symbols for table in self.loads.timed]
        return ca.vertcat(self.rubbing.signs, *pieces, self.values, self.closed)

    @property
    def lockable_pairs(self) -> list[Slip | Unilateral]:
        """What may be held at zero speed: slips, then unilateral contacts."""
        return [*self.rubbing.slips, *self.unilateral]

    @property
    def locks(self) -> Sym:
        """Which of the lockable pairs are held, (k,)."""
        return ca.vertcat(SX(0, 1), *self.rubbing.locks, self.closed)

    def locked(self, signs: Floats) -> Booleans:
        """Return the same (n, k) from inputs (n, .), and slips at rest that contacts hold."""
        count, contacts = self.rubbing.count, len(self.unilateral)
        ways, locks, resting = np.split(signs[:, : 3 * count], 3, axis=1)
        closed = signs[:, signs.shape[1] - contacts :]
        return np.hstack([(locks > 0) | (resting > 0) & (ways == 0), closed > 0])

    @cached_property
    def slips(self) -> Sym:
        """Speeds whose signs are inputs."""
        return self.moved(self.rubbing.speeds)

    @cached_property
    def gaps_of_contacts(self) -> Sym:
        """Gaps of the unilateral contacts, (contacts,)."""
        return self.moved(ca.vertcat(SX(0, 1), *[contact.gap for contact in self.unilateral]))

    @cached_property
    def lockable(self) -> Sym:
        """Speeds that may be held at zero, over the absolute coordinates and their rates, (k,)."""
        model = self.model
        rates = [ca.dot(self.stack(c.column), model.velocity) for c in self.unilateral]
        return ca.vertcat(self.rubbing.speeds, *rates)

    @cached_property
    def held_back(self) -> Sym:
        """Generalised forces of locks per unit, at the absolute coordinates, (nq, k)."""
        columns = ca.jacobian(self.lockable, self.model.velocity).T
        return self.moved(columns)

    @cached_property
    def rubbed(self) -> Sym:
        """Generalised forces of friction and bearings per unit of size, (nq, feedbacks)."""
        columns = [self.stack(feedback.column) for feedback in self.rubbing.feedbacks]
        return self.moved(ca.horzcat(*columns))

    @cached_property
    def passed(self) -> JointReactions:
        """Reactions in space of the joints whose forces follow from them."""
        joints = dict.fromkeys(feedback.joint for feedback in self.rubbing.feedbacks)
        return JointReactions(self, list(joints))

    def own(self, feedback: Feedback) -> list[int]:
        """Return the equations of the joint of a feedback."""
        rows = enumerate(self.rows)
        return [i for i, row in rows if row.owner == feedback.joint and not row.driver]

    def pressing(self, feedback: Feedback) -> Sym:
        """Return what has to be unique for a feedback, by multipliers of all rows, (k, rows)."""
        if feedback.contact is not None:
            return SX(feedback.forms.shape[0], len(self.rows))
        forms = feedback.forms if feedback.needs is None else feedback.needs
        forms = self.moved(SX(forms))
        if self.model.space.behind:
            return forms @ self.passed.by_multiplier[self.passed.place(feedback.joint), :]
        found = SX(forms.shape[0], len(self.rows))
        found[:, self.own(feedback)] = forms
        return found

    @cached_property
    def losses(self) -> dict[str, list[tuple[int, Sym]]]:
        """By joint its places among the sizes, and the power lost per unit of each."""
        result: dict[str, list[tuple[int, Sym]]] = {}
        for j, feedback in enumerate(self.rubbing.feedbacks):
            if feedback.friction:
                result.setdefault(feedback.joint, []).append((j, self.moved(feedback.rate)))
        return result

    def gaps(self, length: float) -> list[float]:
        """Return natural sizes of the rows that are left: a `length`, or 1."""
        return [row_size(unit, length) for unit in self.units]

    def moved(self, absolute: Sym, acceleration: object = None) -> Sym:
        """Return an expression over (q, v, a, t) as one over (x, v, t), at x'' = 0 or another."""
        model = self.model
        result = SX(absolute)
        if self.loads.signals:
            pieces = ca.vertcat(*[signal.piece for signal in self.loads.signals])
            values = [
                ca.vertcat(signal.at, _broken_line(signal), 0) for signal in self.loads.signals
            ]
            result = ca.substitute(result, pieces, ca.vertcat(*values))
        inputs = [model.q, model.velocity, model.acceleration, self.t, model.p, self.signs]
        function = ca.Function("moved", inputs, [result])
        turned = self.bias if acceleration is None else self.bias + self.V @ acceleration
        at = [self.q, self.qd, turned, self.t, model.p, self.signs]
        return function(*at)

    def stack(self, wrench: Wrench) -> Sym:
        """Return a generalised force as a column over the absolute coordinates."""
        size, wrench = self.model.q.numel(), of_coordinates(wrench)
        pattern = ca.Sparsity.triplet(size, 1, list(wrench), [0] * len(wrench))
        column = SX(pattern)
        for i, force in wrench.items():
            column[i] = force
        return column

    @cached_property
    def applied(self) -> Sym:
        """Generalised force of loads and pretensions at the absolute coordinates, (nq,)."""
        return self.moved(self.stack(add(self.loads.total, self.rubbing.steady)))

    @cached_property
    def acting(self) -> Sym:
        """Loads on the bodies: of the plane `applied`, in space sizes of the forces and moments.

        The generalised forces of a tree vanish where loads are in balance.
        """
        if not self.model.space.behind:
            return self.applied
        every = self.loads.wrenches.values()
        keys = [("on", body, k) for body in self.model.mechanism.bodies for k in range(6)]
        sizes = [sum((ca.fabs(wrench.get(key, SX(0))) for wrench in every), SX(0)) for key in keys]
        return self.moved(ca.vertcat(SX(0, 1), *sizes))

    def acting_sizes(self, length: float) -> Floats:
        """Return by what its entries are multiplied to be moments, `length` that of forces."""
        if not self.model.space.behind:
            return self.model.coordinates.sizes(length)
        return np.tile([length] * 3 + [1.0] * 3, len(self.model.mechanism.bodies))

    @cached_property
    def push(self) -> Sym:
        """Loads less the inertia at x'' = 0, at the absolute coordinates, (nq,)."""
        return self.applied - self.moved(self.stack(inertia(self.model)))

    @cached_property
    def f(self) -> Sym:
        """Generalised force at x, inertia at x'' = 0 in it, (n,)."""
        return ca.densify(self.V.T @ self.push)

    @cached_property
    def mass(self) -> Sym:
        """Mass matrix of the absolute coordinates, (nq, nq)."""
        return self.moved(self.model.mass_matrix)

    @cached_property
    def M(self) -> Sym:
        """Mass matrix of x, (n, n)."""
        return self.V.T @ self.mass @ self.V

    # -- energy ------------------------------------------------------------------------------

    @cached_property
    def kinetic(self) -> Sym:
        """Kinetic energy."""
        return self.moved(kinetic_energy(self.model)[0])

    @cached_property
    def stores(self) -> dict[str, Sym]:
        """Potential energies by load: gravity, springs without time in their numbers."""
        model, result = self.model, {}
        for name, load in model.mechanism.loads.items():
            if isinstance(load, Spring) and self._constant(load):
                result[name] = self._strain(load)
        if "gravity" in self.loads.wrenches:
            g = ca.vertcat(*[model.numbers[f"gravity.{axis}"] for axis in model.space.axes])
            total = SX(0)
            for body in model.mechanism.bodies:
                if f"{body}.mass" in model.numbers:
                    place = model.mass_center(body)
                    total -= model.numbers[f"{body}.mass"] * ca.dot(g, place)
            result["gravity"] = total
        return {name: self.moved(expression) for name, expression in result.items()}

    def _constant(self, load: Spring) -> bool:
        """Return whether a spring's numbers depend on parameters alone."""
        numbers = (load.stiffness, load.free_length, load.preload, load.damping)
        used = {name for number in numbers if isinstance(number, str) for name in names_in(number)}
        return used <= set(self.model.mechanism.parameters)

    def _strain(self, load: Spring) -> Sym:
        """Return preload s + k s^2/2 with s = L - L0."""
        k, free, preload = (
            self.loads._number(load, name) for name in ("stiffness", "free_length", "preload")
        )
        stretch = self._length(load) - free
        return preload * stretch + k * stretch**2 / 2

    @cached_property
    def powers(self) -> dict[str, Sym]:
        """Powers that are no rate of a stored energy, by load."""
        result: dict[str, Sym] = {}
        for name, wrench in self.loads.wrenches.items():
            if name == "gravity":
                continue
            load: Any = self.model.mechanism.loads[name]
            total = sum(power(self.model, wrench), SX(0))
            if name in self.stores:
                if not (isinstance(load, Spring) and load.damping != 0):
                    continue
                c, model = self.loads._number(load, "damping"), self.model
                speed = ca.jtimes(self._length(load), model.q, model.velocity)
                total = -c * speed**2
            result[name] = self.moved(total)
        return result

    def _length(self, load: Spring) -> Sym:
        """Return the length of a spring, or the coordinate it acts on."""
        model = self.model
        if load.coordinate is not None:
            return model.coordinate(coordinate(model.mechanism, load.coordinate))
        first, second = load.between or ("", "")
        return ca.sqrt(ca.sumsqr(model.point(second) - model.point(first)))

    def driven_power(self, acceleration: Sym) -> Sym:
        """Return the power that the laws put in: rate of the energy less that of the loads."""
        whole = self.push - self.mass @ (self.V @ acceleration)
        return -ca.dot(whole, self.qd)


def _broken_line(signal: Signal) -> Sym:
    """Return the value of a table by straight lines, over its abscissa."""
    points = signal.load.points
    at, first, last = signal.at, points[0][0], points[-1][0]
    if signal.load.periodic:
        span = last - first
        at = at - span * ca.floor((at - first) / span)
    abscissae, values = zip(*points, strict=True)
    return ca.pw_lin(at, ca.DM(list(abscissae)), ca.DM(list(values)))


def row_size(unit: str, length: float) -> float:
    """Return the natural size of an equation: 1 of angles, else a `length`."""
    return 1.0 if unit == "rad" else length


def _column(items: list[Sym]) -> Sym:
    return ca.vertcat(*items) if items else SX(0, 1)
