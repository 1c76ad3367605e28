"""A mechanism as a tree of links with loops to be closed, as simulators of robots want it.

Of each loop one joint is left out of the tree: those of one freedom are kept first. The links'
frames have the directions of the bodies' own frames and their origins at the joint to the parent.
Coordinates of the tree's joints are those of mechdae: second body less first body.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mechdae.describe.coordinates import coordinate
from mechdae.describe.joints.joint import Joint
from mechdae.describe.joints.spatial import SpatialJoint
from mechdae.describe.mechanism import GROUND
from mechdae.errors import MechdaeError, UnavailableError
from mechdae.parts.exchange.robots.couplings import couplings_of
from mechdae.parts.exchange.robots.link_frames import BodyFrame, Described, MassOf, Z, frames_of
from mechdae.parts.exchange.robots.tree_parts import (
    Coupling,
    ElementaryMotion,
    LoopJoint,
    TreeEdge,
    TreeLink,
)
from mechdae.tasks.motion_of import ExportedMotion, reported

SMALL = 2e-3
"""Share of its heaviest neighbour's mass that a massless body gets where simulators need one,"""
SPREAD = 0.1
"""and the radius of gyration that it gets, as a share of the mechanism's size."""
RANKS = {"revolute": 1, "prismatic": 1, "weld": 0, "cylindrical": 2, "screw": 2, "universal": 2,
         "pin-in-slot": 3, "planar": 3, "spherical": 4}  # fmt: skip
"""Which joints are kept in the tree first."""


@dataclass
class LinkTree:
    """Links, joints of the tree from the ground outwards, joints that close loops, wheels."""

    motion: ExportedMotion
    row: int
    links: dict[str, TreeLink] = field(default_factory=dict)
    edges: dict[str, TreeEdge] = field(default_factory=dict)
    loops: list[LoopJoint] = field(default_factory=list)
    couplings: list[Coupling] = field(default_factory=list)

    def children(self, parent: str) -> list[TreeEdge]:
        """Return the joints that hang on a link."""
        return [edge for edge in self.edges.values() if edge.parent == parent]

    def motions(self) -> Iterator[ElementaryMotion]:
        """Yield the freedoms of the tree."""
        for edge in self.edges.values():
            yield from edge.motions

    @property
    def size(self) -> float:
        """A length of the mechanism [m]."""
        return self.motion.mechanism.scale

    @property
    def left_out(self) -> list[str]:
        """What the problem has and no format of robots holds."""
        mechanism = self.motion.mechanism
        found = [f"load {name}" for name in mechanism.loads]
        rubs = [name for name, own in mechanism.joints.items() if getattr(own, "friction", None)]
        found += [f"friction in {name}" for name in rubs]
        losses = [name for name, own in mechanism.joints.items() if getattr(own, "mesh_loss", None)]
        found += [f"losses in {name}" for name in losses]
        held = [n for n, own in mechanism.joints.items() if getattr(own, "one_sided", None)]
        return found + [f"{name} holds in one sense only" for name in held]


def link_tree(motion: ExportedMotion) -> LinkTree:
    """Return the tree of a motion's mechanism in its first assembled pose.

    Raises
    ------
    UnavailableError
        A joint that is no joint of links (a curve, a vector of a loop), a body that hangs on
        nothing.
    """
    described = Described(motion.mechanism)
    tree = LinkTree(motion, motion.first)
    frames = frames_of(motion, described, tree.row)
    for name, joint in motion.mechanism.joints.items():
        if joint.on_curve or joint.pointer:
            raise UnavailableError(
                f"a {joint.kind} joint is no joint between links that simulators of robots know",
                where=f"joints.{name}",
                hint="export --format dxf draws it",
            )
    for edge_joint, forward in _chosen(motion):
        _grow(tree, described, frames, edge_joint, forward)
    for name in motion.mechanism.bodies:
        if name not in tree.links:
            _float(tree, described, frames, name)
    for name, joint in motion.mechanism.joints.items():
        if name not in tree.edges and not joint.meshes:
            tree.loops.append(_loop(tree, described, frames, joint))
    tree.couplings = couplings_of(motion, described, frames, tree.edges)
    return tree


def _chosen(motion: ExportedMotion) -> list[tuple[Joint, bool]]:
    """Return the joints of the tree, each with whether its first body is the parent."""
    mechanism = motion.mechanism
    driven = {driven_joint(motion, name) for name in motion.result.drivers}
    racks = any(joint.wheels == 1 for joint in mechanism.joints.values())
    places = {name: k for k, name in enumerate(mechanism.joints)}

    def rank(joint: Joint) -> tuple[int, int]:
        known = RANKS.get(joint.kind, 9)
        if joint.name in driven or (racks and joint.guide):  # what racks run along are slides
            known = -1
        return known, places[joint.name]

    order = sorted((j for j in mechanism.joints.values() if not j.meshes and not j.bar), key=rank)
    reached, chosen = {GROUND}, list[tuple[Joint, bool]]()
    while True:
        for joint in order:
            one, other = joint.first_body in reached, joint.second_body in reached
            if one != other:
                chosen.append((joint, one))
                reached |= {joint.first_body, joint.second_body}
                break
        else:
            return chosen


def driven_joint(motion: ExportedMotion, driver: str) -> str:
    """Return the joint that a driver moves, "" where it is none."""
    mechanism = motion.mechanism
    try:
        found = coordinate(mechanism, driver)
    except MechdaeError:
        return ""
    if found.kind != "body angle":
        return found.part
    for name, joint in mechanism.joints.items():
        if joint.hinge and {joint.first_body, joint.second_body} == {GROUND, found.part}:
            return name
    return ""


def _grow(
    tree: LinkTree,
    described: Described,
    frames: Mapping[str, BodyFrame],
    joint: Joint,
    forward: bool,
) -> None:
    """Put a joint and its link into the tree."""
    parent, child = joint.first_body, joint.second_body
    here = joint.second
    if not forward:
        parent, child, here = child, parent, joint.first
    own = frames[child]
    frame = BodyFrame(own.world(described.local(here)), own.R)
    shift = described.local(here)
    body = tree.motion.mechanism.bodies[child]
    points = {p: described.local(f"{child}.{p}") - shift for p in body.points}
    mass, assumed = _mass(tree, described, child)
    mass = MassOf(mass.mass, mass.center - shift, mass.inertia)
    tree.links[child] = TreeLink(child, frame, mass, points, assumed)
    motions = _motions(tree, described, frames, joint, frame)
    if not forward:
        motions = tuple(
            ElementaryMotion(m.kind, -m.axis, m.anchor, m.coordinate, m.start)
            for m in reversed(motions)
        )
    tree.edges[joint.name] = TreeEdge(joint.name, joint.kind, parent, child, forward, motions)


def _float(
    tree: LinkTree, described: Described, frames: Mapping[str, BodyFrame], name: str
) -> None:
    """Put a body that hangs on bars only: it moves freely, its coordinates are its place."""
    point = next(iter(tree.motion.mechanism.bodies[name].points))
    shift = described.local(f"{name}.{point}")
    own = frames[name]
    frame = BodyFrame(own.world(shift), own.R)
    points = {
        p: described.local(f"{name}.{p}") - shift for p in tree.motion.mechanism.bodies[name].points
    }
    mass, assumed = _mass(tree, described, name)
    mass = MassOf(mass.mass, mass.center - shift, mass.inertia)
    tree.links[name] = TreeLink(name, frame, mass, points, assumed)
    motions: tuple[ElementaryMotion, ...] = ()
    if tree.motion.mechanism.dimension == 2:
        angle = float(np.ravel(reported(tree.motion, "bodies", name, "angle", tree.row))[0])
        here = np.zeros(3)
        motions = (
            ElementaryMotion("slide", own.R.T[:, 0], here, f"{name}.{point}.x", frame.origin[0]),
            ElementaryMotion("slide", own.R.T[:, 1], here, f"{name}.{point}.y", frame.origin[1]),
            ElementaryMotion("hinge", Z, here, f"{name}.angle", angle),
        )
    else:
        motions = (ElementaryMotion("free", Z, np.zeros(3), f"{name}.free", 0.0),)
    tree.edges[f"{name}.free"] = TreeEdge(f"{name}.free", "free", GROUND, name, True, motions)


def _mass(tree: LinkTree, described: Described, name: str) -> tuple[MassOf, str]:
    """Return the mass of a link, and what of it is assumed: simulators take no massless ones."""
    bodies = tree.motion.mechanism.bodies
    small, heavy = _small(tree, described, name)
    least = small * (SPREAD * tree.size) ** 2 * np.eye(3)
    found = described.mass(name)
    if found is None:
        points = [described.local(f"{name}.{p}") for p in bodies[name].points]
        told = f"mass {small:g} kg and inertia {least[0, 0]:g} kg m2{heavy}"
        return MassOf(small, np.mean(points, axis=0), least), told
    assumed = []
    mass, inertia = found.mass, found.inertia
    if not mass > 0:
        mass, assumed = small, [f"mass {small:g} kg{heavy}"]
    if not np.linalg.eigvalsh(inertia).min() > 0:
        inertia = inertia + least
        assumed.append(f"inertia {least[0, 0]:g} kg m2")
    return MassOf(mass, found.center, inertia), " and ".join(assumed)


def _small(tree: LinkTree, described: Described, name: str) -> tuple[float, str]:
    """Return the mass that is assumed for a body, and by which neighbour.

    Loops hold as well as masses on both of their sides are alike: it is a share of the heaviest
    body beside it, or beside the massless ones that it hangs on.
    """
    mechanism = tree.motion.mechanism
    pairs = [set(joint.bodies) for joint in mechanism.joints.values()]
    reached, near = {name, GROUND}, {name}
    while near:
        heavy = {b: described.values.get(f"{b}.mass", 0.0) for b in near - {name}}
        best = max(heavy, key=heavy.__getitem__, default="")
        if best and heavy[best] > 0:
            return SMALL * heavy[best], f", {SMALL:g} of {best}'s mass"
        near = set().union(*(own for own in pairs if own & near)) - reached
        reached |= near
    return SMALL, ""


def small_mass(tree: LinkTree, *between: str) -> MassOf:
    """Return the mass of a link that is no body of the mechanism, between two that are."""
    links = [tree.links[name] for name in between if name in tree.links] or [*tree.links.values()]
    mass = max(own.mass.mass * (1.0 if own.assumed else SMALL) for own in links)
    return MassOf(mass, np.zeros(3), mass * (SPREAD * tree.size) ** 2 * np.eye(3))


def _motions(
    tree: LinkTree,
    described: Described,
    frames: Mapping[str, BodyFrame],
    joint: Joint,
    frame: BodyFrame,
) -> tuple[ElementaryMotion, ...]:
    """Return the freedoms of a joint from its first to its second body, in a frame."""
    first, second = frames[joint.first_body], frames[joint.second_body]
    at = frame.R.T @ (second.world(described.local(joint.second)) - frame.origin)
    axis = frame.R.T @ first.R @ described.axis(joint) if joint.kind != "spherical" else Z
    spin = axis if tree.motion.mechanism.dimension == 3 else Z
    if joint.ball or joint.kind == "spherical":
        return (ElementaryMotion("ball", Z, at, f"{joint.name}.ball", 0.0),)

    def one(kind: str, direction: Any, word: str) -> ElementaryMotion:
        value = float(np.ravel(reported(tree.motion, "joints", joint.name, word, tree.row))[0])
        if not math.isfinite(value):
            raise UnavailableError(
                f"the {word} of the joint is not known", where=f"joints.{joint.name}"
            )
        return ElementaryMotion(kind, direction, at, f"{joint.name}.{word}", value)

    if joint.crossed if isinstance(joint, SpatialJoint) else False:
        other = frame.R.T @ second.R @ described.direction(joint, "axis2")
        return (one("hinge", axis, "angle"), one("hinge", other, "angle2"))
    if isinstance(joint, SpatialJoint) and joint.kind == "planar":
        x = frame.R.T @ first.R @ described.zero(joint)
        y = np.cross(axis, x)
        return (one("slide", x, "x"), one("slide", y, "y"), one("hinge", axis, "angle"))
    found = []
    if joint.slides:
        found.append(one("slide", axis, "slide"))
    if joint.turns:
        found.append(one("hinge", spin, "angle"))
    return tuple(found)


def _loop(
    tree: LinkTree, described: Described, frames: Mapping[str, BodyFrame], joint: Joint
) -> LoopJoint:
    places = []
    for reference in (joint.first, joint.second):
        body, point = reference.split(".")
        local = described.local(reference)
        places.append(local if body == GROUND else tree.links[body].points[point])
    second = frames[joint.second_body]
    frame = BodyFrame(second.world(described.local(joint.second)), second.R)
    length = described.values.get(f"{joint.name}.length", 0.0) if joint.bar else 0.0
    motions = () if joint.bar else _motions(tree, described, frames, joint, frame)
    ends = joint.first_body, joint.second_body
    first, other = places
    return LoopJoint(joint.name, joint.kind, *ends, first, other, motions, length)
