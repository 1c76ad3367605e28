"""What does not close is refused in bounded work."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.kernels.graphs.blocks import BlockGraph
from mechdae.motion.assembly import multistart
from mechdae.motion.assembly.assembler import Assembler


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
    honest = Assembler._polish

    def counted(self, *rest):
        count[0] += 1
        return honest(self, *rest)

    with monkeypatch.context() as patch:
        patch.setattr(Assembler, "_polish", counted)
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
