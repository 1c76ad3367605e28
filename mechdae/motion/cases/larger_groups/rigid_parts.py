"""What a planar group is made of: rigid parts, shared pins, guides, higher pairs, in numbers.

Links welded together or held by a driver count as one part, all that is known as one more.
"""

from __future__ import annotations

import cmath
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import casadi as ca

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND
from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene
from mechdae.equations.space import PLANE
from mechdae.kernels.run.functions import Call
from mechdae.records import dataclass
from mechdae.types import Floats

Coordinates = Mapping[tuple[str, str], float]
"""Values by (body or joint, name)."""
Pose = tuple[complex, float]
"""Origin and angle of a frame in another."""


@dataclass(frozen=True)
class LegPoint:
    """A point of a body; of a slot whose slide is driven, the place of its pin."""

    body: str
    point: str
    slot: str = ""


class OtherShape(Exception):
    """The group has another shape than it is read for."""


@dataclass(frozen=True)
class GroupPoses:
    """All poses of a group, each as {(body, name): value}, and what is known of their number.

    ``basis`` says why there are no others, empty where there may be some; ``singular`` counts the
    complex solutions that end in singular ones or at infinity of the ``generic`` ones, ``bounded``
    tells that there are no more single ones than these. ``proven`` tells that there are no
    others, ``gap`` by how much the group stays open when there is none, ``free`` that it moves by
    itself. In all complex poses (m, ...) that paths led to ``axes`` (m, 6, 3) are directions of a
    ``row`` of hinges, ``placed`` a point of a body, its places (m, 3) and the quaternions (m, 4).
    """

    poses: list[dict[tuple[str, str], float]]
    proven: bool
    basis: str = ""
    gap: float = 0.0
    free: bool = False
    generic: int = 0
    singular: int = 0
    bounded: bool = False
    row: tuple[tuple[str, bool], ...] = ()
    axes: Any = None
    placed: tuple[str, Any, Any] | None = None
    by: str = "homotopy"

    @property
    def partly(self) -> str:
        """What is known where some solutions end elsewhere."""
        regular = self.generic - self.singular
        if self.by != "homotopy":
            return (
                f"{self.by}: {regular} of {self.generic} complex poses are certified, the others "
                f"are singular or at infinity"
            )
        return (
            f"homotopy: {regular} of {self.generic} complex poses are certified, the paths of the "
            f"others end in singular poses or at infinity"
        )


class ShapedGroup(ABC):
    """A group of a shape whose poses are found at once; raises `OtherShape` for other groups."""

    @abstractmethod
    def __init__(self, scene: Scene, group: Group, p: Floats) -> None: ...

    @abstractmethod
    def solve(self, q: Coordinates, u: Floats) -> GroupPoses | None:
        """Return the group's coordinates in all poses, None where this way does not tell them.

        `q` are coordinates of earlier groups, absolute ones in the plane; `u` (nd,) driver values.
        """


def shaped(
    shapes: tuple[type[ShapedGroup], ...], scene: Scene, group: Group, p: Floats
) -> ShapedGroup | None:
    """Return a group as the first of some shapes that it has, None where it has none of them."""
    for shape in shapes:
        try:
            return shape(scene, group, p)
        except OtherShape:
            continue
    return None


class GroupParts(ShapedGroup):
    """The parts of a planar group."""

    def __init__(self, scene: Scene, group: Group, p: Floats) -> None:
        model = scene.model
        if model.mechanism.dimension != 2 or not group.bodies or group.superfluous:
            raise OtherShape
        self.group, self.model, self.p = group, model, p
        self.joints: list[Joint] = [model.mechanism.joints[name] for name in group.joints]
        self._read_drivers(scene)
        self._numbers: dict[str, complex] = {}
        self.rigid: list[Joint] = []
        self.pins: list[set[LegPoint]] = []
        self.guides: list[Joint] = []
        self.higher: list[Joint] = []
        for joint in self.joints:
            self._sort(joint)
        self.node: dict[str, str] = {name: name for name in (GROUND, *group.bodies)}
        for joint in self.rigid:
            one, other = self.node_of(joint.first_body), self.node_of(joint.second_body)
            if one == other:
                raise OtherShape
            old, new = (one, other) if other == GROUND else (other, one)
            self.node = {name: new if node == old else node for name, node in self.node.items()}

    @property
    def nodes(self) -> list[str]:
        """One body of each part, the ground for all that is known."""
        return [name for name, node in self.node.items() if name == node]

    def _read_drivers(self, scene: Scene) -> None:
        """Sort the group's drivers: of joints, of points; the angle of a body is no leg."""
        self.driven: dict[str, tuple[int, str]] = {}
        self.rails: list[tuple[int, NamedCoordinate]] = []
        count = len(scene.model.rows)
        for k, c in enumerate(scene.drivers):
            if count + k not in self.group.rows:
                continue
            if c.kind == "point":
                self.rails.append((k, c))
            elif c.part in self.group.joints and c.part not in self.driven:
                self.driven[c.part] = (k, c.kind)
            else:
                raise OtherShape

    def _sort(self, joint: Joint) -> None:
        driven = self.driven.get(joint.name, (0, ""))[1]
        if joint.rigid or (joint.lower and driven):
            self.rigid.append(joint)
        elif joint.hinge or driven == "slide":
            slot = joint.name if driven else ""
            pin = {place(joint.first, slot), place(joint.second)}
            for other in [other for other in self.pins if other & pin]:
                self.pins.remove(other)
                pin |= other
            self.pins.append(pin)
        elif joint.guide or driven == "joint angle":
            self.guides.append(joint)
        elif joint.replaced:
            self.higher.append(joint)
        else:
            raise OtherShape

    def node_of(self, body: str) -> str:
        return self.node.get(body, GROUND)

    def number(self, name: str) -> float:
        """Return a number of a joint."""
        if name not in self._numbers:
            self._numbers[name] = float(self._value(name, lambda: self.model.numbers[name])[0])
        return self._numbers[name].real

    def local(self, place: LegPoint) -> complex:
        """Return a point in its body's frame."""
        name = f"{place.body}.{place.point}"
        if name not in self._numbers:
            self._numbers[name] = complex(*self._value(name, lambda: self.model.local(name)))
        return self._numbers[name]

    def _value(self, name: str, make: Callable[[], Any]) -> Floats:
        """Return the value (n,) of an expression over p."""

        def function() -> Call:
            return Call(ca.Function("n", [self.model.p], [ca.densify(ca.SX(make()))]))

        return self.model.cache(("number", name), function)(self.p)[0]

    def turn(self, joint: Joint, u: Floats) -> float:
        """Return the angle of a joint's second body less that of its first."""
        k, kind = self.driven.get(joint.name, (0, ""))
        return float(u[k]) if kind == "joint angle" else self.number(f"{joint.name}.turn")


class PlacedParts:
    """The parts of a group in numbers, at one pose of what is known."""

    def __init__(self, shape: GroupParts, q: Coordinates, u: Floats) -> None:
        self.shape, self.q, self.u = shape, q, u
        self.placed: dict[str, Pose] = {}
        """Frames of bodies in that of the body they are one with."""
        for body, node in shape.node.items():
            if body == node:
                self.placed[body] = (0j, 0.0)
        rest = list(shape.rigid)
        while rest:
            joint = next(j for j in rest if {j.first_body, j.second_body} & self._known(j))
            rest.remove(joint)
            self._place_rigid(joint)

    def _known(self, joint: Joint) -> set[str]:
        outside = {b for b in (joint.first_body, joint.second_body) if b not in self.shape.node}
        return self.placed.keys() | outside

    def placement(self, body: str) -> Pose:
        """Return a body's frame in that of its node; a known body's in the fixed frame."""
        if body in self.shape.node:
            return self.placed[body]
        x, y, angle = (self.q[body, name] for name in PLANE.twist)
        return complex(x, y), angle

    def _place_rigid(self, joint: Joint) -> None:
        shape = self.shape
        k, kind = shape.driven.get(joint.name, (0, ""))
        turn = shape.turn(joint, self.u)
        first, second = shape.local(place(joint.first)), shape.local(place(joint.second))
        if kind == "slide":
            first += float(self.u[k]) * cmath.rect(1, shape.number(f"{joint.name}.axis"))
        relative: Pose = (first - cmath.rect(1, turn) * second, turn)
        if joint.second_body in self._known(joint):
            body, start = joint.first_body, self.placement(joint.second_body)
            relative = (-relative[0] * cmath.rect(1, -turn), -turn)
        else:
            body, start = joint.second_body, self.placement(joint.first_body)
        self.placed[body] = _compose(start, relative)

    def spot(self, place: LegPoint) -> complex:
        """Return a point in the frame of its node."""
        shape = self.shape
        local = shape.local(place)
        if place.slot:
            slide = float(self.u[shape.driven[place.slot][0]])
            local += slide * cmath.rect(1, shape.number(f"{place.slot}.axis"))
        z, angle = self.placement(place.body)
        return z + cmath.rect(1, angle) * local

    def normal(self, joint: Joint) -> complex:
        """Return the normal of a guide in the frame of its first body's node."""
        angle = self.placement(joint.first_body)[1] + self.shape.number(f"{joint.name}.axis")
        return 1j * cmath.rect(1, angle)

    def guided(self, joint: Joint, node: str) -> float:
        """Return the angle of a leg's link less that of the body whose guide it slides on."""
        first, second = (self.placement(b)[1] for b in (joint.first_body, joint.second_body))
        turn = self.shape.turn(joint, self.u) + first - second
        return turn if self.shape.node_of(joint.second_body) == node else -turn

    def coordinates(
        self, frames: Mapping[str, tuple[complex, complex]]
    ) -> Iterator[tuple[tuple[str, str], float]]:
        """Yield the coordinates of the group's bodies."""
        for body in self.shape.group.bodies:
            z, w = frames[self.shape.node[body]]
            offset, angle = self.placed[body]
            origin = z + w * offset
            turned = cmath.phase(w * cmath.rect(1, angle))
            for name, value in zip(PLANE.twist, (origin.real, origin.imag, turned), strict=True):
                yield (body, name), value


def place(reference: str, slot: str = "") -> LegPoint:
    """Return the place of ``body.point``."""
    body, point = reference.split(".")
    return LegPoint(body, point, slot)


def _compose(frame: Pose, relative: Pose) -> Pose:
    return frame[0] + cmath.rect(1, frame[1]) * relative[0], frame[1] + relative[1]
