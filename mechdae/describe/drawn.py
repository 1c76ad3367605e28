"""Mechanisms in space whose points and directions are places in one pose, the drawn one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mechdae.describe.joints import Joint
from mechdae.errors import MechanismError

CLOSED = 1e-6
"""Share of the mechanism's size by which points of a joint may be apart as they are drawn."""
TOLD = 3
"""Points that tell the orientation of a body."""


def drawn_sketch(
    joints: Mapping[str, Joint], bodies: Mapping[str, Any], sketch: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the sketch of the drawn pose: angles are 0, bodies without any are at their points."""
    found: dict[str, Any] = {}
    for name, joint in joints.items():
        angles = [word for word in joint.coordinates if word.startswith("angle")]
        given = {name, *(f"{name}.{word}" for word in joint.coordinates)}
        if not given & sketch.keys():
            found |= {f"{name}.{word}": 0.0 for word in angles}
    for name, body in bodies.items():
        own = [joint for joint in joints.values() if name in joint.bodies]
        if any(joint.coordinates for joint in own):
            continue
        for point, place in list(body.points.items())[:TOLD]:
            found |= {f"{name}.{point}.{x}": v for x, v in zip("xyz", place, strict=True)}
    return found


def check_drawn(joints: Mapping[str, Joint], values: Mapping[str, float], size: float) -> None:
    """Raise for a joint whose points coincide in every pose but not as they are drawn."""
    for name, joint in joints.items():
        if not joint.coincide:
            continue
        gap = sum(
            (values[f"{joint.first}.{x}"] - values[f"{joint.second}.{x}"]) ** 2 for x in "xyz"
        )
        if gap**0.5 > CLOSED * size:
            raise MechanismError(
                f"{joint.first} and {joint.second} are drawn {gap**0.5:g} m apart",
                where=f"joints.{name}.between",
                hint='with frames = "drawn" all points are places in one assembled pose',
            )
