"""Dry friction in motion against closed forms, quadratures and independent equations."""

from __future__ import annotations

import dataclasses
import json
import math
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from tests.shared.paths import DATA

G = 9.81


def changed(name: str, **keys: Any) -> md.Result:
    """Return the motion of a predefined problem with other keys of its task."""
    problem = md.load(name)
    task = dataclasses.replace(problem.tasks["motion"], **keys)
    return md.solve(problem.with_task("m", task), "m")


def events(result: md.Result, kind: str) -> list[dict[str, Any]]:
    return [event for event in result.events if event["kind"] == kind]


def block(friction: dict[str, float], **more: Any) -> dict[str, Any]:
    return {
        "schema": 1,
        "gravity": [0, -G],
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {"block": {"points": {"P": [0, 0]}, "mass": 1.0}},
        "joints": {"guide": {"kind": "prismatic", "between": ["ground.O", "block.P"], **friction}},
        "tasks": {"m": {"kind": "motion", "until": 1.0, "tolerance": 1e-11}},
        **more,
    }


# -- one slip --------------------------------------------------------------------------------


def test_incline_stops_and_rests_without_creep() -> None:
    result = changed("incline-block", until=1e4)
    slope = math.radians(20)
    down = G * (math.sin(slope) + 0.5 * math.cos(slope))
    (stick,) = events(result, "stick")
    assert stick["at"] == pytest.approx(2.0 / down, rel=1e-14)
    assert result.joints["guide"].slide[-1] == pytest.approx(2.0**2 / (2 * down), rel=1e-14)
    assert np.ptp(result.joints["guide"].slide[1:]) == 0.0
    assert result.fault is None
    normal, along = result.joints["guide"].reaction[-1, :2] @ _turned(slope)
    assert along == pytest.approx(G * math.sin(slope), rel=1e-12)  # what holds it
    assert normal == pytest.approx(G * math.cos(slope), rel=1e-12)


def _turned(slope: float) -> Any:
    axis = np.array([math.cos(slope), math.sin(slope)])
    return np.array([[-axis[1], axis[0]], [axis[0], axis[1]]])


def test_a_steep_incline_slides_back() -> None:
    """With tan(slope) > mu the block turns and comes down with g (sin - mu cos)."""
    data = block({"friction": 0.2, "axis_deg": 30})
    data["tasks"]["m"] |= {"start_speed": {"guide": {"slide": 2.0}}}
    result = md.solve(from_dict(data), "m")
    s, c = 0.5, math.sqrt(0.75)
    up, down = G * (s + 0.2 * c), G * (s - 0.2 * c)
    (turn,) = events(result, "reversal")
    assert turn["at"] == pytest.approx(2 / up, rel=1e-14)
    assert result.joints["guide"].slide[-1] == pytest.approx(
        2 / up - down * (1 - 2 / up) ** 2 / 2, rel=1e-13
    )


def test_belt_has_the_period_of_the_closed_form() -> None:
    result = md.solve(md.load("belt-stick-slip"), "motion")
    slips = np.array([event["at"] for event in events(result, "slip")])
    period = 0.66935706234255753696031626
    assert slips[0] == pytest.approx(0.24525, rel=1e-12)
    assert len(slips) == 100  # the 101st is at the end
    assert np.diff(slips) == pytest.approx(period, abs=1e-11)
    assert slips[-1] == pytest.approx(0.24525 + 99 * period, abs=1e-9)
    assert result.outputs["x"].value[-1] == pytest.approx(0.04905, abs=1e-9)
    assert np.max(result.outputs["x"].value) <= 0.0574468592101256061 + 1e-10
    assert result.checks["energy"] <= 1e-11


# -- pins --------------------------------------------------------------------------------------


def test_pendulum_with_constant_torque() -> None:
    data = json.loads((DATA / "friction_pendulum_const_torque.json").read_text(encoding="utf-8"))
    result = md.solve(md.load("pendulum-dry-torque"), "motion")
    turns = [event["at"] for event in result.events]
    assert [event["kind"] for event in result.events] == ["reversal"] * 10 + ["stick"]
    assert turns == pytest.approx([float(own["t"]) for own in data["turning_points"]], abs=1e-11)
    assert result.joints["O"].angle[-1] == pytest.approx(float(data["final_stick"]), abs=1e-11)
    assert result.summary["rests_from"] == turns[-1]


def test_pendulum_with_friction_circle() -> None:
    data = json.loads((DATA / "friction_pendulum_friction_circle.json").read_text(encoding="utf-8"))
    free = md.solve(md.load("pendulum-dry-circle"), "motion")
    turns = [event for event in free.events if event["kind"] != "crossing"]
    assert [event["kind"] for event in turns] == ["reversal"] * 12 + ["stick"]
    times = [event["at"] for event in turns[:8]]
    angles = changed("pendulum-dry-circle", until=None, at=tuple(times)).joints["O"].angle
    assert angles == pytest.approx([float(own) for own in data["first_turns"]], abs=1e-10)
    bottom = events(free, "crossing")[0]["at"]
    there = changed("pendulum-dry-circle", until=None, at=(bottom,))
    square = there.bodies["rod"].angular_velocity[-1] ** 2
    assert square == pytest.approx(float(data["thetadot2_at_first_bottom_passage"]), rel=1e-10)
    assert abs(math.tan(free.joints["O"].angle[-1])) <= float(data["kappa"])


@pytest.mark.parametrize(("tolerance", "bar"), [(1e-8, 5e-8), (1e-10, 5e-10), (1e-12, 5e-12)])
def test_coasting_slider_crank(tolerance: float, bar: float) -> None:
    """Newton-Euler equations for the square of the speed over the crank angle."""
    result = changed("coasting-slider-crank", tolerance=tolerance)
    assert result.outputs["turned"].value[-1] == pytest.approx(12.121009647567854, abs=bar)
    assert result.checks["energy"] <= 1e3 * tolerance


# -- several slips -----------------------------------------------------------------------------


def test_two_blocks_start_one_after_the_other() -> None:
    """A pull 10 t on the lower one; both slip at rest's coefficients, then kinetic ones count."""
    data = block({}, loads={"pull": {"kind": "force", "point": "A.P", "value": ["10*t", 0]}})
    data["bodies"] = {
        "A": {"points": {"P": [0, 0]}, "mass": 2.0}, "B": {"points": {"P": [0, 0]}, "mass": 1.0}
    }  # fmt: skip
    data["joints"] = {
        "low": {"kind": "prismatic", "between": ["ground.O", "A.P"],
                "friction": 0.3, "friction_static": 0.4},
        "high": {"kind": "prismatic", "between": ["A.P", "B.P"],
                 "friction": 0.2, "friction_static": 0.25},
    }  # fmt: skip
    data["tasks"]["m"]["until"] = 3.0
    result = md.solve(from_dict(data), "m")
    first, second = 0.4 * 3 * G / 10, (0.25 + 0.3) * 3 * G / 10
    assert [(event["kind"], event["joint"]) for event in result.events] == [
        ("slip", "low"), ("slip", "high")
    ]  # fmt: skip
    assert [event["at"] for event in result.events] == pytest.approx([first, second], rel=1e-12)

    def speed(t: float) -> float:
        return (5 * t * t - 0.9 * G * t) / 3

    def way(t: float) -> float:
        return (5 * t**3 / 3 - 0.45 * G * t * t) / 3

    left, pull = 3 - second, 10 * second - 0.9 * G - 0.2 * G
    common = way(second) - way(first) - speed(first) * (second - first)
    common += (speed(second) - speed(first)) * left
    lower = common + (pull * left**2 / 2 + 10 * left**3 / 6) / 2
    upper = common + 0.2 * G * left**2 / 2
    assert result.joints["low"].slide[-1] == pytest.approx(lower, rel=1e-11)
    assert result.joints["high"].slide[-1] == pytest.approx(upper - lower, rel=1e-11)


def slider_crank(torque: str, **task: Any) -> dict[str, Any]:
    """A massless-looking drive: rod without mass, heavy slider, friction everywhere."""
    pin = {"kind": "revolute", "friction": 0.3}
    return block(
        {},
        bodies={
            "crank": {"points": {"O": [0, 0], "B": [0.1, 0]}, "mass": 1.0, "inertia": 0.01},
            "rod": {"points": {"B": [0, 0], "C": [0.3, 0]}, "mass": 0.5, "inertia": 0.004},
            "slider": {"points": {"C": [0, 0]}, "mass": 2.0},
        },
        joints={
            "O": {**pin, "between": ["ground.O", "crank.O"], "pin_radius": 0.02},
            "B": {**pin, "between": ["crank.B", "rod.B"], "pin_radius": 0.015},
            "C": {**pin, "between": ["rod.C", "slider.C"], "pin_radius": 0.01},
            "slide": {"kind": "prismatic", "between": ["ground.O", "slider.C"], "friction": 0.2},
        },
        sketch={"crank_deg": 60, "rod_deg": -15},
        loads={"motor": {"kind": "torque", "body": "crank", "value": torque}},
        tasks={"m": {"kind": "motion", "start": {"crank": 1.0}, "tolerance": 1e-10, **task}},
    )


def test_a_mechanism_at_rest_starts_when_its_effort_is_reached() -> None:
    """Four pairs stick with one freedom; the start is where the coupled statics have the torque."""
    data = slider_crank("0.6 + 0.1*t", until=1.8)
    result = md.solve(from_dict(data), "m")
    (start,) = [event["at"] for event in result.events[:1] if event["kind"] == "slip"]
    assert result.joints["O"].angle[0] == 1.0
    for joint in data["joints"]:  # four forces of friction hold one freedom
        assert np.isnan(result.joints[joint].reaction[0]).all()
        assert np.isfinite(result.joints[joint].reaction[-1]).all()
    assert any("O, B, C, slide stick together" in note for note in result.summary["notes"])
    data["loads"] = {}
    data["tasks"]["r"] = {
        "kind": "reactions", "friction": "coupled",
        "driver": {"coordinate": "crank.angle", "at": [1.0], "speed": 1e-9},
    }  # fmt: skip
    effort = md.solve(from_dict(data), "r").efforts["crank.angle"][0]
    assert 0.6 + 0.1 * start == pytest.approx(effort, rel=1e-9)


def test_a_torque_that_grows_from_nothing_starts_at_once() -> None:
    """Without weights friction is a share of the torque: there is nothing it could hold."""
    data = slider_crank("5*t", until=0.1)
    data["gravity"] = [0, 0]
    result = md.solve(from_dict(data), "m")
    assert result.fault is None
    assert result.joints["O"].angle[-1] > 1.0


# -- verdicts ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("p", "mu", "side", "accelerations"),
    [
        (0.1, 0.15, 1, [4.0625]),
        (0.1, 0.15, -1, [8.75]),
        (0.1, 0.4, 1, [3.4615384615384615, -1.6666666666666667]),
        (0.1, 0.4, -1, []),
        (0.3, 0.4, 1, []),
        (0.3, 0.4, -1, [35 / 3, 6.538461538461538]),
    ],
)
def test_eccentric_slider(p: float, mu: float, side: int, accelerations: list[float]) -> None:
    problem = md.load("eccentric-slider").with_values({"p": p, "mu": mu, "side": side})
    result = md.solve(problem, "motion")
    found = result.joints["guide"].slide_acceleration
    if len(accelerations) == 1:
        assert result.fault is None
        assert found == pytest.approx(accelerations[0], rel=1e-13)
        return
    assert result.fault is not None
    assert np.isnan(found).all()  # never one of several
    assert result.status[0] == ("ambiguous" if accelerations else "jammed")
    assert "0.625 of the coefficients" in result.fault  # L/(2 h) = 0.25 of 0.4
    if not accelerations:
        assert "jammed (F1)" in result.fault
    else:
        assert "2 solutions (F2)" in result.fault
        for value in accelerations:
            assert f"{value:.9g}" in result.fault


@pytest.mark.parametrize(("scale", "mass"), [(1e-6, 1e6), (1e3, 1e-6)])
def test_scale_changes_nothing(scale: float, mass: float) -> None:
    """Lengths and gravity times s, and another mass: the same times in the same steps."""
    problem = md.load("pendulum-dry-circle")
    plain = md.solve(problem, "motion")
    values = {"g": G * scale, "L": 0.5 * scale, "r_pin": 0.05 * scale, "m": mass}
    scaled = md.solve(problem.with_values(values), "motion")
    times, expected = ([e["at"] for e in result.events] for result in (scaled, plain))
    assert times == pytest.approx(expected, rel=1e-11)
    assert scaled.summary["steps"] == plain.summary["steps"]


@pytest.mark.parametrize("dip", [1e-2, 1e-4, 1e-6, -1e-6])
def test_a_short_dip_of_a_speed_is_not_stepped_over(dip: float) -> None:
    """On a table that swings, x' = cos t, a block sticks for a moment if it is as fast as that.

    The block slides with x' = 1 - dip against friction that a force balances, so that its speed
    over the table, 1 - dip - cos t, would fall below zero only around t = 2 pi.
    """
    data = block({}, loads={"pull": {"kind": "force", "point": "block.P", "value": [0.1 * G, 0]}})
    data["bodies"]["table"] = {"points": {"P": [0, 0]}}
    data["joints"] = {
        "drive": {"kind": "prismatic", "between": ["ground.O", "table.P"]},
        "rub": {"kind": "prismatic", "between": ["table.P", "block.P"], "friction": 0.1},
    }
    data["tasks"]["m"] |= {
        "drivers": [{"coordinate": "drive.slide", "law": "sin(t + 3)"}],
        "start": {"block.P.x": 0}, "start_speed": {"block.P.x": 1 - dip},
        "until": 6.0, "tolerance": 1e-4,
    }  # fmt: skip
    result = md.solve(from_dict(data), "m")
    if dip < 0:
        assert result.events == ()
        return
    # the table overtakes where cos(t + 3) = 1 - dip; then both forces push the block along
    first = result.events[0]
    assert first["at"] == pytest.approx(2 * math.pi - math.acos(1 - dip) - 3, abs=1e-6)
    assert first["joint"] == "rub"


def test_reactions_balance_the_slider() -> None:
    """Newton's law of the slider, friction in guide and pin: the reactions are all there is."""
    result = changed("coasting-slider-crank", until=0.5)
    acceleration = result.points["slider.C"].acceleration
    force = result.joints["slide"].reaction[:, :2] + result.joints["C"].reaction[:, :2]
    force += np.array([0.0, -2.0 * G])
    assert force == pytest.approx(2.0 * acceleration, abs=1e-9)
    moment = result.joints["C"].reaction[:, 2]
    rho = 0.01 * 0.2 / math.sqrt(1 + 0.2**2)
    size = np.linalg.norm(result.joints["C"].reaction[:, :2], axis=1)
    assert np.abs(moment) == pytest.approx(rho * size, rel=1e-9)


def test_friction_on_forces_that_are_not_unique_is_refused() -> None:
    """Two guides in one line carry a block together: what each of them carries is open."""
    data = block({"friction": 0.1})
    data["bodies"]["block"]["points"]["Q"] = [1.0, 0]
    data["joints"]["other"] = {
        "kind": "prismatic", "between": ["ground.O", "block.Q"], "friction": 0.3
    }  # fmt: skip
    with pytest.raises(md.IndeterminateFrictionError, match="guide, other"):
        md.solve(from_dict(data), "m")
    for joint in data["joints"].values():
        joint["friction"] = 0.0
    assert md.solve(from_dict(data), "m").fault is None
