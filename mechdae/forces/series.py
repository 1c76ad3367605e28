"""Forces as named series: reactions in several axes, efforts, all solutions, unique directions."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.tasks.motion import Reactions
from mechdae.equations.model import Model
from mechdae.forces.friction_branches import some
from mechdae.forces.inverse_dynamics import InverseDynamics, absolute
from mechdae.forces.poses import PoseForces
from mechdae.forces.uniqueness import Orientations, Uniqueness, in_axes, resultants
from mechdae.motion.kinematics.prepared import Setting
from mechdae.results import Series
from mechdae.results.series import Summary
from mechdae.types import Floats, Json, Matrix


def series_of(
    statics: InverseDynamics, answer: PoseForces, task: Reactions, unique: Uniqueness | None
) -> dict[str, dict[str, Floats]]:
    balance = statics.balance
    static = statics.static(answer.inputs, answer.quiet) if task.parts else None
    if static is not None:
        static.reactions[~answer.there] = np.nan
    found: dict[str, dict[str, Floats]] = {}
    axes = reaction_axes(statics, answer, task.axes or ())
    for k, name in enumerate(balance.joints):
        joint: dict[str, Floats] = {"reaction": answer.whole.reactions[:, k]}
        if name in balance.guides:
            joint["normal"] = answer.whole.normals[:, balance.guides.index(name)]
        if name in balance.lossy:
            place = balance.lossy.index(name)
            joint["loss"] = answer.whole.losses[:, place]
            if answer.coupled:
                joint["reaction_uncoupled"] = answer.free.reactions[:, k]
                joint["loss_uncoupled"] = answer.free.losses[:, place]
        if static is not None:
            parts = {"static": static.reactions[:, k]}
            parts["inertial"] = answer.free.reactions[:, k] - static.reactions[:, k]
            joint |= {f"reaction_{part}": parts[part] for part in task.parts or ()}
        if unique is not None:
            for word in joint:
                if not unique.given(balance, name, word):
                    joint[word] = np.full_like(joint[word], np.nan)
        for word, frame in axes.get(name, {}).items():
            joint[f"reaction_{word}"] = _in_frame(joint["reaction"], word, frame)
        found[name] = joint
    return found


def unique_of(
    statics: InverseDynamics, answer: PoseForces, unique: Uniqueness | None, summary: Summary
) -> dict[str, dict[str, Matrix | str]]:
    """Return what is unique of each joint; resultants that are go to the summary."""
    if unique is None:
        return {}
    places = {name: k for k, name in enumerate(statics.balance.joints)}
    reactions = answer.whole.reactions
    summary["not_unique"] = [n for k, n in enumerate(places) if not unique.whole[k]]
    known = {name: reactions[:, k] for name, k in places.items()}
    summary["unique_sums"] = resultants(statics.scene.model, unique.sums, known)
    return {name: directions.values(known[name]) for name, directions in unique.joints.items()}


def link_axis(model: Model, name: str) -> tuple[str, float]:
    """Return the link a joint's reaction is taken apart on, and the direction of its axis there.

    It is the second body, else the first, that has another joint apart from this one; the axis
    leads from this joint to that one [rad].
    """
    found, values = _link(model, name), model.mechanism.values()
    if found is None:
        return model.mechanism.joints[name].second_body, 0.0
    here, there = (np.array([values[f"{end}.{axis}"] for axis in "xy"]) for end in found)
    gap = there - here
    return found[0].split(".")[0], float(np.arctan2(gap[1], gap[0]))


def _link(model: Model, name: str) -> tuple[str, str] | None:
    """Return this joint's point and another joint's on the link of `link_axis`, None: there is no
    such link.
    """
    mechanism = model.mechanism
    joint, values = mechanism.joints[name], mechanism.values()

    def local(reference: str) -> Floats:
        return np.array([values[f"{reference}.{axis}"] for axis in mechanism.axes])

    for reference in (joint.second, joint.first):
        body = reference.split(".")[0]
        if body not in mechanism.bodies:
            continue
        here = local(reference)
        for other in mechanism.joints.values():
            for end in (other.first, other.second):
                if end.split(".")[0] == body and other.name != name and (local(end) != here).any():
                    return reference, end
    return None


def reaction_axes(
    statics: InverseDynamics, answer: PoseForces, words: tuple[str, ...]
) -> dict[str, dict[str, Floats]]:
    """Return by joint the axes (n, 3, 3) of its second body and of its link.

    Of a link in space it is its direction (n, 3). What spins freely has no axes; a joint in space
    without a link has no direction, but a vector is one.
    """
    model, joints = statics.scene.model, statics.balance.joints if words else []
    q = absolute(statics.scene, answer.motion)[0] if joints else np.zeros((0, 0))
    orientations = Orientations(model, statics.scene.cache, statics.balance.columns, q)
    links = _link_directions(statics, answer, joints) if model.space.behind else {}
    found: dict[str, dict[str, Floats]] = {}
    for name in joints:
        axes, body = found.setdefault(name, {}), model.mechanism.joints[name].second_body
        for word in words:
            if word == "body" and body not in model.spinning:
                axes[word] = orientations.of(body) if orientations.has(body) else orientations.world
            elif word == "radial" and not model.space.behind:
                link, direction = link_axis(model, name)
                axes[word] = orientations.about(link, direction)
            elif word == "radial" and name in links:
                axes[word] = links[name]
    return found


def _link_directions(
    statics: InverseDynamics, answer: PoseForces, joints: Iterable[str]
) -> dict[str, Floats]:
    """Return the directions (n, 3) of the links of joints in space, of those that have one."""
    model, ways = statics.scene.model, {}
    for name in joints:
        joint = model.mechanism.joints[name]
        ends = (joint.first, joint.second) if joint.pointer else _link(model, name)
        if ends is not None:
            ways[name] = model.point(ends[1]) - model.point(ends[0])
    if not ways:
        return {}
    batch = statics.batch(
        f"directions of {', '.join(ways)}",
        lambda: statics.balance.function("directions", [ca.vertcat(*ways.values())]),
    )
    values = batch(*answer.inputs)[0]
    values = np.broadcast_to(values, (len(answer.standing), values.shape[1])).reshape(-1, 3)
    with np.errstate(invalid="ignore", divide="ignore"):
        unit = values / np.linalg.norm(values, axis=1)[:, None]
    return dict(zip(ways, unit.reshape(-1, len(ways), 3).transpose(1, 0, 2), strict=True))


def without_axes(statics: InverseDynamics, task: Reactions) -> list[str]:
    """Return what is said of joints in space whose reactions have none of the axes asked for."""
    model = statics.scene.model
    if not task.axes or model.mechanism.dimension == 2:
        return []
    joints = {name: model.mechanism.joints[name] for name in statics.balance.joints}
    spun = [n for n, joint in joints.items() if joint.second_body in model.spinning]
    alone = [n for n, joint in joints.items() if not joint.pointer and _link(model, n) is None]
    said = []
    if spun and "body" in task.axes:
        bodies = ", ".join(dict.fromkeys(joints[n].second_body for n in spun))
        said.append(f"{', '.join(spun)}: no reaction_body, {bodies} spins freely and has no axes")
    if alone and "radial" in task.axes:
        said.append(f"{', '.join(alone)}: no reaction_radial, no other joint makes a link of it")
    return said


def _in_frame(reaction: Floats, word: str, axes: Floats) -> Floats:
    """Return a reaction in axes of its second body, or along and across the link."""
    if word == "body":
        return in_axes(axes, reaction)
    if axes.ndim == 3:
        return in_axes(axes, reaction)[:, :2]
    along = np.einsum("ni,ni->n", axes, reaction[:, :3])
    across = np.linalg.norm(reaction[:, :3] - along[:, None] * axes, axis=1)
    return np.stack([along, across], axis=1)


def efforts_of(
    setting: Setting, statics: InverseDynamics, answer: PoseForces, task: Reactions
) -> tuple[Series, dict[str, Series]]:
    names = [row.owner for row in setting.scene.rows if row.driver]

    def listed(efforts: Floats) -> Series:
        return Series({name: efforts[:, k] for k, name in enumerate(names)})

    parts = {}
    if answer.coupled:
        parts["uncoupled"] = listed(answer.free.efforts)
    if task.parts:
        static = statics.static(answer.inputs, answer.quiet).efforts
        static[~answer.there] = np.nan
        both = {"static": static, "inertial": answer.free.efforts - static}
        parts |= {part: listed(both[part]) for part in task.parts}
    return listed(answer.whole.efforts), parts


def solutions_of(
    setting: Setting, statics: InverseDynamics, answer: PoseForces, unique: Uniqueness | None
) -> Iterable[dict[str, Any]]:
    """Yield all solutions of the poses that have several."""
    lead = setting.plan.lead
    names = [row.owner for row in setting.scene.rows if row.driver]
    for k, solutions in answer.found.items():
        if len(solutions.sizes) < 2:
            continue
        one = some(answer.inputs, slice(k, k + 1))
        listed = []
        for i, sizes in enumerate(solutions.sizes):
            loaded = statics.loaded(one, sizes[None, :])
            if unique is not None:
                loaded.reactions[:, ~unique.whole] = np.nan
            listed.append(
                {
                    "efforts": dict(zip(names, loaded.efforts[0].tolist(), strict=True)),
                    "reactions": {
                        name: loaded.reactions[0, j].tolist()
                        for j, name in enumerate(statics.balance.joints)
                    },
                    "connected": solutions.connected == i,
                }
            )
        yield {
            "pose": k,
            "at": float(answer.motion.u[k, lead]),
            "count": len(solutions.sizes),
            "proven": solutions.proven,
            "solutions": listed,
        }


def jams_of(setting: Setting, answer: PoseForces) -> list[Json]:
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
