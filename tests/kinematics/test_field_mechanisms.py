"""A front axle with a T-bar, by points and lengths; a folded vertex, by products of rotations."""

from __future__ import annotations

import itertools
from math import cos, radians, sin, tan
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md

DATA = Path(__file__).parents[1] / "data" / "spatial"

# -- the axle ------------------------------------------------------------------------------------

FIXED = {
    "lif": (250, 400, 200), "lif2": (750, 350, 200), "uif": (225, 350, 500),
    "uif2": (725, 350, 500), "ra": (0, 250, 400), "ra2": (0, 300, 500),
}  # fmt: skip
"""Points of the left side [mm], two on each hinge; the right one is its mirror in y."""
MOVING = {
    "L": (0, 900, 200), "U": (-25, 750, 500), "T": (150, 800, 275), "P": (0, 870, 240),
    "W": (-20, 950, 313.426), "I": (-20, 800, 308.426), "rP": (100, 430, 480), "D": (60, 250, 450),
}  # fmt: skip
BARS = [
    *itertools.combinations(("L", "U", "T", "P", "W", "I"), 2),
    ("L", "lif"), ("L", "lif2"), ("U", "uif"), ("U", "uif2"), ("rP", "ra"), ("rP", "ra2"),
    ("D", "ra"), ("D", "ra2"), ("rP", "D"), ("rP", "P"), ("T", "rack"),
]  # fmt: skip
PIVOT = np.array([0, 0, 0.25])


def axle(left: float, right: float, rack: float) -> dict[str, Any]:
    """Places of all points for heights of both wheels and a place of the rack: Gauss and Newton.

    Every rigid part is its distances; the second pin of the cross, through the middle of the
    T-bar's ends, stays in the plane across the first one.
    """
    drawn: dict[str, Any] = {}
    for side, sense in (("l", 1), ("r", -1)):
        for name, place in {
            **FIXED,
            **MOVING,
            "rack": (50, 200, 250),
            "bar": (20, 220, 430),
        }.items():
            drawn[f"{side}.{name}"] = np.array(place) * [1, sense, 1] / 1000
    drawn["O"] = PIVOT
    bars = [(f"{side}.{a}", f"{side}.{b}") for side in "lr" for a, b in [*BARS, ("D", "bar")]]
    bars += itertools.combinations(("l.bar", "r.bar", "O"), 2)
    free = [f"{side}.{name}" for side in "lr" for name in (*MOVING, "bar")]
    lengths = [np.linalg.norm(drawn[a] - drawn[b]) for a, b in bars]
    place = {name: own.copy() for name, own in drawn.items()}
    at = {name: slice(3 * k, 3 * k + 3) for k, name in enumerate(free)}
    steps = 10
    for k in range(1, steps + 1):
        share = k / steps
        for side in "lr":
            place[f"{side}.rack"] = drawn[f"{side}.rack"] + [0, share * rack, 0]
        wanted = [drawn[f"{s}.W"][2] + share * (own - drawn[f"{s}.W"][2])
                  for s, own in (("l", left), ("r", right))]  # fmt: skip
        for _ in range(12):
            rows, gaps = np.zeros((len(bars) + 3, 3 * len(free))), np.zeros(len(bars) + 3)
            for i, ((a, b), length) in enumerate(zip(bars, lengths, strict=True)):
                way = place[a] - place[b]
                gaps[i] = (way @ way - length**2) / 2
                for name, sense in ((a, 1), (b, -1)):
                    if name in at:
                        rows[i, at[name]] += sense * way
            n = len(bars)
            for j, side in enumerate("lr"):
                rows[n + j, at[f"{side}.W"].start + 2] = 1.0
                gaps[n + j] = place[f"{side}.W"][2] - wanted[j]
                rows[n + 2, at[f"{side}.bar"].start + 1] = 0.5
            gaps[n + 2] = (place["l.bar"][1] + place["r.bar"][1]) / 2
            change = np.linalg.lstsq(rows, -gaps, rcond=1e-12)[0]
            for name in free:
                place[name] = place[name] + change[at[name]]
        assert np.abs(gaps).max() < 1e-15
    return place


@pytest.mark.parametrize(
    ("task", "pose", "wheels", "rack"),
    [
        ("bump", 0, (0.263426, 0.263426), 0.0),
        ("roll", 0, (0.263426, 0.363426), 0.0),
        ("steer", 0, (0.33, 0.30), -0.03),
    ],
)
def test_axle(task: str, pose: int, wheels: Any, rack: float) -> None:
    wanted = axle(*wheels, rack)
    result = md.solve(md.load(DATA / "axle-with-t-bar.toml"), task)
    assert all(own == "ok" for own in result.status)
    for point, own in (("l_hub.W", "l.W"), ("l_hub.I", "l.I"), ("tbar.l", "l.bar"),
                       ("tbar.r", "r.bar")):  # fmt: skip
        assert result.points[point].position[pose] == pytest.approx(wanted[own], abs=1e-9), point


# -- the vertex ----------------------------------------------------------------------------------


def turned(axis: float, angle: float) -> Any:
    """Return the rotation about a crease in the plane, by its direction and the fold."""
    e = np.array([cos(axis), sin(axis), 0.0])
    cross = np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    return np.eye(3) + sin(angle) * cross + (1 - cos(angle)) * cross @ cross


@pytest.mark.parametrize("task", ["fold", "mid", "through"])
def test_a_flat_foldable_vertex_closes(task: str) -> None:
    """Four turns about the creases are none, and half-angle tangents of two folds keep a ratio."""
    problem = md.load(DATA / "origami-vertex.toml")
    result = md.solve(problem, task)
    creases = np.radians([60, 160, 280, 0])
    ratios = [sin(radians(20)) / sin(radians(80)), cos(radians(20)) / cos(radians(80))]
    for k in range(len(result)):
        if result.status[k] != "ok":
            continue
        angles = [result.joints[f"c{i}"].angle[k] for i in (1, 2, 3, 4)]
        whole = np.eye(3)
        for crease, angle in zip(creases, angles, strict=True):
            whole = whole @ turned(crease, angle)
        assert whole == pytest.approx(np.eye(3), abs=1e-11)
        first, last = tan(angles[0] / 2), tan(angles[3] / 2)
        assert min(abs(abs(last) - own * abs(first)) for own in ratios) < 1e-11 * (1 + abs(first))
    assert sum(own == "ok" for own in result.status) >= len(result) - 1
