"""A task of motion from start to result."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechdae.describe.expression import evaluate
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.motion import Motion, start_values
from mechdae.dynamics.bdf import Automatic, Cvodes, Radau
from mechdae.dynamics.checks import check_friction, check_inertia, check_rest, check_start
from mechdae.dynamics.creep import Creep
from mechdae.dynamics.endings import check_dead_start, feasible
from mechdae.dynamics.equations import MotionProblem, idle, rubbing, setup
from mechdae.dynamics.integrate import DormandPrince, Integrator
from mechdae.dynamics.observe import Observer, States, alike
from mechdae.dynamics.report import report
from mechdae.dynamics.rest.linear_system import LinearisedState, LinearSystem
from mechdae.dynamics.run import MotionRun, OutputStates, integrate
from mechdae.dynamics.start import Start, start
from mechdae.equations.forces.meshes import Mesh
from mechdae.equations.forces.spatial_meshes import SpatialMesh
from mechdae.errors import InputError, MechanismError, UnavailableError
from mechdae.forces.meshes import about_meshes, meshed, meshes_beside
from mechdae.results import Result
from mechdae.types import Floats, Json, Unknowns

INTEGRATORS: dict[str, type[Integrator]] = {
    "explicit": DormandPrince,
    "bdf": Cvodes,
    "radau": Radau,
    "auto": Automatic,
}


def motion_start(problem: Problem, task: Motion) -> tuple[MotionProblem, Start, Floats, Floats]:
    """Return what a motion is computed with, its start, free coordinates and their rates."""
    whole = setup(problem, task)
    begin = start(whole)
    whole.held = {key: float(begin.q[whole.model.places[key]]) for key in idle(whole)}
    whole.meshes = _meshes(whole, begin)
    assumed = about_meshes(whole.meshes, problem.mechanism)
    whole.notes += [*assumed, *whole.model.left_out]
    r = whole.released
    x, v = begin.q[r.free], begin.qd[r.free]
    check_start(whole, begin)
    check_dead_start(whole, x, v)
    whole.kernel.scale(0.0, x, v, whole.loose)
    check_inertia(whole, x, v)
    check_friction(whole, x, v)
    return whole, begin, x, v


def _meshes(whole: MotionProblem, begin: Start) -> dict[str, Mesh | SpatialMesh]:
    """Return gears, racks and belts with the forces of their teeth.

    Without friction the teeth of those in space may have no place: a note says so.
    """
    try:
        return meshes_beside(whole.plain, whole.model, begin.q, whole.length)
    except (MechanismError, UnavailableError) as error:
        if rubbing(whole.problem.mechanism, whole.task):
            raise
        wheels = ", ".join(meshed(whole.model))
        whole.notes.append(f"no forces of teeth of {wheels} and no reactions are given: {error}")
        return {}


def prepared(problem: Problem, task: Motion) -> tuple[MotionRun, Floats, Floats]:
    """Return a run that has not begun, and what it starts from."""
    whole, begin, x, v = motion_start(problem, task)
    method = task.method or ("bdf" if whole.smooth else "explicit")
    integrator = INTEGRATORS[method](whole)
    run = MotionRun(whole, begin, integrator)
    check_rest(whole, x, v)
    return run, x, v


def motion(problem: Problem, name: str, task: Motion) -> Result:
    """Return the result of a task of motion."""
    run, x, v = prepared(problem, task)
    observer = _integrated(run, x, v)
    data = {} if task.linearise is None else {"linear": _linear(problem, task)}
    return report(problem, name, task, run, observer, data)


def _linear(problem: Problem, task: Motion) -> Json:
    """Return the linear system at the time asked for: the motion is computed up to there."""
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
    J = kernel.value("place", t, states.x[k], states.v[k], run.setup.loose)[1]
    basis = run.setup.freedoms(J)
    names = [c.text for c in start_values(problem.mechanism, task.start, "start")]
    state = LinearisedState(t, states.x[k], states.v[k], states.a[k], states.lam[k])
    return LinearSystem(run.setup, state, basis, names, task.inputs, task.outputs).told()


def _integrated(run: MotionRun, x: Unknowns, v: Floats) -> Observer:
    """Integrate a run and complete its states."""
    whole, integrator = run.setup, run.integrator
    kept = OutputStates()
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


def _energy(observer: Observer, x: Unknowns, v: Floats) -> float:
    """Return the energy of the start."""
    setup = observer.setup
    rest, signs = np.zeros((1, len(x))), setup.loose[None, :]
    none = np.zeros((1, 0))
    state = States(np.zeros(1), x[None, :], v[None, :], rest, none, none, signs)
    kinetic, stores = observer.energies(state)
    return float(kinetic[0] + sum(store[0] for store in stores.values()))


def _keep_last(kept: OutputStates, run: MotionRun) -> None:
    """Keep the state at which a motion ended early, where it was no time of output."""
    if run.last is None:
        return
    lay = run.integrator.layout
    t, x, v, w = (lay.of(run.last, part) for part in ("t", "x", "v", "w"))
    if t < run.setup.end and (not kept.rows or kept.rows[-1][0][-1] < t):
        kept.add(t, x, v, w, run.last_signs)


def _cut(kept: OutputStates, run: MotionRun) -> None:
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


def _states(
    setup: MotionProblem, integrator: Integrator, kept: OutputStates, undecided: float
) -> States:
    """Return the states of output with accelerations and multipliers computed again.

    Those at the time ``undecided`` have none.
    """
    if not kept.rows:
        raise InputError("no time of output was reached", where="at")
    t, x, v, w, signs = kept.stacked()
    a, lam = np.empty_like(x), np.empty((len(t), setup.kernel.inner))
    lost = t == undecided
    a[lost], lam[lost] = np.nan, np.nan
    for pattern, rows in alike(signs, np.flatnonzero(~lost)):
        a[rows], lam[rows] = integrator.rates(t[rows, None], x[rows], v[rows], pattern)
    integrator.rhs += len(t)
    return States(t, x, v, a, lam, w, setup.sided(t[:, None], x, v, signs))
