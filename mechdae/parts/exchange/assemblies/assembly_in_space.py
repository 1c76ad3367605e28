"""An assembly with joints in space as a mechanism whose frames are drawn in the file's pose."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mechdae.describe import Joint, Mechanism
from mechdae.describe.joints.spatial import (
    Cylindrical,
    PlanarPair,
    Screw,
    SpatialPrismatic,
    SpatialRevolute,
    SpatialWeld,
    Spherical,
    Universal,
)
from mechdae.errors import UnavailableError
from mechdae.parts.exchange.assemblies.asmt_read import AsmtFrame, AsmtJoint
from mechdae.parts.exchange.assemblies.assembly_parts import JoinedAssembly
from mechdae.types import Floats

KINDS: dict[str, Any] = {
    "RevoluteJoint": SpatialRevolute,
    "TranslationalJoint": SpatialPrismatic,
    "CylindricalJoint": Cylindrical,
    "SphericalJoint": Spherical,
    "UniversalJoint": Universal,
    "PlanarJoint": PlanarPair,
    "ScrewJoint": Screw,
    "FixedJoint": SpatialWeld,
}
WITHOUT_AXIS = ("SphericalJoint", "FixedJoint")
DIGITS = 15
"""Digits that are kept: superfluous equations hold no better than they."""


def mechanism_of_space(
    made: JoinedAssembly, remarks: list[str]
) -> tuple[Mechanism, dict[str, tuple[str, float, float, float]]]:
    """Return the mechanism, and how coordinates of joints follow from those of the file."""
    starts: dict[str, tuple[str, float, float, float]] = {}
    joints = [_joint(made, joint, starts) for joint in made.joints]
    gravity = _rounded(made.assembly.gravity * made.unit)
    remarks.append("joints in space: points and axes are places of the file's pose")
    mechanism = made.mechanism(
        joints,
        lambda side: _rounded(made.markers[side].origin),
        lambda part: _mass(made, part),
        gravity=gravity if any(gravity) else None,
        dimension=3,
        frames="drawn",
    )
    return mechanism, starts


def _joint(
    made: JoinedAssembly, joint: AsmtJoint, starts: dict[str, tuple[str, float, float, float]]
) -> Joint:
    kind = KINDS.get(joint.form)
    if kind is None:
        raise UnavailableError(
            f"a {joint.form} has no counterpart",
            where=f"{made.path}: {joint.name}",
            hint=f"read are {', '.join(KINDS)}, in the plane GearJoint too",
        )
    name = made.names[joint.name]
    ends = made.reference(joint.first), made.reference(joint.second)
    given: dict[str, Any] = {}
    one, other = made.markers[joint.first], made.markers[joint.second]
    if joint.form not in WITHOUT_AXIS:
        given["axis"] = _rounded(one.R[:, 2])
    if joint.form == "UniversalJoint":
        given["axis2"] = _rounded(other.R[:, 2])
    if joint.form == "ScrewJoint":
        given["pitch"] = joint.numbers.get("pitch", 0.0) * made.unit
    first = made.body(joint.first)
    turned = one.R.T @ other.R
    if joint.form in ("RevoluteJoint", "CylindricalJoint"):
        # angles are 0 in the pose of the file, where the markers may be turned
        angle = math.atan2(turned[1, 0], turned[0, 0])
        starts[f"{name}.angle"] = (first, 1.0, 1.0, round(-angle, DIGITS) + 0.0)
    if joint.form == "TranslationalJoint":
        starts[f"{name}.slide"] = (first, 1.0, made.unit, 0.0)
    made_joint: Joint = kind(name, *ends, **given)
    return made_joint


def _mass(made: JoinedAssembly, part: str) -> dict[str, Any]:
    """Return what a part weighs, in the fixed frame of the file's pose."""
    weighed = made.weighed(part)
    if weighed is None:
        return {}
    mass, frame, moments = weighed
    here = AsmtFrame(frame.origin * made.unit, frame.R).inside(made.frames[part])
    inertia = here.R @ np.diag(moments * made.unit**2) @ here.R.T
    found: dict[str, Any] = {"mass": mass, "center": _rounded(here.origin)}
    if np.linalg.eigvalsh(inertia).min() > 0:
        pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
        found["inertia"] = tuple(float(inertia[i, j]) for i, j in pairs)
    return found


def _rounded(values: Floats) -> tuple[float, ...]:
    return tuple(round(float(value), DIGITS) + 0.0 for value in values)
