"""With frames = "drawn" the drawn pose is the sketch, for bodies in balls and driven points too."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.describe import drawn as described
from mechdae.describe.file.load import load as load_file
from mechdae.describe.values import Table
from tests.attack import drawn_loops
from tests.shared.paths import DATA

STARTS = DATA / "starts"


def strut() -> md.Mechanism:
    """The strut of the data, its links with masses."""
    mechanism = load_file(STARTS / "drawn-strut.toml").mechanism
    masses = {"mass": 1.0, "center": (0.0, 0.8, 0.3), "inertia": (0.2, 0.3, 0.4)}
    bodies = {name: replace(own, **masses) for name, own in mechanism.bodies.items()}
    return replace(mechanism, bodies=Table(bodies))


def at_the_drawn_pose() -> None:
    mechanism = strut()
    held = md.Driver("hinge.angle", at=[0])
    tasks = [
        md.Sweep(held),
        md.Motion(start={"hinge.angle": 0}, at=[0, 1e-6]),
        md.Motion(at=[0, 1e-6]),
    ]
    for task in tasks:
        result = md.solve(mechanism, task)
        for name in ("knuckle.I", "knuckle.T", "rod.S"):
            body, point = name.split(".")
            drawn = np.array(mechanism.bodies[body].points[point], float)
            assert result.points[name].position[0] == pytest.approx(drawn, abs=1e-9)


def test_all_tasks_begin_at_the_drawn_pose() -> None:
    at_the_drawn_pose()


def test_a_sketch_of_angles_alone_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted: nothing tells how what hangs in a ball is turned."""

    def angles(joints, bodies, sketch):
        words = [(name, w) for name, joint in joints.items() for w in joint.coordinates]
        return {f"{name}.{w}": 0.0 for name, w in words if w.startswith("angle")}

    monkeypatch.setattr(described, "drawn_sketch", angles)
    with pytest.raises(md.MechdaeError, match="does not tell"):
        at_the_drawn_pose()


def test_the_whole_range_of_a_driven_point() -> None:
    """A point turns about a skew axis: its height is a cosine about the axis's share of it."""
    result = md.solve(STARTS / "drawn-arm.toml", "all")
    axis = np.array([1, 0, 0.1]) / math.hypot(1, 0.1)
    W = np.array([0, 0.6, 0.1])
    along = (W @ axis) * axis
    wide = float(np.linalg.norm(W - along)) * math.sqrt(1 - axis[2] ** 2)
    assert result.summary["limits"] == pytest.approx([along[2] - wide, along[2] + wide], rel=1e-9)


@pytest.mark.parametrize("seed", [0, 6])
def test_random_loops_begin_as_they_are_drawn(seed: int) -> None:
    assert drawn_loops.examine(seed, drawn_loops.LOOPS[seed % len(drawn_loops.LOOPS)]) == {}
