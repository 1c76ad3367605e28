"""Whole curves of predefined mechanisms against their closed forms, pose by pose."""

from __future__ import annotations

import math

import numpy as np
import pytest

import mechdae as md


def test_hoeken_deviation_from_the_line() -> None:
    """Over half a turn P stays between y = 4 a and y = 21/8 sqrt(7/3) a."""
    problem = md.load("hoeken-straight-line")
    a = problem.mechanism.values()["a"]
    driver = md.Driver("crank.angle", from_=math.pi / 2, to=3 * math.pi / 2)
    result = md.solve(problem.mechanism, md.Sweep(driver, poses=2001))
    x, y = result.points["coupler.P"].position.T / a
    far = 21 / 8 * math.sqrt(7 / 3)
    assert y.min() == pytest.approx(4, abs=4e-15)
    # the grid misses the flat top by less than half a step: y'' = 0.071 there
    assert far - 0.071 * (math.pi / 2000) ** 2 / 8 < y.max() < far + 4e-15
    assert (x[0], x[1000], x[-1]) == pytest.approx((4, 2, 0), abs=4e-15)
    assert np.all(np.diff(x) < 0)


def test_every_point_of_the_trammel_draws_an_ellipse() -> None:
    result = md.solve("elliptic-trammel", "turn")
    for point, along in (("M", 0.05), ("P", 0.16)):
        x, y = result.points[f"bar.{point}"].position.T
        round_ = (x / along) ** 2 + (y / (along - 0.10)) ** 2
        assert round_ == pytest.approx(np.ones(361), abs=4e-15)


def test_the_pen_of_the_pantograph_copies_the_pin() -> None:
    result = md.solve("pantograph", "circle")
    P, Q = result.points["link.P"], result.points["bar.Q"]
    for order, size in (("position", 0.5), ("velocity", 0.1), ("acceleration", 0.1)):
        assert np.abs(Q[order] - 3 * P[order]).max() < 1e-14 * size * 4
    x, y = P.position.T
    assert np.hypot(x - 0.11, y - 0.02) == pytest.approx([0.03] * 49, rel=1e-14)


def test_the_table_moves_twice_as_far_as_the_carriage() -> None:
    result = md.solve("rack-and-pinion", "turn")
    carriage, table = result.joints["guide"], result.joints["slide"]
    assert table.slide == pytest.approx(2 * carriage.slide - 0.19, rel=1e-14, abs=1e-16)
    assert table.slide_velocity == pytest.approx(2 * carriage.slide_velocity, rel=1e-13, abs=1e-15)
    rolled = (0.19 - carriage.slide) / 0.03
    assert result.bodies["pinion"].angle == pytest.approx(rolled, rel=1e-14, abs=1e-14)


def test_the_klann_leg_takes_the_stride_of_its_patent() -> None:
    """The table of the patent gives the foot at (0, 0) and (1.000, 0), to three decimals."""
    result = md.solve("klann-leg", "turn", poses=361)
    foot = result.points["leg.P"].position
    assert foot[180] == pytest.approx([0, 0], abs=1e-15)
    assert foot[0] == pytest.approx([1, 0], abs=5e-4)
    on_ground, lifted = foot[:181, 1], foot[181:360, 1]
    assert np.ptp(on_ground) < 0.06 < lifted.max() < 0.55
    assert np.all(np.diff(foot[30:150, 0]) < 0)
