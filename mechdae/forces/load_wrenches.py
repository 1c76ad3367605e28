"""What each load does to each body in each pose: force and moment."""

from __future__ import annotations

import casadi as ca
import numpy as np

from mechdae.forces.inverse_dynamics import InverseDynamics
from mechdae.forces.pose_forces import PoseForces
from mechdae.results import LazyPart, Series, Summary
from mechdae.types import Floats, Graph


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
