"""Extremes and envelopes, against closed forms and independent computations."""

from __future__ import annotations

from dataclasses import replace
from math import acos, pi

import numpy as np
import pytest

import mechdae as md
from tests.reference.closed_forms import double_rocker_limits
from tests.shared.measured import TURN, driven, measured, two_waves


def test_extremes_of_a_rocker_and_its_dead_points() -> None:
    """Crank and coupler in one line: AC = b + a and AC = b - a."""
    a, b, c, d = 0.04, 0.12, 0.08, 0.1
    result = measured("four-bar-crank-rocker", "extremes", poses=7)
    found = result.summary["extremes"]["rocker.angle"]
    for end, s in (("min", 1), ("max", -1)):
        reach = b + s * a
        rocker = pi - acos((c * c + d * d - reach**2) / (2 * c * d))
        crank = acos((reach**2 + d * d - c * c) / (2 * reach * d)) + (0 if s > 0 else pi)
        assert found[end]["value"] == pytest.approx(rocker, abs=1e-14)
        assert found[end]["at"] == pytest.approx(crank, abs=1e-13)
        event = next(e for e in result.events if e["of"] == "rocker.angle" and e["extreme"] == end)
        assert event["kind"] == "stationary"
        assert event["at"] == found[end]["at"]
    assert [e["at"] for e in result.events] == sorted(e["at"] for e in result.events)
    assert {e["of"] for e in result.events} == {"rocker.angle", "coupler.angle"}
    swing = found["max"]["value"] - found["min"]["value"]
    assert result.summary["swing"]["rocker"] == pytest.approx(swing, abs=1e-14)


@pytest.mark.parametrize("name", ["jansen-leg", "slider-crank-offset"])
def test_measures_do_not_depend_on_the_poses_nor_on_the_direction(name: str) -> None:
    names = ("extremes", "time-ratio", "dwell", "envelope", "curve", "transmission")
    sweep = replace(md.load(name).tasks["turn"], measures=names)
    chosen = {"jansen-leg": ("lower.P", "upper"), "slider-crank-offset": None}[name]
    few, many = (md.solve(name, replace(sweep, poses=poses, outputs=chosen)) for poses in (5, 700))
    words = ("extremes", "time_ratio", "dwell", "envelope", "curve", "transmission")
    for word in words:
        assert few.summary[word] == many.summary[word], word
    back = replace(sweep, poses=5, outputs=chosen, driver=replace(sweep.driver, from_=TURN, to=0.0))
    down = md.solve(name, back)
    for point, facts in few.summary["curve"].items():
        other = down.summary["curve"][point]
        assert other["length"] == pytest.approx(facts["length"], rel=1e-13)
        assert other["area"] == pytest.approx(-facts["area"], rel=1e-12, abs=1e-17)


def test_extremes_reach_around_limit_positions() -> None:
    """A sweep of a whole turn sees both arms of the arc, the driver's values are the sweep's."""
    whole = replace(md.load("four-bar-double-rocker").tasks["window"].driver, range=None)
    end = double_rocker_limits()[1]
    driver = replace(whole, from_=0.0, to=TURN)
    result = measured("four-bar-double-rocker", "extremes", task="window", driver=driver, poses=9)
    arc = measured("four-bar-double-rocker", "extremes", task="window", poses=3)
    for name in ("right.angle", "coupler.angle", "coupler.P.x"):
        for word in ("min", "max"):
            found, other = (r.summary["extremes"][name][word] for r in (result, arc))
            assert found["value"] == pytest.approx(other["value"], abs=1e-14)
            at = found["at"] if found["at"] < pi else found["at"] - TURN
            assert 0 <= found["at"] <= TURN
            assert abs(at) == pytest.approx(abs(other["at"]), abs=1e-12)
    assert end < pi


def test_what_stands_still_has_no_extremes_and_counts_in_the_box() -> None:
    result = measured("slider-crank", "extremes", "envelope", poses=3)
    r, rod = 0.1, 0.3
    assert "slider.angle" not in result.summary["extremes"]
    assert "slider.C.y" not in result.summary["extremes"]
    stroke = result.summary["extremes"]["guide.slide"]
    for word, value, at in (("max", r + rod, 0.0), ("min", rod - r, pi)):
        assert stroke[word]["value"] == pytest.approx(value, abs=stroke[word]["error"])
        assert stroke[word]["at"] == pytest.approx(at, abs=1e-14)
    box = result.summary["envelope"]
    assert box["all"] == pytest.approx([-r, r + rod, -r, r], abs=1e-15)
    assert box["bodies"]["slider"] == pytest.approx([rod - r, rod + r, 0, 0], abs=1e-15)
    dead = [e["at"] for e in result.events if e["of"] == "guide.slide"]
    assert dead == pytest.approx([0, pi, TURN], abs=1e-14)


def test_a_fast_wheel_is_seen_between_the_steps_of_the_path() -> None:
    """A planet that turns 240 times while the crank turns once: 480 dead points of its pin."""
    gear = replace(two_waves(0.01).joints["mesh"], ratio=-239)
    mechanism = replace(two_waves(0.01), joints=two_waves(0.01).joints.with_("mesh", gear))
    result = driven(mechanism, "crank.angle", "extremes", poses=3)
    u = np.linspace(0, TURN, 400_001)
    rate = -np.sin(u) - 2.4 * np.sin(240 * u)
    crossings = int(np.count_nonzero(rate[1:-2] * rate[2:-1] < 0)) + 2  # both ends are ones
    assert len([e for e in result.events if e["of"] == "guide.slide"]) == crossings
