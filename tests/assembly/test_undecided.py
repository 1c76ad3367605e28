"""What is meant where a sketch does not decide, what is refused, and what a note says."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.describe.file.load import load as load_file
from mechdae.describe.structure import cylinders
from mechdae.errors import SketchError
from mechdae.motion.assembly.turns.undecided import Undecided
from tests.shared.paths import DATA

STEWART = DATA / "starts" / "stewart.toml"


def stewart_legs() -> None:
    """Lengths of the legs from the places of the platform, by hand."""
    problem = load_file(STEWART)
    task = replace(problem.tasks["ik"], outputs=None)
    result = md.solve(problem.with_task("all", task), "all")
    points, values = result.points, problem.mechanism.values()
    turns = np.array(result.bodies["plate"].orientation)
    for k in range(1, 7):
        local = np.array([values[f"plate.T{k}.{axis}"] for axis in "xyz"])
        w, v = turns[:, :1], turns[:, 1:]
        moved = local + 2 * np.cross(v, np.cross(v, local) + w * local)
        foot = np.array([values[f"ground.B{k}.{axis}"] for axis in "xyz"])
        wanted = np.linalg.norm(points["plate.C"].position + moved - foot, axis=1)
        assert np.abs(result.joints[f"leg{k}"].slide - wanted).max() < 1e-9
    (note,) = result.summary["notes"]
    assert all(f"U{k}" in note for k in range(1, 7))


def test_legs_that_are_not_sketched_are_pushed_out() -> None:
    stewart_legs()


def test_a_leg_of_negative_length_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted: the legs are not pushed out, and of their angles those about the balls decide."""
    monkeypatch.setattr(Undecided, "_pushed_out", lambda self, part, near, u: near)
    monkeypatch.setattr(Undecided, "_least_turned", lambda self, part, near, u: (near[:1], []))
    with pytest.raises(AssertionError):
        stewart_legs()


def crane(foot: tuple[float, float], **sketch: float) -> md.Mechanism:
    """A boom turned by a crank, with a cylinder from a foot to its end that is not driven."""
    return md.Mechanism(
        ground=md.Ground({"O": (0, 0), "F": foot}),
        bodies=[
            md.Body("boom", {"O": (0, 0), "E": (2, 0)}),
            md.Body("barrel", {"F": (0, 0)}),
            md.Body("rod", {"E": (0, 0)}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "boom.O"),
            md.Revolute("F", "ground.F", "barrel.F"),
            md.Revolute("E", "boom.E", "rod.E"),
            md.Prismatic("ram", "barrel.F", "rod.E", axis=0, turn=0),
        ],
        sketch=sketch,
    )


@pytest.mark.parametrize("seed", range(12))
def test_a_cylinder_is_positive_unless_told(seed: int) -> None:
    rng = np.random.default_rng(seed)
    foot, theta = tuple(rng.uniform(-3, 3, 2)), float(rng.uniform(-3, 3))
    end = 2 * np.exp(1j * theta) - complex(*foot)
    task = md.Sweep(md.Driver("boom.angle", at=[theta]))
    result = md.solve(crane(foot, boom=theta), task)
    assert result.joints["ram"].slide[0] == pytest.approx(abs(end), rel=1e-12)
    assert not result.summary.get("notes")
    back = md.solve(crane(foot, boom=theta, ram=-abs(end)), task)
    assert back.joints["ram"].slide[0] == pytest.approx(-abs(end), rel=1e-12)
    turned = float(np.angle(-end))
    beside = md.solve(crane(foot, boom=theta, barrel=turned), task)
    assert beside.joints["ram"].slide[0] == pytest.approx(-abs(end), rel=1e-12)
    (note,) = beside.summary["notes"]
    assert "ram.slide is negative at first" in note


def test_which_sliding_joints_are_cylinders() -> None:
    assert cylinders(crane((1, 1))) == ["ram"]
    assert cylinders(md.load("slider-crank-friction").mechanism) == []
    assert cylinders(load_file(STEWART).mechanism) == [f"leg{k}" for k in range(1, 7)]


def four_bar(**sketch: float) -> md.Mechanism:
    mechanism = load_file(DATA / "starts" / "four-bar.toml").mechanism
    return replace(mechanism, sketch=sketch)


def test_degrees_without_a_suffix_choose_no_mode() -> None:
    """Beyond a right angle nothing was chosen: a mode was answered with a note."""
    mechanism = four_bar(crank=30.0, coupler=97.0, rocker=23.0)
    for task in (md.Sweep(md.Driver("crank.angle", at=[0.4])), md.Motion(at=[0, 1e-3])):
        with pytest.raises(SketchError, match="chooses no assembly mode") as caught:
            md.solve(mechanism, task)
        assert "in radians" in caught.value.hint
    told = caught.value.hint.rpartition("nearest one has ")[2]
    near = {
        key.removesuffix("_deg"): math.radians(float(value))
        for key, value in (part.split(" = ") for part in told.split(", "))
    }
    result = md.solve(replace(mechanism, sketch={**mechanism.sketch, **near}), task)
    assert result.bodies["coupler"].angle[0] == pytest.approx(near["coupler"], abs=1e-5)


def test_a_link_of_negative_length_is_told() -> None:
    data = {
        "schema": 1, "parameters": {"AB": -0.4}, "ground": {"points": {"A": [0, 0]}},
        "bodies": {"crank": {"points": {"A": [0, 0], "B": ["AB", 0]}}},
        "joints": {"A": {"kind": "revolute", "between": ["ground.A", "crank.A"]}},
        "tasks": {"turn": {"kind": "sweep", "driver": {"coordinate": "crank.angle", "at": [0]}}},
    }  # fmt: skip
    (note,) = md.solve(from_dict(data), "turn").summary["notes"]
    assert "AB is negative: B of crank lies behind A" in note
