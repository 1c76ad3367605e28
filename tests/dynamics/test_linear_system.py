"""A, B, C, D of small motions against closed forms."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.errors import InputError, UnavailableError, UnknownName
from mechdae.tasks import export
from tests.attack import equilibria

M, m, L, K, C, G = 2.0, 0.5, 0.8, 40.0, 1.5, 9.81


def cart(**task: Any) -> Any:
    """Return a cart on a spring with a pendulum (a point mass) that hangs from it."""
    spring = {"kind": "spring", "coordinate": "rail.slide", "stiffness": K, "damping": C}
    return from_dict(
        {
            "schema": 1,
            "gravity": [0, -G],
            "ground": {"points": {"O": [0, 0]}},
            "bodies": {
                "cart": {"points": {"P": [0, 0]}, "mass": M},
                "rod": {"points": {"P": [0, 0], "E": [0, -L]}, "mass": m, "center": [0, -L]},
            },
            "joints": {
                "rail": {"kind": "prismatic", "between": ["ground.O", "cart.P"]},
                "pin": {"kind": "revolute", "between": ["cart.P", "rod.P"]},
            },
            "loads": {
                "s": spring,
                "F": {"kind": "force", "point": "cart.P", "value": [0, 0]},
                "T": {"kind": "torque", "body": "rod", "value": 0},
            },
            "outputs": {"x": "rail.slide", "tip": "rod.E.x", "a": "rail.slide.acceleration"},
            "tasks": {
                "e": {
                    "kind": "equilibrium", "linearise": True,
                    "free": ["rail.slide", "rod.angle"], "outputs": ["x", "tip", "a"],
                    "inputs": ["loads.F.x", "loads.T", "rod.angle"], **task,
                }
            },
        }
    )  # fmt: skip


def test_cart_with_pendulum() -> None:
    result = md.solve(cart(), "e")
    system = result.data["linear"]
    assert system["states"] == ["rail.slide", "rod.angle", "rail.slide.speed", "rod.angle.speed"]
    assert system["inputs"] == ["loads.F.x", "loads.T", "efforts.rod.angle"]
    mass = np.array([[M + m, m * L], [m * L, m * L**2]])
    inverse = np.linalg.inv(mass)
    stiff, damp = np.diag([K, m * G * L]), np.diag([C, 0.0])
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ stiff, -inverse @ damp]])
    push = np.array([[1.0, 0, 0], [0, 1, 1]])
    B = np.vstack([np.zeros((2, 3)), inverse @ push])
    outputs = np.array([[1.0, 0, 0, 0], [1, L, 0, 0]])
    assert np.array(system["A"]) == pytest.approx(A, abs=1e-12)
    assert np.array(system["B"]) == pytest.approx(B, abs=1e-12)
    assert np.array(system["C"]) == pytest.approx(np.vstack([outputs, A[2]]), abs=1e-12)
    assert np.array(system["D"]) == pytest.approx(np.vstack([np.zeros((2, 3)), B[2]]), abs=1e-12)
    modes = [complex(*mode["eigenvalue"]) for mode in result.summary["modes"]]
    values = np.linalg.eigvals(A)
    for mode in modes:
        assert np.abs(values - mode).min() < 1e-10


def test_files_have_it(tmp_path) -> None:
    result = md.solve(cart(), "e")
    export.save(result, tmp_path)
    packed = np.load(tmp_path / "e.npz")
    told = json.loads((tmp_path / "e.json").read_text())["tasks"]["e"]["linear"]
    for name in "ABCD":
        assert packed[f"linear.{name}"].tolist() == told[name]
    assert packed["linear.states"].tolist() == told["states"]


def test_double_pendulum() -> None:
    """Equal lengths and masses: M z'' + K z = 0 with M = [[2, 1], [1, 1]], K = g diag(2, 1)."""
    free = ("upper.angle", "lower.angle")
    task = md.Equilibrium(linearise=True, free=free, inputs=free)
    system = md.solve(md.load("double-pendulum"), task).data["linear"]
    inverse = np.linalg.inv(np.array([[2.0, 1], [1, 1]]))
    assert np.array(system["A"])[2:, :2] == pytest.approx(-inverse @ np.diag([2 * G, G]), rel=1e-12)
    assert np.array(system["B"])[2:] == pytest.approx(inverse, rel=1e-12)


def test_a_driven_coordinate_is_an_input() -> None:
    """A pendulum whose pivot is moved: theta'' = -(g/L) theta - x''/L."""
    problem = cart(
        drivers=[{"coordinate": "rail.slide", "at": [0.1]}], free=["rod.angle"], inputs=None
    )
    system = md.solve(problem, "e").data["linear"]
    states = ["rod.angle", "rail.slide", "rod.angle.speed", "rail.slide.speed"]
    assert system["states"] == states
    assert system["inputs"][0] == "rail.slide.acceleration"
    A, B = np.array(system["A"]), np.array(system["B"])
    assert A[2] == pytest.approx([-G / L, 0, 0, 0], abs=1e-12)
    assert A[3] == pytest.approx(np.zeros(4), abs=1e-14)
    assert B[:, 0] == pytest.approx([0, 0, -1 / L, 1], abs=1e-12)
    assert np.array(system["C"])[1] == pytest.approx([L, 1, 0, 0], abs=1e-12)
    assert np.array(system["D"])[2, 0] == pytest.approx(1, abs=1e-12)


def test_about_a_motion() -> None:
    """A pendulum that swings: theta'' = -(g/L) sin(theta); at the time, the slope is a cosine."""
    data = {
        "schema": 1,
        "gravity": [0, -G],
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {"rod": {"points": {"O": [0, 0]}, "mass": 2.0, "center": [0, -L]}},
        "joints": {"O": {"kind": "revolute", "between": ["ground.O", "rod.O"]}},
        "outputs": {"pull": "rod.angle.speed**2"},
        "tasks": {
            "go": {
                "kind": "motion", "start": {"rod.angle": 1.0}, "until": 2.0, "linearise": 0.7,
                "at": [0.7, 2.0], "inputs": ["rod.angle"], "outputs": ["pull"],
            }
        },
    }  # fmt: skip
    result = md.solve(from_dict(data), "go")
    system = result.data["linear"]
    whole = md.solve(
        from_dict(data | {"outputs": {"pull": "rod.angle", "w": "rod.angle.speed"}}), "go"
    )
    theta = float(whole.outputs["pull"].value[0])
    speed = float(whole.outputs["pull"].rate[0])
    assert system["time"] == 0.7
    assert np.array(system["A"]) == pytest.approx(
        np.array([[0, 1], [-G / L * math.cos(theta), 0]]), abs=1e-8
    )
    assert np.array(system["B"]) == pytest.approx(np.array([[0], [1 / (2 * L**2)]]), rel=1e-12)
    assert system["C"][0] == pytest.approx([0, 2 * speed], abs=1e-8)


def test_a_linkage_in_motion_against_differences() -> None:
    """Where the speed counts: A of a linkage in motion is the slope of its accelerations."""
    case, generator = equilibria.drawn(5)
    data = case.data(generator)
    data["bodies"].get("rocker", {}).update({"mass": 1.0, "inertia": 0.1})
    problem = from_dict(data)
    start = {"crank.angle": case.theta}

    def acceleration(angle: float, speed: float) -> float:
        task = md.Motion(
            start={"crank.angle": angle}, start_speed={"crank.angle": speed}, at=(0.0, 1e-4)
        )
        result = md.solve(problem, task)
        return float(result.bodies["crank"].angular_acceleration[0])

    task = md.Motion(
        start=start, start_speed={"crank.angle": 2.0}, at=(0.0, 1e-4), linearise=0.0,
        inputs=("crank.angle",),
    )  # fmt: skip
    A = np.array(md.solve(problem, task).data["linear"]["A"])

    def slope(function: Any, h: float) -> float:
        steps = [(function(k * h) - function(-k * h)) / (2 * k * h) for k in (1, 2, 3)]
        return (15 * steps[0] - 6 * steps[1] + steps[2]) / 10

    by_angle = slope(lambda d: acceleration(case.theta + d, 2.0), 1e-3)
    by_speed = slope(lambda d: acceleration(case.theta, 2.0 + d), 1e-2)
    assert A[1] == pytest.approx([by_angle, by_speed], rel=1e-8)


def test_what_is_refused() -> None:
    with pytest.raises(UnknownName, match=r"loads.G"):
        md.solve(cart(inputs=["loads.G"]), "e")
    with pytest.raises(InputError, match="raill"):
        md.solve(cart(inputs=["raill.slide"]), "e")
    problem = md.load("coasting-slider-crank")
    name, task = next((n, t) for n, t in problem.tasks.items() if t.kind == "motion")
    rubbing = md.Motion(start=task.start, start_speed=task.start_speed, until=0.01, linearise=0.0)
    with pytest.raises(UnavailableError, match="dry friction"):
        md.solve(problem, rubbing)
    assert name


def test_a_resistance_at_rest_resists_nothing() -> None:
    problem = md.load("slider-crank-inertia")
    gravity = md.Equilibrium(friction="none", linearise=False)
    assert md.solve(problem, gravity).summary["stable"] == "neutral"
