"""Groups that are two bodies joined by three legs, whichever of their links is known.

Links welded together or held by a driver count as one body, all that is known as one more. If
two of these bodies, base and platform, are joined by three legs, each a link with two lower pairs
or a higher pair, all poses follow by elimination (`triad`). The base is what is known in a triad of
class III; in a group of class IV with four links it is one of them, and the known link is a leg.
"""

from __future__ import annotations

import cmath
import itertools
from collections.abc import Mapping
from typing import TYPE_CHECKING

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND
from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene
from mechdae.motion.assembly.platform import EPS, Leg, closures
from mechdae.motion.cases.larger_groups.rigid_parts import (
    Coordinates,
    GroupParts,
    GroupPoses,
    LegPoint,
    OtherShape,
    PlacedParts,
    ShapedGroup,
    place,
    shaped,
)
from mechdae.records import dataclass

if TYPE_CHECKING:
    from mechdae.types import Floats


ELIMINATED = "elimination: the roots of one polynomial"


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


def truss(scene: Scene, group: Group, p: Floats) -> ShapedGroup | None:
    """Return the group as a platform on three legs, None when it is none."""
    return shaped((Truss,), scene, group, p)


class Truss(GroupParts):
    """A group of two bodies joined by three legs, and all its poses."""

    def __init__(self, scene: Scene, group: Group, p: Floats) -> None:
        super().__init__(scene, group, p)
        nodes = self.nodes
        for base, platform in itertools.combinations(nodes, 2):
            struts = self._struts(nodes, base, platform)
            if struts is not None:
                self.base, self.platform, self.struts = base, platform, struts
                return
        raise OtherShape

    def _struts(self, nodes: list[str], base: str, platform: str) -> list[Strut] | None:
        """Return the legs when three of them join two bodies and nothing else is there."""
        hubs = {base, platform}
        ends: dict[str, dict[str, LegEnd]] = {node: {} for node in nodes if node not in hubs}
        struts: list[Strut] = []
        for pin in self.pins:
            at = {self.node_of(place.body): place for place in pin}
            hub = base if base in at else platform
            if len(at) != len(pin) - self._repeated(pin) or hub not in at or hubs <= set(at):
                return None
            for node in at.keys() - hubs:
                if hub in ends[node]:
                    return None
                ends[node][hub] = LegEnd(at[node], at[hub])
        for joint in self.guides:
            pair = {self.node_of(joint.first_body), self.node_of(joint.second_body)}
            if len(pair & hubs) != 1 or len(pair) != 2:
                return None
            (hub,), (node,) = pair & hubs, pair - hubs
            if hub in ends[node]:
                return None
            ends[node][hub] = LegEnd(guide=joint)
        for joint in self.higher:
            if {self.node_of(joint.first_body), self.node_of(joint.second_body)} != hubs:
                return None
            struts.append(Strut(joint=joint))
        for _, c in self.rails:
            if base != GROUND or self.node_of(c.part) != platform:
                return None
            struts.append(Strut(driven=c))
        for node, joined in ends.items():
            if joined.keys() != hubs or all(end.guide for end in joined.values()):
                return None
            struts.append(Strut(node, (joined[base], joined[platform])))
        return struts if len(struts) == 3 else None

    def _repeated(self, pin: set[LegPoint]) -> int:
        """Return how many places of a pin belong to known bodies besides the first."""
        return max(sum(self.node_of(place.body) == GROUND for place in pin) - 1, 0)

    def solve(self, q: Coordinates, u: Floats) -> GroupPoses:
        at = _Numbers(self, q, u)
        legs = [at.leg(strut) for strut in self.struts]
        bars = [leg.length for leg in legs if leg.normal == 0]
        if bars and min(bars) <= 64 * EPS * max(bars):  # its pins meet: it turns by itself
            return GroupPoses([], False, free=True)
        found = closures(legs)
        poses = []
        for z, w in zip(found.z, found.w, strict=True):
            frames = at.frames(complex(z), complex(w))
            poses.append(dict(at.coordinates(frames)))
        basis = ELIMINATED if found.proven else ""
        return GroupPoses(poses, found.proven, basis, found.gap, found.free)


class _Numbers(PlacedParts):
    """The numbers of a truss at one pose of what is known."""

    shape: Truss

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
        turned = cmath.rect(1, self.guided(joint, node))
        first, second = place(joint.first), place(joint.second)
        inside = self.shape.node_of(joint.first_body) == node
        normal = self.normal(joint) * (turned if inside else 1)
        link, hub = (first, second) if inside else (second, first)
        away = turned * (self.spot(link) - pin)
        return self.spot(hub), -(normal.conjugate() * away).real, normal

    def _higher(self, joint: Joint) -> Leg:
        first, second = self.spot(place(joint.first)), self.spot(place(joint.second))
        turning = self.shape.node_of(joint.first_body) == self.shape.platform
        base, platform = (second, first) if turning else (first, second)
        if joint.bar:
            return Leg(base, platform, self.shape.number(f"{joint.name}.length"))
        return Leg(base, platform, 0.0, self.normal(joint), turning)

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
                turned = w * cmath.rect(1, self.guided(end.guide, strut.link))
            elif end.link is not None and end.hub is not None:
                pins.append((self.spot(end.link), z + w * self.spot(end.hub)))
        if len(pins) == 2:
            turned = (pins[1][1] - pins[0][1]) / (pins[1][0] - pins[0][0])
            turned /= abs(turned)
        local, place = pins[0]
        return place - turned * local, turned
