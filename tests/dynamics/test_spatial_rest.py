"""Equilibria and small motions in space against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.values import Table
from tests.reference.spatial_bodies import rotation
from tests.shared.turning import G, pinned

MASS, CENTRE = 2.0, (0.3, 0.1, -0.4)
TENSOR = (0.1, 0.2, 0.15, 0.01, 0.02, -0.03)


def rest(mechanism: md.Mechanism, **keys: Any) -> md.Result:
    return md.solve(mechanism, md.Equilibrium(linearise=True, **keys))


def hinged(axis: Any) -> md.Mechanism:
    """Return a rigid body on a hinge: a physical pendulum in a tilted plane."""
    body = md.Body("rod", {"O": (0, 0, 0)}, mass=MASS, center=CENTRE, inertia=TENSOR)
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": (0, 0, 0)}),
        bodies=[body],
        joints=[md.SpatialRevolute("O", "ground.O", "rod.O", axis=axis)],
        gravity=(0, 0, -G),
        sketch={"O": 0.2},
    )


@pytest.mark.parametrize("tilt", [0.0, 0.4, 1.2])
def test_a_physical_pendulum_in_a_tilted_plane(tilt: float) -> None:
    axis = np.array([0, math.cos(tilt), math.sin(tilt)])
    result = rest(hinged(axis))
    xx, yy, zz, xy, xz, yz = TENSOR
    J = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    c = np.array(CENTRE)
    arm = c - axis * (axis @ c)
    about = axis @ J @ axis + MASS * arm @ arm
    wanted = math.sqrt(MASS * G * math.cos(tilt) * np.linalg.norm(arm) / about) / (2 * math.pi)
    assert abs(result.summary["frequencies"][0] / wanted - 1) < 1e-12
    assert result.summary["stable"] == "stable"
    assert result.summary["all_equilibria"]
    both = [own["stable"] for own in result.summary["equilibria"]]
    assert sorted(both) == ["stable", "unstable"]
    reaction = result.joints["O"].reaction[0]
    assert np.abs(reaction[:3] - [0, 0, MASS * G]).max() < 1e-12 * MASS * G
    assert np.abs(result.data["linear"]["A"][1][0] + (2 * math.pi * wanted) ** 2) < 1e-11


def test_a_body_on_a_ball_joint_swings_about_two_axes_and_is_free_to_spin() -> None:
    mechanism = pinned((0.1, 0.2, 0.15), (0, 0, -0.5), G, sketch={"top.P": (-0.3, -0.1, 0.9)})
    result = rest(mechanism)
    across = [MASS * G * 0.5 / (J + MASS * 0.25) for J in (0.2, 0.1)]
    wanted = [0, 0, *(math.sqrt(own) / (2 * math.pi) for own in across)]
    assert np.abs(np.array(result.summary["frequencies"]) - wanted).max() < 1e-7
    assert np.abs(np.array(result.summary["frequencies"])[2:] / wanted[2:] - 1).max() < 1e-12
    assert result.summary["freedoms"] == 3
    assert result.summary["stable"] == "neutral"
    assert np.abs(result.points["top.P"].position[0] - [0, 0, 1]).max() < 1e-12
    R = rotation(result.bodies["top"].orientation[0])
    for own, axis in zip(result.summary["modes"][2:], ([0, 1, 0], [1, 0, 0]), strict=True):
        turn = R.T @ [own["bodies"]["top"][word][0] for word in ("wx", "wy", "wz")]
        assert np.abs(np.cross(turn, axis)).max() < 1e-9 * np.abs(turn).max()


def test_a_plate_on_three_springs_finds_its_place() -> None:
    k, a, m = 500.0, 0.4, 3.0
    ways = [2 * math.pi * j / 3 for j in range(3)]
    feet = {f"B{j}": (a * math.cos(w), a * math.sin(w), 0) for j, w in enumerate(ways)}
    body = md.Body("plate", {"O": (0, 0, 0), **feet}, mass=m, inertia=(0.05, 0.05, 0.1))
    rail = md.Body("rail", {"O": (0, 0, 0)})
    joints = [
        md.SpatialPrismatic("up", "ground.O", "rail.O", axis=(0, 0, 1)),
        md.Universal("tilt", "rail.O", "plate.O", axis=(1, 0, 0), axis2=(0, 1, 0)),
    ]
    roof = {f"A{j}": (x, y, 1.0) for j, (x, y, _) in enumerate(feet.values())}
    springs = [
        md.Spring(f"s{j}", between=(f"ground.A{j}", f"plate.B{j}"), stiffness=k, free_length=0.8)
        for j in range(3)
    ]
    mechanism = md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": (0, 0, 0), **roof}),
        bodies=[rail, body],
        joints=joints,
        loads=springs,
        gravity=(0, 0, -G),
        sketch={"up": 0.1, "plate.B0": (a, 0, 0.1), "plate.B1": (-a / 2, 0.8 * a, 0.1)},
    )
    result = rest(mechanism, free=("up.slide", "tilt.angle", "tilt.angle2"))
    length = 0.8 + m * G / (3 * k)
    assert abs(result.joints["up"].slide[0] - (1 - length)) < 1e-12
    # a foot at (x, y) stays above its spring: it sinks by -y w, and comes nearer by y w^2 / 2
    second = k * 1.5 * a**2
    lift = math.sqrt(3 * k / m) / (2 * math.pi)
    tilt = math.sqrt(second / 0.05) / (2 * math.pi)
    found = sorted(result.summary["frequencies"])
    assert np.abs(np.array(found) / sorted([lift, tilt, tilt]) - 1).max() < 1e-9


def test_an_equilibrium_lies_on_the_sketched_mode() -> None:
    mechanism = md.load("rssr").mechanism
    bodies = {
        n: b if n == "bar" else replace(b, mass=1.0, inertia=(0.1, 0.1, 0.1))
        for n, b in mechanism.bodies.items()
    }
    pull = md.Spring("pull", coordinate="A.angle", stiffness=3.0, free_length=0.7)
    loaded = replace(mechanism, bodies=Table(bodies), loads=Table({"pull": pull}), gravity=None)
    result = rest(loaded)
    sweep = md.solve(mechanism, md.Sweep(driver=md.Driver("A.angle", at=[0.7])))
    assert abs(result.joints["A"].angle[0] - 0.7) < 1e-10
    gap = result.points["rocker.C"].position[0] - sweep.points["rocker.C"].position[0]
    assert np.abs(gap).max() < 1e-10
    assert result.summary["sketched_mode"]
    other = [own for own in result.summary["equilibria"] if not own["sketched_mode"]]
    assert all(own["mode"] != result.summary["mode"] for own in other)


def test_a_leg_that_could_be_turned_about_and_slid_back_slides_forward() -> None:
    """An upright arm of 0.3 on a telescope of 0.5 at its rest, which starts 0.4 beside its pin."""
    telescope = md.Mechanism(
        dimension=3,
        gravity=(0, 0, -9.81),
        ground=md.Ground({"A": [0, 0, 0], "D": [0.4, 0, 0]}),
        bodies=[
            md.Body("tube", {"A": [0, 0, 0]}),
            md.Body("rod", {"S": [0, 0, 0]}),
            md.Body("arm", {"D": [0, 0, 0], "S": [0, 0, 0.3]}, mass=2.0, center=[0, 0, 0.15],
                    inertia=[0.01, 0.01, 0.01]),
        ],
        joints=[
            md.SpatialRevolute("A", "ground.A", "tube.A", axis=[0, 1, 0]),
            md.SpatialPrismatic("P", "tube.A", "rod.S", axis=[0, 0, 1]),
            md.Spherical("S", "rod.S", "arm.S"),
            md.SpatialRevolute("D", "ground.D", "arm.D", axis=[0, 1, 0]),
        ],
        loads=[md.Spring("coil", coordinate="P.slide", stiffness=800.0, free_length=0.5)],
        sketch={"arm.S": [0.35, 0, 0.29]},
    )  # fmt: skip
    result = md.solve(telescope, md.Equilibrium())
    assert list(result.status) == ["ok"]
    assert result.joints["P"].slide[0] == pytest.approx(0.5, abs=1e-12)
    assert result.joints["A"].angle[0] == pytest.approx(np.arctan2(4, 3), abs=1e-12)
    assert result.joints["D"].angle[0] == pytest.approx(0.0, abs=1e-12)
