"""What a page draws: links, joints, guides and wheels as data; places come from the points."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mechdae.describe import GROUND, Mechanism
from mechdae.describe.joints.curve import follows_curve, place, span
from mechdae.parts.page.space_scenes import joint_in_space

if TYPE_CHECKING:
    from mechdae.types import Json


SAMPLES = 240
"""Pieces of a curve."""


def drawn(mechanism: Mechanism) -> Json:
    """Return the bodies, points and joints of the diagram.

    ``bodies``: name, number on the diagram, references of the points that shape it.
    ``joints``: name, kind, references of its two points, what is drawn there; angles of guides
    are in the frame of the first body. ``ground``: names of the fixed points, with their places.
    """
    values = mechanism.values()
    used = {end for joint in mechanism.joints.values() for end in (joint.first, joint.second)}
    bodies = []
    for number, (name, body) in enumerate(mechanism.bodies.items(), start=1):
        outline = [f"{name}.{point}" for point in body.outline or ()]
        points = [f"{name}.{point}" for point in body.points]
        bodies.append(
            {
                "name": name,
                "number": body.number if body.number is not None else number,
                "shape": outline or points,
                "free": [reference for reference in points if reference not in used],
            }
        )
    joints = [_joint(mechanism, name, values) for name in mechanism.joints]
    ground = [f"{GROUND}.{name}" for name in mechanism.ground.points]
    places = [[values[f"{point}.{axis}"] for axis in mechanism.axes] for point in ground]
    return {
        "dimension": mechanism.dimension,
        "bodies": bodies,
        "joints": joints,
        "ground": ground,
        "places": places,
    }


def turned(scene: Json) -> set[str]:
    """Return the bodies whose angles the diagram needs: guides and curves turn with them."""
    joints = [joint for joint in scene["joints"] if "curve" in joint or "axis" in joint]
    return {joint["first"].split(".")[0] for joint in joints if scene["dimension"] == 2} - {GROUND}


def round_off(value: float) -> float:
    """Return a coordinate with as many digits as a picture shows."""
    return float(f"{value:.6g}")


def _joint(mechanism: Mechanism, name: str, values: dict[str, float]) -> Json:
    joint = mechanism.joints[name]
    entry: Json = {
        "name": name,
        "kind": joint.kind,
        "first": joint.first,
        "second": joint.second,
        "fixed": GROUND in joint.bodies,
        "pin": joint.coincide,
        "rigid": joint.rigid,
    }
    if mechanism.dimension == 3:
        return entry | joint_in_space(mechanism, joint)
    if follows_curve(joint):
        first, last = span(joint, values)
        at = [first + (last - first) * k / SAMPLES for k in range(SAMPLES + 1)]
        entry |= {"curve": [[round_off(v) for v in place(joint, values, s)] for s in at]}
        entry |= {"closed": joint.closed, "roller": values.get(f"{name}.roller_radius", 0.0)}
    if joint.straight:
        entry |= {"axis": values[f"{name}.axis"], "block": joint.keeps_angle}
    if joint.wheels == 2:
        entry |= {"ratio": joint.turn_ratio(values), "strands": joint.strands}
    elif joint.wheels == 1:
        entry["radius"] = abs(values[f"{name}.radius"])
    return entry
