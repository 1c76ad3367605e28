"""Stiff forces in motion: both methods against closed forms and a Radau method of the tests."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from tests.reference.pendulums import G, radau
from tests.shared.pendulums import bobs, pendulum

# -- an own integration ------------------------------------------------------------------------


NAMES = {"bdf": "bdf, CVODES", "radau": "Radau IIA 5"}
BOTH = pytest.mark.parametrize("method", list(NAMES))


@BOTH
@pytest.mark.parametrize("tolerance", [1e-8, 1e-10])
def test_a_stiff_hinge(tolerance: float, method: str) -> None:
    """Relative rates of 4e4 1/s: the explicit method takes 6000 steps a second."""
    wanted = radau(1e4, 0.0, 1.0, 600)
    result = md.solve(from_dict(pendulum(1e4, method=method, tolerance=tolerance)), "m")
    found = [result.bodies[name].angle[-1] for name in ("upper", "lower")]
    assert np.max(np.abs(found - wanted[:2])) <= 50 * tolerance
    speeds = [result.bodies[name].angular_velocity[-1] for name in ("upper", "lower")]
    assert np.max(np.abs(speeds - wanted[2:])) <= 500 * tolerance
    assert result.summary["steps"] <= 400
    assert result.summary["method"] == NAMES[method]
    assert result.fault is None
    assert result.checks["energy"] <= 1e2 * tolerance


@BOTH
def test_a_stiff_damper_whose_direction_turns_and_closed_constraints(method: str) -> None:
    wanted = radau(0.0, 1e4, 1.0, 600)
    times = [0.1, 0.25, 0.7, 1.0]  # not at equal intervals
    result = md.solve(from_dict(bobs(1e4, method=method, tolerance=1e-10, at=times)), "m")
    assert (result.summary["coordinates"], result.summary["constraints"]) == (4, 2)
    assert np.max(result.scalars.drift) <= 1e-14
    assert result.summary["drift_of_speeds"] <= 1e-12
    assert result.time.tolist() == times
    place = result.points["b.Q"].position[-1]
    x = math.sin(wanted[0]) + math.sin(wanted[1])
    assert place[0] == pytest.approx(x, abs=1e-8)
    assert place[1] == pytest.approx(-math.cos(wanted[0]) - math.cos(wanted[1]), abs=1e-8)
    middle = radau(0.0, 1e4, 0.25, 400)
    assert result.points["a.P"].position[1][0] == pytest.approx(math.sin(middle[0]), abs=1e-8)


@BOTH
def test_a_heavily_damped_spring(method: str) -> None:
    """x'' = -c x' - k x: exponentials with rates of 1e6 and 1e-1 1/s."""
    c, k = 1e6, 1e5
    data = pendulum(0.0)
    data["bodies"] = {"block": {"points": {"P": [0, 0]}, "mass": 1.0}}
    data["joints"] = {"guide": {"kind": "prismatic", "between": ["ground.O", "block.P"]}}
    data["loads"] = {"s": {"kind": "spring", "coordinate": "guide.slide",
                           "stiffness": k, "damping": c}}  # fmt: skip
    data.pop("sketch")
    data["gravity"] = [0, 0]
    data["tasks"]["m"] |= {"start": {"guide": {"slide": 1.0}}, "method": method, "at": [20.0]}
    result = md.solve(from_dict(data), "m")
    slow, fast = k / (c / 2 + math.sqrt(c * c / 4 - k)), c / 2 + math.sqrt(c * c / 4 - k)
    wanted = (fast * math.exp(-slow * 20) - slow * math.exp(-fast * 20)) / (fast - slow)
    assert result.joints["guide"].slide[-1] == pytest.approx(wanted, abs=1e-7)
    assert result.work["s"][-1] == pytest.approx(-k / 2 * (1 - wanted**2), rel=1e-6)
    assert result.summary["steps"] <= 1000


@pytest.mark.parametrize("make", [pendulum, bobs])
def test_work_is_within_three_times_that_of_cvodes_alone(make: Any) -> None:
    """Right-hand sides; `motion_long.py` measures times."""
    from benchmarks.integrators import sundials
    from mechdae.dynamics.bdf import Cvodes
    from mechdae.parts.bench.motions import work_of

    problem = from_dict(make(1e4, at=[5.0]))
    work = work_of(problem)
    assert work is not None
    plain = next(way for method, _, way in sundials(work, (1e-8,)) if method == "CVODES BDF")
    work.setup.tolerance = 1e-8  # Work left that of its reference
    own = Cvodes(work.setup)
    start = own.first(0.0, work.x, work.v, np.zeros(len(work.setup.works)), work.none)
    drifts = [
        work.drift(state[own.layout["x"]])
        for nodes in own.steps(start, work.none)
        for state in nodes.states
    ]
    assert max(drifts) <= 1e-10
    assert own.rhs <= 3 * plain().rhs


# -- S6 ----------------------------------------------------------------------------------------


def test_stiffness_is_found_within_2000_steps_and_proposes_the_key() -> None:
    result = md.solve(from_dict(pendulum(1e4, at=[0.2])), "m")
    (event,) = [event for event in result.events if event["kind"] == "stiff"]
    assert (event["code"], event["load"], event["method"]) == ("S6", "damper", "bdf")
    k = math.cos(0.5)  # (b - a)'' = -c (3 + 2 k)/(2 - k^2) (b - a)', k = cos(a - b)
    assert event["rate"] == pytest.approx(1e4 * (3 + 2 * k) / (2 - k * k), rel=0.05)
    assert any('method = "bdf"' in note for note in result.summary["notes"])
    until = md.solve(from_dict(pendulum(1e4, at=[event["at"]])), "m")
    assert until.summary["steps"] + until.summary["rejected"] <= 2000


def test_auto_turns_to_the_stiff_method_where_it_is_stiff() -> None:
    wanted = radau(1e4, 0.0, 1.0, 600)
    result = md.solve(from_dict(pendulum(1e4, method="auto")), "m")
    assert result.summary["method"] == "explicit, Dormand-Prince 8(5,3); then bdf, CVODES"
    assert result.summary["steps"] <= 600
    assert result.bodies["upper"].angle[-1] == pytest.approx(wanted[0], abs=1e-7)
    soft = md.solve(from_dict(pendulum(1.0, method="auto")), "m")
    assert soft.summary["method"] == "explicit, Dormand-Prince 8(5,3)"
    plain = md.solve(from_dict(pendulum(1.0)), "m")
    assert soft.bodies["upper"].angle[-1] == plain.bodies["upper"].angle[-1]


# -- events and friction -------------------------------------------------------------------------


def changed(name: str, **keys: Any) -> md.Result:
    problem = md.load(name)
    task = dataclasses.replace(problem.tasks["motion"], **keys)
    return md.solve(problem.with_task("m", task), "m")


@BOTH
def test_crossings_are_located(method: str) -> None:
    problem = md.load("pendulum")
    task = dataclasses.replace(problem.tasks["curves"], method=method, tolerance=1e-10)
    result = md.solve(problem.with_task("m", task), "m")
    period = 2.36784194757623744930
    times = np.array([event["at"] for event in result.events])
    assert times == pytest.approx([(0.25 + k / 2) * period for k in range(4)], abs=2e-8)


@BOTH
def test_dry_friction_sticks(method: str) -> None:
    result = changed("incline-block", until=1e4, method=method)
    slope = math.radians(20)
    down = G * (math.sin(slope) + 0.5 * math.cos(slope))
    assert result.summary["rests_from"] == pytest.approx(2.0 / down, rel=1e-9)
    assert result.joints["guide"].slide[-1] == pytest.approx(2.0 / down, abs=1e-9)
    assert np.ptp(result.joints["guide"].slide[1:]) == 0.0


@BOTH
def test_coasting_slider_crank(method: str) -> None:
    result = changed("coasting-slider-crank", tolerance=1e-8, method=method)
    assert result.outputs["turned"].value[-1] == pytest.approx(12.121009647567854, abs=1e-6)
    assert result.fault is None


@BOTH
def test_a_singular_pose_is_a_fault(method: str) -> None:
    """The method does not stay on the motion behind it; the answer is never without a word."""
    problem = md.load("n-four-bar")
    task = dataclasses.replace(problem.tasks["motion"], method=method, tolerance=1e-9)
    result = md.solve(problem.with_task("m", task).with_values({"t_end": 1.0}), "m")
    assert any(event["kind"] == "singular" for event in result.events)
    assert 'try method = "explicit"' in (result.fault or "")


@BOTH
def test_states_are_kept_where_forces_end(method: str) -> None:
    data = pendulum(0.0, method=method, until=1.0)
    data["tasks"]["m"].pop("at")
    data["loads"] = {"motor": {"kind": "torque", "body": "upper", "value": "sqrt(0.5 - t)"}}
    result = md.solve(from_dict(data), "m")
    assert "step size went to nothing" in (result.fault or "")
    assert result.time[-1] == pytest.approx(0.5, abs=1e-9)
    assert np.isfinite(result.bodies["lower"].angle).all()


@pytest.mark.parametrize("scale", [1e-6, 1e3])
@BOTH
def test_lengths_change_nothing(scale: float, method: str) -> None:
    plain = md.solve(from_dict(bobs(100.0, method=method)), "m")
    data = bobs(100.0, method=method)
    data["gravity"] = [0, -G * scale]
    for joint in data["joints"].values():
        joint["length"] = scale
    data["sketch"] = {name: value * scale for name, value in data["sketch"].items()}
    result = md.solve(from_dict(data), "m")
    assert result.summary["steps"] == plain.summary["steps"]
    gap = result.points["b.Q"].position / scale - plain.points["b.Q"].position
    assert np.max(np.abs(gap)) <= 1e-12
