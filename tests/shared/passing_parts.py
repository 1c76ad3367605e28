"""Two parts that pass each other, or meet for a moment: what a grid of poses does not see."""

from __future__ import annotations

import numpy as np

import mechdae as md
from mechdae.parts.exchange.workshop.apart import Motions, PlateShape, meetings
from mechdae.tasks.motion_of import motion_of


def passing(radius: float) -> tuple[float, bool]:
    """Return the least distance that an arm keeps from a thin pin, and whether they are met.

    The arm's end of a length 1 turns past a pin at 1 + 0.03 in 0.4 rad of 0.7; within 1/256 of
    that it goes 0.0027.
    """
    mechanism = md.Mechanism(
        ground=md.Ground(points={"O": [0, 0], "D": [1.03, 0.0]}),
        bodies=[
            md.Body("arm", points={"O": [0, 0], "A": [1.0, 0]}),
            md.Body("rod", points={"A": [0, 0], "E": [0.5, 0]}),
            md.Body("post", points={"D": [0, 0], "E": [0.5, 0]}),
        ],
        joints=[
            md.Revolute("O", "ground.O", "arm.O"), md.Revolute("A", "arm.A", "rod.A"),
            md.Revolute("E", "rod.E", "post.E"), md.Revolute("D", "ground.D", "post.D"),
        ],
        sketch={"arm": 0.2, "rod": 2.0, "post": 1.6},
    )  # fmt: skip
    driver = md.Driver("arm.angle", from_=-0.3011, to=0.3999)
    motion = motion_of(md.Problem(mechanism, {"swing": md.Sweep(driver, poses=3)}), None)
    motions, still = Motions(motion), np.zeros((1, 2))
    arm = PlateShape("arm", "arm", "arm.A", still, radius)
    pin = PlateShape("pin", "post", "post.D", still, radius)
    return 0.03 - 2 * radius, bool(meetings(motions, [(arm, pin)], 0.0))
