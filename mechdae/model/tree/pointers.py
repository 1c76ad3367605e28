"""Vectors of spatial loops: from their tail to their head by length, elevation and azimuth."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca

from mechdae.describe.joints import Joint
from mechdae.describe.mechanism import Mechanism

WORDS = ("length", "elevation", "azimuth")


def points_of(mechanism: Mechanism) -> set[str]:
    """Return the bodies that are points at the ends of vectors: they do not turn."""
    joints = mechanism.joints.values()
    return {body for joint in joints if joint.pointer for body in joint.bodies}


def span(joint: Joint, numbers: Mapping[str, Any], own: Mapping[str, Any]) -> Any:
    """Return head less tail (3,): what is no number of the mechanism is a coordinate."""
    length, e, a = (own.get(w, numbers.get(f"{joint.name}.{w}")) for w in WORDS)
    level = length * ca.cos(e)
    return ca.vertcat(level * ca.cos(a), length * ca.sin(e), level * ca.sin(a))


def structure_rows(joint: Joint, gap: Any) -> list[tuple[str, Any, str]]:
    """Return as many equations between the two points as the vector takes freedoms.

    For the structure: only which coordinates are in them counts.
    """
    weights = ((1.0, 1.3, 0.7), (0.4, 1.1, 1.9), (1.6, 0.3, 0.8))
    count = 3 - len(joint.coordinates)
    return [
        (axis, ca.dot(ca.DM(list(w)), gap) - k * ca.sumsqr(gap), "m")
        for k, (axis, w) in enumerate(zip("xyz", weights[:count], strict=False))
    ]
