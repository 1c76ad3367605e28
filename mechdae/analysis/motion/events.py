"""Events of a motion that the task asks for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca

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

    def rows(self) -> list[Any]:
        """Return what is left to each crossing, over time and state."""
        model, r = self.setup.model, self.setup.released
        rows = []
        for i, crossing in enumerate(self.wanted):
            try:
                found = over_states(model, self.setup.loads, crossing.text, {})
            except MechdaeError as problem:
                raise problem.inside(f"events[{i}]") from None
            rows.append(r.moved(found) - crossing.value)
        return rows

    @cached_property
    def _function(self) -> Batch:
        return Batch(self.setup.kernel.function("events", [ca.vertcat(*self.rows())]), [3])

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
