"""Motions against the yardstick: processor time, medians of interleaved runs, error beside it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from functools import partial
from statistics import median
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.describe import Problem, coordinate
from mechdae.describe.coordinates import split_rate
from mechdae.describe.expression import names_in
from mechdae.describe.tasks.motion import Motion
from mechdae.dynamics.equations import MotionProblem
from mechdae.dynamics.output_values import over_states
from mechdae.dynamics.run import MotionRun, OutputStates, integrate
from mechdae.dynamics.task import motion, prepared
from mechdae.errors import MechdaeError
from mechdae.parts.bench.runs import yardstick
from mechdae.records import dataclass
from mechdae.types import Floats, Graph, Unknowns

if TYPE_CHECKING:
    from mechdae.kernels.graphs.equations_of_motion import Kernel

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
        self.name: str = f"{problem.name} {name}"
        self.problem, self.key = problem, name
        self.run, self.x, self.v = run, x, v
        self.setup, self.integrator = self.run.setup, self.run.integrator
        self.kernel: Kernel = self.setup.kernel
        self.none: Floats = self.setup.loose
        self.sizes: Floats = self.kernel.sizes
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
        self.run: MotionRun = MotionRun(self.setup, last.begin, self.integrator)
        return self.run

    def ours(self, tolerance: float) -> MotionEnd:
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


TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
QUICK_TOLERANCES = (1e-8, 1e-10)
POSES = 10_000
"""Poses of the yardstick."""
Others = Callable[[MotionWork, tuple[float, ...], list[str]], Iterable[tuple[str, float, Way]]]
"""Other methods of a work at tolerances; they may add notes."""


def work_of(problem: Problem) -> MotionWork | None:
    """Return the first task of motion of a problem."""
    for name, task in problem.tasks.items():
        if isinstance(task, Motion):
            run, x, v = prepared(problem, task)
            rubs = run.setup.released.rubbing.slips and not run.setup.smooth
            kind = RubbingWork if rubs else MotionWork
            return kind(problem, name, run, x, v)
    return None


def measure(
    work: MotionWork,
    tolerances: tuple[float, ...] = TOLERANCES,
    repeats: int = 7,
    others: Others | None = None,
) -> tuple[list[dict[str, Any]], list[str]]:
    """Return one record per method and tolerance, and notes on what was left out or failed.

    ``n`` is the number of right-hand sides, ``seconds`` the median processor time of an
    integration with its functions built, ``yardstick`` that of the yardstick at 10 000 poses,
    ``ratio`` their quotient. ``error`` is the largest one at the end, over natural sizes, or
    over the value where that is larger; ``drift`` the largest gap of a constraint there. ``first``
    is a whole task of the package, from the description to the result.
    """
    begin = time.process_time()
    motion(work.problem, work.key, work.run.setup.task)
    first = time.process_time() - begin
    ways, ends, notes = [], [], [*work.notes]
    tried: list[tuple[str, float, Way]] = [
        (OURS, tolerance, partial(work.ours, tolerance)) for tolerance in tolerances
    ]
    beside = others(work, tolerances, notes) if others is not None else ()
    for method, tolerance, way in (*tried, *beside):
        try:
            end = way()
        except (RuntimeError, ValueError) as problem:
            reason = str(problem).strip().splitlines()[-1].rpartition("cpp:")[2]
            notes.append(f"{method} at {tolerance:.0e} failed: {reason}")
            continue
        ways.append((method, tolerance, way))
        ends.append(end)
    crank = np.linspace(0, 2 * np.pi, POSES)
    times: list[list[float]] = [[] for _ in ways]
    sticks: list[float] = []
    for _ in range(repeats):
        for (_, _, way), kept in zip(ways, times, strict=True):
            sticks.append(_timed(partial(yardstick, crank)))
            kept.append(_timed(way))
    stick = median(sticks)
    records = []
    for (method, tolerance, _), kept, end in zip(ways, times, ends, strict=True):
        seconds = median(kept)
        record = {
            "work": work.name, "task": "motion", "method": method, "tolerance": tolerance,
            "n": end.rhs, "ratio": seconds / stick, "yardstick": stick,
            "error": work.error(end.x), "seconds": seconds, "drift": work.drift(end.x),
            "reference": work.reference,
        }  # fmt: skip
        if method == OURS:
            record["first"] = first
        records.append(record)
    return records, notes


def _timed(function: Callable[[], object]) -> float:
    begin = time.process_time()
    function()
    return time.process_time() - begin


def table(records: list[dict[str, Any]], notes: list[str]) -> str:
    lines = [
        f"{records[0]['work']:24} {'tolerance':>9} {'rhs':>7} {'ms':>8} {'x yardstick':>12} "
        f"{'error':>9} {'drift':>9}"
    ]
    lines += [
        f"  {r['method']:22} {r['tolerance']:9.0e} {r['n']:7d} {r['seconds'] * 1e3:8.2f} "
        f"{r['ratio']:12.2f} {r['error']:9.1e} {r['drift']:9.1e}"
        for r in records
    ]
    lines.append(
        f"yardstick: closed-form four-bar in NumPy at {POSES} poses, "
        f"{records[0]['yardstick'] * 1e3:.2f} ms; processor time, medians of interleaved runs"
    )
    lines.append(f"error at the end against {records[0]['reference']}; functions are built before")
    return "\n".join([*lines, *notes])
