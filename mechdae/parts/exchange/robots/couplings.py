"""Wheels, racks and screws as sums of the coordinates of a tree that do not change."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND
from mechdae.errors import UnavailableError
from mechdae.parts.exchange.robots.link_frames import BodyFrame, Described, Z, turned
from mechdae.parts.exchange.robots.tree_parts import Coupling, TreeEdge
from mechdae.tasks.motion_of import ExportedMotion

KEPT = 1e-9
"""Largest change of a sum along the task, in radians or in the mechanism's size."""
Sum = dict[str, float]


def couplings_of(
    motion: ExportedMotion,
    described: Described,
    frames: Mapping[str, BodyFrame],
    edges: Mapping[str, TreeEdge],
) -> list[Coupling]:
    """Return the couplings of a tree, each compared with all poses of the motion.

    Raises
    ------
    UnavailableError
        Wheels whose angles are no sums of coordinates of the tree.
    """
    found = []
    for name, joint in motion.mechanism.joints.items():
        if f"{name}.pitch" in described.values:
            pitch = described.values[f"{name}.pitch"] / (2 * math.pi)
            if name in edges:
                factors = {f"{name}.slide": 1.0, f"{name}.angle": -pitch}
                found.append(_checked(motion, name, factors))
        elif joint.meshes:
            found.append(_checked(motion, name, _mesh(motion, described, frames, edges, joint)))
    return found


def _mesh(
    motion: ExportedMotion,
    described: Described,
    frames: Mapping[str, BodyFrame],
    edges: Mapping[str, TreeEdge],
    joint: Joint,
) -> Sum:
    carrier = getattr(joint, "carrier", None) or GROUND
    first = _angle(motion, edges, joint, joint.first_body, carrier)
    if joint.wheels == 2:
        second = _angle(motion, edges, joint, joint.second_body, carrier)
        return _plus(first, second, -joint.turn_ratio(described.values))
    radius = described.values[f"{joint.name}.radius"]
    if motion.mechanism.dimension == 3:
        return _plus({_slide(edges, joint, carrier): 1.0}, first, -radius)
    rack = frames[joint.second_body]
    axis = rack.R @ turned(Z, described.values[f"{joint.name}.axis"])[:, 0]
    found = _plus({}, first, -radius)
    for reference, sign in ((joint.second, 1.0), (joint.first, -1.0)):
        found = _plus(found, _along(described, frames, edges, joint, reference, axis), sign)
    return found


def _along(
    described: Described,
    frames: Mapping[str, BodyFrame],
    edges: Mapping[str, TreeEdge],
    joint: Joint,
    reference: str,
    axis: Any,
) -> Sum:
    """Return the place of a point along a fixed direction: the slides on its way to the ground."""
    above = {edge.child: edge for edge in edges.values()}
    body = reference.split(".")[0]
    place = frames[body].world(described.local(reference))
    found: Sum = {}
    while body in above:
        edge = above[body]
        for own in edge.motions:
            if own.kind == "slide":
                share = float(axis @ (frames[body].R @ own.axis))
                found = _plus(found, {own.coordinate: share if abs(share) > KEPT else 0.0}, 1.0)
                continue
            hinge = described.local(_end(edge, described.mechanism.joints[edge.joint]))
            gap = np.linalg.norm(frames[body].world(hinge) - place)
            if gap > KEPT * described.mechanism.scale:
                raise UnavailableError(
                    f"{reference} is not guided along the rack in the tree of links",
                    where=f"joints.{joint.name}",
                )
        body = edge.parent
    return found


def _end(edge: TreeEdge, joint: Joint) -> str:
    """Return the point of a joint on the child of the tree."""
    return joint.second if edge.forward else joint.first


def _slide(edges: Mapping[str, TreeEdge], joint: Joint, carrier: str) -> str:
    rack = joint.second_body
    for edge in edges.values():
        slides = [m for m in edge.motions if m.kind == "slide"]
        if {edge.parent, edge.child} == {rack, carrier} and len(slides) == 1:
            return slides[0].coordinate
    raise UnavailableError(
        f"rack {rack} has no guide on {carrier} in the tree of links", where=f"joints.{joint.name}"
    )


def _angle(
    motion: ExportedMotion, edges: Mapping[str, TreeEdge], joint: Joint, body: str, carrier: str
) -> Sum:
    """Return the angle of a wheel from its carrier as a sum of coordinates."""
    if motion.mechanism.dimension == 2:
        return _plus(_turn(edges, body), _turn(edges, carrier), -1.0)
    if body == carrier:
        return {}
    for edge in edges.values():
        hinges = [m for m in edge.motions if m.kind == "hinge"]
        if {edge.parent, edge.child} == {body, carrier} and len(hinges) == 1:
            own = motion.mechanism.joints[edge.joint]
            return {hinges[0].coordinate: 1.0 if own.second_body == body else -1.0}
    raise UnavailableError(
        f"wheel {body} does not turn on {carrier} in the tree of links",
        where=f"joints.{joint.name}",
    )


def _turn(edges: Mapping[str, TreeEdge], body: str) -> Sum:
    """Return the angle of a body of the plane: the hinges on its way to the ground."""
    above = {edge.child: edge for edge in edges.values()}
    found: Sum = {}
    while body in above:
        edge = above[body]
        for own in edge.motions:
            if own.kind == "hinge":
                found = _plus(found, {own.coordinate: 1.0 if edge.forward else -1.0}, 1.0)
        body = edge.parent
    return found


def _plus(one: Sum, other: Sum, factor: float) -> Sum:
    found = dict(one)
    for name, value in other.items():
        found[name] = found.get(name, 0.0) + factor * value
    return {name: value for name, value in found.items() if value}


def _sums(motion: ExportedMotion, factors: Sum) -> Any:
    total: Any = 0.0
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
