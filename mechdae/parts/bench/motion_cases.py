"""Motions to be measured: their kernels, and how far off the end is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe import Problem, coordinate
from mechdae.describe.coordinates import split_rate
from mechdae.describe.expression import names_in
from mechdae.dynamics.equations import MotionProblem
from mechdae.dynamics.expressions import over_states
from mechdae.dynamics.run import MotionRun, OutputStates, integrate
from mechdae.errors import MechdaeError
from mechdae.records import dataclass
from mechdae.types import Floats, Graph, Unknowns

SX = ca.SX
TIGHT = 1e-13
STALE = 10.0
"""Times the deviation that the file allows, from which expected values are stale."""
OURS = "mechdae"
STATE = "summary/state/"


@dataclass(frozen=True)
class MotionEnd:
    """Where an integration ends, and how many right-hand sides it took."""

    x: Unknowns
    rhs: int


Way = Callable[[], MotionEnd]


class MotionWork:
    """A task of motion, its kernels and the truth at its end.

    ``reference``: what errors are differences to: "values of the problem" or "tightened run".
    ``notes``: what was found beforehand: expected values that are not those of the file.
    """

    def __init__(self, problem: Problem, name: str, run: MotionRun, x: Unknowns, v: Floats) -> None:
        self.name = f"{problem.name} {name}"
        self.problem, self.key = problem, name
        self.run, self.x, self.v = run, x, v
        self.setup, self.integrator = self.run.setup, self.run.integrator
        self.kernel = self.setup.kernel
        self.none = self.setup.loose
        self.sizes = self.kernel.sizes
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

    def error(self, x: Unknowns) -> float:
        """Return the largest error at the end, over natural sizes or what is larger."""
        found = x if self._outputs is None else self._outputs(self.end, x)
        found = np.array(ca.DM(found)).ravel()
        scale = np.maximum(self._units, np.abs(self._wanted))
        return float(np.max(np.abs(found - self._wanted) / scale, initial=0.0))

    def drift(self, x: Unknowns) -> float:
        """Return the largest gap of a constraint at the end, over its natural size."""
        if not self.kernel.m:
            return 0.0
        phi = self.kernel.value("place", self.end, x, np.zeros(len(x)), self.none)[0]
        return float(np.max(np.abs(phi.ravel()) / self.kernel.gaps))

    def ours(self, tolerance: float) -> MotionEnd:
        """Integrate with the package."""
        integrator = self.integrator
        self.setup.tolerance = tolerance
        before = integrator.rhs
        works = np.zeros(len(self.setup.works))
        state = integrator.first(0.0, self.x, self.v, works, self.none)
        for nodes in integrator.steps(state, self.none):
            if nodes.stalled:
                raise RuntimeError("the step size went to nothing")
            state = nodes.states[-1]
        return MotionEnd(state[integrator.layout["x"]].copy(), integrator.rhs - before)


class RubbingWork(MotionWork):
    """The same with dry friction: steps, sliding speeds that vanish, ways to go on."""

    def fresh(self) -> MotionRun:
        """Return a run without a past; what has been built for the last one stays."""
        last = self.run
        self.run = MotionRun(self.setup, last.begin, self.integrator)
        return self.run

    def ours(self, tolerance: float) -> MotionEnd:
        """Integrate with the package."""
        self.setup.tolerance = tolerance
        before, run = self.integrator.rhs, self.fresh()
        integrate(run, OutputStates(), self.x, self.v)
        if run.fault:
            raise RuntimeError(run.fault)
        return MotionEnd(run.last[self.integrator.layout["x"]].copy(), self.integrator.rhs - before)


def _expected(
    setup: MotionProblem, problem: Problem, name: str
) -> tuple[Graph | None, Floats, Floats, float]:
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
    given = [released.t, released.x, model.p]
    held = ca.DM(list(setup.held.values()))
    place = ca.Function("place", given, [ca.substitute(released.q, released.values, held)])
    t, x = SX.sym("t"), SX.sym("x", released.x.numel())
    p = ca.DM(model.p_values)
    at_end = ca.Function("end", [t, x], [general(place(t, x, p), t, p)])
    return at_end, np.array(wanted), np.array(units), allowed


def _size(setup: MotionProblem, text: str) -> float:
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
