"""A task of motion from start to result."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mechdae.describe.expression import evaluate
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.kinds import Motion
from mechdae.describe.tasks.motion import start_values
from mechdae.dynamics.bdf import Bdf
from mechdae.dynamics.checks import check_friction, check_inertia, check_rest, check_start
from mechdae.dynamics.clock import Clock
from mechdae.dynamics.creep import Creep
from mechdae.dynamics.endings import Growth, check_dead_start, feasible, stalled
from mechdae.dynamics.equations import Setup, idle, setup
from mechdae.dynamics.integrate import Integrator, Nodes
from mechdae.dynamics.observe import Observer, States
from mechdae.dynamics.report import Run, report
from mechdae.dynamics.rest.linear_system import Linear, State
from mechdae.dynamics.start import Start, start
from mechdae.dynamics.verdict import NoWay
from mechdae.dynamics.watchers.events import Crossings
from mechdae.dynamics.watchers.lift_off import Lifting
from mechdae.dynamics.watchers.onset import verdict_ahead
from mechdae.dynamics.watchers.passages import Passages
from mechdae.dynamics.watchers.ranges import Ranges
from mechdae.dynamics.watchers.sticking import Sticking
from mechdae.dynamics.watchers.stiffness import Stiffness
from mechdae.errors import InputError, UnavailableError
from mechdae.forces.meshes import about_meshes, meshes_beside
from mechdae.kernels.run.batch import Batch
from mechdae.numerics.null_space import freedoms
from mechdae.results import Result

MOST = 2_000_000
"""States that are kept."""
CROWD = 20
"""Events of friction so near each other that the motion does not go on."""
CLOSE = 1e-6
"""Share of the whole time that is near."""


@dataclass
class Kept:
    """States of output as they are found: time, x, v, works, signs."""

    rows: list[tuple[Any, Any, Any, Any, Any]] = field(default_factory=list)
    count: int = 0

    def add(self, t: Any, x: Any, v: Any, w: Any, signs: Any) -> None:
        """Add states (n, .)."""
        t = np.atleast_1d(np.asarray(t, float))
        self.count += len(t)
        if self.count > MOST:
            raise InputError(
                f"more than {MOST} states would be kept", hint="name the times: at = [...] or poses"
            )
        signs = np.broadcast_to(np.asarray(signs, float), (len(t), len(signs)))
        self.rows.append((t, *(np.atleast_2d(part) for part in (x, v, w)), signs))

    def stacked(self) -> tuple[Any, ...]:
        """Return all of them."""
        return tuple(np.concatenate(parts) for parts in zip(*self.rows, strict=True))


def motion_start(problem: Problem, task: Motion) -> tuple[Setup, Start, Any, Any]:
    """Return what a motion is computed with, its start, free coordinates and their rates.

    Raises
    ------
    InputError, UnavailableError
        What the task asks for is wrong, or friction in motion.
    AssemblyError, InconsistentStartError, InfeasibleMotionError, SingularMassError
        There is no start.
    """
    whole = setup(problem, task)
    begin = start(whole)
    whole.held = {own: float(begin.q[whole.model.places[own]]) for own in idle(whole)}
    whole.meshes = meshes_beside(whole.plain, begin.q, whole.length)
    whole.notes += about_meshes(whole.meshes)
    r = whole.released
    x, v = begin.q[r.free], begin.qd[r.free]
    check_start(whole, begin)
    check_dead_start(whole, x, v)
    whole.kernel.scale(0.0, x, v, whole.loose)
    check_inertia(whole, x, v)
    check_friction(whole, x, v)
    return whole, begin, x, v


def prepared(problem: Problem, task: Motion) -> tuple[Run, Any, Any]:
    """Return a run that has not begun, and what it starts from.

    Raises
    ------
    InputError, SolveError
        As `motion_start`.
    """
    whole, begin, x, v = motion_start(problem, task)
    method = task.method or ("bdf" if whole.smooth else "explicit")
    integrator = Integrator(whole) if method == "explicit" else Bdf(whole, method == "bdf")
    run = Run(whole, begin, integrator, Passages(whole, integrator))
    run.crossings, run.sticking = Crossings(whole, integrator), Sticking(whole, integrator)
    run.stiffness, run.ranges = Stiffness(whole, integrator), Ranges(whole, integrator)
    run.growth, run.lifting = Growth(whole, integrator), Lifting(whole, integrator)
    check_rest(whole, x, v)
    return run, x, v


def motion(problem: Problem, name: str, task: Motion) -> Result:
    """Return the result of a task of motion.

    Raises
    ------
    InputError, SolveError
        As `motion_start`.
    """
    run, x, v = prepared(problem, task)
    observer = _integrated(run, x, v)
    data = {} if task.linearise is None else {"linear": _linear(problem, task)}
    return report(problem, name, task, run, observer, data)


def _linear(problem: Problem, task: Motion) -> dict[str, Any]:
    """Return the linear system at the time asked for: the motion is computed up to there.

    Raises
    ------
    InputError
        A time that the motion does not reach.
    UnavailableError
        Dry friction, or a resistance.
    """
    assert task.linearise is not None
    known = problem.mechanism.parameter_values
    t = evaluate(task.linearise, known)
    end = evaluate(task.until if task.until is not None else (task.at or (0.0,))[-1], known)
    if not 0 <= t <= end:
        raise InputError(f"a time from 0 to {end:g} is needed, not {t:g}", where="linearise")
    at = (t,) if t > 0 else (0.0, end)
    run, x, v = prepared(problem, replace(task, until=None, poses=None, at=at, linearise=None))
    if run.setup.rubbing.feedbacks or run.setup.rubbing.count:
        raise UnavailableError(
            "dry friction and resistances have no linear system: their forces jump",
            where="linearise",
            hint='friction = "none" leaves friction in joints out',
        )
    _integrated(run, x, v)
    states, k = run.states, 0
    if abs(float(states.t[k]) - t) > 1e-12 * end:
        raise InputError(f"the motion ends before t = {t:g}: {run.fault}", where="linearise")
    kernel = run.setup.kernel
    J = np.array(kernel.place(t, states.x[k], states.v[k], run.setup.loose)[1])
    basis = freedoms(J, kernel.sizes)
    names = [c.text for c in start_values(problem.mechanism, task.start, "start")]
    state = State(t, states.x[k], states.v[k], states.a[k], states.lam[k])
    return Linear(run.setup, state, basis, names, task.inputs, task.outputs).told()


def _integrated(run: Run, x: Any, v: Any) -> Observer:
    """Integrate a run and complete its states."""
    whole, integrator = run.setup, run.integrator
    kept = Kept()
    integrate(run, kept, x, v)
    whole.pieces = whole.pieces_at(0.0)
    _keep_last(kept, run)
    if run.ends is not None and run.ends["kind"] == "infeasible":
        _cut(kept, run)
    observer = Observer(whole)
    run.states = observer.complete(_states(whole, integrator, kept, run.undecided[0]))
    if whole.smooth:
        run.creep = Creep(whole)
        run.creep.look(run.states.t, run.states.x, run.states.v)
    run.first_energy = _energy(observer, x, v)
    return observer


def _energy(observer: Observer, x: Any, v: Any) -> float:
    """Return the energy of the start."""
    setup = observer.setup
    rest, signs = np.zeros((1, len(x))), setup.loose[None, :]
    none = np.zeros((1, 0))
    state = States(np.zeros(1), x[None, :], v[None, :], rest, none, none, signs)
    kinetic, stores = observer.energies(state)
    return float(kinetic[0] + sum(own[0] for own in stores.values()))


def integrate(run: Run, kept: Kept, x: Any, v: Any) -> None:
    """Integrate a run from its start; keep the states of output."""
    setup, integrator, sticking = run.setup, run.integrator, run.sticking
    lay, times = integrator.layout, setup.times
    try:
        signs, v = sticking.first(0.0, x, v)
    except NoWay as verdict:
        run.verdict(0.0, verdict)
        signs = setup.loose
    if times is None or times[0] == 0.0:
        kept.add(0.0, x, v, np.zeros(lay.works), signs)
    if run.fault:
        return
    clock = Clock(setup, x, v, run.crossings.expressions)
    state = integrator.first(0.0, x, v, np.zeros(lay.works), signs)
    if clock.begin() > 0:
        state, signs = _resumed(run, state, signs, clock.begin())
    while True:
        if sticking.final(signs, *(lay.of(state, part) for part in ("t", "x", "v"))):
            _rest(run, kept, state, signs)
            return
        turn, stop = None, None
        stretch = clock.stretch(float(lay.of(state, "t")))
        for nodes in integrator.steps(state, signs, stretch.end, stretch.longest):
            turn, lost = sticking.look(nodes), sticking.verdict
            nodes = _until(nodes, None if turn is None else turn.state, lay)
            if lost is not None and (turn is None or lost[0][0] < turn.state[0]):
                nodes, turn = _until(nodes, lost[0], lay), None
                run.verdict(float(lost[0][0]), lost[1])
            stop = run.crossings.look(nodes)
            if stop is not None:
                nodes, turn = _until(nodes, stop.state, lay), None
                run.stopped = stop
            wild = run.growth.look(nodes)
            if wild is not None:
                nodes, turn = _until(nodes, wild, lay), None
                t = float(lay.of(wild, "t"))
                event = {"kind": "unbounded", "code": "S7", "at": t, **(run.growth.found or {})}
                run.end(run.growth.fault(), event)
            run.passages.look(nodes)
            run.stiffness.look(nodes)
            run.ranges.look(nodes)
            run.lifting.look(nodes)
            _keep(kept, nodes, integrator, times)
            run.last = nodes.states[-1]
            if setup.laws:
                run.marks.append((nodes.states[0], nodes.signs))
            run.last_signs = nodes.signs
            if stop is not None or turn is not None or run.fault:
                break
            if nodes.stalled:
                jam = verdict_ahead(sticking, run.last, nodes.signs)
                if jam is not None:
                    run.verdict(float(lay.of(run.last, "t")), jam)
                else:
                    run.end(*stalled(setup, integrator, sticking, run.last, nodes.signs))
        if turn is None:
            if stop is not None or run.fault or stretch.end >= setup.end:
                return
            state = state if run.last is None else run.last
            if stretch.bends:
                fault = clock.impact(stretch)
                if fault is not None:
                    t = stretch.end
                    run.end(fault, {"kind": "impact", "code": "S9", "at": t, "time": t})
                    return
                state, signs = _resumed(run, state, signs, stretch.resume)
            continue
        after = turn.state
        t = float(lay.of(after, "t"))
        x, v, w = (after[lay[part]] for part in ("x", "v", "w"))
        try:
            signs, v = sticking.settled(t, x, v, sticking.sides(signs), turn)
        except NoWay as verdict:
            run.verdict(t, verdict)
            return
        sticking.note(t, turn, signs)
        recent = [entry for entry in sticking.found if t - entry[0] <= CLOSE * setup.end]
        if len(recent) >= CROWD:
            owners = ", ".join(dict.fromkeys(entry[1] for entry in recent))
            fault = (
                f"{CROWD} events of dry friction (F4) of {owners} within "
                f"{CLOSE * setup.end:.2g} s before t = {t:.9g} s: the motion does not go on"
            )
            event = {"kind": "chatter", "code": "F4", "at": t, "time": t, "count": len(recent)}
            run.end(fault, event | {"joints": list(dict.fromkeys(own[1] for own in recent))})
            return
        h = float(after[lay["h"]][0])
        state = integrator.first(t, x, v, w, signs, h)
        trials = after[lay["trials"]]
        state[lay["trials"]] = trials


def _resumed(run: Run, state: Any, signs: Any, t: float) -> tuple[Any, Any]:
    """Return the state and the inputs of friction right behind a breakpoint."""
    integrator, lay = run.integrator, run.integrator.layout
    run.setup.pieces = run.setup.pieces_at(t)
    signs = run.sticking.resumed(signs)
    x, v, w = (state[lay[part]] for part in ("x", "v", "w"))
    found = integrator.first(t, x, v, w, signs, float(lay.of(state, "h")))
    found[lay["trials"]] = state[lay["trials"]]
    return found, signs


def _rest(run: Run, kept: Kept, state: Any, signs: Any) -> None:
    """Keep the states of a mechanism that rests until the end."""
    setup, lay = run.setup, run.integrator.layout
    last = state.copy()
    last[lay["t"]] = setup.end
    run.last, run.last_signs = last, signs
    run.rests = float(lay.of(state, "t"))
    start = run.rests if run.rests > 0 else -1.0
    times = np.array([setup.end]) if setup.times is None else setup.times
    ahead = times[times > max(start, kept.rows[-1][0][-1] if kept.rows else -1.0)]
    if len(ahead):
        x, v, w = (np.tile(state[lay[part]], (len(ahead), 1)) for part in ("x", "v", "w"))
        kept.add(ahead, x, v, w, signs)


def _until(nodes: Nodes, state: Any, lay: Any) -> Nodes:
    """Return the accepted steps up to a state inside one of them."""
    if state is None:
        return nodes
    before = nodes.states[:, lay["t"]][:, 0] < state[lay["t"]][0]
    states = np.vstack([nodes.states[before], state[None, :]])
    return Nodes(states, nodes.signs)


def _keep(kept: Kept, nodes: Nodes, integrator: Integrator, times: Any) -> None:
    """Keep the states of output inside accepted steps."""
    lay, states = integrator.layout, nodes.states
    if len(states) < 2:
        return
    first, last = float(lay.of(states[0], "t")), float(lay.of(states[-1], "t"))
    if times is None:
        own = states[1:]
        t, x, v, w = (lay.of(own, part) for part in ("t", "x", "v", "w"))
        kept.add(t, x, v, w, nodes.signs)
        return
    inside = times[(times > first) & (times <= last)]
    if len(inside):
        kept.add(inside, *integrator.between(nodes, inside), nodes.signs)


def _keep_last(kept: Kept, run: Run) -> None:
    """Keep the state at which a motion ended early, where it was no time of output."""
    if run.last is None:
        return
    lay = run.integrator.layout
    t, x, v, w = (lay.of(run.last, part) for part in ("t", "x", "v", "w"))
    if t < run.setup.end and (not kept.rows or kept.rows[-1][0][-1] < t):
        kept.add(t, x, v, w, run.last_signs)


def _cut(kept: Kept, run: Run) -> None:
    """Drop the last states whose speeds do not meet the constraints: a dead point was passed."""
    setup, lay = run.setup, run.integrator.layout
    while kept.rows:
        t, x, v, w, signs = kept.rows.pop()
        good = np.logical_and.accumulate(feasible(setup, t, x, v, signs))
        if good.any():
            kept.rows.append((t[good], x[good], v[good], w[good], signs[good]))
            break
    for state, signs in reversed(run.marks):
        t, x, v, w = (lay.of(state, part) for part in ("t", "x", "v", "w"))
        if kept.rows and kept.rows[-1][0][-1] >= t:
            break
        if feasible(setup, t[None], x[None], v[None], signs[None])[0]:
            kept.add(t, x, v, w, signs)
            break
    run.last = run.last.copy()
    for name, part in zip("txvw", kept.rows[-1], strict=False):
        run.last[lay[name]] = part[-1]


def _states(setup: Setup, integrator: Integrator, kept: Kept, undecided: float) -> States:
    """Return the states of output with accelerations and multipliers computed again.

    Those at the time ``undecided`` have none.
    """
    if not kept.rows:
        raise InputError("no time of output was reached", where="at")
    t, x, v, w, signs = kept.stacked()
    a, lam = np.empty_like(x), np.empty((len(t), setup.kernel.inner))
    lost = t == undecided
    a[lost], lam[lost] = np.nan, np.nan
    rest = np.flatnonzero(~lost)
    while len(rest):
        same = (signs[rest] == signs[rest[0]]).all(axis=1)
        rows = rest[same]
        a[rows], lam[rows] = integrator.rates(t[rows, None], x[rows], v[rows], signs[rows[0]])
        rest = rest[~same]
    integrator.rhs += len(t)
    if setup.smooth:
        kernel: Any = setup.kernel
        smooth = Batch(kernel.sides, [], straight=lambda: None)
        signs = signs.copy()
        signs[:, : setup.rubbing.count] = smooth(t[:, None], x, v, signs)[0]
    return States(t, x, v, a, lam, w, signs)
