"""Pairs of wheels in space, and a wheel with a rack."""

from __future__ import annotations

from math import cos, radians, sin

import mechdae as md

Z1, Z2 = 18, 45
SKEW = 70.0


def wheels(axes, places, points, **keys) -> md.Mechanism:
    """Return two wheels in the frame, one of them driven, with the points of their mesh."""
    mesh = md.SpatialGear(
        "mesh", "one.M", "two.M", **({"teeth": (Z1, Z2), "mesh": "external"} | keys)
    )
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"A": places[0], "B": places[1]}),
        bodies=[
            md.Body("one", {"A": [0, 0, 0], "M": points[0]}),
            md.Body("two", {"B": [0, 0, 0], "M": points[1]}),
        ],
        joints=[
            md.SpatialRevolute("V", "ground.A", "one.A", axis=axes[0]),
            md.SpatialRevolute("W", "two.B", "ground.B", axis=axes[1]),
            mesh,
        ],
        sketch={"V": 0},
    )


def rack() -> md.Mechanism:
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"A": [0, 0, 0], "R": [0.03, 0.01, 0.0]}),
        bodies=[
            md.Body("wheel", {"A": [0, 0, 0], "M": [0, 0, 0.01]}),
            md.Body("rack", {"R": [0, 0, 0]}),
        ],
        joints=[
            md.SpatialRevolute("V", "ground.A", "wheel.A", axis=[0, 0, 1]),
            md.SpatialPrismatic("S", "ground.R", "rack.R", axis=[0, 2, 0]),
            md.SpatialRack("mesh", "wheel.M", "rack.R", radius=0.03),
        ],
        sketch={"V": 0},
    )


TURN = md.Sweep(driver=md.Driver("V.angle", at=[0.0, 0.7, 1.4]))
SIGMA = radians(SKEW)
TILTED = [sin(SIGMA), 0.0, cos(SIGMA)]
UPRIGHT, LEVEL = [[0, 0, 1], [0, 0, 1]], [[0, 0, 0], [0, 0, 0]]
LEANING = [[0, 0, 1], TILTED]
SCENES = {
    "external": wheels(
        [[0, 0, 3], [0, 0, 1]], ([0, 0, 0], [0.063, 0, 0.1]), ([0, 0, 0.2], [0, 0, 0.1])
    ),
    "internal": wheels(UPRIGHT, ([0, 0, 0], [0.03, 0, 0]), LEVEL, mesh="internal"),
    "bevel": wheels(
        LEANING, ([0, 0, 0.3], [0, 0, 0]), ([0, 0, -0.2], [0.1 * x for x in TILTED]), radius=0.02
    ),
    "skew": wheels(LEANING, ([0, 0, -0.4], [0.2 * TILTED[0], 0.05, 0.2 * TILTED[2]]), LEVEL),
    "rack": rack(),
}
