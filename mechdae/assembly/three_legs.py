"""Groups that are two bodies joined by three legs, whichever of their links is known.

Links welded together or held by a driver count as one body, all that is known as one more. If
two of these bodies, base and platform, are joined by three legs, each a link with two lower pairs
or a higher pair, all poses follow by elimination (`triad`). The base is what is known in a triad of
class III; in a group of class IV with four links it is one of them, and the known link is a leg.
"""

from __future__ import annotations

import cmath
import itertools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from mechdae.assembly.platform import EPS, Closures, Leg, closures
from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.joints import Joint
from mechdae.describe.mechanism import GROUND
from mechdae.kernels.run.call import Call
from mechdae.model.groups import Group
from mechdae.model.reduction import Scene
from mechdae.model.space import PLANE

Pose = tuple[complex, float]
"""Origin and angle of a frame in another."""


@dataclass(frozen=True)
class LegPoint:
    """A point of a body; of a slot whose slide is driven, the place of its pin."""

    body: str
    point: str
    slot: str = ""


@dataclass(frozen=True)
class LegEnd:
    """Where a leg's link is joined to base or platform: a pin's two places, or a guide."""

    link: LegPoint | None = None
    hub: LegPoint | None = None
    guide: Joint | None = None


@dataclass(frozen=True)
class Strut:
    """A leg: a link with its ends at base and platform, a joint, or a driven point."""

    link: str = ""
    ends: tuple[LegEnd, LegEnd] | None = None
    joint: Joint | None = None
    driven: NamedCoordinate | None = None


class _NoTruss(Exception):
    """The group has another shape."""


def truss(scene: Scene, group: Group, p: Any) -> Truss | None:
    """Return the group as a platform on three legs, None when it is none."""
    try:
        return Truss(scene, group, p)
    except _NoTruss:
        return None


class Truss:
    """A group of two bodies joined by three legs, and all its poses."""

    def __init__(self, scene: Scene, group: Group, p: Any) -> None:
        model = scene.model
        if model.mechanism.dimension != 2 or not group.bodies:
            raise _NoTruss
        self.group, self.model, self.p = group, model, p
        self.joints = [model.mechanism.joints[name] for name in group.joints]
        self._read_drivers(scene)
        self._numbers: dict[str, complex] = {}
        self.rigid: list[Joint] = []
        self.pins: list[set[LegPoint]] = []
        self.guides: list[Joint] = []
        self.higher: list[Joint] = []
        for joint in self.joints:
            self._sort(joint)
        self.node = {name: name for name in (GROUND, *group.bodies)}
        for joint in self.rigid:
            self._unite(joint)
        nodes = [name for name, node in self.node.items() if name == node]
        for base, platform in itertools.combinations(nodes, 2):
            struts = self._struts(nodes, base, platform)
            if struts is not None:
                self.base, self.platform, self.struts = base, platform, struts
                return
        raise _NoTruss

    # -- shape -----------------------------------------------------------------------------

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
                raise _NoTruss

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
            raise _NoTruss

    def _unite(self, joint: Joint) -> None:
        one, other = self._node(joint.first_body), self._node(joint.second_body)
        if one == other:
            raise _NoTruss
        old, new = (one, other) if other == GROUND else (other, one)
        self.node = {name: new if node == old else node for name, node in self.node.items()}

    def _node(self, body: str) -> str:
        return self.node.get(body, GROUND)

    def _struts(self, nodes: list[str], base: str, platform: str) -> list[Strut] | None:
        """Return the legs when three of them join two bodies and nothing else is there."""
        hubs = {base, platform}
        ends: dict[str, dict[str, LegEnd]] = {node: {} for node in nodes if node not in hubs}
        struts: list[Strut] = []
        for pin in self.pins:
            at = {self._node(place.body): place for place in pin}
            hub = base if base in at else platform
            if len(at) != len(pin) - self._repeated(pin) or hub not in at or hubs <= set(at):
                return None
            for node in at.keys() - hubs:
                if hub in ends[node]:
                    return None
                ends[node][hub] = LegEnd(at[node], at[hub])
        for joint in self.guides:
            pair = {self._node(joint.first_body), self._node(joint.second_body)}
            if len(pair & hubs) != 1 or len(pair) != 2:
                return None
            (hub,), (node,) = pair & hubs, pair - hubs
            if hub in ends[node]:
                return None
            ends[node][hub] = LegEnd(guide=joint)
        for joint in self.higher:
            if {self._node(joint.first_body), self._node(joint.second_body)} != hubs:
                return None
            struts.append(Strut(joint=joint))
        for _, c in self.rails:
            if base != GROUND or self._node(c.part) != platform:
                return None
            struts.append(Strut(driven=c))
        for node, joined in ends.items():
            if joined.keys() != hubs or all(end.guide for end in joined.values()):
                return None
            struts.append(Strut(node, (joined[base], joined[platform])))
        return struts if len(struts) == 3 else None

    def _repeated(self, pin: set[LegPoint]) -> int:
        """Return how many places of a pin belong to known bodies besides the first."""
        return max(sum(self._node(place.body) == GROUND for place in pin) - 1, 0)

    # -- numbers ---------------------------------------------------------------------------

    def _number(self, name: str) -> float:
        """Return a number of a joint."""
        if name not in self._numbers:
            self._numbers[name] = float(self._value(name, lambda: self.model.numbers[name])[0])
        return self._numbers[name].real

    def _local(self, place: LegPoint) -> complex:
        """Return a point in its body's frame."""
        name = f"{place.body}.{place.point}"
        if name not in self._numbers:
            self._numbers[name] = complex(*self._value(name, lambda: self.model.local(name)))
        return self._numbers[name]

    def _value(self, name: str, make: Callable[[], Any]) -> Any:
        """Return the value (n,) of an expression over p."""

        def function() -> Call:
            return Call(ca.Function("n", [self.model.p], [ca.densify(ca.SX(make()))]))

        return self.model.kept(("number", name), function)(self.p)[0]

    def _turn(self, joint: Joint, u: Any) -> float:
        """Return the angle of a joint's second body less that of its first."""
        k, kind = self.driven.get(joint.name, (0, ""))
        return float(u[k]) if kind == "joint angle" else self._number(f"{joint.name}.turn")

    def solve(self, q: Mapping[tuple[str, str], float], u: Any) -> tuple[list[Any], Closures]:
        """Return the bodies' coordinates in all poses, as {(body, name): value}, and the count.

        Parameters
        ----------
        q
            Absolute coordinates of earlier groups.
        u : (nd,) array
            Driver values.
        """
        at = _Numbers(self, q, u)
        legs = [at.leg(strut) for strut in self.struts]
        bars = [leg.length for leg in legs if leg.normal == 0]
        if bars and min(bars) <= 64 * EPS * max(bars):  # its pins meet: it turns by itself
            return [], Closures(np.zeros(0), np.zeros(0), False, free=True)
        found = closures(legs)
        poses = []
        for z, w in zip(found.z, found.w, strict=True):
            frames = at.frames(complex(z), complex(w))
            poses.append(dict(at.coordinates(frames)))
        return poses, found


class _Numbers:
    """The numbers of a truss at one pose of what is known."""

    def __init__(self, shape: Truss, q: Mapping[tuple[str, str], float], u: Any) -> None:
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
        turn = shape._turn(joint, self.u)
        first, second = shape._local(place(joint.first)), shape._local(place(joint.second))
        if kind == "slide":
            first += float(self.u[k]) * cmath.rect(1, shape._number(f"{joint.name}.axis"))
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
        local = shape._local(place)
        if place.slot:
            slide = float(self.u[shape.driven[place.slot][0]])
            local += slide * cmath.rect(1, shape._number(f"{place.slot}.axis"))
        z, angle = self.placement(place.body)
        return z + cmath.rect(1, angle) * local

    def _normal(self, joint: Joint) -> complex:
        """Return the normal of a guide in the frame of its first body's node."""
        angle = self.placement(joint.first_body)[1] + self.shape._number(f"{joint.name}.axis")
        return 1j * cmath.rect(1, angle)

    def _guided(self, joint: Joint, node: str) -> float:
        """Return the angle of a leg's link less that of the body whose guide it slides on."""
        first, second = (self.placement(b)[1] for b in (joint.first_body, joint.second_body))
        turn = self.shape._turn(joint, self.u) + first - second
        return turn if self.shape._node(joint.second_body) == node else -turn

    def leg(self, strut: Strut) -> Leg:
        """Return a leg's numbers."""
        if strut.driven is not None:
            c = strut.driven
            k = next(k for k, other in self.shape.rails if other == c)
            point = self.spot(LegPoint(c.part, c.point))
            return Leg(0j, point, float(self.u[k]), 1j if c.axis else 1)
        if strut.joint is not None:
            return self._higher(strut.joint)
        assert strut.ends is not None
        at_base, at_platform = strut.ends
        if at_base.guide is None and at_platform.guide is None:
            places = [at_base.hub, at_platform.hub, at_base.link, at_platform.link]
            base, platform, one, other = (self.spot(place) for place in places if place)
            return Leg(base, platform, abs(other - one))
        pinned, sliding = strut.ends if at_platform.guide else strut.ends[::-1]
        assert sliding.guide is not None
        assert pinned.hub is not None
        assert pinned.link is not None
        on_platform, hub = sliding is at_platform, self.spot(pinned.hub)
        guide, offset, normal = self._guide(sliding.guide, strut.link, self.spot(pinned.link))
        if on_platform:
            return Leg(hub, guide, -offset, normal, turning=True)
        return Leg(guide, hub, offset, normal)

    def _guide(self, joint: Joint, node: str, pin: complex) -> tuple[complex, float, complex]:
        """Return a point of a guide, the offset of a sliding link's pin from it, its normal."""
        turned = cmath.rect(1, self._guided(joint, node))
        first, second = place(joint.first), place(joint.second)
        inside = self.shape._node(joint.first_body) == node
        normal = self._normal(joint) * (turned if inside else 1)
        link, hub = (first, second) if inside else (second, first)
        away = turned * (self.spot(link) - pin)
        return self.spot(hub), -(normal.conjugate() * away).real, normal

    def _higher(self, joint: Joint) -> Leg:
        first, second = self.spot(place(joint.first)), self.spot(place(joint.second))
        turning = self.shape._node(joint.first_body) == self.shape.platform
        base, platform = (second, first) if turning else (first, second)
        if joint.bar:
            return Leg(base, platform, self.shape._number(f"{joint.name}.length"))
        return Leg(base, platform, 0.0, self._normal(joint), turning)

    # -- back to bodies --------------------------------------------------------------------

    def frames(self, z: complex, w: complex) -> dict[str, tuple[complex, complex]]:
        """Return origin and direction of the nodes' frames; what is known stays where it is."""
        shape = self.shape
        found = {shape.base: (0j, 1 + 0j), shape.platform: (z, w)}
        for strut in shape.struts:
            if strut.ends is not None:
                found[strut.link] = self._link(strut, found)
        z0, w0 = found[GROUND]
        back = w0.conjugate()
        return {node: ((z - z0) * back, w * back) for node, (z, w) in found.items()}

    def _link(
        self, strut: Strut, found: Mapping[str, tuple[complex, complex]]
    ) -> tuple[complex, complex]:
        assert strut.ends is not None
        hubs = (self.shape.base, self.shape.platform)
        pins = []
        for end, hub in zip(strut.ends, hubs, strict=True):
            z, w = found[hub]
            if end.guide is not None:
                turned = w * cmath.rect(1, self._guided(end.guide, strut.link))
            elif end.link is not None and end.hub is not None:
                pins.append((self.spot(end.link), z + w * self.spot(end.hub)))
        if len(pins) == 2:
            turned = (pins[1][1] - pins[0][1]) / (pins[1][0] - pins[0][0])
            turned /= abs(turned)
        local, place = pins[0]
        return place - turned * local, turned

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
