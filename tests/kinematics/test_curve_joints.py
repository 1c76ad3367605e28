"""Curve joints: cams with point and roller followers, grooves, their ends, bounds, undercut."""

from __future__ import annotations

import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

import mechdae as md
from mechdae.bench.extended import true_error
from mechdae.describe.file.load import from_dict
from mechdae.describe.file.problem import Problem
from mechdae.describe.file.writing import dumps
from mechdae.describe.table import Table
from mechdae.errors import AssemblyError, MechanismError, MechdaeError
from mechdae.kernels.bounds.intervals import Floors, enclosure, lower_bounds
from mechdae.kernels.bounds.majorant import NoMajorant
from mechdae.kinematics.prepared import prepare
from mechdae.kinematics.report import report
from mechdae.kinematics.sweep import run
from mechdae.tasks.check import validate
from mechdae.tasks.show import structure
from tests.shared.mechanisms import SPEED, cam, rod_and_slot

LONG = np.longdouble
PI = math.pi


def turn(low: float = 0.0, high: float = 2 * PI, poses: int = 25) -> md.Sweep:
    return md.Sweep(md.Driver("cam.angle", from_=low, to=high, speed=SPEED), poses=poses)


def largest(a: object, b: object) -> float:
    return float(np.max(np.abs(np.asarray(a, LONG) - np.asarray(b, LONG))))


# -- against closed forms ------------------------------------------------------------------------


def slider_crank(e: float, rod: float, u: object) -> list:
    """Slide along y of a crank e from the x axis with a rod, and its rates at speed SPEED."""
    u = np.asarray(u, LONG)
    e, rod = LONG(e), LONG(rod)
    x, dx, ddx = e * np.cos(u), -e * np.sin(u), -e * np.cos(u)
    root = np.sqrt(rod**2 - x**2)
    y = e * np.sin(u) + root
    first = e * np.cos(u) - x * dx / root
    slope = (dx * dx + x * ddx) / root + (x * dx) ** 2 / root**3
    return [y, first * SPEED, (-e * np.sin(u) - slope) * SPEED**2]


@pytest.mark.parametrize("roller", [0.008, None])
def test_an_eccentric_circle_is_a_slider_crank(roller: float | None) -> None:
    """Circle and roller keep their centres apart by the sum of the radii: a rod."""
    radius = 0.038 - (roller or 0.0)
    result = md.solve(cam(f"0.01 + {radius}*cos(s)", f"{radius}*sin(s)", roller), turn())
    assert set(result.status) == {"ok"}
    assert result.summary["bound"] == "proved"
    u = result.drivers["cam.angle"].position
    y, dy, ddy = slider_crank(0.01, 0.038, u)
    point = result.points["follower.N"]
    gap = np.abs(point.position[:, 1] - y).astype(float)
    assert np.all(gap <= result.bound.length)
    assert gap.max() < 2e-17
    assert largest(point.velocity[:, 1], dy) < 1e-15 * SPEED
    assert largest(point.acceleration[:, 1], ddy) < 1e-15 * SPEED**2
    # the contact lies on the rod: s is its angle in the cam
    s = np.arctan2(y - LONG(0.01) * np.sin(u.astype(LONG)), -LONG(0.01) * np.cos(u.astype(LONG)))
    off = np.exp(1j * (result.joints["profile"].s - (s - u).astype(float)))
    assert np.abs(off - 1).max() < 1e-14


def test_a_roller_on_a_lever_is_a_four_bar() -> None:
    e, radius, roller, lever, d = (LONG(v) for v in ("0.012", "0.03", "0.01", "0.09", "0.1"))
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0), "D": ("d", 0)}),
        bodies=[
            md.Body("cam", {"O": (0, 0)}),
            md.Body("lever", {"D": (0, 0), "N": ("lever_length", 0)}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "cam.O"),
            md.Revolute("D", "ground.D", "lever.D"),
            md.Curve(
                "profile",
                "cam.O",
                "lever.N",
                x="e + r*cos(s)",
                y="r*sin(s)",
                closed=True,
                roller_radius="rho",
            ),
        ],
        parameters={"e": 0.012, "r": 0.03, "rho": 0.01, "lever_length": 0.09, "d": 0.1},
        sketch={"cam": 0.2, "lever": 2.6},
    )
    result = md.solve(mechanism, turn())
    assert set(result.status) == {"ok"}
    assert result.summary["formula"] == "I(1) -> II cam(2)"
    u = np.asarray(result.drivers["cam.angle"].position, LONG)
    rod = radius + roller
    a = e * np.exp(1j * u)
    # lever: |d + lever exp(i t) - a| = rod, the upper solution
    gap = a - d
    size, direction = np.abs(gap), np.angle(gap)
    t = direction - np.arccos((size**2 + lever**2 - rod**2) / (2 * size * lever))
    ours = result.bodies["lever"]
    assert np.abs(np.exp(1j * (ours.angle - t)) - 1).max() < 2e-15
    arm, link = lever * np.exp(1j * t), d + lever * np.exp(1j * t) - a
    dot = lambda v, w: (v * np.conj(w)).real  # noqa: E731
    v = 1j * a * LONG(SPEED)
    omega = dot(v, link) / dot(1j * arm, link)
    rate = 1j * arm * omega - v
    push = -a * LONG(SPEED) ** 2 + arm * omega**2
    alpha = (dot(push, link) - dot(rate, rate)) / dot(1j * arm, link)
    assert largest(ours.angular_velocity, omega) < 1e-14
    assert largest(ours.angular_acceleration, alpha) < 1e-13


LAW = "(0.03 + 0.004*sin(2*s) - 0.003*cos(3*s))"


def test_a_point_on_a_radial_guide_reads_the_law() -> None:
    result = md.solve(cam(f"{LAW}*cos(s)", f"{LAW}*sin(s)"), turn(-7.0, 7.0, 57))
    u = np.asarray(result.drivers["cam.angle"].position, LONG)
    s = LONG(PI) / 2 - u
    wide = [LONG(value) for value in ("0.03", "0.004", "0.003")]
    y = wide[0] + wide[1] * np.sin(2 * s) - wide[2] * np.cos(3 * s)
    dy = -(2 * wide[1] * np.cos(2 * s) + 3 * wide[2] * np.sin(3 * s)) * SPEED
    ddy = (-4 * wide[1] * np.sin(2 * s) + 9 * wide[2] * np.cos(3 * s)) * SPEED**2
    point = result.points["follower.N"]
    assert np.all(np.abs(point.position[:, 1] - y).astype(float) <= result.bound.length)
    assert largest(point.position[:, 1], y) < 1e-16
    assert largest(point.velocity[:, 1], dy) < 2e-15
    assert largest(point.acceleration[:, 1], ddy) < 2e-14
    contact = result.joints["profile"]
    turns = (contact.s - (PI / 2 - result.drivers["cam.angle"].position)) / (2 * PI)
    assert np.abs(turns - turns[0]).max() < 1e-14, "s grows on through whole turns"
    assert np.abs(contact.s_velocity + SPEED).max() < 1e-13
    assert np.abs(contact.s_acceleration).max() < 1e-12


@pytest.mark.parametrize("scale", [1e-6, 1e3])
def test_micrometres_and_kilometres_give_the_same_digits(scale: float) -> None:
    base = md.load("cam-roller-follower")
    names = ("base", "h", "rho", "offset", "stem")
    values = base.mechanism.values()
    scaled = base.with_values({name: values[name] * scale for name in names})
    mechanism = scaled.mechanism
    sketch = {**mechanism.sketch, "guide": 0.075 * scale}
    scaled = replace(scaled, mechanism=replace(mechanism, sketch=Table(sketch)))
    one, other = (md.solve(problem, "turn", poses=25) for problem in (base, scaled))
    assert set(other.status) == {"ok"}
    for name in ("position", "velocity", "acceleration"):
        a, b = one.points["follower.R"][name], other.points["follower.R"][name] / scale
        assert np.abs(a - b).max() < 1e-14 * np.abs(a).max()
    assert np.abs(one.joints["profile"].s - other.joints["profile"].s).max() < 1e-13
    assert other.bound.length.max() == pytest.approx(one.bound.length.max() * scale, rel=1e-6)
    assert one.summary["work"]["path_steps"] == other.summary["work"]["path_steps"]


@pytest.mark.parametrize("unit", [1e-4, 1.0, 1e5])
def test_the_unit_of_s_does_not_matter(unit: float) -> None:
    """s may be an angle, an arc length, a share of the curve."""
    mechanism = cam(
        f"0.01 + 0.03*cos(s*{1 / unit!r})",
        f"0.03*sin(s*{1 / unit!r})",
        0.008,
        range=(0.0, 2 * PI * unit),
    )
    result = md.solve(mechanism, turn())
    y = slider_crank(0.01, 0.038, result.drivers["cam.angle"].position)[0]
    assert set(result.status) == {"ok"}
    assert largest(result.points["follower.N"].position[:, 1], y) < 1e-16
    assert result.bound.length.max() < 4e-15
    assert result.summary["work"]["path_steps"] < 200


def test_the_cam_follows_where_the_follower_drives() -> None:
    result = md.solve(
        cam("0.01 + 0.03*cos(s)", "0.03*sin(s)", 0.008),
        md.Sweep(md.Driver("guide.slide", range="assembled"), poses=7),
    )
    assert result.summary["limits"] == pytest.approx([0.028, 0.048], abs=1e-15)
    assert list(result.status) == ["limit", *["ok"] * 5, "limit"]
    back = slider_crank(0.01, 0.038, result.bodies["cam"].angle)[0]
    assert largest(back, result.drivers["guide.slide"].position) < 1e-9  # flat at the limits
    assert largest(back[1:-1], result.drivers["guide.slide"].position[1:-1]) < 1e-16


# -- ends of a curve -----------------------------------------------------------------------------


def test_the_motion_ends_where_the_slot_does() -> None:
    """A straight slot (s is eliminated): a slider-crank with a stop."""
    mechanism = rod_and_slot(x="s", y=0, range=(0.055, 0.09))
    result = md.solve(mechanism, md.Sweep(md.Driver("crank.angle", range="assembled"), poses=9))
    stops = [math.acos((0.03**2 + stop**2 - 0.08**2) / (2 * 0.03 * stop)) for stop in (0.09, 0.055)]
    assert result.summary["limits"] == pytest.approx(stops, rel=1e-13)
    assert set(result.status) == {"ok"}
    assert result.joints["slot"].s[[0, -1]] == pytest.approx([0.09, 0.055], rel=1e-14)
    assert [event["kind"] for event in result.events] == ["end_of_curve"] * 2
    assert {event["joint"] for event in result.events} == {"slot"}
    beyond = md.solve(mechanism, md.Sweep(md.Driver("crank.angle", from_=1.0, to=3.0), poses=21))
    u = beyond.drivers["crank.angle"].position
    inside = (u >= stops[0]) & (u <= stops[1])
    assert np.array_equal(beyond.status == "ok", inside)
    assert "the contact of joint slot is at the end of its curve" in str(beyond.fault)
    assert beyond.summary["failed"][0]["joint"] == "slot"
    assert np.isnan(beyond.points["rod.B"].position[~inside]).all()


def test_a_stop_between_two_steps_is_not_passed() -> None:
    """The end is crossed and crossed again within a fiftieth of a step."""
    turn_back = 5e-4
    end = 0.03 * math.cos(turn_back) + math.sqrt(0.08**2 - (0.03 * math.sin(turn_back)) ** 2)
    mechanism = rod_and_slot(x="s", y="0*s", range=(0.04, end))
    mechanism = replace(mechanism, sketch=Table({"crank": -1.0, "rod": 0.3}))
    result = md.solve(mechanism, md.Sweep(md.Driver("crank.angle", from_=-1.0, to=1.0), poses=5))
    # what lies behind the stop is reached by turning the other way round
    assert list(result.status) == ["ok", "ok", "unassembled", "ok", "ok"]
    low, high = (event["at"] for event in result.events)
    assert high == pytest.approx(-turn_back, rel=1e-7)  # flat: s is stationary nearby
    assert low == pytest.approx(turn_back - 2 * PI, abs=1e-7 * turn_back)


def test_a_contact_that_is_no_unknown_ends_as_well() -> None:
    """A yoke with a bent slot: all is explicit, s = r sin u."""
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[md.Body("crank", {"O": (0, 0), "A": (0.05, 0)}), md.Body("yoke", {"S": (0, 0)})],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Curve("slot", "yoke.S", "crank.A", x="2*s**2", y="s", range=(-0.04, 0.03)),
            md.Prismatic("guide", "ground.O", "yoke.S"),
        ],
        sketch={"crank": 0.2},
    )
    result = md.solve(mechanism, md.Sweep(md.Driver("crank.angle", range="assembled"), poses=9))
    assert result.summary["work"]["unknowns"] == 0
    ends = [math.asin(-0.8), math.asin(0.6)]
    assert result.summary["limits"] == pytest.approx(ends, rel=1e-13)
    u = result.drivers["crank.angle"].position
    slide = 0.05 * np.cos(u) - 2 * (0.05 * np.sin(u)) ** 2
    assert np.abs(result.joints["guide"].slide - slide).max() < 1e-17
    task = md.Sweep(md.Driver("crank.angle", from_=0.0, to=1.0), poses=11)
    beyond = md.solve(mechanism, task)
    places = beyond.drivers["crank.angle"].position
    assert np.array_equal(beyond.status == "ok", places <= ends[1])
    with pytest.raises(AssemblyError, match="joint slot stays open"):
        md.solve(replace(mechanism, sketch=Table({"crank": 1.2})), task)


def test_both_ends_of_a_rod_on_curves_are_a_four_bar() -> None:
    """Two contacts in one block; circles are cranks."""
    a, b, c, d = 0.03, 0.08, 0.07, 0.09
    circle = "{}*cos(s)", "{}*sin(s)"
    mechanism = md.Mechanism(
        ground=md.Ground({"A": (0, 0), "D": (d, 0)}),
        bodies=[md.Body("rod", {"B": (0, 0), "C": (b, 0)})],
        joints=[
            md.Curve(
                n,
                f"ground.{p}",
                f"rod.{q}",
                x=circle[0].format(r),
                y=circle[1].format(r),
                closed=True,
            )
            for n, p, q, r in (("one", "A", "B", a), ("two", "D", "C", c))
        ],
        sketch={"one": 0.5, "two": 1.5, "rod": 0.5},
    )
    task = md.Sweep(md.Driver("one.s", range="assembled"), poses=13)
    result = md.solve(mechanism, task)
    assert result.summary["limits"] == [None, None]
    u = result.joints["two"].s
    gap = d + c * np.exp(1j * u) - a * np.exp(1j * result.drivers["one.s"].position)
    assert np.abs(np.abs(gap) - b).max() < 3e-17
    assert np.abs(np.exp(1j * result.bodies["rod"].angle) - gap / b).max() < 1e-15
    modes = md.solve(mechanism, md.Modes(md.Driver("rod.angle", at=[0.5])))
    assert modes.summary["count"] == 2


def test_the_end_of_a_bent_slot() -> None:
    """B at the end of the parabola y = 4 s^2: the law of cosines about O."""
    result = md.solve(
        rod_and_slot(x="0.02 + s", y="4*s**2 - 0.01", range=(0, 0.07)),
        md.Sweep(md.Driver("crank.angle", range="assembled"), poses=5),
    )
    end = complex(0.09, 4 * 0.07**2 - 0.01)
    half = math.acos((0.03**2 + abs(end) ** 2 - 0.08**2) / (2 * 0.03 * abs(end)))
    middle = math.atan2(end.imag, end.real)
    assert result.summary["limits"] == pytest.approx(
        [middle + half, middle - half + 2 * PI], rel=1e-12
    )
    assert result.joints["slot"].s[[0, -1]] == pytest.approx([0.07, 0.07], rel=1e-12)


def test_the_curve_itself_can_be_driven() -> None:
    mechanism = rod_and_slot(x="0.02 + s", y="4*s**2 - 0.01", range=(0, 0.07))
    mechanism = replace(mechanism, sketch=Table({"slot": 0.05, "crank": 1.6}))
    task = md.Sweep(md.Driver("slot.s", from_=0.05, to=0.09, speed=2.0), poses=9)
    result = md.solve(mechanism, task)
    assert list(result.status) == ["ok"] * 5 + ["unassembled"] * 4
    s = result.drivers["slot.s"].position[:5]
    B = result.points["rod.B"]
    assert np.abs(B.position[:5] - np.stack([0.02 + s, 4 * s**2 - 0.01], axis=1)).max() < 1e-16
    assert np.abs(B.velocity[:5] - np.stack([2 + 0 * s, 16 * s], axis=1)).max() < 1e-14
    assert result.unit("drivers", "slot.s", "velocity") == "1/s"
    closed = cam("0.01 + 0.03*cos(s)", "0.03*sin(s)", 0.008)
    closed = replace(closed, sketch=Table({"profile": 1.5, "guide": 0.04}))
    task = md.Sweep(md.Driver("profile.s", range="assembled"), poses=13)
    result = md.solve(closed, task)
    assert result.summary["limits"] == [None, None]
    assert result.bodies["cam"].angle[-1] - result.bodies["cam"].angle[0] == pytest.approx(-2 * PI)


# -- undercut ------------------------------------------------------------------------------------


def test_a_roller_too_large_for_the_curve_is_said_to_cut() -> None:
    """In an ellipse the least radius of curvature is b^2/a; the follower locks at a cusp."""
    a, b = 0.05, 0.04
    fits = md.solve(cam("0.05*cos(s)", "0.04*sin(s)", 0.031, 0.01, side="left"), turn())
    assert fits.fault is None
    assert "undercut" not in fits.summary
    roller = 0.035
    result = md.solve(cam("0.05*cos(s)", "0.04*sin(s)", roller, 0.005, side="left"), turn())
    # by symmetry the roller touches on both sides when the long axis is upright
    (cut,) = result.summary["undercut"]
    assert cut["from"] == pytest.approx(PI / 2, abs=1e-8)
    assert cut["from"] >= PI / 2
    assert cut["to"] == pytest.approx(result.summary["limits"][1], abs=1e-8)  # up to the cusp
    (few,) = md.solve(result.mechanism, turn(poses=7)).summary["undercut"]
    assert few["from"] == pytest.approx(PI / 2, abs=1e-8)  # whatever the poses
    assert cut["joint"] == "profile"
    assert 0 < cut["depth"] < roller
    assert "the roller of joint profile cuts into its curve" in str(result.fault)
    assert [e["joint"] for e in result.events if e["kind"] == "undercut"] == ["profile"]
    # cusp of the parallel: the radius of curvature is that of the roller
    sine2 = ((roller * a * b) ** (2 / 3) - b * b) / (a * a - b * b)
    sine = math.sqrt(sine2)
    cosine = math.sqrt(1 - sine2)
    n = complex(b * cosine, a * sine) / math.hypot(b * cosine, a * sine)
    center = complex(a * cosine, b * sine) - roller * n
    assert result.summary["limits"][1] == pytest.approx(
        PI / 2 - math.atan2(center.imag, center.real), rel=1e-12
    )
    modes = md.solve(
        cam("0.05*cos(s)", "0.04*sin(s)", roller, 0.005, side="left"),
        md.Modes(md.Driver("cam.angle", at=[PI / 2 + 0.02])),
    )
    assert 0 < len(modes.summary["undercut"]) < modes.summary["count"]


def test_a_roller_may_cut_away_from_its_contact() -> None:
    """A peanut: the neck is wide enough for the curvature, not for the roller."""
    law = "(0.03 + 0.012*cos(2*s))"
    for roller, cuts in ((0.010, False), (0.02, True)):
        result = md.solve(cam(f"{law}*cos(s)", f"{law}*sin(s)", roller, 0.03 + roller), turn())
        assert ("undercut" in result.summary) == cuts


# -- modes ---------------------------------------------------------------------------------------


def test_all_contacts_of_a_pin_on_lobes_are_found() -> None:
    """Where the ring is as far from the disc's centre as the pin: all roots of one function."""
    lobes, u = 9, 0.3
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[
            md.Body("crank", {"O": (0, 0), "C": (0.003, 0)}),
            md.Body("disc", {"C": (0, 0), "P": (0.05, 0)}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "crank.O"),
            md.Revolute("C", "crank.C", "disc.C"),
            md.Curve(
                "ring",
                "ground.O",
                "disc.P",
                x=f"0.05*cos(s) + 0.003*cos({lobes}*s)",
                y=f"0.05*sin(s) - 0.003*sin({lobes}*s)",
                closed=True,
            ),
        ],
        sketch={"crank": u, "disc": -u / lobes},
    )
    result = md.solve(mechanism, md.Modes(md.Driver("crank.angle", at=[u])))
    center = 0.003 * np.exp(1j * u)

    def ring(s: object) -> object:
        return 0.05 * np.exp(1j * s) + 0.003 * np.exp(-1j * lobes * s)

    fine = np.linspace(0, 2 * PI, 200_001)
    apart = np.abs(ring(fine) - center) - 0.05
    crossings = fine[:-1][apart[:-1] * apart[1:] < 0]
    assert len(crossings) == 2 * (lobes + 1)
    assert result.summary["count"] == len(crossings)
    assert result.summary["proven"] is False
    s = np.sort(result.joints["ring"].s)
    assert np.abs(s - crossings).max() < 2 * PI / 200_000
    assert np.abs(s + u / lobes - 2 * PI).min() < 1e-13, "the contact of the drive"
    P = result.points["disc.P"].position
    for row, place in enumerate(ring(result.joints["ring"].s)):
        assert abs(complex(*P[row]) - place) < 1e-16
        assert abs(complex(*P[row]) - center) == pytest.approx(0.05, rel=1e-14)
    labels = [label for (label,) in result.labels]
    assert sorted(labels) == sorted(f"{sign}{k}" for sign in "+-" for k in range(1, lobes + 2))


def test_a_sweep_starts_on_the_mode_named_and_the_sketch_may_leave_it_open() -> None:
    mechanism = cam("0.01 + 0.03*cos(s)", "0.03*sin(s)", 0.008)
    lower = md.solve(mechanism, replace(turn(), mode="+1"))
    u = lower.drivers["cam.angle"].position
    y = LONG(0.02) * np.sin(u.astype(LONG)) - slider_crank(0.01, 0.038, u)[0]
    assert largest(lower.points["follower.N"].position[:, 1], y) < 1e-16
    for key, value in (("profile", 1.5), ("profile.s", 1.5), ("guide", 0.03)):
        sketched = replace(mechanism, sketch=Table({"cam": 0.3, key: value}))
        assert md.solve(sketched, turn()).points["follower.N"].position[0, 1] > 0
    with pytest.raises(MechanismError, match="does not tell which assembly mode") as caught:
        md.solve(replace(mechanism, sketch=Table({"cam": 0.3})), turn())
    assert "guide" in caught.value.hint
    assert "profile" in caught.value.hint


# -- bounds --------------------------------------------------------------------------------------

CONIC = "0.03/(1 + 0.3*cos(s))"
RISE = "min(max((s - 1)/1.5, 0), 1)"
FALL = "min(max((s - 4)/1.5, 0), 1)"
DWELL = (
    f"(0.03 + 0.012*({RISE})**3*(10 - 15*{RISE} + 6*({RISE})**2)"
    f" - 0.012*({FALL})**3*(10 - 15*{FALL} + 6*({FALL})**2))"
)
BOUNDS = {
    "division": (cam(f"{CONIC}*cos(s)", f"{CONIC}*sin(s)", 0.006), "proved"),
    "root": (cam("sqrt(9e-4 + 1e-4*cos(s))*cos(s)", "sqrt(9e-4 + 1e-4*cos(s))*sin(s)"), "proved"),
    "exponential": (
        cam(
            "0.02*exp(0.1*s)*cos(s)",
            "0.02*exp(0.1*s)*sin(s)",
            lift=0.025,
            closed=False,
            range=(-9, 9),
        ),
        "proved",
    ),
    "measured divisor": (
        cam("0.0015*cos(s)/(1.05 - cos(s)**2 - sin(s)**2) + 0.01", "0.03*sin(s)", 0.004),
        "estimated",
    ),
    "dwell of one turn": (cam(f"{DWELL}*cos(s)", f"{DWELL}*sin(s)", lift=0.035), "estimated"),
}


@pytest.mark.parametrize("name", BOUNDS)
def test_bounds_hold_in_extended_precision_and_say_what_they_are(name: str) -> None:
    mechanism, how = BOUNDS[name]
    task = turn(-0.5, 3 * PI if "one turn" in name else 1.5, 41)
    problem = Problem(mechanism, Table({"a": task}))
    setting = prepare(problem, task)
    found = run(setting, task)
    result = report(problem, "a", task, setting, found)
    assert set(result.status) == {"ok"}
    assert result.summary["bound"] == how
    poses, constants = found.poses, found.path.constants
    error = true_error(setting.graphs, poses.x, poses.s[:, None], setting.assembler.p)
    assert np.all(error <= poses.error)
    assert constants.estimated == (how == "estimated")
    if name == "dwell of one turn":
        # written for one turn, followed through one and a half
        y = dwell(PI / 2 - result.drivers["cam.angle"].position)
        assert np.abs(result.points["follower.N"].position[:, 1] - y).max() < 1e-16
    if name == "measured divisor":
        assert constants.measured
        assert 0 < constants.floors[0] <= 0.75 * 0.05 * (1 + 1e-12)


def test_a_corner_where_the_curve_closes_is_said() -> None:
    law = "(0.03 + 0.002*s*(2*pi - s))"
    result = md.solve(cam(f"{law}*cos(s)", f"{law}*sin(s)", lift=0.045), turn(-6, 6, 49))
    assert set(result.status) == {"ok"}
    s = np.remainder(PI / 2 - result.drivers["cam.angle"].position, 2 * PI)
    place = 0.03 + 0.002 * s * (2 * PI - s)
    assert np.abs(result.points["follower.N"].position[:, 1] - place).max() < 2e-17
    rate = -0.002 * (2 * PI - 2 * s) * SPEED
    assert np.abs(result.points["follower.N"].velocity[:, 1] - rate).max() < 1e-15
    (note,) = result.summary["notes"]
    angle = 2 * math.degrees(math.atan2(0.004 * PI, 0.03))
    assert f"a corner of {angle:.3g} degrees" in note
    smooth = md.solve(BOUNDS["dwell of one turn"][0], turn(0, 1, 2))
    assert "notes" not in smooth.summary


def dwell(s: object) -> object:
    """The law of the cam with two dwells."""

    def rise(w: object) -> object:
        w = np.clip(w, 0, 1)
        return w**3 * (10 - 15 * w + 6 * w * w)

    s = np.remainder(s, 2 * PI)
    return 0.03 + 0.012 * rise((s - 1) / 1.5) - 0.012 * rise((s - 4) / 1.5)


def test_a_mechanism_without_curves_pays_nothing() -> None:
    problem = md.load("four-bar-crank-rocker")
    graphs = prepare(problem, problem.tasks["turn"]).graphs
    assert graphs.floors.symbols.numel() == 0
    assert graphs.pose.n_instructions() == 253
    assert graphs.advance.n_instructions() == 289
    assert not graphs.enclosed


X, P = ca.SX.sym("x", 3), ca.SX.sym("p", 2)
EXPRESSIONS = [
    ca.exp(X[0]) * P[0] - ca.tanh(X[1]),
    ca.sqrt(2 + ca.sin(X[0])) / (3 + ca.cos(X[1])),
    ca.fmin(ca.fmax(X[0] / P[1], -0.4), 0.9) ** 3,
    ca.sinh(X[0]) * ca.cosh(X[1]) + ca.atan(X[2]),
    ca.fabs(X[0]) * ca.sign(X[1]) - ca.remainder(X[2], 1.3),
    ca.log(4 + X[0]) + ca.asin(X[1] / 4) - ca.acos(X[2] / 4),
    (3.5 + X[0]) ** 2.5 + (3.5 + X[0]) ** (-2) + X[1] ** 3,
    ca.atan2(5 + X[0], X[1]) + ca.tan(X[2] / 3),
    ca.if_else(X[0] <= X[1], X[2], X[0] * X[1]),
    2.0 ** X[0] + P[1] ** X[1] - 1 / (X[2] - 4),
]


@pytest.mark.parametrize("k", range(len(EXPRESSIONS)))
def test_enclosures_hold_values_slopes_and_rounding(k: int) -> None:
    random = np.random.default_rng(k)
    slopes = ca.vec(ca.jacobian(EXPRESSIONS[k], X))
    both = ca.densify(ca.vertcat(EXPRESSIONS[k], slopes))
    floor = ca.SX.sym("floor", 16)
    low, high = ca.SX.sym("low", 3), ca.SX.sym("high", 3)
    floors = Floors(floor)
    bounds = enclosure(both, [X], [(low, high)], floors)
    divisors = ca.vertcat(*floors.divisors) if floors.divisors else ca.SX(0, 1)
    measured = ca.Function("d", [X, P], [ca.fabs(divisors)])
    function = ca.Function("b", [low, high, P, floor], list(bounds))
    exact = ca.Function("e", [X, P], [both])
    from mechdae.bench.extended import evaluate

    p = np.array([-0.7, 1.9])
    for width in (3.0, 0.1):
        for _ in range(40):
            a = random.uniform(-2.9, 2.9 - width if width < 3 else 0.0, 3)
            x = a + width * random.uniform(0, 1, 3)
            x, b = np.minimum(x, 2.9), np.minimum(a + width, 2.9)
            kept = np.zeros(16)
            kept[: divisors.numel()] = np.array(measured(x, p)).ravel()
            top, slack = (np.array(part).ravel() for part in function(a, b, p, kept))
            value = np.array(exact(x, p)).ravel()
            assert np.all(np.abs(value) <= top * (1 + 1e-12) + 1e-300)
            inputs = [np.asarray(x, LONG)[None, :], np.asarray(p, LONG)[None, :]]
            true = evaluate(exact, inputs)[0]
            assert np.all(np.abs(value - true) <= slack * 2.0**-53 + 1e-30)


def test_divisors_bounded_by_their_interval_need_no_measure() -> None:
    low, high = ca.SX.sym("low", 3), ca.SX.sym("high", 3)
    least = lower_bounds(ca.vertcat(2 + ca.sin(X[0]), X[1], 1 + X[2] ** 2), [X], [(low, high)])
    value = ca.Function("l", [low, high], [least])
    assert np.array(value([-9, -1, -2], [9, 1, 2])).ravel() == pytest.approx([1, 0, 1])
    assert np.array(value([1.4, 1, 3], [1.6, 2, 4])).ravel() == pytest.approx(
        [2.9, 1, 10], rel=0.01
    )
    with pytest.raises(NoMajorant):
        enclosure(ca.erf(X), [X], [(low, high)], Floors(ca.SX.sym("f", 4)))


# -- description ---------------------------------------------------------------------------------


def test_structure_counts_one_higher_pair() -> None:
    problem = md.load("cam-roller-follower")
    shown = structure(problem)
    count = shown["mobility"]
    assert (count["n"], count["p5"], count["p4"], count["W"]) == (2, 2, 1, 1)
    assert count["rank"]["mobility"] == 1
    assert shown["formulas"][0]["formula"] == "I(1) -> II cam(2)"
    assert shown["groups"][1]["joints"] == ["guide", "profile"]
    # a follower that hangs on a cam driven by gears stays a group of its own
    drive = structure(md.load("hypocycloid-drive"))["formulas"][0]
    assert drive["formula"] == "I(1) -> II gear(2) -> {II.5 RPP(3,4); II cam(5)}"


def test_outputs_of_a_contact() -> None:
    problem = md.load("hypocycloid-drive")
    task = replace(problem.tasks["turns"], outputs=("lobes",), poses=5)
    result = md.solve(problem, task)
    assert set(result.joints["lobes"]) == {"s", "s_velocity", "s_acceleration"}
    assert result.summary["not_in_scene"] == ["cross", "output"]
    units = {name: unit for name, unit, _ in result.columns()}
    assert units["lobes.s"] == "1"
    assert units["lobes.s_acceleration"] == "1/s2"


@pytest.mark.parametrize("roller", [0.008, None])
def test_the_pressure_angle_is_that_of_the_slider_crank(roller: float | None) -> None:
    """Its complement, the transmission angle: acos(e |cos u| / rod)."""
    radius = 0.038 - (roller or 0.0)
    mechanism = cam(f"0.01 + {radius}*cos(s)", f"{radius}*sin(s)", roller)
    result = md.solve(mechanism, replace(turn(0.0, 2.0, 9), measures=("transmission",)))
    u = result.drivers["cam.angle"].position
    angle = result.joints["profile"].transmission_angle
    assert np.abs(angle - np.arccos(0.01 * np.abs(np.cos(u)) / 0.038)).max() < 1e-14
    found = result.summary["transmission"]["profile"]
    assert (found["min"], found["max"]) == pytest.approx((math.acos(0.01 / 0.038), PI / 2))
    assert (found["at"], found["max_at"]) == pytest.approx((0.0, PI / 2), abs=1e-12)


def test_a_study_of_a_cam_follows_each_set_alone() -> None:
    problem = md.load("cam-roller-follower")
    problem = problem.with_task("turn", replace(problem.tasks["turn"], poses=3))
    path = "points/follower.R/position"
    study = md.Study(of="turn", vary={"h": [0.01, 0.014, 2]}, outputs=(path,))
    table = md.solve(problem, study).table[path]
    for k, h in enumerate((0.01, 0.014)):
        alone = md.solve(problem, "turn", set={"h": h})
        assert np.array_equal(table[k], alone.points["follower.R"].position)


def test_a_curve_is_written_and_read_back() -> None:
    for name in ("cam-roller-follower", "hypocycloid-drive"):
        problem = md.load(name)
        import tomllib

        again = from_dict(tomllib.loads(dumps(problem)), name)
        assert again.mechanism == problem.mechanism
    millimetres = from_dict(
        tomllib.loads(
            dumps(Problem(cam("60*cos(s)", "40*sin(s)", closed=True)))
            .replace('x = "60', 'x_mm = "60')
            .replace('y = "40', 'y_mm = "40')
        )
    )
    assert millimetres.mechanism.joints["profile"].x == "(60*cos(s))/1000"
    changed = millimetres.with_values({"profile.end_deg": 360})
    assert changed.mechanism.values()["profile.end"] == pytest.approx(2 * PI)


BAD = [
    ({"closed": False}, "joints.profile.range: the key 'range' is missing"),
    ({"x": "0.03", "y": "0.04"}, "joints.profile.x: neither x nor y depends on s"),
    ({"x": "0.03*cos(t)"}, "joints.profile.x: unknown name 't'"),
    ({"x": "radus*cos(s)"}, "joints.profile.x: unknown name 'radus'"),
    ({"range": (0, 6)}, "joints.profile.closed: the curve is not closed"),
    ({"range": (6, 0)}, "joints.profile.range: range ends at 0, not after its start 6"),
    ({"roller": -0.01}, "joints.profile.roller_radius: roller_radius is negative"),
    ({"x": "sqrt(cos(s))"}, "joints.profile.x: 'sqrt(cos(s))' has no value"),
    ({"x": "0.03/(s - 0)"}, "joints.profile.x: '0.03/(s - 0)' has no value"),
    ({"x": "0*s", "y": "0*s"}, "joints.profile.x: the curve is a single point"),
    ({"side": "inside"}, "side: unknown side 'inside'"),
    ({"x": "import os"}, "x: 'import os' is not an expression"),
]


@pytest.mark.parametrize(("keys", "message"), BAD)
def test_what_is_no_curve_is_refused(keys: dict, message: str) -> None:
    whole = {"x": "0.03*cos(s)", "y": "0.03*sin(s)", **keys}
    with pytest.raises(MechdaeError) as caught:
        cam(**whole)
    assert message in str(caught.value)


def test_a_parameter_may_not_be_called_like_that_of_the_curve() -> None:
    mechanism = cam("0.03*cos(s)", "0.03*sin(s)")
    with pytest.raises(MechanismError, match="is the parameter of the curve in joint profile"):
        replace(mechanism, parameters=Table({"s": 1.0}))


def test_a_contact_beyond_the_ends_does_not_assemble() -> None:
    mechanism = rod_and_slot(x="s", y=0, range=(0.2, 0.3))
    task = md.Sweep(md.Driver("crank.angle", from_=0.0, to=1.0))
    (error,) = validate(Problem(mechanism, Table({"a": task})))
    assert "group II cam(2) cannot be assembled" in str(error)


# -- pictures ------------------------------------------------------------------------------------


def test_cam_roller_groove_and_track_are_drawn() -> None:
    def drawn(result: object) -> dict:
        ax = md.plot(result, "diagram")
        return {artist.get_gid(): artist for artist in ax.get_children() if artist.get_gid()}

    problem = md.load("cam-roller-follower")
    result = md.solve(problem, "turn", poses=3)
    found = drawn(result)
    outline = np.array(found["joint-profile-curve"].get_xydata())
    u = result.drivers["cam.angle"].position[0]
    values = problem.mechanism.values()
    at_start = (values["base"] + 0.0) * np.array([math.cos(u), math.sin(u)])
    assert np.hypot(*(outline - at_start).T).min() < 1e-12
    roller = found["joint-profile-roller"]
    assert roller.get_radius() == pytest.approx(values["rho"], rel=1e-9)
    gap = np.hypot(*(outline - np.array(roller.center)).T).min()
    assert gap == pytest.approx(values["rho"], rel=1e-3), "the roller touches the cam"
    slot = rod_and_slot(x="0.02 + s", y="4*s**2 - 0.01", range=(0, 0.07))
    result = md.solve(slot, md.Sweep(md.Driver("crank.angle", at=[2.0])))
    assert {"joint-slot-curve", "joint-slot-follower"} <= set(drawn(result))
    driven = replace(slot, sketch=Table({"slot": 0.05, "crank": 1.6}))
    result = md.solve(driven, md.Sweep(md.Driver("slot.s", at=[0.05])))
    assert "driver-slot.s" in drawn(result)
