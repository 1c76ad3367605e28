"""Modes of bodies on balls and bars are written as places of points, which choose them again."""

from __future__ import annotations

import numpy as np

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.results.tables import table

RODS = {
    "rod1": ([0.12, 0.33, 0.18], [0.02, -0.06, -0.12], 0.393),
    "rod2": ([-0.15, 0.30, 0.19], [-0.04, -0.07, -0.11], 0.398),
    "rod3": ([0.10, 0.38, 0.44], [0.03, -0.09, 0.13], 0.291),
    "rod4": ([-0.13, 0.37, 0.45], [-0.03, -0.095, 0.14], 0.304),
    "rod5": ([-0.20, 0.32, 0.26], [-0.12, -0.07, -0.03], 0.37),
}
"""Place on the ground, place on the wheel carrier, length."""


def carrier(sketch):
    """A wheel carrier on five rods at one height."""
    return from_dict(
        {
            "schema": 1,
            "dimension": 3,
            "ground": {"points": {name: own[0] for name, own in RODS.items()}},
            "bodies": {
                "carrier": {"points": {"W": [0, 0, 0], **{n: own[1] for n, own in RODS.items()}}}
            },
            "joints": {
                f"{name}_bar": {
                    "kind": "distance",
                    "between": [f"ground.{name}", f"carrier.{name}"],
                    "length": own[2],
                }
                for name, own in RODS.items()
            },
            "sketch": sketch,
            "tasks": {
                kind: {"kind": kind, "driver": {"coordinate": "carrier.W.z", "at": [0.3]}}
                for kind in ("modes", "sweep")
            },
        }
    )


def test_each_mode_is_listed_with_a_sketch_that_is_it() -> None:
    rough = {"carrier.W": [0, 0.75, 0.3], "carrier.rod3": [0.03, 0.66, 0.43]}
    result = md.solve(carrier(rough), "modes")
    assert result.summary["count"] == 8
    ends = {name: np.array(own[0]) for name, own in RODS.items()}
    for k, sketch in enumerate(result.summary["sketches"]):
        assert [name.split(".")[1] for name in sketch if name != "carrier.W.z"] == [
            "W", "rod1", "rod2"
        ]  # fmt: skip
        for name, place in sketch.items():
            own = name.split(".")[1]
            if own in ends:
                assert abs(np.linalg.norm(np.array(place) - ends[own]) - RODS[own][2]) < 1e-12
        again = md.solve(carrier(sketch), "sweep")
        np.testing.assert_allclose(
            again.points["carrier.rod5"].position[0],
            result.points["carrier.rod5"].position[k],
            atol=1e-9,
        )
    assert '"carrier.W" = [' in table(result)
