"""Arrows of loads on pages of spatial mechanisms: in the frame that the load is given in."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from mechdae.draw.fragments import fragments


@pytest.mark.parametrize(
    ("name", "load", "places", "head"),
    [
        ("five-rod-suspension", "road", ["carrier.W"], (0.0, 0.0, 1.0)),
        ("bevel-differential", "left", ["left_pin/"], None),
    ],
)
def test_arrows_move_with_the_place_of_a_load(name, load, places, head):
    result = md.solve(name)
    drawing = fragments(result, np.linspace(0.0, 1.0, len(result.status)))[1]
    parts = [part for part in drawing["solids"] if part["id"] == f"load-{load}"]
    assert parts
    assert {(*part["at"], part["turn"]) for part in parts} == {(*places, "")}
    if head is not None:  # from behind to the tip: in the direction of the file
        shapes = [shape for part in parts for shape in part["shapes"] if shape[0] == "head"]
        behind, tip = np.reshape(shapes[0][3], (2, 3))
        way = (tip - behind) / np.linalg.norm(tip - behind)
        assert way == pytest.approx(head, abs=1e-3)
    assert any(part["id"] == f"label-load-{load}" for part in drawing["parts"])
