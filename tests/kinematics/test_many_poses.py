"""Sweeps of many poses: what is kept, how often kernels run, and the poses left to be looked at."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.motion.cases.many import many_poses
from mechdae.motion.continuation import evaluate
from mechdae.motion.continuation.evaluate import Evaluator
from mechdae.motion.kinematics.prepared import prepare
from mechdae.motion.kinematics.sweep import run

KINDS = ("drivers", "bodies", "points", "joints")
LARGE = {
    "four-bar-crank-rocker": ("turn", None, 242),
    "gorshkov-seven-link": ("window", (-0.8, 0.8), 490),
    "jansen-leg": ("turn", None, 554),
}
"""Problem -> task, interval of the driver, bytes a pose: half of what version 0.6 kept."""


def kept(result: md.Result) -> list[Any]:
    """Return the arrays that a result holds in memory, each once."""
    found = {}
    for kind in KINDS:
        for series in getattr(result, kind).values():
            for array in series.open().values():
                if isinstance(array, np.ndarray):
                    base = array
                    while isinstance(base.base, np.ndarray):
                        base = base.base
                    found[id(base)] = base
    return [*found.values(), *result.bound.values(), result.condition]


def series_of(result: md.Result) -> dict[str, Any]:
    """Return every series of poses by its path."""
    return {
        f"{kind}/{part}/{name}": np.asarray(series[name])
        for kind in KINDS
        for part, series in getattr(result, kind).items()
        for name in series
    }


def large(name: str, poses: int) -> md.Result:
    task, interval, _ = LARGE[name]
    problem = md.load(name)
    if interval is not None:
        low, high = interval
        sweep = md.Sweep(driver=md.Driver("crank.angle", from_=low, to=high), poses=poses)
        return md.solve(problem, sweep)
    return md.solve(problem, task, poses=poses)


@pytest.mark.parametrize("name", LARGE)
def test_a_pose_takes_half_the_memory_it_did(name: str) -> None:
    n = 20_000
    result = large(name, n)
    held = sum(array.nbytes for array in kept(result) if any(array.strides)) + n  # a status each
    assert held / n <= LARGE[name][2]


def test_equal_columns_are_one_and_constant_ones_a_number() -> None:
    result = large("four-bar-crank-rocker", 2000)
    pins = [result.points[name] for name in ("crank.B", "coupler.B")]
    for name in ("position", "velocity", "acceleration"):
        assert np.shares_memory(pins[0][name], pins[1][name])
    assert np.shares_memory(result.bodies["crank"].angle, result.drivers["crank.angle"].position)
    ground = result.points["rocker.D"]
    assert ground.position.strides[0] == 0
    assert ground.position[7].tolist() == [0.1, 0.0]
    assert not any(result.bodies["crank"].angular_velocity.strides)
    assert set(result.bodies["crank"].angular_velocity.tolist()) == {10.0}
    for array in series_of(result).values():
        assert not array.flags.writeable


def test_statuses_are_bytes_until_they_are_read() -> None:
    result = large("four-bar-crank-rocker", 2000)
    assert vars(result)["_codes"].nbytes == len(result) == 2000
    assert set(result.status) == {"ok"}
    assert result.status.dtype.kind == "U"


def test_every_pose_is_evaluated_once_in_few_calls() -> None:
    problem = md.load("four-bar-crank-rocker")
    task = replace(problem.tasks["turn"], poses=50_000)
    setting = prepare(problem, task)
    calls = []
    line = many_poses.lean_line(setting.graphs, setting.outputs)
    assert line is not None
    own = line.block
    line.block = lambda inputs, *rest: calls.append(inputs[0].shape[1]) or own(inputs, *rest)
    try:
        done = run(setting, task)
    finally:
        del line.block
    assert sum(calls) == 50_000
    assert len(calls) <= 50_000 // line.chunk + 1
    assert done.evaluator.pose.evaluations == 50_000
    assert done.poses.fine


@pytest.mark.parametrize(
    ("name", "task"),
    [
        ("four-bar-crank-rocker", "turn"),
        ("four-bar-double-rocker", "window"),
        ("gorshkov-seven-link", "window"),
        ("change-point-parallelogram", "turn"),
        ("folding-slider-crank", None),
        ("geared-five-bar", None),
        ("kite", "turn"),
    ],
)
def test_blocks_give_what_poses_one_by_one_do(
    name: str, task: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Limits, lost poses and change points among them, in small blocks and in one."""
    problem = md.load(name)
    monkeypatch.setattr(evaluate, "MANY", 10**9)
    alone = md.solve(problem, task)
    monkeypatch.setattr(evaluate, "MANY", 1)
    for chunk in (17, 10_000):
        monkeypatch.setattr(many_poses, "chunk_of", lambda line, chunk=chunk: chunk)
        blocks = md.solve(problem, task)
        assert blocks.status.tolist() == alone.status.tolist()
        expected, found = series_of(alone), series_of(blocks)
        assert expected.keys() == found.keys()
        for path, own in expected.items():
            size = np.nanmax(np.abs(own), initial=0.0)
            assert np.array_equal(np.isnan(own), np.isnan(found[path])), path
            known = ~np.isnan(own)
            gap = np.abs(own - found[path])[known]
            condition = np.broadcast_to(alone.condition, own.T.shape).T[known]
            assert np.all(gap <= 1e-13 * size * np.clip(condition, 1.0, 1e5) ** 3), path
        for word, own in alone.bound.items():
            assert blocks.bound[word] == pytest.approx(own, rel=1e-6, nan_ok=True), word


def test_a_reported_pose_is_within_its_bound_of_the_closed_form() -> None:
    n = 5000
    result = large("four-bar-crank-rocker", n)
    real = np.longdouble
    u = result.drivers["crank.angle"].position.astype(real)
    a, b, c, d = (real(v) for v in (0.04, 0.12, 0.08, 0.1))
    dx, dy = d - a * np.cos(u), -a * np.sin(u)
    e = np.hypot(dx, dy)
    coupler = np.arctan2(dy, dx) + np.arccos((e * e + b * b - c * c) / (2 * b * e))
    rocker = np.arctan2(b * np.sin(coupler) - dy, b * np.cos(coupler) - dx)
    turn = 2 * np.arctan2(real(0), real(-1))
    for name, angle in (("coupler", coupler), ("rocker", rocker)):
        off = result.bodies[name].angle.astype(real) - angle
        off = np.abs(off - turn * np.round(off / turn))
        assert np.all(off <= result.bound["angle"])
        assert off.max() <= 2e-15


def test_angles_that_move_far_are_solved_again() -> None:
    """The kernel carries sines along to second order in its step: large steps are repeated."""
    problem = md.load("spur-gears-idler")
    task = next(iter(problem.tasks.values()))
    setting = prepare(problem, task)
    done = run(setting, task)
    evaluator = Evaluator(setting.graphs, setting.outputs)
    s = done.places[:5]
    guess = done.path.guess(s)
    if guess.shape[1]:
        rates = evaluator.all_rates(done.path, s, ())
        far, _ = evaluator._converged(done.path, guess + 0.3, s, s, rates)
        near, _ = evaluator._converged(done.path, guess, s, s, rates)
        assert far[5] == pytest.approx(near[5], abs=1e-13)
