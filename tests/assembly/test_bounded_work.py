"""What does not close is refused in bounded work."""

from __future__ import annotations

import importlib

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.design.derivatives import function
from mechdae.design.studies.batches import march
from mechdae.kernels.graphs.blocks import BlockGraph
from mechdae.motion.assembly import multistart
from mechdae.motion.assembly.assembler import Assembler
from mechdae.motion.kinematics import near_poses
from mechdae.numerics import radau


def two_pins_that_contradict():
    """Two bodies on two common pins, 5 apart on one and 3 on the other, a guide on the ground."""
    return {
        "schema": 1,
        "ground": {"points": {"p0": [-1.0, 2.0]}},
        "bodies": {
            "b0": {"points": {"p0": [1.0, -1.0], "p1": [2.0, -1.0], "p2": [-2.0, 2.0]}},
            "b2": {"points": {"p0": [2.0, 2.0], "p2": [-1.0, 2.0], "p3": [2.0, -2.0]}},
        },
        "joints": {
            "j0": {"kind": "revolute", "between": ["b2.p0", "b0.p2"]},
            "j3": {"kind": "revolute", "between": ["b0.p1", "b2.p2"]},
            "j4": {"kind": "prismatic", "between": ["b2.p3", "ground.p0"], "axis": np.pi / 2},
        },
        "sketch": {"b0": 0.0, "b2": -3.0},
        "tasks": {
            "a": {
                "kind": "sweep",
                "driver": {"coordinate": "b0.p0.x", "from": 0.3, "to": 0.9},
                "poses": 5,
            }
        },
    }


def polished(monkeypatch):
    """Return how many poses are polished until the mechanism is refused."""
    count = [0]
    honest = Assembler.polish

    def counted(self, *rest):
        count[0] += 1
        return honest(self, *rest)

    with monkeypatch.context() as patch:
        patch.setattr(Assembler, "polish", counted)
        with pytest.raises(md.MechdaeError):
            md.solve(from_dict(two_pins_that_contradict()), task="a")
    return count[0]


def test_what_is_met_at_infinity_is_no_pose(monkeypatch):
    """A length of 1e16 m meets every equation within its rounding."""
    assert polished(monkeypatch) < 50


def test_a_crowd_of_solutions_ends_the_search(monkeypatch):
    """Planted: places at infinity count; the search then ends with as many as it may have."""
    monkeypatch.setattr(multistart, "FAR", np.inf)
    crowded = polished(monkeypatch)
    assert multistart.CROWD < crowded < 4 * multistart.CROWD


def test_continua_are_told_in_few_steps(monkeypatch):
    """With axes turned round, which is no pose, Bricard's links move by themselves.

    Hundreds of such places are met by the search; sixty steps at each were 220 000 evaluations.
    """
    count = [0]
    honest = BlockGraph.value_at

    def counted(self, *rest):
        count[0] += 1
        return honest(self, *rest)

    monkeypatch.setattr(BlockGraph, "value_at", counted)
    result = md.solve("bricard", "poses")
    assert list(result.status) == ["ok"] * 3
    assert count[0] < 10_000


# -- searches that give up say so ------------------------------------------------------------------

FOUR_BAR = "four-bar-crank-rocker"
PLACE, WORD = "points/coupler.P/position", "summary/swing/rocker"


def turned(at, **keys):
    return md.solve(FOUR_BAR, md.Sweep(driver=md.Driver("crank.angle", at=at)), **keys)


@pytest.mark.parametrize(
    ("module", "bound", "value", "call", "words"),
    [
        ("motion.continuation.follower", "MOST_STEPS", 20, lambda: turned([0.5, 60.0]),
         "takes 1.2e.03 steps, at most 20 are followed"),
        ("motion.assembly.mode_tree", "DEEPEST", 0, lambda: md.solve("watt-six-bar", "modes"),
         "the assembly modes are not counted"),
        ("motion.assembly.nearest_mode", "MOST_BEGUN", 1, lambda: md.solve("watt-six-bar", "turn"),
         "no mode near the sketch is found: 2 were begun"),
        ("dynamics.run", "MOST", 50, lambda: md.solve("double-pendulum", "regular"),
         "more than 50 states would be kept"),
    ],
)  # fmt: skip
def test_a_search_that_gives_up_says_so(module, bound, value, call, words, monkeypatch):
    monkeypatch.setattr(importlib.import_module(f"mechdae.{module}"), bound, value)
    with pytest.raises(md.MechdaeError, match=words):
        call()


def test_parameters_that_are_not_led_to_have_no_number(monkeypatch):
    far = md.function(FOUR_BAR, inputs=["crank.angle", "a"], outputs=[PLACE])
    assert np.isfinite(np.array(far(0.7, 0.2))).all()
    monkeypatch.setattr(function, "HALVINGS", 0)
    assert np.isnan(np.array(far(0.7, 0.2))).all()


def test_poses_without_a_short_way_are_those_of_the_long_one(monkeypatch):
    """Steps near a known pose, steps of many sets at once: where they end, others go on."""
    known = turned([2.5])
    lengths = {"a": [0.039, 0.04, 0.041]}
    study = md.Study(of="turn", samples=lengths, outputs=[WORD])
    sets = md.solve(FOUR_BAR, study)
    monkeypatch.setattr(near_poses, "MOST_STEPS", 0)
    monkeypatch.setattr(march, "MOST", 1)
    again, others = turned([2.5]), md.solve(FOUR_BAR, study)
    gap = again.points["coupler.P"].position - known.points["coupler.P"].position
    assert np.abs(gap).max() < 1e-13
    assert np.abs(others.table[WORD] - sets.table[WORD]).max() < 1e-12


def test_steps_that_shrink_to_nothing_end_an_integration():
    """y' has no number behind t = 0.1."""

    def rates(t, y):
        return np.where(t[:, None] < 0.1, 1.0, np.nan) + 0 * y

    steps = radau.steps(rates, lambda t, y: 0 * np.eye(1), 0.0, np.zeros(1), 1.0, 1e-6, 0.01)
    with pytest.raises(ArithmeticError, match="goes to nothing"):
        list(steps)
