"""Whole turns that make other modes in space: screws, and wheels on bearings of joints."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict

RADIUS, BAR, ARM, CENTRE = 0.04, 0.26, 0.11, np.array([0.14, 0.18, 0.07])


def crank_and_screw(pitch):
    """A crank, a bar with two balls, an arm on a screw along x."""
    joints = {
        "A": {"kind": "revolute", "between": ["ground.A", "crank.A"], "axis": [0, 0, 1]},
        "B": {"kind": "spherical", "between": ["crank.B", "bar.B"]},
        "C": {"kind": "spherical", "between": ["arm.C", "bar.C"]},
        "D": {
            "kind": "screw", "between": ["ground.D", "arm.D"], "axis": [1, 0, 0],
            "zero": [0, 1, 0], "axis2": [0, 0, 1], "zero2": [1, 0, 0], "pitch": pitch,
        },
    }  # fmt: skip
    return from_dict(
        {
            "schema": 1,
            "dimension": 3,
            "ground": {"points": {"A": [0, 0, 0], "D": CENTRE.tolist()}},
            "bodies": {
                "crank": {"points": {"A": [0, 0, 0], "B": [RADIUS, 0, 0]}},
                "bar": {"points": {"B": [0, 0, 0], "C": [BAR, 0, 0]}},
                "arm": {"points": {"D": [0, 0, 0], "C": [ARM, 0, 0]}},
            },
            "joints": joints,
            "sketch": {"A_deg": 0, "arm.C": [0.14, 0.2, 0.17]},
            "tasks": {"modes": {"kind": "modes", "driver": {"coordinate": "A.angle", "at": [0]}}},
        }
    )


def screwed(pitch):
    """All angles at which the arm's ball is a bar's length from the crank's at angle zero."""

    def gap(a):
        ball = CENTRE + np.array([pitch * a / (2 * np.pi), ARM * np.cos(a), ARM * np.sin(a)])
        return float(((ball - [RADIUS, 0, 0]) ** 2).sum()) - BAR**2

    most = 2 * np.pi / abs(pitch) * (BAR + CENTRE[0])
    grid = np.linspace(-most, most, 20001)
    values = np.array([gap(a) for a in grid])
    at = np.flatnonzero(values[:-1] * values[1:] < 0)
    found = []
    for k in at:
        low, high = grid[k], grid[k + 1]
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if gap(middle) * gap(low) > 0 else (low, middle)
        found.append(middle)
    return found


@pytest.mark.parametrize("pitch", [0.06, -0.045])
def test_all_turns_of_a_screw_are_looked_at(pitch: float) -> None:
    found = md.solve(crank_and_screw(pitch), "modes")
    assert found.summary["proven"]
    assert list(found.status) == ["ok"] * len(found)
    expected = screwed(pitch)
    assert len(expected) > 10
    np.testing.assert_allclose(np.sort(found.joints["D"].angle), expected, rtol=0, atol=1e-11)
    slides = np.sort(np.array(expected) * pitch / (2 * np.pi))
    np.testing.assert_allclose(np.sort(found.joints["D"].slide), slides, rtol=0, atol=1e-12)


def geared(dimension, ratio):
    """A four-bar whose coupler is geared to a wheel on the crank's pin."""
    points = {
        "ground": {"D": [0, 0], "A": [0.1, 0]}, "crank": {"A": [0, 0], "B": [0.048, 0]},
        "coupler": {"C": [0, 0], "B": [0.09, 0]}, "rocker": {"D": [0, 0], "C": [0.08, 0]},
        "wheel": {"A": [0, 0]},
    }  # fmt: skip
    space = dimension == 3
    if space:
        points = {b: {p: [*v, 0] for p, v in own.items()} for b, own in points.items()}
    bodies = {name: {"points": own} for name, own in points.items() if name != "ground"}
    along = {"axis": [0, 0, 1]} if space else {}
    ends = {
        "A": ["ground.A", "crank.A"], "wheel_pin": ["crank.A", "wheel.A"],
        "B": ["crank.B", "coupler.B"], "C": ["coupler.C", "rocker.C"],
        "D": ["ground.D", "rocker.D"],
    }  # fmt: skip
    joints = {name: {"kind": "revolute", "between": own, **along} for name, own in ends.items()}
    if space:
        joints["C"] = {"kind": "spherical", "between": ends["C"]}
        joints["D"]["kind"] = "cylindrical"
    mesh = {"kind": "gear", "between": ["wheel.A", "coupler.B"], "carrier": "crank", "ratio": ratio}
    angles = {"A_deg": 20, "D_deg": -30} if space else {"crank_deg": 20, "rocker_deg": -30}
    driver = "A.angle" if space else "crank.angle"
    return from_dict(
        {
            "schema": 1, "dimension": dimension, "ground": {"points": points["ground"]},
            "bodies": bodies, "joints": {**joints, "mesh": mesh}, "sketch": angles,
            "tasks": {"modes": {"kind": "modes", "driver": {"coordinate": driver, "at": [0.3]}}},
        }
    )  # fmt: skip


@pytest.mark.parametrize(("ratio", "turns"), [("2", 1), ("2/3", 3), ("-3/4", 4)])
def test_turns_of_wheels_are_told_apart_as_in_the_plane(ratio: str, turns: int) -> None:
    """A turn of the coupler turns the wheel by the ratio, so that as many turns are other modes."""
    plane, space = (md.solve(geared(d, ratio), "modes") for d in (2, 3))
    for result in (plane, space):
        assert result.summary["count"] == 2 * turns
        assert result.summary["proven"]

    def wheel(angles):
        return np.exp(1j * np.array(angles))

    own = [plane.bodies[b].angle for b in ("wheel", "crank")]
    flat, solid = wheel(own[0] - own[1]), wheel(space.joints["wheel_pin"].angle)
    assert max(np.abs(solid - one).min() for one in flat) < 1e-11
    assert max(np.abs(flat - one).min() for one in solid) < 1e-11


def test_a_sketch_that_is_silent_of_wheels_means_those_turned_least() -> None:
    """A planet on a wheel that is held, too, by a bearing on the cage: its turns are open."""
    mechanism = md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": (0, 0, 0)}),
        bodies=[
            md.Body("cage", {"O": (0, 0, 0), "P": (0.04, 0, 0)}),
            md.Body("planet", {"P": (0, 0, 0), "T": (0, 0.026, 0)}),
            md.Body("wheel", {"O": (0, 0, 0)}),
        ],
        joints=[
            md.SpatialRevolute("C", "ground.O", "cage.O", axis=(0, 0, 1)),
            md.SpatialWeld("W", "ground.O", "wheel.O", axis=(0, 0, 1)),
            md.SpatialRevolute("O", "cage.O", "wheel.O", axis=(0, 0, 1)),
            md.SpatialRevolute("P", "cage.P", "planet.P", axis=(1, 0, 0)),
            md.SpatialGear("mesh", "wheel.O", "planet.P", carrier="cage", ratio="-16/24"),
        ],
        sketch={"C.angle": 0.0},
    )
    at = md.Driver("C.angle", at=(0.4,))
    pose = md.solve(mechanism, md.Sweep(driver=at))
    np.testing.assert_allclose(pose.joints["P"].angle, 1.5 * 0.4, atol=1e-13)
    modes = md.solve(mechanism, md.Modes(driver=at))
    assert modes.summary["count"] == 2  # a turn of the wheel is one and a half of the planet
    turns = np.sort((modes.joints["P"].angle - 1.5 * 0.4) / (2 * np.pi))
    np.testing.assert_allclose(np.abs(turns - turns[np.abs(turns).argmin()]).max(), 1.5, atol=1e-12)
