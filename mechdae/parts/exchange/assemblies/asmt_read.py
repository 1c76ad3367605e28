"""Reads assemblies of Ondsel and FreeCAD: a tree of lines indented by tabs.

A line is a key, those below it with one tab more are its values or parts. What is after the
parameters of the simulation (``TimeSeries``) are results and is left out.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mechdae.describe import GROUND, Body, Ground, Joint, Mechanism, Table
from mechdae.errors import InputError, ProblemFileError, UnavailableError
from mechdae.types import Floats, Matrix

HEADS = ("OndselSolver", "freeCAD:")
REFERENCES = ("RefPoints", "RefCurves", "RefSurfaces")
MOST_BYTES = 20_000_000
ORTHOGONAL = 1e-5
"""By how much a matrix may miss a rotation, which then is the nearest one; what is `ROUNDED`."""
ROUNDED = 1e-12
PLACEHOLDER = (1.0, 1.0, 1.0)
"""Moments of inertia that FreeCAD writes of every part, with a mass of 1."""
SAME = 1e-9
Side = tuple[str, str]


@dataclass
class AsmtNode:
    """A line with what is below it."""

    text: str
    line: int
    children: list[AsmtNode] = field(default_factory=list)

    def get(self, key: str) -> AsmtNode | None:
        """Return the part of that key, None without one."""
        return next((child for child in self.children if child.text == key), None)

    def word(self, key: str) -> str:
        """Return the text below a key, "" without one."""
        part = self.get(key)
        return part.children[0].text if part is not None and part.children else ""

    def parts(self, key: str) -> list[AsmtNode]:
        part = self.get(key)
        return part.children if part is not None else []


@dataclass(frozen=True)
class AsmtFrame:
    """Origin (3,) and directions of the axes (3, 3) of a frame."""

    origin: Floats
    R: Matrix

    def inside(self, other: AsmtFrame) -> AsmtFrame:
        """Return a frame that is given in another one."""
        return AsmtFrame(other.origin + other.R @ self.origin, other.R @ self.R)


HOME = AsmtFrame(np.zeros(3), np.eye(3))


@dataclass(frozen=True)
class AsmtPart:
    """A body: where it is, its markers in its frame, its mass where it has one."""

    name: str
    frame: AsmtFrame
    markers: dict[str, AsmtFrame]
    mass: tuple[float, AsmtFrame, Any] | None


@dataclass(frozen=True)
class AsmtJoint:
    """A joint: its form, the part ("" of the assembly) and marker of both sides, its numbers."""

    form: str
    name: str
    first: tuple[str, str]
    second: tuple[str, str]
    numbers: dict[str, float]


@dataclass(frozen=True)
class AsmtMotion:
    """What moves a joint, as an expression of ``time``."""

    kind: str
    name: str
    joint: str
    law: str


@dataclass(frozen=True)
class AsmtAssembly:
    """An assembly; ``others`` are what else is in it and has a part in the motion."""

    name: str
    markers: dict[str, AsmtFrame]
    parts: dict[str, AsmtPart]
    joints: list[AsmtJoint]
    motions: list[AsmtMotion]
    gravity: Floats
    times: tuple[float, float, float] | None
    others: list[str]
    remarks: list[str]


def read_assembly(path: str | Path) -> AsmtAssembly:
    root = _tree(Path(path))
    try:
        return _assembly(root)
    except _Wrong as error:
        raise ProblemFileError(str(error), where=f"{path}: line {error.line}") from None
    except UnavailableError as error:
        raise UnavailableError(error.what, where=f"{path}: {error.where}") from None


class _Wrong(Exception):
    def __init__(self, what: str, node: AsmtNode) -> None:
        super().__init__(what)
        self.line = node.line


def _tree(path: Path) -> AsmtNode:
    try:
        if path.stat().st_size > MOST_BYTES:
            raise ProblemFileError("more than 20 MB", where=str(path))
        lines = path.read_bytes().decode("utf-8-sig", "replace").splitlines()
    except OSError as error:
        raise ProblemFileError(
            f"cannot be read: {error.strerror or error}", where=str(path)
        ) from None
    if len(lines) < 2 or not lines[0].startswith(HEADS) or lines[1].strip() != "Assembly":
        raise ProblemFileError(
            "is no assembly of Ondsel or FreeCAD", where=str(path), hint="OndselSolver, Assembly"
        )
    root = AsmtNode("Assembly", 2)
    open_nodes = [root]
    for number, line in enumerate(lines[2:], 3):
        if not line.strip():
            continue
        level = len(line) - len(line.lstrip("\t"))
        if level == 0:  # results follow
            break
        if level > len(open_nodes):
            raise ProblemFileError("indented too far", where=f"{path}: line {number}")
        node = AsmtNode(line.strip(), number)
        open_nodes[level - 1].children.append(node)
        open_nodes[level:] = [node]
    return root


def _row(node: AsmtNode, count: int) -> Floats:
    try:
        values = [float(word) for word in node.text.split()]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        raise _Wrong(f"{count} numbers are needed, not '{node.text[:40]}'", node)
    return np.array(values)


def _value(node: AsmtNode, key: str) -> float:
    part = node.get(key)
    if part is None or not part.children:
        raise _Wrong(f"{key} is missing", node)
    return float(_row(part.children[0], 1)[0])


def _frame(node: AsmtNode) -> AsmtFrame:
    place, turn = node.parts("Position3D"), node.parts("RotationMatrix")
    origin = _row(place[0], 3) if place else np.zeros(3)
    if turn and len(turn) != 3:
        raise _Wrong("a RotationMatrix has three rows", node)
    R = np.array([_row(row, 3) for row in turn]) if turn else np.eye(3)
    off = _off(R)
    if off > ORTHOGONAL or np.linalg.det(R) < 0:
        raise _Wrong("a RotationMatrix that is no rotation", node.get("RotationMatrix") or node)
    if off > ROUNDED:
        left, _, right = np.linalg.svd(R)
        R = left @ right
    return AsmtFrame(origin, R)


def _off(R: Matrix) -> float:
    """Return by how much a matrix misses a rotation."""
    return float(np.abs(R @ R.T - np.eye(3)).max())


def _rounded(root: AsmtNode) -> Iterator[str]:
    """Yield a remark on matrices of a file that are rotations nearly."""
    todo, found = [root], list[tuple[float, int]]()
    while todo:
        node = todo.pop()
        todo += node.children
        if node.text == "RotationMatrix":
            found.append((_off(np.array([_row(row, 3) for row in node.children])), node.line))
    off = [turn for turn in found if turn[0] > ROUNDED]
    if off:
        worst, line = max(off)
        yield (
            f"{len(off)} of {len(found)} rotation matrices are none by up to {worst:.1e} (line "
            f"{line}): the nearest rotations are taken"
        )


def _markers(node: AsmtNode) -> dict[str, AsmtFrame]:
    """Return the markers of a part in its frame, those of curves and surfaces too."""
    found = {}
    for point in (point for key in REFERENCES for point in node.parts(key)):
        around = _frame(point)
        for marker in point.parts("Markers"):
            found[_named(marker)] = _frame(marker).inside(around)
    return found


def _named(node: AsmtNode) -> str:
    name = node.word("Name")
    if not name:
        raise _Wrong(f"{node.text} has no Name", node)
    return name


def _mass(node: AsmtNode) -> tuple[float, AsmtFrame, Floats] | None:
    marker = node.get("PrincipalMassMarker")
    if marker is None or marker.get("Mass") is None:
        return None
    moments = marker.parts("MomentOfInertias")
    return _value(marker, "Mass"), _frame(marker), _row(moments[0], 3) if moments else np.zeros(3)


def _assembly(root: AsmtNode) -> AsmtAssembly:
    name = _named(root)
    _frame(root)  # nothing depends on it, but it has to be one
    parts = {}
    for node in root.parts("Parts"):
        read = AsmtPart(_named(node), _frame(node), _markers(node), _mass(node))
        if read.name in parts:
            raise _Wrong(f"two parts are called {read.name}", node)
        parts[read.name] = read
    sets = root.get("ConstraintSets") or AsmtNode("", root.line)
    markers = _markers(root)
    known = {("", marker) for marker in markers}
    known |= {(part.name, marker) for part in parts.values() for marker in part.markers}
    joints = [_joint(node, name, known) for node in sets.parts("Joints")]
    gravity = root.parts("ConstantGravity")
    for node in sets.parts("GeneralConstraintSets"):
        raise UnavailableError(f"a {node.text} has no counterpart", where=f"line {node.line}")
    others = [f"{node.text} {node.word('Name')}".strip() for node in sets.parts("Limits")]
    others += [f"{n.text} {n.word('Name')}".strip() for n in root.parts("ForceTorques")]
    return AsmtAssembly(
        name,
        markers,
        parts,
        joints,
        list(_motions(sets, name)),
        _row(gravity[0], 3) if gravity else np.zeros(3),
        _times(root),
        others,
        [*_rounded(root), *_unnamed(joints, sets)],
    )


def _unnamed(joints: list[AsmtJoint], sets: AsmtNode) -> Iterator[str]:
    """Yield a remark on joints that have no name in the file."""
    given = {node.word("Name") for node in sets.parts("Joints")}
    called = [joint.name for joint in joints if joint.name not in given]
    if called:
        yield f"joints without a name are called {', '.join(called)}"


def _joint(node: AsmtNode, assembly: str, known: set[tuple[str, str]]) -> AsmtJoint:
    sides = []
    for key in ("MarkerI", "MarkerJ"):
        words = node.word(key).split("/")
        side = (words[2], words[3]) if len(words) == 4 else ("", words[-1])
        if len(words) not in (3, 4) or words[:2] != ["", assembly] or side not in known:
            raise _Wrong(f"{key} '{node.word(key)}' is no marker", node)
        sides.append(side)
    numbers = {}
    for part in node.children:
        if part.text not in ("Name", "MarkerI", "MarkerJ") and part.children:
            try:
                numbers[part.text] = float(part.children[0].text)
            except ValueError:
                continue
    name = node.word("Name") or f"{node.text}_{node.line}"
    return AsmtJoint(node.text, name, sides[0], sides[1], numbers)


def _motions(sets: AsmtNode, assembly: str) -> Iterator[AsmtMotion]:
    for node in sets.parts("Motions"):
        law = node.word("RotationZ") or node.word("TranslationZ")
        yield AsmtMotion(node.text, _named(node), node.word("MotionJoint").split("/")[-1], law)


def _times(root: AsmtNode) -> tuple[float, float, float] | None:
    times = root.get("SimulationParameters")
    if times is None or times.get("tend") is None or times.get("hout") is None:
        return None
    return _value(times, "tstart"), _value(times, "tend"), _value(times, "hout")


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
