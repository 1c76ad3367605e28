"""Robots driven at all their joints, and what a platform on six legs takes to be assembled."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from mechdae.motion.assembly.assembler import Assembler

AXES = np.eye(3)[[2, 1, 1, 0, 1, 0]]
LINKS = ([0, 0, 0.4], [0, 0, 0.45], [0.1, 0, 0.05], [0.35, 0, 0], [0.08, 0, 0], [0.05, 0.02, 0])
MASSES = (12.0, 9.0, 6.0, 3.0, 2.0, 0.8)
G = 9.81


def arm() -> md.Mechanism:
    """A six-axis arm: joint k turns about `AXES` k at the end of link k - 1."""
    bodies = [
        md.Body(f"b{k}", {"O": (0, 0, 0), "T": LINKS[k]}, mass=MASSES[k], center=LINKS[k],
                inertia=(0.01, 0.01, 0.01))
        for k in range(6)
    ]  # fmt: skip
    joints = [
        md.SpatialRevolute(
            f"J{k}", f"b{k - 1}.T" if k else "ground.O", f"b{k}.O", axis=tuple(AXES[k])
        )
        for k in range(6)
    ]
    return md.Mechanism(
        dimension=3, gravity=(0, 0, -G), ground=md.Ground({"O": (0, 0, 0)}), bodies=bodies,
        joints=joints,
    )  # fmt: skip


def turned(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rodrigues' rotation."""
    K = np.cross(np.eye(3), axis)
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def test_an_arm_driven_at_all_joints() -> None:
    """Places by a product of rotations, efforts at rest by the moments of weights."""
    ways = np.array([[0.3, 0.5], [-0.4, 0.1], [0.9, 0.6], [-1.2, 2.5], [0.7, -0.8], [2.0, 7.0]])
    drivers = [md.Driver(f"J{k}.angle", at=ways[k].tolist(), speed=0.0) for k in range(6)]
    result = md.solve(arm(), md.Reactions(drivers=drivers))
    assert list(result.status) == ["ok", "ok"]
    for n, angles in enumerate(ways.T):
        R, place, axes, feet, ends = np.eye(3), np.zeros(3), [], [], []
        for k, angle in enumerate(angles):
            axes.append(R @ AXES[k])
            feet.append(place)
            R = R @ turned(AXES[k], angle)
            place = place + R @ np.array(LINKS[k])
            ends.append(place)
            np.testing.assert_allclose(result.points[f"b{k}.T"].position[n], place, atol=1e-14)
        for k in range(6):
            weights = [np.cross(ends[i] - feet[k], [0, 0, -G * MASSES[i]]) for i in range(k, 6)]
            wanted = -axes[k] @ np.sum(weights, axis=0)
            assert abs(result.efforts[f"J{k}.angle"][n] - wanted) < 1e-12 * G * sum(MASSES)


@pytest.fixture
def polished(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many poses of blocks are polished."""
    count, honest = [0], Assembler.polish

    def counted(self, *rest):
        count[0] += 1
        return honest(self, *rest)

    monkeypatch.setattr(Assembler, "polish", counted)
    return count


def test_legs_of_a_platform_are_not_all_combined(polished: list[int]) -> None:
    """Each leg closes in four ways, of which two have axes of the wrong sense: 4^5 times 16."""
    told = md.solve("hexapod", "forward")
    assert list(told.status) == ["ok", "ok"]
    assert polished[0] < 10_000
    assert any("of the least angles is taken" in note for note in told.summary["notes"])
    crosses = [abs(told.joints[f"U{k}"].angle2[0]) for k in range(1, 7)]
    assert max(crosses) < np.pi / 2
