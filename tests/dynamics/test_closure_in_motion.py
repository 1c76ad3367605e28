"""Motions and equilibria of overconstrained mechanisms whose dimensions hardly agree."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.values import Table
from mechdae.dynamics.equations import MotionProblem
from mechdae.errors import AssemblyError, InputError
from mechdae.numerics.null_space import ZERO
from tests.shared.noisy import parallelogram, value_named

G, END = 9.81, 1.5
ALL = ["A1", "B1", "A2", "B2", "A3", "B3"]


def heavy(noise: float, seed: int = 0, tolerance: float | None = None) -> md.Mechanism:
    """Return a beam on three cranks, all with a mass of 1 kg and 0.2 kg m^2."""
    mechanism = parallelogram(noise, seed, tolerance)
    bodies = {
        name: replace(body, mass=1.0, center=(0.3, 0.1), inertia=0.2)
        for name, body in mechanism.bodies.items()
    }
    return replace(mechanism, bodies=Table(bodies), gravity=(0.0, -G))


def acceleration(angle: float) -> float:
    """Return that of exact cranks: T = 1.9 w^2 / 2, V = g (1.9 sin + 0.3 cos)."""
    return -G * (1.9 * math.cos(angle) - 0.3 * math.sin(angle)) / 1.9


def fallen(angle: float, end: float, steps: int = 4000) -> float:
    """Return the angle after a time from rest, by Runge and Kutta's method of fourth order."""
    h, y = end / steps, np.array([angle, 0.0])

    def rate(state: Any) -> Any:
        return np.array([state[1], acceleration(state[0])])

    for _ in range(steps):
        a = rate(y)
        b = rate(y + h / 2 * a)
        c = rate(y + h / 2 * b)
        y = y + h / 6 * (a + 2 * b + 2 * c + rate(y + h * c))
    return float(y[0])


@pytest.mark.parametrize(("seed", "power"), [(0, 11), (1, 10), (2, 9), (3, 8), (4, 7.1)])
def test_a_motion_is_that_of_exact_dimensions_but_for_the_noise(seed: int, power: float) -> None:
    noise = 10.0**-power
    result = md.solve(
        heavy(noise, seed, 10 * noise), md.Motion(until=END, poses=2, tolerance=1e-11)
    )
    assert result.fault is None
    assert abs(result.bodies["c1"].angle[-1] - fallen(1.0, END)) < 60 * noise + 1e-9
    assert result.summary["not_unique"] == ALL
    assert "redundant equations close within" in str(result.summary["assumptions"])


@pytest.mark.parametrize("noise", [1e-10, 1e-8, 8e-8])
def test_an_equilibrium_has_the_angle_of_exact_dimensions(noise: float) -> None:
    result = md.solve(heavy(noise, 5, 10 * noise), md.Equilibrium())
    low = math.atan2(1.9, 0.3) - math.pi
    assert abs(result.bodies["c1"].angle[0] - low) < 20 * noise + 1e-12
    assert result.summary["not_unique"] == ALL


@pytest.mark.parametrize("noise", [1e-11, 1e-9, 1e-7])
@pytest.mark.parametrize("task", [md.Motion(until=0.1), md.Equilibrium()], ids=["motion", "rest"])
def test_without_the_key_no_start_leaves_the_sketch(noise: float, task: Any) -> None:
    """Newton's method finds poses 0.2 rad away in which the noise locks the mechanism."""
    mechanism = heavy(noise, 1)
    with pytest.raises(AssemblyError, match="does not close at the sketch") as caught:
        md.solve(mechanism, task)
    named = mechanism.with_values({"closure_tolerance": value_named(caught.value)})
    assert md.solve(named, task).fault is None


def test_a_drawing_programs_last_digits_need_no_key() -> None:
    result = md.solve(heavy(1e-12, 2), md.Motion(until=END, poses=2, tolerance=1e-11))
    assert abs(result.bodies["c1"].angle[-1] - fallen(1.0, END)) < 1e-9


def test_a_law_of_time_drives_it() -> None:
    turn = md.Driver("c1.angle", law="1 + t")
    task = md.Motion(drivers=(turn,), until=2 * math.pi, poses=9)
    result = md.solve(heavy(1e-9, 3, 1e-8), task)
    assert result.fault is None
    assert np.allclose(result.bodies["c3"].angle, result.bodies["c1"].angle, rtol=0, atol=2e-8)


def test_more_than_noise_is_refused() -> None:
    with pytest.raises(InputError, match="closure_tolerance of a mechanism that moves"):
        md.solve(heavy(1e-5, 0, 1e-4), md.Motion(until=0.1))


def test_a_rank_that_takes_noise_for_equations_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(MotionProblem, "rank", ZERO)
    result = md.solve(heavy(5e-8, 0, 5e-7), md.Motion(until=0.1, poses=2))
    assert result.summary.get("not_unique") != ALL
