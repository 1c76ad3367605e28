"""An assembly of Ondsel or FreeCAD as a problem: of the plane where its joints allow it.

Revolute and cylindrical joints about one direction, translations across it: a mechanism of the
plane. Else the joints are those of space, and the file must show an assembled pose. Joints that
have no counterpart are refused by name.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np

from mechdae.describe import GROUND, Driver, Mechanism, Problem, Sweep, Table, Task
from mechdae.describe.expression import evaluate, names_in
from mechdae.errors import InputError, MechdaeError, UnavailableError
from mechdae.parts.exchange.assemblies.asmt_read import AsmtAssembly, AsmtMotion, read_assembly
from mechdae.parts.exchange.assemblies.assembly_in_plane import mechanism_of_plane, plane_of
from mechdae.parts.exchange.assemblies.assembly_in_space import mechanism_of_space
from mechdae.parts.exchange.assemblies.assembly_parts import JoinedAssembly, joined
from mechdae.parts.exchange.drawings.dxf_read import NAMED

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
    """Return the mobility by count, which is less than the true one of superfluous equations."""
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
