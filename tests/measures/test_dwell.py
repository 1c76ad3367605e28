"""Dwells, against closed forms and independent computations."""

from __future__ import annotations

from math import acos, cos, pi, sin, sqrt

import numpy as np
import pytest

import mechdae as md
from tests.shared.measured import TURN, driven, measured, trammel, two_waves


def test_dwells_of_a_slider_crank_and_a_yoke() -> None:
    """Ends of the stroke: the triangle r, rod, x at the edge of the band of 2 % of the stroke."""
    r, rod = 0.1, 0.3
    result = measured("slider-crank", "dwell", poses=3)
    dwells = result.summary["dwell"]["guide"]
    edges = (rod + r - 0.02 * 2 * r, rod - r + 0.02 * 2 * r)
    widths = [acos((r * r + x * x - rod * rod) / (2 * r * x)) for x in edges]
    assert len(dwells) == 2
    assert [dwells[0][end] for end in ("from", "to")] == pytest.approx(
        [-widths[0], widths[0]], abs=1e-12
    )
    assert [dwells[1][end] for end in ("from", "to")] == pytest.approx(
        [widths[1], TURN - widths[1]], abs=1e-12
    )
    assert dwells[0]["mean"] == pytest.approx(rod + r - 0.01 * 2 * r, abs=1e-15)
    assert dwells[0]["within"] == pytest.approx(0.01 * 2 * r, abs=1e-15)
    result = measured("scotch-yoke", "dwell", dwell_tolerance="0.1/2", poses=3)
    first = result.summary["dwell"]["guide"][0]
    assert (first["from"], first["to"]) == pytest.approx((-acos(0.8), acos(0.8)), abs=1e-12)


@pytest.mark.parametrize("share", [0, -0.1, 0.5, 2.0])
def test_bands_of_dwells_that_are_none(share: float) -> None:
    with pytest.raises(md.InputError, match=r"dwell_tolerance: a share .* between 0 and 0\.5"):
        measured("slider-crank", "dwell", dwell_tolerance=share, poses=3)


def test_a_dwell_with_a_ripple_is_one_dwell() -> None:
    """cos u - b cos 3u with b above 1/9: two maxima and a minimum within the band."""
    b, tolerance = 0.13, 0.01
    result = driven(two_waves(-b), "crank.angle", "dwell", poses=3)
    dwells = result.summary["dwell"]["guide"]
    assert len(dwells) == 2
    x = sqrt((1 + 3 * b) / (12 * b))  # cosine at the maxima of (1 + 3 b) x - 4 b x^3
    top = (1 + 3 * b) * x - 4 * b * x**3
    level = top - 4 * tolerance * top
    roots = np.roots([-4 * b, 0, 1 + 3 * b, -level])
    edge = acos(min(root.real for root in roots if abs(root.imag) < 1e-12 and root.real > 0))
    assert (dwells[0]["from"], dwells[0]["to"]) == pytest.approx((-edge, edge), abs=1e-9)
    assert dwells[0]["mean"] == pytest.approx(top * (1 - 2 * tolerance), abs=1e-13)


def test_a_dwell_on_the_way_lies_where_it_is_longest() -> None:
    """cos u + b cos 3u with b just above 1/3: a ripple half way, the band around zero."""
    b = 0.345
    result = driven(two_waves(b), "crank.angle", "dwell", poses=3)
    dwells = result.summary["dwell"]["guide"]
    half = 0.01 * 2 * (1 + b)
    way = next(entry for entry in dwells if abs(entry["mean"]) < 1e-9)
    u = way["from"]
    assert (way["from"] + way["to"]) / 2 == pytest.approx(pi / 2, abs=1e-9)
    assert cos(u) + b * cos(3 * u) == pytest.approx(half, abs=1e-9)
    assert way["within"] == pytest.approx(half, abs=1e-14)


def test_a_dwell_is_cut_where_the_motion_ends() -> None:
    """A slide driven over an interval: the band is not left before the end of the sweep."""
    result = driven(trammel(), "gx.slide", "dwell", poses=3, from_=-0.01, to=0.1)
    (entry,) = result.summary["dwell"]["gy"]
    assert entry["cut"]
    assert entry["from"] == -0.01
    height = sqrt(0.3**2 - entry["to"] ** 2)
    swing = 0.3 - sqrt(0.3**2 - 0.1**2)
    assert height == pytest.approx(0.3 - 0.02 * swing, abs=1e-13)


def cycloidal(start: float, end: float) -> str:
    """A rise from 0 to 1 over an interval of s, at rest before and behind."""
    share = f"min(max((s - {start!r})/{end - start!r}, 0), 1)"
    return f"({share} - sin(2*pi*{share})/(2*pi))"


def share_of_rise(height: float) -> float:
    """Share of a cycloidal rise at which it has risen by a share `height`, by bisection."""
    low, high = 0.0, 0.5
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if middle - sin(TURN * middle) / TURN < height else (low, middle)
    return low


def cam(lift: str) -> md.Mechanism:
    """A knife edge on a line through the centre of a cam of radius 40 mm + 10 mm `lift`(s)."""
    radius = f"(0.04 + 0.01*({lift}))"
    return md.Mechanism(
        ground=md.Ground(points={"O": [0, 0]}),
        bodies=[md.Body("cam", points={"O": [0, 0]}), md.Body("edge", points={"F": [0, 0]})],
        joints=[
            md.Revolute("O", "ground.O", "cam.O"),
            md.Prismatic("guide", "ground.O", "edge.F"),
            md.Curve(
                "profile",
                "cam.O",
                "edge.F",
                x=f"{radius}*cos(s)",
                y=f"{radius}*sin(s)",
                closed=True,
            ),
        ],
        sketch={"cam": -0.5, "guide": 0.0405},
    )


def test_dwells_of_a_cam_that_rests() -> None:
    """Rise over 120 degrees, rest over 60, fall over 120, rest over 60; s = -u.

    Bands begin where a cycloid has risen by 2 %.
    """
    third, sixth = TURN / 3, TURN / 6
    mechanism = cam(f"{cycloidal(0, third)} - {cycloidal(pi, pi + third)}")
    result = driven(mechanism, "cam.angle", "dwell", "extremes", "time-ratio", poses=5)
    edge = share_of_rise(0.02) * third
    ends = [(-edge, sixth + edge, 0.0401), (pi - edge, pi + sixth + edge, 0.0499)]
    found = result.summary["dwell"]["guide"]
    assert len(found) == 2
    for entry, (first, last, mean) in zip(found, ends, strict=True):
        assert (entry["from"], entry["to"]) == pytest.approx((first, last), abs=1e-8)
        assert entry["mean"] == pytest.approx(mean, abs=1e-12)
        assert "cut" not in entry
    low, high = (e for e in result.events if e["kind"] == "stationary")
    assert (low["extreme"], high["extreme"]) == ("min", "max")
    assert (low["value"], high["value"]) == pytest.approx((0.04, 0.05), abs=1e-15)
    assert (low["at"], high["at"]) == pytest.approx((pi / 6, pi + pi / 6), abs=1e-6)
    assert low["rest"] == pytest.approx((0, sixth), abs=2e-3)  # leaves with the third power
    assert high["rest"] == pytest.approx((pi, pi + sixth), abs=2e-3)
    extremes = result.summary["extremes"]["guide.slide"]
    assert [extremes[end]["value"] for end in ("min", "max")] == pytest.approx((0.04, 0.05))
    assert result.summary["no_time_ratio"]["guide"].startswith("it rests")


def test_a_rest_on_the_way_is_a_dwell_and_no_extreme() -> None:
    """Two rises by half the lift with a rest between: the band lies around the rest."""
    sixth = TURN / 6
    lift = "/2 + ".join(cycloidal(k * sixth, (k + 1) * sixth) for k in (0, 2))
    mechanism = cam(f"{lift}/2 - {cycloidal(pi, 5 * sixth)}")
    result = driven(mechanism, "cam.angle", "dwell", "extremes", poses=3)
    edge = share_of_rise(0.02) * sixth  # 1 % of all is 2 % of one of the rises
    way = next(e for e in result.summary["dwell"]["guide"] if abs(e["mean"] - 0.045) < 1e-6)
    assert way["mean"] == pytest.approx(0.045, abs=1e-9)
    assert (way["from"], way["to"]) == pytest.approx(
        (TURN - 2 * sixth - edge, TURN - sixth + edge), abs=1e-5
    )
    values = [e["value"] for e in result.events if e["kind"] == "stationary"]
    assert sorted(values) == pytest.approx([0.04, 0.05])


def parallelogram(task: str, *measures: str) -> md.Result:
    """Crank and rocker of 1, frame and coupler of 2: change points at 0 and 180 degrees."""
    mechanism = md.Mechanism(
        ground=md.Ground(points={"A": [0, 0], "D": [2, 0]}),
        bodies=[
            md.Body("crank", points={"A": [0, 0], "B": [1, 0]}),
            md.Body("coupler", points={"B": [0, 0], "C": [2, 0]}),
            md.Body("rocker", points={"D": [0, 0], "C": [1, 0]}),
        ],
        joints=[
            md.Revolute("A", "ground.A", "crank.A"),
            md.Revolute("B", "crank.B", "coupler.B"),
            md.Revolute("C", "coupler.C", "rocker.C"),
            md.Revolute("D", "ground.D", "rocker.D"),
        ],
        sketch={"crank": 1.0, "coupler": 0.0, "rocker": 1.0},
    )
    driver = md.Driver("crank.angle", from_=0.5, to=0.5 + TURN)
    return md.solve(mechanism, md.Sweep(driver, poses=13, on_change_point=task, measures=measures))


def test_measures_reach_the_change_point_at_which_a_motion_stops() -> None:
    result = parallelogram("stop", "extremes", "curve")
    for name in ("rocker.angle", "rocker.C.y"):
        extremes = result.summary["extremes"][name]
        ends = (0.0, 1.0) if name == "rocker.C.y" else (0.5, pi)
        assert [extremes[end]["value"] for end in ("min", "max")] == pytest.approx(ends, abs=1e-12)
    assert result.summary["curve"]["rocker.C"]["length"] == pytest.approx(pi - 0.5, abs=1e-11)


def test_what_rests_before_a_change_point_has_no_stationary_positions() -> None:
    """Behind it the antiparallelogram, whose rocker turns back with corners at 180 and 360 degrees.

    Its coupler is furthest where crank e and rocker -e are parallel: 2 x = 2 e + 2 c for the
    coupler's direction c gives |x - c| = 1, c at 60 and e at 300 degrees.
    """
    result = parallelogram("switch", "extremes", "dwell", "time-ratio", "centrodes")
    found = [(e["of"], e["extreme"]) for e in result.events if e["kind"] == "stationary"]
    assert found == [("rocker.angle", "max"), ("coupler.angle", "max"), ("rocker.angle", "min")]
    at = [e["at"] for e in result.events if e["kind"] == "stationary"]
    assert at == pytest.approx([pi, 5 * pi / 3, TURN], abs=1e-9)
    assert result.summary["swing"]["coupler"] == pytest.approx(pi / 3, abs=1e-12)
    assert result.summary["time_ratio"]["rocker"] == pytest.approx(1, abs=1e-9)
    assert not any("cut" in e for e in result.summary["dwell"]["rocker"])
    assert len(result.summary["centrodes"]["at_infinity"]["coupler"]) == 5
