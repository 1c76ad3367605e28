"""Joints in gaps: how far a clearance or a backlash opens the equations of its joint."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca

from mechdae.describe.joints.joint import Joint
from mechdae.types import Sym


def opened(joint: Joint, key: str, numbers: Mapping[str, Any], centres: Sym) -> dict[str, Sym]:
    """Return how far the gap of a joint opens each of its equations alone, by part.

    Parameters
    ----------
    key
        ``clearance``, ``backlash`` or ``backlash_angle``.
    numbers
        Of the mechanism, floats or expressions.
    centres
        Distance of the centres of two wheels.
    """
    name, size = joint.name, numbers[f"{joint.name}.{key}"]
    if joint.hinge:
        return {"x": size, "y": size}
    if joint.straight:
        length = numbers.get(f"{name}.contact_length") if joint.guide else None
        if length is None:
            return {"n": size}
        return {"n": size, "turn": ca.asin(2 * size / length)}  # both ends within the guide
    if key == "backlash" and joint.wheels == 2:
        return {"mesh": size / 2 * abs(1 - numbers[f"{name}.ratio"]) / centres}
    return {"mesh": size / 2}
