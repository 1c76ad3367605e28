"""Mechanisms in space whose points and directions are places in one pose, the drawn one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from mechdae.describe.joints.joint import Joint
from mechdae.errors import MechanismError

CLOSED = 1e-6
"""Share of the mechanism's size by which points of a joint may be apart as they are drawn."""
TOLD = 3
"""Points that tell the orientation of a body."""


def drawn_joints(joints: Mapping[str, Joint]) -> dict[str, Joint]:
    """Return joints whose crossed pins are at angle 0 where they are drawn, if no zero is given."""
    found = dict(joints)
    for name, joint in joints.items():
        if joint.spatial and getattr(joint, "crossed", False):
            drawn: Any = joint
            zero = drawn.axis2 if drawn.zero is None else drawn.zero
            zero2 = drawn.axis if drawn.zero2 is None else drawn.zero2
            found[name] = replace(drawn, zero=zero, zero2=zero2)
    return found


def drawn_sketch(
    joints: Mapping[str, Joint], bodies: Mapping[str, Any], sketch: Mapping[str, Any]
) -> dict[str, float]:
    """Return the sketch of the drawn pose: angles are 0, other bodies are at their points.

    Those are bodies without any joint that has an angle, and those that hang in a ball or on a bar.
    """
    found: dict[str, float] = {}
    for name, joint in joints.items():
        angles = [word for word in joint.coordinates if word.startswith("angle")]
        given = {name, *(f"{name}.{word}" for word in joint.coordinates)}
        if not given & sketch.keys():
            found |= {f"{name}.{word}": 0.0 for word in angles}
    for name, body in bodies.items():
        ending = [joint for joint in joints.values() if name in joint.bodies]
        measured = any(joint.coordinates for joint in ending)
        if measured and not any(joint.ball or joint.bar for joint in ending):
            continue
        for point, place in list(body.points.items())[:TOLD]:
            found |= {f"{name}.{point}.{x}": v for x, v in zip("xyz", place, strict=True)}
    return found


def drawn_value(
    joints: Mapping[str, Joint], values: Mapping[str, float], part: str, words: list[str]
) -> float:
    """Return the place of a point or the slide of a joint as drawn, nan of other coordinates."""
    if part not in joints:
        return values.get(".".join([part, *words]), math.nan)
    if words != ["slide"]:
        return math.nan
    joint = joints[part]
    axis = [values[f"{part}.axis.{x}"] for x in "xyz"]
    gap = [values[f"{joint.second}.{x}"] - values[f"{joint.first}.{x}"] for x in "xyz"]
    return sum(a * b for a, b in zip(axis, gap, strict=True)) / math.hypot(*axis)


def check_drawn(joints: Mapping[str, Joint], values: Mapping[str, float], size: float) -> None:
    """Raise for a joint whose points coincide in every pose but not as they are drawn.

    So do its pins for one whose pins are at right angles in every pose.
    """
    for name, joint in joints.items():
        if joint.spatial and getattr(joint, "crossed", False):
            _check_pins(name, values)
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


def _check_pins(name: str, values: Mapping[str, float]) -> None:
    first, second = ([values[f"{name}.{key}.{x}"] for x in "xyz"] for key in ("axis", "axis2"))
    cosine = sum(a * b for a, b in zip(first, second, strict=True))
    cosine /= math.hypot(*first) * math.hypot(*second)
    if abs(cosine) > CLOSED:
        raise MechanismError(
            f"its pins are drawn at {math.degrees(math.acos(cosine)):.6g} degrees, those of a "
            "cross are at right angles",
            where=f"joints.{name}.axis2",
            hint='with frames = "drawn" all directions are those in one assembled pose',
        )
