"""Slips planted in contacts of motions, seen by a ball, a rack and a pin in its bush."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.motion.kinematics.prepared import SHAPES
from tests.shared.bouncing import G, ball, disc, hits, wheel_and_rack
from tests.shared.planting import Slip

SUITE = "dynamics/test_contacts.py::"


def moved(data: dict[str, Any]) -> md.Result:
    SHAPES.clear()  # kernels that are kept know nothing of a slip
    try:
        return md.solve(from_dict(data), "m")
    finally:
        SHAPES.clear()


def off(found: list[float], wanted: list[float]) -> float:
    if len(found) < len(wanted):
        return np.inf
    return float(np.abs(np.array(found[: len(wanted)]) - wanted).max() / 1e-9)


def bounces() -> float:
    first = math.sqrt(2 / G)
    return off(hits(moved(ball(0.5, 1.0))), [first, 2 * first])


def impact_losses() -> float:
    return float(moved(ball(0.5, 1.0)).checks["energy"] / 1e-9)


def flank_times() -> float:
    return off(hits(moved(wheel_and_rack(start_speed={"wheel": 10.0, "guide": 0.0}))), [1e-3])


def chords() -> float:
    return off(hits(moved(disc(1.0, 0.2, 0.02))), [math.sqrt(3) / 2 * 1e-3 / 0.2])


BALL = SUITE + "test_a_ball_bounces_until_it_lies_still"
SLIPS = [
    Slip("dynamics.contacts.impacts", "before + e * np.minimum(", "before - e * np.minimum(",
         bounces, BALL),
    Slip("dynamics.contacts.touching", "(self.before + self.after) / 2",
         "(self.before + self.after)", impact_losses, BALL),
    Slip("dynamics.contacts.gaps", 'numbers[f"{name}.backlash"] / 2',
         'numbers[f"{name}.backlash"]', flank_times,
         SUITE + "test_a_rack_is_hit_by_one_flank_after_the_other"),
    Slip("dynamics.contacts.gaps", "(c - ca.sumsqr(model.ends[name].gap) / c) / 2",
         "(2 * c - ca.sumsqr(model.ends[name].gap) / c) / 2", chords,
         SUITE + "test_a_pin_flies_along_chords_of_its_bush"),
]  # fmt: skip
