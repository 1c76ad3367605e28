"""Counterweights, a flywheel and a spring, against the closed forms of each."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from math import cos, pi, sin

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.describe.file.problem import Problem


def design_of(name: str) -> tuple[dict[str, float], Problem]:
    """Return parameters and problem of the best design, all of them sound."""
    result = md.synthesize(name)
    assert result.fault is None
    best = result.data["designs"][0]
    assert best["defects"] == []
    return best["parameters"], from_dict(tomllib.loads(best["problem"]), "design")


def test_counterweights_of_berkof_and_lowen() -> None:
    found, problem = design_of("balanced-four-bar")
    v = problem.mechanism.values()
    centre = complex(v["x2"], v["y2"]) / v["b"]
    crank = -v["m2"] * v["a"] * (1 - centre) / v["m1"]
    rocker = -v["m2"] * v["c"] * centre / v["m3"]
    assert complex(found["x1"], found["y1"]) == pytest.approx(crank, rel=1e-10)
    assert complex(found["x3"], found["y3"]) == pytest.approx(rocker, rel=1e-10)

    plain = md.load("balanced-four-bar")
    peaks = []
    for own in (plain, problem):  # by the centres of mass, which all go round a point at rest
        numbers = own.mechanism.values()
        result = md.solve(replace(own, expected=()), "turn")
        force = sum(
            numbers[f"{body}.mass"] * acceleration_of_centre(result, numbers, body, point)
            for body, point in (("crank", "A"), ("coupler", "B"), ("rocker", "D"))
        )
        peaks.append(float(np.abs(force).max()))
    assert peaks[1] <= 1e-12 * peaks[0]
    assert peaks[0] > 1


def acceleration_of_centre(
    result: md.Result, numbers: dict[str, float], body: str, point: str
) -> np.ndarray:
    """Return the acceleration of a centre of mass as complex numbers (n,)."""
    base = 0.0 if point in "AD" else result.points[f"{body}.{point}"].acceleration @ [1, 1j]
    turning = result.bodies[body]
    arm = complex(numbers[f"{body}.center.x"], numbers[f"{body}.center.y"])
    spin = 1j * turning.angular_acceleration - turning.angular_velocity**2
    return np.asarray(base + spin * arm * np.exp(1j * turning.angle))


def test_flywheel_for_a_fluctuation() -> None:
    found, problem = design_of("flywheel")
    v = problem.mechanism.values()
    share = (2 - v["delta"]) / (2 + v["delta"])
    exact = 4 * v["M"] / (v["omega0"] ** 2 * (1 - share**2))
    assert found["J"] == pytest.approx(exact, rel=1e-6)
    motion = md.solve(problem, md.Motion(
        start={"shaft": 0.0}, start_speed={"shaft": "omega0"}, until=0.35, poses=4001,
        tolerance=1e-12,
    ))  # fmt: skip
    speed = motion.bodies["shaft"].angular_velocity
    fluctuation = (speed.max() - speed.min()) / ((speed.max() + speed.min()) / 2)
    assert fluctuation == pytest.approx(v["delta"], rel=1e-6)
    table = md.study(
        problem, of="run", sets={"J": [10.0]},
        outputs=["fluctuation/bodies/shaft/angular_velocity"],
    ).table  # fmt: skip
    low = (v["omega0"] ** 2 - 4 * v["M"] / 10.0) ** 0.5
    wanted = (v["omega0"] - low) / ((v["omega0"] + low) / 2)
    assert table["fluctuation/bodies/shaft/angular_velocity"][0] == pytest.approx(wanted, rel=1e-8)


def test_spring_that_balances_an_arm() -> None:
    found, problem = design_of("balanced-arm")
    v = problem.mechanism.values()
    weight = v["m"] * v["g"] * v["c"]
    assert found["k"] == pytest.approx(weight / (v["h"] * v["r"]), rel=1e-12)
    effort = md.solve(problem, "lift").efforts["arm.angle"]
    assert np.abs(effort).max() <= 1e-12 * weight


def test_shaking_moment_of_a_turning_arm() -> None:
    """m c^2 + I about the pivot, with the pivot away from the origin, under an acceleration."""
    m, c, inertia, px, speed, acceleration = 2.0, 0.3, 0.05, 0.4, 3.0, 7.0
    mechanism = md.Mechanism(
        ground=md.Ground(points={"O": [px, 0.0]}),
        bodies=[md.Body("arm", points={"O": [0, 0], "E": [0.5, 0]}, mass=m, center=[c, 0],
                        inertia=inertia)],
        joints=[md.Revolute("O", "ground.O", "arm.O")],
        sketch={"arm": 0.0},
    )  # fmt: skip
    from mechdae.describe.tasks.shaking import with_shaking

    driver = md.Driver("arm.angle", from_=0.0, to=pi / 2, speed=speed, acceleration=acceleration)
    problem = with_shaking(Problem(mechanism, {"turn": md.Sweep(driver=driver, poses=3)}), ["turn"])  # type: ignore[arg-type]
    result = md.solve(problem, "turn")
    for k, phi in enumerate((0.0, pi / 4, pi / 2)):
        along = m * c * (-acceleration * sin(phi) - speed**2 * cos(phi))
        across = m * c * (acceleration * cos(phi) - speed**2 * sin(phi))
        moment = (inertia + m * c * c) * acceleration + px * across
        got = [result.value(f"outputs/{name}/value")[k]
               for name in ("shaking_x", "shaking_y", "shaking_moment")]  # fmt: skip
        assert got == pytest.approx([along, across, moment], rel=1e-12, abs=1e-12)


def test_what_cannot_shake_is_said() -> None:
    problem = md.load("four-bar-crank-rocker")
    goal = {"kind": "minimise", "of": "turn/shaking/force"}
    from mechdae.describe.tasks.constraints import Turned
    from mechdae.describe.tasks.goals import Minimise

    task = md.Synthesis(
        driver=Turned("crank.angle"), goal=Minimise(of=goal["of"], reduce="rms"),
        free={"b": (0.1, 0.13)}, starts=1,
    )  # fmt: skip
    with pytest.raises(md.InputError, match="no body has a mass"):
        md.synthesize(problem.with_task("design", task), "design")
