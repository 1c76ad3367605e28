"""Ends of load tables and of curves that a motion reaches: beyond them nothing is defined."""

from __future__ import annotations

import casadi as ca
import numpy as np

from mechdae.dynamics.equations import MotionProblem
from mechdae.dynamics.integrate import Cut, Integrator, Nodes
from mechdae.types import Graph, Sym

SLACK = 1e-9
"""Share of a table's range by which an abscissa may lie outside."""


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
