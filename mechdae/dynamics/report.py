"""From the states of a motion to a result."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import Selection, selection
from mechdae.describe.file.problem import Problem
from mechdae.describe.named import reactions_of
from mechdae.describe.tasks.kinds import Motion
from mechdae.dynamics.expressions import WithReactions
from mechdae.dynamics.observe import Observer
from mechdae.dynamics.run import Run
from mechdae.dynamics.unique import dependence_note, unique
from mechdae.forces.meshes import slack_belts
from mechdae.kernels.run.batch import Batch
from mechdae.model.model import Model
from mechdae.results import Named, Result, Series, Summary
from mechdae.setup.named_outputs import NamedOutputs, requests
from mechdae.setup.outputs import Outputs

BALANCED = 1e-3
"""Gap of the energy balance, over the energies that move, that is a fault."""
ROUNDED = 1e-9
"""Share of the energies stored, and of loads times a length, below which energies do not move."""
CORRECTED = 1e-9


@dataclass(frozen=True)
class Whole:
    """What `Outputs` reads of a scene: absolute coordinates stay as they are."""

    model: Model
    selection: Selection
    groups: tuple[Any, ...] = ()

    def expression(self, absolute: Any) -> Any:
        return absolute


def report(
    problem: Problem,
    name: str,
    task: Motion,
    run: Run,
    observer: Observer,
    data: dict[str, Any],
) -> Result:
    """Return the result of a motion."""
    setup, states = run.setup, run.states
    model = setup.model
    q, v, a = observer.absolute(states)
    chosen = selection(problem.mechanism, task.outputs, forces=True)
    forced = [own for own in chosen.named if reactions_of(problem.mechanism, own)]
    plain = [own for own in chosen.named if own not in forced]
    expressions = NamedOutputs(model, plain, 2, task.outputs is not None, time=True)
    whole = Whole(model, chosen)
    outputs: Any = Outputs(whole, requests(model, list(expressions.rates)))  # type: ignore[arg-type]
    y = evaluated(model, outputs.expression, q, v, a)
    named: dict[str, Any] = outputs.named(y)
    columns = outputs.columns(expressions.coordinates)
    there = np.isfinite(q).all(axis=1)
    found, lost = expressions.evaluate([part[:, columns] for part in y], states.t, there)
    lam = observer.multipliers(states)
    reactions = observer.reactions(states, q, lam)
    sole = unique(observer, states, q, reactions)
    for k, own in enumerate(reactions.values()):
        own[sole.lost[:, k]] = np.nan
    series = {own: dict(found[own]) for own in found}
    if forced:
        values = WithReactions(model, setup.loads, forced)(q, v, a, states.t, reactions)
        series |= {own: {"value": values[:, k]} for k, own in enumerate(forced)}
    order = [own for own in chosen.named if own in series]
    named["outputs"] = Named("output", {own: Series(series[own]) for own in order})
    named["joints"] = with_reactions(named["joints"], reactions, chosen)
    scalars, work, balance = _energies(run, observer)
    drift, rates = observer.gaps(states, q, v)
    scalars["drift"] = drift
    status = np.where(there, "ok", "singular").astype("<U11")
    status[states.t == run.undecided[0]] = run.undecided[1]
    summary = _summary(run, drift, rates)
    summary["status"] = {own: status.tolist().count(own) for own in dict.fromkeys(status.tolist())}
    kept = [own for own in order if own not in forced]
    summary["state"] = {
        own: [float(series[own].get(word, [np.nan])[-1]) for word in ("value", "rate")]
        for own in kept
    }
    rows = setup.released.rows
    summary["multipliers"] = {own: float(series[own]["value"][-1]) for own in forced} | {
        row.name: float(lam[-1, i]) if sole.multipliers[i] else None
        for i, row in enumerate(rows)
        if row.name not in forced and (row.owner, row.part) not in setup.held
    }
    summary |= sole.summary
    efforts = {
        row.owner: -lam[:, i] if sole.multipliers[i] else np.full(len(lam), np.nan)
        for i, row in enumerate(rows)
        if row.driver and row.part == "law"
    }
    notes = (
        sole.notes
        + setup.notes
        + setup.rubbing.assumptions
        + expressions.notes
        + lost
        + run.stiffness.notes()
        + run.lifting.notes()
    )
    if run.begin.correction > CORRECTED:
        notes.append(
            f"the numbers of the start were corrected by up to {run.begin.correction:.2g} "
            "of their natural size to meet the constraints"
        )
    if setup.held:
        idle = ", ".join(".".join(own) for own in setup.held)
        notes.append(f"nothing moves {idle}: kept as they are in the sketch")
    if summary["superfluous_equations"] and sole.dependent:
        open_ones = sole.summary.get("not_unique", [])
        joints = [name for name in setup.model.mechanism.joints if name not in open_ones]
        redundant = {"equations": sole.dependent, "unique": joints, "not_unique": open_ones}
        summary["redundant"] = redundant
        notes.append(dependence_note(redundant))
    if run.creep is not None:
        summary["creep"] = run.creep.found
        notes += run.creep.notes()
    if notes:
        summary["notes"] = notes
    faults = [run.fault] if run.fault else []
    faults += slack_belts(
        setup.meshes,
        lambda own: reactions[own][:, 2],
        lambda slack: f", first at t = {states.t[int(np.argmax(slack))]:.6g} s",
    )
    faults += _faults(run, balance)
    return Result(
        problem.name,
        name,
        task.kind,
        problem.mechanism,
        problem.title,
        status=status,
        events=_events(run),
        checks={"energy": balance},
        summary=Summary(summary),
        fault="; ".join(faults) or None,
        definition=task,
        data=data,
        time=states.t,
        efforts=Series(efforts),
        scalars=Series(scalars),
        work=Series(work),
        unique=sole.joints,
        **named,
    )


def evaluated(model: Model, expression: Any, q: Any, v: Any, a: Any) -> list[Any]:
    """Return scalars over q with their rates and accelerations."""
    at = ca.vertcat(model.q, model.velocity)
    along = ca.vertcat(model.velocity, model.acceleration)
    first = ca.jtimes(expression, model.q, model.velocity)
    second = ca.jtimes(first, at, along)
    inputs = [model.q, model.velocity, model.acceleration, model.p]
    results = [ca.densify(part) for part in (expression, first, second)]
    function = ca.Function("outputs", inputs, results, {"cse": True})
    return Batch(function, [3], straight=lambda: None)(q, v, a, model.p_values)


def with_reactions(joints: Named, reactions: dict[str, Any], chosen: Selection) -> Named:
    """Return the series of joints with their reactions."""
    found = {}
    for joint in chosen.joints:
        own = dict(joints.get(joint, {}))
        if joint in reactions:
            own["reaction"] = reactions[joint]
        found[joint] = Series(own)
    return Named("joint", found)


def _energies(run: Run, observer: Observer) -> tuple[dict[str, Any], dict[str, Any], float]:
    """Return energies, works by load, and the gap of their balance over the energies that move."""
    states = run.states
    kinetic, stores = observer.energies(states)
    potential = sum(stores.values(), np.zeros_like(kinetic))
    energy = kinetic + potential
    work = {name: states.w[:, k] for k, name in enumerate(run.setup.works)}
    done = sum(work.values(), np.zeros_like(kinetic))
    size = max(
        float(np.max(kinetic)),
        *(float(np.ptp(own)) for own in (potential, done)),
        *(float(np.max(np.abs(own))) for own in work.values()),
    )
    gap = energy - run.first_energy - done
    balance = float(np.max(np.abs(gap))) / size if size > 0 else 0.0
    if balance > BALANCED:  # of a mechanism at rest, rounding is all that moves
        stored = sum(float(np.max(np.abs(own))) for own in stores.values())
        size = max(size, ROUNDED * (stored + observer.loads(states)))
        balance = float(np.max(np.abs(gap))) / size
    return {"energy": energy, "kinetic": kinetic, "potential": potential}, work, balance


def _summary(run: Run, drift: Any, rates: Any) -> dict[str, Any]:
    setup, work, r = run.setup, run.integrator, run.setup.released
    summary: dict[str, Any] = {
        "poses": len(run.states.t),
        "end": float(run.last[0]) if run.last is not None else 0.0,
        "tolerance": setup.tolerance,
        "coordinates": len(r.coordinates),
        "constraints": len(r.kept),
        "eliminated": len(r.gone),
        "freedoms": len(r.coordinates) - len(r.kept) + run.passages.superfluous,
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
    return summary


def _events(run: Run) -> tuple[dict[str, Any], ...]:
    lay = run.integrator.layout
    found: list[dict[str, Any]] = [
        {"kind": "singular", "code": "S1", "at": t, "time": t, "rank_drop": drop}
        for t, drop in run.passages.found
    ]
    for own in run.crossings.found:
        t = float(lay.of(own.state, "t"))
        entry = {"kind": "crossing", "at": t, "time": t, "name": own.crossing.name}
        entry |= {"of": own.crossing.text, "value": own.crossing.value}
        found.append(entry | {"direction": "up" if own.rises else "down"})
    loads = run.setup.problem.mechanism.loads
    for t, name, sign, kind in run.sticking.found:
        owner = "load" if name in loads else "joint"
        found.append({"kind": kind, "at": t, "time": t, owner: name, "sign": sign})
    found += run.stiffness.events() + run.lifting.events()
    found += [run.ends] if run.ends is not None else []
    found.sort(key=lambda entry: float(entry["at"]))
    return tuple(entry | {"in_range": True} for entry in found)


def _faults(run: Run, balance: float) -> list[str]:
    faults = run.ranges.faults()
    if run.passages.found and run.integrator.implicit:
        faults.append(
            f"the motion passes a singular pose at t = {run.passages.found[0][0]:.9g} s, behind "
            'which method = "bdf" may be on another branch: try method = "explicit"'
        )
    if balance > BALANCED and run.ends is None:
        faults.append(
            f"the energy balance (S8) has a gap of {balance:.1g} of the energies in motion: "
            "a smaller tolerance is needed"
        )
    return faults
