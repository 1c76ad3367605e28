"""Time ratios, against closed forms and independent computations."""

from __future__ import annotations

from dataclasses import replace
from math import acos, asin, pi

import pytest

import mechdae as md
from tests.shared.measured import TURN, driven, measured, trammel, two_waves


def test_time_ratio_of_a_crank_rocker() -> None:
    """alpha = pi + phi2 - phi1 with the crank's directions phi at both dead points."""
    a, b, c, d = 0.04, 0.12, 0.08, 0.1
    phi1, phi2 = (acos((reach**2 + d * d - c * c) / (2 * reach * d)) for reach in (b + a, b - a))
    alpha = pi + phi2 - phi1
    result = measured("four-bar-crank-rocker", "time-ratio", poses=3)
    assert result.summary["time_ratio"]["rocker"] == pytest.approx(
        max(alpha, TURN - alpha) / min(alpha, TURN - alpha), rel=1e-13
    )
    assert result.summary["return_angle"]["rocker"] == pytest.approx(min(alpha, TURN - alpha))


def test_time_ratio_of_slider_cranks_and_quick_returns() -> None:
    r, rod, e = 0.04, 0.12, -0.02
    out, back = asin(e / (rod + r)), pi + asin(e / (rod - r))
    alpha = back - out
    result = measured("slider-crank-offset", "time-ratio", poses=3)
    ratio = max(alpha, TURN - alpha) / min(alpha, TURN - alpha)
    assert result.summary["time_ratio"]["guide"] == pytest.approx(ratio, rel=1e-13)
    assert measured("slider-crank", "time-ratio").summary["time_ratio"]["guide"] == pytest.approx(1)
    result = measured("whitworth-quick-return", "time-ratio", poses=3)
    assert result.summary["time_ratio"]["guide"] == pytest.approx(2, rel=1e-13)
    assert result.summary["return_angle"]["guide"] == pytest.approx(TURN / 3, rel=1e-13)
    assert "turns fully" in result.summary["no_time_ratio"]["link"]


def test_no_time_ratio_comes_with_the_reason() -> None:
    result = measured("four-bar-double-rocker", "time-ratio", task="window", poses=3)
    assert "limit position" in result.summary["no_time_ratio"]["right"]
    result = measured("geared-five-bar", "time-ratio", task="turns", poses=3)
    assert "not back after one turn" in result.summary["no_time_ratio"]["rocker"]
    result = driven(two_waves(0.6), "crank.angle", "time-ratio", poses=3)
    assert "3 maxima and 3 minima" in result.summary["no_time_ratio"]["guide"]
    result = driven(trammel(), "gx.slide", "time-ratio", poses=3, from_=-0.1, to=0.1)
    assert "does not turn" in result.summary["no_time_ratio"]["gy"]


def test_a_time_ratio_looks_at_a_whole_turn_wherever_the_sweep_ends() -> None:
    problem = md.load("whitworth-quick-return")
    driver = replace(problem.tasks["turn"].driver, from_=0.2, to=0.7)
    result = measured("whitworth-quick-return", "time-ratio", driver=driver, poses=3)
    assert result.summary["time_ratio"]["guide"] == pytest.approx(2, rel=1e-13)
