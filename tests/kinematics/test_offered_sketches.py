"""The sketches that modes offer are followed near limit positions, where digits decide."""

from __future__ import annotations

import math

import numpy as np
import pytest

import mechdae as md

CRANK, COUPLER, ROCKER = 1.0, 3.0, 2.5


def four_bar(ground: float, sketch: dict[str, float]) -> md.Mechanism:
    return md.Mechanism(
        ground=md.Ground({"A": (0, 0), "D": (ground, 0)}),
        bodies=[
            md.Body("crank", {"A": (0, 0), "B": (CRANK, 0)}),
            md.Body("coupler", {"B": (0, 0), "C": (COUPLER, 0)}),
            md.Body("rocker", {"D": (0, 0), "C": (ROCKER, 0)}),
        ],
        joints=[
            md.Revolute("A", "ground.A", "crank.A"), md.Revolute("B", "crank.B", "coupler.B"),
            md.Revolute("C", "coupler.C", "rocker.C"), md.Revolute("D", "ground.D", "rocker.D"),
        ],
        sketch=sketch,
    )  # fmt: skip


@pytest.mark.parametrize("ground", [4.0, 4.1, 4.2, 4.3])
@pytest.mark.parametrize("before", [1e-3, 1e-6, 1e-8])
def test_a_mode_next_to_a_limit_is_assembled_from_its_sketch(before: float, ground: float) -> None:
    """The rocker is farthest out where crank and coupler are in line: law of cosines."""
    far = CRANK + COUPLER
    inside = math.acos((ground**2 + ROCKER**2 - far**2) / (2 * ground * ROCKER))
    at = math.pi - inside + before
    driver = md.Driver("rocker.angle", at=[at])
    rough = {"crank": 0.6, "coupler": 0.6, "rocker": at}
    modes = md.solve(four_bar(ground, rough), md.Modes(driver))
    assert len(modes.status) == 2
    for k, lines in enumerate(modes.summary["sketches"]):
        sketch = {name.removesuffix("_deg"): math.radians(v) for name, v in lines.items()}
        pose = md.solve(four_bar(ground, sketch), md.Sweep(driver))
        assert list(pose.status) == ["ok"]
        assert np.allclose(pose.bodies["crank"].angle, modes.bodies["crank"].angle[k], atol=1e-9)
