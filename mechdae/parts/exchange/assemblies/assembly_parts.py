"""An assembly with the parts that are fixed to the ground made one with it, in metres."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mechdae.describe import GROUND, Body, Ground, Joint, Mechanism, Table
from mechdae.errors import InputError
from mechdae.parts.exchange.assemblies.asmt_read import AsmtAssembly, AsmtFrame, AsmtJoint
from mechdae.types import Floats

HOME = AsmtFrame(np.zeros(3), np.eye(3))
PLACEHOLDER = (1.0, 1.0, 1.0)
"""Moments of inertia that FreeCAD writes of every part, with a mass of 1."""
SAME = 1e-9
Side = tuple[str, str]


@dataclass
class JoinedAssembly:
    """Bodies that move, their markers in the fixed frame, joints between them.

    ``bodies``: names of bodies by those of parts; parts that are fixed are the ground. ``frames``,
    ``markers``: frames of parts, and of markers by (part, marker), in the pose of the file.
    ``points``: names of points by (part, marker): one for each place of a body.
    """

    assembly: AsmtAssembly
    path: str
    unit: float
    bodies: dict[str, str] = field(default_factory=dict)
    names: dict[str, str] = field(default_factory=dict)
    frames: dict[str, AsmtFrame] = field(default_factory=dict)
    markers: dict[Side, AsmtFrame] = field(default_factory=dict)
    points: dict[Side, str] = field(default_factory=dict)
    joints: list[AsmtJoint] = field(default_factory=list)

    def body(self, side: Side) -> str:
        return self.bodies[side[0]]

    def reference(self, side: Side) -> str:
        """Return the point of one side of a joint."""
        return f"{self.body(side)}.{self.points[side]}"

    @property
    def size(self) -> float:
        """The extent of the markers [m]."""
        places = np.array([marker.origin for marker in self.markers.values()])
        return float(np.ptp(places, axis=0).max()) or 1.0

    def mechanism(
        self,
        joints: list[Joint],
        place: Callable[[Side], tuple[float, ...]],
        weight: Callable[[str], dict[str, Any]],
        **more: Any,
    ) -> Mechanism:
        """Return a mechanism of joints, with places of points and what parts weigh."""
        points: dict[str, dict[str, tuple[float, ...]]] = {GROUND: {}}
        for side, point in self.points.items():
            points.setdefault(self.body(side), {}).setdefault(point, place(side))
        bodies = {
            body: Body(body, points=Table(points.get(body, {})), **weight(part))
            for part, body in self.bodies.items()
            if body != GROUND
        }
        ground, pairs = (
            Ground(points=Table(points[GROUND])),
            {joint.name: joint for joint in joints},
        )
        return Mechanism(ground, Table(bodies), Table(pairs), **more)

    def weighed(self, part: str) -> tuple[float, AsmtFrame, Floats] | None:
        """Return mass, frame and moments of a part; numbers that FreeCAD writes of all are none."""
        mass = self.assembly.parts[part].mass
        if mass is None or mass[0] <= 0 or (mass[0] == 1.0 and tuple(mass[2]) == PLACEHOLDER):
            return None
        return mass

    def local(self, side: Side) -> Floats:
        """Return the place of a marker in the frame of its body (3,)."""
        if self.body(side) == GROUND:
            return self.markers[side].origin
        marker = self.assembly.parts[side[0]].markers[side[1]]
        return marker.origin * self.unit


def joined(assembly: AsmtAssembly, unit: float, path: str) -> JoinedAssembly:
    """Return an assembly in metres, with names that mechdae knows."""
    made = JoinedAssembly(assembly, path, unit)
    fixed, more = {""}, True
    while more:
        more = False
        for joint in assembly.joints:
            ends = {joint.first[0], joint.second[0]}
            if joint.form == "FixedJoint" and ends & fixed and not ends <= fixed:
                fixed |= ends
                more = True
    taken = {GROUND}
    made.bodies = {"": GROUND}
    for name, part in assembly.parts.items():
        made.bodies[name] = GROUND if name in fixed else _identifier(name, "part", taken)
        made.frames[name] = AsmtFrame(part.frame.origin * unit, part.frame.R)
    if all(body == GROUND for body in made.bodies.values()):
        raise InputError("no part of the assembly moves", where=path)
    for owner, part_of in [
        ("", assembly.markers),
        *((p.name, p.markers) for p in assembly.parts.values()),
    ]:
        frame = made.frames.get(owner, HOME)
        for name, marker in part_of.items():
            scaled = AsmtFrame(marker.origin * unit, marker.R)
            made.markers[(owner, name)] = scaled.inside(frame)
    for joint in assembly.joints:
        if made.body(joint.first) == made.body(joint.second):
            continue
        made.names[joint.name] = _identifier(joint.name, "joint", taken)
        made.joints.append(joint)
    _points(made)
    return made


def _points(made: JoinedAssembly) -> None:
    """Name the points of joints: one for each place of a body."""
    known: dict[str, list[tuple[Floats, str]]] = {}
    for joint in made.joints:
        for side in (joint.first, joint.second):
            places = known.setdefault(made.body(side), [])
            here = made.markers[side].origin
            for place, name in places:
                if np.abs(place - here).max() <= SAME * made.size:
                    made.points[side] = name
                    break
            else:
                taken = {name for _, name in places}
                made.points[side] = _identifier(side[1], "P", taken)
                places.append((here, made.points[side]))


def _identifier(text: str, default: str, taken: set[str]) -> str:
    """Return a name of letters, digits and underscores that is not taken, and take it."""
    word = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_") or default
    if not word[0].isalpha():
        word = f"{default}_{word}"
    name, k = word, 2
    while name in taken or name in ("t", "pi", "e"):
        name, k = f"{word}_{k}", k + 1
    taken.add(name)
    return name
