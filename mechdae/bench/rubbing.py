"""Motions with dry friction, up to the event that stops them, beside scipy's DOP853 with events.

What the package does is measured as a whole: steps, sliding speeds that vanish, ways to go on.
scipy integrates the same right-hand side with the signs of the sliding speeds fixed, stops where
one of them vanishes, and goes on with the other sign. That is right while no pair sticks before the
motion is stopped, as in a mechanism of one freedom that coasts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property, partial
from typing import Any

import casadi as ca
import numpy as np

from mechdae.bench.works import OURS, End, Way, Work
from mechdae.dynamics.run import Kept, Run, integrate
from mechdae.kernels.run.call import Call

MOST = 10_000
"""Reversals after which scipy gives up."""
STILL = 1e-9
"""Share of its first value below which what stops a motion counts as zero."""
STICKS = "a pair sticks: that takes more than an integrator with events"


class Rubbing(Work):
    """A task of motion whose joints rub, its kernels and the truth at its end."""

    def _fresh(self) -> Run:
        """Return a run without a past; what has been built for the last one stays."""
        last = self.run
        self.run = Run(self.setup, last.begin, self.integrator)
        for own, built in zip(self.run.watchers, last.watchers, strict=True):
            cached = [name for name in vars(built) if _cached(type(built), name)]
            vars(own).update({name: vars(built)[name] for name in cached})
        return self.run

    def ours(self, tolerance: float) -> End:
        """Integrate with the package."""
        self.setup.tolerance = tolerance
        before, run = self.integrator.rhs, self._fresh()
        integrate(run, Kept(), self.x, self.v)
        if run.fault:
            raise RuntimeError(run.fault)
        return End(run.last[self.integrator.layout["x"]].copy(), self.integrator.rhs - before)

    def ways(self, tolerances: tuple[float, ...]) -> Iterator[tuple[str, float, Way]]:
        """Yield method, tolerance and function of each integration."""
        for tolerance in tolerances:
            yield OURS, tolerance, partial(self.ours, tolerance)
        try:
            from scipy.integrate import solve_ivp
        except ImportError:
            return
        for tolerance in tolerances:
            yield "scipy DOP853, events", tolerance, partial(self._scipy, solve_ivp, tolerance)

    @cached_property
    def _watched(self) -> Call:
        """(t, x, v, signs) -> speeds of the slips, what is left to the events that stop."""
        k, crossings = self.kernel, self.run.crossings
        rows = [
            row for row, own in zip(crossings.rows(), crossings.wanted, strict=True) if own.stop
        ]
        results = [ca.densify(self.setup.released.slips), ca.densify(ca.vertcat(*rows))]
        return Call(k.function("watched", results))

    def _scipy(self, solve_ivp: Callable[..., Any], tolerance: float) -> End:
        n, calls = len(self.x), 0
        rhs, watched, sticking = self.integrator._rhs, self._watched, self._fresh().sticking
        stops = [own for own in self.run.crossings.wanted if own.stop]
        signs, v = sticking.first(0.0, self.x, self.v)
        t, y = 0.0, np.concatenate([self.x, v])
        first = np.array(watched(t, self.x, v, signs)[1]).ravel()
        known: tuple[float, bytes, Any] = (np.nan, b"", None)

        def slope(t: float, y: Any) -> Any:
            return np.concatenate([y[n:], rhs(t, y[:n], y[n:], signs)[0]])

        def value(t: float, y: Any, k: int) -> float:
            nonlocal known
            if known[0] != t or known[1] != y.tobytes():
                speeds, left = watched(t, y[:n], y[n:], signs)
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
                slope, (t, self.end), y, method="DOP853", rtol=max(tolerance, 3e-14),
                atol=tolerance * float(self.sizes.min(initial=1.0)), events=events,
            )  # fmt: skip
            calls += int(found.nfev)
            t, y = float(found.t[-1]), found.y[:, -1]
            if found.status != 1:
                if found.status < 0:
                    raise RuntimeError(found.message)
                return End(y[:n], calls)
            met = [k for k, times in enumerate(found.t_events) if len(times)]
            left = np.array(watched(t, y[:n], y[n:], signs)[1]).ravel()
            if max(met) >= sticking.k or (np.abs(left) <= STILL * np.abs(first)).any():
                return End(y[:n], calls)
            sides = sticking.sides(signs).copy()
            sides[met] *= -1.0
            signs = sticking.signs(sides)
            rates = sticking.values(t, y[:n], y[n:], signs)[1][0]
            if (sides[met] * rates[met] <= 0).any():
                raise RuntimeError(STICKS)
        raise RuntimeError(f"more than {MOST} reversals")


def _cached(kind: type, name: str) -> bool:
    return isinstance(getattr(kind, name, None), cached_property)
