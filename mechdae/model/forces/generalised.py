"""Forces on bodies as generalised forces of the absolute coordinates.

A generalised force is kept as {position in q: expression}: most of them touch one or two
bodies only.
"""

from __future__ import annotations

from typing import Any

import casadi as ca

from mechdae.describe.mechanism import GROUND
from mechdae.model.model import Model

SX = ca.SX
Wrench = dict[int, Any]


def add(*parts: Wrench) -> Wrench:
    """Return the sum of generalised forces."""
    total: Wrench = {}
    for part in parts:
        for i, value in part.items():
            total[i] = total[i] + value if i in total else value
    return total


def put(total: Wrench, factor: Any, part: Wrench) -> None:
    """Add a generalised force, multiplied by a number, to another one in place."""
    for i, value in part.items():
        own = factor * value
        total[i] = total[i] + own if i in total else own


def times(factor: Any, wrench: Wrench) -> Wrench:
    """Return a generalised force multiplied by a number."""
    return {i: factor * value for i, value in wrench.items()}


def gradients(column: Any, symbols: Any) -> list[Wrench]:
    """Return the gradient of each entry of a column, by position in `symbols`."""
    jacobian = ca.jacobian(column, symbols)
    result: list[Wrench] = [{} for _ in range(jacobian.shape[0])]
    triplet = zip(*jacobian.sparsity().get_triplet(), jacobian.nonzeros(), strict=True)
    for i, j, entry in triplet:
        result[i][j] = entry
    return result


def push(model: Model, body: str, place: Any, force: Any) -> Wrench:
    """Return the generalised force of a `force` (2,) at a `place` (2,), world axes, on a body."""
    if body == GROUND:
        return {}
    arm = place - model.frame(body).r
    parts = (force[0], force[1], model.space.moment(arm, force))
    return dict(zip(model.twist(body), parts, strict=True))


def couple(model: Model, body: str, moment: Any) -> Wrench:
    """Return the generalised force of a couple on a body."""
    return {} if body == GROUND else {model.turn(body): moment}


def pair(model: Model, first: str, second: str, place: Any, force: Any) -> Wrench:
    """Return that of a force on the second body, and its opposite on the first, at a place."""
    return add(push(model, second, place, force), push(model, first, place, -force))


def couples(model: Model, first: str, second: str, moment: Any) -> Wrench:
    """Return that of a couple on the second body, and its opposite on the first."""
    return add(couple(model, second, moment), couple(model, first, -moment))


def on_body(model: Model, wrench: Wrench, body: str, place: Any) -> tuple[Any, Any, Any]:
    """Return force and moment about `place` of the part of a wrench that acts on a body."""
    x, y, moment = (wrench.get(i, SX(0)) for i in model.twist(body))
    return x, y, moment - model.space.moment(place - model.frame(body).r, (x, y))


def reaction(model: Model, name: str, wrench: Wrench) -> list[Any]:
    """Return force and moment about the second body's point, on the second body, of a joint."""
    joint, place = model.mechanism.joints[name], model.ends[name].p2
    if joint.second_body == GROUND:
        return [-part for part in on_body(model, wrench, joint.first_body, place)]
    return list(on_body(model, wrench, joint.second_body, place))


def velocity(model: Model, body: str, place: Any) -> Any:
    """Return the velocity (2,) of a body's material point that is now at `place`."""
    if body == GROUND:
        return SX.zeros(2)
    twist = model.velocity[model.twist(body)]
    return model.space.velocity(twist, place - model.frame(body).r)


def spin(model: Model, body: str) -> Any:
    """Return the angular velocity of a body."""
    return SX(0) if body == GROUND else model.velocity[model.turn(body)]
