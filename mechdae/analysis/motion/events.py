"""Events of a motion: crossings that the task asks for, resistances whose speed vanishes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.analysis.motion.expressions import over_states
from mechdae.analysis.motion.integrate import Integrator, Nodes
from mechdae.analysis.motion.setup import Setup
from mechdae.describe.moving import Crossing, crossings
from mechdae.errors import MechdaeError
from mechdae.kernels.batch import Batch

SX = ca.SX


@dataclass(frozen=True)
class Found:
    """A crossing at a state; ``rises`` tells its direction."""

    crossing: Crossing
    state: Any
    rises: bool
    signs: Any


class Crossings:
    """The crossings a task asks for, located by repeating the step they lie in."""

    def __init__(self, setup: Setup, integrator: Integrator) -> None:
        self.setup, self.integrator = setup, integrator
        self.wanted = crossings(setup.problem.mechanism, setup.task)
        self.found: list[Found] = []

    @cached_property
    def _function(self) -> Batch:
        model, r = self.setup.model, self.setup.released
        rows = []
        for i, crossing in enumerate(self.wanted):
            try:
                found = over_states(model, self.setup.loads, crossing.text, {})
            except MechdaeError as problem:
                raise problem.inside(f"events[{i}]") from None
            rows.append(r.moved(found) - crossing.value)
        return Batch(self.setup.kernel.function("events", [ca.vertcat(*rows)]), [3])

    def values(self, states: Any, signs: Any) -> Any:
        """Return what is left to each crossing, (n, crossings)."""
        lay = self.integrator.layout
        t, x, v = (lay.of(states, name) for name in ("t", "x", "v"))
        return self._function(t[:, None], x, v, signs)[0]

    def look(self, nodes: Nodes) -> Found | None:
        """Look for crossings in accepted steps; return the first that stops the motion."""
        if not self.wanted:
            return None
        lay, states = self.integrator.layout, nodes.states
        values = self.values(states, nodes.signs)
        found: list[Found] = []
        for k, crossing in enumerate(self.wanted):
            own = values[:, k]
            for i in range(len(own) - 1):
                rises = own[i] < 0 <= own[i + 1]
                falls = own[i] > 0 >= own[i + 1]
                if (rises and crossing.direction != "down") or (
                    falls and crossing.direction != "up"
                ):
                    h = float(lay.of(states[i + 1], "t") - lay.of(states[i], "t"))

                    def value(state: Any, k: int = k) -> float:
                        return float(self.values(state[None, :], nodes.signs)[0, k])

                    state = self.integrator.located(states[i], h, nodes.signs, value)
                    found.append(Found(crossing, state, bool(rises), nodes.signs))
        found.sort(key=lambda entry: float(lay.of(entry.state, "t")))
        stop = next((k for k, entry in enumerate(found) if entry.crossing.stop), None)
        self.found += found if stop is None else found[: stop + 1]
        return None if stop is None else found[stop]


class Reversals:
    """Signs of the speeds of resistances: fixed over steps, they change where a speed vanishes.

    A speed that resistance holds at zero sticks: this version says so and stops.
    """

    def __init__(self, setup: Setup, integrator: Integrator) -> None:
        self.setup, self.integrator = setup, integrator
        self.names = [slip.owner for slip in setup.loads.slips]
        self.found: list[tuple[float, str, float]] = []

    @cached_property
    def _speeds(self) -> Batch:
        r = self.setup.released
        return Batch(self.setup.kernel.function("slips", [ca.densify(r.slips)]), [3])

    @cached_property
    def _rates(self) -> Batch:
        r = self.setup.released
        a = SX.sym("a", r.x.numel())
        along = r.rate(r.slips) + ca.jacobian(r.slips, r.v) @ a
        return Batch(self.setup.kernel.function("slip_rates", [ca.densify(along)], [a]), [3])

    def _rate(self, t: float, x: Any, v: Any, signs: Any) -> Any:
        a = self.integrator.acceleration(t, x, v, signs)
        return self._rates(np.array([[t]]), x[None, :], v[None, :], signs, a[None, :])[0][0]

    def speeds(self, t: Any, x: Any, v: Any, signs: Any) -> Any:
        """Return the speeds (n, slips)."""
        return self._speeds(np.reshape(t, (-1, 1)), x, v, signs)[0]

    def first(self, t: float, x: Any, v: Any) -> tuple[Any, list[str]]:
        """Return signs at a state, those of the coming motion where it rests, and what sticks."""
        count = len(self.names)
        signs = np.zeros(count)
        if not count:
            return signs, []
        speed = self.speeds(t, x[None, :], v[None, :], signs)[0]
        size = np.max(np.abs(speed), initial=0.0)
        resting = np.abs(speed) <= 1e-12 * size
        signs = np.where(resting, 0.0, np.sign(speed))
        return self.settled(t, x, v, signs, np.flatnonzero(resting))

    def settled(self, t: float, x: Any, v: Any, signs: Any, resting: Any) -> tuple[Any, list[str]]:
        """Return the signs of the coming motion for speeds that are zero, and what sticks."""
        signs, stuck = signs.copy(), []
        signs[resting] = 0.0
        for k in resting:
            ahead = float(np.sign(self._rate(t, x, v, signs)[k]))
            signs[k] = ahead
            if ahead and self._rate(t, x, v, signs)[k] * ahead <= 0:
                stuck.append(self.names[k])
        return signs, stuck

    def look(self, nodes: Nodes) -> tuple[Any, int] | None:
        """Return the state at which the first speed vanishes and which one; None for none."""
        if not self.names:
            return None
        lay, states, signs = self.integrator.layout, nodes.states, nodes.signs
        t, x, v = (lay.of(states, name) for name in ("t", "x", "v"))
        speeds = self.speeds(t, x, v, signs) * signs
        against = speeds[1:] < 0
        if not against.any():
            return None
        i = int(np.flatnonzero(against.any(axis=1))[0])
        first: tuple[Any, int] | None = None
        for k in np.flatnonzero(against[i]):
            h = float(t[i + 1] - t[i])

            def value(state: Any, k: int = int(k)) -> float:
                place, rate = state[lay["x"]], state[lay["v"]]
                at = float(lay.of(state, "t"))
                return float(self.speeds(at, place[None, :], rate[None, :], signs)[0, k])

            state = self.integrator.located(states[i], h, signs, value)
            if first is None or lay.of(state, "t") < lay.of(first[0], "t"):
                first = (state, int(k))
        return first
