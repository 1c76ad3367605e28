"""Joint reactions, friction, losses and efforts along a sweep; how much more friction jams it.

The kinematics come from the sweep, certified as ever; the balance of forces follows pose by
pose (see `mechdae.kernels.graphs.kinetostatics`). Every result has its checks: virtual power,
the energy differenced along the path, the balance of each body.
"""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np

from mechdae.describe.file.problem import Problem
from mechdae.describe.tasks.motion import Reactions
from mechdae.equations.tree.bars import check_in_space
from mechdae.errors import InputError
from mechdae.forces.cycle import cycle
from mechdae.forces.force_messages import (
    CHECKS,
    assumptions_of,
    checks,
    failed_checks,
    lost_poses,
    slack,
    verdicts,
)
from mechdae.forces.friction_branches import some
from mechdae.forces.inverse_dynamics import InverseDynamics, LoadedPoses
from mechdae.forces.poses import LoadedRun, PoseForces, loaded_run, solved
from mechdae.forces.series import (
    efforts_of,
    jams_of,
    series_of,
    solutions_of,
    unique_of,
    without_axes,
)
from mechdae.forces.uniqueness import uniqueness
from mechdae.motion.kinematics.prepared import Setting
from mechdae.motion.kinematics.report import report, sorted_events
from mechdae.results import (
    CODES,
    LazyPart,
    Named,
    ReactionsResult,
    Series,
    Status,
    Summary,
    SweepResult,
    among,
    counts,
    events_of,
)
from mechdae.types import Floats, Graph, Integers, Json

POSES = 2
"""Poses at which the critical factor is looked for: those where friction feeds itself most."""
MOST = 1000.0
"""Factors above are not looked for."""


def critical_factor(
    statics: InverseDynamics,
    motion: LoadedPoses,
    inputs: list[Floats],
    sizes: Floats,
    rows: Integers,
    lead: int,
) -> Json:
    """Return the least factor on all coefficients of friction at which a pose jams.

    Parameters
    ----------
    sizes
        Those of friction at all poses.
    rows
        Poses that have one solution.
    lead
        The driver whose value tells the pose.

    Returns
    -------
    dict
        ``factor``, ``at`` and ``joint``, at the poses of the task; ``factor`` None where none is
        found up to the factor ``up_to``: `MOST`, that with which meshes lose all power, or as far
        as the search came.
    """
    worst: Json = {"factor": None, "at": None, "joint": None, "up_to": None}
    if not len(rows):
        return worst
    feeds = _feeding(statics, some(inputs, rows), sizes[rows])
    most = min(MOST, _all_power(statics))
    chosen = np.asarray(rows)[np.argsort(-feeds, kind="stable")[:POSES]]
    limits = statics.branches.limits(some(inputs, chosen), most)
    for k, (factor, joint, _) in zip(chosen, limits, strict=True):
        if factor is not None and (worst["factor"] is None or factor < worst["factor"]):
            worst |= {"factor": factor, "at": float(motion.u[k, lead]), "joint": joint}
    if worst["factor"] is None:
        worst["up_to"] = min(far for _, _, far in limits)
    return worst


def _feeding(statics: InverseDynamics, inputs: list[Floats], sizes: Floats) -> Floats:
    """Return how much friction feeds itself at poses, (n,): at 1 it jams.

    It is the largest real eigenvalue of d size / d m; a feedback that reduces itself is
    negative, however strong.
    """
    found = np.full(len(sizes), -np.inf)
    for stage in statics.staged(inputs, sizes):
        slopes = stage.slopes(np.nan_to_num(sizes))
        slopes[~np.isfinite(slopes).all(axis=(1, 2))] = 0.0
        values = np.linalg.eigvals(slopes)
        real = np.abs(values.imag) <= 1e-9 * np.abs(values)
        found = np.fmax(found, np.where(real, values.real, -np.inf).max(axis=1))
    return found


def _all_power(statics: InverseDynamics) -> float:
    """Return the factor on friction at which a mesh would lose all of its power."""
    values = statics.scene.model.mechanism.values()
    losses = [values.get(f"{name}.mesh_loss", 0.0) for name in statics.balance.joints]
    largest = max(losses, default=0.0)
    return (1 + 1e-9) / largest if largest > 0 else np.inf


def acting_loads(statics: InverseDynamics, answer: PoseForces) -> Summary:
    """Return `load_wrenches` by load, computed when one of them is read."""
    later = LazyPart(lambda: load_wrenches(statics, answer))
    return Summary(dict.fromkeys(statics.loads.wrenches, later))


def load_wrenches(statics: InverseDynamics, answer: PoseForces) -> dict[str, Series]:
    """Return force [N] and moment about the body's origin [N m] by load and body.

    (n, 3) each, in space (n, 6) in world axes, of links that spin freely about their first ball
    joint; weights are under ``gravity``. They follow from the loads alone, reactions are not
    in them. nan where the pose has no forces.
    """
    model = statics.scene.model
    entries = []
    for name, wrench in statics.loads.wrenches.items():
        for body in model.mechanism.bodies:
            if body not in statics.scene.not_in_scene:
                acting = model.space.at_origin(model, wrench, body)
                if acting is not None:
                    entries.append((name, body, acting))
    if not entries:
        return {}

    def build() -> Graph:
        column = ca.vertcat(*[acting for _, _, acting in entries])
        return statics.balance.function("load_wrenches", [column])

    values = statics.batch("load wrenches", build)(*answer.inputs)[0]
    values = np.broadcast_to(values, (len(answer.standing), values.shape[1])).copy()
    values[~answer.standing] = np.nan
    found: dict[str, dict[str, Floats]] = {}
    width = model.space.freedoms
    for k, (name, body, _) in enumerate(entries):
        found.setdefault(name, {})[body] = values[:, width * k : width * (k + 1)]
    return {name: Series(bodies) for name, bodies in found.items()}


SINGULAR = 1e12
"""Condition of the constraints above which forces are not given: they grow with it."""


def reactions(problem: Problem, name: str, task: Reactions) -> ReactionsResult:
    """Return the result of a reactions task.

    Raises
    ------
    InputError
        Inertial parts without any mass, a load that needs a time the task does not have, a
        table that ends before the motion does.
    IndeterminateFrictionError
        Friction on a normal force that is not unique.
    """
    _check(problem, task)
    loaded = loaded_run(problem, task)
    return with_forces(report(problem, name, task, loaded.setting, loaded.run), loaded, task)[0]


def _check(problem: Problem, task: Reactions) -> None:
    mechanism = problem.mechanism
    if mechanism.dimension == 3:
        check_in_space(mechanism)
    if "inertial" in (task.parts or ()):
        masses = [body for body in mechanism.bodies.values() if body.mass or body.inertia]
        if not masses:
            raise InputError(
                "inertial parts are asked for and no body has a mass",
                where="parts",
                hint="give bodies.NAME.mass and inertia",
            )


def with_forces(
    result: SweepResult, loaded: LoadedRun, task: Reactions
) -> tuple[ReactionsResult, PoseForces]:
    """Return the result of a sweep with forces, and these as they were solved for."""
    setting, moving, motion, statics = loaded.setting, loaded.moving, loaded.motion, loaded.statics
    unique = uniqueness(statics, motion)
    _check_loads(setting, statics, motion)
    lost = _without_rank(result)
    there = motion.there & among(result.codes, (Status.OK, Status.AMBIGUOUS))
    there[lost] = False
    answer = solved(statics, motion, there)
    answer.leave_out(~there)
    summary, status = result.summary.copy(), _statuses(result, lost, answer)
    if status is not result.codes:
        summary["status"] = counts(status)
    faults = [result.fault] if isinstance(result.fault, str) else []
    faults += [*lost_poses(setting, answer, lost), *verdicts(setting, answer)]
    if task.cycle:
        figures, broken = cycle(statics, moving, answer)
        summary |= figures
        faults += broken
    if task.direction == "both":
        other = replace(task, direction="load")
        reverse = with_forces(result, loaded.of(other), other)[0]
        noted = "notes" in result.summary
        known = [name for name in result.summary.names() if name != "notes" or noted]
        keys = [k for k in reverse.summary.names() if k not in known or k == "jammed"]
        summary["reverse"] = reverse.summary.only(keys)
    faults += slack(statics, answer)
    checked = LazyPart(lambda: checks(statics, moving, answer))
    lifted, notes = list[Json](), list[str]()
    for along in statics.scene.cases("events of forces"):
        lifted, notes = along(statics, moving, answer, unique)
    if notes := [*notes, *without_axes(statics, task)]:
        summary["notes"] = [*summary.get("notes", []), *notes]
    _add_facts(summary, loaded, answer, task)
    efforts, parts = efforts_of(setting, statics, answer, task)
    series = series_of(statics, answer, task, unique)
    for measure in statics.scene.cases("measures of forces"):
        measure(loaded, answer, unique, series, summary)
    named, sought = result.outputs, list[Json]()
    if setting.expressions is not None and setting.expressions.forced:
        from mechdae.forces import outputs

        named, sought, more = outputs.with_outputs(loaded, result, task, answer, series, efforts)
        if more:
            summary["notes"] = [*summary.get("notes", []), *more]
    whole = result.as_kind(
        ReactionsResult,
        status=status,
        outputs=named,
        joints=_joints(result, loaded, task, series),
        efforts=efforts,
        parts=parts,
        unique=Summary(unique_of(statics, answer, unique, summary)),
        solutions=tuple(solutions_of(setting, statics, answer, unique)),
        checks=Summary(dict.fromkeys(CHECKS, checked)),
        loads=acting_loads(statics, answer),
        summary=summary,
        events=events_of(sorted_events([*result.events, *lifted, *sought], setting.plan.lead)),
        fault=LazyPart(lambda: {"fault": "; ".join([*faults, *failed_checks(checked.parts())])}),
    )
    return whole, answer


def _statuses(result: SweepResult, lost: Integers, answer: PoseForces) -> Integers:
    """Return the codes of poses (n,), those of the sweep where forces change none."""
    marks = {
        Status.SINGULAR: lost,
        Status.JAMMED: np.flatnonzero(answer.jammed),
        Status.AMBIGUOUS: np.flatnonzero(answer.ambiguous),
    }
    codes: Integers = result.codes
    if any(map(len, marks.values())):
        codes = codes.copy()
        for status, rows in marks.items():
            codes[rows] = CODES[status]
    return codes


def _add_facts(summary: Summary, loaded: LoadedRun, answer: PoseForces, task: Reactions) -> None:
    """Add assumptions, and what there is to know of friction."""
    statics, lead = loaded.statics, loaded.setting.plan.lead
    assumed = summary.get("assumptions", [])
    assumed = [*assumed, *statics.assumptions, *assumptions_of(statics, task)]
    summary["assumptions"] = list(dict.fromkeys(assumed))
    if answer.coupled:
        rows = np.flatnonzero(answer.standing)
        motion, inputs, sizes = loaded.motion, answer.inputs, answer.sizes
        summary["critical_factor"] = LazyPart(
            lambda: {"critical_factor": critical_factor(statics, motion, inputs, sizes, rows, lead)}
        )
    if unproven := [k for k, solutions in answer.found.items() if not solutions.proven]:
        summary["not_proven"] = unproven
    if answer.jammed.any():
        summary["jammed"] = jams_of(loaded.setting, answer)


def _joints(
    result: SweepResult, loaded: LoadedRun, task: Reactions, series: dict[str, dict[str, Floats]]
) -> Named:
    """Return the joints in declared order, with what the sweep and forces give of them."""
    every = dict(result.joints)
    for name, forces in series.items():
        every[name] = Series({**dict(every.get(name, {})), **forces})
    order = [name for name in result.mechanism.joints if name in every]
    chosen = order if task.outputs is None else loaded.setting.scene.selection.joints
    return Named("joint", {name: every[name] for name in order if name in chosen})


def _without_rank(result: SweepResult) -> Integers:
    """Return the poses at which constraints lose their rank, at change points, and no more."""
    if result.condition is None:
        return np.zeros(0, int)
    with np.errstate(invalid="ignore"):
        rows = np.flatnonzero(result.condition > SINGULAR)
    known: Integers = rows[result.codes[rows] == CODES[Status.OK]]
    return known


def _check_loads(setting: Setting, statics: InverseDynamics, motion: LoadedPoses) -> None:
    """Raise `InputError` for a load without a value at some pose."""
    lead = setting.plan.lead
    c = setting.plan.coordinates[lead]
    for load, lost, text, key, hint in statics.lost(motion):
        if lost.any():
            at = float(motion.u[np.flatnonzero(lost)[0], lead])
            text = f"{text} at {c.text} = {at:.6g}"
            raise InputError(text, where=f"loads.{load}{key}", hint=hint)
