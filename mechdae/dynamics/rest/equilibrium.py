"""Static equilibrium of a released mechanism on the assembly mode of its sketch."""

from __future__ import annotations

import numpy as np

from mechdae.describe.assumed import about_motion
from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.motion import Equilibrium, start_values
from mechdae.dynamics.equations import MotionProblem, as_motion, idle, setup
from mechdae.dynamics.output_values import Observer, Reported, States
from mechdae.dynamics.rest.all_equilibria import Rest, Rests
from mechdae.dynamics.rest.balance import EquilibriumEquations
from mechdae.dynamics.rest.chart import Chart
from mechdae.dynamics.rest.linear_system import LinearisedState, LinearSystem
from mechdae.dynamics.rest.small_motions import small_motions
from mechdae.dynamics.start import start
from mechdae.dynamics.unique import unique
from mechdae.errors import InputError, SolveError
from mechdae.records import dataclass
from mechdae.results import EquilibriumResult, Named, Series, Status, Summary, statuses
from mechdae.types import Floats, Json, Matrix, Unknowns

MOST = 20
"""Equilibria that are listed."""


def equilibrium(problem: Problem, name: str, task: Equilibrium) -> EquilibriumResult:
    found = at_rest(problem, task)
    summary: Json = {
        "poses": 1,
        "freedoms": found.basis.shape[1],
        "coordinates": found.balance.n,
        "constraints": found.balance.m,
        "iterations": found.rest.steps,
        "residual": found.rest.left,
        "closure": float(np.max(np.abs(found.phi), initial=0.0)),
        "bound": "estimated",
        "not_in_scene": [],
    }
    summary["stable"] = found.rest.stable
    summary |= found.listed
    if task.linearise:
        summary |= small_motions(found.balance, task, found.rest.x, found.basis, found.along)
    notes = found.notes
    data: dict[str, Json] = {}
    if task.linearise and found.basis.shape[1] + len(found.balance.setup.laws):
        data["linear"] = _linear(found, task)
    lam = found.rest.lam / found.balance.gaps
    return _report(
        problem, name, task, found.balance.setup, found.rest.x, lam, summary, notes, data
    )


def _linear(found: AtRest, task: Equilibrium) -> Json:
    """Return the linear system of small motions."""
    rest, n = found.rest, found.balance.n
    still = np.zeros(n)
    state = LinearisedState(0.0, rest.x, still, still, rest.lam / found.balance.gaps)
    names = [*(task.free or ()), *found.listed["mode_coordinates"]]
    whole = found.balance.setup
    return LinearSystem(whole, state, found.basis, names, task.inputs, task.outputs).told()


@dataclass
class AtRest:
    """A mechanism at the equilibrium that its sketch means.

    ``basis`` is that of its freedoms, ``along`` mass, damping and stiffness along them, all in
    natural sizes; ``listed`` is what the summary says about all equilibria.
    """

    balance: EquilibriumEquations
    rest: Rest
    basis: Matrix
    along: list[Floats]
    phi: Floats
    listed: Json
    notes: list[str]


def at_rest(problem: Problem, task: Equilibrium) -> AtRest:
    """Return the equilibrium that the sketch means."""
    whole, x = _prepared(problem, task)
    balance = EquilibriumEquations(whole)
    rest, listed, notes = _chosen(balance, task, x)
    _, J, phi, K, C, M = balance.at(rest.x, rest.lam)
    basis = balance.freedoms(J)
    along = [basis.T @ part @ basis for part in (M, C, K)]
    return AtRest(balance, rest, basis, along, phi, listed, notes)


def _prepared(problem: Problem, task: Equilibrium) -> tuple[MotionProblem, Floats]:
    whole = setup(problem, as_motion(task), moves=False)
    if whole.loads.uses_time:
        raise InputError("it uses t", where=f"loads.{whole.loads.uses_time[0]}")
    whole.likely = task.free or ()
    begin = start(whole)
    whole.held = {key: float(begin.q[whole.model.places[key]]) for key in idle(whole)}
    return whole, begin.q[whole.released.free]


def _chosen(
    balance: EquilibriumEquations, task: Equilibrium, x: Unknowns
) -> tuple[Rest, Json, list[str]]:
    """Return the equilibrium that the task means, facts about all of them, and notes."""
    closed = balance.closed(x)
    x = x if closed is None else closed
    _, J, _ = balance.light(x)
    basis = balance.freedoms(J)
    begins = start_values(balance.setup.problem.mechanism, task.start, "start")
    names = [*(task.free or ()), *(c.text for c in begins)]
    chart = Chart(balance.setup, x, basis, names)
    if task.mode is not None:
        moved = balance.closed(chart.on_mode(x, task.mode))
        x = x if moved is None else moved
    rests = Rests(balance, chart, x)
    rest = rests.answer
    if rest is None:
        left = balance.newton(x)[2]
        raise SolveError(
            f"no equilibrium was found near the sketch: {left:.2g} of the forces is left",
            where="start",
            hint="sketch a pose nearer to it, or hold coordinates with drivers",
        )
    listed: Json = {"mode": chart.label(rest.x), "mode_coordinates": chart.names}
    listed["sketched_mode"] = rest.on_mode
    listed["equilibria"] = [
        {
            "mode": chart.label(found.x),
            "sketched_mode": found.on_mode,
            "sketched_circuit": found.circuit,
            "stable": found.stable,
            "distance": found.far,
            "coordinates": chart.values(found.x),
            "answer": found is rest,
        }
        for found in rests.found[:MOST]
    ]
    listed["all_equilibria"] = rests.whole
    return rest, listed, _notes(chart, rests, rest)


def _notes(chart: Chart, rests: Rests, rest: Rest) -> list[str]:
    """Return what the user must know about the choice."""

    def at(one: Rest) -> str:
        values = ", ".join(f"{name} = {value:.6g}" for name, value in chart.values(one.x).items())
        return f"({values}; mode {chart.label(one.x)}, {one.stable})"

    notes = []
    nearest = rests.found[0]
    on_mode = [other for other in rests.found if other.on_mode]
    if not rest.on_mode:
        there = f"only {at(on_mode[0])}, far from it," if on_mode else "none"
        notes.append(
            f"on the assembly mode of the sketch {there} was found, and let go the mechanism "
            f"leaves it: the nearest equilibrium {at(rest)} lies on another {_kind(rest)}"
        )
    elif nearest is not rest and not nearest.on_mode:
        notes.append(
            f"an equilibrium nearer to the sketch {at(nearest)} lies on another {_kind(nearest)}; "
            "that of the sketch is answered"
        )
    elif nearest is not rest:
        notes.append(
            f"the equilibrium nearest to the sketch {at(nearest)} is more than 20 degrees away: "
            "answered is the one that the mechanism comes to from there when it is let go"
        )
    others = [one for one in on_mode if one is not rest and one.stable == "stable"]
    if rest.stable == "unstable" and others:
        notes.append(f"this equilibrium is unstable; the nearest stable one is {at(others[0])}")
    return notes


def _kind(rest: Rest) -> str:
    """Return where an equilibrium lies that is not on the sketch's mode."""
    if rest.circuit is False:
        return "circuit: the mechanism cannot get there without being taken apart"
    return "mode"


def _report(
    problem: Problem,
    name: str,
    task: Equilibrium,
    whole: MotionProblem,
    x: Unknowns,
    lam: Floats,
    summary: Json,
    more: list[str],
    data: dict[str, Json],
) -> EquilibriumResult:
    model, n = whole.model, len(x)
    observer = Observer(whole)
    still = np.zeros((1, n))
    signs = whole.loose[None, :]
    none = np.zeros((1, 0))
    state = States(np.zeros(1), x[None, :], still, still, lam[None, :], none, signs)
    q, v, a = observer.absolute(state)
    reported = Reported(whole, task.outputs, moves=False)
    named, found = reported.evaluate((q, v, a), None, np.ones(1, bool))
    series = {name: Series({"value": found[name]["value"]}) for name in found}
    every = observer.multipliers(state)
    reactions = {} if model.mesh_names else observer.reactions(state, every)
    sole = unique(observer, state, q, reactions)
    for k, reaction in enumerate(reactions.values()):
        reaction[sole.lost[:, k]] = np.nan
    named["joints"] = reported.with_reactions(named["joints"], reactions)
    summary |= sole.summary
    summary["state"] = {name: float(series[name].value[0]) for name in series}
    rows, tells = whole.released.rows, whole.released.tells
    summary["multipliers"] = {
        row.name: float(every[0, i]) if sole.multipliers[i] else None
        for i, row in enumerate(rows)
        if (row.owner, row.part) not in whole.held and tells(row)
    }
    notes = whole.notes + more + reported.notes + _lifted(whole, q, reactions)
    if whole.loads.slips:
        owners = ", ".join(slip.owner for slip in whole.loads.slips)
        notes.append(f"at rest {owners} resists nothing here: what it could hold is left out")
    if notes:
        summary["notes"] = notes
    if assumed := about_motion(problem.mechanism):
        summary["assumptions"] = assumed
    status, faults = statuses(1), list[str]()
    for passed in model.cases("passed stops"):
        over, sentences = passed(model, q, rebound=False)
        status[over] = Status.STOPPED
        faults += [f"{text}: rest at a stop is not looked for" for text in sentences]
    summary["status"] = {status.tolist()[0]: 1}
    return EquilibriumResult.of(
        problem,
        name,
        task,
        outputs=Named("output", series),
        status=status,
        fault="; ".join(faults) or None,
        summary=Summary(summary),
        data=data,
        unique=Summary(sole.joints),
        **named,
    )


def _lifted(whole: MotionProblem, q: Unknowns, reactions: dict[str, Floats]) -> list[str]:
    """Return what is said of one-sided contacts."""
    notes: list[str] = []
    for said in whole.model.cases("notes at rest"):
        notes += said(whole.model, q, reactions)
    return notes
