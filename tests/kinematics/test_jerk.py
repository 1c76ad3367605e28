"""Third derivatives against closed forms in 80-bit floats: a driver, laws of time, two drivers."""

from __future__ import annotations

from dataclasses import replace
from math import factorial

import numpy as np
import pytest

import mechdae as md
from mechdae.motion.kinematics.prepared import prepare
from mechdae.tasks.export import csv_text
from tests.reference.closed_forms import MECHANISMS, circle_circle
from tests.reference.jets import Jet, derivatives, unit
from tests.shared.series import jerk_of

LONG = np.longdouble
SWEEPS = [
    ("four-bar-crank-rocker", "turn"),
    ("four-bar-double-rocker", "window"),
    ("geared-five-bar", "turns"),
    ("gorshkov-seven-link", "window"),
    ("jansen-leg", "turn"),
    ("peaucellier", "window"),
    ("scotch-yoke", "turn"),
    ("slider-crank-offset", "turn"),
    ("whitworth-quick-return", "turn"),
]
ACCELERATION, JERK = 7.0, -30.0


@pytest.mark.parametrize(("name", "task"), SWEEPS)
def test_jerk_against_the_closed_form(name: str, task: str) -> None:
    problem = md.load(name)
    sweep = problem.tasks[task]
    driver = replace(sweep.driver, acceleration=ACCELERATION, jerk=JERK)
    result = md.solve(problem, replace(sweep, driver=driver, derivatives=3, poses=73))
    given = next(iter(result.drivers.values()))
    assert set(given.jerk) == {JERK}
    w, fine = LONG(given.velocity[0]), np.asarray(result.status) == "ok"
    closed = derivatives(MECHANISMS[name], np.asarray(given.position, dtype=LONG), 3)
    compared = 0
    tables = [*result.points.items(), *result.bodies.items(), *result.joints.items()]
    for part, series in tables:
        if part not in closed[0] or not any("jerk" in entry for entry in series):
            continue
        f1, f2, f3 = (np.asarray(closed[k][part])[fine] for k in (1, 2, 3))
        theirs = f3 * w**3 + 3 * f2 * w * ACCELERATION + f1 * JERK
        gap = np.abs(jerk_of(series)[fine] - theirs).astype(float)
        size = np.abs(theirs).astype(float)
        # a pose loses as many digits as its condition says, five times at worst; in fact
        # the whole sweep agrees to 1e-13 of the largest jerk
        assert np.all(gap <= 1e-15 * result.condition[fine] ** 5 * (size + abs(float(w)) ** 3))
        assert gap.max(initial=0.0) <= 1e-13 * size.max(initial=0.0) + 1e-300, part
        compared += 1
    assert compared >= 5
    assert np.isnan(result.points[next(iter(result.points))].jerk[~fine]).all()


def test_jerk_by_a_law_of_time() -> None:
    """theta = 0.7 + sin(3 t): the series of the mechanism in t itself."""
    times = [0.0, 0.1, 0.35, 0.8]
    driver = md.Driver("crank.angle", law="0.7 + sin(3*t)", times=times)
    result = md.solve("four-bar-crank-rocker", md.Sweep(driver, derivatives=3))
    t = np.array(times, dtype=LONG)
    sine, cosine = np.sin(3 * t), np.cos(3 * t)
    u = Jet([LONG("0.7") + sine, 3 * cosine, -9 * sine / 2, -27 * cosine / 6])
    closed = MECHANISMS["four-bar-crank-rocker"](u)
    assert result.drivers["crank.angle"].jerk == pytest.approx((-27 * cosine).astype(float))
    for part, series in [*result.points.items(), *result.bodies.items()]:
        if part in closed:
            theirs = closed[part].c[3] * factorial(3)
            assert np.abs(jerk_of(series) - theirs).max() < 1e-13 * (np.abs(theirs).max() + 1), part


def test_jerk_of_two_drivers() -> None:
    """A five-bar whose two cranks follow laws of their own."""
    mechanism = md.Mechanism(
        ground=md.Ground(points={"A": [0, 0], "D": [1, 0]}),
        bodies=[
            md.Body("left", points={"A": [0, 0], "B": [0.8, 0]}),
            md.Body("right", points={"D": [0, 0], "C": [0.7, 0]}),
            md.Body("one", points={"B": [0, 0], "P": [1.1, 0]}),
            md.Body("two", points={"C": [0, 0], "P": [1.2, 0]}),
        ],
        joints=[
            md.Revolute("A", "ground.A", "left.A"),
            md.Revolute("D", "ground.D", "right.D"),
            md.Revolute("B", "left.B", "one.B"),
            md.Revolute("C", "right.C", "two.C"),
            md.Revolute("P", "one.P", "two.P"),
        ],
        sketch={"left": 2.0, "right": 0.9, "one": 0.8, "two": 2.1},
    )
    times = [0.0, 0.2, 0.5]
    drivers = [
        md.Driver("left.angle", law="2 + sin(t)", times=times),
        md.Driver("right.angle", law="0.9 - t**3/2 + t/4", times=times),
    ]
    result = md.solve(mechanism, md.Sweep(drivers=drivers, derivatives=3))
    assert set(result.status) == {"ok"}
    t = np.array(times, dtype=LONG)
    left = Jet([2 + np.sin(t), np.cos(t), -np.sin(t) / 2, -np.cos(t) / 6])
    right = Jet([LONG("0.9") - t**3 / 2 + t / 4, -3 * t**2 / 2 + 0.25, -3 * t / 2, -0.5 + 0 * t])
    b = unit(left) * LONG("0.8")
    c = unit(right) * LONG("0.7") + 1.0
    p = circle_circle(b, LONG("1.1"), c, LONG("1.2"), 1)
    ours = result.points["one.P"]
    place = ours.position[:, 0] + 1j * ours.position[:, 1]
    assert np.abs(place - p.c[0]).max() < 1e-15
    theirs = p.c[3] * 6
    assert np.abs(jerk_of(ours) - theirs).max() < 1e-13 * np.abs(theirs).max()


def test_straight_lines_of_two_drivers_have_no_jerk_of_their_own() -> None:
    """Two sliders carry a point: what is linear in the drivers has no third rate."""
    mechanism = md.Mechanism(
        ground=md.Ground(points={"O": [0, 0]}),
        bodies=[
            md.Body("x", points={"P": [0, 0]}),
            md.Body("y", points={"P": [0, 0]}),
        ],
        joints=[
            md.Prismatic("gx", "ground.O", "x.P"),
            md.Prismatic("gy", "x.P", "y.P", axis=np.pi / 2),
        ],
    )
    drivers = [
        md.Driver("gx.slide", from_=0, to=1, speed=2, jerk=5),
        md.Driver("gy.slide", from_=0, to=3, speed=6),
    ]
    result = md.solve(mechanism, md.Sweep(drivers=drivers, poses=3, derivatives=3))
    assert result.points["y.P"].jerk == pytest.approx(np.array([[5.0, 0.0]] * 3), abs=1e-15)
    assert result.drivers["gy.slide"].jerk.tolist() == [0, 0, 0]
    assert result.joints["gx"].slide_jerk == pytest.approx([5, 5, 5])


def test_units_and_what_is_refused() -> None:
    problem = md.load("slider-crank-offset")
    sweep = replace(problem.tasks["turn"], poses=3, derivatives=3)
    head = csv_text(md.solve(problem, sweep)).split("\n")[0]
    for title in (
        "crank.angle.jerk [rad/s3]",
        "rod.angular_jerk [rad/s3]",
        "rod.C.jerk.y [m/s3]",
        "slide_jerk [m/s3]",
    ):
        assert title in head
    with pytest.raises(md.UnavailableError, match="above the third"):
        md.solve(problem, replace(sweep, derivatives=4))
    law = md.Driver("crank.angle", law="t", times=[0.0], jerk=1.0)
    with pytest.raises(md.InputError, match="gives its rates itself") as caught:
        md.solve(problem, md.Sweep(law))
    assert "driver.jerk" in str(caught.value)


def test_an_unknown_third_derivative_of_a_law_is_left_out() -> None:
    """t**2.5 has a speed and an acceleration at 0, its third derivative is infinite there."""
    driver = md.Driver("crank.angle", law="t**2.5", times=[0.0, 1.0])
    result = md.solve("slider-crank", md.Sweep(driver, derivatives=3))
    assert np.isfinite(result.points["rod.C"].acceleration).all()
    assert np.isnan(result.points["rod.C"].jerk[0, 0])  # across the guide it stands still
    assert np.isnan(result.points["crank.B"].jerk[0]).all()
    assert np.isfinite(result.points["rod.C"].jerk[1]).all()


def test_no_jerk_is_made_up_at_a_change_point() -> None:
    """A parallelogram passes its change point at pi: the expansion there has no third rate."""
    problem = md.load("change-point-parallelogram")
    driver = md.Driver("crank.angle", at=[2.0, np.pi - 0.001, np.pi, 4.0], speed=2.0)
    result = md.solve(problem, replace(problem.tasks["turn"], driver=driver, derivatives=3))
    assert set(result.status) == {"ok"}
    series = result.points["rocker.C"]
    assert np.isfinite(series.acceleration).all()
    assert np.isnan(series.jerk).any(axis=1).tolist() == [False, True, True, False]
    arm = series.position - [problem.mechanism.values()["ground.D.x"], 0]
    expected = 8 * np.stack([arm[:, 1], -arm[:, 0]], axis=1)  # -omega^3 k x r
    assert series.jerk[[0, 3]] == pytest.approx(expected[[0, 3]], abs=1e-12)
    assert np.isfinite(result.points["crank.B"].jerk).all()


@pytest.mark.parametrize(("name", "pose", "step"), [("four-bar-crank-rocker", 290, 289)])
def test_nobody_else_pays_for_the_third_derivative(name: str, pose: int, step: int) -> None:
    problem = md.load(name)
    graphs = prepare(problem, problem.tasks["turn"]).graphs
    assert graphs.pose.n_instructions() <= pose
    assert graphs.advance.n_instructions() <= step
