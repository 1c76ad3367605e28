"""Velocity ratios and ideal advantages against closed forms and the balance of powers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from tests.shared.measured import driven, measured

BOTH = ("velocity-ratio", "mechanical-advantage")


def test_a_four_bar_has_the_ratio_of_its_instant_centre() -> None:
    """Kennedy: w4/w2 = (I24 - A)/(I24 - D), where the coupler's line meets the line of the pins."""
    result = measured("four-bar-crank-rocker", *BOTH, poses=37)
    joints = {name: result.points[name].position for name in ("crank.B", "coupler.C")}
    b, c = joints["crank.B"], joints["coupler.C"]
    ground = 0.1
    with np.errstate(divide="ignore", invalid="ignore"):
        centre = b[:, 0] - b[:, 1] * (c[:, 0] - b[:, 0]) / (c[:, 1] - b[:, 1])
        expected = centre / (centre - ground)
    rocker = result.bodies["rocker"]
    there = np.isfinite(expected)
    assert there.sum() > 30
    assert rocker.velocity_ratio[there] == pytest.approx(expected[there], rel=1e-11, abs=1e-12)
    assert rocker.mechanical_advantage == pytest.approx(1 / abs(rocker.velocity_ratio), rel=1e-12)


@pytest.mark.parametrize("speed", [1.0, -7.0])
def test_the_driver_s_speed_plays_no_part(speed: float) -> None:
    r, rod = 0.04, 0.12
    mechanism = md.slider_crank(crank=r, rod=rod)
    driver = md.Driver("crank.angle", at=[0.3, 1.2, np.pi], speed=speed)
    result = md.solve(mechanism, md.Sweep(driver, measures=BOTH))
    u = np.array([0.3, 1.2, np.pi])
    lean = np.sqrt(rod**2 - (r * np.sin(u)) ** 2)
    expected = -r * np.sin(u) - r**2 * np.sin(u) * np.cos(u) / lean
    guide = result.joints["guide"]
    assert guide.slide_per_angle == pytest.approx(expected, abs=1e-15)
    assert guide.force_per_torque[:2] == pytest.approx(1 / abs(expected[:2]), rel=1e-12)
    assert guide.force_per_torque[2] == np.inf  # the dead centre of a toggle
    assert "velocity_ratio" in result.bodies["rod"]
    assert "crank" not in _with_ratio(result)
    units = {name: unit for name, unit, _ in result.columns()}
    assert units["guide.slide_per_angle"] == "m"
    assert units["guide.force_per_torque"] == "1/m"


def test_the_slider_may_drive() -> None:
    mechanism = md.slider_crank(crank=0.04, rod=0.12)
    by_crank = driven(mechanism, "crank.angle", *BOTH, from_=0.4, to=1.4, poses=5)
    slides = by_crank.joints["guide"].slide
    driver = md.Driver("guide.slide", at=slides.tolist())
    by_slider = md.solve(mechanism, md.Sweep(driver, measures=BOTH))
    crank, guide = by_slider.bodies["crank"], by_crank.joints["guide"]
    assert abs(crank.angle_per_slide * guide.slide_per_angle) == pytest.approx(1, rel=1e-9)
    assert crank.torque_per_force * guide.force_per_torque == pytest.approx(1, rel=1e-9)


def test_the_advantage_is_that_of_forces_without_friction() -> None:
    """An effort from the balance of forces, by another way than rates."""
    mechanism = md.slider_crank(crank=0.04, rod=0.12)
    result = driven(mechanism, "crank.angle", *BOTH, from_=0.4, to=1.4, poses=3)
    pushed = replace(mechanism.mechanism, loads=[md.Force("push", "slider.C", [-100.0, 0.0])])
    task = md.Reactions(md.Driver("crank.angle", from_=0.4, to=1.4), poses=3)
    effort = md.solve(pushed, task).efforts["crank.angle"]
    assert 100 / abs(effort) == pytest.approx(result.joints["guide"].force_per_torque, rel=1e-11)


def test_several_drivers_have_no_such_ratio() -> None:
    with pytest.raises(md.UnavailableError, match="'velocity-ratio' needs a single driver"):
        measured("five-bar-robot", "velocity-ratio", task=_sweep_of("five-bar-robot"))


def test_the_table_shows_them() -> None:
    text = measured("four-bar-crank-rocker", *BOTH, poses=3).table(width=200)
    assert "rocker velocity ratio" in text
    assert "rocker mechanical advantage" in text
    dead = driven(md.slider_crank(crank=0.04, rod=0.12), "crank.angle", *BOTH, poses=3)
    assert " inf" in dead.table()


def _with_ratio(result) -> set[str]:
    return {name for name, series in result.bodies.items() if "velocity_ratio" in series}


def _sweep_of(name: str) -> str:
    tasks = md.load(name).tasks
    return next(task for task, definition in tasks.items() if definition.kind == "sweep")
