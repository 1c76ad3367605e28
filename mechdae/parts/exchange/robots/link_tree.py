"""A mechanism as a tree of links with loops to be closed, as simulators of robots want it.

Of each loop one joint is left out of the tree: those of one freedom are kept first. The links'
frames have the directions of the bodies' own frames and their origins at the joint to the parent.
Coordinates of the tree's joints are those of mechdae: second body less first body.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from mechdae import __version__
from mechdae.describe import GROUND, Joint, coordinate
from mechdae.describe.joints.joint import GAPS, LIMITS, TURN
from mechdae.describe.joints.limits import limited
from mechdae.describe.joints.spatial import SpatialJoint
from mechdae.errors import MechdaeError, UnavailableError
from mechdae.parts.exchange.robots.couplings import couplings_of
from mechdae.parts.exchange.robots.link_frames import (
    HOME,
    BodyFrame,
    Described,
    MassOf,
    Z,
    frames_of,
    placed,
)
from mechdae.parts.exchange.robots.tree_parts import (
    Coupling,
    ElementaryMotion,
    LoopJoint,
    TreeEdge,
    TreeLink,
)
from mechdae.tasks import ExportedMotion, reported
from mechdae.types import Floats

SMALL = 2e-3
"""Share of its heaviest neighbour's mass that a massless body gets where simulators need one,"""
SPREAD = 0.1
"""and the radius of gyration that it gets, as a share of the mechanism's size."""
ROD = 0.012
"""Radius of the rods that are drawn, as a share of the mechanism's size."""
RANKS = {"revolute": 1, "prismatic": 1, "weld": 0, "cylindrical": 2, "screw": 2, "universal": 2,
         "pin-in-slot": 3, "planar": 3, "spherical": 4}  # fmt: skip
"""Which joints are kept in the tree first."""


@dataclass
class LinkTree:
    """Links, joints of the tree from the ground outwards, joints that close loops, wheels."""

    motion: ExportedMotion
    links: dict[str, TreeLink] = field(default_factory=dict)
    edges: dict[str, TreeEdge] = field(default_factory=dict)
    loops: list[LoopJoint] = field(default_factory=list)
    couplings: list[Coupling] = field(default_factory=list)
    limited: set[str] = field(default_factory=set)
    """Joints whose limits were asked for."""

    def children(self, parent: str) -> list[TreeEdge]:
        """Return the joints that hang on a link."""
        return [edge for edge in self.edges.values() if edge.parent == parent]

    def motions(self) -> Iterator[ElementaryMotion]:
        for edge in self.edges.values():
            yield from edge.motions

    @property
    def size(self) -> float:
        """A length of the mechanism [m]."""
        return self.motion.mechanism.scale

    def frame(self, link: str) -> BodyFrame:
        """Return the frame of a link, the world's of the ground."""
        return HOME if link == GROUND else self.links[link].frame

    def gravity(self) -> Floats:
        """Return the acceleration of gravity (3,), zeros without one."""
        mechanism = self.motion.mechanism
        values = mechanism.values()
        return placed([values[f"gravity.{a}"] for a in mechanism.axes] if mechanism.gravity else [])

    def rods(self, places: Iterable[Floats]) -> Iterator[tuple[int, Floats, Floats]]:
        """Yield number and ends of rods that are drawn: between places apart."""
        for k, (start, end) in enumerate(itertools.pairwise(places)):
            if float(np.linalg.norm(end - start)) > self.rod:
                yield k, start, end

    def limits(self, motion: ElementaryMotion) -> tuple[float, float] | None:
        """Return the limits of a motion, an angle's on the turn of its value; None without."""
        joint = self.motion.mechanism.joints.get(motion.coordinate.partition(".")[0])
        if joint is None or motion.coordinate != f"{joint.name}.{joint.ranged}":
            return None
        values = self.motion.mechanism.values()
        found = [values[f"{joint.name}.{end}"] for end in LIMITS if f"{joint.name}.{end}" in values]
        if not found:
            return None
        self.limited.add(joint.name)
        low, high = found
        near = round((motion.start - (low + high) / 2) / TURN)
        turns = TURN * near if motion.kind == "hinge" and high - low < TURN else 0.0
        return low + turns, high + turns

    def limits_left_out(self) -> list[str]:
        """Return the joints whose limits were not asked for: they close loops."""
        joints = limited(self.motion.mechanism.joints)
        return [f"limits of {joint.name}" for joint in joints if joint.name not in self.limited]

    @property
    def rod(self) -> float:
        """Radius of the rods that are drawn [m]."""
        return ROD * self.size

    @property
    def title(self) -> str:
        return f"mechdae {__version__}: {self.motion.problem.name}, task {self.motion.task}"

    def remarks(self, needed: str = "") -> Iterator[str]:
        """Yield what is assumed of masses."""
        for link in self.links.values():
            if link.assumed:
                yield f"assumed for {link.name}{needed}: {link.assumed}"

    @property
    def left_out(self) -> list[str]:
        """What the problem has and no format of robots holds."""
        mechanism = self.motion.mechanism
        found = [f"load {name}" for name in mechanism.loads]
        keys = {"friction": "friction in {0}", "mesh_loss": "losses in {0}",
                "one_sided": "{0} holds in one sense only",
                "restitution": "restitution of {0}"}  # fmt: skip
        keys |= dict.fromkeys(GAPS, "gap of {0}")
        joints = mechanism.joints.items()
        return found + [
            text.format(name)
            for key, text in keys.items()
            for name, joint in joints
            if getattr(joint, key, None)
        ]


def link_tree(motion: ExportedMotion) -> LinkTree:
    """Return the tree of a motion's mechanism in its first assembled pose."""
    builder = _Builder(motion)
    for name, joint in motion.mechanism.joints.items():
        if joint.on_curve or joint.pointer:
            raise UnavailableError(
                f"a {joint.kind} joint is no joint between links that simulators of robots know",
                where=f"joints.{name}",
                hint="export --format dxf draws it",
            )
    return builder.built()


def _chosen(motion: ExportedMotion) -> list[tuple[Joint, bool]]:
    """Return the joints of the tree, each with whether its first body is the parent."""
    mechanism = motion.mechanism
    driven = {driven_joint(motion, name) for name in motion.result.drivers}
    racks = any(joint.wheels == 1 for joint in mechanism.joints.values())
    places = {name: k for k, name in enumerate(mechanism.joints)}

    def rank(joint: Joint) -> tuple[int, int]:
        known = RANKS.get(joint.kind, 9)
        # what racks run along are slides, and loops keep no limits
        if joint.name in driven or (racks and joint.guide) or getattr(joint, "limits", None):
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


def small_mass(tree: LinkTree, *between: str) -> MassOf:
    """Return the mass of a link that is no body of the mechanism, between two that are."""
    links = [tree.links[name] for name in between if name in tree.links] or [*tree.links.values()]
    mass = max(link.mass.mass * (1.0 if link.assumed else SMALL) for link in links)
    return MassOf(mass, np.zeros(3), mass * (SPREAD * tree.size) ** 2 * np.eye(3))


class _Builder:
    """A tree in the making, with the frames of its bodies."""

    def __init__(self, motion: ExportedMotion) -> None:
        self.tree, self.motion, self.mechanism = LinkTree(motion), motion, motion.mechanism
        self.described = Described(motion.mechanism)
        self.frames = frames_of(motion, self.described, motion.first)

    def built(self) -> LinkTree:
        tree = self.tree
        for joint, forward in _chosen(self.motion):
            self._grow(joint, forward)
        for name in self.mechanism.bodies:
            if name not in tree.links:
                self._float(name)
        for name, joint in self.mechanism.joints.items():
            if name not in tree.edges and not joint.meshes:
                tree.loops.append(self._loop(joint))
        tree.couplings = couplings_of(self.motion, self.described, self.frames, tree.edges)
        return tree

    def _reported(self, part: str, name: str, word: str) -> float:
        return float(np.ravel(reported(self.motion, part, name, word, self.motion.first))[0])

    def _link(self, child: str, point: str) -> BodyFrame:
        """Put a body as a link whose frame is at one of its points."""
        local, body = self.described.local, self.frames[child]
        shift = local(f"{child}.{point}")
        points = {p: local(f"{child}.{p}") - shift for p in self.mechanism.bodies[child].points}
        mass, assumed = self._mass(child)
        mass = MassOf(mass.mass, mass.center - shift, mass.inertia)
        frame = BodyFrame(body.world(shift), body.R)
        self.tree.links[child] = TreeLink(child, frame, mass, points, assumed)
        return frame

    def _grow(self, joint: Joint, forward: bool) -> None:
        """Put a joint and its link into the tree."""
        parent, child = joint.first_body, joint.second_body
        here = joint.second
        if not forward:
            parent, child, here = child, parent, joint.first
        motions = self._motions(joint, self._link(child, here.split(".")[1]))
        if not forward:
            motions = tuple(replace(motion, axis=-motion.axis) for motion in reversed(motions))
        edge = TreeEdge(joint.name, joint.kind, parent, child, forward, motions)
        self.tree.edges[joint.name] = edge

    def _float(self, name: str) -> None:
        """Put a body that hangs on bars only: it moves freely, its coordinates are its place."""
        point = next(iter(self.mechanism.bodies[name].points))
        frame, here = self._link(name, point), np.zeros(3)
        motions: tuple[ElementaryMotion, ...]
        motions = (ElementaryMotion("free", Z, here, f"{name}.free", 0.0),)
        if self.mechanism.dimension == 2:
            angle = self._reported("bodies", name, "angle")
            (x, y), place = frame.R[:2], frame.origin
            motions = (
                ElementaryMotion("slide", x, here, f"{name}.{point}.x", place[0]),
                ElementaryMotion("slide", y, here, f"{name}.{point}.y", place[1]),
                ElementaryMotion("hinge", Z, here, f"{name}.angle", angle),
            )
        self.tree.edges[f"{name}.free"] = TreeEdge(
            f"{name}.free", "free", GROUND, name, True, motions
        )

    def _mass(self, name: str) -> tuple[MassOf, str]:
        """Return a link's mass, and what of it is assumed: simulators take no massless ones."""
        small, heavy = self._small(name)
        least = small * (SPREAD * self.tree.size) ** 2 * np.eye(3)
        found = self.described.mass(name)
        if found is None:
            points = self.mechanism.bodies[name].points
            places = [self.described.local(f"{name}.{p}") for p in points]
            assumption = f"mass {small:g} kg and inertia {least[0, 0]:g} kg m2{heavy}"
            return MassOf(small, np.mean(places, axis=0), least), assumption
        assumed = []
        mass, inertia = found.mass, found.inertia
        if not mass > 0:
            mass, assumed = small, [f"mass {small:g} kg{heavy}"]
        if not np.linalg.eigvalsh(inertia).min() > 0:
            inertia = inertia + least
            assumed.append(f"inertia {least[0, 0]:g} kg m2")
        return MassOf(mass, found.center, inertia), " and ".join(assumed)

    def _small(self, name: str) -> tuple[float, str]:
        """Return the mass that is assumed for a body, and by which neighbour.

        Loops hold as well as masses on both of their sides are alike: it is a share of the heaviest
        body beside it, or beside the massless ones that it hangs on.
        """
        pairs = [set(joint.bodies) for joint in self.mechanism.joints.values()]
        reached, near = {name, GROUND}, {name}
        while near:
            heavy = {b: self.described.values.get(f"{b}.mass", 0.0) for b in near - {name}}
            best = max(heavy, key=heavy.__getitem__, default="")
            if best and heavy[best] > 0:
                return SMALL * heavy[best], f", {SMALL:g} of {best}'s mass"
            near = set().union(*(pair for pair in pairs if pair & near)) - reached
            reached |= near
        return SMALL, ""

    def _motions(self, joint: Joint, frame: BodyFrame) -> tuple[ElementaryMotion, ...]:
        """Return the freedoms of a joint from its first to its second body, in a frame."""
        described = self.described
        first, second = self.frames[joint.first_body], self.frames[joint.second_body]
        at = frame.R.T @ (second.world(described.local(joint.second)) - frame.origin)
        axis = frame.R.T @ first.R @ described.axis(joint) if joint.kind != "spherical" else Z
        spin = axis if self.mechanism.dimension == 3 else Z
        if joint.ball or joint.kind == "spherical":
            return (ElementaryMotion("ball", Z, at, f"{joint.name}.ball", 0.0),)

        def one(kind: str, direction: Floats, word: str) -> ElementaryMotion:
            value = self._reported("joints", joint.name, word)
            if not math.isfinite(value):
                raise UnavailableError(
                    f"the {word} of the joint is not known", where=f"joints.{joint.name}"
                )
            return ElementaryMotion(kind, direction, at, f"{joint.name}.{word}", value)

        if isinstance(joint, SpatialJoint) and joint.crossed:
            other = frame.R.T @ second.R @ described.direction(joint, "axis2")
            return (one("hinge", axis, "angle"), one("hinge", other, "angle2"))
        if isinstance(joint, SpatialJoint) and joint.kind == "planar":
            x = frame.R.T @ first.R @ described.zero(joint)
            y = np.cross(axis, x)
            return (one("slide", x, "x"), one("slide", y, "y"), one("hinge", axis, "angle"))
        slides = (one("slide", axis, "slide"),) if joint.slides else ()
        return (*slides, one("hinge", spin, "angle")) if joint.turns else slides

    def _loop(self, joint: Joint) -> LoopJoint:
        places = []
        for reference in (joint.first, joint.second):
            body, point = reference.split(".")
            local = self.described.local(reference)
            places.append(local if body == GROUND else self.tree.links[body].points[point])
        second = self.frames[joint.second_body]
        frame = BodyFrame(second.world(self.described.local(joint.second)), second.R)
        length = self.described.values.get(f"{joint.name}.length", 0.0) if joint.bar else 0.0
        motions = () if joint.bar else self._motions(joint, frame)
        ends = joint.first_body, joint.second_body
        first, other = places
        return LoopJoint(joint.name, joint.kind, *ends, first, other, motions, length)
