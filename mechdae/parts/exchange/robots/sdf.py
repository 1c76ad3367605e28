"""SDFormat 1.10: links where they are in the first assembled pose, joints of tree and loops alike.

Loops are closed by joints: a link may be the child of several. Positions of joints are counted
from the pose in the file.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.describe import GROUND
from mechdae.errors import UnavailableError
from mechdae.parts.exchange.robots.actuators import actuators
from mechdae.parts.exchange.robots.link_frames import HOME, BodyFrame, MassOf, Z, quaternion
from mechdae.parts.exchange.robots.link_tree import LinkTree, link_tree, small_mass
from mechdae.parts.exchange.robots.single_freedoms import (
    ChainJoint,
    chain,
    loop_chain,
)
from mechdae.parts.exchange.robots.tree_parts import LoopJoint
from mechdae.parts.exchange.robots.xml_text import Element, document, number, numbers, put, remark
from mechdae.tasks import ExportedMotion
from mechdae.types import Floats

VERSION = "1.10"
CONTROLLER = (
    "gz-sim-joint-position-controller-system",
    "gz::sim::systems::JointPositionController",
)
TYPES = {"hinge": "revolute", "slide": "prismatic", "ball": "ball"}


def sdf(motion: ExportedMotion) -> dict[str, str]:
    """Return the files of a motion's mechanism by their endings."""
    return {"": _World(link_tree(motion)).text()}


class _World:
    def __init__(self, tree: LinkTree) -> None:
        self.tree, self.motion = tree, tree.motion
        self.actuators, _ = actuators(tree)
        self.names: dict[str, str] = {}
        self.root = Element("sdf", version=VERSION)
        self.model = put(self.root, "model", name=self.motion.problem.name)

    def text(self) -> str:
        tree = self.tree
        self._head()
        for link in tree.links.values():
            body = self._link(link.name, link.frame, link.mass)
            self._drawn(body, list(link.points.values()))
        for edge in tree.edges.values():
            if edge.kind != "free":
                self._joints(chain(tree, edge))
        for loop in tree.loops:
            if loop.length:
                self._bar(loop)
            else:
                self._joints(loop_chain(tree, loop))
        for coupling in tree.couplings:
            self._gear(coupling.joint)
        self._drive()
        if left := tree.limits_left_out():
            remark(self.model, f"not in this file: {', '.join(left)}: loops hold none")
        return document(self.root)

    def _drive(self) -> None:
        """Put controllers that hold the drivers; positions are counted from this pose."""
        for one in self.actuators:
            plugin = put(self.model, "plugin", filename=CONTROLLER[0], name=CONTROLLER[1])
            put(plugin, "joint_name", self.names[one.coordinate])
            for tag, value in (("p_gain", one.stiffness), ("d_gain", one.damping)):
                put(plugin, tag, number(value))
            put(plugin, "initial_position", "0")

    def _head(self) -> None:
        tree = self.tree
        remark(self.model, tree.title)
        remark(self.model, "SI units; positions of joints are counted from this pose")
        starts = [f"{m.coordinate} = {number(m.start)}" for m in tree.motions() if m.kind != "ball"]
        remark(self.model, f"mechdae's coordinates in this pose: {', '.join(starts)}")
        for text in tree.remarks():
            remark(self.model, text)
        if tree.left_out:
            remark(self.model, f"not in this file: {', '.join(tree.left_out)}")
        remark(self.model, f"gravity is the world's: {numbers(tree.gravity())} m/s2")

    @staticmethod
    def _pose(parent: Element, frame: BodyFrame) -> None:
        w, x, y, z = quaternion(frame.R)
        put(parent, "pose", numbers([*frame.origin, x, y, z, w]), rotation_format="quat_xyzw")

    def _link(self, name: str, frame: BodyFrame, mass: MassOf) -> Element:
        body = put(self.model, "link", name=name)
        self._pose(body, frame)
        inertial = put(body, "inertial")
        put(inertial, "mass", number(mass.mass))
        put(inertial, "pose", numbers([*mass.center, 0, 0, 0]))
        inertia = put(inertial, "inertia")
        for name, moment in mass.moments().items():
            put(inertia, name, number(moment))
        return body

    def _drawn(self, body: Element, places: list[Floats]) -> None:
        """Put rods between the points of a link."""
        for k, one, other in self.tree.rods(places):
            way = other - one
            length = float(np.linalg.norm(way))
            visual = put(body, "visual", name=f"rod{k}")
            across = np.cross(Z, way / length)
            x = across if np.linalg.norm(across) > 1e-9 else np.array([1.0, 0, 0])
            x = x / np.linalg.norm(x)
            R = np.stack([x, np.cross(way / length, x), way / length], axis=1)
            self._pose(visual, BodyFrame((one + other) / 2, R))
            shape = put(put(visual, "geometry"), "cylinder")
            put(shape, "radius", number(self.tree.rod))
            put(shape, "length", number(length))

    def _joints(self, joints: list[ChainJoint]) -> None:
        ends = [joints[0].parent, joints[-1].child] if joints else []
        for single in joints:
            if single.small:
                self._link(single.child, single.frame, small_mass(self.tree, *ends))
            kind = "fixed" if single.motion is None else TYPES[single.motion.kind]
            if single.motion and single.name.endswith("_slide") and self._is_screw(single):
                raise UnavailableError(
                    "screws differ between versions of SDFormat", where=f"joints.{single.name[:-6]}"
                )
            joint = put(self.model, "joint", name=single.name, type=kind)
            self._ends(joint, single.parent, single.child)
            # the joint's frame is given in the child's, which it may leave by an offset
            offset = np.zeros(3)
            if not single.small:
                offset = single.frame.seen_from(self.tree.frame(single.child)).origin
                offset = offset + (single.motion.anchor if single.motion else 0.0)
            self._pose(joint, BodyFrame(offset, HOME.R))
            if single.motion is not None and single.motion.kind != "ball":
                axis = put(joint, "axis")
                put(axis, "xyz", numbers(single.axis))
                self.names[single.motion.coordinate] = single.name
                start = single.motion.start
                driven = {one.coordinate: (one.low, one.high) for one in self.actuators}
                reach = self.tree.limits(single.motion) or driven.get(single.motion.coordinate)
                for tag, value in zip(("lower", "upper"), reach or (), strict=False):
                    limit = axis.find("limit")
                    put(put(axis, "limit") if limit is None else limit, tag, number(value - start))

    def _is_screw(self, single: ChainJoint) -> bool:
        joint = self.motion.mechanism.joints.get(single.name.removesuffix("_slide"))
        return joint is not None and joint.kind == "screw"

    @staticmethod
    def _ends(joint: Element, parent: str, child: str) -> None:
        put(joint, "parent", "world" if parent == GROUND else parent)
        put(joint, "child", "world" if child == GROUND else child)

    def _bar(self, loop: LoopJoint) -> None:
        """Put a bar between two points as a link, pinned at both."""
        tree = self.tree
        first, second = tree.frame(loop.first), tree.frame(loop.second)
        one, other = first.world(loop.first_place), second.world(loop.second_place)
        name = f"{loop.joint}_bar"
        body = self._link(name, BodyFrame(one, HOME.R), small_mass(tree, loop.first, loop.second))
        self._drawn(body, [np.zeros(3), other - one])
        kind = "revolute" if self.motion.mechanism.dimension == 2 else "ball"
        for side, link, place in (("first", loop.first, one), ("second", loop.second, other)):
            joint = put(self.model, "joint", name=f"{loop.joint}_{side}", type=kind)
            self._ends(joint, link, name)
            self._pose(joint, BodyFrame(place - one, HOME.R))
            if kind == "revolute":
                put(put(joint, "axis"), "xyz", numbers(Z))

    def _gear(self, name: str) -> None:
        """Put wheels: theta2 = -ratio theta1, angles of child and parent from the carrier."""
        mechanism = self.motion.mechanism
        mesh = mechanism.joints[name]
        if mesh.wheels != 2:
            raise UnavailableError(
                f"SDFormat has no {mesh.kind} between links",
                where=f"joints.{name}",
                hint="export --format mjcf",
            )
        ratio = mesh.turn_ratio(mechanism.values())
        joint = put(self.model, "joint", name=name, type="gearbox")
        self._ends(joint, mesh.first_body, mesh.second_body)
        put(joint, "gearbox_ratio", number(-1 / ratio))
        carrier = getattr(mesh, "carrier", None) or GROUND
        put(joint, "gearbox_reference_body", "world" if carrier == GROUND else carrier)
        for tag, wheel in (("axis", mesh.first_body), ("axis2", mesh.second_body)):
            put(put(joint, tag), "xyz", numbers(self._wheel_axis(wheel, carrier, mesh.second_body)))

    def _wheel_axis(self, wheel: str, carrier: str, child: str) -> Any:
        if self.motion.mechanism.dimension == 2:
            return Z
        for edge in self.tree.edges.values():
            hinges = [m for m in edge.motions if m.kind == "hinge"]
            if {edge.parent, edge.child} == {wheel, carrier} and len(hinges) == 1:
                world = self.tree.frame(edge.child).R @ hinges[0].axis
                return self.tree.frame(child).R.T @ world * (1.0 if edge.forward else -1.0)
        return Z
