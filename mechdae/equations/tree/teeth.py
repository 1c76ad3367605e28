"""A mesh in space: its equation, and how its axes lie: parallel, meeting or crossing.

What is told apart by numbers is told here, with the keys that are missing; the pitch point and its
directions follow in symbols where forces are asked for.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.describe.joints.bearings import Bearing, bearings
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.errors import MechanismError, UnavailableError
from mechdae.records import dataclass
from mechdae.types import Floats

if TYPE_CHECKING:
    from mechdae.types import Sym

SAME = 1e-9
"""Sine, or share of the mechanism's size, below which directions or places are one."""
AXES = "xyz"


@dataclass(frozen=True)
class AxesOfMesh:
    """Kind "parallel", "meeting" or "crossing" of axes, and on which side of an apex teeth lie.

    ``side`` is the sense of the common generatrix along ratio a1 - a2.
    """

    kind: str
    side: float = 1.0


@dataclass(frozen=True)
class _Member:
    """A wheel or rack as its carrier sees it: axis (3,), a point of it, height of its own point."""

    axis: Floats
    place: Floats
    height: float


def axes_of_mesh(mechanism: Mechanism, mesh: Joint) -> AxesOfMesh:
    """Return how the members of a mesh lie on their carrier.

    Raises
    ------
    MechanismError, UnavailableError
        Teeth that have no place, with the key that would give them one.
    """
    values = mechanism.values()
    members = [_member(mechanism, mesh, k, values) for k in range(2)]
    first, second = members
    given, where = getattr(mesh, "point", None) is not None, f"joints.{mesh.name}"
    length = mechanism.scale
    sine = float(np.linalg.norm(np.cross(first.axis, second.axis)))
    gap = second.place - first.place
    if mesh.wheels == 1:
        if abs(first.axis @ second.axis) <= SAME:
            return AxesOfMesh("parallel")
        return _crossing(mesh, values)
    if sine <= SAME:
        across = gap - first.axis * (first.axis @ gap)
        if np.linalg.norm(across) <= SAME * length:
            raise UnavailableError(
                f"{mesh.name} has no teeth: both wheels turn about one line, its forces are not "
                f"computed in space",
                where=where,
                hint="the wheels between them, or leave forces out",
            )
        if abs(1 - np.sign(first.axis @ second.axis) * values[f"{mesh.name}.ratio"]) <= SAME:
            raise MechanismError(
                f"wheels side by side whose ratio is {values[f'{mesh.name}.ratio']:g} have no "
                f"pitch point",
                where=f"{where}.ratio",
            )
        sense = np.sign(first.axis @ second.axis)
        apart = gap @ first.axis + sense * second.height - first.height
        if not given and abs(apart) > SAME * length:
            raise MechanismError(
                f"the points {mesh.first} and {mesh.second} lie at different heights along the "
                f"axes: where do the teeth meet?",
                where=f"{where}.between",
                hint='points in one plane across the axes, or point = "CARRIER.POINT"',
            )
        return AxesOfMesh("parallel")
    normal = np.cross(first.axis, second.axis) / sine
    if abs(normal @ gap) > SAME * length:
        return _crossing(mesh, values)
    return AxesOfMesh("meeting", 1.0 if given else _side(mesh, members, values, length))


def _member(mechanism: Mechanism, mesh: Joint, k: int, values: dict[str, float]) -> _Member:
    """Return a wheel or rack in the axes of the carrier."""
    bearing: Bearing = bearings(mechanism, mesh)[k]
    joint, wheel = mechanism.joints[bearing.joint], bearing.word == "angle"
    if not (joint.hinge if wheel else joint.guide):
        raise UnavailableError(
            f"forces of teeth need a {'revolute' if wheel else 'prismatic'} joint of "
            f"{mesh.bodies[k]} on its carrier, {joint.name} is {joint.kind}",
            where=f"joints.{mesh.name}",
            hint="another joint, or leave forces out",
        )
    carrier = getattr(mesh, "carrier", None) or GROUND
    carries_second = joint.second_body == carrier
    sides: Any = joint
    axes = [
        _unit(_numbers(values, f"{joint.name}.{sides.side(second)[0]}"))
        for second in (carries_second, not carries_second)
    ]
    here, there = (joint.second, joint.first) if carries_second else (joint.first, joint.second)
    reference = mesh.second if k else mesh.first
    arm = _numbers(values, reference) - _numbers(values, there)
    return _Member(axes[0], _numbers(values, here), float(axes[1] @ arm) if wheel else 0.0)


def _crossing(mesh: Joint, values: dict[str, float]) -> AxesOfMesh:
    """Return how axes that cross lie; what they need is given."""
    where = f"joints.{mesh.name}"
    for key, what, hint in (
        ("point", "the pitch point", 'point = "CARRIER.POINT"'),
        ("helix", "the helix of the first wheel's teeth", "helix_deg = ..., right-handed positive"),
    ):
        missing = getattr(mesh, key, None) is None
        if missing:
            raise MechanismError(
                f"the axes of {mesh.name} cross: forces of its teeth need {what}",
                where=f"{where}.{key}",
                hint=hint,
            )
    if values.get(f"{mesh.name}.mesh_loss", 0.0):
        raise UnavailableError(
            "mesh_loss of axes that cross is not computed by this version: teeth slide along "
            "their helix there",
            where=f"{where}.mesh_loss",
        )
    return AxesOfMesh("crossing")


def _side(mesh: Joint, members: list[_Member], values: dict[str, float], length: float) -> float:
    """Return on which side of the apex the teeth lie: that of the wheels' own points."""
    first, second = members
    where = f"joints.{mesh.name}"
    if not values.get(f"{mesh.name}.radius", 0.0) > 0:
        raise MechanismError(
            f"the axes of {mesh.name} meet: forces of its teeth need the mean pitch radius of the "
            f"first wheel",
            where=f"{where}.radius",
            hint="radius = ... [m], or point",
        )
    gap, cosine = second.place - first.place, first.axis @ second.axis
    to_apex = (gap @ first.axis - cosine * (gap @ second.axis)) / (1 - cosine**2)
    apex = first.place + to_apex * first.axis
    way = values[f"{mesh.name}.ratio"] * first.axis - second.axis
    votes = []
    for member in members:
        height = (member.place - apex) @ member.axis + member.height
        if abs(height) > SAME * length and abs(way @ member.axis) > SAME * np.linalg.norm(way):
            votes.append(np.sign(height * (way @ member.axis)))
    if len(set(votes)) != 1:
        raise MechanismError(
            f"the points {mesh.first} and {mesh.second} do not tell on which side of the apex "
            f"the teeth of {mesh.name} lie",
            where=f"{where}.between",
            hint='points of the axes beside the apex, where the wheels are, or '
            'point = "CARRIER.POINT"',
        )  # fmt: skip
    return float(votes[0])


def _numbers(values: dict[str, float], name: str) -> Floats:
    return np.array([values[f"{name}.{axis}"] for axis in AXES])


def _unit(vector: Floats) -> Floats:
    return vector / np.linalg.norm(vector)


def meshed(
    mechanism: Mechanism, mesh: Joint, number: Callable[[str], Any], value: Callable[..., Any]
) -> tuple[Sym, str]:
    """Return the equation of a mesh and its unit.

    Parameters
    ----------
    number
        Gives a number of the mesh by its key.
    value
        Gives the coordinate of a joint by the joint and the word.
    """
    first, second = (b.sense * value(b.joint, b.word) for b in bearings(mechanism, mesh))
    if mesh.wheels > 1:
        return number("ratio") * second + number("phase") - first, "rad"
    return number("radius") * first + number("phase") - second, "m"
