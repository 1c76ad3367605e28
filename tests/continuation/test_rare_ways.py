"""Ways that no predefined problem goes, once each: long chains, 50 digits, gaps that stay."""

from __future__ import annotations

import math
from dataclasses import replace

import mpmath
import numpy as np
import pytest

import mechdae as md
from mechdae.motion.continuation.path import Path
from mechdae.motion.kinematics.prepared import prepare
from mechdae.motion.kinematics.sweep import run
from mechdae.parts.bench.chain import chain
from tests.reference.levers import LONG, levers
from tests.shared.mechanisms import four_bar, toggle

LOOPS = 20
"""Four-bars in a row, from which on steps are proved around polynomials of degree five."""


def test_steps_of_a_long_chain() -> None:
    """All are proved, and the poses between them are those of the closed form."""
    item = chain(LOOPS)
    task = replace(item.task, poses=9)
    path = run(prepare(item.problem, task), task).path
    assert isinstance(path, Path)
    assert path.quintics is not None
    assert path.counts.rejected == 0
    result = md.solve(item.problem, task)
    places = np.asarray(result.drivers["rocker0.angle"].position, LONG)
    found = levers(places, LOOPS, *(LONG(text) for text in ("0.02", "0.11", "0.05", "0.1", "1")))
    for k, (angle, _, _) in enumerate(found, start=1):
        off = result.bodies[f"rocker{k}"].angle - angle.astype(float)
        off -= 2 * np.pi * np.round(off / (2 * np.pi))
        assert np.abs(off).max() <= result.bound["angle"].max() + 4e-15, k


@pytest.mark.parametrize("gap", [1e-12, 1e-14])
def test_branches_that_nearly_meet(gap: float) -> None:
    """A parallelogram but for its coupler: next to the stretched pose doubles lose all digits.

    The rocker is where two circles meet, in 60 digits, on one side all the way.
    """
    b = 2.0 + gap
    at = [2.9, *(math.pi + step for step in (-1e-3, -1e-6, -1e-7, 1e-6, 1e-5)), 3.3]
    mechanism = four_bar(1.0, b, 1.0, 2.0, crank=1.0, coupler=0.0, rocker=1.0)
    result = md.solve(mechanism, md.Sweep(md.Driver("crank.angle", at=at)))
    assert set(result.status) == {"ok"}
    assert result.summary["bound"] == "proved"
    with mpmath.workdps(60):
        for k, angle in enumerate(at):
            B = mpmath.expj(mpmath.mpf(angle))
            along = 2 - B
            e = abs(along)
            x = (mpmath.mpf(b) ** 2 - 1 + e * e) / (2 * e)
            C = B + along / e * mpmath.mpc(x, mpmath.sqrt(mpmath.mpf(b) ** 2 - x * x))
            turn = (result.bodies["rocker"].angle[k] - float(mpmath.arg(C - 2))) / (2 * math.pi)
            off = 2 * math.pi * abs(turn - round(turn))
            assert off <= result.bound["angle"][k] + 1e-15, angle
    assert result.bound["angle"][2:5].max() < 1e-15  # those in 50 digits


def test_a_coupler_that_does_not_reach_is_drawn_open() -> None:
    """Crank and rocker in line towards each other: what lacks is what their lengths lack."""
    mechanism = four_bar(1.0, 2.0, 1.5, 5.0, crank=0.0, coupler=0.1, rocker=3.0)
    task = md.Sweep(md.Driver("crank.angle", at=[0.0]))
    result = md.open_pose(md.Problem(mechanism, {"pose": task}))
    (joint,) = result.summary["open"]
    assert joint["joint"] == "C"
    assert joint["gap"] == pytest.approx(5.0 - 1.0 - 2.0 - 1.5, rel=1e-9)
    assert result.bodies["crank"].angle == pytest.approx([0.0], abs=1e-15)


def test_a_law_that_touches_a_limit_position() -> None:
    """Two links of 1 m, stretched to 2 m - 0.3 (t - 0.1)^4: their angles differ by (t - 0.1)^2."""
    law = md.Driver("g.slide", law="2 - 0.3*(t - 0.1)**4", from_=-1.0, to=1.0)
    result = md.solve(toggle(0.9), md.Sweep(law, poses=41))
    (event,) = (own for own in result.events if own["kind"] == "change_point")
    assert event["order"] == 2
    low, high = event["range"]
    assert low <= 0.1 <= high
    assert high - low < 0.01
    assert event["time"] == pytest.approx(0.1, abs=1e-6)
    assert set(result.status[result.time > high]) == {"unassembled"}  # both ways go on
