"""What is wrong with forces in sentences: jams, several solutions, slack belts, failed checks."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from mechdae.describe.assumed import about_blocks, about_bodies, about_inertia, about_springs
from mechdae.describe.tasks.reactions import Reactions
from mechdae.forces.friction_branches import FrictionSolutions
from mechdae.forces.inverse_dynamics import InverseDynamics
from mechdae.forces.pose_forces import PoseForces
from mechdae.motion.assembly.not_assembled import shown
from mechdae.motion.kinematics.prepared import Setting
from mechdae.types import Booleans, Floats, Integers

TOLERANCE = 1e-9
"""Share by which a check may fail before the result says so."""


def lost_poses(setting: Setting, answer: PoseForces, places: Integers) -> list[str]:
    """Return a sentence on poses that assemble and have no finite forces."""
    if not places.size:
        return []
    c = setting.plan.coordinates[setting.plan.lead]
    first = shown(c.unit, float(answer.motion.u[places[0], setting.plan.lead]))
    return [
        f"{places.size} of {len(answer.motion)} poses have no finite forces, first at "
        f"{c.text} = {first}: "
        f"the constraints lose their rank there (a change point)"
    ]


def verdicts(setting: Setting, answer: PoseForces) -> list[str]:
    """Return what is wrong in sentences: jammed and ambiguous poses."""
    c = setting.plan.coordinates[setting.plan.lead]
    at = answer.motion.u[:, setting.plan.lead]

    def place(k: int) -> str:
        return f"{c.text} = {shown(c.unit, float(at[k]))}"

    jammed, ambiguous = np.flatnonzero(answer.jammed), np.flatnonzero(answer.ambiguous)
    return about_friction(len(at), jammed, ambiguous, answer.found, place)


def about_friction(
    n: int, jammed: Integers, ambiguous: Integers, found: Mapping[int, FrictionSolutions],
    place: Callable[[int], str],
) -> list[str]:  # fmt: skip
    """Return sentences on poses of `n` that jam or have several solutions, given by number.

    `found` are the solutions of each, `place` says where a pose is.
    """
    faults = []
    if len(jammed):
        solutions = found[int(jammed[0])]
        text = f"{len(jammed)} of {n} poses are jammed: no equilibrium with friction, first at "
        text += place(int(jammed[0]))
        if solutions.critical is not None:
            text += f", where it jams from {solutions.critical:.6g} times the friction given on"
            text += f", by joint {solutions.joint}" if solutions.joint else ""
        faults.append(text)
    if len(ambiguous):
        known = all(found[int(k)].connected is not None for k in ambiguous)
        which = "the one that continues from no friction" if known else "one of them"
        faults.append(
            f"{len(ambiguous)} of {n} poses have several solutions, first at "
            f"{place(int(ambiguous[0]))}; {which} is given, all are listed"
        )
    return faults


def slack(statics: InverseDynamics, answer: PoseForces) -> list[str]:
    """Return belts whose slack strand would have to push."""

    def moment(name: str) -> Floats:
        return answer.whole.reactions[:, statics.balance.joints.index(name), 2]

    def when(slack: Booleans) -> str:
        return f" at {int(slack.sum())} of {len(slack)} poses"

    scene = statics.scene
    found: list[str] = []
    for case in scene.cases("forces of joints"):
        found += case.slack_belts(scene.model, statics.meshes, moment, when)
    return found


def failed_checks(found: Mapping[str, float]) -> list[str]:
    return [
        f"check '{name}' fails: {value:.3g} of the forces and powers in it"
        for name, value in found.items()
        if value is not None and not value <= TOLERANCE
    ]


def assumptions_of(statics: InverseDynamics, task: Reactions) -> list[str]:
    mechanism = statics.scene.model.mechanism
    balance = statics.balance
    found = about_inertia(mechanism, task)
    found += about_bodies(mechanism, balance.bodies, moves=not task.quasi_static)
    found += about_springs(mechanism)
    if task.friction != "none":
        lossy = balance.lossy
        found += about_blocks(mechanism, lossy)
        smooth = [
            name for name in balance.joints if name not in lossy and mechanism.joints[name].rubs
        ]
        if lossy and smooth:
            found.append(f"without friction: {', '.join(smooth)}")
    return found
