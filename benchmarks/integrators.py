"""Motions by scipy's and casadi's integrators, on the same right-hand side as the package.

All integrate x'' of the package's equations of motion, evaluated by the same virtual machine:
scipy through the buffer that the package uses itself, CVODES and IDAS as part of casadi's own
graph. Where the equations allow it, IDAS also solves them as they stand, with accelerations and
multipliers as algebraic unknowns. With dry friction scipy integrates with the signs of the sliding
speeds fixed, stops where one of them vanishes, and goes on with the other sign; that is right while
no pair sticks before the motion is stopped, as in a mechanism of one freedom that coasts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import casadi as ca
import numpy as np

from mechdae.kernels.run.casadi_warnings import quiet
from mechdae.kernels.run.functions import Call
from mechdae.parts.bench.motions import MotionEnd, MotionWork, RubbingWork, Way

SX = ca.SX
IMPLICIT = 1e-8
"""Tightest tolerance of scipy's Radau, whose work grows too fast for more."""
STEPS = 200_000
"""Steps after which SUNDIALS gives up."""
MOST = 10_000
"""Reversals after which scipy gives up."""
STILL = 1e-9
"""Share of its first value below which what stops a motion counts as zero."""
STICKS = "a pair sticks: that takes more than an integrator with events"
NO_SCIPY = (
    "DOP853 and Radau are not measured: scipy is not installed (pip install 'mechdae[bench]')"
)


def others(
    work: MotionWork, tolerances: tuple[float, ...], notes: list[str]
) -> Iterator[tuple[str, float, Way]]:
    """Yield method, tolerance and function of each integration."""
    try:
        from scipy.integrate import solve_ivp
    except ImportError:
        solve_ivp = None
        notes.append(NO_SCIPY)
    if isinstance(work, RubbingWork):
        look = watched(work)
        for tolerance in tolerances if solve_ivp is not None else ():
            way = partial(events, work, solve_ivp, look, tolerance)
            yield "scipy DOP853, events", tolerance, way
        return
    if solve_ivp is not None:
        yield from scipys(work, solve_ivp, tolerances)
    yield from sundials(work, tolerances)


def watched(work: RubbingWork) -> Callable[..., list[Any]]:
    """Return (t, x, v, signs) -> speeds of the slips, what is left to the events that stop."""
    k, crossings = work.kernel, work.run.crossings
    rows = [row for row, own in zip(crossings.rows(), crossings.wanted, strict=True) if own.stop]
    results = [ca.densify(work.setup.released.slips), ca.densify(ca.vertcat(*rows))]
    return k.call("watched", lambda: k.function("watched", results))


def events(
    work: RubbingWork,
    solve_ivp: Callable[..., Any],
    look: Callable[..., list[Any]],
    tolerance: float,
) -> MotionEnd:
    """Integrate with scipy's DOP853 from one sliding speed that vanishes to the next."""
    n, calls = len(work.x), 0
    rhs, sticking = work.integrator._rhs, work.fresh().sticking
    stops = [own for own in work.run.crossings.wanted if own.stop]
    signs, v = sticking.first(0.0, work.x, work.v)
    t, y = 0.0, np.concatenate([work.x, v])
    first = np.array(look(t, work.x, v, signs)[1]).ravel()
    known: tuple[float, bytes, Any] = (np.nan, b"", None)

    def slope(t: float, y: Any) -> Any:
        return np.concatenate([y[n:], rhs(t, y[:n], y[n:], signs)[0]])

    def value(t: float, y: Any, k: int) -> float:
        nonlocal known
        if known[0] != t or known[1] != y.tobytes():
            speeds, left = look(t, y[:n], y[n:], signs)
            both = np.concatenate([sticking.sides(signs) * speeds, left])
            known = (t, y.tobytes(), both)
        return float(known[2][k])

    events: list[Any] = [partial(value, k=k) for k in range(sticking.k + len(stops))]
    ways = {"up": 1.0, "down": -1.0, "both": 0.0}
    for event, way in zip(
        events, [-1.0] * sticking.k + [ways[own.direction] for own in stops], strict=True
    ):
        event.terminal, event.direction = True, way
    for _ in range(MOST):
        if (sticking.sides(signs) == 0).any():
            raise RuntimeError(STICKS)
        known = (np.nan, b"", None)
        found = solve_ivp(
            slope, (t, work.end), y, method="DOP853", rtol=max(tolerance, 3e-14),
            atol=tolerance * float(work.sizes.min(initial=1.0)), events=events,
        )  # fmt: skip
        calls += int(found.nfev)
        t, y = float(found.t[-1]), found.y[:, -1]
        if found.status != 1:
            if found.status < 0:
                raise RuntimeError(found.message)
            return MotionEnd(y[:n], calls)
        met = [k for k, times in enumerate(found.t_events) if len(times)]
        left = np.array(look(t, y[:n], y[n:], signs)[1]).ravel()
        if max(met) >= sticking.k or (np.abs(left) <= STILL * np.abs(first)).any():
            return MotionEnd(y[:n], calls)
        sides = sticking.sides(signs).copy()
        sides[met] *= -1.0
        signs = sticking.signs(sides)
        rates = sticking.values(t, y[:n], y[n:], signs)[1][0]
        if (sides[met] * rates[met] <= 0).any():
            raise RuntimeError(STICKS)
    raise RuntimeError(f"more than {MOST} reversals")


def scipys(
    work: MotionWork, solve_ivp: Callable[..., Any], tolerances: tuple[float, ...]
) -> Iterator[tuple[str, float, Way]]:
    """Yield DOP853 and Radau, the latter with the exact Jacobian."""
    n, none = len(work.x), work.none
    call = work.integrator._rhs
    start = np.concatenate([work.x, work.v])
    least = float(work.sizes.min(initial=1.0))

    def slope(t: float, y: Any) -> Any:
        return np.concatenate([y[n:], call(t, y[:n], y[n:], none)[0]])

    def jacobian(t: float, y: Any) -> Any:
        return rates(t, y)[0]

    def way(method: str, tolerance: float, more: dict[str, Any]) -> MotionEnd:
        found = solve_ivp(
            slope, (0.0, work.end), start, method=method, rtol=max(tolerance, 3e-14),
            atol=tolerance * least, t_eval=[work.end], **more,
        )  # fmt: skip
        if not found.success:
            raise RuntimeError(found.message)
        return MotionEnd(found.y[:n, -1], int(found.nfev))

    for tolerance in tolerances:
        yield "scipy DOP853", tolerance, partial(way, "DOP853", tolerance, {})
    t, y, ode = _ode(work)
    rates = Call(ca.Function("rates", [t, y], [ca.densify(ca.jacobian(ode, y))], {"cse": True}))
    for tolerance in tolerances:
        if tolerance >= IMPLICIT:
            yield "scipy Radau", tolerance, partial(way, "Radau", tolerance, {"jac": jacobian})


def _ode(work: MotionWork) -> tuple[Any, Any, Any]:
    """Return t, y = (x, x') and y'."""
    n = len(work.x)
    t, y = SX.sym("t"), SX.sym("y", 2 * n)
    return t, y, ca.vertcat(y[n:], work.kernel.rhs(t, y[:n], y[n:], work.none, _numbers(work))[0])


def _numbers(work: MotionWork) -> Any:
    """Return the numbers of the kernel as constants."""
    return SX(ca.DM(work.kernel.numbers))


def sundials(work: MotionWork, tolerances: tuple[float, ...]) -> Iterator[tuple[str, float, Way]]:
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
        M, f, J, gamma = kernel.parts(t, y[:n], y[n:], work.none, _numbers(work))
        balance = ca.densify(ca.vertcat(M @ z[:n] + J.T @ z[n:] - f, J @ z[:n] - gamma))
        whole = {"t": t, "x": y, "z": z, "ode": ca.vertcat(y[n:], z[:n]), "alg": balance}
        chosen.append(("IDAS, index 1", "idas", whole, {}))

    def way(solver: Any, algebraic: bool) -> MotionEnd:
        found = solver(x0=start, z0=first) if algebraic else solver(x0=start)
        return MotionEnd(np.array(found["xf"])[:n, 0], int(solver.stats()["nfevals"]))

    for method, plugin, equations, more in chosen:
        for tolerance in tolerances:
            options = {
                "reltol": tolerance, "abstol": tolerance * least, "max_num_steps": STEPS,
                "disable_internal_warnings": True, **more,
            }  # fmt: skip
            with quiet():
                solver = ca.integrator("solver", plugin, equations, 0.0, work.end, options)
            yield method, tolerance, partial(way, solver, "z" in equations)
