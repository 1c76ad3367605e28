"""The linear system of small motions about an equilibrium or a state of a motion: A, B, C, D.

    dx/dt = A x + B u,   y = C x + D u,

with states x (deviations of independent coordinates, then of their speeds), inputs u (efforts,
loads, accelerations of driven coordinates) and outputs y. All matrices are exact derivatives of

    M a + J^T lambda = f,   J a = gamma,   phi = 0

at the state: x follows the independent coordinates z by J dx = 0, H dx = dz.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import KINDS, PLACE
from mechdae.describe.coordinates import BALL, coordinate, named_coordinate, selection
from mechdae.describe.loads import Force, Torque
from mechdae.describe.named import forces_of
from mechdae.dynamics.equations import MotionProblem
from mechdae.dynamics.output_values import over_states
from mechdae.dynamics.rest.chart import Chart
from mechdae.equations.forces.generalised import couple, push
from mechdae.equations.gradients import gradients
from mechdae.equations.motion_equations import Law, Released
from mechdae.errors import InputError, SolveError, UnknownName
from mechdae.kernels.run.functions import Call
from mechdae.records import dataclass
from mechdae.types import Floats, Json, Matrix, Sym

if TYPE_CHECKING:
    from mechdae.describe.coordinates import NamedCoordinate

SX = ca.SX
RANK = 1e-11
CLOSES = 1e-8
"""Share by which redundant equations may contradict each other."""


@dataclass(frozen=True)
class LinearisedState:
    """Where a mechanism is linearised: time, free coordinates, rates, accelerations."""

    t: float
    x: Floats
    v: Floats
    a: Floats
    lam: Floats


@dataclass(frozen=True)
class _Input:
    """An input: its name, and its generalised force over q or the driver it accelerates."""

    name: str
    column: dict[int, Sym] | None = None
    driver: int | None = None


class LinearSystem:
    """The linear system at a state.

    `basis`: freedoms at the state, (n, k), over natural sizes. `inputs`, `outputs`: what is asked
    for; None: all drivers, forces and torques; the outputs of the task.
    """

    def __init__(
        self,
        setup: MotionProblem,
        state: LinearisedState,
        basis: Matrix,
        names: list[str],
        inputs: Sequence[str] | None,
        outputs: tuple[str, ...] | None,
    ) -> None:
        self.setup, self.state, self.model = setup, state, setup.model
        self.chart: Chart = Chart(setup, state.x, basis, names)
        drivers = [law.coordinate for law in setup.laws]
        self.inputs: list[_Input] = self._inputs(inputs, [c.text for c in drivers])
        moved = [given.driver for given in self.inputs if given.driver is not None]
        self.moved: list[NamedCoordinate] = [drivers[i] for i in moved]
        self.r, self.since, self.d = setup.cache(
            ("driven", *moved, *setup.held), lambda: self._driven(moved)
        )
        self._solve(outputs)

    def _driven(self, moved: list[int]) -> tuple[Released, Sym, Sym]:
        """Return the equations with laws that deviate, the time from which, the deviations."""
        setup, k = self.setup, len(moved)
        begin, d = SX.sym("begin"), SX.sym("d", 3 * k)
        if not moved:
            return setup.released, begin, d
        since = setup.loads.time - begin
        laws = []
        for i, law in enumerate(setup.laws):
            value = law.value
            if i in moved:
                j = moved.index(i)
                value = value + d[j] + since * d[k + j] + since**2 / 2 * d[2 * k + j]
            laws.append(Law(law.coordinate, value))
        return Released(self.model, setup.loads, laws, list(setup.held)), begin, d

    # -- what acts ---------------------------------------------------------------------------

    def _inputs(self, asked: Sequence[str] | None, drivers: list[str]) -> list[_Input]:
        model, mechanism = self.model, self.model.mechanism
        axes = mechanism.axes
        units = ca.horzsplit(SX(ca.DM.eye(len(axes))))
        known: dict[str, _Input] = {
            name: _Input(f"{name}.acceleration", driver=i) for i, name in enumerate(drivers)
        }
        for name, load in mechanism.loads.items():
            if isinstance(load, Torque) and mechanism.dimension == 2:
                known[f"loads.{name}"] = _Input(f"loads.{name}", couple(model, load.body, SX(1)))
            elif isinstance(load, Torque):
                for axis, unit in zip(axes, units, strict=True):
                    column = couple(model, load.body, unit)
                    known[f"loads.{name}.{axis}"] = _Input(f"loads.{name}.{axis}", column)
            if isinstance(load, Force):
                body = load.point.split(".")[0]
                for axis, unit in zip(axes, units, strict=True):
                    column = push(model, body, model.point(load.point), unit)
                    known[f"loads.{name}.{axis}"] = _Input(f"loads.{name}.{axis}", column)
        if asked is None:
            return list(known.values())
        found = []
        for i, name in enumerate(asked):
            both = [f"{name}.{axis}" for axis in axes if f"{name}.{axis}" in known]
            if name in known:
                found.append(known[name])
            elif name.startswith("loads.") and both:
                found += [known[name] for name in both]
            elif name.startswith("loads."):
                raise UnknownName("force or torque", name, known, where=f"inputs[{i}]")
            else:
                try:
                    c = named_coordinate(mechanism, name)
                except InputError as error:
                    raise error.inside(f"inputs[{i}]") from None
                if c.text in known:
                    found.append(known[c.text])
                    continue
                (column,) = gradients(model.coordinate(c), model.q)
                found.append(_Input(f"efforts.{c.text}", column))
        return found

    # -- derivatives -------------------------------------------------------------------------

    def _slopes(self, outputs: tuple[str, ...] | None) -> tuple[list[str], Call]:
        """Return the names of the outputs, and the function of all derivatives at a state."""
        r, model = self.r, self.model
        pushed = [given.column for given in self.inputs if given.column is not None]
        u, a = SX.sym("u", len(pushed)), SX.sym("a", r.x.numel())
        lam = SX.sym("lam", r.phi.numel())
        columns = [r.moved(r.stack(column)) for column in pushed]
        force = r.f + (r.V.T @ (ca.horzcat(*columns) @ u) if pushed else 0)
        rows = [model.coordinate(c) for c in self.chart.coordinates]
        h = r.moved(ca.vertcat(*rows)) if rows else SX(0, 1)
        rate_phi, rate_h = r.rate(r.phi), r.rate(h)
        residual = ca.vertcat(r.M @ a + r.J.T @ lam - force, r.J @ a - r.gamma)
        second = r.rate(rate_h) + ca.jacobian(h, r.x) @ a if rows else SX(0, 1)
        names, y = self._outputs(outputs, a)
        both = ca.vertcat(a, lam)
        parts = [ca.vertcat(r.phi, h), ca.vertcat(rate_phi, rate_h), residual, second, y]
        wanted: list[Sym] = []
        for part in parts:
            wanted += [ca.jacobian(part, s) for s in (r.x, r.v, both, self.d, u)]
        inputs = [r.t, r.x, r.v, r.signs, a, lam, model.p, self.since, self.d, u]
        return names, Call(ca.Function("linear", inputs, [ca.densify(part) for part in wanted]))

    def _solve(self, outputs: tuple[str, ...] | None) -> None:
        r, setup, state = self.r, self.setup, self.state
        n, m, k, nd = r.x.numel(), r.phi.numel(), len(self.chart.names), len(self.moved)
        nu = sum(given.column is not None for given in self.inputs)
        inputs = tuple(given.name for given in self.inputs)
        key = ("linear", r, inputs, tuple(self.chart.names), outputs)
        names, call = setup.cache(key, lambda: self._slopes(outputs))
        at = [state.t, state.x, state.v, setup.loose, state.a, state.lam[:m], self.model.p_values]
        found = call(*at, state.t, np.zeros(3 * nd), np.zeros(nu))
        shapes = map(call.function.size_out, range(len(found)))
        found = [np.reshape(part, shape) for part, shape in zip(found, shapes, strict=True)]
        parts = range(len(found) // 5)
        slopes = [found[5 * i : 5 * i + 5] for i in parts]
        sizes = r.coordinates.sizes(setup.length)
        gaps = np.array(r.gaps(setup.length))
        units = [
            1.0 if c.is_angle or c.kind == BALL else setup.length for c in self.chart.coordinates
        ]
        scales = np.concatenate([gaps, units])
        # deviations over (z, zd, d, u): places, speeds, accelerations with multipliers
        whole = 2 * k + 3 * nd + nu
        z, zd = np.eye(k, whole), np.eye(k, whole, k)
        d, push_ = np.eye(3 * nd, whole, 2 * k), np.eye(nu, whole, 2 * k + 3 * nd)

        def solved(left: Floats, right: Floats, rows: Floats, columns: Floats) -> Floats:
            scaled, wanted = left * np.outer(1 / rows, columns), right / rows[:, None]
            answer = np.linalg.lstsq(scaled, wanted, rcond=RANK)[0]
            miss = float(np.max(np.abs(scaled @ answer - wanted), initial=0.0))
            if miss > CLOSES * max(float(np.max(np.abs(wanted), initial=0.0)), 1e-300):
                raise SolveError(
                    "no linear system: the state is singular", where="linearise",
                    hint="linearise at another pose",
                )  # fmt: skip
            return answer * columns[:, None]

        place, speed, balance, last, out = slopes
        dx = solved(place[0], np.vstack([np.zeros((m, whole)), z]) - place[3] @ d, scales, sizes)
        right = np.vstack([np.zeros((m, whole)), zd]) - speed[0] @ dx - speed[3] @ d
        dv = solved(speed[1], right, scales, sizes)
        right = -(balance[0] @ dx + balance[1] @ dv + balance[3] @ d + balance[4] @ push_)
        masses = np.abs(balance[2][:n, :n] * np.outer(sizes, sizes))
        mass = max(float(masses.max(initial=0.0)), 1e-300)
        rows_of = np.concatenate([mass / sizes, gaps])
        columns_of = np.concatenate([sizes, mass / gaps])
        da = solved(balance[2], right, rows_of, columns_of)
        zdd = last[0] @ dx + last[1] @ dv + last[2] @ da + last[3] @ d
        dy = out[0] @ dx + out[1] @ dv + out[2] @ da + out[3] @ d + out[4] @ push_
        self._put(k, nd, nu, zdd, dy, names)

    def _put(self, k: int, nd: int, nu: int, zdd: Floats, dy: Floats, names: list[str]) -> None:
        """Keep the matrices: states (z, driven, their speeds), inputs in the order asked for."""
        two = 2 * k
        order = [*range(k), *range(two, two + nd), *range(k, two), *range(two + nd, two + 2 * nd)]
        pushed, driven = iter(range(two + 3 * nd, two + 3 * nd + nu)), iter(range(nd))
        inputs = [
            next(pushed) if entry.driver is None else two + 2 * nd + next(driven)
            for entry in self.inputs
        ]
        half = k + nd
        rates = np.zeros((half, zdd.shape[1]))
        rates[:k] = zdd
        for j in range(nd):
            rates[k + j, two + 2 * nd + j] = 1.0
        self.A = np.block([[np.zeros((half, half)), np.eye(half)], [rates[:, order]]])
        self.B = np.vstack([np.zeros((half, len(inputs))), rates[:, inputs]])
        self.C, self.D = dy[:, order], dy[:, inputs]
        states = [*self.chart.names, *(c.text for c in self.moved)]
        self.states: list[str] = [*states, *(f"{name}.speed" for name in states)]
        self.outputs = names

    def _outputs(self, outputs: tuple[str, ...] | None, a: Sym) -> tuple[list[str], Sym]:
        """Return names and expressions over (x, v, a, d, t) of the outputs."""
        model, mechanism, r = self.model, self.model.mechanism, self.r
        chosen = selection(mechanism, outputs, forces=True)
        chosen = model.reported(chosen, outputs is not None)
        found: dict[str, Sym] = {}
        for name in chosen.named:
            if not forces_of(mechanism, name):
                text = mechanism.outputs[name]
                found[name] = over_states(model, self.setup.loads, text, {}, (name,))
        for body in chosen.bodies if mechanism.dimension == 2 else ():
            found[f"{body}.angle"] = model.coordinate(coordinate(mechanism, f"{body}.angle"))
        for point in chosen.points:
            parts = ca.vertsplit(SX(model.point(point)))
            for axis, part in zip(mechanism.axes, parts, strict=True):
                found[f"{point}.{axis}"] = part
        for joint in chosen.joints:
            for word in sorted(mechanism.joints[joint].coordinates):
                if KINDS[word] is PLACE:
                    continue
                name = f"{joint}.{word}"
                found[name] = model.coordinate(coordinate(mechanism, name))
        inputs = [model.q, model.velocity, model.acceleration, self.setup.loads.time, model.p]
        function = ca.Function("y", inputs, [ca.vertcat(*found.values())] if found else [SX(0, 1)])
        at = [r.q, r.qd, r.bias + r.V @ a, r.t, model.p]
        return list(found), function(*at)

    def told(self) -> Json:
        """Return the system as plain data."""
        matrices = {name: getattr(self, name).tolist() for name in "ABCD"}
        place = self.chart.values(self.state.x)
        return {
            **matrices,
            "states": self.states,
            "inputs": [given.name for given in self.inputs],
            "outputs": self.outputs,
            "time": self.state.t,
            "operating_point": place,
        }
