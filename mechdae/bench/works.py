"""Motions to be measured: what integrates them, and how far off the end is.

All integrate x'' of `kernels.proximal`, evaluated by the same virtual machine: scipy through the
buffer that the package uses itself, CVODES and IDAS as part of casadi's own graph. Where the
equations allow it, IDAS also solves them as they stand, with accelerations and multipliers as
algebraic unknowns.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import coordinate
from mechdae.describe.expression import names_in
from mechdae.describe.file.problem import Problem
from mechdae.describe.named import split_rate
from mechdae.dynamics.equations import Setup
from mechdae.dynamics.expressions import over_states
from mechdae.dynamics.run import Run
from mechdae.errors import MechdaeError
from mechdae.kernels.run.quiet import quiet

SX = ca.SX
IMPLICIT = 1e-8
"""Tightest tolerance of scipy's Radau, whose work grows too fast for more."""
TIGHT = 1e-13
STALE = 10.0
"""Times the deviation that the file allows, from which expected values are stale."""
STEPS = 200_000
"""Steps after which SUNDIALS gives up."""
OURS = "mechdae"
SCIPY = {"scipy DOP853", "scipy DOP853, events"}
STATE = "summary/state/"


@dataclass(frozen=True)
class End:
    """Where an integration ends, and how many right-hand sides it took."""

    x: Any
    rhs: int


Way = Callable[[], End]


class Work:
    """A task of motion, its kernels and the truth at its end.

    Attributes
    ----------
    name : str
        Problem and task.
    reference : str
        What errors are differences to: "values of the problem" or "tightened run".
    notes : list of str
        What was found beforehand: expected values that are not those of the file.
    """

    def __init__(self, problem: Problem, name: str, run: Run, x: Any, v: Any) -> None:
        self.name = f"{problem.name} {name}"
        self.problem, self.key = problem, name
        self.run, self.x, self.v = run, x, v
        self.setup, self.integrator = self.run.setup, self.run.integrator
        self.kernel = self.setup.kernel
        self.none = np.zeros(0)
        self.sizes = self.setup.sizes(self.setup.released)
        self._outputs, self._wanted, self._units, self._allowed = _expected(
            self.setup, problem, name
        )
        self.reference, self.notes = "values of the problem", []
        tight = self._tight() if len(self._wanted) else None
        if tight is not None and self.error(tight) > self._allowed:
            self.notes.append(
                f"the values that {problem.name} expects are not those of this file (by "
                f"{self.error(tight):.1g}): errors are differences to a tightened run"
            )
            self._wanted, self._outputs = np.zeros(0), None
        if not len(self._wanted):
            self.reference = "tightened run"
            self._wanted, self._units = self.ours(TIGHT).x, self.sizes

    def _tight(self) -> Any:
        """Return the end of a tightened run, None where there is none."""
        try:
            return self.ours(TIGHT).x
        except RuntimeError:
            return None

    @property
    def end(self) -> float:
        """The time at the end."""
        return self.setup.end

    def error(self, x: Any) -> float:
        """Return the largest error at the end, over natural sizes or what is larger."""
        found = x if self._outputs is None else self._outputs(self.end, x)
        found = np.array(ca.DM(found)).ravel()
        scale = np.maximum(self._units, np.abs(self._wanted))
        return float(np.max(np.abs(found - self._wanted) / scale, initial=0.0))

    def drift(self, x: Any) -> float:
        """Return the largest gap of a constraint at the end, over its natural size."""
        if not self.kernel.m:
            return 0.0
        phi = self.kernel.place(self.end, x, np.zeros(len(x)), self.none)[0]
        return float(np.max(np.abs(np.array(phi).ravel()) / self.kernel.gaps))

    # -- ways ----------------------------------------------------------------------------------

    def ours(self, tolerance: float) -> End:
        """Integrate with the package."""
        own = self.integrator
        self.setup.tolerance = tolerance
        before = own.rhs
        works = np.zeros(len(self.setup.works))
        state = own.first(0.0, self.x, self.v, works, self.none)
        for nodes in own.steps(state, self.none):
            if nodes.stalled:
                raise RuntimeError("the step size went to nothing")
            state = nodes.states[-1]
        return End(state[own.layout["x"]].copy(), own.rhs - before)

    def ways(self, tolerances: tuple[float, ...]) -> Iterator[tuple[str, float, Way]]:
        """Yield method, tolerance and function of each integration."""
        for tolerance in tolerances:
            yield OURS, tolerance, partial(self.ours, tolerance)
        yield from _scipy(self, tolerances)
        yield from _sundials(self, tolerances)


def _expected(setup: Setup, problem: Problem, name: str) -> tuple[Any, Any, Any, float]:
    """Return the function (t, x) -> named outputs that the problem has values of.

    With them, the values, natural sizes, and the largest deviation that the file allows.
    """
    released, model = setup.released, setup.model
    texts, wanted, units = [], [], []
    allowed = 0.0
    for entry in problem.expected:
        output = entry.what.removeprefix(STATE)
        known = entry.task == name and entry.time is None and entry.what.startswith(STATE)
        if not known or not isinstance(entry.value, list | tuple):
            continue
        text = model.mechanism.outputs[output]
        texts.append(over_states(model, setup.loads, text, {}))
        wanted.append(float(entry.value[0]))
        units.append(_size(setup, text))
        size = max(abs(float(number)) for number in entry.value)
        least = max(float(entry.abs or 0.0), float(entry.rel or 0.0) * size)
        least = least if least > 0 else np.inf  # it says nothing about its digits
        allowed = max(allowed, STALE * least / max(units[-1], abs(wanted[-1])))
    if not texts:
        return None, np.zeros(0), np.zeros(0), 0.0
    inputs = [model.q, setup.loads.time, model.p]
    general = ca.Function("outputs", inputs, [ca.vertcat(*texts)])
    own = [released.t, released.x, model.p]
    place = ca.Function("place", own, [released.q])
    t, x = SX.sym("t"), SX.sym("x", released.x.numel())
    p = ca.DM(model.p_values)
    at_end = ca.Function("end", [t, x], [general(place(t, x, p), t, p)])
    return at_end, np.array(wanted), np.array(units), allowed


def _size(setup: Setup, text: str) -> float:
    """Return the natural size of an output: 1 rad if it is made of angles, else a length."""
    mechanism = setup.model.mechanism
    for used in names_in(text):
        if used not in mechanism.parameters:
            try:
                if coordinate(mechanism, split_rate(used)[0]).unit != "rad":
                    return setup.length
            except MechdaeError:
                return setup.length
    return 1.0


def _scipy(work: Work, tolerances: tuple[float, ...]) -> Iterator[tuple[str, float, Way]]:
    """Yield DOP853 and Radau, the latter with the exact Jacobian."""
    try:
        from scipy.integrate import solve_ivp
    except ImportError:
        return
    n, none = len(work.x), work.none
    call = work.integrator._rhs
    start = np.concatenate([work.x, work.v])
    least = float(work.sizes.min(initial=1.0))

    def slope(t: float, y: Any) -> Any:
        return np.concatenate([y[n:], call(t, y[:n], y[n:], none)[0]])

    def jacobian(t: float, y: Any) -> Any:
        return rates(t, y)[0]

    def way(method: str, tolerance: float, more: dict[str, Any]) -> End:
        found = solve_ivp(
            slope, (0.0, work.end), start, method=method, rtol=max(tolerance, 3e-14),
            atol=tolerance * least, t_eval=[work.end], **more,
        )  # fmt: skip
        if not found.success:
            raise RuntimeError(found.message)
        return End(found.y[:n, -1], int(found.nfev))

    for tolerance in tolerances:
        yield "scipy DOP853", tolerance, partial(way, "DOP853", tolerance, {})
    from mechdae.kernels.run.call import Call

    t, y, ode = _ode(work)
    rates = Call(ca.Function("rates", [t, y], [ca.densify(ca.jacobian(ode, y))], {"cse": True}))
    for tolerance in tolerances:
        if tolerance >= IMPLICIT:
            yield "scipy Radau", tolerance, partial(way, "Radau", tolerance, {"jac": jacobian})


def _ode(work: Work) -> tuple[Any, Any, Any]:
    """Return t, y = (x, x') and y'."""
    n = len(work.x)
    t, y = SX.sym("t"), SX.sym("y", 2 * n)
    return t, y, ca.vertcat(y[n:], work.kernel.rhs(t, y[:n], y[n:], SX(0, 1))[0])


def _sundials(work: Work, tolerances: tuple[float, ...]) -> Iterator[tuple[str, float, Way]]:
    """Yield CVODES and IDAS on x'' = ..., and IDAS on the equations as they stand."""
    n, m, kernel = len(work.x), work.kernel.m, work.kernel
    t, y, ode = _ode(work)
    explicit = {"t": t, "x": y, "ode": ode}
    start = np.concatenate([work.x, work.v])
    first = np.concatenate(work.integrator._rhs(0.0, work.x, work.v, work.none))
    least = float(work.sizes.min(initial=1.0))
    adams = {"linear_multistep_method": "adams"}
    chosen: list[tuple[str, str, Any, dict[str, Any]]] = [
        ("CVODES Adams", "cvodes", explicit, adams),
        ("CVODES BDF", "cvodes", explicit, {}),
        ("IDAS", "idas", explicit, {}),
    ]
    if m:
        z = SX.sym("z", n + m)
        M, f, J, gamma = kernel.parts(t, y[:n], y[n:], SX(0, 1))
        balance = ca.densify(ca.vertcat(M @ z[:n] + J.T @ z[n:] - f, J @ z[:n] - gamma))
        whole = {"t": t, "x": y, "z": z, "ode": ca.vertcat(y[n:], z[:n]), "alg": balance}
        chosen.append(("IDAS, index 1", "idas", whole, {}))

    def way(solver: Any, algebraic: bool) -> End:
        found = solver(x0=start, z0=first) if algebraic else solver(x0=start)
        return End(np.array(found["xf"])[:n, 0], int(solver.stats()["nfevals"]))

    for method, plugin, equations, more in chosen:
        for tolerance in tolerances:
            options = {
                "reltol": tolerance, "abstol": tolerance * least, "max_num_steps": STEPS,
                "disable_internal_warnings": True, **more,
            }  # fmt: skip
            with quiet():
                solver = ca.integrator("solver", plugin, equations, 0.0, work.end, options)
            yield method, tolerance, partial(way, solver, "z" in equations)
