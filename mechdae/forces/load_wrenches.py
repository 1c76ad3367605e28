"""What each load does to each body in each pose: force and moment."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from mechdae.forces.inverse_dynamics import Statics
from mechdae.forces.pose_forces import PoseForces
from mechdae.model.model import Model
from mechdae.results import Later, Series, Summary


def acting_loads(statics: Statics, answer: PoseForces) -> Summary:
    """Return `load_wrenches` by load, computed when one of them is read."""
    later = Later(lambda: load_wrenches(statics, answer))
    return Summary(dict.fromkeys(statics.loads.wrenches, later))


def load_wrenches(statics: Statics, answer: PoseForces) -> dict[str, Series]:
    """Return force [N] and moment about the body's origin [N m] by load and body, (n, 3) each.

    World axes; weights are under ``gravity``. They follow from the loads alone, reactions are not
    in them. nan where the pose has no forces.
    """
    model = statics.scene.model
    entries = [
        (name, body, [wrench.get(i, 0.0) for i in model.twist(body)])
        for name, wrench in statics.loads.wrenches.items()
        for body in model.mechanism.bodies
        if body not in statics.scene.not_in_scene and any(i in wrench for i in model.twist(body))
    ]
    if not entries:
        return {}

    def make() -> Any:
        column = [_at_origin(model, body, parts) for _, body, parts in entries]
        return statics.balance.function("load_wrenches", [ca.vertcat(*column)])

    values = statics.batch("load wrenches", make)(*answer.inputs)[0]
    values = np.broadcast_to(values, (len(answer.standing), values.shape[1])).copy()
    values[~answer.standing] = np.nan
    found: dict[str, dict[str, Any]] = {}
    for k, (name, body, _) in enumerate(entries):
        found.setdefault(name, {})[body] = values[:, 3 * k : 3 * k + 3]
    return {name: Series(bodies) for name, bodies in found.items()}


def _at_origin(model: Model, body: str, parts: list[Any]) -> Any:
    """Return the force and the moment about the body's origin of a generalised force."""
    force = ca.vertcat(*parts[:-1])
    arm = model.frame(body).r - model.origin(body)
    return ca.vertcat(force, parts[-1] + model.space.moment(arm, force))
