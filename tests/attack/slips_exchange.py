"""Slips planted in drawings and in trees of links, seen by what comes back and by poses."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

import mechdae as md
from mechdae.parts.exchange.robots.actuators import actuators
from mechdae.parts.exchange.robots.link_frames import of_quaternion, quaternion, turned
from mechdae.parts.exchange.robots.link_tree import link_tree
from mechdae.tasks.motion_of import motion_of
from tests.shared.exports import block, coordinate, in_space, motion
from tests.shared.meshing import faults as faults_of_teeth
from tests.shared.passing_parts import passing
from tests.shared.paths import DATA
from tests.shared.planting import Slip
from tests.shared.round_trips import CLOSE, back, faults

DRAWN, ROBOTS = "exchange/test_drawings.py::", "exchange/test_robots.py::"
BACK = f"{DRAWN}test_a_problem_comes_back_or_what_is_lost_is_said"
WEIGHTS = f"{ROBOTS}test_weights_of_a_file_are_held_by_the_efforts_of_mechdae"
CLOSES = f"{ROBOTS}test_sdf_closes_at_200_poses"
MESH = "exchange/test_teeth.py::test_wheels_mesh_at_the_pose"
EXACT = 1e-12


def drawings() -> float:
    """Two mechanisms are drawn and read: a guide, and links of three pins."""
    worst = 0.0
    with tempfile.TemporaryDirectory() as folder:
        for name in ("slider-crank-offset", "watt-six-bar"):
            found = back(name, Path(folder))
            if faults(found) or "lost" in found:
                return np.inf
            worst = max(worst, found["off"], found["followed"])
    return worst / CLOSE


def circles() -> float:
    """Wheels around pins are no pins, and are said to be lost."""
    with tempfile.TemporaryDirectory() as folder:
        found = back("geared-five-bar-97-13", Path(folder)).get("lost")
    return 0.0 if found == ["2 second circle around a pin"] else np.inf


def links() -> float:
    """Points and centres of links are where the pose has them."""
    whole, worst = motion("balanced-four-bar"), 0.0
    values, row = whole.mechanism.values(), whole.first
    for name, link in link_tree(whole).links.items():
        angle = float(whole.result.bodies[name].angle[row])
        R = turned(np.array([0.0, 0.0, 1.0]), angle)
        for point, local in link.points.items():
            known = in_space(whole.result.points[f"{name}.{point}"].position[row])
            worst = max(worst, float(np.abs(link.frame.world(local) - known).max()))
            arm = [values[f"{name}.center.{a}"] - values[f"{name}.{point}.{a}"] for a in "xy"]
            gap = link.frame.world(link.mass.center) - known - R @ in_space(arm)
            worst = max(worst, float(np.abs(gap).max()))
    return worst / EXACT


def massless() -> float:
    """A rod without mass beside a boom of 1200 kg gets 2/1000 of it."""
    tree = link_tree(motion(str(DATA / "excavator-massless-cylinders.toml"), "forward"))
    return abs(tree.links["rod1"].mass.mass - 2.4) / EXACT


def meshes() -> float:
    """Sums of coordinates that wheels keep are the same in all poses."""
    whole = motion("geared-five-bar")
    try:
        (coupling,) = link_tree(whole).couplings
    except md.MechdaeError:
        return np.inf
    sums = [
        sum(own * coordinate(whole.result, word, row) for word, own in coupling.factors.items())
        for row in whole.rows[::40]
    ]
    return float(np.ptp(sums)) / 1e-9


def turns() -> float:
    """Quaternions are those of the matrices."""
    R = turned(np.array([2.0, -1.0, 2.0]) / 3, 2.0)
    return float(np.abs(of_quaternion(quaternion(R)) - R).max()) / EXACT


def drives() -> float:
    """A block of 3 kg on a guide is held by a spring of 3 w^2, its drive weighs a share of that."""
    (one,), _ = actuators(link_tree(motion_of(block(), None)))
    gains = np.array([one.stiffness, one.damping, one.armature(0.0005), one.low, one.high])
    known = np.array([3 * 200.0**2, 2 * 3 * 200.0, 3 * 0.2**2, 0.19, 0.41])
    return float(np.abs(gains / known - 1).max()) / EXACT


def passes() -> float:
    """Parts that touch between two poses are met, those that pass are not."""
    gaps = [passing(radius) for radius in (0.0149999, 0.01500001)]
    return 0.0 if all(met is (gap < 0) for gap, met in gaps) else np.inf


def teeth() -> float:
    """Wheels mesh at the pose, with half of the backlash on either side."""
    off, gap = faults_of_teeth()
    return max(off / 1e-6, gap / 1e-3)


FROM, TREE = "parts.exchange.drawings.from_drawing", "parts.exchange.robots.link_tree"
SLIPS = [
    Slip(FROM, "self.grounded and not outer", "self.grounded and outer", circles, BACK),
    Slip(FROM, "c * x + s * y, -s * x + c * y", "c * x - s * y, s * x + c * y", drawings, BACK),
    Slip(FROM, "guide[-1][1] - guide[0][1], guide[-1][0] - guide[0][0]",
         "guide[-1][0] - guide[0][0], guide[-1][1] - guide[0][1]", drawings, BACK),
    Slip(FROM, "3 * len(mechanism.bodies) - held", "3 * len(mechanism.bodies) + held", drawings,
         BACK),
    Slip(FROM, "and a not in pins", "", drawings, BACK),
    Slip("parts.exchange.drawings.dxf", "MILLIMETRE * float(v)",
         "1.000001 * MILLIMETRE * float(v)",
         drawings, f"{DRAWN}test_links_and_paths_are_those_of_the_result"),
    Slip(TREE, "mass.center - shift, mass.inertia)",
         "mass.center + shift, mass.inertia)", links, WEIGHTS),
    Slip(TREE, "points = {p: local(f\"{child}.{p}\") - shift",
         "points = {p: local(f\"{child}.{p}\") + shift", links, CLOSES),
    Slip(TREE, "return SMALL * heavy[best]", "return SMALL**2 * heavy[best]", massless,
         f"{ROBOTS}test_a_body_without_mass_gets_a_share_of_its_neighbour"),
    Slip("parts.exchange.robots.couplings", "_plus(first, second, -joint.turn_ratio(",
         "_plus(first, second, joint.turn_ratio(", meshes,
         f"{ROBOTS}test_sdf_gears_have_the_sign_of_the_format"),
    Slip("parts.exchange.robots.actuators", "(step / FOLLOWED) ** 2", "step / FOLLOWED", drives,
         f"{ROBOTS}test_drivers_have_actuators_in_all_formats"),
    Slip("parts.exchange.robots.actuators", "link.mass.mass / len(link.points)",
         "link.mass.mass / 2",
         drives, f"{ROBOTS}test_drivers_have_actuators_in_all_formats"),
    Slip("parts.exchange.robots.link_frames", "R[2, 1] - R[1, 2], R[0, 2] - R[2, 0]",
         "R[1, 2] - R[2, 1], R[0, 2] - R[2, 0]", turns, CLOSES),
    Slip("parts.exchange.workshop.apart", "~(gaps > reach)", "~(gaps > 0)", passes,
         "exchange/test_workshop.py::test_what_passes_between_two_poses_is_met"),
    Slip("parts.exchange.workshop.gearing", "float(sums[0]) - 0.5", "float(sums[0])", teeth, MESH),
    Slip("parts.exchange.workshop.teeth", "- thin / (2 * self.radius)",
         "- thin / (4 * self.radius)", teeth, MESH),
]  # fmt: skip
