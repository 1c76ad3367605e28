"""Wishbones: an arm on a hinge, a hub between two balls, a rod; all poses in closed form."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from tests.shared.paths import ROOT

TEXT = re.sub(
    r"\[\[expected\]\].*",
    "",
    (ROOT / "problems" / "double-wishbone.toml").read_text(encoding="utf-8"),
    flags=re.DOTALL,
)
TURNED = {
    "as it is": (),
    "hub first": (('["lower.B", "knuckle.lower"]', '["knuckle.lower", "lower.B"]'),),
    "arm first": (('["ground.U", "upper.U"]', '["upper.U", "ground.U"]'),),
    "upper ball first": (('["upper.B", "knuckle.upper"]', '["knuckle.upper", "upper.B"]'),),
    "a bar": (
        ('steer_ball = { kind = "spherical", between = ["knuckle.steer", "tie_rod.K"] }',
         'bar = { kind = "distance", between = ["knuckle.steer", "ground.R"], length = 0.34 }'),
        ('rack_ball  = { kind = "spherical", between = ["ground.R", "tie_rod.R"] }\n', ""),
        ("[bodies.tie_rod]\nnumber = 4\npoints = { R = [0, 0, 0], K = [0.34, 0, 0] }\n", ""),
    ),
}  # fmt: skip


def turn(axis: Any, angle: float) -> Any:
    """Return the rotation by Rodrigues' formula."""
    n = np.array(axis) / np.linalg.norm(axis)
    K = np.array([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def changes(values: Any) -> Any:
    """Return the places where a periodic series of values changes its sign."""
    return np.flatnonzero(values * np.roll(values, -1) < 0)


def counted(lower: float, rod: float) -> int:
    """Return how many poses there are, from changes of sign of two functions of one turn."""
    ground = np.array([[0, 0.3, 0.2], [-0.02, 0.36, 0.45], [-0.12, 0.33, 0.26]])
    own = np.array([[0.01, -0.05, -0.12], [-0.03, -0.09, 0.16], [-0.12, -0.08, -0.05]])
    ball = ground[0] + turn([1, 0.03, 0.02], lower) @ [0.01, 0.4, -0.02]
    angles = np.linspace(-np.pi, np.pi, 1500, endpoint=False) + 1e-4  # the drawn pose is at 0
    tips = [ground[1] + turn([1, -0.05, -0.08], t) @ [-0.01, 0.3, 0.01] for t in angles]
    gaps = np.linalg.norm(np.array(tips) - ball, axis=1) - np.linalg.norm(own[1] - own[0])
    count, along = 0, (own[1] - own[0]) / np.linalg.norm(own[1] - own[0])
    for k in changes(gaps):
        share = gaps[k] / (gaps[k] - np.roll(gaps, -1)[k])
        t = angles[k] + share * (angles[1] - angles[0])
        line = ground[1] + turn([1, -0.05, -0.08], t) @ [-0.01, 0.3, 0.01] - ball
        line /= np.linalg.norm(line)
        axis = np.cross(along, line)
        R = turn(axis, float(np.arctan2(np.linalg.norm(axis), along @ line)))
        ends = [ball + turn(line, a) @ R @ (own[2] - own[0]) for a in angles]
        count += len(changes(np.linalg.norm(np.array(ends) - ground[2], axis=1) - rod))
    return count


@pytest.mark.parametrize("word", TURNED)
def test_all_poses_whatever_the_order_of_bodies(word: str, tmp_path: Path) -> None:
    """Points keep their distances, modes are proven and as many as functions change their sign."""
    text = TEXT
    for old, new in TURNED[word]:
        assert old in text
        text = text.replace(old, new)
    path, counts = tmp_path / "wishbone.toml", set[int]()
    for lower, rod in ((0.0, 0.34), (-0.6, 0.34), (0.3, 0.3), (0.0, 0.22), (1.9, 0.34)):
        own = text.replace("K = [0.34, 0, 0]", f"K = [{rod}, 0, 0]").replace(
            "length = 0.34", f"length = {rod}"
        )
        own = own.replace('"L.angle", at = [0] }', f'"L.angle", at = [{lower}] }}')
        path.write_text(own, encoding="utf-8")
        found = md.solve(str(path), "modes")
        assert found.summary["proven"], (lower, rod)
        assert len(found.status) == counted(lower, rod), (lower, rod)
        counts.add(len(found.status))
        if not len(found.status):
            continue
        assert (found.status == "ok").all()
        assert "closed form" in found.summary["basis"]
        at = {name: series.position for name, series in found.points.items()}
        assert np.linalg.norm(at["upper.B"] - at["knuckle.upper"], axis=1).max() < 1e-12
        assert np.linalg.norm(at["lower.B"] - at["knuckle.lower"], axis=1).max() < 1e-12
        lengths = np.linalg.norm(at["knuckle.steer"] - [-0.12, 0.33, 0.26], axis=1)
        assert np.abs(lengths - rod).max() < 1e-12
        steer = at["knuckle.steer"]
        apart = np.linalg.norm(steer[:, None] - steer, axis=2) + np.eye(len(steer))
        assert apart.min() > 1e-3
    assert len(counts) > 1
