"""Joint reactions, friction, losses and efforts along a sweep.

The kinematics come from the sweep, certified as ever; the balance of forces follows pose by
pose (see `mechdae.kernels.balance`). Every result has its checks: virtual power, the energy
differenced along the path, the balance of each body.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechdae.analysis.branches import Found
from mechdae.analysis.cycle import cycle
from mechdae.analysis.force_checks import checks
from mechdae.analysis.margin import critical_factor
from mechdae.analysis.moving import Moving, requests
from mechdae.analysis.report import report
from mechdae.analysis.setting import Run, Setting, prepare
from mechdae.analysis.statics import Loaded, Motion, Statics, some
from mechdae.analysis.sweep import run
from mechdae.analysis.uniqueness import Uniqueness, uniqueness
from mechdae.describe.problem import Problem
from mechdae.describe.tasks import Reactions
from mechdae.errors import InputError
from mechdae.model.inertia import massive
from mechdae.model.loads import Loads
from mechdae.model.model import Model
from mechdae.results import Named, Result, Series

TOLERANCE = 1e-9
"""Share by which a check may fail before the result says so."""
SINGULAR = 1e12
"""Condition of the constraints above which forces are not given: they grow with it."""


@dataclass
class Answer:
    """Forces at the poses of a sweep.

    ``there`` (n,) tells which poses have rates, ``jammed``, ``ambiguous`` which of them have
    no solution or several; ``found`` has all solutions of those by pose. ``free`` is what acts
    without friction, ``sizes`` and ``quiet`` the sizes with and without it.
    """

    motion: Motion
    inputs: list[Any]
    there: Any
    jammed: Any
    ambiguous: Any
    found: dict[int, Found]
    sizes: Any
    quiet: Any
    whole: Loaded
    free: Loaded


def reactions(problem: Problem, name: str, task: Reactions) -> Result:
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
    wanted = replace(task, derivatives=max(2, task.derivatives))
    setting = prepare(problem, wanted, loaded_bodies, requests)
    followed = run(setting, wanted)
    result = report(problem, name, task, setting, followed)
    return _with_forces(result, setting, followed, task)


def _check(problem: Problem, task: Reactions) -> None:
    mechanism = problem.mechanism
    if "inertial" in (task.parts or ()):
        masses = [body for body in mechanism.bodies.values() if body.mass or body.inertia]
        if not masses:
            raise InputError(
                "inertial parts are asked for and no body has a mass",
                where="parts",
                hint="give bodies.NAME.mass and inertia",
            )


def loaded_bodies(model: Model) -> Iterable[str]:
    """Return the bodies that forces act on or come from."""
    found = {*Loads(model).bodies, *massive(model)}
    for joint in model.mechanism.joints.values():
        if getattr(joint, "pretension", None) is not None:
            found |= set(joint.bodies)
    return found


def _with_forces(result: Result, setting: Setting, followed: Run, task: Reactions) -> Result:
    moving = Moving(setting, followed)
    motion = moving.poses()
    statics = Statics(
        setting.scene, followed.evaluator, task, motion, turned=task.direction == "load"
    )
    _check_time(statics, motion)
    unique = uniqueness(statics, motion)
    status = _with_rank(result)
    answer = solved(statics, motion, status)
    _check_loads(setting, statics, motion)
    summary = dict(result.summary)
    found = checks(statics, moving, answer)
    status[answer.jammed] = "jammed"
    status[answer.ambiguous] = "ambiguous"
    faults = [result.fault] if result.fault else []
    faults += _lost(setting, answer, status, result.status)
    faults += _faults(setting, answer)
    if task.cycle:
        figures, broken = cycle(statics, moving, answer, task)
        summary |= figures
        faults += broken
    if task.direction == "both":
        other = replace(task, direction="load")
        reverse = _with_forces(result, setting, followed, other)
        keys = [k for k in reverse.summary if k not in result.summary or k == "jammed"]
        summary["reverse"] = {key: reverse.summary[key] for key in keys}
    faults += _slack(statics, answer)
    faults += _failed_checks(found)
    assumptions = list(dict.fromkeys([*statics.assumptions, *_assumptions(statics, task)]))
    summary["assumptions"] = assumptions
    if answer.whole is not answer.free:
        rows = np.flatnonzero(answer.there & ~answer.jammed)
        lead = setting.plan.lead
        summary["critical_factor"] = critical_factor(statics, motion, answer.inputs, rows, lead)
    unproven = [k for k, own in answer.found.items() if not own.proven]
    if unproven:
        summary["not_proven"] = unproven
    if answer.jammed.any():
        summary["jammed"] = _jams(setting, answer)
    summary["status"] = _counts(status)
    series = _series(statics, answer, task, unique)
    efforts, parts = _efforts(setting, statics, answer, task)
    joints = {
        name: Series({**dict(result.joints.get(name, {})), **own}) for name, own in series.items()
    }
    kept = {name: own for name, own in result.joints.items() if name not in joints}
    order = [name for name in result.mechanism.joints if name in joints or name in kept]
    every = {**kept, **joints}
    chosen = setting.scene.selection.joints if task.outputs is not None else order
    return replace(
        result,
        status=status,
        joints=Named("joint", {name: every[name] for name in order if name in chosen}),
        efforts=efforts,
        parts=parts,
        unique=_unique(statics, answer, unique, summary),
        solutions=tuple(_solutions(setting, statics, answer)),
        checks=found,
        summary=summary,
        fault="; ".join(faults) or None,
    )


def _with_rank(result: Result) -> Any:
    """Return the statuses, "singular" where constraints lose their rank: at change points."""
    status = result.status.copy()
    if result.condition is not None:
        with np.errstate(invalid="ignore"):
            status[(result.condition > SINGULAR) & (status == "ok")] = "singular"
    return status


def _check_time(statics: Statics, motion: Motion) -> None:
    if statics.loads.uses_time and motion.t is None:
        raise InputError(
            "it uses t, and this task has no time",
            where=f"loads.{statics.loads.uses_time[0]}",
            hint="a driver with a constant speed or a law",
        )


def _check_loads(setting: Setting, statics: Statics, motion: Motion) -> None:
    """Raise `InputError` for a load without a value at some pose."""
    lead = setting.plan.lead
    c = setting.plan.coordinates[lead]
    for load, lost in statics.outside(motion).items():
        at = float(motion.u[np.flatnonzero(lost)[0], lead])
        raise InputError(
            f"the table ends before the motion does: no value at {c.text} = {at:.6g}",
            where=f"loads.{load}.{statics.table_key(load)}",
            hint="add rows, or periodic = true",
        )
    for load, lost in statics.undirected(motion).items():
        at = float(motion.u[np.flatnonzero(lost)[0], lead])
        raise InputError(
            f"the spring has no direction: its points coincide at {c.text} = {at:.6g}",
            where=f"loads.{load}.between",
            hint="other points; a spring may only vanish with free_length = 0, preload = 0 and "
            "damping = 0",
        )


# -- solving ---------------------------------------------------------------------------------


def solved(statics: Statics, motion: Motion, status: Any) -> Answer:
    """Return the forces at poses, all solutions where there may be none or several."""
    n = len(motion)
    there = ((status == "ok") | (status == "ambiguous")) & np.isfinite(motion.a).all(axis=1)
    inputs = statics.inputs(motion)
    jammed, ambiguous = np.zeros(n, bool), np.zeros(n, bool)
    if statics.task.friction != "coupled" or not statics.frictional:
        quiet = statics.sizes(inputs)[0]
        free = statics.loaded(inputs, quiet, friction=False)
        free.put(np.flatnonzero(~there), np.nan)
        return Answer(motion, inputs, there, jammed, ambiguous, {}, quiet, quiet, free, free)
    forces, found = statics.settled(inputs, there)
    for k, own in found.items():
        jammed[k], ambiguous[k] = len(own.sizes) == 0, len(own.sizes) > 1
    free, whole = forces.free, forces.whole
    free.put(np.flatnonzero(~there), np.nan)
    whole.put(np.flatnonzero(~there | jammed), np.nan)
    sizes, quiet = forces.sizes, forces.quiet
    return Answer(motion, inputs, there, jammed, ambiguous, found, sizes, quiet, whole, free)


# -- what is reported ------------------------------------------------------------------------


def _series(
    statics: Statics, answer: Answer, task: Reactions, unique: Uniqueness | None
) -> dict[str, dict[str, Any]]:
    balance = statics.balance
    coupled = answer.whole is not answer.free
    friction = task.friction != "none"
    static = statics.static(answer.inputs, answer.quiet) if task.parts else None
    if static is not None:
        static.reactions[~answer.there] = np.nan
    lossy = {balance.feedbacks[k].joint for k in balance.active}
    found: dict[str, dict[str, Any]] = {}
    for k, name in enumerate(balance.joints):
        own: dict[str, Any] = {"reaction": answer.whole.reactions[:, k]}
        if unique is not None:
            own["reaction"] = np.where(unique.whole[k], own["reaction"], np.nan)
        if name in balance.guides:
            own["normal"] = answer.whole.normals[:, balance.guides.index(name)]
        if name in lossy and friction:
            own["loss"] = answer.whole.losses[:, k]
            if coupled:
                own["reaction_uncoupled"] = answer.free.reactions[:, k]
                own["loss_uncoupled"] = answer.free.losses[:, k]
        if static is not None:
            parts = {"static": static.reactions[:, k]}
            parts["inertial"] = answer.free.reactions[:, k] - static.reactions[:, k]
            own |= {f"reaction_{part}": parts[part] for part in task.parts or ()}
        own |= _turned(statics, answer, name, own["reaction"], task.axes or ())
        found[name] = own
    return found


def _unique(
    statics: Statics, answer: Answer, unique: Uniqueness | None, summary: dict[str, Any]
) -> dict[str, dict[str, Any]]:
    """Return what is unique of each joint; resultants that are go to the summary."""
    if unique is None:
        return {}
    places = {name: k for k, name in enumerate(statics.balance.joints)}
    reactions = answer.whole.reactions
    summary["not_unique"] = [n for k, n in enumerate(places) if not unique.whole[k]]
    summary["unique_sums"] = [
        {"body": body, "joints": names, "force": _resultant(statics, reactions, body, names)}
        for body, names in unique.sums.items()
    ]
    return {name: own.values(reactions[:, places[name]]) for name, own in unique.joints.items()}


def _resultant(statics: Statics, reactions: Any, body: str, names: list[str]) -> Any:
    """Return the sum of forces (n, 2) of joints on a body."""
    joints = statics.scene.model.mechanism.joints
    places = {name: k for k, name in enumerate(statics.balance.joints)}
    return sum(
        (1 if joints[name].second_body == body else -1) * reactions[:, places[name], :2]
        for name in names
    )


def _turned(
    statics: Statics, answer: Answer, name: str, reaction: Any, axes: tuple[str, ...]
) -> dict[str, Any]:
    """Return a reaction in axes of its second body, and along and across the link."""
    found: dict[str, Any] = {}
    model = statics.scene.model
    joint = model.mechanism.joints[name]
    for word in axes:
        body, direction = joint.second_body, 0.0
        if word == "radial":
            body, direction = link_axis(model, name)
        angle = np.full(len(reaction), direction)
        if body in model.mechanism.bodies:
            column = statics.balance.columns.index(model.places[body, "angle"])
            angle = angle + answer.motion.q[:, column]
        c, s = np.cos(angle), np.sin(angle)
        along = c * reaction[:, 0] + s * reaction[:, 1]
        across = c * reaction[:, 1] - s * reaction[:, 0]
        parts = [along, across, reaction[:, 2]] if word == "body" else [along, across]
        found[f"reaction_{word}"] = np.stack(parts, axis=1)
    return found


def link_axis(model: Model, name: str) -> tuple[str, float]:
    """Return the link a joint's reaction is taken apart on, and the direction of its axis there.

    It is the second body, else the first, that has another joint apart from this one; the axis
    leads from this joint to that one [rad].
    """
    mechanism = model.mechanism
    joint, values = mechanism.joints[name], mechanism.values()
    for reference in (joint.second, joint.first):
        body, point = reference.split(".")
        if body not in mechanism.bodies:
            continue
        here = np.array([values[f"{body}.{point}.{axis}"] for axis in "xy"])
        for other in mechanism.joints.values():
            for end in (other.first, other.second):
                owner, place = end.split(".")
                if owner == body and other.name != name:
                    there = np.array([values[f"{body}.{place}.{axis}"] for axis in "xy"])
                    gap = there - here
                    if np.any(gap != 0):
                        return body, float(np.arctan2(gap[1], gap[0]))
    return joint.second_body, 0.0


def _efforts(
    setting: Setting, statics: Statics, answer: Answer, task: Reactions
) -> tuple[Series, dict[str, Series]]:
    names = [row.owner for row in setting.scene.rows if row.driver]

    def listed(efforts: Any) -> Series:
        return Series({name: efforts[:, k] for k, name in enumerate(names)})

    parts = {}
    if answer.whole is not answer.free:
        parts["uncoupled"] = listed(answer.free.efforts)
    if task.parts:
        static = statics.static(answer.inputs, answer.quiet).efforts
        static[~answer.there] = np.nan
        both = {"static": static, "inertial": answer.free.efforts - static}
        parts |= {part: listed(both[part]) for part in task.parts}
    return listed(answer.whole.efforts), parts


def _counts(status: Any) -> dict[str, int]:
    words = ("ok", "limit", "singular", "ambiguous", "jammed", "unassembled")
    return {word: count for word in words if (count := int(np.count_nonzero(status == word)))}


def _solutions(setting: Setting, statics: Statics, answer: Answer) -> Iterable[dict[str, Any]]:
    """Yield all solutions of the poses that have several."""
    lead = setting.plan.lead
    names = [row.owner for row in setting.scene.rows if row.driver]
    for k, own in answer.found.items():
        if len(own.sizes) < 2:
            continue
        one = some(answer.inputs, slice(k, k + 1))
        listed = []
        for i, sizes in enumerate(own.sizes):
            loaded = statics.loaded(one, sizes[None, :])
            listed.append(
                {
                    "efforts": dict(zip(names, loaded.efforts[0].tolist(), strict=True)),
                    "reactions": {
                        name: loaded.reactions[0, j].tolist()
                        for j, name in enumerate(statics.balance.joints)
                    },
                    "connected": own.connected == i,
                }
            )
        yield {
            "pose": k,
            "at": float(answer.motion.u[k, lead]),
            "count": len(own.sizes),
            "proven": own.proven,
            "solutions": listed,
        }


def _jams(setting: Setting, answer: Answer) -> list[dict[str, Any]]:
    lead = setting.plan.lead
    return [
        {
            "pose": int(k),
            "at": float(answer.motion.u[k, lead]),
            "proven": answer.found[int(k)].proven,
            "critical_factor": answer.found[int(k)].critical,
            "joint": answer.found[int(k)].joint,
        }
        for k in np.flatnonzero(answer.jammed)
    ]


def _lost(setting: Setting, answer: Answer, status: Any, before: Any) -> list[str]:
    """Return a sentence on poses that assemble and have no finite forces."""
    from mechdae.analysis.start import shown

    places = np.flatnonzero((status == "singular") & (before == "ok"))
    if not places.size:
        return []
    c = setting.plan.coordinates[setting.plan.lead]
    first = shown(c.unit, float(answer.motion.u[places[0], setting.plan.lead]))
    return [
        f"{places.size} of {len(status)} poses have no finite forces, first at {c.text} = {first}: "
        f"the constraints lose their rank there (a change point)"
    ]


def _faults(setting: Setting, answer: Answer) -> list[str]:
    """Return what is wrong in sentences: jammed and ambiguous poses."""
    from mechdae.analysis.start import shown

    c = setting.plan.coordinates[setting.plan.lead]
    n, faults = len(answer.motion), []
    for rows, word in ((answer.jammed, "jammed"), (answer.ambiguous, "ambiguous")):
        places = np.flatnonzero(rows)
        if not places.size:
            continue
        first = shown(c.unit, float(answer.motion.u[places[0], setting.plan.lead]))
        if word == "jammed":
            own = answer.found[int(places[0])]
            text = f"{len(places)} of {n} poses are jammed: no equilibrium with friction, first at "
            text += f"{c.text} = {first}"
            if own.critical is not None:
                text += f", where it jams from {own.critical:.6g} times the friction given on"
                text += f", by joint {own.joint}" if own.joint else ""
        else:
            known = all(answer.found[int(k)].connected is not None for k in places)
            which = "the one that continues from no friction" if known else "one of them"
            text = (
                f"{len(places)} of {n} poses have several solutions, first at {c.text} = {first}; "
                f"{which} is given, all are listed"
            )
        faults.append(text)
    return faults


def _slack(statics: Statics, answer: Answer) -> list[str]:
    """Return belts whose slack strand would have to push."""
    model = statics.scene.model
    values = model.mechanism.values()
    faults = []
    for name, mesh in statics.meshes.items():
        if not mesh.steady:
            continue
        radius = values[f"{name}.radius"] * values[f"{name}.ratio"]
        moment = answer.whole.reactions[:, statics.balance.joints.index(name), 2]
        with np.errstate(invalid="ignore"):
            slack = np.abs(moment) > 2 * radius * values[f"{name}.pretension"]
        if slack.any():
            need = float(np.nanmax(np.abs(moment))) / (2 * radius)
            faults.append(
                f"belt {name} goes slack at {int(slack.sum())} of {len(slack)} poses: "
                f"pretension of {need:.6g} N at least is needed"
            )
    return faults


def _failed_checks(found: dict[str, Any]) -> list[str]:
    return [
        f"check '{name}' fails: {value:.3g} of the forces and powers in it"
        for name, value in found.items()
        if value is not None and not value <= TOLERANCE
    ]


def _assumptions(statics: Statics, task: Reactions) -> list[str]:
    mechanism = statics.scene.model.mechanism
    balance = statics.balance
    massless = [name for name in balance.bodies if name not in massive(statics.scene.model)]
    found = []
    if massless:
        found.append(f"massless: {', '.join(massless)}")
    points = [
        name
        for name in balance.bodies
        if mechanism.bodies[name].mass is not None and mechanism.bodies[name].inertia is None
    ]
    if points:
        found.append(f"point masses (no inertia given): {', '.join(points)}")
    if task.friction != "none":
        lossy = {balance.feedbacks[k].joint for k in balance.active}
        smooth = [
            name
            for name in balance.joints
            if name not in lossy and mechanism.joints[name].kind not in ("weld", "distance")
        ]
        if lossy and smooth:
            found.append(f"without friction: {', '.join(smooth)}")
    return found
