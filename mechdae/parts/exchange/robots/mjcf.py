"""MuJoCo's format: a tree of hinges and slides with equalities that close the loops.

The model stands in the first assembled pose of the task, ``ref`` makes the joints' coordinates
those of mechdae. Loops are closed between sites, so that their places do not depend on a pose.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.describe import GROUND
from mechdae.parts.exchange.robots.actuators import actuators
from mechdae.parts.exchange.robots.link_frames import BodyFrame, placed, quaternion
from mechdae.parts.exchange.robots.link_tree import LinkTree, link_tree, small_mass
from mechdae.parts.exchange.robots.tree_parts import ElementaryMotion, LoopJoint, TreeLink
from mechdae.parts.exchange.robots.xml_text import Element, document, numbers, put, remark
from mechdae.tasks import ExportedMotion
from mechdae.types import Floats

STEP = 0.0005
"""Time step [s]."""


def mjcf(motion: ExportedMotion) -> dict[str, str]:
    """Return the files of a motion's mechanism by their endings."""
    return {"": _Model(link_tree(motion)).text()}


class _Model:
    def __init__(self, tree: LinkTree) -> None:
        self.tree, self.motion = tree, tree.motion
        self.actuators, self.others = actuators(tree)
        self.root = Element("mujoco", model=self.motion.problem.name)
        self.elements: dict[str, Element] = {}
        self.equalities: list[tuple[str, dict[str, Any]]] = []
        self.tendons: list[tuple[str, str, list[tuple[str, dict[str, Any]]]]] = []

    def text(self) -> str:
        root, tree = self.root, self.tree
        self._head()
        put(root, "compiler", angle="radian", autolimits="true")
        settings: dict[str, Any] = {"timestep": STEP, "iterations": 200, "tolerance": 1e-12}
        put(root, "option", integrator="implicitfast", gravity=tree.gravity(), **settings)
        default = put(root, "default")
        put(default, "geom", contype="0", conaffinity="0", rgba="0.35 0.45 0.6 1")
        remark(default, "loops are closed again within 1 ms (2 steps), to 1e-4 of a force")
        put(default, "equality", solref=[2 * STEP, 1], solimp="0.999 0.9999 0.0001")
        world = put(root, "worldbody")
        self.elements[GROUND] = world
        for point in self.motion.mechanism.ground.points:
            put(world, "site", name=f"{GROUND}.{point}", pos=self._ground(point))
        self._grow(GROUND)
        for loop in tree.loops:
            self._close(loop)
        for coupling in tree.couplings:
            self._couple(coupling.joint, dict(coupling.factors))
        self._equations()
        self._drive()
        if left := tree.limits_left_out():
            remark(root, f"not in this file: {', '.join(left)}: loops hold none")
        return document(root)

    def _head(self) -> None:
        tree, motion = self.tree, self.motion
        remark(self.root, tree.title)
        remark(self.root, "SI units; joints are named and counted as in mechdae, second body less "
               "first; qpos0 is the first assembled pose of the task")  # fmt: skip
        for text in tree.remarks(", which MuJoCo needs"):
            remark(self.root, text)
        if motion.mechanism.dimension == 2:
            remark(self.root, "a mechanism of the plane x, y: Ixx = Iyy = Izz / 2 have no part")
        if tree.left_out:
            remark(self.root, f"not in this file: {', '.join(tree.left_out)}")

    def _ground(self, point: str) -> Floats:
        values, axes = self.motion.mechanism.values(), self.motion.mechanism.axes
        return placed([values[f"{GROUND}.{point}.{axis}"] for axis in axes])

    def _drive(self) -> None:
        """Put actuators that hold the drivers, and the pose in which the model stands, as a key."""
        found = self.actuators
        for name in self.others:
            remark(self.root, f"no actuator for the driver {name}, which is no joint of the tree")
        if not found:
            return
        block = put(self.root, "actuator")
        for one in found:
            given: dict[str, Any] = {
                "kp": one.stiffness,
                "kv": one.damping,
                "ctrlrange": [one.low, one.high],
            }
            put(block, "position", name=one.driver, joint=one.coordinate, **given)
        remark(self.root, "the key holds this pose: mj_resetDataKeyframe(model, data, 0)")
        key = put(put(self.root, "keyframe"), "key", name="assembled")
        key.set("ctrl", numbers(one.start for one in found))

    # -- bodies ----------------------------------------------------------------------------

    def _grow(self, parent: str) -> None:
        """Put what hangs on a link, and what hangs on that."""
        for edge in self.tree.children(parent):
            link = self.tree.links[edge.child]
            body = self._body(parent, link.name, link.frame)
            self._joints(body, edge.motions)
            mass = link.mass
            xx, xy, xz, yy, yz, zz = mass.moments().values()
            full = [xx, yy, zz, xy, xz, yz]
            put(body, "inertial", pos=mass.center, mass=mass.mass, fullinertia=full)
            self._drawn(body, link)
            for point, place in link.points.items():
                put(body, "site", name=f"{link.name}.{point}", pos=place)
            self.elements[link.name] = body
            self._grow(link.name)

    def _body(self, parent: str, name: str, frame: BodyFrame) -> Element:
        seen = frame.seen_from(self.tree.frame(parent))
        quat = quaternion(seen.R)
        return put(self.elements[parent], "body", name=name, pos=seen.origin, quat=quat)

    def _joints(self, body: Element, motions: tuple[ElementaryMotion, ...]) -> None:
        driven = {one.coordinate: one for one in self.actuators}
        for motion in motions:
            if motion.kind == "free":
                put(body, "freejoint", name=motion.coordinate)
                continue
            given: dict[str, Any] = {"name": motion.coordinate, "type": motion.kind}
            given["pos"] = motion.anchor
            if motion.kind != "ball":
                given |= {"axis": motion.axis, "ref": motion.start}
            if limits := self.tree.limits(motion):
                given["range"] = limits
            if motion.coordinate in driven:
                given["armature"] = driven[motion.coordinate].armature(STEP)
            put(body, "joint", **given)

    def _drawn(self, body: Element, link: TreeLink) -> None:
        """Put rods between the points of a link."""
        places = list(link.points.values())
        rods = [*self.tree.rods(places)]
        for _, start, end in rods:
            ends = numbers([*start, *end])
            put(body, "geom", type="capsule", fromto=ends, size=self.tree.rod)
        if not rods:
            put(body, "geom", type="sphere", pos=places[0], size=2 * self.tree.rod)

    def _dummy(self, loop: LoopJoint, motions: tuple[ElementaryMotion, ...]) -> str:
        """Put a small body that moves on the first link as the second body of a joint does."""
        second = self.tree.frame(loop.second)
        frame = BodyFrame(second.world(loop.second_place), second.R)
        name = f"{loop.joint}.block"
        block = self._body(loop.first, name, frame)
        mass = small_mass(self.tree, loop.first, loop.second)
        remark(block, f"carries the loop's joint; its mass of {mass.mass:g} kg is assumed")
        self._joints(block, motions)
        put(block, "inertial", pos=[0, 0, 0], mass=mass.mass, diaginertia=np.diag(mass.inertia))
        put(block, "site", name=name, pos=[0, 0, 0])
        return name

    # -- loops -----------------------------------------------------------------------------

    def _site(self, link: str, place: Floats, loop: LoopJoint, side: str) -> str:
        """Return the name of a site at the second point with the directions of the second body."""
        name = f"{loop.joint}.{side}"
        turn = self.tree.frame(link).R.T @ self.tree.frame(loop.second).R
        put(self.elements[link], "site", name=name, pos=place, quat=quaternion(turn))
        return name

    def _close(self, loop: LoopJoint) -> None:
        """Close a loop by an equality between two sites."""
        planar = self.motion.mechanism.dimension == 2
        second = self._site(loop.second, loop.second_place, loop, "second")
        if loop.length:
            first = self._site(loop.first, loop.first_place, loop, "first")
            ends = [("site", {"site": first}), ("site", {"site": second})]
            self.tendons.append(("spatial", loop.joint, ends))
            self.equalities.append(("tendon", {"name": loop.joint, "tendon1": loop.joint}))
            return
        joint = self.motion.mechanism.joints[loop.joint]
        pinned = joint.ball or (planar and joint.hinge)
        if pinned or joint.rigid:
            first = self._site(loop.first, loop.first_place, loop, "first")
            tag = "connect" if pinned else "weld"
        elif planar and joint.slot:
            first, tag = self._dummy(loop, loop.motions[:1]), "connect"
        else:
            first, tag = self._dummy(loop, loop.motions), "weld"
        self.equalities.append((tag, {"name": loop.joint, "site1": first, "site2": second}))
        values = self.motion.mechanism.values()
        if f"{loop.joint}.pitch" in values:
            pitch = values[f"{loop.joint}.pitch"] / (2 * np.pi)
            factors = {f"{loop.joint}.slide": 1.0, f"{loop.joint}.angle": -pitch}
            self._couple(f"{loop.joint}.pitch", factors)

    def _couple(self, name: str, factors: dict[str, float]) -> None:
        """Hold a sum of coordinates: by the polynomial of one joint, or as a tendon's length."""
        if len(factors) == 2:
            (one, a), (other, b) = factors.items()
            equality = {
                "name": name,
                "joint1": one,
                "joint2": other,
                "polycoef": [0, -b / a, 0, 0, 0],
            }
            self.equalities.append(("joint", equality))
            return
        parts = [("joint", {"joint": word, "coef": factor}) for word, factor in factors.items()]
        self.tendons.append(("fixed", name, parts))
        self.equalities.append(("tendon", {"name": name, "tendon1": name}))

    def _equations(self) -> None:
        if self.tendons:
            tendons = put(self.root, "tendon")
            for tag, name, parts in self.tendons:
                element = put(tendons, tag, name=name)
                for word, given in parts:
                    put(element, word, **given)
        if self.equalities:
            closed = put(self.root, "equality")
            for tag, given in self.equalities:
                put(closed, tag, **given)
