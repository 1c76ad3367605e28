"""Forces that force tiny steps on an explicit method, found by its steps and their slopes."""

from __future__ import annotations

from collections import deque

import casadi as ca
import numpy as np

from mechdae.dynamics.equations import MotionProblem
from mechdae.dynamics.integrate import Integrator, Nodes
from mechdae.results import Event, motion_event
from mechdae.types import Graph

SLOW = 0.05
"""Share of the natural step, tol^(1/8) over the frequency, below which steps are small."""
STEPS = 96
"""Small steps in a row that are looked into."""
BOUND = 1.0
"""Product of step and rate from which a force, not the motion, sets the step; the method is
stable up to about 6."""


class Stiffness:
    """Watches the steps of a motion."""

    def __init__(self, setup: MotionProblem, integrator: Integrator) -> None:
        self.setup, self.integrator = setup, integrator
        self.found: tuple[float, str, float, float] | None = None
        self.turned = False
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
