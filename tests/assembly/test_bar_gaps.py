"""Gaps of bars that do not close are lengths in metres, whatever their lengths are called."""

from __future__ import annotations

import re
from math import cos, hypot, sin, sqrt

import numpy as np
import pytest

import mechdae as md
from tests.reference.virtual_work import about
from tests.shared.paths import DATA

CASES = DATA / "gaps"
TOLD = re.compile(r"joint (\w+) stays open by ([\d.e+-]+) m\b")


def told(problem: md.Problem | md.Mechanism, task: str | md.Sweep | md.Modes) -> tuple[str, float]:
    """Return which joint stays open, and by how much."""
    try:
        result = md.solve(problem, task)
        text = str(result.fault)
    except md.MechdaeError as error:
        text = error.what
    found = TOLD.search(text)
    assert found is not None, text
    return found[1], float(found[2])


def gap(least: float, most: float, length: float) -> float:
    """Return by how much a bar misses two points whose distance is between two bounds."""
    return least - length if length < least else length - most


def test_a_bar_that_is_too_short() -> None:
    """B of the crank is at (0.02, 0.02 sqrt 3), C turns about D with a radius of 0.08."""
    far = hypot(0.28, 0.02 * sqrt(3))
    problem = md.load(CASES / "bar-too-short.toml")
    joint, size = told(problem, "turn")
    assert joint == "bar"
    assert size == pytest.approx(far - 0.08 - 0.05, rel=1e-3)


def test_plates_in_space() -> None:
    """A name is no other bar than its number, and gaps are no longer than the mechanism."""
    problem = md.load(CASES / "plate-on-named-bars.toml")
    assert told(problem, "s") == told(problem.with_values({"a1.length": 0.1}), "s")
    problem = md.load(CASES / "plate-on-a-short-tie.toml")
    assert told(problem, "m")[0] == "tie"
    for task in ("m", "p"):
        assert told(problem, task)[1] < hypot(1, 1, 1)


@pytest.mark.parametrize("named", [False, True])
def test_bars_of_cranks_and_rockers(named: bool) -> None:
    rng = np.random.default_rng(7)
    for _ in range(12):
        r, c, u = rng.uniform(0.2, 0.5), rng.uniform(0.2, 0.5), rng.uniform(-3, 3)
        D = rng.uniform(0.5, 1.5, 2)
        far = hypot(D[0] - r * cos(u), D[1] - r * sin(u))
        least, most = abs(far - c), far + c
        length = least * rng.uniform(0.1, 0.9) if rng.random() < 0.5 else most * rng.uniform(1.1, 5)
        mechanism = md.Mechanism(
            ground=md.Ground({"A": (0, 0), "D": D}),
            bodies=[
                md.Body("crank", {"A": (0, 0), "B": (r, 0)}),
                md.Body("rocker", {"D": (0, 0), "C": (c, 0)}),
            ],
            joints=[
                md.Revolute("A", "ground.A", "crank.A"),
                md.Revolute("D", "ground.D", "rocker.D"),
                md.Distance("bar", "crank.B", "rocker.C", length="l" if named else length),
            ],
            parameters={"l": length} if named else {},
            sketch={"crank": u, "rocker": 1.0},
        )
        joint, size = told(mechanism, md.Sweep(md.Driver("crank.angle", at=[u])))
        assert joint == "bar"
        assert size == pytest.approx(gap(least, most, length), rel=1e-3)
        swung = md.Mechanism(
            ground=md.Ground({"B": (r * cos(u), r * sin(u)), "D": D}),
            bodies=[md.Body("rocker", {"D": (0, 0), "C": (c, 0)}, mass=1.0, inertia=1.0)],
            joints=[
                md.Revolute("D", "ground.D", "rocker.D"),
                md.Distance("bar", "ground.B", "rocker.C", length="l" if named else length),
            ],
            parameters={"l": length} if named else {},
            sketch={"rocker": 1.0},
        )
        joint, size = told(swung, md.Motion(until=1.0))
        assert joint == "bar"
        widest = max(abs(least - length), abs(most - length))
        assert gap(least, most, length) * 0.999 < size < widest * 1.001


def test_bars_of_hinges_in_space() -> None:
    """|D + R(q) c - B|^2 lies between S - hypot(P, Q) and S + hypot(P, Q)."""
    rng = np.random.default_rng(3)
    for _ in range(8):
        a, d = (own / np.linalg.norm(own) for own in rng.normal(size=(2, 3)))
        b, c, D = rng.normal(size=(3, 3)) * np.array([[0.3], [0.3], [1.0]])
        u = float(rng.uniform(-3, 3))
        B = about(a, u) @ b
        w, flat = D - B, c - d * (d @ c)
        swing = hypot(float(2 * w @ flat), float(2 * w @ np.cross(d, c)))
        middle = w @ w + c @ c + 2 * (w @ d) * (d @ c)
        least, most = sqrt(max(middle - swing, 0.0)), sqrt(middle + swing)
        length = least * 0.3 if least > 0.05 else most * 1.7
        mechanism = md.Mechanism(
            dimension=3,
            ground=md.Ground({"A": (0, 0, 0), "D": D}),
            bodies=[
                md.Body("crank", {"A": (0, 0, 0), "B": b}),
                md.Body("rocker", {"D": (0, 0, 0), "C": c}),
            ],
            joints=[
                md.SpatialRevolute("A", "ground.A", "crank.A", axis=a),
                md.SpatialRevolute("D", "ground.D", "rocker.D", axis=d),
                md.Distance("bar", "crank.B", "rocker.C", length="l"),
            ],
            parameters={"l": length},
            sketch={"A.angle": u, "D.angle": 1.0},
        )
        joint, size = told(mechanism, md.Sweep(md.Driver("A.angle", at=[u])))
        assert joint == "bar"
        assert size == pytest.approx(gap(least, most, length), rel=1e-3)
