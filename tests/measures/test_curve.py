"""Lengths, areas and cusps of curves, against closed forms and independent computations."""

from __future__ import annotations

import json
from dataclasses import replace
from math import cos, hypot, pi, sin, sqrt

import numpy as np
import pytest

import mechdae as md
from mechdae.numerics.quadrature import GAUSS, KRONROD, PLACES, Substitution, integrate
from tests.reference.closed_forms import double_rocker_limits, four_bar, four_bar_double_rocker
from tests.reference.jets import derivatives
from tests.shared.measured import TURN, driven, measured, trammel
from tests.shared.paths import DATA

CUSP = json.loads((DATA / "cusp_coupler.json").read_text())


def test_the_rules_of_the_quadrature() -> None:
    """15 nodes are exact to degree 22, 7 nodes to degree 13."""
    for weights, degree in ((KRONROD, 22), (GAUSS, 13)):
        for power in range(degree + 1):
            assert weights @ PLACES**power == pytest.approx(1 / (power + 1), rel=1e-14)
    value, error = integrate(
        lambda s: np.stack([1 / np.sqrt(1 - s), np.abs(s - 0.3)], axis=1),
        [Substitution(0, 0.5), Substitution(0.5, 1, 1)],
        lambda found: found,
    )
    assert value == pytest.approx([2, (0.3**2 + 0.7**2) / 2], rel=1e-12)
    assert np.all(error < 1e-10)


LENGTHS = {
    # 34-digit quadrature of the closed form in mpmath; areas by the trapezoidal rule, twice
    "four-bar-crank-rocker": (0.247031601825117898572045711355, 0.00370052024899179613663709495249),
    "cusp-coupler": (34.7137372306569107940440784194, -4.84896869081821467584581892081),
}


@pytest.mark.parametrize("name", list(LENGTHS))
def test_length_and_area_of_a_coupler_curve(name: str) -> None:
    facts = measured(name, "curve", poses=5).summary["curve"]["coupler.P"]
    length, area = LENGTHS[name]
    assert facts["length"] == pytest.approx(length, rel=1e-14)
    assert facts["closed"]
    assert facts["area"] == pytest.approx(area, rel=1e-13)
    assert abs(facts["length"] - length) <= facts["error"] <= 1e-10 * length


def test_length_of_a_coupler_curve_in_80_bits() -> None:
    """The trapezoidal rule over a turn converges faster than any power of its step."""
    u = np.arange(256, dtype=np.longdouble) * (np.arctan(np.longdouble(1)) / 32)
    sizes = [np.longdouble(text) for text in ("0.04", "0.12", "0.08", "0.1")]
    rate = derivatives(four_bar, u, 1, **dict(zip("abcd", sizes, strict=True)), px=0.06, py=0.04)
    length = np.abs(rate[1]["coupler.P"]).mean() * 8 * np.arctan(np.longdouble(1))
    assert float(length) == pytest.approx(LENGTHS["four-bar-crank-rocker"][0], rel=1e-15)


def test_an_ellipse_drawn_by_a_trammel() -> None:
    """Semi-axes 0.2 and 0.1: perimeter by the arithmetic-geometric mean, curvature, tangent."""
    result = driven(trammel(), "bar.angle", "curve", poses=9, from_=0.3, to=0.3 + TURN)
    facts = result.summary["curve"]["bar.P"]
    m, n = 0.2, 0.1
    x, y, s, power = m, n, m * m, 0.5
    while abs(x - y) > 1e-17:
        s -= power * (x * x - y * y)
        x, y, power = (x + y) / 2, sqrt(x * y), 2 * power
    assert facts["length"] == pytest.approx(TURN * s / x, rel=1e-14)
    assert facts["area"] == pytest.approx(-pi * m * n, rel=1e-14)
    assert not facts["cusps"]
    u = result.drivers["bar.angle"].position
    series = result.points["bar.P"]
    bend = -m * n / (m**2 * np.sin(u) ** 2 + n**2 * np.cos(u) ** 2) ** 1.5
    assert series.curvature == pytest.approx(bend, rel=1e-12)
    along = np.stack([m * np.sin(u), n * np.cos(u)], axis=1)  # P = (-m cos u, n sin u)
    expected = np.arctan2(along[:, 1], along[:, 0])
    assert series.tangent == pytest.approx(expected, abs=1e-13)


def test_lengths_of_arcs_up_to_limit_positions() -> None:
    """The end of a link runs over its swing; its speed is infinite at both limits."""
    result = measured("four-bar-double-rocker", "curve", task="window", poses=3)
    end = double_rocker_limits()[1]
    at = four_bar_double_rocker(np.array([-end, end, 0.3897607327974747]) * (1 - 1e-16))["right"]
    d, c, a = 0.12, 0.06, 0.08
    ends = [pi - np.arctan2(s * a * sin(end), d - a * cos(end)) for s in (-1, 1)]
    turned = sum(angle - at[2] for angle in ends)
    facts = result.summary["curve"]["right.C"]
    assert facts["length"] == pytest.approx(c * turned, rel=1e-12)
    assert not facts["closed"]
    assert "area" not in facts
    assert [round(entry["at"], 12) for entry in facts["reversals"]] == [0.389760732797]
    driver = result.summary["curve"]["left.B"]
    assert driver["length"] == pytest.approx(0.08 * 2 * end, rel=1e-14)


def test_cusps_of_a_hypocycloid() -> None:
    """A point of the planet's pitch circle touches the ring: a cusp where it stops, no reversal."""
    result = measured("planetary-gear-train", "curve", poses=3)
    facts = result.summary["curve"]["planet.T"]
    radius = hypot(*facts["cusps"][0]["position"])
    assert len(facts["cusps"]) == 4
    assert not facts["reversals"]
    for cusp in facts["cusps"]:
        assert hypot(*cusp["position"]) == pytest.approx(radius, rel=1e-14)
    assert {e["kind"] for e in result.events} == {"cusp"}


def test_points_that_turn_back_have_no_cusps() -> None:
    result = measured("slider-crank", "curve", poses=5)
    facts = result.summary["curve"]["slider.C"]
    assert facts["length"] == pytest.approx(0.4, rel=1e-14)
    assert facts["cusps"] == []
    assert [entry["at"] for entry in facts["reversals"]] == pytest.approx([0, pi, TURN], abs=1e-14)
    assert np.isnan(result.points["slider.C"].tangent[[0, 2, 4]]).all()
    assert result.events == ()


def cusp_file(scale: float = 1.0, shift: float = 0.0, **changes) -> md.Result:
    problem = md.load("cusp-coupler")
    px, py = (float(text) for text in CUSP["coupler_point_local"])
    sizes = {name: float(CUSP["params"][name]) * scale for name in "abcd"}
    values = {**sizes, "px": (px + shift) * scale, "py": py * scale}
    problem = problem.with_values(values)
    return md.solve(problem, replace(problem.tasks["cusp"], outputs=("coupler.P",), **changes))


@pytest.mark.parametrize("scale", [1.0, 1e-6, 1e3])
def test_every_row_of_the_cusp(scale: float) -> None:
    result = cusp_file(scale)
    rows = CUSP["rows"]
    point = result.points["coupler.P"]
    wanted = np.array([[float(row["x"]), float(row["y"])] for row in rows])
    speeds = np.array([[float(row["vx"]), float(row["vy"])] for row in rows])
    assert np.abs(point.position / scale - wanted).max() < 2e-14
    assert np.abs(point.velocity / scale - speeds).max() < 1e-14
    bend = [float(x) for x in CUSP["second_derivative_at_cusp"]]
    assert point.acceleration[3] / scale == pytest.approx(bend, abs=3e-14)
    assert [k for k in range(7) if np.isnan(point.tangent[k])] == [3]
    assert [k for k in range(7) if np.isnan(point.curvature[k])] == [3]
    directions = np.arctan2(speeds[:, 1], speeds[:, 0])
    other = np.arange(7) != 3
    assert point.tangent[other] == pytest.approx(directions[other], abs=2e-9)
    (event,) = result.events
    assert event["kind"] == "cusp"
    assert event["point"] == "coupler.P"
    assert event["at"] == pytest.approx(1.0, abs=1e-14)
    place = [float(x) for x in CUSP["cusp_xy"]]
    assert np.array(event["position"]) / scale == pytest.approx(place, abs=2e-14)
    assert result.summary["curve"]["coupler.P"]["cusps"] == [
        {"at": event["at"], "position": event["position"]}
    ]
    plain = result.to_dict()["points"]["coupler.P"]
    assert plain["tangent"][3] is None
    assert plain["curvature"][3] is None


@pytest.mark.parametrize("at", [["theta"], ["theta", "theta + 1"], ["theta - 0.02"]])
def test_a_named_pose_at_the_cusp_says_so(at: list[str]) -> None:
    result = cusp_file(driver=md.Driver("crank.angle", at=at))
    there = at[0] == "theta"
    assert np.isnan(result.points["coupler.P"].tangent[0]) == there
    assert np.isnan(result.points["coupler.P"].curvature[0]) == there
    assert [event["kind"] for event in result.events] == (["cusp"] if there else [])


def test_a_point_beside_the_cusp_has_none() -> None:
    """A millionth of the crank's length away the point turns sharply, but does not stop."""
    result = cusp_file(shift=1e-6)
    assert result.events == ()
    assert np.isfinite(result.points["coupler.P"].curvature).all()
    assert result.summary["curve"]["coupler.P"]["cusps"] == []
