"""From the states of a motion to a result."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.assumed import about_motion
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.motion import Motion, start_values
from mechdae.dynamics.output_values import Observer, Reported, States
from mechdae.dynamics.rest.chart import Chart
from mechdae.dynamics.run import MotionRun
from mechdae.dynamics.unique import Determined
from mechdae.errors import InputError
from mechdae.results import (
    Event,
    LazyPart,
    MotionResult,
    Named,
    Series,
    Status,
    Summary,
    motion_event,
    statuses,
)
from mechdae.types import Floats, Sym

SX = ca.SX
MOST = 48
"""States that are looked at."""
BALANCED = 1e-3
"""Gap of the energy balance, over the energies that move, that is a fault."""
ROUNDED = 1e-9
"""Share of the energies stored, and of loads times a length, below which energies do not move."""
CORRECTED = 1e-9
EQUAL = 1e-6
"""What may be left of Lagrange's equations."""


def left_over(observer: Observer, s: States) -> float:
    """Return the largest gap of Lagrange's equations over the largest term or load."""
    r, k = observer.r, observer.kernel
    there = np.flatnonzero(np.isfinite(s.a).all(axis=1))
    if not len(there) or not k.n:
        return 0.0
    chosen = there[np.linspace(0, len(there) - 1, min(MOST, len(there))).astype(int)]

    def build() -> tuple[list[Sym], list[Sym]]:
        a, inner = SX.sym("a", r.x.numel()), SX.sym("inner", k.inner)
        momentum = ca.gradient(r.kinetic, r.v)
        at, along = ca.vertcat(r.x, r.v, r.t), ca.vertcat(r.v, a, SX(1))
        rate = ca.jtimes(momentum, at, along)
        applied = r.applied
        if k.slips:
            applied = applied - r.held_back @ inner[k.m : k.m + k.slips]
        if k.rubs:
            applied = applied + r.rubbed @ inner[k.m + k.slips :]
        parts = [rate, ca.gradient(r.kinetic, r.x), r.V.T @ applied, ca.vec(ca.densify(r.J))]
        return parts, [a, inner]

    inner = np.zeros((len(s.t), k.inner))
    inner[:, : s.lam.shape[1]] = s.lam
    states = [part[chosen] for part in (s.t[:, None], s.x, s.v, s.signs, s.a, inner)]
    rate, slope, force, J = observer.many("lagrange", build)(*states)
    worst, sizes = 0.0, observer.loads(s)
    for i in range(len(chosen)):
        Z = observer.setup.freedoms(J[i].reshape(k.m, k.n, order="F"))
        terms = [part[i] * k.sizes for part in (rate, slope, force)]
        gap = Z.T @ (terms[0] - terms[1] - terms[2])
        worst = max(worst, float(np.max(np.abs(gap), initial=0.0)))
        sizes = max(sizes, *(float(np.max(np.abs(part))) for part in terms))
    return worst / sizes if sizes > 0 else 0.0


def report(
    problem: Problem,
    name: str,
    task: Motion,
    run: MotionRun,
    observer: Observer,
    data: dict[str, Any],
) -> MotionResult:
    setup, states = run.setup, run.states
    q, v, a = observer.absolute(states)
    forces = Determined(observer, states, q)
    there = np.isfinite(run.states.a).all(axis=1)
    for lifting in run.lifting if there.any() else ():
        names = lifting.contacts.names
        open_ = {n for n in names if np.isnan(forces.reactions[n][there]).any(axis=1).all()}
        lifting.leave_out(open_)
    shown = _Shown(task, run, (q, v, a), forces)
    scalars, work, balance = _energies(run, observer)
    drift, rates = observer.gaps(states, q, v)
    scalars["drift"] = drift
    status = statuses(len(shown.there))
    status[~shown.there] = Status.SINGULAR
    status[states.t == run.undecided[0]] = run.undecided[1]
    summary = _summary(run, drift, rates)
    summary["status"] = {
        word: status.tolist().count(word) for word in dict.fromkeys(status.tolist())
    }
    summary["state"], forced = shown.last()
    notes = _notes(run, shown.notes), [] if run.creep is None else run.creep.notes()
    note = forces.summary(forced, summary["superfluous_equations"], *notes)
    summary |= dict.fromkeys(("multipliers", "not_unique", "unique_sums", "redundant"), note)
    if run.creep is not None:
        summary["creep"] = run.creep.found
    summary["notes"] = note
    sticking = [] if setup.smooth else [slip.owner for slip in setup.rubbing.slips]
    if assumed := about_motion(setup.problem.mechanism, sticking):
        summary["assumptions"] = assumed
    summary |= dict.fromkeys(("mode", "mode_coordinates"), _mode(task, run))
    faults = [run.fault] if run.fault else []
    for passed in setup.model.cases("passed stops"):
        over, sentences = passed(setup.model, q, rebound=True)
        status[over & shown.there] = Status.STOPPED
        hint = "without a restitution nothing rebounds"
        faults += [
            f"{text}, first at t = {states.t[n]:.6g} s: {hint}" for text, n in sentences.items()
        ]
    for case in setup.model.cases("forces of joints"):
        faults += case.slack_belts(
            setup.model,
            setup.meshes,
            lambda joint: forces.reactions[joint][:, 2],
            lambda slack: f", first at t = {states.t[int(np.argmax(slack))]:.6g} s",
        )
    checks = {"energy": balance}
    if setup.model.space.behind:
        checks["balance"] = left_over(observer, states)
    faults += _faults(run, checks)
    return MotionResult.of(
        problem,
        name,
        task,
        status=status,
        events=_events(run),
        checks=checks,
        summary=Summary(summary),
        fault="; ".join(faults) or None,
        data=data,
        time=states.t,
        efforts=forces.efforts(),
        scalars=Series(scalars),
        work=Series(work),
        unique=forces.unique(),
        **shown.tables,
    )


def _mode(task: Motion, run: MotionRun) -> LazyPart:
    """Return the assembly mode that the motion starts on, and the coordinates that tell it."""
    setup, x = run.setup, run.begin.q[run.setup.released.free]

    def told() -> dict[str, Any]:
        kernel = setup.kernel
        if not kernel.m:
            return {"mode": "", "mode_coordinates": []}
        J = kernel.value("place", 0.0, x, np.zeros(len(x)), setup.loose)[1]
        names = start_values(setup.problem.mechanism, task.start, "start")
        try:
            chart = Chart(setup, x, setup.freedoms(J), [c.text for c in names])
        except InputError:
            return {"mode": None, "mode_coordinates": []}
        return {"mode": chart.label(x), "mode_coordinates": chart.names}

    return LazyPart(told)


class _Shown:
    """Bodies, points, joints and named outputs of a motion at its states."""

    def __init__(
        self, task: Motion, run: MotionRun, coordinates: tuple[Any, Any, Any], forces: Determined
    ) -> None:
        states = run.states
        self._reported = reported = Reported(run.setup, task.outputs, moves=True)
        self.there = np.isfinite(coordinates[0]).all(axis=1)
        self.tables, series = reported.evaluate(coordinates, states.t, self.there)
        if reported.forced:
            efforts = forces.efforts()
            series |= reported.of_forces(coordinates, states.t, forces.reactions, efforts)
        self.notes, self._series = reported.notes, series
        order = [name for name in reported.chosen.named if name in series]
        self.tables["outputs"] = Named("output", {name: Series(series[name]) for name in order})
        joints = self.tables["joints"]
        contacts = [touching.series(states, forces) for touching in run.touching]
        self.tables["joints"] = reported.with_reactions(joints, forces.series(), *contacts)

    def last(self) -> tuple[dict[str, list[float]], dict[str, float]]:
        """Return value and rate of the outputs at the end, and values of those of forces."""
        forced = self._reported.forced
        names = [name for name in self.tables["outputs"] if name not in forced]
        state = {
            name: [float(self._series[name].get(word, [np.nan])[-1]) for word in ("value", "rate")]
            for name in names
        }
        return state, {name: float(self._series[name]["value"][-1]) for name in forced}


def _notes(run: MotionRun, of_outputs: list[str]) -> list[str]:
    """Return what there is to say beside what forces have to."""
    setup = run.setup
    notes = setup.notes + setup.rubbing.assumptions + of_outputs
    notes += run.stiffness.notes()
    for lifting in run.lifting:
        notes += lifting.notes()
    for touching in run.touching:
        notes += touching.notes()
    notes += run.sticking.sizes.notes.values()
    if run.begin.correction > CORRECTED:
        notes.append(
            f"the numbers of the start were corrected by up to {run.begin.correction:.2g} "
            "of their natural size to meet the constraints"
        )
    if setup.held:
        idle = ", ".join(".".join(key) for key in setup.held)
        notes.append(f"nothing moves {idle}: kept as they are in the sketch")
    return notes


def _energies(
    run: MotionRun, observer: Observer
) -> tuple[dict[str, Floats], dict[str, Floats], float]:
    """Return energies, works by load, and the gap of their balance over the energies that move."""
    states = run.states
    kinetic, stores = observer.energies(states)
    potential = sum(stores.values(), np.zeros_like(kinetic))
    energy = kinetic + potential
    work = {name: states.w[:, k] for k, name in enumerate(run.setup.works)}
    done = sum(work.values(), np.zeros_like(kinetic))
    size = max(
        float(np.max(kinetic)),
        *(float(np.ptp(energies)) for energies in (potential, done)),
        *(float(np.max(np.abs(done_by_one))) for done_by_one in work.values()),
    )
    gap = energy - run.first_energy - done
    balance = float(np.max(np.abs(gap))) / size if size > 0 else 0.0
    if balance > BALANCED:  # of a mechanism at rest, rounding is all that moves
        stored = sum(float(np.max(np.abs(store))) for store in stores.values())
        size = max(size, ROUNDED * (stored + observer.loads(states)))
        balance = float(np.max(np.abs(gap))) / size
    return {"energy": energy, "kinetic": kinetic, "potential": potential}, work, balance


def _summary(run: MotionRun, drift: Any, rates: Any) -> dict[str, Any]:
    setup, work, r = run.setup, run.integrator, run.setup.released
    return {
        "poses": len(run.states.t),
        "end": float(run.last[0]) if run.last is not None else 0.0,
        "tolerance": setup.tolerance,
        "coordinates": len(r.coordinates),
        "constraints": len(r.left),
        "eliminated": len(r.gone),
        "freedoms": len(r.coordinates) - len(r.left) + run.passages.superfluous,
        "superfluous_equations": run.passages.superfluous + len(r.empty),
        "steps": work.accepted,
        "rejected": work.rejected,
        "rhs": work.rhs,
        "drift": float(np.max(drift, initial=0.0)),
        "drift_of_speeds": float(np.max(rates, initial=0.0)),
        "singular": len(run.passages.found),
        "method": work.name,
        "bound": "estimated",
        **({} if run.rests is None else {"rests_from": run.rests}),
        "not_in_scene": [],
    }


def _events(run: MotionRun) -> tuple[Event, ...]:
    lay = run.integrator.layout
    found = [
        motion_event("singular", t, code="S1", rank_drop=drop) for t, drop in run.passages.found
    ]
    for met in run.crossings.found:
        crossing, direction = met.crossing, "up" if met.rises else "down"
        parts = {"name": crossing.name, "of": crossing.coordinate, "value": crossing.crosses}
        t = float(lay.of(met.state, "t"))
        found.append(motion_event("crossing", t, **parts, direction=direction))
    loads = run.setup.problem.mechanism.loads
    for t, signs, kind in run.sticking.found:
        (name, sign), *more = signs.items()
        who: dict[str, object] = {"load" if name in loads else "joint": name, "sign": sign}
        who |= {"group": list(signs), "signs": list(signs.values())} if more else {}
        found.append(motion_event(kind, t, **who))
    found += run.stiffness.events()
    for lifting in run.lifting:
        found += lifting.events()
    for touching in run.touching:
        found += touching.found
    found += [run.ends] if run.ends is not None else []
    return tuple(sorted(found, key=lambda event: float(event["at"])))


def _faults(run: MotionRun, checks: dict[str, float]) -> list[str]:
    faults, balance = run.ranges.faults(), checks["energy"]
    if not checks.get("balance", 0.0) <= EQUAL:
        faults.append(
            f"Lagrange's equations are left with {checks['balance']:.1g} of their largest term: "
            "the accelerations are wrong"
        )
    if run.passages.found and run.integrator.implicit:
        method = "radau" if run.setup.task.method == "radau" else "bdf"
        faults.append(
            f"the motion passes a singular pose at t = {run.passages.found[0][0]:.9g} s, behind "
            f'which method = "{method}" may be on another branch: try method = "explicit"'
        )
    if balance > BALANCED and run.ends is None:
        faults.append(
            f"the energy balance (S8) has a gap of {balance:.1g} of the energies in motion: "
            "a smaller tolerance is needed"
        )
    return faults
