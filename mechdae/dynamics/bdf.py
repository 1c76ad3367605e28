"""Integration of stiff motions: CVODES' formulas of order 1 to 5, and Radau IIA of order 5.

The same right-hand side in natural sizes, so that one absolute tolerance holds for all. CVODES
integrates windows of equally spaced states, each of which is projected to the constraints, and the
next window starts from the last one; of Radau's method each step is. States between these, and
those of events, are integrated from the one before.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.dynamics.equations import MotionProblem
from mechdae.dynamics.integrate import LEAST, DormandPrince, Integrator, Nodes
from mechdae.kernels.graphs.stepper import CLOSED, ROUNDING, SLOW
from mechdae.kernels.run.casadi_warnings import quiet
from mechdae.numerics import radau
from mechdae.types import Floats, Graph, Matrix, Sym, Unknowns

COUNT = 64
"""States of a window."""
FINE = 0.25
"""Time between two of them, times the frequency."""
STEPS = 500
"""Steps of CVODES between two of them."""
SHORTER = 4.0
"""By which a window is shortened in which CVODES fails."""
PROJECTIONS = 6
ROUNDED = 2e-14
"""Relative tolerance: what rounding leaves of large coordinates."""
CHUNK = 32
"""Steps of Radau's method that are looked at together."""
STRICT = 0.25
"""Share of the tolerance that a step may have."""


class ImplicitMethod(Integrator):
    """A method for stiff forces: states are nodes, those between are integrated from the last."""

    implicit = True

    def _dense_output_impl(self, nodes: Nodes, times: Floats) -> tuple[Matrix, Matrix, Matrix]:
        lay, states = self.layout, nodes.states
        starts = lay.of(states, "t")
        rows = []
        near = 1e-12 * self.setup.end
        for time in times:
            place = int(np.clip(np.searchsorted(starts, time + near) - 1, 0, len(states) - 1))
            gap = time - starts[place]
            if place + 1 < len(starts) and abs(starts[place + 1] - time) <= near:
                rows.append(states[place + 1])
            elif gap <= near:
                rows.append(states[place])
            else:
                rows.append(self.stepped(states[place], float(gap), nodes.signs))
        found = np.array(rows)
        return lay.of(found, "x"), lay.of(found, "v"), lay.of(found, "w")

    def _states(
        self, state: Floats, times: Floats, x: Unknowns, v: Floats, works: Any, signs: Floats
    ) -> Any:
        """Return states (n, .) with what belongs to them, on the constraints; None off them."""
        lay, sizes = self.layout, self.kernel.sizes
        if self.kernel.m or self.kernel.slips:
            x, v, closed = self._closed(times[:, None], x, v, signs)
            if not closed:
                return None
        a, inner = self.rates(times[:, None], x, v, signs)
        self.rhs += len(times)
        states = np.tile(state, (len(times), 1))
        m = inner[:, inner.shape[1] - self.kernel.rubs :]
        for name, value in (("t", times[:, None]), ("x", x), ("v", v), ("a", a), ("m", m)):
            states[:, lay[name]] = value
        if works is not None:
            states[:, lay["w"]] = works
        top = float(lay.of(state, "omega"))
        highest = np.maximum(np.abs(v / sizes), np.sqrt(np.abs(a / sizes))).max(axis=1, initial=0.0)
        states[:, lay["omega"]] = np.maximum.accumulate(np.maximum(highest, top))[:, None]
        return states if np.isfinite(states).all() else None

    def _closed(
        self, t: Floats, x: Unknowns, v: Floats, signs: Floats
    ) -> tuple[Floats, Floats, bool]:
        """Return states (n, .) on the constraints, and whether they are."""
        miss = np.inf
        for _ in range(PROJECTIONS):
            x, v, left = self._project(t, x, v, signs)
            before, miss = miss, float(np.max(left))
            if miss <= ROUNDING or not miss < before / 2:
                break
        grain = ROUNDING * (1 + float(np.max(np.abs(x / self.kernel.sizes), initial=0.0)))
        return x, v, miss <= CLOSED * self.setup.tolerance + grain + self.setup.closure


class Cvodes(ImplicitMethod):
    """CVODES' formulas, over windows of states."""

    name = "bdf, CVODES"

    def __init__(self, setup: MotionProblem) -> None:
        super().__init__(setup)
        self._short: dict[int, Any] = {}

    @cached_property
    def _equations(self) -> dict[str, Sym]:
        """Rates of (x, v) over natural sizes in a time from 0 to 1, and powers."""
        k, n, stepper = self.kernel, self.kernel.n, self.stepper
        sym = stepper.kind.sym
        s, y = sym("s"), sym("y", 2 * n)
        p = sym("p", 4 + stepper.fixed)
        begin, span, omega, energy = p[0], p[1], p[2], p[3]
        signs, c = ca.vertsplit(p, [0, 4, 4 + k.signs.numel(), 4 + stepper.fixed])[1:]
        sizes = stepper.sizes(c)
        t, x, v = begin + span * s, sizes * y[:n], sizes * omega * y[n:]
        a, inner = k.rhs(t, x, v, signs, c)
        power = stepper.power(t, x, v, signs, a, stepper._sizes(inner), c)
        rates = span * ca.vertcat(v / sizes, a / (sizes * omega))
        found = {"t": s, "x": y, "p": p, "ode": rates}
        return found | ({"quad": span * power / energy} if stepper.works else {})

    def _limited(self, share: float) -> Graph:
        """Return the solver of a window whose steps are not longer than about a share of it."""
        if share >= 1:
            return self._window
        power = min(int(np.floor(np.log2(share))), 0)
        if power not in self._short:
            self._short[power] = self._solver(COUNT, 2.0**power)
        return self._short[power]

    def _solver(self, count: int, longest: float = 0.0) -> Graph:
        tolerance = STRICT * self.setup.tolerance
        options = {
            "reltol": ROUNDED, "abstol": tolerance, "max_num_steps": STEPS,
            "disable_internal_warnings": True, "show_eval_warnings": False,
            "quad_err_con": True, "max_step_size": longest,
        }  # fmt: skip
        grid = (np.arange(1, count + 1) / count).tolist()
        with quiet():
            return ca.integrator("bdf", "cvodes", self._equations, 0.0, grid, options)

    @cached_property
    def _window(self) -> Graph:
        return self._solver(COUNT)

    @cached_property
    def _single(self) -> Graph:
        return self._solver(1)

    def _integrated(self, solver: Graph, state: Floats, span: float, signs: Floats) -> Any:
        """Return the states (n, .) of a window on the constraints, None where CVODES fails."""
        lay, n = self.layout, self.layout.n
        sizes = self.kernel.sizes
        t, x, v, w = (lay.of(state, name) for name in ("t", "x", "v", "w"))
        top = float(lay.of(state, "omega"))
        omega = max(self.frequency(v, lay.of(state, "a")), SLOW * top)
        energy = self._inertia * omega**2
        start = np.concatenate([x / sizes, v / (sizes * omega)])
        try:
            given = [float(t), span, omega, energy]
            found = solver(x0=start, p=np.concatenate([given, signs, self.kernel.numbers]))
        except RuntimeError:
            return None
        stats = solver.stats()
        self.accepted += int(stats["nsteps"])
        self.rejected += int(stats["netfails"])
        self.rhs += int(stats["nfevals"])
        y = np.array(found["xf"]).T
        if not np.isfinite(y).all():
            return None
        count = len(y)
        times = float(t) + span * np.arange(1, count + 1) / count
        x, v = y[:, :n] * sizes, y[:, n:] * sizes * omega
        works = w + energy * np.array(found["qf"]).T if lay.works else None
        return self._states(state, times, x, v, works, signs)

    @cached_property
    def _inertia(self) -> float:
        """Natural size of the inertia, kg m^2."""
        k = self.kernel
        none = np.zeros(k.n)
        M = k.value("parts", 0.0, none + 0.1 * k.sizes, none, self.setup.loose)[0]
        return float(np.mean(np.diag(M) * k.sizes**2)) if k.n else 1.0

    def _step_impl(self, state: Floats, signs: Any, end: float, longest: float) -> Iterator[Nodes]:
        lay, limit, longest = self.layout, longest, np.inf
        while state[lay["t"]][0] < end:
            t = float(state[lay["t"]][0])
            omega = self.frequency(state[lay["v"]], state[lay["a"]])
            fine = min(FINE / omega if omega > 0 else np.inf, limit)
            span = min(COUNT * self._spacing(fine), longest)
            last = span >= (end - t) * (1 - 1e-10)
            span = end - t if last else span
            states = self._integrated(self._limited(limit / span), state, span, signs)
            if states is None:
                longest = span / SHORTER
                if longest < LEAST * self.setup.end:
                    state = state.copy()
                    state[lay["h"]] = span
                    yield Nodes(state[None, :], signs, True)
                    return
                continue
            if last:
                states[-1, lay["t"]] = end
            longest = 2 * longest
            nodes = Nodes(np.vstack([state[None, :], states]), signs)
            state = states[-1]
            yield nodes

    def _spacing(self, fine: float) -> float:
        """Return a time between states: outputs at equal intervals are among them."""
        times = self.setup.times
        least = self.setup.end / COUNT
        if times is None or len(times) < 2:
            return min(fine, least)
        gaps = np.diff(times)
        if times[0] > 0 or np.ptp(gaps) > 1e-9 * gaps[0]:
            return min(fine, least)
        return float(gaps[0] / max(1.0, np.ceil(gaps[0] / min(fine, least))))

    def stepped(self, state: Floats, h: float, signs: Floats) -> Any:
        found = self._integrated(self._single, state, h, signs)
        if found is None:
            return np.full_like(state, np.nan)
        return found[0]


class Automatic(Cvodes, DormandPrince):
    """Dormand and Prince's method until a force is found stiff, CVODES from there on."""

    name, implicit = DormandPrince.name, False

    def turn_stiff(self) -> bool:
        self.name, self.implicit = f"{DormandPrince.name}; then {Cvodes.name}", True
        return True

    def _step_impl(self, state: Floats, signs: Any, end: float, longest: float) -> Iterator[Nodes]:
        if not self.implicit:
            for nodes in DormandPrince._step_impl(self, state, signs, end, longest):
                yield nodes
                state = nodes.states[-1]
                if self.implicit:
                    break
            else:
                return
        yield from super()._step_impl(state, signs, end, longest)

    def _dense_output_impl(self, nodes: Nodes, times: Floats) -> tuple[Matrix, Matrix, Matrix]:
        method = Cvodes if self.implicit else DormandPrince
        return method._dense_output_impl(self, nodes, times)

    def stepped(self, state: Floats, h: float, signs: Floats) -> Floats:
        method = Cvodes if self.implicit else DormandPrince
        return method.stepped(self, state, h, signs)


class Radau(ImplicitMethod):
    """Integrates a motion by Radau IIA of order 5: each accepted step is a state."""

    name = "Radau IIA 5"

    @cached_property
    def _slopes(self) -> Any:
        """(t, x, v, signs) -> derivatives of x'' by x and v, (n, 2 n), by columns."""
        k = self.kernel

        def build() -> Graph:
            a = k.rhs(*k.inputs)[0]
            found = ca.jacobian(a, ca.vertcat(k.x, k.v))
            return k.function("slopes", [ca.vec(ca.densify(found))])

        return k.call("slopes of rates", build)

    @cached_property
    def _powers(self) -> Any:
        """(t, x, v, signs) -> powers (works,) for many states."""
        k, stepper = self.kernel, self.stepper

        def build() -> Graph:
            a, inner = k.rhs(*k.inputs)
            power = stepper.power(*k.inputs[:4], a, stepper._sizes(inner), k.c)
            return ca.Function("powers", k.inputs, [ca.densify(power)])

        return k.batch("powers", build)

    def _along(self, state: Floats, end: float, signs: Floats, first: float, limit: float) -> Any:
        """Yield the states behind each step up to a time."""
        lay, n, sizes = self.layout, self.layout.n, self.kernel.sizes
        t, x, v, w = (np.array(lay.of(state, name)) for name in ("t", "x", "v", "w"))
        omega = max(self.frequency(v, lay.of(state, "a")), SLOW * float(lay.of(state, "omega")))

        def placed(y: Floats) -> tuple[Floats, Floats]:
            return y[..., :n] * sizes, y[..., n:] * sizes * omega

        def natural(x: Unknowns, v: Floats) -> Floats:
            return np.concatenate([x / sizes, v / (sizes * omega)], axis=-1)

        def rates(times: Floats, y: Floats) -> Floats:
            x, v = placed(y)
            a = self.rates(times[:, None], x, v, signs)[0]
            return np.concatenate([v / sizes, a / sizes / omega], axis=1)

        def slopes(t: float, y: Floats) -> Floats:
            found = np.reshape(self._slopes(t, *placed(y), signs)[0], (n, 2 * n), order="F")
            found = found * np.concatenate([sizes, sizes * omega]) / (sizes * omega)[:, None]
            return np.vstack([np.hstack([np.zeros((n, n)), omega * np.eye(n)]), found])

        def settled(t: float, y: Floats) -> Any:
            x, v, closed = self._closed(np.array([[t]]), *placed(y[None]), signs)
            if not closed:
                raise ArithmeticError("the state leaves the constraints")
            return natural(x, v)[0]

        held = self.kernel.m or self.kernel.slips
        given = (float(t), natural(x, v), end, STRICT * self.setup.tolerance, first, limit)
        for step in radau.steps(rates, slopes, *given, settled if held else None):
            self.accepted += 1
            self.rejected += step.rejected
            self.rhs += step.calls
            if lay.works:
                powers = self._powers(step.times[:, None], *placed(step.stages), signs)[0]
                w = w + step.length * (radau.WEIGHTS @ powers)
            found = self._states(state, np.array([step.t]), *placed(step.y[None]), w[None], signs)
            if found is None:
                raise ArithmeticError("the state leaves the constraints")
            state = found[0]
            state[lay["h"]] = step.next_length
            yield state

    def _step_impl(self, state: Floats, signs: Any, end: float, longest: float) -> Iterator[Nodes]:
        lay, found = self.layout, [state]
        try:
            for behind in self._along(state, end, signs, float(lay.of(state, "h")), longest):
                found.append(behind)
                if len(found) > CHUNK:
                    yield Nodes(np.array(found), signs)
                    found = [behind]
        except ArithmeticError:
            yield Nodes(np.array(found), signs, True)
            return
        if len(found) > 1:
            yield Nodes(np.array(found), signs)

    def stepped(self, state: Floats, h: float, signs: Floats) -> Floats:
        counts, last = (self.accepted, self.rejected), state
        end = float(self.layout.of(state, "t")) + h
        try:
            for last in self._along(state, end, signs, h, np.inf):  # noqa: B007
                pass
        except ArithmeticError:
            return np.full_like(state, np.nan)
        self.accepted, self.rejected = counts
        return last
