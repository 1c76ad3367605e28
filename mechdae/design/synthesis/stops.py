"""Limits of joints as inequalities of poses: what a design keeps between its stops."""

from __future__ import annotations

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import coordinate
from mechdae.describe.joints.joint import LIMITS, Joint
from mechdae.equations.model import Model
from mechdae.types import Sym

STOP = "limits of "
"""Begins the name of an asked value that is not negative between stops."""


def inside(model: Model, joints: list[Joint], size: float) -> dict[str, Sym]:
    """Return by name what is not negative where joints are within their limits.

    Angles count but for whole turns, unless the limits are a turn apart.
    """
    values, found = model.mechanism.values(), {}
    for joint in joints:
        c = coordinate(model.mechanism, f"{joint.name}.{joint.usual}")
        value = model.coordinate(c)
        low, high = (model.numbers[f"{joint.name}.{end}"] for end in LIMITS)
        span = values[f"{joint.name}.{LIMITS[1]}"] - values[f"{joint.name}.{LIMITS[0]}"]
        if c.is_angle and span < 2 * np.pi:
            rows = ca.cos(value - (low + high) / 2) - ca.cos((high - low) / 2)
        else:
            rows = ca.vertcat(value - low, high - value) / (1.0 if c.is_angle else size)
        found[STOP + joint.name] = rows
    return found
