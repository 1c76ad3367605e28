"""Friction wheels: rolling, forces where they touch, slip, against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mechdae as md

R1, R2, PRESS = 0.03, 0.09, 500.0


def pair(contact: str = "external", torque: float = 9.0, **keys: Any) -> md.Mechanism:
    """Return two wheels on the ground, the second loaded by a torque."""
    apart = R1 + R2 if contact == "external" else R2 - R1
    wheels = {"radius": R1, "second_radius": R2, "press": PRESS, "adhesion": 0.25} | keys
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0), "Q": (apart, 0)}),
        bodies=[md.Body("small", {"O": (0, 0)}), md.Body("large", {"Q": (0, 0)})],
        joints=[
            md.Revolute("O", "ground.O", "small.O"),
            md.Revolute("Q", "ground.Q", "large.Q"),
            md.FrictionWheel("touch", "small.O", "large.Q", contact=contact, **wheels),
        ],
        loads=[md.Torque("load", "large", torque)],
        sketch={"small": 0.0},
    )


def forces(mechanism: md.Mechanism, *at: float) -> md.Result:
    """Return the reactions at values of the small wheel's angle."""
    task = md.Reactions(md.Driver("small.angle", at=at))
    return md.solve(md.Problem(mechanism, {"forces": task}), "forces")


@pytest.mark.parametrize(("contact", "sense"), [("external", -1), ("internal", 1)])
def test_wheels_roll_and_load_their_bearings(contact: str, sense: int) -> None:
    result = forces(pair(contact), *np.linspace(0.0, 6.0, 7).tolist())
    assert result.bodies["large"].angle == pytest.approx(sense * R1 / R2 * np.linspace(0, 6, 7))
    effort = result.efforts["small.angle"]
    assert effort == pytest.approx(-sense * 9.0 * R1 / R2, rel=1e-12)
    # the small wheel lies left of the large one, at its left rim inside: T acts across the centres
    tangential = sense * 9.0 / R2
    apart = PRESS if contact == "external" else -PRESS
    force = result.joints["touch"].reaction
    assert force[:, 0] == pytest.approx(apart, rel=1e-12)
    assert force[:, 1] == pytest.approx(9.0 / R2, rel=1e-12)
    assert force[:, 2] == pytest.approx(-9.0, rel=1e-12)
    bearing = result.joints["O"].reaction
    assert bearing[:, 0] == pytest.approx(apart, rel=1e-12)
    assert abs(bearing[:, 1]) == pytest.approx(abs(tangential), rel=1e-12)
    assert "fault" not in result.summary


@pytest.mark.parametrize(("share", "slips"), [(0.999, True), (1.001, False)])
def test_slip_is_a_fault_that_says_what_would_hold(share: float, slips: bool) -> None:
    needed = 9.0 / R2 / 0.25
    result = forces(pair(press=share * needed), 0.0, 1.0)
    assert (result.fault is not None) is slips
    if slips:
        assert "friction wheels touch slip at 2 of 2 poses" in result.fault
        assert f"{needed:.6g} N at least" in result.fault


def test_wheels_that_do_not_touch_pass_on_their_torque_alone() -> None:
    mechanism = pair(radius=0.02)
    result = forces(mechanism, 0.0, 1.0)
    assert result.joints["O"].reaction[:, :2] == pytest.approx(0.0, abs=1e-12)
    assert any("no real wheels" in text for text in result.summary["assumptions"])


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"radius": 0.0}, "radius is not above 0"),
        ({"press": 0.0}, "adhesion needs the force"),
        ({"adhesion": -0.1}, "adhesion is negative"),
        ({"contact": "internal", "radius": R2}, "is smaller"),
    ],
)
def test_values_that_make_no_wheels(keys: dict[str, float], said: str) -> None:
    with pytest.raises(md.MechanismError, match=said):
        pair(**keys)


def test_another_radius_of_one_structure() -> None:
    """The ratio follows from radii that are numbers of the model, also where kernels are shared."""
    for radius in (0.03, 0.05):
        mechanism = pair().with_values({"touch.radius": radius})
        turned = forces(mechanism, 0.0, 1.5).bodies["large"].angle
        assert turned[1] == pytest.approx(-1.5 * radius / R2, rel=1e-12)


def test_a_motion_rolls_and_slips_are_told() -> None:
    """M = (I1 + I2 (r1/r2)^2) alpha, and what turns the second wheel is T r2 = I2 alpha r1/r2."""
    moment, first, second = 2.0, 0.01, 0.5
    base = pair(press=40.0)
    mechanism = md.Mechanism(
        ground=base.ground,
        bodies=[
            md.Body("small", {"O": (0, 0)}, inertia=first),
            md.Body("large", {"Q": (0, 0)}, inertia=second),
        ],
        joints=list(base.joints.values()),
        loads=[md.Torque("drive", "small", moment)],
        sketch={"small": 0.0},
    )
    task = md.Motion(until=1.0, poses=3)
    result = md.solve(md.Problem(mechanism, {"run": task}), "run")
    rolled = R1 / R2
    alpha = moment / (first + second * rolled**2)
    assert result.bodies["small"].angular_velocity[-1] == pytest.approx(alpha, rel=1e-9)
    tangential = second * alpha * rolled / R2
    assert np.abs(result.joints["touch"].reaction[-1, 2]) == pytest.approx(
        tangential * R2, rel=1e-9
    )
    assert f"with {tangential / 0.25:.6g} N at least" in result.fault
