"""Regular poses of spatial loops are certified; what is not says whether it opens, loses rank or
has no certificate."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.equations.tree import closures, tree_model
from mechdae.motion.kinematics import modes_task
from tests.attack.loops_of_pairs import run, turn
from tests.shared.paths import ROOT

STRUT = ROOT / "tests/data/spatial/macpherson-wheel-height.toml"
HINGE, TOP, RACK = [0.25, 0.4, 0.2], [-0.04, 0.7, 0.85], [0.05, 0.2, 0.25]
OUTER, SLEEVE, TIE = [0, 0.9, 0.2], [-0.014, 0.83, 0.4275], [0.15, 0.8, 0.275]
WHEEL, CENTRE = [-0.02, 0.95, 0.313426], [-0.02, 0.8, 0.308426]
AXIS, STRAIGHT = np.array([0.5, -0.05, 0]), np.array([-0.026, -0.13, 0.4225])
LOOPS = ("CCPS", "CRCS", "PSCP", "SCUC", "RPUS", "CSU", "SCS", "RSSS")
"""Balls and slides, and parts that spin freely: a sample of `tests.attack.loops_of_pairs`."""


def knuckle(height: float) -> tuple[Any, Any, float]:
    """Return place and rotation of the knuckle from the pose drawn, and its least singular value.

    By its six coordinates: the outer ball on the arm's circle, the strut's axis through the top,
    the length of the tie bar, the wheel's height.
    """
    arm, along = np.array(OUTER) - HINGE, AXIS / np.linalg.norm(AXIS)
    across = np.linalg.svd(STRAIGHT[None])[2][1:]
    r, R = np.zeros(3), np.eye(3)
    for _ in range(30):
        o, s, T, W = (R @ np.array(p) + r for p in (OUTER, SLEEVE, TIE, WHEEL))
        tie = np.linalg.norm(np.array(TIE) - RACK)
        F = [
            (o - HINGE) @ (o - HINGE) / 2 - arm @ arm / 2,
            (o - HINGE - arm) @ along,
            *(across @ R.T @ (np.array(TOP) - s)),
            (T - RACK) @ (T - RACK) / (2 * tie) - tie / 2,
            W[2] - height,
        ]
        rows = [
            np.concatenate([o - HINGE, np.cross(o - r, o - HINGE)]),
            np.concatenate([along, np.cross(o - r, along)]),
            *(np.concatenate([-R @ n, -np.cross(np.array(TOP) - r, R @ n)]) for n in across),
            np.concatenate([T - RACK, np.cross(T - r, T - RACK)]) / tie,
            np.concatenate([[0, 0, 1], np.cross(W - r, [0, 0, 1])]),
        ]
        step = np.linalg.solve(np.array(rows), -np.array(F))
        r, R = r + step[:3], turn(step[3:]) @ R
    assert np.abs(F).max() < 1e-15
    return r, R, float(np.linalg.svd(np.array(rows), compute_uv=False)[-1])


def test_a_strut_driven_by_the_height_of_its_wheel() -> None:
    result = md.solve(md.load(STRUT), task="bump")
    assert list(result.status) == ["ok"] * 5
    for k, height in enumerate(result.drivers["knuckle.W.z"].position):
        r, R, least = knuckle(float(height))
        assert least > 0.05
        for name, place in (("I", CENTRE), ("W", WHEEL), ("S", SLEEVE)):
            off = result.points[f"knuckle.{name}"].position[k] - (R @ np.array(place) + r)
            assert np.abs(off).max() < 1e-12
    assert result.bound.length.max() < 1e-8


def test_all_modes_of_the_strut_are_certified() -> None:
    result = md.solve(md.load(STRUT), task="modes")
    assert list(result.status) == ["ok"] * 4
    r, R, _ = knuckle(0.313426)
    off = result.points["knuckle.I"].position - (R @ np.array(CENTRE) + r)
    assert np.abs(off).max(axis=1).min() < 1e-12


@pytest.mark.parametrize("loop", LOOPS)
def test_no_regular_pose_of_a_loop_is_refused(loop: str) -> None:
    found = run(loop, 1, 1)
    assert found["ok"] + 3 * found["not regular"] == 3
    assert not found["wrong"]


def _plain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Plant rows and drivers whose bounds are those of their terms."""
    monkeypatch.setattr(closures.CutJoint, "_inside", False)
    monkeypatch.setattr(closures.CutJoint, "square_reach", lambda *_: None)
    monkeypatch.setattr(tree_model.TreeModel, "driver_reach", lambda *_: None)


def test_rows_bounded_by_their_terms_refuse_the_strut(monkeypatch: pytest.MonkeyPatch) -> None:
    _plain(monkeypatch)
    result = md.solve(md.load(STRUT), task="bump")
    assert set(result.status) == {"singular"}
    (entry,) = result.summary["failed"]
    assert entry["cause"] == "certificate"
    assert 0.01 < entry["least_singular_value"] < 1
    assert "5 of 5 poses have no values" in result.fault
    assert "keeps its rank" in result.fault
    assert "opens" not in result.fault


def test_modes_without_a_certificate_say_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(modes_task, "H_LIMIT", 0.0)
    (note,) = md.solve(md.load(STRUT), task="modes").summary["notes"]
    assert note.startswith("not certified, though the equations keep their rank there: ")


def test_a_pose_where_rank_is_lost_says_so() -> None:
    """A parallelogram at its fold, where two branches meet."""
    mechanism = md.Mechanism(
        ground=md.Ground({"A": [0, 0], "D": [2, 0]}),
        bodies=[
            md.Body("left", {"A": [0, 0], "B": [1, 0]}),
            md.Body("rod", {"B": [0, 0], "C": [2, 0]}),
            md.Body("right", {"D": [0, 0], "C": [1, 0]}),
        ],
        joints=[
            md.Revolute("A", "ground.A", "left.A"),
            md.Revolute("B", "left.B", "rod.B"),
            md.Revolute("C", "rod.C", "right.C"),
            md.Revolute("D", "ground.D", "right.D"),
        ],
        sketch={"left.angle": 0.0, "rod.angle": 0.0, "right.angle": 0.0},
    )
    driver = md.Driver("left.angle", at=[0.0])
    result = md.solve(mechanism, md.Sweep(driver=driver))
    assert list(result.status) == ["singular"]
    (entry,) = result.summary["failed"]
    assert entry["cause"] == "rank"
    assert entry["least_singular_value"] < 1e-15
    assert "loses rank there" in result.fault
    assert "opens" not in result.fault
    (note,) = md.solve(mechanism, md.Modes(driver=driver)).summary["notes"]
    assert note.startswith("not certified, modes meet within the rounding of the data: ")
