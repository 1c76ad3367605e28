"""What the problem files of geared five-bars expect, found from their targets by other means."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from tests.reference.geared_designs import RATIOS, design, poses, targets
from tests.shared.paths import ROOT

SEEDS = {"gear5-g1": 8, "gear5-g3": 4}
"""Random starts that soon end in the design."""


@pytest.mark.parametrize("name", sorted(RATIOS))
def test_expected_values_come_from_the_targets_alone(name: str) -> None:
    file = ROOT / f"problems/{name}.toml"
    data = tomllib.loads(file.read_text(encoding="utf-8"))
    planted = {own: values[0] for own, values in data["tasks"]["planted"]["samples"].items()}
    found = design(name, SEEDS[name])
    # rounded targets leave the numbers their last digits
    assert {own: found[own] for own in planted} == pytest.approx(planted, abs=1e-5)
    assert found["least"] < 5e-12
    angles, places = targets(name)
    there = [poses({**planted, "side": found["side"]}, angle) for angle in angles]
    points, arms = (own["value"][0] for own in data["expected"][:2])
    assert np.array(points) @ [1, 1j] == pytest.approx(places, abs=0.0)
    assert [own["P"] for own in there] == pytest.approx(places, abs=1e-6)
    assert np.unwrap([own["arm"] for own in there]) == pytest.approx(np.array(arms), abs=1e-12)
    numbers = {**data["parameters"], "phi": 0.0, "theta0": 0.0, "side": 1}
    keys = {"points/link.P/position": "P", "points/link.B/position": "B"}
    for own in data["expected"][2:]:
        pose = poses(numbers, np.radians(own["at_deg"]))
        value = pose[keys.get(own["what"], own["what"].split("/")[1])]
        wanted = complex(*own["value"]) if own["what"] in keys else own["value"]
        assert value == pytest.approx(wanted, rel=1e-12)
