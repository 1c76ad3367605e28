"""The absolute equations of a spatial mechanism, for its structure only.

Six coordinates a body, equations of all joints: what the Assur groups are found from. The groups of
a tree of joints are the same. It is never evaluated at a pose.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from decimal import Decimal, localcontext

import casadi as ca

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.joints.bearings import bearings
from mechdae.describe.joints.joint import Joint
from mechdae.describe.joints.spatial import AXES, SpatialJoint, largest
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.describe.spinning_links import Spin, points_of
from mechdae.equations.coordinates import Coordinates, of_owner
from mechdae.equations.model import Model, Row
from mechdae.equations.structure_cache import StructureCache
from mechdae.equations.tree.closures import CutJoint, rows_of
from mechdae.equations.tree.spatial_frames import TreeFrame, about_x, about_z, structure_rows
from mechdae.types import Sym

DIGITS = 50


def literal(joint: Joint) -> bool:
    """Return whether the directions of a joint are plain numbers."""
    given = joint.directions() if isinstance(joint, SpatialJoint) else ()
    return not any(isinstance(number, str) for _, vector in given for number in vector)


def side(joint: Joint, second: bool, number: Mapping[str, Sym], value: Mapping[str, float]) -> Sym:
    """Return the rotation (3, 3) from a side's joint frame to the frame of its body.

    Parameters
    ----------
    number, value
        Symbols and values of all numbers of the mechanism by their names. Directions that are
        plain numbers are normalised in 50 digits and rounded once.
    """
    if not isinstance(joint, SpatialJoint) or not dict(joint.directions()):
        return SX.eye(3)
    axis, zero = joint.side(second)

    def vector(name: str, of: Mapping[str, Sym]) -> list[Sym]:
        return [of[f"{joint.name}.{name}.{letter}"] for letter in AXES]

    a = vector(axis, number)
    if zero is not None:
        n = vector(zero, number)
    else:
        after = (largest(tuple(vector(axis, value))) + 1) % 3
        n = [SX(float(i == after)) for i in range(3)]
    if all(SX(entry).is_constant() for entry in (*a, *n)):
        columns = _rounded([float(v) for v in a], [float(v) for v in n])
    else:
        columns = _normal(ca.vertcat(*a), ca.vertcat(*n))
    if joint.crossed and second:  # the second pin is x, the first one z
        first, across, last = columns
        columns = (last, -across, first)
    return ca.sparsify(SX(ca.horzcat(*columns)))


def _normal(a: Sym, n: Sym) -> tuple[Sym, Sym, Sym]:
    """Return normal, axis x normal, axis."""
    a = a / ca.norm_2(a)
    n = n - a * ca.dot(a, n)
    n = n / ca.norm_2(n)
    return n, ca.cross(a, n), a


def _rounded(a: list[float], n: list[float]) -> tuple[Sym, Sym, Sym]:
    with localcontext() as context:
        context.prec = DIGITS
        axis = _unit([Decimal(v) for v in a])
        normal = [Decimal(v) for v in n]
        along = _dot(axis, normal)
        normal = _unit([v - along * w for v, w in zip(normal, axis, strict=True)])
        cross = [axis[i - 2] * normal[i - 1] - axis[i - 1] * normal[i - 2] for i in range(3)]
    return tuple(ca.DM([_near(v) for v in vector]) for vector in (normal, cross, axis))  # type: ignore[return-value]


def _dot(a: list[Decimal], b: list[Decimal]) -> Decimal:
    return sum((v * w for v, w in zip(a, b, strict=True)), Decimal(0))


def _unit(a: list[Decimal]) -> list[Decimal]:
    size = _dot(a, a).sqrt()
    return [v / size for v in a]


def _near(value: Decimal) -> float:
    """Return the nearest double; rounding of the last of 50 digits is no component."""
    return 0.0 if abs(value) < Decimal("1e-40") else float(value)


SX = ca.SX
NAMES = ("x", "y", "z", "e1", "e2", "e3")
"""Three coordinates of a point, and three angles that count as numbers here."""


class Skeleton(Model):
    """Coordinates and equations of all bodies.

    Parameters
    ----------
    mechanism
        Without links that spin freely.
    spins
        Bodies that spin freely together: an equation stands for each.
    """

    axes = "xyz"

    def __init__(self, mechanism: Mechanism, spins: Iterable[Spin] = ()) -> None:
        self.mechanism, self.cache, self._free = mechanism, StructureCache(), set()
        self._spins = tuple(spins)
        self._make_parameters()
        self._anchors, self.contacts = {}, {}
        points = points_of(mechanism)
        unknowns = {n: of_owner(n, NAMES[:3] if n in points else NAMES) for n in mechanism.bodies}
        self._frames = {}
        for name, coordinates in unknowns.items():
            x, y, z, *angles = (coordinate.symbol for coordinate in coordinates)
            turn = SX.eye(3)
            for angle, about in zip(angles, (about_z, about_x, about_z), strict=False):
                turn = turn @ about(angle)
            self._frames[name] = TreeFrame(ca.vertcat(x, y, z), turn, SX.eye(3))  # type: ignore[assignment]
        self._frames[GROUND] = TreeFrame(SX(3, 1), SX.eye(3), SX.eye(3))  # type: ignore[assignment]
        self.coordinates: Coordinates = Coordinates(c for part in unknowns.values() for c in part)
        self.q_names: list[tuple[str, str]] = self.coordinates.keys
        self.q: Sym = ca.vertcat(*[c.symbol for c in self.coordinates])
        self._values = mechanism.values()
        self.rows = []
        for name, joint in mechanism.joints.items():
            if joint.meshes:
                unit = "rad" if joint.wheels > 1 else "m"
                self.rows.append(Row(name, "mesh", self._mesh(name), unit))
                continue
            if joint.pointer:
                gap = self.point(joint.second) - self.point(joint.first)
                equations = structure_rows(joint, gap)
                self.rows += [Row(name, *row) for row in equations]
                continue
            self.rows += [Row(name, *row[:3]) for row in rows_of(joint.kind, self._cut(name))]

        for spin in self._spins:
            self.rows.append(self._unspun(spin))
            if spin.sleeve:
                self.rows.append(Row(spin.sleeve, "spin", self._moved(spin.sleeve, "angle"), "1"))

    def part(self, mechanism: Mechanism) -> Skeleton:
        return Skeleton(mechanism, (s for s in self._spins if {*s.joints} <= {*mechanism.joints}))

    def _unspun(self, spin: Spin) -> Row:
        """Return a stand-in for what holds a spin: it is of the bodies on both sides of a joint."""
        joint = self.mechanism.joints[spin.joints[0]]
        one, other = (self._frames[body].side(SX.eye(3)) for body in joint.bodies[:2])  # type: ignore[attr-defined]
        return Row(joint.name, "spin", ca.dot(one[:, 2], other[:, 0]), "1")

    def _cut(self, name: str) -> CutJoint:
        joint = self.mechanism.joints[name]
        sides = [
            self._frames[body].side(side(joint, bool(k), self.numbers, self._values))  # type: ignore[attr-defined]
            for k, body in enumerate((joint.first_body, joint.second_body))
        ]
        gap = self.point(joint.second) - self.point(joint.first)
        length = self.numbers.get(f"{name}.length")
        pitch = self.numbers.get(f"{name}.pitch")
        turned = {"angle": ca.dot(sides[0][:, 1], sides[1][:, 0])}
        return CutJoint(gap, sides[0], sides[1], turned, length, pitch)

    def _mesh(self, name: str) -> Sym:
        """Return a stand-in for the equation of wheels: it holds the same bodies."""
        found = bearings(self.mechanism, self.mechanism.joints[name])
        return sum(
            (k + 2) * self._moved(bearing.joint, bearing.word) for k, bearing in enumerate(found)
        )

    def _moved(self, name: str, word: str) -> Sym:
        cut = self._cut(name)
        return cut.own["angle"] if word == "angle" else ca.dot(cut.A1[:, 2], cut.gap)

    def coordinate(self, coordinate: NamedCoordinate) -> Sym:
        """Return a stand-in for a coordinate: it holds the same bodies."""
        if coordinate.kind == "point":
            return super().coordinate(coordinate)
        joint = self.mechanism.joints[coordinate.part]
        if joint.pointer:
            gap = self.point(joint.second) - self.point(joint.first)
            return ca.dot(ca.DM([1.0, 1.7, 2.3]), gap)
        cut = self._cut(coordinate.part)
        if coordinate.unit == "rad":
            return cut.own["angle"]
        return ca.dot(cut.A1[:, "xy".find(coordinate.word)], cut.gap)
