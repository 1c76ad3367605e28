"""An assembly whose joints all move in one plane, as a mechanism of the plane."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mechdae.describe import GROUND, Joint, Mechanism, Table
from mechdae.describe.joints.pairs import Prismatic, Revolute, Weld
from mechdae.describe.joints.wheels import Gear, Rack
from mechdae.errors import UnavailableError
from mechdae.parts.exchange.assemblies.asmt_read import SAME, AsmtJoint, JoinedAssembly, Side
from mechdae.types import Floats, Json, Unknowns

PARALLEL = 1e-6
"""Sine of the angle within which directions are parallel."""
APART = 1e-3
"""Share of the size by which markers may be apart along the normal without a remark."""
ABOUT = (
    *("RevoluteJoint", "CylindricalJoint", "GearJoint", "RackPinionJoint"),
    *("ParallelAxesJoint", "PlanarJoint"),
)
"""Kinds whose axis is the plane's normal,"""
ACROSS = ("TranslationalJoint",)
"""whose axis lies in the plane,"""
IDLE = ("ParallelAxesJoint", "PlanarJoint")
"""that say nothing of a motion in the plane."""
DIGITS = 15


@dataclass(frozen=True)
class AssemblyPlane:
    """A plane by two directions (3,) and its normal, a right-handed frame."""

    x: Floats
    y: Floats
    normal: Floats

    def place(self, point: Floats) -> tuple[float, float]:
        return _rounded(float(self.x @ point)), _rounded(float(self.y @ point))

    def angle(self, direction: Floats) -> float:
        return math.atan2(float(self.y @ direction), float(self.x @ direction))

    def holds(self, direction: Floats) -> bool:
        return abs(float(self.normal @ direction)) <= PARALLEL


def plane_of(made: JoinedAssembly) -> AssemblyPlane | None:
    """Return the plane in which all joints move, None where there is none."""
    kinds = {joint.form for joint in made.joints}
    if not kinds <= {*ABOUT, *ACROSS, "FixedJoint"}:
        return None
    about = [_z(made, joint) for joint in made.joints if joint.form in ABOUT]
    across = [_z(made, joint) for joint in made.joints if joint.form in ACROSS]
    if about:
        normal = about[0]
    else:
        crossed = [np.cross(a, b) for a in across for b in across]
        normal = max([*crossed, np.array([0.0, 0.0, 1.0])], key=lambda v: float(np.linalg.norm(v)))
        if across and np.linalg.norm(normal) == 1 and abs(normal @ across[0]) > PARALLEL:
            normal = np.cross(across[0], np.eye(3)[int(np.argmin(np.abs(across[0])))])
        normal = normal / np.linalg.norm(normal)
    normal = normal if normal[int(np.argmax(np.abs(normal)))] > 0 else -normal
    parallel = all(np.linalg.norm(np.cross(normal, axis)) <= PARALLEL for axis in about)
    if not parallel or any(abs(normal @ axis) > PARALLEL for axis in across):
        return None
    k = int(np.argmax(np.abs(normal)))
    x = np.eye(3)[(k + 1) % 3]
    x = x - normal * (normal @ x)
    x = x / np.linalg.norm(x)
    return AssemblyPlane(x, np.cross(normal, x), normal)


def _z(made: JoinedAssembly, joint: AsmtJoint) -> Unknowns:
    return made.markers[joint.first].R[:, 2]


def mechanism_of_plane(
    made: JoinedAssembly, plane: AssemblyPlane, remarks: list[str]
) -> tuple[Mechanism, dict[str, tuple[str, float, float, float]]]:
    """Return the mechanism, and how coordinates of joints follow from those of the file.

    By the coordinate's name: its first body, sign, factor and offset of the file's motion.
    """
    work = _InPlane(made, plane, remarks)
    joints = [plane_joint for joint in made.joints for plane_joint in work.joint(joint)]
    return work.mechanism(joints), work.starts


class _InPlane:
    def __init__(self, made: JoinedAssembly, plane: AssemblyPlane, remarks: list[str]) -> None:
        self.made, self.plane, self.remarks = made, plane, remarks
        self.starts: dict[str, tuple[str, float, float, float]] = {}
        self.angles = {GROUND: 0.0}
        self.axes = {GROUND: (plane.x, plane.y)}
        for part, body in made.bodies.items():
            if body != GROUND:
                R = made.frames[part].R
                flat = next((k for k in range(3) if plane.holds(R[:, k])), None)
                x = R.T @ plane.x if flat is None else np.eye(3)[flat]
                self.axes[body] = (x, np.cross(R.T @ plane.normal, x))
                self.angles[body] = plane.angle(R @ x)
        self._flatten()

    def _flatten(self) -> None:
        """Make one point of those of a body that lie behind each other: they are on one pin."""
        known: dict[str, list[tuple[Floats, str]]] = {body: [] for body in self.angles}
        for side, point in self.made.points.items():
            body = self.made.body(side)
            here = np.array(self._local(body, self.made.local(side)))
            reach = SAME * self.made.size
            same = [name for place, name in known[body] if np.abs(place - here).max() <= reach]
            known[body].append((here, point))
            self.made.points[side] = same[0] if same else point

    def _local(self, body: str, place: Floats) -> tuple[float, float]:
        """Return a place in the part's frame in the frame of a body."""
        x, y = self.axes[body]
        return _rounded(float(x @ place)), _rounded(float(y @ place))

    def _turn(self, side: Side, axis: int) -> float:
        """Return the angle of an axis of a marker in its body."""
        direction = self.made.markers[side].R[:, axis]
        return self.plane.angle(direction) - self.angles[self.made.body(side)]

    def _turns(self, joint: AsmtJoint, axis: int) -> float:
        """Return the angle of the second body less that of the first with markers alike."""
        return _whole(self._turn(joint.first, axis) - self._turn(joint.second, axis))

    def joint(self, joint: AsmtJoint) -> list[Joint]:
        """Return the joint of mechdae, nothing for one without a part in the plane."""
        made, name = self.made, self.made.names[joint.name]
        ends = made.reference(joint.first), made.reference(joint.second)
        if joint.form in IDLE:
            self.remarks.append(f"{joint.form} {joint.name} says nothing in the plane")
            return []
        gap = self.plane.normal @ (
            made.markers[joint.first].origin - made.markers[joint.second].origin
        )
        if abs(gap) > APART * made.size and joint.form in ("RevoluteJoint", "FixedJoint"):
            self.remarks.append(f"the markers of {joint.name} are {gap:g} m apart along the normal")
        if joint.form == "CylindricalJoint":
            self.remarks.append(f"{joint.name} turns only: its slide is normal to the plane")
        if joint.form in ("RevoluteJoint", "CylindricalJoint"):
            sign = 1.0 if float(self.plane.normal @ _z(made, joint)) > 0 else -1.0
            flat = self._flat(joint.first)
            first = made.body(joint.first)
            self.starts[f"{name}.angle"] = (first, sign, 1.0, self._offset(joint, flat))
            return [Revolute(name, *ends)]
        if joint.form == "TranslationalJoint":
            axis = self._turn(joint.first, 2)
            self.starts[f"{name}.slide"] = (made.body(joint.first), 1.0, made.unit, 0.0)
            turn = self._turns(joint, 2)
            return [Prismatic(name, *ends, axis=_rounded(_whole(axis)), turn=_rounded(turn))]
        if joint.form == "GearJoint":
            return [self._gear(joint, name, ends)]
        if joint.form == "RackPinionJoint":
            return [self._rack(joint, name, ends)]
        turn = self._turns(joint, self._flat(joint.first))
        return [Weld(name, *ends, turn=_rounded(turn))]

    def _flat(self, side: Side) -> int:
        """Return an axis of a marker that lies in the plane."""
        axes = self.made.markers[side].R.T
        return min(range(3), key=lambda k: abs(float(self.plane.normal @ axes[k])))

    def _offset(self, joint: AsmtJoint, flat: int) -> float:
        """Return the angle of the joint where the markers are alike."""
        if not self.plane.holds(self.made.markers[joint.second].R[:, flat]):
            return 0.0
        return _rounded(self._turns(joint, flat))

    def _gear(self, joint: AsmtJoint, name: str, ends: tuple[str, str]) -> Gear:
        """Return a gear pair on the body that both wheels turn on."""
        one, other = joint.numbers.get("radiusI", 0.0), joint.numbers.get("radiusJ", 0.0)
        wheels = self.made.body(joint.first), self.made.body(joint.second)
        if not one or not other:
            raise UnavailableError("gears need two radii", where=f"{self.made.path}: {joint.name}")
        carriers = set.intersection(*(self._pinned(wheel) for wheel in wheels)) - set(wheels)
        if not carriers:
            raise UnavailableError(
                "the wheels turn on no common body", where=f"{self.made.path}: {joint.name}"
            )
        carrier = GROUND if GROUND in carriers else sorted(carriers)[0]
        ratio, base = -other / one, self.angles[carrier]
        angles = [self.angles[wheel] - base for wheel in wheels]
        phase = _rounded(angles[0] - ratio * angles[1])
        on = None if carrier == GROUND else carrier
        return Gear(name, *ends, carrier=on, ratio=ratio, phase=phase)

    def _rack(self, joint: AsmtJoint, name: str, ends: tuple[str, str]) -> Rack:
        """Return a wheel on a rack: x of the second marker in the first one + r turn is constant.

        The first marker's x is the rack, the second one is on the wheel.
        """
        made, radius = self.made, joint.numbers.get("pitchRadius", 0.0) * self.made.unit
        if not radius:
            raise UnavailableError("a rack needs a pitchRadius", where=f"{made.path}: {joint.name}")
        rack, wheel = made.body(joint.first), made.body(joint.second)
        if rack not in self._straight():
            raise UnavailableError("a rack that turns", where=f"{made.path}: {joint.name}")
        radius *= 1.0 if float(self.plane.normal @ _z(made, joint)) > 0 else -1.0
        along = made.markers[joint.first].R[:, 0]
        gap = made.markers[joint.first].origin - made.markers[joint.second].origin
        return Rack(
            name,
            ends[1],
            ends[0],
            radius=radius,
            axis=_rounded(_whole(self._turn(joint.first, 0))),
            phase=_rounded(float(along @ gap) - radius * self.angles[wheel]),
        )

    def _straight(self) -> set[str]:
        """Return the bodies that slide in the ground, or on those that do: they do not turn."""
        found = {GROUND}
        for _ in self.made.joints:
            for joint in self.made.joints:
                ends = {self.made.body(joint.first), self.made.body(joint.second)}
                if joint.form in ("TranslationalJoint", "FixedJoint") and ends & found:
                    found |= ends
        return found

    def _pinned(self, body: str) -> set[str]:
        """Return the bodies that a body turns on."""
        found = set()
        for joint in self.made.joints:
            ends = {self.made.body(joint.first), self.made.body(joint.second)}
            if joint.form in ("RevoluteJoint", "CylindricalJoint") and body in ends:
                found |= ends - {body}
        return found

    def mechanism(self, joints: list[Joint]) -> Mechanism:
        """Return the mechanism with the pose of the file as its sketch."""
        made, plane = self.made, self.plane
        g = made.assembly.gravity * made.unit
        if abs(float(plane.normal @ g)) > 0:
            self.remarks.append("gravity along the normal of the plane is left out")
        flat = plane.place(g)
        return made.mechanism(
            joints,
            lambda side: self._local(made.body(side), made.local(side)),
            lambda part: self._mass(part, made.bodies[part]),
            sketch=Table({b: _rounded(_whole(a)) for b, a in self.angles.items() if b != GROUND}),
            gravity=flat if any(flat) else None,
        )

    def _mass(self, part: str, body: str) -> Json:
        weighed = self.made.weighed(part)
        if weighed is None:
            return {}
        mass, frame, moments = weighed
        axes = self.made.frames[part].R @ frame.R
        shares = (self.plane.normal @ axes) ** 2
        inertia = float(shares @ moments)
        center = self._local(body, frame.origin * self.made.unit)
        found: Json = {"mass": mass, "center": center}
        if inertia > 0:
            found["inertia"] = inertia * self.made.unit**2
        return found


def _whole(angle: float) -> float:
    """Return an angle without whole turns, in (-pi, pi]."""
    return angle - 2 * math.pi * math.ceil((angle - math.pi) / (2 * math.pi) - 1e-12)


def _rounded(value: float) -> float:
    return round(value, DIGITS) + 0.0
