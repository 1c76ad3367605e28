"""Events of a motion that the task asks for."""

from __future__ import annotations

from collections import deque
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.tasks.motion import Watched, crossings
from mechdae.dynamics.equations import MotionProblem
from mechdae.dynamics.integrate import Cut, Integrator, Nodes
from mechdae.dynamics.output_values import over_states
from mechdae.dynamics.watchers.zeros import Looker, changes
from mechdae.errors import within
from mechdae.records import dataclass
from mechdae.results import Event, motion_event
from mechdae.types import Floats, Graph, Sym, Unknowns

SLOW = 0.05
"""Share of the natural step, tol^(1/8) over the frequency, below which steps are small."""
STEPS = 96
"""Small steps in a row that are looked into."""
BOUND = 1.0
"""Product of step and rate from which a force, not the motion, sets the step; the method is
stable up to about 6."""
SLACK = 1e-9
"""Share of a table's range by which an abscissa may lie outside."""
SX = ca.SX
ROUNDING = 4e-15
"""Value of a crossing, over the sizes it is made of, that is none."""


class Stiffness:
    """Watches the steps of a motion."""

    def __init__(self, setup: MotionProblem, integrator: Integrator) -> None:
        self.setup, self.integrator = setup, integrator
        self.found: tuple[float, str, float, float] | None = None
        self.turned: bool = False
        self._ratios: deque[float] = deque(maxlen=STEPS)

    def _slopes(self) -> Graph:
        """Return the function of mass, Jacobian and the slopes of each load by x' and x."""
        r, k = self.setup.released, self.setup.kernel
        results = [r.M, r.J]
        for wrench in self.setup.loads.wrenches.values():
            force = r.V.T @ r.moved(r.stack(wrench))
            results += [ca.jacobian(force, r.v), ca.jacobian(force, r.x)]
        return k.function("slopes", [ca.densify(part) for part in results])

    def look(self, nodes: Nodes) -> None:
        """Look at accepted steps."""
        if self.found is not None or self.integrator.implicit or len(nodes.states) < 2:
            return
        lay, states = self.integrator.layout, nodes.states
        t, v, a = (lay.of(states, name) for name in ("t", "v", "a"))
        sizes = self.setup.kernel.sizes
        omega = np.maximum(np.abs(v / sizes), np.sqrt(np.abs(a / sizes))).max(axis=1, initial=0.0)
        natural = self.setup.tolerance ** (1 / 8) / np.maximum(omega[:-1], 1e-300)
        # steps between outputs are not cut, so that only the error sets them
        self._ratios.extend(np.diff(t) / np.minimum(natural, self.setup.end))
        if len(self._ratios) == STEPS and np.mean(self._ratios) < SLOW:
            self._name(nodes, float(np.mean(np.diff(t))))
            self._ratios.clear()

    def _name(self, nodes: Nodes, h: float) -> None:
        lay, state = self.integrator.layout, nodes.states[-1]
        k = self.setup.kernel
        t, x, v = (lay.of(state, name) for name in ("t", "x", "v"))
        M, J, *slopes = k.call("slopes", self._slopes)(t, x, v, nodes.signs)
        M, J = np.reshape(M, (k.n, k.n), order="F"), np.reshape(J, (k.m, k.n), order="F")
        basis = self.setup.freedoms(J) * k.sizes[:, None]
        inverse = np.linalg.inv(basis.T @ M @ basis)
        worst = (0.0, "")
        for i, load in enumerate(self.setup.loads.wrenches):
            damping, stiffness = (
                np.linalg.norm(inverse @ basis.T @ np.reshape(part, (k.n, k.n), order="F") @ basis)
                for part in slopes[2 * i : 2 * i + 2]
            )
            worst = max(worst, (float(max(damping, np.sqrt(stiffness))), load))
        if worst[0] * h > BOUND:
            self.found = (float(t), worst[1], worst[0], h)
            self.turned = self.integrator.turn_stiff()

    def events(self) -> list[Event]:
        if self.found is None:
            return []
        t, load, rate, h = self.found
        facts = {"load": load, "rate": rate, "step": h, "method": "bdf"}
        return [motion_event("stiff", t, code="S6", **facts)]

    def notes(self) -> list[str]:
        """Return what to say about it."""
        if self.found is None:
            return []
        t, load, rate, h = self.found
        advice = 'method = "bdf" takes far fewer, and so does a constraint in its place'
        if self.turned:
            advice = "from there on the method is bdf"
        return [
            f"stiff (S6) from t = {t:.6g} s on: load {load} has a rate of {rate:.3g} 1/s, much "
            f"faster than the motion, and holds the explicit steps at {h:.2g} s; {advice}"
        ]


class Ranges:
    """Watches the abscissae of tables and the places on open curves along a motion."""

    def __init__(self, setup: MotionProblem, integrator: Integrator) -> None:
        self.setup, self.integrator = setup, integrator
        self.left: dict[str, tuple[float, float]] = {}
        self._at: list[Sym] = []
        self._ends: list[tuple[str, float, float]] = []
        for signal in setup.loads.signals:
            if not signal.load.periodic:
                self._at.append(signal.at)
                points = signal.load.points
                self._ends.append((f"load {signal.load.name}", points[0][0], points[-1][0]))
        for table in setup.loads.timed:
            if table.ends is not None:
                self._at.append(setup.loads.time)
                self._ends.append((table.name, *table.ends))
        for name, contact in setup.model.contacts.items():
            if not contact.closed:
                self._at.append(contact.s)
                self._ends.append((f"joint {name}", *contact.range))

    def _abscissae(self) -> Graph:
        at = self.setup.released.moved(ca.vertcat(*self._at))
        return self.setup.kernel.function("abscissae", [ca.densify(at)])

    def look(self, nodes: Nodes) -> Cut | None:
        """Look at accepted steps; return the last state at which all of them are within."""
        if not self._ends:
            return None
        lay = self.integrator.layout
        t, x, v = (lay.of(nodes.states, name) for name in ("t", "x", "v"))
        abscissae = self.setup.kernel.batch("abscissae", self._abscissae)
        values = abscissae(t[:, None], x, v, nodes.signs)[0]
        last = len(t)
        for k, (name, low, high) in enumerate(self._ends):
            slack = SLACK * (high - low)
            outside = (values[:, k] < low - slack) | (values[:, k] > high + slack)
            if outside.any():
                first = int(np.argmax(outside))
                self.left[name] = (float(t[first]), float(values[first, k]))
                last = min(last, first)
        return Cut(nodes.states[max(last - 1, 0)]) if last < len(t) else None

    def faults(self) -> list[str]:
        """Return what is wrong with the motion because of it."""
        faults = []
        for name, (t, at) in self.left.items():
            word, _, load = name.partition(" ")
            what = f"the curve of {name}" if word == "joint" else f"the table of the {name}"
            what = f"the table of load {load}" if word == "load" else what
            advice = "a longer range" if word == "joint" else "add rows, or periodic = true"
            faults.append(
                f"{what} ends before the motion does: nothing is given at {at:.6g}, reached by "
                f"t = {t:.6g} s. Try {advice}"
            )
        return faults


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
        self.wanted: list[Watched] = crossings(setup.problem.mechanism, setup.task)
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
