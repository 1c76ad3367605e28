"""Transmission angles, against closed forms and independent computations."""

from __future__ import annotations

from dataclasses import replace
from math import acos, pi, sin

import numpy as np
import pytest

import mechdae as md
from tests.reference.closed_forms import double_rocker_limits
from tests.shared.measured import driven, measured


@pytest.mark.parametrize(
    ("name", "r", "rod", "e"),
    [("slider-crank", 0.1, 0.3, 0.0), ("slider-crank-offset", 0.04, 0.12, -0.02)],
)
def test_transmission_angle_of_slider_cranks(name: str, r: float, rod: float, e: float) -> None:
    """Pressure angle between rod and guide: sin alpha = (r sin theta - e) / rod."""
    result = measured(name, "transmission", poses=25)
    u = result.drivers["crank.angle"].position
    expected = np.arccos(np.abs(r * np.sin(u) - e) / rod)
    assert result.joints["C"].transmission_angle == pytest.approx(expected, abs=1e-14)
    found = result.summary["transmission"]["C"]
    assert found["min"] == pytest.approx(acos((r + abs(e)) / rod), abs=1e-14)
    assert found["at"] == pytest.approx(pi / 2, abs=1e-13)
    assert found["max"] == pytest.approx(pi / 2, abs=1e-14)
    assert r * sin(found["max_at"]) == pytest.approx(e, abs=1e-15)


def test_transmission_angle_of_a_four_bar_and_of_its_rod_as_a_distance() -> None:
    """Cosine rule in the triangle B, C, D: least and greatest with the crank along the frame."""
    a, b, c, d = 0.04, 0.12, 0.08, 0.1
    result = measured("four-bar-crank-rocker", "transmission", poses=31)
    u = result.drivers["crank.angle"].position
    diagonal = a * a + d * d - 2 * a * d * np.cos(u)
    expected = np.arccos(np.abs(b * b + c * c - diagonal) / (2 * b * c))
    assert result.joints["C"].transmission_angle == pytest.approx(expected, abs=1e-13)
    found = result.summary["transmission"]["C"]
    least, most = (acos((b * b + c * c - (d + s * a) ** 2) / (2 * b * c)) for s in (-1, 1))
    assert (found["min"], found["max"]) == pytest.approx((least, most), abs=1e-14)
    assert (found["at"], found["max_at"]) == pytest.approx((0.0, pi), abs=1e-9)
    mechanism = md.load("four-bar-crank-rocker").mechanism
    joints = {n: j for n, j in mechanism.joints.items() if n in ("A", "D")}
    bodies = {n: body for n, body in mechanism.bodies.items() if n != "coupler"}
    rod = md.Distance("rod", "crank.B", "rocker.C", length="b")
    sketch = {"crank": 0.7, "rocker": 1.0}
    short = replace(mechanism, bodies=bodies, joints={**joints, "rod": rod}, sketch=sketch)
    other = driven(short, "crank.angle", "transmission", poses=31)
    assert other.joints["rod"].transmission_angle == pytest.approx(expected, abs=1e-13)
    assert other.summary["transmission"]["rod"]["min"] == pytest.approx(least, abs=1e-14)


def test_transmission_angle_vanishes_at_limit_positions_and_passes_a_right_angle() -> None:
    result = measured("four-bar-double-rocker", "transmission", task="window", poses=9)
    found = result.summary["transmission"]["C"]
    end = double_rocker_limits()[1]
    assert (found["min"], found["max"]) == pytest.approx((0.0, pi / 2), abs=1e-14)
    assert abs(found["at"]) == pytest.approx(end, abs=1e-14)
    a, b, c, d = 0.08, 0.07, 0.06, 0.12
    right = acos((a * a + d * d - b * b - c * c) / (2 * a * d))
    assert abs(found["max_at"]) == pytest.approx(right, abs=1e-13)
    assert result.joints["C"].transmission_angle[0] == pytest.approx(0, abs=1e-14)


def test_transmission_angles_of_dyads_with_slides() -> None:
    """A slotted link through both pins: 90 degrees; off centre by e: acos(e / |GA|)."""
    result = measured("whitworth-quick-return", "transmission", poses=13)
    assert result.joints["slot"].transmission_angle == pytest.approx(np.full(13, pi / 2))
    assert set(result.summary["transmission"]) == {"slot", "C"}
    e = 0.02
    mechanism = md.Mechanism(
        ground=md.Ground(points={"O": [0, 0], "G": [0, -0.2]}),
        bodies=[
            md.Body("crank", points={"O": [0, 0], "A": [0.1, 0]}),
            md.Body("link", points={"G": [0, 0], "S": [0, e]}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("G", "ground.G", "link.G"),
            md.PinInSlot("slot", "link.S", "crank.A"),
        ],
        sketch={"crank": 0.5, "link": 1.2},
    )
    result = driven(mechanism, "crank.angle", "transmission")
    u = result.drivers["crank.angle"].position
    distance = np.hypot(0.1 * np.cos(u), 0.1 * np.sin(u) + 0.2)
    expected = np.arccos(e / distance)
    assert result.joints["slot"].transmission_angle == pytest.approx(expected, abs=1e-13)
    found = result.summary["transmission"]["slot"]
    assert (found["min"], found["max"]) == pytest.approx((acos(e / 0.1), acos(e / 0.3)), abs=1e-14)
    assert found["at"] == pytest.approx(3 * pi / 2, abs=1e-9)


@pytest.mark.parametrize("skew", [pi / 2, 1.0])
def test_transmission_angle_of_a_yoke_is_the_angle_of_its_slot(skew: float) -> None:
    mechanism = md.load("scotch-yoke").mechanism
    slot = replace(mechanism.joints["slot"], axis=skew)
    turned = replace(mechanism, joints=mechanism.joints.with_("slot", slot))
    result = driven(turned, "crank.angle", "transmission")
    assert result.joints["slot"].transmission_angle == pytest.approx(np.full(13, skew))
    assert result.summary["transmission"]["slot"]["min"] == pytest.approx(skew, abs=1e-14)


def test_transmission_angle_of_two_sliders_on_one_pin() -> None:
    """A guide turned by u and an upright one (tangent mechanism): the angle between them."""
    mechanism = md.Mechanism(
        ground=md.Ground(points={"O": [0, 0], "H": [0.5, 0]}),
        bodies=[
            md.Body("arm", points={"O": [0, 0]}),
            md.Body("block", points={"P": [0, 0]}),
            md.Body("rod", points={"P": [0, 0]}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "arm.O"),
            md.Prismatic("along", "arm.O", "block.P"),
            md.Revolute("P", "block.P", "rod.P"),
            md.Prismatic("up", "ground.H", "rod.P", axis=pi / 2),
        ],
        sketch={"arm": 0.3},
    )
    result = driven(mechanism, "arm.angle", "transmission", poses=5, from_=-0.4, to=1.2)
    u = result.drivers["arm.angle"].position
    assert result.joints["P"].transmission_angle == pytest.approx(pi / 2 - np.abs(u), abs=1e-14)
    found = result.summary["transmission"]["P"]
    assert found["min"] == pytest.approx(pi / 2 - 1.2, abs=1e-14)
    assert (found["max"], found["max_at"]) == pytest.approx((pi / 2, 0.0), abs=1e-14)


def test_groups_that_are_no_dyads_have_no_transmission_angle() -> None:
    result = measured("planetary-gear-train", "transmission", poses=3)
    assert result.summary["transmission"] == {}
