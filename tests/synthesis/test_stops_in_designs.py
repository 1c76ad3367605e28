"""Designs keep joints between their limits, judged by the law of cosines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mechdae as md


def rocker_angles(r1: float, r2: float, r3: float, r4: float, mode: int) -> np.ndarray:
    """Return the angle of B0 B to the line A0 B0 over a turn of the crank."""
    u = np.linspace(0, 2 * np.pi, 721)
    x, y = r2 * np.cos(u) - r1, r2 * np.sin(u)
    far = np.hypot(x, y)
    inner = np.arccos((r4**2 + far**2 - r3**2) / (2 * r4 * far))
    return np.unwrap(np.arctan2(y, x) + mode * inner)


@pytest.mark.slow
@pytest.mark.parametrize(("limits", "wide"), [((1.0, 2.6), 2.7e-5), ((0.2, 1.4), 3.9e-4)])
def test_a_rocker_stays_between_its_stops(limits: tuple[float, float], wide: float) -> None:
    """Without them the best design, of an error of 7.4e-7, swings the rocker beyond."""
    problem = md.load("c2-arc5-timed")
    joints = problem.mechanism.joints
    pin = md.Revolute("B0", joints["B0"].first, joints["B0"].second, limits=limits)
    joints = joints.with_("B0", pin)
    task = replace(problem.tasks["design"], starts=6)
    objectives = []
    for mechanism in (problem.mechanism, replace(problem.mechanism, joints=joints)):
        result = md.solve(replace(problem, mechanism=mechanism), task)
        design = result.data["designs"][0]
        assert not design["defects"]
        objectives.append(design["objective"])
        sizes = [design["parameters"][name] for name in ("r1", "r2", "r3", "r4")]
        swings = [rocker_angles(*sizes, mode) for mode in (1, -1)]
        turns = [2 * np.pi * np.round((a.mean() - np.mean(limits)) / (2 * np.pi)) for a in swings]
        fits = [
            bool((a - t).min() > limits[0] - 1e-3 and (a - t).max() < limits[1] + 1e-3)
            for a, t in zip(swings, turns, strict=True)
        ]
        assert any(fits) == (len(objectives) == 2)
    assert objectives[0] < 1e-6 < wide < objectives[1] < 2 * wide
