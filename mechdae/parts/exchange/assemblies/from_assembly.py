"""An assembly of Ondsel or FreeCAD as a problem: of the plane where its joints allow it.

Revolute and cylindrical joints about one direction, translations across it: a mechanism of the
plane. Else the joints are those of space, and the file must show an assembled pose. Joints that
have no counterpart are refused.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np

from mechdae.describe import GROUND, Driver, Joint, Mechanism, Problem, Sweep, Table, Task
from mechdae.describe.expression import evaluate, names_in
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
from mechdae.errors import InputError, MechdaeError, UnavailableError
from mechdae.parts.exchange.assemblies.asmt_read import (
    AsmtAssembly,
    AsmtFrame,
    AsmtJoint,
    AsmtMotion,
    JoinedAssembly,
    joined,
    read_assembly,
)
from mechdae.parts.exchange.assemblies.assembly_in_plane import mechanism_of_plane, plane_of
from mechdae.parts.exchange.drawings.dxf_read import NAMED
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
"""Digits that are kept: redundant equations hold no better than they."""
FREECAD = "OndselAssembly"
"""What FreeCAD calls its assemblies: they are in millimetres."""
POSES, MOST = 181, 1441
DOUBLE = re.compile(r"(?<![\w.])(\d+(?:\.\d*)?)d(?![\w-])")
"""Numbers as Smalltalk writes them, 2.0d; what follows after a minus sign is an exponent there."""
PLANE = {"revolute": 2, "prismatic": 2, "weld": 3, "gear": 1, "rack": 1}
SPACE = {
    **{"revolute": 5, "prismatic": 5, "weld": 6, "cylindrical": 4, "spherical": 3},
    **{"universal": 4, "screw": 5, "planar": 3},
}
"""What joints that are read take of the freedoms of bodies."""


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
    given: dict[str, object] = {}
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


def problem_of_assembly(path: str | Path, unit: str | None = None) -> tuple[Problem, list[str]]:
    """Return the problem in an assembly file, and remarks on what was made of it.

    `unit`: unit of its lengths: "mm", "cm", "m", "in" or "ft". Without one metres, and millimetres
    in files of FreeCAD.
    """
    if unit is not None and unit not in NAMED:
        raise InputError(f"unknown unit '{unit}'", where="--unit", hint=", ".join(NAMED))
    assembly = read_assembly(path)
    chosen = unit or ("mm" if assembly.name == FREECAD else "m")
    remarks = [f"lengths in {chosen}"]
    made = joined(assembly, NAMED[chosen], str(path))
    plane = plane_of(made)
    if plane is None:
        mechanism, starts = mechanism_of_space(made, remarks)
    else:
        mechanism, starts = mechanism_of_plane(made, plane, remarks)
    remarks += assembly.remarks
    if assembly.others:
        remarks.append(f"left out: {', '.join(assembly.others)}")
    tasks = _tasks(assembly, made, mechanism, starts, remarks)
    name = re.sub(r"\W", "_", Path(path).stem)
    title = f"From the assembly {Path(path).name}"
    return Problem(mechanism, Table(tasks), name=name, title=title), remarks


def _tasks(
    assembly: AsmtAssembly,
    made: JoinedAssembly,
    mechanism: Mechanism,
    starts: dict[str, tuple[str, float, float, float]],
    remarks: list[str],
) -> dict[str, Task]:
    """Return the sweep that the motions of a file ask for, else one of a joint on the ground."""
    laws = [_law(assembly, made, starts, motion) for motion in assembly.motions]
    times = assembly.times
    moving = [law for law in laws if law is not None]
    count = _freedoms(mechanism)
    if count > max(len(moving), 1):
        driven = f", {len(moving)} driven" if moving else ""
        remarks.append(
            f"mobility by count {count}{driven}: tasks with drivers are left to be written"
        )
        return {}
    if moving and times is not None and times[1] > times[0] and times[2] > 0:
        first, last, step = times
        poses = min(max(round((last - first) / step) + 1, 2), MOST)
        drivers = tuple(
            Driver(name, law=law, from_=first if not k else None, to=last if not k else None)
            for k, (name, law) in enumerate(moving)
        )
        if len(drivers) == 1:
            return {"motion": Sweep(driver=drivers[0], poses=poses)}
        return {"motion": Sweep(drivers=drivers, poses=poses)}
    name = _crank(mechanism)
    if not name:
        return {}
    remarks.append(f"driver: {name}")
    return {"turn": Sweep(driver=Driver(name, range="assembled"), poses=POSES)}


def _freedoms(mechanism: Mechanism) -> int:
    """Return the mobility by count, which is less than the true one of redundant equations."""
    whole, held = (3, PLANE) if mechanism.dimension == 2 else (6, SPACE)
    joints = mechanism.joints.values()
    on = {
        body: [joint.kind for joint in joints if body in joint.bodies] for body in mechanism.bodies
    }
    idle = sum(kinds == ["spherical"] * 2 for kinds in on.values())  # they turn about their line
    return whole * len(mechanism.bodies) - sum(held[joint.kind] for joint in joints) - idle


def _crank(mechanism: Mechanism) -> str:
    """Return the coordinate of a body that turns in the ground, "" where none does."""
    for name, joint in mechanism.joints.items():
        if joint.hinge and joint.turns and GROUND in joint.bodies:
            body = next(body for body in joint.bodies if body != GROUND)
            return f"{body}.angle" if mechanism.dimension == 2 else f"{name}.angle"
    return ""


def _law(
    assembly: AsmtAssembly,
    made: JoinedAssembly,
    starts: dict[str, tuple[str, float, float, float]],
    motion: AsmtMotion,
) -> tuple[str, str] | None:
    """Return a driver's coordinate and its law; None of a law that does not change."""
    word = {"RotationalMotion": "angle", "TranslationalMotion": "slide"}.get(motion.kind)
    name = made.names.get(motion.joint, "")
    coordinate = f"{name}.{word}"
    if word is None or coordinate not in starts:
        raise UnavailableError(
            f"a {motion.kind} of joint '{motion.joint}' has no counterpart",
            where=f"{made.path}: {motion.name}",
        )
    _, sign, factor, offset = starts[coordinate]
    law = DOUBLE.sub(r"\1", re.sub(r"\btime\b", "t", motion.law)).replace("^", "**")
    try:
        values = [evaluate(law, {"t": t}) for t in (0.1, 0.37, 0.9)]
        strange = names_in(law) - {"t"}
    except MechdaeError:
        values, strange = [math.nan], set()
    if strange or not np.isfinite(values).all():
        raise UnavailableError(
            f"'{motion.law}' is no expression of time that is known here",
            where=f"{made.path}: {motion.name}",
        )
    if max(values) == min(values):
        return None
    scaled = f"({law})" if sign * factor == 1 else f"{sign * factor!r} * ({law})"
    return coordinate, scaled if offset == 0 else f"{scaled} + {offset!r}"
