"""What is read off a sweep, against closed forms and independent quadrature."""

from __future__ import annotations

import json
from dataclasses import replace
from math import acos, asin, cos, hypot, pi, sin, sqrt

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.schema import schema
from mechdae.describe.tasks.kinds import MEASURES
from mechdae.export import csv_text
from mechdae.kinematics.prepared import prepare
from mechdae.numerics.quadrature import GAUSS, KRONROD, PLACES, Substitution, integrate
from mechdae.tables import table
from tests.reference.closed_forms import double_rocker_limits, four_bar, four_bar_double_rocker
from tests.reference.jets import derivatives
from tests.shared.paths import DATA

TURN = 2 * pi
CUSP = json.loads((DATA / "cusp_coupler.json").read_text())


def measured(name: str, *measures: str, task: str = "turn", **changes):
    problem = md.load(name)
    sweep = replace(problem.tasks[task], measures=measures, **changes)
    return md.solve(problem, sweep)


def driven(mechanism: md.Mechanism, coordinate: str, *measures: str, poses=13, **ends):
    ends = ends or {"from_": 0.0, "to": TURN}
    driver = md.Driver(coordinate, **ends)
    return md.solve(mechanism, md.Sweep(driver, poses=poses, measures=measures))


def trammel(length: float = 0.3) -> md.Mechanism:
    """A bar whose ends slide on two lines at right angles (elliptic trammel)."""
    return md.Mechanism(
        ground=md.Ground(points={"O": [0, 0]}),
        bodies=[
            md.Body("bar", points={"X": [0, 0], "Y": [length, 0], "P": [length / 3, 0]}),
            md.Body("sx", points={"X": [0, 0]}),
            md.Body("sy", points={"Y": [0, 0]}),
        ],
        joints=[
            md.Revolute("X", "bar.X", "sx.X"),
            md.Revolute("Y", "bar.Y", "sy.Y"),
            md.Prismatic("gx", "ground.O", "sx.X"),
            md.Prismatic("gy", "ground.O", "sy.Y", axis=pi / 2),
        ],
        sketch={"bar": 2.0},
    )


def two_waves(third: float) -> md.Mechanism:
    """A slider at cos(u) + third cos(3 u): a planet's pin moves a yoke."""
    return md.Mechanism(
        ground=md.Ground(points={"O": [0, 0]}),
        bodies=[
            md.Body("crank", points={"O": [0, 0], "A": [1, 0]}),
            md.Body("planet", points={"A": [0, 0], "Q": [third, 0]}),
            md.Body("yoke", points={"S": [0, 0]}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("A", "crank.A", "planet.A"),
            md.Gear("mesh", "planet.A", "ground.O", carrier="crank", ratio=-2),
            md.Prismatic("guide", "ground.O", "yoke.S"),
            md.PinInSlot("slot", "yoke.S", "planet.Q", axis=pi / 2),
        ],
        sketch={"crank": 0.5, "planet": 1.5},
    )


# -- transmission angles ---------------------------------------------------------------------------


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


# -- extremes, envelope ----------------------------------------------------------------------------


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


# -- time ratio ------------------------------------------------------------------------------------


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


# -- dwells ----------------------------------------------------------------------------------------


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


# -- curves ----------------------------------------------------------------------------------------


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


# -- the cusp of a coupler curve -------------------------------------------------------------------


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


# -- centres ---------------------------------------------------------------------------------------


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


# -- what is computed ------------------------------------------------------------------------------


def test_nothing_is_computed_unless_asked_for() -> None:
    problem = md.load("four-bar-crank-rocker")
    plain = md.solve(problem, "turn", poses=3)
    words = {"transmission", "extremes", "time_ratio", "dwell", "envelope", "curve", "centrodes"}
    assert not words & set(plain.summary)
    assert "centres" not in plain.to_dict()
    bare = prepare(problem, problem.tasks["turn"])
    asked = prepare(problem, replace(problem.tasks["turn"], measures=["transmission"]))
    assert bare.graphs.ny == sum(len(entry.columns) for entry in bare.outputs.entries)
    assert not any(entry.kind == "hidden" for entry in bare.outputs.entries)
    assert asked.graphs.ny == bare.graphs.ny + 2 + 3  # two lines, three turns
    assert (bare.graphs.derivatives, asked.graphs.derivatives) == (2, 2)
    curve = prepare(problem, replace(problem.tasks["turn"], measures=["curve"]))
    assert curve.graphs.derivatives == 3


def test_measures_bring_their_own_rates() -> None:
    """A sweep without velocities still has extremes and curvatures, and reports no rates."""
    result = measured("four-bar-crank-rocker", *MEASURES, derivatives=0, poses=9)
    whole = measured("four-bar-crank-rocker", *MEASURES, poses=9)
    assert list(result.points["coupler.P"]) == ["position", "tangent", "curvature"]
    assert list(result.bodies["rocker"]) == ["angle", "centrode_fixed", "centrode_moving"]
    assert list(result.drivers["crank.angle"]) == ["position"]
    for word in ("extremes", "time_ratio", "dwell", "envelope", "curve", "transmission"):
        assert result.summary[word] == whole.summary[word]


def test_poses_that_are_not_reached_have_no_measures() -> None:
    driver = md.Driver("left.angle", at=[0.2, 2.5])
    problem = md.load("four-bar-double-rocker")
    result = md.solve(problem, md.Sweep(driver, measures=MEASURES))
    assert list(result.status) == ["ok", "unassembled"]
    for array in (
        result.joints["C"].transmission_angle,
        result.points["coupler.P"].curvature,
        result.bodies["coupler"].centrode_fixed[:, 0],
        result.centres["left-right"][:, 0],
    ):
        assert np.isfinite(array[0])
        assert np.isnan(array[1])


def test_one_pose_has_no_range() -> None:
    driver = md.Driver("crank.angle", at=[0.4])
    result = md.solve("four-bar-crank-rocker", md.Sweep(driver, measures=MEASURES))
    assert "single value of the driver" in result.summary["notes"][0]
    assert "extremes" not in result.summary
    assert np.isfinite(result.joints["C"].transmission_angle[0])


def test_several_drivers_have_the_measures_of_single_poses() -> None:
    """A two-link arm, both angles driven: the tip's path and the fore-arm's centre."""
    mechanism = md.Mechanism(
        ground=md.Ground(points={"O": [0, 0]}),
        bodies=[
            md.Body("arm", points={"O": [0, 0], "E": [1, 0]}),
            md.Body("fore", points={"E": [0, 0], "T": [1, 0]}),
        ],
        joints=[md.Revolute("O", "ground.O", "arm.O"), md.Revolute("E", "arm.E", "fore.E")],
    )
    drivers = [
        md.Driver("arm.angle", from_=0, to=1, speed=1),
        md.Driver("E.angle", from_=0.5, to=2.5, speed=2),
    ]
    sweep = md.Sweep(drivers=drivers, poses=3, measures=["centrodes", "curve"])
    result = md.solve(mechanism, sweep)
    # omega of the fore-arm is 3: its centre is two thirds of the way from E back to O
    u = result.drivers["arm.angle"].position
    pole = np.stack([np.cos(u), np.sin(u)], axis=1) * (2 / 3)
    assert result.bodies["fore"].centrode_fixed == pytest.approx(pole, abs=1e-15)
    v = result.points["fore.T"].velocity
    assert result.points["fore.T"].tangent == pytest.approx(np.arctan2(v[:, 1], v[:, 0]))
    with pytest.raises(md.UnavailableError, match="'dwell' needs a single driver"):
        md.solve(mechanism, replace(sweep, measures=["dwell"]))


def test_unknown_measures_are_answered_with_the_nearest() -> None:
    driver = md.Driver("crank.angle", at=[0.0])
    with pytest.raises(md.UnknownName, match="'centrode'") as caught:
        md.Sweep(driver, measures=["centrode"])
    assert "centrodes" in str(caught.value)
    assert "measures" in str(caught.value)
    entry = next(
        task
        for task in schema()["properties"]["tasks"]["additionalProperties"]["oneOf"]
        if task["properties"]["kind"]["const"] == "sweep"
    )
    assert entry["properties"]["measures"]["items"]["enum"] == list(MEASURES)


def test_lines_for_the_terminal() -> None:
    text = table(measured("slider-crank", *MEASURES, poses=3))
    for line in (
        "  transmission angle C: least 70.5287794 deg at 90 deg, greatest 90 deg at 0 deg",
        "  extremes  guide.slide: 0.2 m at 180 deg .. 0.4 m at 0 deg",
        "  time ratio guide: 1 (return in 180 deg)",
        "  envelope  x -0.1 .. 0.4 m, y -0.1 .. 0.1 m",
        "  curve     slider.C: length 0.4 m, closed, area 0 m2",
        "  centre    rod: at infinity at 90 deg, 270 deg",
        "  stationary 180 deg: guide.slide min 0.2 m",
    ):
        assert line in text, line
    edge = np.degrees(acos((0.1**2 + 0.396**2 - 0.3**2) / (2 * 0.1 * 0.396)))
    assert f"dwell     guide: {-edge:.6g} deg .. {edge:.6g} deg at 0.398 m +- 0.002 m" in text


def loose_four_bar(a: float, b: float, c: float, d: float, crank: float, sign: int):
    parts = four_bar(np.array([crank]), a, b, c, d, 0.3, 0.4, sign)
    return md.Mechanism(
        ground=md.Ground(points={"A": [0, 0], "D": [d, 0]}),
        bodies=[
            md.Body("crank", points={"A": [0, 0], "B": [a, 0]}),
            md.Body("coupler", points={"B": [0, 0], "C": [b, 0], "P": [0.3, 0.4]}),
            md.Body("rocker", points={"D": [0, 0], "C": [c, 0]}),
        ],
        joints=[
            md.Revolute("A", "ground.A", "crank.A"),
            md.Revolute("B", "crank.B", "coupler.B"),
            md.Revolute("C", "coupler.C", "rocker.C"),
            md.Revolute("D", "ground.D", "rocker.D"),
        ],
        sketch={name: float(parts[name][0]) for name in ("crank", "coupler", "rocker")},
    )


@pytest.mark.parametrize(
    ("sizes", "crank", "sign"),
    [
        (
            (0.224072382971274, 1.1197442375383306, 0.20155958866287726, 0.8543731552197638),
            2.04,
            -1,
        ),
        (
            (0.26558553775542726, 0.2558903343759978, 0.8889523243235484, 0.8203268186736603),
            3.5,
            -1,
        ),
    ],
)
def test_limit_positions_cost_no_more_than_they_should(sizes, crank: float, sign: int) -> None:
    """Speeds grow without bound towards limits; neither samples nor zeros may run after them."""
    mechanism = loose_four_bar(*sizes, crank, sign)
    driver = md.Driver("crank.angle", range="assembled")
    plain = md.solve(mechanism, md.Sweep(driver, poses=201))
    result = md.solve(mechanism, md.Sweep(driver, poses=5, measures=MEASURES))
    assert "notes" not in result.summary
    assert result.summary["work"]["pose_evaluations"] < 30_000
    assert result.summary["transmission"]["C"]["min"] == pytest.approx(0, abs=1e-14)
    for name, series in plain.bodies.items():
        found = result.summary["extremes"][f"{name}.angle"]
        assert found["min"]["value"] <= series.angle.min() + 1e-14
        assert found["max"]["value"] >= series.angle.max() - 1e-14
        ends = sorted(found[word]["value"] for word in ("min", "max"))
        assert np.ptp(series.angle) == pytest.approx(ends[1] - ends[0], rel=1e-2)


# -- as far as the mechanism goes ------------------------------------------------------------------


def test_the_driven_slide_goes_as_far_as_the_mechanism() -> None:
    """Crank and rod in line at 0.12 m and 0.06 m: beyond there is no stroke and no path."""
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[md.Body("crank", {"O": (0, 0), "B": (0.03, 0)}), md.Body("slider", {"C": (0, 0)})],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Distance("bar", "crank.B", "slider.C", length=0.09),
            md.Prismatic("guide", "ground.O", "slider.C"),
        ],
        sketch={"crank": 1.0, "guide": 0.1},
    )
    driver = md.Driver("guide.slide", from_=0.05, to=0.125)
    summary = md.solve(mechanism, md.Sweep(driver, poses=11, measures=("curve",))).summary
    assert summary["limits"] == pytest.approx([0.06, 0.12], rel=1e-12)
    assert summary["stroke"]["guide"] == pytest.approx(0.06, rel=1e-12)
    assert summary["curve"]["slider.C"]["length"] == pytest.approx(0.06, rel=1e-12)


def test_the_crank_goes_as_far_as_the_change_point_where_it_stops() -> None:
    problem = md.load("change-point-parallelogram")
    task = replace(
        problem.tasks["turn"], on_change_point="stop", measures=("curve",),
        driver=md.Driver("crank.angle", from_=1.0, to=14.0),
    )  # fmt: skip
    summary = md.solve(problem.mechanism, task).summary
    for part in ("crank", "rocker"):
        assert summary["swing"][part] == pytest.approx(np.pi - 1, rel=1e-9)
    for pin in ("crank.B", "coupler.B"):
        assert summary["curve"][pin]["length"] == pytest.approx(np.pi - 1, rel=1e-9)


def test_a_rest_between_two_change_points_is_one_event() -> None:
    problem = md.load("change-point-parallelogram")
    driver = md.Driver("crank.angle", from_=np.pi / 3, to=10 * np.pi / 3)
    task = replace(
        problem.tasks["turn"], on_change_point="switch", driver=driver, measures=("extremes",)
    )
    events = md.solve(problem.mechanism.with_values({"a": 0.04, "b": 0.1}), task).events
    rests = [event["rest"] for event in events if "rest" in event]
    assert rests == [pytest.approx([2 * np.pi, 3 * np.pi], abs=1e-9)]
