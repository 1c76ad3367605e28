"""`md.Solver` and the structures kept between calls: always what a first call gives."""

from __future__ import annotations

import pickle
import random
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.errors import InputError
from mechdae.motion.kinematics.prepared import SHAPES, CacheOwner, Shapes, keep_for
from mechdae.motion.kinematics.tracker import posed

KINDS = [
    ("four-bar-crank-rocker", "turn"),
    ("four-bar-crank-rocker", "modes"),
    ("jansen-leg", "turn"),
    ("whitworth-quick-return", "turn"),
    ("cam-roller-follower", "turn"),
    ("change-point-parallelogram", "turn"),
    ("slider-crank-friction", "cycle"),
    ("andrews-squeezer", "motion"),
    ("double-pendulum", "rest"),
]
"""Problems and tasks of the kinds whose kernels are kept."""


def outcome(call):
    """Return what a call gives as plain data, its error where it has one."""
    try:
        return call().to_dict()
    except md.MechdaeError as error:
        return f"{type(error).__name__}: {error}"


def sets_of(problem: md.Problem, count: int, size: float = 0.02) -> list[dict[str, float]]:
    """Return random changes of two numbers that are not zero."""
    rng = random.Random(17)
    numbers = {**dict(problem.mechanism.numbers()), **problem.mechanism.parameters}
    names = sorted(n for n, v in numbers.items() if isinstance(v, float) and v != 0)
    values = problem.mechanism.values()
    return [
        {
            n: values[n] * (1 + rng.uniform(-size, size))
            for n in rng.sample(names, min(2, len(names)))
        }
        for _ in range(count)
    ]


@pytest.mark.parametrize(("name", "task"), KINDS)
def test_warm_is_fresh(name: str, task: str) -> None:
    """To the last bit: kernels and their inputs are the same."""
    problem = md.load(name)
    solver = md.Solver(problem, task)
    solver()
    for values in sets_of(problem, 3):
        warm = outcome(lambda v=values: solver(v))
        SHAPES.clear()
        fresh = outcome(lambda v=values: md.Solver(problem, task)(v))
        assert repr(warm) == repr(fresh), values


def test_leaving_zero_builds_anew() -> None:
    problem = md.load("four-bar-crank-rocker")
    solver = md.Solver(problem, "turn")
    solver()
    before = len(SHAPES)
    warm = solver({"coupler.C.y": 0.002})
    assert len(SHAPES) == before + 1
    SHAPES.clear()
    fresh = md.solve(problem, "turn", set={"coupler.C.y": 0.002})
    assert warm.to_dict() == fresh.to_dict()


def test_varied_zero_is_a_symbol() -> None:
    problem = md.load("four-bar-crank-rocker")
    solver = md.Solver(problem, "turn", vary=("coupler.C.y",))
    solver()
    before = len(SHAPES)
    warm = solver({"coupler.C.y": 0.002})
    assert len(SHAPES) == before
    fresh = md.solve(problem, "turn", set={"coupler.C.y": 0.002})
    gap = warm.points["coupler.C"].position - fresh.points["coupler.C"].position
    assert np.abs(gap).max() <= 1e-13


@pytest.mark.parametrize("angle", [50.0, -50.0])
def test_mode_is_that_of_the_sketch(angle: float) -> None:
    """A solver that was on one mode follows the sketch of other numbers to the other."""
    problem = md.load("four-bar-crank-rocker")
    mechanism = replace(
        problem.mechanism,
        sketch={**problem.mechanism.sketch, "coupler": "side", "rocker": "2 * side"},
        parameters={**problem.mechanism.parameters, "side": 0.8},
    )
    problem = md.Problem(mechanism, problem.tasks)
    solver = md.Solver(problem, "turn")
    solver()
    value = {"side": np.radians(angle)}
    warm = solver(value)
    SHAPES.clear()
    assert warm.to_dict() == md.solve(problem, "turn", set=value).to_dict()


def test_poses_are_those_of_the_sweep() -> None:
    problem = md.load("four-bar-crank-rocker")
    solver = md.Solver(problem, "turn")
    for b in (0.12, 0.119, 0.121):
        whole = md.solve(problem, "turn", set={"b": b})
        u = whole.drivers["crank.angle"].position
        rows = [17, 200, 340]
        poses = solver.poses({"b": b}, u[rows])
        assert poses.ok.all()
        for path in ("points/coupler.P/position", "bodies/rocker/angular_velocity"):
            expected = np.array(whole.value(path))[rows]
            assert np.abs(poses[path] - expected).max() <= 1e-12 * np.abs(expected).max()


NEAR = {
    "four-bar-crank-rocker": ({"b": 0.119, "d": 0.101}, 1.1),
    "jansen-leg": ({"a": 0.0381, "l": 0.0079}, -1.5),
    "slider-crank": ({"r": 0.101}, 2.5),
}
"""Numbers of predefined mechanisms near their own, and a value of the driver."""


@pytest.mark.parametrize("name", NEAR)
def test_near_poses_need_no_path(name: str) -> None:
    """With other numbers: as on a path of their own, values and bounds, and none is followed."""
    problem = md.load(name)
    solver, own = md.Solver(problem, "turn"), problem.mechanism.values()
    solver.poses({}, 0.1)
    path = solver._posed
    assert path is not None
    given, far = NEAR[name]
    turn = far + np.linspace(-np.pi, np.pi, 50)
    around = np.concatenate([turn[::7], [path[1]._begin], turn[::-3]])
    for share, places in ((1.0, far), (0.5, path[1]._begin), (0.5, far - 1), (0.7, around)):
        u = np.atleast_1d(places)
        numbers = {n: own[n] + share * (v - own[n]) for n, v in given.items()}
        pose = solver.poses(numbers, u)
        assert solver._posed is path
        changed = problem.with_values(numbers)
        beside = posed(changed, problem.tasks["turn"]).at(u)
        assert pose.ok.all()
        assert beside.ok.all()
        assert pose.condition == pytest.approx(beside.condition, rel=1e-9)
        assert np.all(pose.error <= 2 * beside.error)
        for value, other in zip(pose._y, beside._y, strict=True):
            assert np.abs(value - other).max() <= 1e-14 * np.abs(other).max()


@pytest.mark.parametrize("u", [0.7, 3.0, (0.7, 3.0, 1.1), (0.7, 90.0)])
@pytest.mark.parametrize("numbers", [{"a": 0.081}, {"a": 0.4}, {"a": -0.08}, {"phi": 0.71}])
def test_poses_that_are_not_near(numbers: dict[str, float], u: float | tuple[float, ...]) -> None:
    """Beyond a limit position, without a mode, with another sketch: as a solver that is new."""
    problem = md.load("four-bar-double-rocker")
    solver = md.Solver(problem, "window")
    solver.poses({}, 0.7)

    def outcome(own: md.Solver) -> object:
        try:
            pose = own.poses(numbers, u)
        except md.MechdaeError as error:
            return str(error)
        return pose.ok.tolist(), pose["points/coupler.P/position"].round(12).tolist()

    assert repr(outcome(solver)) == repr(outcome(md.Solver(problem, "window")))


def test_many_is_a_study() -> None:
    problem = md.load("four-bar-crank-rocker")
    solver = md.Solver(problem, "turn")
    b = [0.119, 0.12, 0.121]
    found = solver.many({"b": b}, ["points/coupler.P/position", "summary/swing/rocker"])
    for k, value in enumerate(b):
        one = solver(b=value)
        gap = found.table["points/coupler.P/position"][k] - one.points["coupler.P"].position
        assert np.abs(gap).max() < 1e-13


def test_function_varies_what_the_solver_does() -> None:
    solver = md.Solver("four-bar-crank-rocker", "turn", vary=("b",))
    found = solver.function(["points/coupler.P/position"])
    pose = solver.poses({"b": 0.121}, [1.0])["points/coupler.P/position"][0]
    assert np.abs(np.array(found(1.0, 0.121)).ravel() - pose).max() < 1e-13


def test_names_are_checked() -> None:
    with pytest.raises(md.UnknownName, match="coupler"):
        md.Solver("four-bar-crank-rocker", "turn", vary=("coupler.Q.x",))
    with pytest.raises(md.UnknownName):
        md.Solver("four-bar-crank-rocker", "turn")(nothing=1.0)


def test_pickled() -> None:
    solver = md.Solver("four-bar-crank-rocker", "turn", vary=("b",))
    first = solver(b=0.119).to_dict()
    again = pickle.loads(pickle.dumps(solver))
    assert again.vary == ("b",)
    assert again(b=0.119).to_dict() == first


def test_threads_give_the_same_bits() -> None:
    problem = md.load("jansen-leg")
    solver = md.Solver(problem, "turn")
    sets = sets_of(problem, 6, 0.002)
    alone = [outcome(lambda v=values: solver(v)) for values in sets]
    barrier = threading.Barrier(2)

    def work(_: int):
        barrier.wait()
        return [outcome(lambda v=values: solver(v)) for values in sets]

    with ThreadPoolExecutor(2) as pool:
        for found in pool.map(work, range(2)):
            assert repr(found) == repr(alone)


class Thing:
    """Something with a size."""

    def __init__(self, size: int) -> None:
        self.size = size


def test_kept_structures_are_bounded() -> None:
    kept: Shapes[Thing] = Shapes(lambda thing: thing.size, most=3, most_bytes=100)
    for key in range(10):
        kept.put(key, Thing(1))
    assert len(kept) == 3
    assert kept.get(9) is not None
    assert kept.get(0) is None
    kept.put("large", Thing(99))
    assert len(kept) == 2
    kept.put("larger", Thing(1000))
    assert len(kept) == 1


def test_held_structures_stay() -> None:
    kept: Shapes[Thing] = Shapes(lambda thing: thing.size, most=1, most_bytes=100)
    held = CacheOwner()
    with keep_for(held):
        kept.put("mine", Thing(1))
    kept.put("other", Thing(1))
    assert kept.get("mine") is not None
    del held
    kept.clear()
    assert kept.get("mine") is None


def test_memory_is_flat() -> None:
    """What is kept does not grow with the number of calls."""
    solver = md.Solver("four-bar-crank-rocker", "turn")
    solver()
    before = [shape.size for shape in SHAPES.values()]
    for k in range(30):
        solver(b=0.12 + 1e-6 * k)
    assert [shape.size for shape in SHAPES.values()] == before


def test_functions_are_made_once() -> None:
    name = "four-bar-crank-rocker"
    arguments = {"inputs": ["crank.angle", "b"], "outputs": ["points/coupler.P/position"]}
    first = md.function(name, **arguments)
    assert md.function(name, **arguments) is first
    other = md.load("four-bar-crank-rocker").with_values({"a": 0.041})
    assert md.function(other, **arguments) is not first


def test_kernels_of_forces_count() -> None:
    SHAPES.clear()
    problem = md.load("slider-crank-friction")
    md.solve(problem.mechanism, md.Sweep(driver=problem.task("cycle").driver, poses=361))
    plain = SHAPES.values()[-1].size
    md.solve(problem, "cycle")
    forces = SHAPES.values()[-1].size
    assert 10_000 < plain < forces < 100_000_000


@pytest.mark.parametrize("u", [[], [float("nan")], [0.5, float("inf")], [[0.5, 0.6]]])
def test_values_of_the_driver_that_are_none(u: list[float]) -> None:
    """A value that is no number was followed for ever."""
    solver = md.Solver("four-bar-crank-rocker", "turn")
    with pytest.raises(InputError, match="finite values of the driver"):
        solver.poses({}, u)
