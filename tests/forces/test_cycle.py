"""Cycles: how far the motion goes, and how much is evaluated for their means."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.forces.poses import Moving
from mechdae.numerics import changes

BARS = {"crank": 0.9, "coupler": 0.5, "rocker": 0.8}
GROUND = 1.0


def rocking() -> md.Mechanism:
    """No bar of it turns fully: the crank goes from 17.1 to 86.2 deg on this mode."""
    ends = {
        "A": ("ground.A", "crank.A"), "B": ("crank.B", "coupler.B"),
        "C": ("coupler.C", "rocker.C"), "D": ("ground.D", "rocker.D"),
    }  # fmt: skip
    points = {
        "crank": {"A": (0, 0), "B": (0.9, 0)}, "coupler": {"B": (0, 0), "C": (0.5, 0)},
        "rocker": {"D": (0, 0), "C": (0.8, 0)},
    }  # fmt: skip
    return md.Mechanism(
        ground=md.Ground({"A": (0, 0), "D": (GROUND, 0)}),
        bodies=[md.Body(name, own, mass=1.0, inertia=0.01) for name, own in points.items()],
        joints=[
            md.Revolute(name, *pair, friction=0.1, pin_radius=0.01) for name, pair in ends.items()
        ],
        loads=[md.Torque("work", "rocker", -2.0)],
        sketch={"crank": np.radians(40), "coupler": 0.0, "rocker": np.radians(90)},
    )


@pytest.mark.parametrize("friction", ["article", "coupled"])
@pytest.mark.parametrize("poses", [2, 37])
def test_ends_that_are_there_with_none_between(friction: str, poses: int) -> None:
    """After a whole turn the crank is back, but it cannot get there: no means, and no warning."""
    driver = md.Driver("crank.angle", from_=np.radians(40), to=np.radians(400), speed=10.0)
    task = md.Reactions(driver, poses=poses, friction=friction, cycle=True)
    result = md.solve(rocking(), task)
    assert result.status[[0, -1]].tolist() == ["ok", "ok"]
    assert "the motion does not go all the way" in str(result.fault)
    assert "loss" not in result.summary
    assert "kinks" not in result.summary


def test_kinks_are_found_where_they_are_expected(monkeypatch) -> None:
    """Each call looks at all intervals at once; few are needed to know a kink to the last bits."""
    asked: list[int] = []
    own = Moving.at

    def counted(self: Moving, places: Any) -> Any:
        asked.append(len(places))
        return own(self, places)

    problem = md.load("slider-crank-friction")
    solver = md.Solver(problem, "cycle")
    monkeypatch.setattr(Moving, "at", counted)
    result = solver()
    kinks = np.array(result.summary["kinks"])
    assert np.abs(kinks - np.pi / 2 * np.array([1, 2, 3])).max() < 2e-15
    # 360 places between the poses, 4 rounds of 15 places in 3 intervals, means of 4 panels
    assert len(asked) <= 8
    assert sum(asked) <= 360 + 4 * 3 * 15 + 3 * 4 * 15
    before = len(asked)
    assert result.fault is None
    # panels of the energy of one width at once: 6, then those with a kink beside it
    assert len(asked) - before <= 4
    assert sum(asked[before:]) <= 2 * 6 * 12


def test_kinks_away_from_the_poses() -> None:
    """A coarse grid gives the same kinks as a fine one, to their rounding."""
    problem = md.load("quick-return-friction")
    task = problem.tasks["cycle"]
    found = [
        np.array(md.solve(problem, replace(task, poses=poses)).summary["kinks"])
        for poses in (7, 73, 361)
    ]
    assert len(found[0]) > 2
    for other in found[1:]:
        assert np.abs(other - found[0]).max() < 1e-12


def test_a_crank_that_only_presses_on_its_pin_has_no_power() -> None:
    """What its driver gives is rounding, which no finer panel makes smaller."""
    crank = md.Body("crank", {"O": (0, 0)}, mass=2.0, center=(0.1, 0))
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[crank],
        joints=[md.Revolute("O", "ground.O", "crank.O")],
    )
    driver = md.Driver("crank.angle", from_=0.0, to=4 * np.pi, speed=30.0)
    result = md.solve(mechanism, md.Reactions(driver=driver, cycle=True))
    assert abs(result.summary["useful"]) < 1e-12
    assert not result.fault


def test_no_change_is_lost_where_every_interval_has_one() -> None:
    """Rows of a table at all poses, and zeros between them: more changes than intervals."""
    grid = np.arange(0.0, 41.0)

    def look(places):  # a step at each whole number, a sign between them
        signs = np.sign(np.sin(np.pi * (places - 0.5)))
        marks = np.stack([np.floor(places), signs], axis=1).astype(int)
        return marks, np.stack([places, np.sin(np.pi * (places - 0.5))], axis=1)

    guides = [("", slice(0)), ("sign", slice(1, 2))]
    found = np.array([place for place, _, _ in changes.changes(grid, *look(grid), guides, look)])
    for expected in (grid[1:], grid[:-1] + 0.5):
        assert np.abs(found[:, None] - expected).min(axis=0).max() < 1e-12


def test_intervals_narrow_as_fast_as_a_line_allows() -> None:
    """An interval of sin around pi: places crowd around the zero of the line through its ends."""
    low, high = np.array([3.0]), np.array([3.3])
    marks = np.array([[0, 0, 0, 0, 1]]), np.array([[0, 0, 0, 0, -1]])
    guides = [("", slice(0))] * 4 + [("sign", slice(0, 1))]
    own = changes.Intervals(low, high, *marks, np.sin(low)[:, None], np.sin(high)[:, None])
    widths = []
    for _ in range(3):
        places = own.places(guides)
        assert (np.diff(np.hstack([own.low, places[0], own.high])) >= 0).all()
        inner = np.zeros((places.size, 5), int)
        inner[:, 4] = np.sign(np.sin(places.ravel()))
        own = own.cut(places, inner, np.sin(places.ravel())[:, None])
        widths.append(float(own.high[0] - own.low[0]))
    assert widths[0] < 1e-2
    assert widths[1] < 1e-6
    assert widths[2] < 1e-12
    assert own.low[0] <= np.pi <= own.high[0]
