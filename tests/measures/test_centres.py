"""Instant centres and centrodes, against closed forms and independent computations."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

import mechdae as md
from mechdae.tasks.export import csv_text
from tests.shared.measured import driven, measured, trammel


def test_centrodes_of_a_trammel_are_cardans_circles() -> None:
    """The moving circle over the bar rolls inside a fixed one of twice its size."""
    bar = 0.3
    result = driven(trammel(bar), "bar.angle", "centrodes", poses=25, from_=0.1, to=6.0)
    series = result.bodies["bar"]
    assert np.hypot(*series.centrode_fixed.T) == pytest.approx(np.full(25, bar), rel=1e-14)
    from_middle = series.centrode_moving - [bar / 2, 0]
    assert np.hypot(*from_middle.T) == pytest.approx(np.full(25, bar / 2), rel=1e-13)
    u = result.drivers["bar.angle"].position
    expected = np.stack([-bar * np.cos(u), bar * np.sin(u)], axis=1)
    assert series.centrode_fixed == pytest.approx(expected, abs=1e-14)
    assert result.summary["centrodes"] == {"never_turn": ["sx", "sy"]}
    assert "centrode_fixed" not in result.bodies["sx"]


def test_the_instant_centre_goes_to_infinity_where_a_body_stops_turning() -> None:
    result = measured("slider-crank", "centrodes", poses=5)
    rod = result.bodies["rod"]
    assert [k for k in range(5) if np.isnan(rod.centrode_fixed[k]).any()] == [1, 3]
    assert result.summary["centrodes"]["at_infinity"]["rod"] == pytest.approx([pi / 2, 3 * pi / 2])
    assert rod.centrode_fixed[0] == pytest.approx([0.4, 0.0], abs=1e-15)  # the slider at rest
    assert np.array_equal(result.bodies["crank"].centrode_fixed, np.zeros((5, 2)))
    assert result.to_dict()["bodies"]["rod"]["centrode_moving"][1] == [None, None]


def test_a_link_on_a_fixed_pin_keeps_its_centre_at_rest() -> None:
    """At its dead points the rocker has no angular velocity, its centre is the pin still."""
    problem = md.load("four-bar-crank-rocker")
    dead = measured("four-bar-crank-rocker", "extremes", poses=3).summary["extremes"]
    at = [dead["rocker.angle"][end]["at"] for end in ("min", "max")]
    sweep = md.Sweep(md.Driver("crank.angle", at=at), measures=["centrodes"])
    rocker = md.solve(problem, sweep).bodies["rocker"]
    assert rocker.centrode_fixed == pytest.approx(np.array([[0.1, 0.0]] * 2), abs=1e-16)
    assert rocker.centrode_moving == pytest.approx(np.zeros((2, 2)), abs=1e-16)


def test_instant_centres_of_a_four_bar() -> None:
    """Kennedy: three centres in one line; the crank's and the rocker's divides AD as 1 / i."""
    result = measured("four-bar-crank-rocker", "instant-centres", poses=24)
    centres = result.centres
    assert len(centres) == 6
    for one, two, three in (
        ("ground-crank", "ground-rocker", "crank-rocker"),
        ("crank-coupler", "coupler-rocker", "crank-rocker"),
        ("ground-crank", "crank-coupler", "ground-coupler"),
        ("ground-rocker", "coupler-rocker", "ground-coupler"),
    ):
        a, b, c = (centres[name] for name in (one, two, three))
        u, v = b - a, c - a
        across = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
        assert np.nanmax(np.abs(across) / (np.hypot(*u.T) * (np.hypot(*v.T) + 0.1))) < 1e-13
    ratio = result.bodies["rocker"].angular_velocity / result.bodies["crank"].angular_velocity
    pole = centres["crank-rocker"]
    assert pole[:, 0] * 1 == pytest.approx((pole[:, 0] - 0.1) * ratio, rel=1e-11)
    assert np.array_equal(centres["crank-coupler"], result.points["crank.B"].position)
    head = csv_text(result).split("\n")[0]
    assert "centre.crank-rocker.x [m]" in head


def test_pairs_without_a_centre_are_named() -> None:
    result = measured("slider-crank", "instant-centres", poses=5)
    assert result.summary["centres_at_infinity"] == ["ground-slider"]
    assert "ground-slider" not in result.centres
    assert result.to_dict()["centres"]["ground-rod"][1] == [None, None]
    assert result.value("centres/crank-rod")[0] == pytest.approx([0.1, 0.0])
