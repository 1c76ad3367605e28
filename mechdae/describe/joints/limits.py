"""Joints that move between limits, or in gaps."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from mechdae.describe.joints.joint import GAPS, Joint
from mechdae.errors import MechanismError

if TYPE_CHECKING:
    from mechdae.describe.mechanism import Mechanism


def limited(joints: Mapping[str, Joint]) -> list[Joint]:
    """Return the joints that have limits."""
    return [joint for joint in joints.values() if getattr(joint, "limits", None) is not None]


def with_gaps(joints: Mapping[str, Joint], values: Mapping[str, float]) -> list[str]:
    """Return the joints that have a gap."""
    return [name for name in joints if any(values.get(f"{name}.{key}", 0.0) for key in GAPS)]


def in_gaps(joints: Mapping[str, Joint], values: Mapping[str, float]) -> list[str]:
    """Return the joints that may move in a gap: it is given, with a restitution."""
    return [name for name in with_gaps(joints, values) if f"{name}.restitution" in values]


def check_size(mechanism: Mechanism, joint: Joint, key: str, size: float) -> None:
    """Raise for a gap [m] that is as large as a link of the joint, up to its next joint."""
    if key == "backlash_angle":
        return
    values = mechanism.values()
    used = {point for each in mechanism.joints.values() for point in (each.first, each.second)}
    places = {point: (values[f"{point}.x"], values[f"{point}.y"]) for point in used}
    for side, body in zip((joint.first, joint.second), joint.bodies, strict=False):
        if body not in mechanism.bodies:
            continue
        beside = [place for point, place in places.items() if point.split(".")[0] == body]
        links = [math.dist(place, places[side]) for place in beside]
        length = min((link for link in links if link > 0), default=math.inf)
        if size >= length:
            raise MechanismError(
                f"{key} is {size:g} m, and from there to the next joint of {body} it is "
                f"{length:g} m: it has to be smaller than the link",
                where=f"joints.{joint.name}.{key}",
            )
