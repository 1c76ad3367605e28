"""Poses of several drivers by their values: against closed forms, limits, jumps, bad input."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from tests.shared.five_bars import SHORT, random_rows, tip


def test_random_rows_against_circles() -> None:
    """Each row that is ok is on the mode of the sketch; each other one is beyond a limit."""
    rows = random_rows(3000)
    assert 1000 < rows.ok.sum() < 2900
    assert rows.off <= 1e-13
    assert rows.through == 0
    assert rows.refused == 0
    assert rows.bound < 1e-12


def test_a_loop_goes_on_from_pose_to_pose() -> None:
    """A thousand small moves: those of closed forms, a few calls of the step kernel each."""
    random = np.random.default_rng(3)
    solver = md.Solver(md.load("five-bar-robot").with_values(SHORT), "forward")
    walk = np.radians([115.0, 65.0]) + np.cumsum(random.normal(0, 2e-3, (300, 2)), axis=0)
    pose = solver.track(None, walk[0])
    tracker, calls = solver._tracker, []
    step = tracker._step
    tracker._step = lambda *given: (calls.append(1), step(*given))[1]
    for u in walk:
        pose = solver.track(pose, u, speed=[1.0, -0.5])
        assert pose.status[0] == "ok"
        assert np.abs(pose["points/tip.P/position"] - tip(u[None])).max() <= 1e-13
    assert len(calls) == 2 * len(walk)
    ahead, behind = (tip((u + h * np.array([1.0, -0.5]))[None]) for h in (1e-6, -1e-6))
    assert pose["points/tip.P/velocity"] == pytest.approx((ahead - behind) / 2e-6, rel=1e-7)


def test_steps_are_as_long_as_their_tests_allow() -> None:
    """Far moves of a block of seven unknowns: nearly every step that is tried is proved."""
    solver = md.Solver("delta-robot", "path")
    solver.track(None, [0.2, 0.2, 0.2])
    tracker, tests = solver._tracker, []
    step = tracker._step
    tracker._step = lambda *given: (tests.append(step(*given)), tests[-1])[1]
    assert solver.track(None, [0.5, 0.0, 0.4]).ok.all()
    refused = sum(test.max() > 1 for _, test, _, _ in tests)
    assert len(tests) < 50
    assert refused < len(tests) / 4


def test_beyond_a_limit_the_mechanism_stays() -> None:
    solver = md.Solver(md.load("five-bar-robot").with_values(SHORT), "forward")
    here = solver.track(None, [2.0, 1.2])
    refused = solver.track(here, [3.1, -0.1])  # the elbows are further apart than the forearms
    assert refused.status.tolist() == ["unassembled"]
    assert np.isnan(refused["points/tip.P/position"]).all()
    again = solver.track(refused, [2.05, 1.15])
    assert again.ok.all()
    assert np.abs(again["points/tip.P/position"] - tip(again.u)).max() <= 1e-13


@pytest.mark.parametrize(
    ("name", "task", "path"),
    [
        ("five-bar-robot", "forward", "points/tip.P/position"),
        ("five-bar-robot", "circle", "bodies/left/angle"),
        ("pantograph", "circle", None),
        ("six-axis-arm", "move", None),
        ("hexapod", "inverse", "joints/leg1/slide"),
        ("four-bar-crank-rocker", "turn", "points/coupler.P/position"),
    ],
)
def test_jacobians_are_slopes(name: str, task: str, path: str | None) -> None:
    solver = md.Solver(name, task)
    begin = solver.track(None, _first(solver)).u[0]
    path = path or next(iter(_places(solver)))
    given = (lambda u: u.ravel()) if len(begin) == 1 else (lambda u: u)
    slopes = solver.poses({}, given(begin[None, :])).jacobian(path)[0]
    assert slopes.shape[1] == len(begin)
    h = 1e-6
    for k, direction in enumerate(h * np.eye(len(begin))):
        sides = np.stack([begin + direction, begin - direction])
        ahead, behind = (np.atleast_1d(row) for row in solver.poses({}, given(sides))[path])
        size = np.abs(slopes).max() + 1e-9
        assert np.abs(slopes[:, k] - (ahead - behind) / (2 * h)).max() <= 1e-6 * size


def _first(solver: md.Solver) -> list[float]:
    result = solver()
    return [float(driver.position[0]) for driver in result.drivers.values()]


def _places(solver: md.Solver) -> list[str]:
    return [f"points/{name}/position" for name in solver().points]


def test_a_hexapod_there_and_back() -> None:
    """Legs of poses drawn at random lead back to them: two scenes with other unknowns."""
    random = np.random.default_rng(5)
    there, back = md.Solver("hexapod", "inverse"), md.Solver("hexapod", "forward")
    begin = np.array(_first(there))
    u = begin + random.uniform(-0.03, 0.03, (40, 6))
    legs = there.poses({}, u)
    lengths = np.stack([legs[f"joints/leg{k}/slide"] for k in range(1, 7)], axis=1)
    found = back.poses({}, lengths)
    assert legs.ok.all()
    assert found.ok.all()
    for k, name in enumerate(("x", "y", "z")):
        assert np.abs(found[f"joints/{name}/slide"] - u[:, k]).max() <= 1e-12


def test_laws_do_not_stand_in_the_way() -> None:
    """By value as the sweep of the laws has it; as a function of casadi, named by its task."""
    result = md.solve("five-bar-robot", "circle")
    u = np.stack([d.position for d in result.drivers.values()], axis=1)
    poses = md.Solver("five-bar-robot", "circle").poses({}, u)
    expected = np.array(result.value("bodies/left/angle"))
    assert np.abs(poses["bodies/left/angle"] - expected).max() <= 1e-12
    found = md.function(
        "five-bar-robot", inputs=["tip.P.x", "tip.P.y"], outputs=["bodies/left/angle"]
    )
    assert found.name() == "circle"
    assert float(found(*u[17])) == pytest.approx(expected[17], rel=1e-13)
    assert np.isnan(float(found(0.1, 5.0)))


def test_a_driver_beside_held_ones() -> None:
    """Values of the one that moves, or of all."""
    drivers = (md.Driver("left.angle", from_=2.0, to=2.4), md.Driver("right.angle", at=(1.0,)))
    solver = md.Solver("five-bar-robot", md.Sweep(drivers=drivers))
    moving = np.array([2.0, 2.1, 2.3])
    both = np.stack([moving, np.full(3, 1.0)], axis=1)
    alone = solver.poses({}, moving)
    assert alone.u.tolist() == both.tolist()
    path = "points/tip.P/position"
    assert np.array_equal(alone[path], solver.poses({}, both)[path])
    assert np.array_equal(solver.track(None, 2.1)[path], solver.track(None, [2.1, 1.0])[path])


def test_a_loop_keeps_the_numbers_of_its_pose() -> None:
    """Of a pose with other forearms the next one has them too; rows of many are no beginning."""
    solver = md.Solver("five-bar-robot", "forward")
    pose = solver.track(solver.poses(SHORT, [2.0, 1.2]), [2.05, 1.1])
    assert pose.ok.all()
    assert np.abs(pose["points/tip.P/position"] - tip(pose.u)).max() <= 1e-13
    longer = solver.track(solver.track(None, [2.0, 1.2]), [2.05, 1.1])
    assert np.abs(longer["points/tip.P/position"] - tip(pose.u)).max() > 1e-3
    with pytest.raises(md.InputError, match="pose: one pose of several drivers"):
        solver.track(solver.poses({}, [[2.0, 1.1], [2.1, 1.0]]), [2.0, 1.1])


def test_bad_input() -> None:
    solver = md.Solver("five-bar-robot", "forward")
    poses = solver.poses({}, [[2.0, 1.1], [np.nan, 1.1], [2.0, np.inf], [2.1, 1.0]])
    assert poses.status.tolist() == ["ok", "unassembled", "unassembled", "ok"]
    for u in ([1.0, 2.0, 3.0], [[1.0]], 1.0, np.zeros((0, 2)), np.zeros((1, 1, 2))):
        with pytest.raises(md.InputError, match=r"left\.angle, right\.angle"):
            solver.poses({}, u)
    with pytest.raises(md.InputError, match="one value of each"):
        solver.track(None, [[2.0, 1.1], [2.0, 1.1]])
    with pytest.raises(md.InputError, match="speed: 2 values are needed, one for each driver"):
        solver.track(None, [2.0, 1.1], speed=[1.0])
    for call in (lambda u: solver.poses({}, u), lambda u: solver.track(None, u)):
        for u in ("x", [[1.0, 2.0], [3.0]], {}):
            with pytest.raises(md.InputError, match="u: numbers are needed"):
                call(u)
    with pytest.raises(md.InputError, match="no derivatives"):
        poses.jacobian("points/tip.P/velocity")
    with pytest.raises(md.InputError, match="no poses of a driver"):
        md.Solver("five-bar-robot", "modes").track(None, [2.0, 1.1])
    assert solver.track(None, [np.nan, 1.0]).status.tolist() == ["unassembled"]
