"""Mechanisms whose points and directions are places in one pose."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md

HINGED = {
    "dimension": 3,
    "frames": "drawn",
    "ground": md.Ground({"A": [0, 0, 0], "D": [1, 0, 0.2], "E": [0, 0, 2]}),
    "bodies": [
        md.Body("crank", {"A": [0, 0, 0], "B": [0, 0.3, 0]}),
        md.Body("rod", {"B": [0, 0.3, 0], "C": [1, 0.5, 0.4]}),
        md.Body("rocker", {"D": [1, 0, 0.2], "C": [1, 0.5, 0.4]}),
    ],
}
JOINTS = [
    md.SpatialRevolute("A", "ground.A", "crank.A", axis=[0, 0, 1]),
    md.Spherical("B", "crank.B", "rod.B"),
    md.Spherical("C", "rod.C", "rocker.C"),
    md.SpatialRevolute("D", "ground.D", "rocker.D", axis=[1, 0, 0]),
]
HERE = md.Sweep(driver=md.Driver("A.angle", at=[0.0]))


def test_the_drawn_pose_is_where_all_angles_are_zero() -> None:
    mechanism = md.Mechanism(joints=JOINTS, **HINGED)
    result = md.solve(mechanism, HERE)
    length, angle = result.bound.length[0], result.bound.angle[0]
    assert max(length, angle) < 1e-13
    assert abs(result.joints["D"].angle[0]) <= angle
    assert np.abs(result.points["rocker.C"].position[0] - [1, 0.5, 0.4]).max() <= length
    assert np.abs(result.bodies["rocker"].orientation[0] - [1, 0, 0, 0]).max() <= angle


def test_what_is_sketched_comes_before_what_is_drawn() -> None:
    drawn = md.Mechanism(joints=JOINTS, **HINGED)
    other = md.solve(drawn, md.Modes(driver=md.Driver("A.angle", at=[0.0]))).joints["D"].angle
    away = float(other[np.argmax(np.abs(other))])
    assert abs(away) > 0.1
    sketched = md.Mechanism(joints=JOINTS, sketch={"A": 0.0, "D": away}, **HINGED)
    assert abs(md.solve(sketched, HERE).joints["D"].angle[0] - away) < 1e-12


def test_points_that_are_drawn_apart_are_an_error() -> None:
    bodies = [md.Body("crank", {"A": [0, 0, 0.1], "B": [0, 0.3, 0]}), *HINGED["bodies"][1:]]
    with pytest.raises(md.MechanismError, match=r"drawn 0\.1 m apart") as caught:
        md.Mechanism(joints=JOINTS, **{**HINGED, "bodies": bodies})
    assert caught.value.where == "joints.A.between"


def test_frames_are_drawn_in_space_or_not_at_all() -> None:
    with pytest.raises(md.MechanismError, match="'drawn' in space or nothing"):
        md.Mechanism(frames="drawn")
    with pytest.raises(md.MechanismError, match="'drawn' in space or nothing, not 'free'"):
        md.Mechanism(joints=JOINTS, **{**HINGED, "frames": "free"})


def jacked(second_pin):
    """A leg on a hinge and a jack between two crosses, all of it drawn askew."""
    return md.Mechanism(
        dimension=3,
        frames="drawn",
        ground=md.Ground({"A": [0, 0, 0], "J": [0.05, 0.5, 0.25]}),
        bodies=[
            md.Body("leg", {"A": [0, 0, 0], "K": [0.04, 0.12, -0.1], "W": [0, 0.1, -1.2]}),
            md.Body("cylinder", {"J": [0.05, 0.5, 0.25], "E": [0.1, 0.5, 0.25]}),
            md.Body("rod", {"K": [0.04, 0.12, -0.1], "E": [0.1, 0.12, -0.1]}),
        ],
        joints=[
            md.SpatialRevolute("A", "ground.A", "leg.A", axis=[1, 0.1, 0.05]),
            md.Universal("J", "ground.J", "cylinder.J", axis=[1, 0, 0], axis2=[0, 0.6, -0.6]),
            md.Cylindrical("jack", "cylinder.J", "rod.K", axis=[-0.01, -0.38, -0.35]),
            md.Universal("K", "rod.K", "leg.K", axis=[1, 0, 0], axis2=second_pin),
        ],
    )


def test_crosses_are_at_zero_where_they_are_drawn() -> None:
    result = md.solve(jacked([0, 0.35, -0.38]), HERE)
    joints, angle = result.joints, result.bound.angle[0]
    for found in (joints["J"].angle, joints["J"].angle2, joints["K"].angle, joints["K"].angle2):
        assert abs(found[0]) <= angle < 1e-12
    assert joints["jack"].slide[0] == pytest.approx(np.hypot(0.01, np.hypot(0.38, 0.35)), abs=1e-12)
    for point, place in {"cylinder.E": [0.1, 0.5, 0.25], "rod.E": [0.1, 0.12, -0.1]}.items():
        assert np.abs(result.points[point].position[0] - place).max() <= result.bound.length[0]
    assert not result.summary.get("notes")


def test_pins_that_are_drawn_askew_are_an_error() -> None:
    with pytest.raises(md.MechanismError, match=r"drawn at 87\.783 degrees") as caught:
        jacked([0.02, 0.35, -0.38])
    assert caught.value.where == "joints.K.axis2"
