"""Forces as named series: reactions in several axes, efforts, all solutions, unique directions."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.tasks.reactions import Reactions
from mechdae.equations.model import Model
from mechdae.forces.friction_branches import some
from mechdae.forces.inverse_dynamics import InverseDynamics, absolute
from mechdae.forces.pose_forces import PoseForces
from mechdae.forces.uniqueness import Uniqueness
from mechdae.motion.kinematics.prepared import Setting
from mechdae.results import Series
from mechdae.types import Floats, Json, Matrices


def series_of(
    statics: InverseDynamics, answer: PoseForces, task: Reactions, unique: Uniqueness | None
) -> dict[str, dict[str, Floats]]:
    balance = statics.balance
    static = statics.static(answer.inputs, answer.quiet) if task.parts else None
    if static is not None:
        static.reactions[~answer.there] = np.nan
    found: dict[str, dict[str, Floats]] = {}
    in_plane = statics.scene.model.mechanism.dimension == 2
    turned = {} if in_plane else _axes_in_space(statics, answer, task.axes or ())
    for k, name in enumerate(balance.joints):
        own: dict[str, Floats] = {"reaction": answer.whole.reactions[:, k]}
        if name in balance.guides:
            own["normal"] = answer.whole.normals[:, balance.guides.index(name)]
        if name in balance.lossy:
            place = balance.lossy.index(name)
            own["loss"] = answer.whole.losses[:, place]
            if answer.coupled:
                own["reaction_uncoupled"] = answer.free.reactions[:, k]
                own["loss_uncoupled"] = answer.free.losses[:, place]
        if static is not None:
            parts = {"static": static.reactions[:, k]}
            parts["inertial"] = answer.free.reactions[:, k] - static.reactions[:, k]
            own |= {f"reaction_{part}": parts[part] for part in task.parts or ()}
        if unique is not None:
            for word in own:
                if not unique.given(balance, name, word):
                    own[word] = np.full_like(own[word], np.nan)
        if in_plane:
            own |= _turned(statics, answer, name, own["reaction"], task.axes or ())
        else:
            own |= _turned_in_space(own["reaction"], turned.get(name, {}))
        found[name] = own
    return found


def unique_of(
    statics: InverseDynamics, answer: PoseForces, unique: Uniqueness | None, summary: dict[str, Any]
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


def _resultant(statics: InverseDynamics, reactions: Matrices, body: str, names: list[str]) -> Any:
    """Return the sum of forces (n, d) of joints on a body."""
    size = len(statics.scene.model.space.axes)
    joints = statics.scene.model.mechanism.joints
    places = {name: k for k, name in enumerate(statics.balance.joints)}
    return sum(
        (1 if joints[name].second_body == body else -1) * reactions[:, places[name], :size]
        for name in names
    )


def _turned(
    statics: InverseDynamics, answer: PoseForces, name: str, reaction: Any, axes: tuple[str, ...]
) -> dict[str, Floats]:
    """Return a reaction in axes of its second body, and along and across the link."""
    found: dict[str, Floats] = {}
    model = statics.scene.model
    joint = model.mechanism.joints[name]
    for word in axes:
        body, direction = joint.second_body, 0.0
        if word == "radial":
            body, direction = link_axis(model, name)
        angle = np.full(len(reaction), direction)
        if body in model.mechanism.bodies:
            column = statics.balance.columns.index(model.turn(body))
            angle = angle + absolute(statics.scene, answer.motion)[0][:, column]
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


def _axes_in_space(
    statics: InverseDynamics, answer: PoseForces, words: tuple[str, ...]
) -> dict[str, dict[str, Floats]]:
    """Return by joint the axes of its second body (n, 3, 3) and its link's direction (n, 3).

    What spins freely has no axes; a joint without a link has no direction, but a vector is one.
    """
    model, entries = statics.scene.model, []
    for name in statics.balance.joints if words else ():
        joint = model.mechanism.joints[name]
        if "body" in words and joint.second_body not in model.spinning:
            entries.append((name, "body", ca.vec(model.frame(joint.second_body).R)))
        ends = (joint.first, joint.second) if joint.pointer else _link(model, name)
        if "radial" in words and ends is not None:
            way = model.point(ends[1]) - model.point(ends[0])
            entries.append((name, "radial", way))
    if not entries:
        return {}
    own = ", ".join(f"{name} {word}" for name, word, _ in entries)
    batch = statics.batch(
        f"axes of {own}",
        lambda: statics.balance.function("axes", [ca.vertcat(*[entry[2] for entry in entries])]),
    )
    values = batch(*answer.inputs)[0]
    values = np.broadcast_to(values, (len(answer.standing), values.shape[1]))
    found: dict[str, dict[str, Floats]] = {}
    start = 0
    for name, word, expression in entries:
        part = values[:, start : start + expression.numel()]
        start += expression.numel()
        if word == "body":
            part = part.reshape(-1, 3, 3)  # columns of the rotation are rows here
        else:
            with np.errstate(invalid="ignore", divide="ignore"):
                part = part / np.linalg.norm(part, axis=1)[:, None]
        found.setdefault(name, {})[word] = part
    return found


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


def _turned_in_space(reaction: Floats, axes: dict[str, Floats]) -> dict[str, Floats]:
    """Return a reaction (n, 6) in axes of its second body, and along and across the link."""
    found: dict[str, Floats] = {}
    force = reaction[:, :3]
    if "body" in axes:
        parts = reaction.reshape(-1, 2, 3)
        found["reaction_body"] = np.einsum("nij,nkj->nki", axes["body"], parts).reshape(-1, 6)
    if "radial" in axes:
        along = np.einsum("ni,ni->n", axes["radial"], force)
        across = np.linalg.norm(force - along[:, None] * axes["radial"], axis=1)
        found["reaction_radial"] = np.stack([along, across], axis=1)
    return found


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
    for k, own in answer.found.items():
        if len(own.sizes) < 2:
            continue
        one = some(answer.inputs, slice(k, k + 1))
        listed = []
        for i, sizes in enumerate(own.sizes):
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
