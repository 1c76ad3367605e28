"""Ends of an assembled arc at which branches meet: the arc is whole up to a hair before them."""

from __future__ import annotations

import math

import numpy as np
import pytest

import mechdae as md
from mechdae.motion.kinematics import assembled_arc


def lift(stages: int, foot: float, share: float) -> md.Mechanism:
    """Return a scissor lift on a ram from the ground to a bar of its second stage."""
    bodies, joints, sketch = [], [], {"tube": 1.7, "ram": 0.8}
    for k in range(1, stages + 1):
        ends = {"P": (0, 0), "M": (0.5, 0), "Q": (1, 0), "S": (share, 0)}
        bodies += [md.Body(f"a{k}", ends), md.Body(f"b{k}", ends)]
        joints.append(md.Revolute(f"M{k}", f"a{k}.M", f"b{k}.M"))
        sketch |= {f"a{k}": math.pi / 6, f"b{k}": 5 * math.pi / 6}
        if k > 1:
            joints.append(md.Revolute(f"A{k}", f"b{k - 1}.Q", f"a{k}.P"))
            joints.append(md.Revolute(f"B{k}", f"a{k - 1}.Q", f"b{k}.P"))
    joints += [
        md.Revolute("O", "ground.O", "a1.P"),
        md.PinInSlot("roll", "ground.O", "b1.P", axis=0.0),
        md.Revolute("R", "ground.R", "tube.R"),
        md.Prismatic("ram", "tube.R", "rod.S"),
        md.Revolute("S", "rod.S", "a2.S"),
    ]
    bodies += [md.Body("tube", {"R": (0, 0)}), md.Body("rod", {"S": (0, 0)})]
    ground = md.Ground({"O": (0, 0), "R": (foot, 0)})
    return md.Mechanism(ground=ground, bodies=bodies, joints=joints, sketch=sketch)


ARC = md.Sweep(md.Driver("ram.slide", range="assembled"), poses=9)


@pytest.mark.parametrize(("stages", "foot", "share"), [(2, 0.95, 0.6), (3, 0.9, 0.7)])
def test_a_lift_moves_from_flat_to_upright(stages: int, foot: float, share: float) -> None:
    """At both ends all bars are in one line: the ram ends in line with them, or at right angles."""
    result = md.solve(lift(stages, foot, share), ARC)
    assert result.fault is None
    assert set(result.status) == {"ok"}
    flat, upright = foot - share, math.hypot(foot, 1 + share)
    low, high = result.summary["limits"]
    assert low == pytest.approx(flat, abs=1e-4)
    assert high == pytest.approx(upright, abs=1e-4)
    angles = result.bodies["a1"].angle
    slide = result.drivers["ram.slide"].position
    top = 1j * np.sin(angles) + share * np.exp(1j * angles) - foot
    assert slide == pytest.approx(np.abs(top), rel=1e-9)
    ends = [event for event in result.events if event["in_range"]]
    assert len(ends) == 2
    assert {event["kind"] for event in ends} <= {"dead_point", "ambiguous", "unproved"}


def test_ends_taken_for_poses_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(assembled_arc, "FLAT", ())
    result = md.solve(lift(3, 0.9, 0.7), ARC)
    assert "singular" in set(result.status)
    assert result.fault is not None
