"""Laws of time: the motion follows the law itself, against closed forms in time."""

from __future__ import annotations

import csv
import io
import math
import tomllib
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

import mechdae as md
from mechdae.describe.expression import build
from mechdae.describe.file.load import from_dict
from mechdae.describe.file.schema import schema
from mechdae.describe.file.writing import dumps
from mechdae.equations.model import FUNCTIONS
from mechdae.kernels.graphs.driver_curve import FINITE, DriverCurve
from mechdae.motion.kinematics.prepared import prepare
from mechdae.results.tables import table
from mechdae.tasks.check import check
from mechdae.tasks.export import csv_text
from tests.reference.closed_forms import circle_circle, slider_crank
from tests.reference.jets import Jet, arg, unit
from tests.shared.mechanisms import five_bar, toggle

LONG = np.longdouble
TURN = 2 * math.pi


def course_of(text: str) -> DriverCurve:
    t = ca.SX.sym("t")
    return DriverCurve(t, ca.SX(build(text, {"t": t}, FUNCTIONS)))


def sweep(mechanism, *drivers: md.Driver, **keys) -> md.Result:
    return md.solve(mechanism, md.Sweep(drivers=list(drivers), **keys))


def law(coordinate: str, text: str, *span: float, times=None) -> md.Driver:
    first, last = span or (None, None)
    return md.Driver(coordinate, law=text, from_=first, to=last, times=times)


# -- the curve u(t) --------------------------------------------------------------------------------

LAWS = [
    "2 + sin(3*t)",
    "10*t**3 - 15*t**4 + 6*t**5",
    "exp(-t)*cos(5*t)",
    "1/(1.2 - t)",
    "sqrt(t + 0.1)",
    "log(t + 1)",
    "atan2(t, 0.3)",
    "atan2(t - 0.5, -1)",
    "tan(t)",
    "asin(0.9*t)",
    "acos(0.5*t)",
    "tanh(20*(t - 0.5))",
    "sinh(t) + cosh(2*t)",
    "t**2.5",
    "(t + 0.1)**-1.5",
    "2**t",
    "(t + 1)**t",
    "atan(t)",
    "hypot(t, 1)",
    "abs(t - 0.5)",
    "max(min(t, 0.7), 0.2)",
    "max(abs(t - 0.3), min(t, 0.6))",
    "sign(t - 0.5)",
    "sign(t - 0.5)*(t - 0.5)**2",
    "3",
]


@pytest.mark.parametrize("text", LAWS)
def test_drift_bounds_what_a_law_leaves_its_tangent_by(text: str) -> None:
    """Within the step nothing is further from the tangent than the bound, corners included."""
    course = course_of(text)
    s, ds = ca.SX.sym("s"), ca.SX.sym("ds")
    drift = ca.Function("drift", [s, ds], [course.drift(s, ds)])
    random = np.random.default_rng(5)
    at, step = random.uniform(0, 1, 300), 10 ** random.uniform(-6, -0.5, 300)
    bound = np.array(drift(at[None], step[None])).ravel()
    u, rate, second = (part[:, 0] for part in course.sampled(at))
    for share in np.linspace(-1, 1, 9):
        there = at + share * step
        inside = (there >= 0) & (there <= 1)
        gap = np.abs(course.sampled(there)[0][:, 0] - u - rate * share * step)
        noise = 4e-15 * (1 + np.abs(u) + np.abs(rate))
        assert np.all((gap <= bound + noise)[inside])
    smooth = not course.switches.numel()
    small = step < 1e-3
    tight = bound <= 1.2 * step**2 / 2 * np.abs(second) + 0.1 * step**2 + 1e5 * step**3
    assert np.all((tight | (bound > FINITE))[small]) or not smooth
    assert np.mean(bound > FINITE) < 0.1


def test_rates_of_a_law() -> None:
    course = course_of("exp(-t)*cos(5*t) + t**3")
    t = np.linspace(0, 2, 7)
    z = np.exp((-1 + 5j) * t)
    for ours, factor, rest in zip(
        course.sampled(t), (1, -1 + 5j, (-1 + 5j) ** 2), (t**3, 3 * t**2, 6 * t), strict=True
    ):
        assert ours[:, 0] == pytest.approx((factor * z).real + rest, rel=1e-14, abs=1e-14)


# -- against closed forms --------------------------------------------------------------------------


def compare(result: md.Result, closed: dict[str, Jet], tolerance: float) -> None:
    """Values, rates and accelerations agree, relative to the largest of each series."""
    for part, jet in closed.items():
        series = result.points[part] if "." in part else result.bodies[part]
        for order, name in enumerate(series):
            ours = np.asarray(series[name])
            ours = ours[:, 0] + 1j * ours[:, 1] if ours.ndim == 2 else ours
            wanted = jet.c[order] * math.factorial(order)
            gap = np.abs(ours - wanted).astype(float)
            assert gap.max() <= tolerance * float(np.abs(wanted).max()), (part, name, gap.max())
            if order == 0:
                bound = result.bound.length if "." in part else result.bound.angle
                assert np.all(gap <= bound + 4e-16 * np.abs(wanted).astype(float).max())


def inverse(t: Jet) -> dict[str, Jet]:
    """Both dyads of the five-bar robot, its tip on the circle."""
    a, b, d = LONG("0.2"), LONG("0.3"), LONG("0.2")
    p = LONG("0.1") + 1j * LONG("0.35") + LONG("0.06") * unit(3 * t)
    left = circle_circle(0 * p, a, p, b, 1)
    right = circle_circle(0 * p + d, a, p, b, -1)
    return {
        "tip.P": p,
        "left.B": left,
        "left": arg(left, 2.0),
        "right": arg(right - d, 1.0),
        "tip": arg(p - left, 0.7),
        "strut": arg(p - right, 2.4),
    }


def test_inverse_kinematics_of_the_five_bar() -> None:
    result = md.solve("five-bar-robot", "circle")
    assert len(result) == 361
    assert set(result.status) == {"ok"}
    t = Jet.variable(np.asarray(result.time, LONG), 2)
    compare(result, inverse(t), 1e-12)
    x = result.drivers["tip.P.x"]
    assert x.velocity == pytest.approx(-0.18 * np.sin(3 * result.time), abs=1e-15)
    assert x.acceleration == pytest.approx(-0.54 * np.cos(3 * result.time), abs=1e-15)
    assert result.summary["bound"] == "proved"
    work = result.summary["work"]
    assert work["path_steps"] <= 140
    assert work["pose_evaluations"] <= 361 + 200
    assert work["refined_poses"] <= 5


def test_forward_kinematics_of_the_five_bar() -> None:
    result = md.solve("five-bar-robot", "forward")
    t = Jet.variable(np.asarray(result.time, LONG), 2)
    sine, sine2 = (unit(k * 3 * t).map(np.imag) for k in (1, 2))
    left = LONG("2.2") + LONG("0.4") * sine
    right = LONG("0.9") - LONG("0.3") * sine2
    B, D = LONG("0.2") * unit(left), LONG("0.2") + LONG("0.2") * unit(right)
    P = circle_circle(B, LONG("0.3"), D, LONG("0.3"), 1)
    closed = {"left": left, "right": right, "strut.P": P, "tip": arg(P - B, 0.6)}
    compare(result, closed, 1e-12)


@pytest.mark.parametrize("size", [1e-6, 1e4])
def test_a_law_has_no_scale(size: float) -> None:
    problem = md.load("five-bar-robot")
    values = evaluate_lengths(problem, size)
    result = md.solve(problem, "circle", set=values, poses=25)
    same = md.solve(problem, "circle", poses=25)
    assert set(result.status) == {"ok"}
    for body in ("left", "strut"):
        for name in same.bodies[body]:
            assert result.bodies[body][name] == pytest.approx(same.bodies[body][name], rel=1e-12)


def evaluate_lengths(problem: md.Problem, size: float) -> dict[str, float]:
    lengths = ("a", "b", "d", "xc", "yc", "r")
    return {name: size * float(problem.mechanism.parameters[name]) for name in lengths}


def test_one_driver_by_a_law() -> None:
    """Rates in time, and extremes that lie between the poses and between the turns."""
    problem = md.load("slider-crank")
    result = sweep(problem.mechanism, law("crank.angle", "0.4 + 1.9*sin(2*t)", 0, 3), poses=40)
    assert set(result.status) == {"ok"}
    t = Jet.variable(np.asarray(result.time, LONG), 2)
    closed = slider_crank(LONG("0.4") + LONG("1.9") * unit(2 * t).map(np.imag))
    parts = {name: closed[name] for name in ("crank", "rod", "rod.C")}
    compare(result, parts, 1e-12)
    ends = [
        0.1 * math.cos(u) + math.sqrt(0.09 - (0.1 * math.sin(u)) ** 2) for u in (0.0, 2.3, -1.5)
    ]
    assert result.summary["stroke"]["guide"] == pytest.approx(max(ends) - min(ends), rel=1e-13)
    assert result.summary["swing"]["crank"] == pytest.approx(3.8, rel=1e-14)
    assert "limits" not in result.summary


def test_named_times_are_poses_of_the_same_motion() -> None:
    drivers = (law("tip.P.x", "0.1 + 0.06*cos(3*t)", 0, 1), law("tip.P.y", "0.35 + 0.06*sin(3*t)"))
    whole = sweep(md.load("five-bar-robot").mechanism, *drivers, poses=11)
    times = [0.0, 0.7, 0.3, 1.0]
    named = (replace(drivers[0], from_=None, to=None, times=times), drivers[1])
    some = sweep(md.load("five-bar-robot").mechanism, *named)
    rows = [0, 7, 3, 10]
    assert some.time == pytest.approx(times)
    for order in ("angle", "angular_velocity", "angular_acceleration"):
        assert some.bodies["left"][order] == pytest.approx(whole.bodies["left"][order][rows])
    assert "swing" not in some.summary


def test_the_motion_follows_the_law_and_not_its_chord() -> None:
    """Two places of the tip that a straight line joins only through the hole of the workspace."""
    mechanism = md.load("five-bar-robot").mechanism
    start = {"left": 1.3, "right": 1.9, "tip": 3.5, "strut": 5.0}
    mechanism = replace(mechanism, sketch={**start})
    angles = [math.radians(100), math.radians(190)]
    x, y = "0.12*cos(t)", "0.12*sin(t)"
    drivers = (law("tip.P.x", x, times=angles), law("tip.P.y", y, times=angles))
    around = sweep(mechanism, *drivers, outputs=["left"])
    places = [[0.12 * f(a) for a in angles] for f in (math.cos, math.sin)]
    chord = [md.Driver(c, at=p) for c, p in zip(("tip.P.x", "tip.P.y"), places, strict=True)]
    straight = sweep(mechanism, *chord, outputs=["left"])
    assert list(around.status) == ["ok", "ok"]
    assert list(straight.status) == ["ok", "unassembled"]
    x, y = straight.events[0]["at"]
    assert math.hypot(x, y) == pytest.approx(0.1, rel=1e-12)


# -- limits ----------------------------------------------------------------------------------------


def test_a_direct_singularity_on_the_way_of_a_law() -> None:
    """The forearms in one line: located in time, named, and nothing is claimed behind it."""
    left, right = law("left.angle", "2 + 0.4*t", 0, 1), law("right.angle", "1 - 0.3*t")
    result = sweep(five_bar(), left, right, poses=9)
    assert list(result.status) == ["ok"] * 8 + ["unassembled"]
    event = result.events[0]
    assert event["kind"] == "limit"
    assert (event["joint"], event["group"]) == ("C", ["fore", "aft"])
    low, high = LONG(0), LONG(1)
    for _ in range(80):
        t = (low + high) / 2
        gap = np.abs(0.2 * unit(2 + LONG("0.4") * t) - 0.2 - 0.2 * unit(1 - LONG("0.3") * t))
        low, high = (t, high) if gap < 0.5 else (low, t)
    assert event["time"] == pytest.approx(float(low), rel=1e-12)
    assert event["at"] == pytest.approx([2 + 0.4 * float(low), 1 - 0.3 * float(low)], rel=1e-12)
    failed = result.summary["failed"][0]
    assert failed["time"] == pytest.approx([float(low), 1.0], rel=1e-12)
    assert "limits" not in result.summary
    assert "first at t = 0.99475 s to 1 s" in (result.fault or "")
    assert "limit position at t = 0.99475 s, left.angle = 137.39 deg" in (result.fault or "")
    assert np.isnan(result.bodies["fore"].angle[-1])
    assert result.bodies["left"].angle[-1] == pytest.approx(2.4)
    assert "limit     t = 0.99475045" in table(result)


def test_behind_a_limit_a_law_that_returns_is_not_claimed() -> None:
    left = law("left.angle", "2 + 0.5*sin(pi*t)", 0, 1)
    result = sweep(five_bar(), left, law("right.angle", "1 - 0.3*sin(pi*t)"), poses=9)
    assert list(result.status) == ["ok"] * 3 + ["unassembled"] * 6


@pytest.mark.parametrize("beside", [-1e-4, -1e-8, -1e-12, 1e-8, 1e-4])
def test_a_law_that_turns_just_beside_a_limit(beside: float) -> None:
    """It passes however near, and stops where the law goes beyond."""
    limit = 3.041723614232363
    assert abs(0.2 * unit(limit) - 0.2 - 0.2 * unit(1.2)) == pytest.approx(0.5, rel=1e-15)
    left = law("left.angle", f"{limit + beside!r} - (t - 1)**2", 0, 2)
    result = sweep(five_bar(), left, md.Driver("right.angle", at=[1.2]), poses=9)
    if beside < 0:
        assert set(result.status) == {"ok"}
        assert result.events == ()
    else:
        assert list(result.status) == ["ok"] * 4 + ["unassembled"] * 5
        assert result.events[0]["kind"] == "limit"
        expected = 1 - math.sqrt(beside)
        assert result.events[0]["time"] == pytest.approx(expected, abs=1e-15 / math.sqrt(beside))


def test_a_law_over_change_points() -> None:
    """A parallelogram rocked through its change points stays parallel, rates included."""
    mechanism = md.load("change-point-parallelogram").mechanism
    rock = law("crank.angle", "pi/3 + 2*sin(3*t)", 0, 6)
    result = sweep(mechanism, rock, poses=100)
    assert set(result.status) == {"ok"}
    crank, rocker = result.bodies["crank"], result.bodies["rocker"]
    wanted = math.pi / 3 + 2 * np.sin(3 * result.time)
    assert np.abs(rocker.angle - wanted).max() < 1e-14
    assert np.abs(rocker.angular_velocity - crank.angular_velocity).max() < 1e-11
    assert np.abs(rocker.angular_acceleration - crank.angular_acceleration).max() < 1e-8
    passed = [event for event in result.events if event["kind"] == "change_point"]
    turns = [(math.pi + math.asin(math.pi / 6)) / 3, (2 * math.pi - math.asin(math.pi / 6)) / 3]
    times = sorted(t + k * 2 * math.pi / 3 for t in turns for k in range(3))
    assert [event["time"] for event in passed] == pytest.approx([t for t in times if t < 6], 1e-14)
    assert [event["at"] for event in passed] == pytest.approx([0.0] * 5, abs=1e-14)
    stopped = sweep(mechanism, rock, poses=100, on_change_point="stop")
    assert stopped.events[0]["time"] == pytest.approx(times[0], rel=1e-14)
    behind = stopped.time > times[0]
    assert np.array_equal(stopped.status == "unassembled", behind)


def test_a_tip_out_of_reach() -> None:
    x = law("tip.P.x", "0.1 + 0.5*t", 0, 1)
    mechanism = md.load("five-bar-robot").mechanism
    result = sweep(mechanism, x, md.Driver("tip.P.y", at=["0.35"]), poses=11)
    event = result.events[0]
    assert event["at"] == pytest.approx([math.sqrt(0.25 - 0.35**2), 0.35], rel=1e-13)
    assert event["joint"] == "B"
    assert list(result.status) == ["ok"] * 6 + ["unassembled"] * 5
    assert np.all(np.isfinite(result.drivers["tip.P.x"].velocity))


# -- corners ---------------------------------------------------------------------------------------


def crank_by(text: str, first: float, last: float, poses: int = 21) -> md.Result:
    mechanism = md.load("slider-crank").mechanism
    return sweep(mechanism, law("crank.angle", text, first, last), poses=poses)


def test_rates_at_a_corner_are_not_given() -> None:
    result = crank_by("abs(t - 1)", 0, 2)
    assert set(result.status) == {"ok"}
    crank = result.bodies["crank"]
    assert list(np.flatnonzero(np.isnan(crank.angular_velocity))) == [10]
    assert list(np.flatnonzero(np.isnan(result.drivers["crank.angle"].velocity))) == [10]
    assert crank.angular_velocity[[9, 11]] == pytest.approx([-1, 1])
    assert crank.angle == pytest.approx(np.abs(result.time - 1), abs=1e-15)
    assert "corner at t = 1: no rates" in result.summary["notes"][0]
    beside = crank_by("abs(t - 1.03)", 0, 2)
    assert not np.isnan(beside.bodies["rod"].angular_velocity).any()
    slide = [0.1 * math.cos(u) + math.sqrt(0.09 - (0.1 * math.sin(u)) ** 2) for u in (0, 1.03)]
    assert beside.summary["stroke"]["guide"] == pytest.approx(slide[0] - slide[1], rel=1e-13)


def test_only_rates_that_differ_are_left_out() -> None:
    """A corner of the acceleration alone, and ends of the interval with one side only."""
    result = crank_by("max(t, 0)**2", -1, 1)
    rod = result.bodies["rod"]
    assert not np.isnan(rod.angular_velocity).any()
    assert list(np.flatnonzero(np.isnan(rod.angular_acceleration))) == [10]
    ends = crank_by("abs(t)", 0, 1)
    assert ends.bodies["crank"].angular_velocity == pytest.approx(np.ones(21))
    inner = crank_by("2*min(t/0.3, 1)", 0, 0.3)
    assert inner.bodies["crank"].angular_velocity == pytest.approx(np.full(21, 2 / 0.3))


def test_dwell_and_rise() -> None:
    """A cycloidal rise between dwells, written with min and max, is smooth and stays so."""
    s = "min(max(t/0.3, 0), 1)"
    result = crank_by(f"3*({s} - sin(2*pi*({s}))/(2*pi))", -0.3, 0.6, poses=31)
    assert set(result.status) == {"ok"}
    assert not np.isnan(result.bodies["rod"].angular_acceleration).any()
    x = np.clip(result.time / 0.3, 0, 1)
    wanted = 3 * (x - np.sin(TURN * x) / TURN)
    assert result.bodies["crank"].angle == pytest.approx(wanted, abs=1e-14)


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("sign(t - 0.5)", 0.5),
        ("1 + 1e-5*sign(t - 0.3)", 0.3),
        ("atan2(sin(6*t), cos(6*t))", math.pi / 6),
        ("1.2 + 0.1*atan2(sin(6*t), cos(6*t))", math.pi / 6),
        ("sin(atan2(sin(6*t), cos(6*t))/2)", math.pi / 6),
        ("t + 1e-5*tanh(atan2(sin(6*t), cos(6*t)))", math.pi / 6),
        ("tan(2*t)", math.pi / 4),
        ("1/(t - 0.551)", 0.551),
        ("sqrt(abs(t - 0.33))", 0.33),
    ],
)
def test_laws_that_jump_are_refused(text: str, place: float) -> None:
    with pytest.raises(md.InputError, match=f"t = {place:.6g}: a driver moves continuously"):
        crank_by(text, 0, 1)


def test_laws_that_leave_all_bounds_are_refused_at_once() -> None:
    """Values above 1e50 over a part of the interval, not at a single place."""
    with pytest.raises(md.InputError, match="no bounded value at t = "):
        crank_by("exp(t)", 0, 500)


@pytest.mark.parametrize("text", ["exp(t)", "1e9*t"])
def test_motions_of_too_many_steps_are_refused(text: str) -> None:
    with pytest.raises(md.InputError, match="at most 1000000 are followed"):
        crank_by(text, 0, 25)


def test_steep_laws_are_followed() -> None:
    result = crank_by("tanh(50*(t - 1))", 0, 2)
    assert set(result.status) == {"ok"}
    assert result.summary["work"]["path_steps"] < 5000
    assert result.bodies["crank"].angle[-1] == pytest.approx(1.0)


# -- in files and outputs --------------------------------------------------------------------------


def test_times_are_columns_of_every_output() -> None:
    result = md.solve("five-bar-robot", "circle", poses=5)
    assert result.to_dict()["time"] == pytest.approx(np.linspace(0, TURN / 3, 5))
    rows = list(csv.DictReader(io.StringIO(csv_text(result))))
    assert [float(row["time [s]"]) for row in rows] == result.time.tolist()
    assert "t [s]" in table(result)
    assert "time" not in md.solve("slider-crank", "turn", poses=3).to_dict()
    one = sweep(md.load("slider-crank").mechanism, law("crank.angle", "t", times=[0.5]))
    assert "0.5 s" in table(one)


def test_an_expected_value_names_a_time() -> None:
    problem = md.load("five-bar-robot")
    entry = problem.expected[0]
    for bad, words in (
        (replace(entry, time=0.01), "no pose at 0.01"),
        (replace(entry, time=None), "361 poses"),
        (replace(entry, task="modes", what="bodies/left/angle"), "no times"),
    ):
        verdict = check(replace(problem, expected=(bad,)))[0]
        assert not verdict.met
        assert words in verdict.note


def drivers_in_a_file(*drivers: str) -> md.Problem:
    data = tomllib.loads(dumps(replace(md.load("five-bar-robot"), expected=())))
    data["tasks"] = tomllib.loads(f"[go]\nkind = 'sweep'\ndrivers = [{', '.join(drivers)}]")
    return from_dict(data)


def test_laws_in_degrees_and_back() -> None:
    problem = drivers_in_a_file(
        '{ coordinate = "left.angle", law_deg = "115 + 10*t", from = 0, to = "1/2" }',
        '{ coordinate = "right.angle", at_deg = [65] }',
    )
    assert from_dict(tomllib.loads(dumps(problem))).tasks == problem.tasks
    result = md.solve(problem, poses=6)
    assert np.degrees(result.bodies["left"].angle) == pytest.approx(np.linspace(115, 120, 6))
    keys = schema()["properties"]["tasks"]["additionalProperties"]["oneOf"][0]["properties"]
    assert "law_deg" in keys["driver"]["properties"]


@pytest.mark.parametrize(
    ("drivers", "words"),
    [
        (['{ coordinate = "left.angle", law = "t", from_deg = 0, to_deg = 1 }'], "in seconds"),
        (['{ coordinate = "left.angle", law = "t*", from = 0, to = 1 }'], "not an expression"),
        (['{ coordinate = "left.angle", law = "t", from = 0 }'], "needed together"),
        (['{ coordinate = "left.angle", law = "t", from = 0, to = 0 }'], "same value"),
        (
            ['{ coordinate = "left.angle", law = "t", from = 0, to = 1, times = [0, 1] }'],
            "not both",
        ),
        (['{ coordinate = "left.angle", law = "t", times = [] }'], "empty"),
        (['{ coordinate = "left.angle", times = [0, 1] }'], "not times"),
        (['{ coordinate = "left.angle", law = "t", at = [1] }'], "not at and law"),
        (['{ coordinate = "left.angle", law = "speed*t", times = [1] }'], "unknown name 'speed'"),
        (['{ coordinate = "left.angle", law = "1/0*t", times = [1] }'], "has no value"),
        (['{ coordinate = "left.angle", law = "min(t)", times = [1] }'], "2 or more"),
    ],
)
def test_laws_that_are_no_laws(drivers: list[str], words: str) -> None:
    with pytest.raises(md.InputError, match=words):
        md.solve(drivers_in_a_file(*drivers, '{ coordinate = "right.angle", at = [1] }'))


@pytest.mark.parametrize(
    ("right", "words"),
    [
        (md.Driver("right.angle", law="t", times=[2]), "the same times"),
        (md.Driver("right.angle", from_=0, to=1), "held or follows a law"),
        (md.Driver("right.angle", at=[1, 2]), "held or follows a law"),
        (md.Driver("right.angle", at=[1], speed=2), "is held while others move"),
    ],
)
def test_what_a_law_does_not_go_with(right: md.Driver, words: str) -> None:
    with pytest.raises(md.InputError, match=words):
        sweep(five_bar(), law("left.angle", "2 + t", times=[0]), right)


def test_a_plain_driver_builds_what_it_did() -> None:
    """The kernels of a single driver hold nothing of laws."""
    problem = md.load("four-bar-crank-rocker")
    graphs = prepare(problem, problem.tasks["turn"]).graphs
    assert graphs.single
    assert graphs.course is None
    assert graphs.advance.n_instructions() < 300
    assert graphs.pose.n_instructions() < 300


def test_a_path_goes_both_ways_in_time() -> None:
    """Times before the first one named are reached backwards."""
    mechanism = md.load("slider-crank").mechanism
    result = sweep(mechanism, law("crank.angle", "0.5 + t**2", times=[0.5, -0.7, 1.1]))
    assert set(result.status) == {"ok"}
    assert result.bodies["crank"].angular_velocity == pytest.approx([1.0, -1.4, 2.2])


# -- laws that begin on a limit position -----------------------------------------------------------


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(
    "law", ["2 - t", "2 - t - t**2/3", "2*cos(0.7*t + 0.2)/cos(0.2)", "2 - t/7"]
)
def test_a_law_that_begins_on_a_limit_position_goes_on_along_the_sketched_branch(
    law: str, side: int
) -> None:
    driver = md.Driver("g.slide", law=law, from_=0, to=1)
    result = md.solve(toggle(side * 0.9), md.Sweep(driver, poses=9))
    assert [str(word) for word in result.status] == ["limit"] + ["ok"] * 8
    assert result.fault is None
    g = result.drivers["g.slide"].position
    wanted = side * np.arccos(np.minimum(g / 2, 1))
    assert result.bodies["p"].angle == pytest.approx(wanted, abs=1e-7)
    assert result.bodies["p"].angle[1:] == pytest.approx(wanted[1:], abs=1e-14)


def test_a_law_that_begins_beyond_a_limit_position_is_not_reached() -> None:
    driver = md.Driver("g.slide", law="2.2 - t", from_=0, to=1)
    result = md.solve(toggle(0.9), md.Sweep(driver, poses=11))
    assert set(result.status) == {"unassembled"}
    assert "11 of 11 poses are not reached" in result.fault
    assert "limit position at" in result.fault


def test_a_line_of_several_drivers_that_begins_on_a_limit_position() -> None:
    """The pivot is on a slider of its own at h: the angle is acos((g - h) / 2)."""
    base = toggle(0.9)
    mechanism = md.Mechanism(
        ground=base.ground,
        bodies=[*base.bodies.values(), md.Body("t", points={"A": (0, 0)})],
        joints=[
            *[joint for name, joint in base.joints.items() if name != "a"],
            md.Prismatic("h", "ground.A", "t.A"),
            md.Revolute("a", "t.A", "p.A"),
        ],
        sketch={**base.sketch, "h": 0.0, "t": 0.0},
    )
    drivers = [
        md.Driver("g.slide", from_=2.5, to=2.0),
        md.Driver("h.slide", from_=0.5, to=1.0),
    ]
    result = md.solve(mechanism, md.Sweep(drivers=drivers, poses=5))
    assert [str(word) for word in result.status] == ["limit"] + ["ok"] * 4
    apart = result.drivers["g.slide"].position - result.drivers["h.slide"].position
    assert result.bodies["p"].angle[1:] == pytest.approx(np.arccos(apart[1:] / 2), abs=1e-13)
