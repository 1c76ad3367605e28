"""A sample of the random spatial loops: no pose `ok` and outside of its bound."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.attack.spatial_honesty import LOOPS, case, judged

SLOW = ("RCCC", "RRRRRRR", "RUURR")


@pytest.mark.parametrize("loop", [name for name in LOOPS if name not in SLOW])
def test_poses_are_where_the_closure_puts_them(loop: str) -> None:
    found = case(np.random.default_rng(sum(map(ord, loop))), loop)
    told = judged(found, poses=3)
    assert told["ok"] >= 1  # the planted pose is the middle one
    assert told["wrong"] == 0
    assert told["wide"] == 0


def test_the_closure_sees_a_point_that_is_off() -> None:
    """The judge of this file: a mechanism whose bar is 1e-9 longer is found out."""
    found = case(np.random.default_rng(3), "RSRC")
    points = dict(found.mechanism.bodies["b1"].points)
    x, y, z = points["P1"]
    points["P1"] = (x + 1e-9, y, z)
    longer = replace(found.mechanism.bodies["b1"], points=points)
    bodies = found.mechanism.bodies.with_("b1", longer)
    told = judged(replace(found, mechanism=replace(found.mechanism, bodies=bodies)), poses=3)
    assert told["wrong"] == told["ok"] >= 1
