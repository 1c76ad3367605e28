"""Rows of cut ball joints by the joint a body hangs on, and meshes of wheels and racks in space."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from tests.attack.spatial_honesty import Case, case

POSE = md.Driver("J0.angle", at=[0.0])


@pytest.mark.parametrize(("loop", "blocks"), [("RUSR", [1, 1, 1]), ("RRSRR", [2, 1])])
def test_what_a_joint_does_not_move_comes_first(loop: str, blocks: list[int]) -> None:
    found = case(np.random.default_rng(8), loop)
    result = md.solve(found.mechanism, md.Sweep(driver=POSE, derivatives=0))
    assert result.summary["work"]["blocks"] == blocks
    for point, place in found.planted.items():
        own = next(p for p in result.points if p.endswith(f".{point}"))
        assert np.abs(result.points[own].position[0] - place).max() < 1e-12


def test_a_leg_of_driven_length() -> None:
    """A ball on a cross and a driven slide: its distance from the cross is that of the slide."""
    rng = np.random.default_rng(2)
    found = case(rng, "RSPU")
    driver = md.Driver("J2.slide", at=[0.0, 0.05])
    result = md.solve(found.mechanism, md.Sweep(driver=driver, derivatives=0))
    assert list(result.status) == ["ok", "ok"]
    assert result.summary["work"]["blocks"] == [1, 2]
    ball = result.points["b1.P1"].position
    assert np.abs(ball[0] - found.planted["P1"]).max() < 1e-12
    axis = np.array(found.closure.pairs[2].a1, float)
    body = found.mechanism.bodies["b2"].points
    from_ball = np.array(body["P2"], float) - np.array(body["P1"], float)
    leg = found.mechanism.bodies["b3"].points
    rest = np.linalg.norm(np.array(found.planted["P3"]) - found.planted["P1"])
    across = found.planted["P3"] - found.planted["P2"]
    assert np.abs(np.linalg.norm(np.array(leg["P3"]) - leg["P2"]) - np.linalg.norm(across)) < 1e-14
    along = _in_b2(found, across) @ axis + from_ball @ axis
    expected = np.sqrt(rest**2 + 2 * 0.05 * along + 0.05**2)
    assert abs(np.linalg.norm(ball[1] - found.planted["P3"]) - expected) < 1e-12


def _in_b2(found: Case, way: np.ndarray) -> np.ndarray:
    """Return a direction of the planted pose in the frame of body b2, by its slide's two sides."""
    pair = found.closure.pairs[2]
    own = [np.array(v, float) for v in (pair.a1, pair.n1, pair.a2, pair.n2)]
    here = np.stack([own[1], np.cross(own[0], own[1]), own[0]], axis=1)
    there = np.stack([own[3], np.cross(own[2], own[3]), own[2]], axis=1)
    leg = found.mechanism.bodies["b3"].points
    local = np.array(leg["P3"], float) - np.array(leg["P2"], float)
    assert abs(np.linalg.norm(local) - np.linalg.norm(way)) < 1e-14
    return here @ there.T @ local


def wheels(joint: md.SpatialGear | md.SpatialRack, **other: object) -> md.Mechanism:
    """Return a driven wheel on z, a second one or a rack on an arm that turns about x."""
    second = other.get("second") or md.SpatialRevolute("W", "arm.B", "two.B", axis=[0, 1, 2])
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": [0, 0, 0]}),
        bodies=[
            md.Body("arm", {"O": [0, 0, 0], "A": [0, 0, 0.1], "B": [0.3, 0, 0]}),
            md.Body("one", {"A": [0, 0, 0], "T": [0.1, 0, 0]}),
            md.Body("two", {"B": [0, 0, 0], "T": [0, 0.1, 0]}),
        ],
        joints=[
            md.SpatialRevolute("C", "ground.O", "arm.O", axis=[1, 0, 0]),
            md.SpatialRevolute("V", "arm.A", "one.A", axis=[0, 0, 1]),
            second,
            joint,
        ],
    )


def test_a_rack_slides_by_the_radius() -> None:
    slide = md.SpatialPrismatic("W", "arm.B", "two.B", axis=[0, 1, 0])
    rack = md.SpatialRack("m", "one.A", "two.B", radius=0.04, phase=0.1, carrier="arm")
    drivers = [md.Driver("C.angle", at=[0.7], speed=0.0), md.Driver("V.angle", at=[9.0], speed=2.0)]
    result = md.solve(wheels(rack, second=slide), md.Sweep(drivers=drivers))
    assert abs(result.joints["W"].slide[0] - (0.04 * 9 + 0.1)) < 1e-15
    assert abs(result.joints["W"].slide_velocity[0] - 0.08) < 1e-15
    place = [0.3, 0.46 * np.cos(0.7), 0.46 * np.sin(0.7)]
    assert np.abs(result.points["two.B"].position[0] - place).max() < 1e-15


def test_wheels_with_axes_that_cross_count_turns() -> None:
    gear = md.SpatialGear("m", "two.B", "one.A", teeth=[30, 12], mesh="external", carrier="arm")
    drivers = [md.Driver("C.angle", at=[0.0], speed=1.0), md.Driver("V.angle", at=[20.0], speed=5)]
    result = md.solve(wheels(gear), md.Sweep(drivers=drivers))
    assert abs(result.joints["W"].angle[0] + 8.0) < 1e-14
    spin = np.array([1.0, 0, 0]) - 2.0 * np.array([0, 1, 2]) / np.sqrt(5)
    assert np.abs(result.bodies["two"].angular_velocity[0] - spin).max() < 1e-14


def test_a_wheel_needs_a_joint_on_its_carrier() -> None:
    gear = md.SpatialGear("m", "two.B", "one.A", ratio=2.0)
    with pytest.raises(md.MechanismError, match="wheel two needs one joint with an angle") as told:
        md.solve(wheels(gear), md.Sweep(driver=md.Driver("V.angle", at=[0.0])))
    assert told.value.where == "joints.m"
