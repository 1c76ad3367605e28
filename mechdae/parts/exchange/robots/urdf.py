"""URDF: the tree of links, and beside it a JSON file with its loops and mimic polynomials.

Values of joints are mechdae's coordinates. URDF has no loops: those joints are in the second
file, and for each joint of the tree a polynomial of the driver whose error is proved.
"""

from __future__ import annotations

import json
import math

import numpy as np

from mechdae import __version__
from mechdae.describe import GROUND
from mechdae.errors import InputError, UnavailableError
from mechdae.parts.exchange.robots.actuators import Actuator, actuators
from mechdae.parts.exchange.robots.link_frames import BodyFrame, MassOf, turned
from mechdae.parts.exchange.robots.link_tree import LinkTree, driven_joint, link_tree, small_mass
from mechdae.parts.exchange.robots.mimic import Mimics, NotProved, mimics
from mechdae.parts.exchange.robots.single_freedoms import ChainJoint, chain
from mechdae.parts.exchange.robots.tree_parts import ElementaryMotion, LoopJoint
from mechdae.parts.exchange.robots.xml_text import Element, document, number, put, remark
from mechdae.tasks import ExportedMotion
from mechdae.types import Floats, Json, Matrix

TOLERANCE = 1e-6
SIDECAR = ".loops.json"
PROOF = (
    "proved for every driver value of the range, not at samples: the unknowns lie within a radius "
    "of a polynomial over each proved step (Newton-Kantorovich), the difference from the fit is "
    "bounded by its largest Bernstein coefficient; 1e-13 of the sizes is added for rounding"
)


def urdf(motion: ExportedMotion, tolerance: float = TOLERANCE) -> dict[str, str]:
    """Return the files of a motion's mechanism by their endings: URDF and its loops."""
    if not 0 < tolerance < math.inf:
        raise InputError(f"a number above 0 is needed, not {tolerance:g}", where="tolerance")
    tree = link_tree(motion)
    for edge in tree.edges.values():
        kinds = {motion.kind for motion in edge.motions}
        if edge.kind == "free" or kinds & {"ball", "free"}:
            what = "a ball joint" if kinds & {"ball"} else "a body that only bars hold"
            raise UnavailableError(
                f"URDF has no joint for {what} in the tree of links",
                where=f"joints.{edge.joint}" if kinds & {"ball"} else f"bodies.{edge.child}",
                hint="export --format mjcf or sdf",
            )
    found: Mimics | None = None
    reason = ""
    try:
        names = [motion.coordinate for motion in tree.motions()]
        found = mimics(motion, names, tolerance, tree.size)
    except NotProved as error:
        reason = str(error)
    except InputError as error:
        reason = error.what
    robot = _Robot(tree, found, tolerance)
    return {"": robot.text(), SIDECAR: _sidecar(tree, found, reason, tolerance, robot)}


class _Robot:
    def __init__(self, tree: LinkTree, found: Mimics | None, tolerance: float) -> None:
        self.tree, self.motion, self.found = tree, tree.motion, found
        self.tolerance = tolerance
        self.root = Element("robot", name=self.motion.problem.name)
        self.names: dict[str, str] = {}
        driver = next(iter(self.motion.result.drivers), "")
        lead = driven_joint(self.motion, driver) if driver else ""
        words = [m.coordinate for m in tree.motions() if m.coordinate.split(".")[0] == lead]
        self.lead = self._lead(words)

    def _lead(self, words: list[str]) -> str:
        """Return the coordinate that is the driver's but for a constant, "" without one."""
        for word in words:
            line = self.found.lines[word] if self.found else None
            if line is not None and self._is_exact(word) and abs(self._slope(word)) > 0.5:
                return word
        return ""

    def _is_exact(self, word: str) -> bool:
        assert self.found is not None
        size = self.tree.size if word.endswith(".slide") else 1.0
        return self.found.lines[word].error <= self.tolerance * size

    def _slope(self, word: str) -> float:
        assert self.found is not None
        return (
            float(self.found.lines[word].coefficients[1]) * 2 / (self.found.high - self.found.low)
        )

    def text(self) -> str:
        tree = self.tree
        remark(self.root, tree.title)
        remark(self.root, "SI units; values of joints are mechdae's coordinates, second body less "
               "first; loops and polynomials are in the JSON file beside this one")  # fmt: skip
        for text in tree.remarks():
            remark(self.root, text)
        remark(self.root, "effort and velocity are no limits of the mechanism: URDF wants them")
        if tree.left_out:
            remark(self.root, f"not in this file: {', '.join(tree.left_out)}")
        put(self.root, "link", name=GROUND)
        for link in tree.links.values():
            element = self._link(link.name, link.mass)
            self._drawn(element, list(link.points.values()))
        for edge in tree.edges.values():
            above = tree.frame(edge.parent)
            for joint in chain(tree, edge):
                if joint.small:
                    self._link(joint.child, small_mass(tree, edge.parent, edge.child))
                self._joint(joint, above)
                above = joint.frame
        self._drive(actuators(tree)[0])
        if left := tree.limits_left_out():
            remark(self.root, f"not in this file: {', '.join(left)}: loops hold none")
        return document(self.root)

    def _drive(self, found: list[Actuator]) -> None:
        """Put what controllers of ROS command: the drivers, with their ranges and first values."""
        if not found:
            return
        block = put(self.root, "ros2_control", name="drivers", type="system")
        put(put(block, "hardware"), "plugin", "gz_ros2_control/GazeboSimSystem")
        for one in found:
            joint = put(block, "joint", name=self.names[one.coordinate])
            command = put(joint, "command_interface", name="position")
            put(command, "param", number(one.low), name="min")
            put(command, "param", number(one.high), name="max")
            state = put(joint, "state_interface", name="position")
            put(state, "param", number(one.start), name="initial_value")

    def _link(self, name: str, mass: MassOf) -> Element:
        element = put(self.root, "link", name=name)
        inertial = put(element, "inertial")
        put(inertial, "origin", xyz=mass.center)
        put(inertial, "mass", value=mass.mass)
        put(inertial, "inertia", "", **mass.moments())
        return element

    def _drawn(self, link: Element, places: list[Floats]) -> None:
        for _, one, other in self.tree.rods(places):
            way = other - one
            length = float(np.linalg.norm(way))
            visual = put(link, "visual")
            across = float(np.hypot(way[0], way[1]))
            turn = [0.0, math.atan2(across, way[2]), math.atan2(way[1], way[0])]
            put(visual, "origin", xyz=(one + other) / 2, rpy=turn)
            shape = put(visual, "geometry")
            put(shape, "cylinder", radius=self.tree.rod, length=length)

    def _joint(self, joint: ChainJoint, above: BodyFrame) -> None:
        """Put a joint; its origin is where the child is at value zero."""
        motion = joint.motion
        kind = "fixed"
        if motion is not None:
            self.names[motion.coordinate] = joint.name
            turning = "revolute" if self.tree.limits(motion) else "continuous"
            kind = "prismatic" if motion.kind == "slide" else turning
        entry = put(self.root, "joint", name=joint.name, type=kind)
        R, shift = joint.frame.R, np.zeros(3)
        if motion is not None and motion.kind == "slide":
            shift = -R @ (joint.axis * motion.start)
        elif motion is not None:
            R = R @ turned(joint.axis, -motion.start)
        seen = BodyFrame(joint.frame.origin + shift, R).seen_from(above)
        put(entry, "origin", xyz=seen.origin, rpy=_roll_pitch_yaw(seen.R))
        put(entry, "parent", link=joint.parent)
        put(entry, "child", link=joint.child)
        if motion is None:
            return
        put(entry, "axis", xyz=joint.axis)
        if kind != "continuous":
            low, high = self.tree.limits(motion) or self._reach(motion)
            put(entry, "limit", lower=low, upper=high, effort=1000, velocity=1000)
        else:
            put(entry, "limit", effort=1000, velocity=1000)
        self._mimic(entry, motion)

    def _reach(self, motion: ElementaryMotion) -> tuple[float, float]:
        """Return values of a slide along the task, and a little more."""
        joint, _, word = motion.coordinate.partition(".")
        values = np.asarray(self.motion.result.joints[joint][word], float)[self.motion.rows]
        more = 0.05 * (float(np.ptp(values)) or self.tree.size)
        return float(values.min()) - more, float(values.max()) + more

    def _mimic(self, entry: Element, motion: ElementaryMotion) -> None:
        """Put a mimic element where a straight line is within the tolerance."""
        if self.found is None or not self.lead or motion.coordinate == self.lead:
            return
        if not self._is_exact(motion.coordinate):
            return
        slope = self._slope(motion.coordinate) / self._slope(self.lead)
        mine, its = self.found.lines[motion.coordinate], self.found.lines[self.lead]
        offset = float(mine.coefficients[0] - slope * its.coefficients[0])
        remark(entry, f"within {number(mine.error + abs(slope) * its.error)}, proved")
        lead = self.names.get(self.lead, self.lead.split(".")[0])
        put(entry, "mimic", joint=lead, multiplier=slope, offset=offset)


def _roll_pitch_yaw(R: Matrix) -> list[float]:
    """Return the angles about fixed x, y, z, in this order, of a matrix (3, 3)."""
    pitch = math.atan2(-R[2, 0], math.hypot(R[0, 0], R[1, 0]))
    if abs(R[2, 0]) > 1 - 1e-14:
        return [0.0, pitch, math.atan2(-R[0, 1], R[1, 1])]
    return [math.atan2(R[2, 1], R[2, 2]), pitch, math.atan2(R[1, 0], R[0, 0])]


def _sidecar(
    tree: LinkTree, found: Mimics | None, reason: str, tolerance: float, robot: _Robot
) -> str:
    """Return the second file: loops, wheels, polynomials."""
    motion = tree.motion
    data: Json = {
        "mechdae": __version__,
        "problem": motion.problem.name,
        "task": motion.task,
        "units": "m, rad, kg",
        "coordinates": {word: {"joint": name} for word, name in robot.names.items()},
        "loops": [_loop(tree, loop) for loop in tree.loops],
        "couplings": [
            {
                "joint": coupling.joint,
                "factors": dict(coupling.factors),
                "constant": coupling.constant,
            }
            for coupling in tree.couplings
        ],
        "driver": {
            "coordinate": next(iter(motion.result.drivers), None),
            "joint": robot.names.get(robot.lead),
        },
        "mimic": _polynomials(found, tolerance, tree.size) if found else None,
    }
    if found is None:
        data["why_no_mimic"] = reason
    return json.dumps(data, indent=1, ensure_ascii=False) + "\n"


def _polynomials(found: Mimics, tolerance: float, size: float) -> Json:
    joints = {
        word: {
            "coefficients": fit.coefficients.tolist(),
            "error": fit.error,
            "within_tolerance": fit.error <= tolerance * (size if word.endswith(".slide") else 1.0),
            "unit": "m" if word.endswith(".slide") else "rad",
        }
        for word, fit in found.polynomials.items()
    }
    return {
        "range": [found.low, found.high],
        "basis": "q = sum c_k T_k(x), x = (2 s - low - high) / (high - low), s the driver's value",
        "tolerance": tolerance,
        "error": PROOF,
        "joints": joints,
    }


def _loop(tree: LinkTree, loop: LoopJoint) -> Json:
    """Return a joint that closes a loop: places and axes in the frames of both links."""
    first, second = tree.frame(loop.first), tree.frame(loop.second)
    turn = first.R.T @ second.R
    axes = [
        {
            "kind": motion.kind,
            "coordinate": motion.coordinate,
            "axis_second": motion.axis.tolist(),
            "axis_first": (turn @ motion.axis).tolist(),
        }
        for motion in loop.motions
        if motion.kind != "ball"
    ]
    return {
        "joint": loop.joint,
        "kind": loop.kind,
        "first": {"link": loop.first, "xyz": loop.first_place.tolist()},
        "second": {"link": loop.second, "xyz": loop.second_place.tolist()},
        **({"length": loop.length} if loop.length else {"freedoms": axes}),
    }
