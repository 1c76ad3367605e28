"""A task of motion from start to result."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np

from mechdae.describe.expression import evaluate
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.motion import Motion, start_values
from mechdae.dynamics.bdf import Automatic, Cvodes, Radau
from mechdae.dynamics.endings import check_dead_start, feasible
from mechdae.dynamics.equations import MotionProblem, idle, rubbing, setup
from mechdae.dynamics.friction_sizes import Creep
from mechdae.dynamics.integrate import DormandPrince, Integrator
from mechdae.dynamics.output_values import Observer, States, alike
from mechdae.dynamics.report import report
from mechdae.dynamics.rest.linear_system import LinearisedState, LinearSystem
from mechdae.dynamics.run import MotionRun, OutputStates, integrate
from mechdae.dynamics.start import Start, start
from mechdae.equations.forces.generalised import MeshForces
from mechdae.equations.motion_equations import row_size
from mechdae.errors import (
    InconsistentStartError,
    IndeterminateFrictionError,
    InputError,
    MechanismError,
    SingularMassError,
    SolveError,
    UnavailableError,
)
from mechdae.kernels.run.functions import Call
from mechdae.numerics.null_space import dependences, rank, unit_rows
from mechdae.results import MotionResult
from mechdae.types import Floats, Graph, Json, Unknowns

SX = ca.SX
CLOSED = 1e-9
MASSLESS = 1e-12
"""Least eigenvalue of the scaled mass matrix along the freedoms that counts as inertia."""
ASIDE = 1e-2
"""Way along the freedoms, over natural sizes, to the pose where a rank is looked at again."""
DEFICIENT = 1e-4
"""Singular value, over the largest, that the right-hand side takes for none at a start."""
OPEN = 1e-6
"""Share of the accelerations by which redundant equations may contradict each other."""
INTEGRATORS: dict[str, type[Integrator]] = {
    "explicit": DormandPrince,
    "bdf": Cvodes,
    "radau": Radau,
    "auto": Automatic,
}


def check_start(setup: MotionProblem, begin: Start) -> None:
    """Raise for equations without a coordinate that do not hold, and laws that fight joints."""
    r = setup.released

    def build() -> Call:
        rows = ca.vertcat(*[row.expression for row in r.rows]) if r.rows else ca.SX(0, 1)
        inputs = [r.model.q, r.t, r.signs, r.model.p]
        return Call(ca.Function("rows", inputs, [ca.densify(rows)]))

    values = r.cache("rows", build)(begin.q, 0.0, setup.loose, setup.model.p_values)[0]
    sizes = np.array([row_size(row.unit, setup.length) for row in r.rows])
    left = {
        row.name: float(value)
        for row, value, size in zip(r.rows, values, sizes, strict=True)
        if abs(value) > (CLOSED + setup.closure) * size
    }
    if left:
        listed = ", ".join(f"{name} {value:.3g}" for name, value in list(left.items())[:6])
        error = InconsistentStartError(
            f"the constraints do not hold together at t = 0; what is left: {listed}",
            where="start",
            hint="a law of time must begin where the start is",
        )
        error.residuals = left
        raise error
    if r.residue.numel():
        moving = [e for e in ca.symvar(r.residue) if e.element_hash() == r.t.element_hash()]
        if moving:
            owners = ", ".join(dict.fromkeys(r.rows[i].owner for i in r.empty))
            raise InconsistentStartError(
                f"laws of time leave no freedom to {owners}: too many coordinates are driven",
                where="drivers",
                hint="drive fewer coordinates",
            )


def check_inertia(setup: MotionProblem, x: Unknowns, v: Floats) -> None:
    """Raise for freedoms without inertia."""
    k = setup.kernel
    signs = setup.loose
    M, f, J, _ = k.value("parts", 0.0, x, v, signs)
    if not np.isfinite(f).all() or not np.isfinite(M).all():
        loads = ", ".join(setup.loads.wrenches)
        raise SolveError(
            f"forces are not finite at the start: {loads}", where="loads", hint="check the values"
        )
    basis = setup.freedoms(J)
    if not basis.shape[1]:
        return
    scaled = M * np.outer(k.sizes, k.sizes)
    along = basis.T @ scaled @ basis
    values, vectors = np.linalg.eigh(along)
    largest = max(float(values[-1]), float(np.trace(scaled)), 0.0)
    if values[0] > MASSLESS * largest:
        return
    direction = np.abs(basis @ vectors[:, 0])
    chosen = [
        ".".join(c.key)
        for c, share in zip(k.released.coordinates, direction, strict=True)
        if share > 0.1 * direction.max()
    ]
    raise SingularMassError(
        f"nothing that moves with {', '.join(chosen)} has a mass or a moment of inertia, and no "
        "constraint holds it: its acceleration is not determined (S5)",
        where="bodies",
        hint="give mass and inertia to these bodies, or a driver",
    )


def check_friction(setup: MotionProblem, x: Unknowns, v: Floats) -> None:
    """Raise for friction on forces that redundant equations leave open.

    Multipliers that balance without any load must not press where there is friction, at the
    start and at a pose beside it: a singular pose alone decides nothing.
    """
    k, r = setup.kernel, setup.released
    if not k.rubs or not r.rows:
        return

    def gradient() -> Graph:
        rows = ca.vertcat(*[row.expression for row in r.rows])
        found = SX(ca.jacobian(rows, r.model.q))
        for i, row in enumerate(r.rows):
            mesh = None if row.driver else r.rubbing.meshes.get(row.owner)
            if mesh is not None and mesh.column is not None:
                found[i, :] = r.stack(mesh.column).T
        forms = [r.pressing(feedback) for feedback in r.rubbing.feedbacks]
        return k.function("gradient", [ca.densify(part) for part in (r.moved(found), *forms)])

    J = k.value("place", 0.0, x, v, setup.loose)[1]
    aside = x + ASIDE * k.sizes * setup.freedoms(J).sum(axis=1)
    for _ in range(4):
        aside = k.value("project", 0.0, aside, v, setup.loose)[0].ravel()
    sizes = r.model.coordinates.sizes(setup.length)
    common: set[str] | None = None
    for place in (x, aside):
        G, *forms = k.call("gradient", gradient)(0.0, place, v, setup.loose)
        G = np.reshape(G, (len(r.rows), -1), order="F") * sizes
        stress = dependences(G) / unit_rows(G)[1]
        found = set()
        for feedback, form in zip(r.rubbing.feedbacks, forms, strict=True):
            if not feedback.friction:
                continue
            pressed = np.reshape(form, (-1, len(r.rows)), order="F") @ stress
            size = np.abs(stress).max(initial=0.0)
            idle = feedback.idle(r.model.p, setup.model.p_values)
            if pressed.size and np.abs(pressed).max() > OPEN * size and not idle:
                found.add(feedback.joint)
        common = found if common is None else common & found
    if common:
        joints = ", ".join(name for name in r.model.mechanism.joints if name in common)
        raise IndeterminateFrictionError(
            f"redundant equations leave the forces open that press on {joints}: friction (F3) "
            "that follows from them is not determined",
            where=f"joints.{sorted(common)[0]}.friction",
            hint="take away what holds twice, or the friction there",
        )


def check_rest(setup: MotionProblem, x: Unknowns, v: Floats) -> None:
    """Raise where redundant equations contradict each other in their accelerations.

    J x'' = gamma is a question of the pose, the speeds and the laws alone: forces are not asked.
    What no acceleration meets is the part of gamma across the image of J.
    """
    k, r = setup.kernel, setup.released
    if not k.m:
        return
    bias = k.call("bias", lambda: k.function("bias", [ca.densify(r.bias)]))
    _, _, J, gamma = k.value("parts", 0.0, x, v, setup.loose)
    turned = bias(0.0, x, v, setup.loose)[0]
    lengths = r.model.coordinates.sizes(setup.length)
    left, sigma, _ = np.linalg.svd(J * k.sizes / k.gaps[:, None])
    wanted = gamma.ravel() / k.gaps
    independent = left[:, : rank(sigma, DEFICIENT)]
    rest = wanted - independent @ (independent.T @ wanted)
    size = max(
        float(np.max(np.abs(wanted), initial=0.0)),
        float(np.max(np.abs(turned / lengths), initial=0.0)),
        float(np.max(np.abs(v / k.sizes), initial=0.0)) ** 2,
    )
    if not np.isfinite(rest).all() or np.max(np.abs(rest)) > OPEN * size:
        names = [r.rows[i].name for i in r.left]
        found = dict(zip(names, (rest * k.gaps).tolist(), strict=True))
        worst = max(found, key=lambda name: abs(found[name]))
        error = InconsistentStartError(
            "the pose is singular and the speeds do not fit it: no accelerations meet the "
            f"constraints, {worst} is left with {found[worst]:.3g}",
            where="start",
            hint="start at another pose, or with other speeds",
        )
        error.residuals = found
        raise error


def motion_start(problem: Problem, task: Motion) -> tuple[MotionProblem, Start, Floats, Floats]:
    """Return what a motion is computed with, its start, free coordinates and their rates."""
    whole = setup(problem, task)
    starts = whole.model.cases("starts in gaps") if whole.model.opened else [start]
    begin = starts[0](whole)
    whole.held = {key: float(begin.q[whole.model.places[key]]) for key in idle(whole)}
    whole.meshes = _meshes(whole, begin)
    for case in whole.model.cases("forces of joints"):
        whole.notes += case.about_meshes(whole.meshes, problem.mechanism)
    whole.notes += whole.model.left_out
    r = whole.released
    x, v = begin.q[r.free], begin.qd[r.free]
    check_start(whole, begin)
    check_dead_start(whole, x, v)
    whole.kernel.scale(0.0, x, v, whole.loose)
    check_inertia(whole, x, v)
    check_friction(whole, x, v)
    return whole, begin, x, v


def _meshes(whole: MotionProblem, begin: Start) -> dict[str, MeshForces]:
    """Return gears, racks and belts with the forces of their teeth."""
    found: dict[str, MeshForces] = {}
    try:
        for case in whole.model.cases("forces of joints") if whole.model.mesh_names else ():
            found |= case.meshes_beside(whole.plain, whole.model, begin.q, whole.length)
    except (MechanismError, UnavailableError) as error:
        if rubbing(whole.problem.mechanism, whole.task):
            raise
        wheels = ", ".join(whole.model.mesh_names)
        whole.notes.append(f"no forces of teeth of {wheels} and no reactions are given: {error}")
    return found


def prepared(problem: Problem, task: Motion) -> tuple[MotionRun, Floats, Floats]:
    """Return a run that has not begun, and what it starts from."""
    whole, begin, x, v = motion_start(problem, task)
    method = task.method or ("bdf" if whole.smooth else "explicit")
    integrator = INTEGRATORS[method](whole)
    run = MotionRun(whole, begin, integrator)
    check_rest(whole, x, v)
    return run, x, v


def motion(problem: Problem, name: str, task: Motion) -> MotionResult:
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
    if run.setup.released.locked(states.signs)[k].any():
        raise UnavailableError(
            "a contact is closed then: it has no linear system", where="linearise"
        )
    kernel = run.setup.kernel
    J = kernel.value("place", t, states.x[k], states.v[k], run.setup.loose)[1]
    basis = run.setup.freedoms(J)
    names = [c.text for c in start_values(problem.mechanism, task.start, "start")]
    state = LinearisedState(t, states.x[k], states.v[k], states.a[k], states.lam[k])
    return LinearSystem(run.setup, state, basis, names, task.inputs, task.outputs).told()


def _integrated(run: MotionRun, x: Unknowns, v: Floats) -> Observer:
    """Integrate a run and complete its states."""
    whole, integrator = run.setup, run.integrator
    recorded = OutputStates()
    integrate(run, recorded, x, v)
    whole.pieces = whole.pieces_at(0.0)
    _keep_last(recorded, run)
    if run.ends is not None and run.ends["kind"] == "infeasible":
        _cut(recorded, run)
    observer = Observer(whole)
    run.states = observer.complete(_states(whole, integrator, recorded, run.undecided[0]))
    if whole.smooth:
        run.creep = Creep(whole)
        run.creep.look(run.states.t, run.states.x, run.states.v)
    run.first_energy = _energy(observer, x, v)
    return observer


def _energy(observer: Observer, x: Unknowns, v: Floats) -> float:
    setup = observer.setup
    rest, signs = np.zeros((1, len(x))), setup.loose[None, :]
    none = np.zeros((1, 0))
    state = States(np.zeros(1), x[None, :], v[None, :], rest, none, none, signs)
    kinetic, stores = observer.energies(state)
    return float(kinetic[0] + sum(store[0] for store in stores.values()))


def _keep_last(recorded: OutputStates, run: MotionRun) -> None:
    """Keep the state at which a motion ended early, where it was no time of output."""
    if run.last is None:
        return
    lay = run.integrator.layout
    t, x, v, w = (lay.of(run.last, part) for part in ("t", "x", "v", "w"))
    if t < run.setup.end and (not recorded.rows or recorded.rows[-1][0][-1] < t):
        recorded.add(t, x, v, w, run.last_signs)


def _cut(recorded: OutputStates, run: MotionRun) -> None:
    """Drop the last states whose speeds do not meet the constraints: a dead point was passed."""
    setup, lay = run.setup, run.integrator.layout
    while recorded.rows:
        t, x, v, w, signs = recorded.rows.pop()
        good = np.logical_and.accumulate(feasible(setup, t, x, v, signs))
        if good.any():
            recorded.rows.append((t[good], x[good], v[good], w[good], signs[good]))
            break
    for state, signs in reversed(run.marks):
        t, x, v, w = (lay.of(state, part) for part in ("t", "x", "v", "w"))
        if recorded.rows and recorded.rows[-1][0][-1] >= t:
            break
        if feasible(setup, t[None], x[None], v[None], signs[None])[0]:
            recorded.add(t, x, v, w, signs)
            break
    run.last = run.last.copy()
    for name, part in zip("txvw", recorded.rows[-1], strict=False):
        run.last[lay[name]] = part[-1]


def _states(
    setup: MotionProblem, integrator: Integrator, recorded: OutputStates, undecided: float
) -> States:
    """Return the states of output with accelerations and multipliers computed again."""
    if not recorded.rows:
        raise InputError("no time of output was reached", where="at")
    t, x, v, w, signs = recorded.stacked()
    a, lam = np.empty_like(x), np.empty((len(t), setup.kernel.inner))
    lost = t == undecided
    a[lost], lam[lost] = np.nan, np.nan
    for pattern, rows in alike(signs, np.flatnonzero(~lost)):
        a[rows], lam[rows] = integrator.rates(t[rows, None], x[rows], v[rows], pattern)
    integrator.rhs += len(t)
    return States(t, x, v, a, lam, w, setup.sided(t[:, None], x, v, signs))
