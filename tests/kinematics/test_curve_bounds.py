"""Bounds of curve joints hold in extended precision, corners are said."""

from __future__ import annotations

import math

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.problem import Problem
from mechdae.describe.values import Table
from mechdae.motion.kinematics.prepared import prepare
from mechdae.motion.kinematics.report import report
from mechdae.motion.kinematics.sweep import run
from mechdae.parts.bench.kinematics import true_error
from tests.shared.cams import PI, turn
from tests.shared.mechanisms import SPEED, cam

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
    assert graphs.pose.n_instructions() == 257
    assert graphs.advance.n_instructions() == 289
    assert not graphs.enclosed
