"""Wheels, racks and screws as sums of the coordinates of a tree that do not change."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from mechdae.describe import GROUND, Joint
from mechdae.errors import UnavailableError
from mechdae.parts.exchange.robots.link_frames import BodyFrame, Described, Z, turned
from mechdae.parts.exchange.robots.tree_parts import Coupling, TreeEdge
from mechdae.records import dataclass
from mechdae.tasks import ExportedMotion
from mechdae.types import Floats

KEPT = 1e-9
"""Largest change of a sum along the task, in radians or in the mechanism's size."""
Sum = dict[str, float]


def couplings_of(
    motion: ExportedMotion,
    described: Described,
    frames: Mapping[str, BodyFrame],
    edges: Mapping[str, TreeEdge],
) -> list[Coupling]:
    """Return the couplings of a tree, each compared with all poses of the motion."""
    wheels = _Wheels(motion, described, frames, edges)
    found = []
    for name, joint in motion.mechanism.joints.items():
        if f"{name}.pitch" in described.values:
            pitch = described.values[f"{name}.pitch"] / (2 * math.pi)
            if name in edges:
                factors = {f"{name}.slide": 1.0, f"{name}.angle": -pitch}
                found.append(_checked(motion, name, factors))
        elif joint.meshes:
            found.append(_checked(motion, name, wheels.mesh(joint)))
    return found


@dataclass(frozen=True)
class _Wheels:
    """What wheels and racks turn and shift, by the edges of a tree."""

    motion: ExportedMotion
    described: Described
    frames: Mapping[str, BodyFrame]
    edges: Mapping[str, TreeEdge]

    def mesh(self, joint: Joint) -> Sum:
        """Return the sum of coordinates that two wheels, or wheel and rack, keep."""
        described, carrier = self.described, getattr(joint, "carrier", None) or GROUND
        first = self._angle(joint, joint.first_body, carrier)
        if joint.wheels == 2:
            second = self._angle(joint, joint.second_body, carrier)
            return _plus(first, second, -joint.turn_ratio(described.values))
        radius = described.values[f"{joint.name}.radius"]
        if self.motion.mechanism.dimension == 3:
            return _plus({self._slide(joint, carrier): 1.0}, first, -radius)
        rack = self.frames[joint.second_body]
        axis = rack.R @ turned(Z, described.values[f"{joint.name}.axis"])[:, 0]
        found = _plus({}, first, -radius)
        for reference, sign in ((joint.second, 1.0), (joint.first, -1.0)):
            found = _plus(found, self._along(joint, reference, axis), sign)
        return found

    def _upwards(self, body: str) -> Iterator[tuple[str, TreeEdge]]:
        """Yield the bodies on the way to the ground, each with the joint that it hangs on."""
        above = {edge.child: edge for edge in self.edges.values()}
        while body in above:
            edge = above.pop(body)
            yield body, edge
            body = edge.parent

    def _between(self, one: str, other: str, kind: str) -> tuple[TreeEdge, str] | None:
        """Return the joint of the tree between two bodies with a single freedom of a kind."""
        for edge in self.edges.values():
            names = [motion.coordinate for motion in edge.motions if motion.kind == kind]
            if {edge.parent, edge.child} == {one, other} and len(names) == 1:
                return edge, names[0]
        return None

    def _along(self, joint: Joint, reference: str, axis: Floats) -> Sum:
        """Return the place of a point along a fixed direction: slides on its way to the ground."""
        described, body = self.described, reference.split(".")[0]
        place = self.frames[body].world(described.local(reference))
        found: Sum = {}
        for child, edge in self._upwards(body):
            frame = self.frames[child]
            for motion in edge.motions:
                if motion.kind == "slide":
                    share = float(axis @ (frame.R @ motion.axis))
                    found = _plus(found, {motion.coordinate: share * (abs(share) > KEPT)}, 1.0)
                    continue
                pair = self.motion.mechanism.joints[edge.joint]
                hinge = described.local(pair.second if edge.forward else pair.first)
                gap = np.linalg.norm(frame.world(hinge) - place)
                if gap > KEPT * described.mechanism.scale:
                    raise UnavailableError(
                        f"{reference} is not guided along the rack in the tree of links",
                        where=f"joints.{joint.name}",
                    )
        return found

    def _slide(self, joint: Joint, carrier: str) -> str:
        found = self._between(joint.second_body, carrier, "slide")
        if found is None:
            raise UnavailableError(
                f"rack {joint.second_body} has no guide on {carrier} in the tree of links",
                where=f"joints.{joint.name}",
            )
        return found[1]

    def _angle(self, joint: Joint, body: str, carrier: str) -> Sum:
        if self.motion.mechanism.dimension == 2:
            return _plus(self._turn(body), self._turn(carrier), -1.0)
        if body == carrier:
            return {}
        found = self._between(body, carrier, "hinge")
        if found is None:
            raise UnavailableError(
                f"wheel {body} does not turn on {carrier} in the tree of links",
                where=f"joints.{joint.name}",
            )
        pair = self.motion.mechanism.joints[found[0].joint]
        return {found[1]: 1.0 if pair.second_body == body else -1.0}

    def _turn(self, body: str) -> Sum:
        """Return the angle of a body of the plane: the hinges on its way to the ground."""
        found: Sum = {}
        for _, edge in self._upwards(body):
            for motion in edge.motions:
                if motion.kind == "hinge":
                    found = _plus(found, {motion.coordinate: 1.0 if edge.forward else -1.0}, 1.0)
        return found


def _plus(one: Sum, other: Sum, factor: float) -> Sum:
    found = dict(one)
    for name, value in other.items():
        found[name] = found.get(name, 0.0) + factor * value
    return {name: value for name, value in found.items() if value}


def _sums(motion: ExportedMotion, factors: Sum) -> Floats:
    total = np.zeros(1)
    for word, factor in factors.items():
        joint, _, quantity = word.partition(".")
        total = total + factor * np.asarray(motion.result.joints[joint][quantity])
    return np.asarray(total, float)[motion.rows]


def _changes(motion: ExportedMotion, factors: Sum) -> float:
    """Return the largest change of a sum along the task, by its natural size."""
    scale = motion.mechanism.scale if any(w.endswith(".slide") for w in factors) else 1.0
    sums = _sums(motion, factors)
    return float(np.ptp(sums)) / (scale * max(1.0, *map(abs, factors.values())))


def _checked(motion: ExportedMotion, name: str, factors: Sum) -> Coupling:
    """Return a coupling whose sum is the same in all poses."""
    if not _changes(motion, factors) <= KEPT:
        raise UnavailableError(
            "what the wheels turn is no sum of coordinates of the tree of links",
            where=f"joints.{name}",
        )
    return Coupling(name, factors, float(_sums(motion, factors)[0]))
