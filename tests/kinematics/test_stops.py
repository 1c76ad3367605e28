"""Limits of joints: statuses, events, messages, against the law of cosines."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from mechdae.errors import InputError, MechanismError

A, B, C, D = 0.04, 0.12, 0.08, 0.1
HIGH = math.radians(110)
"""Of the four-bar's rocker."""


def limited(problem: md.Problem, joint: md.Revolute | md.Prismatic) -> md.Problem:
    """Return the problem with a joint in place of the one of its name."""
    joints = problem.mechanism.joints.with_(joint.name, joint)
    return replace(problem, mechanism=replace(problem.mechanism, joints=joints))


def four_bar(limits: object = (math.radians(50), HIGH), joint: str = "D") -> md.Problem:
    """Return the crank-rocker with limits in one of its joints."""
    problem = md.load("four-bar-crank-rocker")
    mechanism = problem.mechanism
    pin = md.Revolute(
        joint, mechanism.joints[joint].first, mechanism.joints[joint].second, limits=limits
    )
    return limited(problem, pin)


def crank_angles(rocker: float) -> list[float]:
    """Return the crank's angles at an angle of the rocker, both ways of the dyad, in [0, 2 pi]."""
    x, y = D + C * math.cos(rocker), C * math.sin(rocker)
    far, way = math.hypot(x, y), math.atan2(y, x)
    inner = math.acos((A**2 + far**2 - B**2) / (2 * A * far))
    return sorted((way + sign * inner) % (2 * math.pi) for sign in (1, -1))


def test_a_sweep_names_where_stops_are_met() -> None:
    result = md.solve(four_bar(), "turn")
    plain = md.solve("four-bar-crank-rocker", "turn")
    u = np.asarray(result.drivers["crank.angle"].position)
    first, last = crank_angles(HIGH)
    beyond = (u > first) & (u < last)
    assert (np.asarray(result.status) == np.where(beyond, "stopped", "ok")).all()
    events = [event for event in result.events if event.kind == "stop"]
    assert np.allclose([event.at for event in events], [first, last], rtol=0, atol=1e-12)
    assert [(e["joint"], e["direction"]) for e in events] == [("D", "up"), ("D", "down")]
    assert [e["value"] for e in events] == pytest.approx([HIGH] * 2)
    assert result.summary["stopped"] == ["D"]
    assert "joint D is beyond its greatest angle of 110 deg at crank.angle = 149 deg" in str(
        result.fault
    )
    angle = result.bodies["rocker"].angle
    assert np.array_equal(angle, plain.bodies["rocker"].angle), "values stay"
    assert np.array_equal(result.bound["angle"], plain.bound["angle"])


def test_poses_beyond_either_stop_are_counted_for_themselves() -> None:
    rocker = np.asarray(md.solve("four-bar-crank-rocker", "turn").bodies["rocker"].angle)
    low, high = rocker.min() + 0.1, rocker.max() - 0.2
    said = str(md.solve(four_bar((low, high)), "turn").fault).split("; ")
    counts = {"least": int((rocker < low).sum()), "greatest": int((rocker > high).sum())}
    assert counts["least"] != counts["greatest"]
    for word, count in counts.items():
        (own,) = [text for text in said if word in text]
        assert own.endswith(f"and {count - 1} more poses")


def test_one_pose_says_which_limit() -> None:
    sweep = md.Sweep(driver=md.Driver("crank.angle", at=(math.pi,)))
    result = md.solve(four_bar(), sweep)
    assert result.status.tolist() == ["stopped"]
    assert str(result.fault) == (
        "joint D is beyond its greatest angle of 110 deg at crank.angle = 180 deg"
    )
    assert md.solve(four_bar(), md.Sweep(driver=md.Driver("crank.angle", at=(0.5,)))).fault is None


def test_rows_of_a_solver_have_statuses() -> None:
    """With other numbers near by, sets for each row, and step by step."""
    solver = md.Solver(four_bar(), "turn", vary=["b", "D.limits.high"])
    rows = solver.poses({}, [0.5, 3.0, 1.0])
    assert rows.status.tolist() == ["ok", "stopped", "ok"]
    assert rows.ok.tolist() == [True, False, True]
    assert rows.faults == {1: "joint D is beyond its greatest angle of 110 deg"}
    assert np.isfinite(rows["bodies/rocker/angle"]).all()
    assert solver.poses({"D.limits.high": 2.2}, [3.0]).ok.all()
    highs = np.linspace(1.8, 2.4, 12)
    sets = solver.poses({"b": np.full(12, B), "D.limits.high": highs}, 3.0)
    angle = md.Solver("four-bar-crank-rocker").poses({}, [3.0])["bodies/rocker/angle"]
    assert sets.status.tolist() == np.where(highs < angle, "stopped", "ok").tolist()
    pose = None
    for u, status in ((1.0, "ok"), (2.5, "ok"), (2.7, "stopped"), (2.4, "ok")):
        pose = solver.track(pose, [u])
        assert pose.status.tolist() == [status]


def test_rows_of_several_drivers() -> None:
    problem = md.load("five-bar-robot")
    joints = problem.mechanism.joints
    pin = md.Revolute("B", joints["B"].first, joints["B"].second, limits=(-math.pi, -1.4))
    solver = md.Solver(limited(problem, pin), "circle")
    u = np.column_stack([np.linspace(0.05, 0.15, 9), np.linspace(0.3, 0.4, 9)])
    swept = md.solve(limited(problem, pin), "circle")
    turns = swept.bodies["tip"].angle - swept.bodies["left"].angle
    within = (turns + math.pi) % (2 * math.pi) - math.pi <= -1.4
    assert (swept.status == np.where(within, "ok", "stopped")).all(), "two drivers go around"
    poses = solver.poses({}, u)
    relative = poses["bodies/tip/angle"] - poses["bodies/left/angle"]
    inside = (relative + math.pi) % (2 * math.pi) - math.pi <= -1.4
    assert 0 < inside.sum() < 9
    assert poses.status.tolist() == np.where(inside, "ok", "stopped").tolist()
    pose = solver.track(None, u[0])
    for row in u[1:]:
        pose = solver.track(pose, row)
    assert pose.status[0] == poses.status[-1]


def test_angles_count_but_for_whole_turns() -> None:
    """Unless the limits are a turn apart: then turns are counted."""
    turn = 2 * math.pi
    same = md.solve(four_bar((math.radians(50) + turn, HIGH + turn)), "turn")
    assert np.array_equal(same.status, md.solve(four_bar(), "turn").status)
    problem = four_bar((-0.1, 1.5 * turn), "A")
    sweep = md.Sweep(driver=md.Driver("crank.angle", from_=0.0, to=2 * turn), poses=9)
    status = md.solve(problem, sweep).status
    assert status.tolist() == ["ok"] * 7 + ["stopped"] * 2


def test_slides_and_modes() -> None:
    """A slider-crank's stroke: |s - r cos u| = sqrt(l^2 - r^2 sin^2 u)."""
    problem = md.slider_crank(0.05, 0.15)
    name = next(n for n, joint in problem.mechanism.joints.items() if joint.guide)
    joint = problem.mechanism.joints[name]
    guide = md.Prismatic(name, joint.first, joint.second, axis=joint.axis, limits=(0.11, 0.19))
    problem = limited(problem, guide)
    task = md.Sweep(driver=md.Driver("crank.angle", from_=0.0, to=2 * math.pi), poses=37)
    result = md.solve(problem, task)
    u = np.linspace(0, 2 * math.pi, 37)
    slide = 0.05 * np.cos(u) + np.sqrt(0.15**2 - (0.05 * np.sin(u)) ** 2)
    inside = (slide >= 0.11) & (slide <= 0.19)
    assert inside[u > math.pi].any()
    inside &= u < math.pi  # the sketch is here: a stop is before the others, whichever way
    assert "a stop of" in result.fault
    assert (np.asarray(result.status) == np.where(inside, "ok", "stopped")).all()
    modes = md.solve(problem, md.Modes(driver=md.Driver("crank.angle", at=(1.0,))))
    assert sorted(modes.status.tolist()) == ["ok", "stopped"]
    assert any("beyond its least slide of 0.11 m" in note for note in modes.summary["notes"])


def test_the_assembled_arc_ends_at_stops() -> None:
    """Of a crank that turns fully, backwards to the stop that is ahead."""
    first, last = crank_angles(HIGH)
    task = md.Sweep(driver=md.Driver("crank.angle", range="assembled"), poses=25)
    result = md.solve(four_bar(), task)
    assert set(result.status) == {"ok"}
    assert result.fault is None
    ends = [last - 2 * math.pi, first]
    assert result.summary["limits"] == pytest.approx(ends, abs=1e-12)
    at = result.drivers["crank.angle"].position
    np.testing.assert_allclose(at, np.linspace(*ends, 25), rtol=0, atol=1e-12)
    events = [event for event in result.events if event.kind == "stop"]
    assert [(e["joint"], e["direction"]) for e in events] == [("D", "down"), ("D", "up")]
    assert [event.at for event in events] == pytest.approx(ends, abs=1e-12)
    stretched = math.pi - math.acos((D**2 + C**2 - (B + A) ** 2) / (2 * D * C))
    assert result.summary["swing"]["rocker"] == pytest.approx(HIGH - stretched, abs=1e-9)
    free = md.solve("four-bar-crank-rocker", task)
    assert md.solve(four_bar((0.0, 3.0)), task).summary["limits"] == free.summary["limits"]


def test_poses_behind_a_stop_are_not_reached() -> None:
    """A range that ends before the crank is back; the other way round only where it turns fully."""
    problem = four_bar()
    first, last = crank_angles(HIGH)
    for end, status in ((2 * math.pi, "ok"), (last + 0.5, "ok")):
        sweep = md.Sweep(driver=md.Driver("crank.angle", from_=0.0, to=end), poses=73)
        result = md.solve(problem, sweep)
        assert result.status[-1] == status, "the crank comes there backwards"
    timed = md.Sweep(
        driver=md.Driver("crank.angle", law="2*t", times=tuple(np.linspace(0, 3, 31))), poses=None
    )
    result = md.solve(problem, timed)
    u = result.drivers["crank.angle"].position
    assert (result.status == np.where(u > first, "stopped", "ok")).all(), "time does not go back"
    assert "a stop of D is before" in result.fault


def test_threads_and_crosses_have_stops() -> None:
    """A spindle runs 50 mm down its thread of 6 mm a turn; a cross bends both ways in a turn."""
    press = md.load("screw-press")
    nut = replace(press.mechanism.joints["nut"], limits=(-0.05, 0.01))
    result = md.solve(limited(press, nut), "stroke")
    met = 2 * math.pi * 0.05 / 0.006
    u = result.drivers["nut.angle"].position
    assert (result.status == np.where(u > met, "stopped", "ok")).all()
    (event,) = [event for event in result.events if event.kind == "stop"]
    assert event.at == pytest.approx(met, rel=1e-12)
    assert "beyond its least slide of -0.05 m" in result.fault
    shafts = md.load("double-cardan")
    last = next(joint for joint in shafts.mechanism.joints.values() if joint.kind == "cylindrical")
    task = next(name for name, task in shafts.tasks.items() if isinstance(task, md.Sweep))
    slide = np.asarray(md.solve(shafts, task).joints[last.name].slide)
    low, high = (float(np.median(slide)) + way for way in (-0.01, 0.01))
    found = md.solve(limited(shafts, replace(last, limits=(low, high))), task)
    assert set(found.status) == {"ok"}
    assert low < slide.min() <= slide.max() < high
    found = md.solve(limited(shafts, replace(last, limits=(high, high + 0.01))), task)
    assert set(found.status) == {"stopped"}
    cardan = md.load("cardan-joint")
    plain = np.asarray(md.solve(cardan, "turn").joints["U"].angle)
    cross = replace(cardan.mechanism.joints["U"], limits=(-9.0, -0.5))
    status = md.solve(limited(cardan, cross), "poses").status
    assert plain[0] == pytest.approx(-math.acos(4 / 5), rel=1e-12)
    nearest = plain[np.rint(np.degrees([0.0, 0.3, 0.9, 1.5])).astype(int)]
    assert (status == np.where(nearest > -0.5, "stopped", "ok")).all()
    assert set(status) == {"stopped", "ok"}


def test_limits_are_numbers_of_the_file(tmp_path: Path) -> None:
    problem = four_bar()
    md.dump(problem, tmp_path / "written.toml")
    assert md.load(tmp_path / "written.toml").mechanism == problem.mechanism
    assert problem.mechanism.values()["D.limits.high"] == HIGH
    again = problem.with_values({"D.limits.high_deg": 90})
    assert again.mechanism.joints["D"].limits == (math.radians(50), math.radians(90))
    with pytest.raises(MechanismError, match=r"joints.D.limits: limits end at 0.5 rad, not after"):
        four_bar((1.0, 0.5))
    with pytest.raises(InputError, match="limits"):
        four_bar((1.0,))


def test_studies_see_stops() -> None:
    """Sets are not followed together, where nothing would compare them with limits."""
    table = md.study(
        four_bar(), sets={"b": [0.119, 0.12]}, of="turn", outputs=["bodies/rocker/angle"]
    )
    assert table.status.tolist() == ["stopped"] * 2


def test_nothing_is_said_of_the_motion_without_stops() -> None:
    """Swing and stroke would be those of a linkage that its stops let through."""
    result = md.solve(four_bar(), "turn", poses=73)
    assert not {"swing", "stroke", "limits"} & set(result.summary)
    assert "swing, stroke, limits are not given: D meets a stop" in result.summary["notes"]
    free = md.solve(four_bar((0.0, 3.0)), "turn", poses=73)
    assert {"swing"} <= set(free.summary)


def test_a_page_of_a_joint_with_limits_is_recorded() -> None:
    """A live one would certify poses that a stop forbids."""
    page = md.page(four_bar(), "turn")
    assert page.data["reason"] == "its joints have limits, at which only mechdae stops"


def test_parts_are_not_made_of_a_motion_that_stops() -> None:
    with pytest.raises(md.UnavailableError, match="between its poses is stopped"):
        md.export(four_bar(), "turn", format="svg-cut")
