"""Recorded poses: near enough to each other for their ways, played in time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import mechdae as md
from tests.shared.mechanisms import doubled
from tests.shared.node import needs_node, run_script
from tests.shared.paths import ROOT


def places(data: dict[str, Any], point: str) -> Any:
    return np.reshape(data["recorded"]["points"][point], (-1, data["scene"]["dimension"]))


def chord_off(way: Any, seen: float = 600.0) -> float:
    """Return how far chords are off circles about the origin, in pixels of a picture."""
    radius = np.linalg.norm(way, axis=1).max()
    turns = np.diff(np.unwrap(np.arctan2(way[:, 1], way[:, 0])))
    return float(np.max(1 - np.cos(turns / 2)) * radius * seen / np.ptp(way, axis=0).max())


def test_few_poses_of_a_recorded_sweep_are_sampled_on_their_way() -> None:
    """A doubled coupler is recorded; nine poses of a crank's turn are chords of 45 degrees."""
    problem = doubled(md.load("four-bar-crank-rocker"), "coupler")
    driver = md.Driver("crank.angle", from_=0.0, to=2 * math.pi)
    data = md.page(problem.with_task("turn", md.Sweep(driver, poses=9)), "turn").data
    assert data["live"] is False
    way = places(data, "crank.B")
    values = np.array(data["driver"]["values"])
    assert len(way) == len(values) == len(data["status"]) == len(data["recorded"]["rows"])
    assert chord_off(way) <= 0.5
    assert np.ptp(values) == pytest.approx(2 * math.pi)
    angle = np.unwrap(np.arctan2(way[:, 1], way[:, 0]))
    assert angle - angle[0] == pytest.approx(values - values[0], abs=1e-9)


def test_a_motion_is_sampled_on_its_way() -> None:
    """A pendulum let go at the level swings through half a turn in three poses."""
    mechanism = md.Mechanism(
        ground=md.Ground({"O": (0, 0)}),
        bodies=[md.Body("rod", {"O": (0, 0), "P": (1, 0)}, mass=1.0, center=(1, 0))],
        joints=[md.Revolute("O", "ground.O", "rod.O")],
        gravity=(0, -9.81),
    )
    motion = md.Motion(start={"rod.angle": 0.0}, until=1.0, poses=3)
    data = md.page(md.Problem(mechanism, {"go": motion}), "go").data
    way = places(data, "rod.P")
    assert np.linalg.norm(way, axis=1) == pytest.approx(1.0, abs=1e-9)
    assert chord_off(way) <= 0.5
    assert data["driver"]["values"][-1] == 1.0


def test_named_poses_stay_those_that_are_named() -> None:
    problem = doubled(md.load("four-bar-crank-rocker"), "coupler")
    at = md.Sweep(md.Driver("crank.angle", at=[0.1, 1.1, 2.1]))
    data = md.page(problem.with_task("turn", at), "turn").data
    assert data["driver"]["values"] == [0.1, 1.1, 2.1]


@needs_node
def test_recorded_motions_play_in_time(tmp_path) -> None:
    """Steps of an integrator are no equal times; poses of a sweep are equal steps."""
    script = f"""
import {{ Recorded }} from "{(ROOT / "mechdae/parts/page/web/recorded.js").as_uri()}";
const made = (unit, values) => new Recorded({{ driver: {{ unit, values }}, status: [],
  recorded: {{ rows: values.map((_, k) => k), points: {{}}, angles: {{}}, turns: {{}} }} }});
const played = (unit, values, share) => {{
  const own = made(unit, values);
  own.advance(6 * share);
  return own.s;
}};
const shares = [0, 0.02, 0.03, 0.5, 0.99], time = made("s", [2, 2.1, 2.2, 6]);
const back = [0, 1, 2].map((k) => {{ time.drive(k); time.advance(0); return time.s; }});
const result = [shares.map((own) => played("s", [2, 2.1, 2.2, 6], own)),
  shares.map((own) => played("rad", [0, 5, 6, 7], own)), back, [2.14, 9].map((v) => time.at(v))];
console.log(JSON.stringify(result));
"""
    assert run_script(script, tmp_path) == [
        [0, 0, 1, 2, 2], [0, 0, 0, 2, 3], [0, 1, 2], [1, 3],
    ]  # fmt: skip
