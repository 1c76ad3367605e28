"""Events of a motion that the task asks for."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.tasks.motion import Watched, crossings
from mechdae.dynamics.equations import MotionProblem
from mechdae.dynamics.expressions import over_states
from mechdae.dynamics.integrate import Cut, Integrator, Nodes
from mechdae.dynamics.watchers.zeros import Looker, changes
from mechdae.errors import within
from mechdae.records import dataclass
from mechdae.types import Floats, Graph, Sym, Unknowns

SX = ca.SX
ROUNDING = 4e-15
"""Value of a crossing, over the sizes it is made of, that is none."""


@dataclass(frozen=True)
class LocatedEvent:
    """A crossing at a state; ``rises`` tells its direction."""

    crossing: Watched
    state: Any
    rises: bool
    signs: Floats


class Crossings:
    """The crossings a task asks for, located by repeating the step they lie in."""

    def __init__(self, setup: MotionProblem, integrator: Integrator) -> None:
        self.setup, self.integrator = setup, integrator
        self.wanted = crossings(setup.problem.mechanism, setup.task)
        self.found: list[LocatedEvent] = []

    @cached_property
    def expressions(self) -> list[Sym]:
        """What is left to each crossing, over time and absolute coordinates."""
        found = []
        for i, crossing in enumerate(self.wanted):
            with within(f"events[{i}]"):
                expression = over_states(
                    self.setup.model, self.setup.loads, crossing.coordinate, {}
                )
            found.append(expression - crossing.crosses)
        return found

    def rows(self) -> list[Sym]:
        """Return what is left to each crossing, over time and state."""
        return [self.setup.released.moved(expression) for expression in self.expressions]

    @cached_property
    def _function(self) -> Any:
        """(t, x, v, signs) -> what is left to each crossing, and the size of its rounding."""
        r, k = self.setup.released, self.setup.kernel

        def build() -> Graph:
            rows = ca.vertcat(*self.rows())
            omega, sizes = SX.sym("omega"), k.given["sizes"]
            size = ca.fabs(rows)
            for symbols, scale in ((r.x, sizes), (r.v, omega * sizes)):
                size += ca.fabs(ca.jacobian(rows, symbols)) @ (ca.fabs(symbols) + scale)
            return k.function("events", [ca.densify(rows), ca.densify(size)], [omega])

        wanted = tuple((crossing.coordinate, crossing.crosses) for crossing in self.wanted)
        return k.batch(f"events {wanted}", build)

    def values(self, t: Floats, x: Unknowns, v: Floats, signs: Floats) -> Floats:
        """Return what is left to each crossing, (n, crossings); what is rounding is 0."""
        omega = np.max(np.abs(v) / self.setup.kernel.sizes, axis=1, initial=0.0)
        left, size = self._function(t, x, v, signs, omega[:, None])
        return np.where(np.abs(left) <= ROUNDING * size, 0.0, left)

    def look(self, nodes: Nodes) -> Cut | None:
        """Look for crossings in accepted steps; return where the first stops the motion."""
        if not self.wanted or len(nodes.states) < 2:
            return None
        lay, signs = self.integrator.layout, nodes.signs

        def values(t: Floats, x: Unknowns, v: Floats) -> Floats:
            return self.values(t, x, v, signs)

        looker = Looker(self.integrator, nodes, values)
        found: list[LocatedEvent] = []
        for sign in changes(lay, nodes, values):
            crossing = self.wanted[sign.which]
            for state, before in looker.states(sign):
                if crossing.direction != ("down" if before < 0 else "up"):
                    found.append(LocatedEvent(crossing, state, before < 0, signs))
        found.sort(key=lambda entry: float(lay.of(entry.state, "t")))
        stop = next((k for k, entry in enumerate(found) if entry.crossing.stop), None)
        self.found += found if stop is None else found[: stop + 1]
        return None if stop is None else Cut(found[stop].state)
