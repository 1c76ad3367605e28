"""Slips planted in closed forms, the eliminant and certificates of arms, seen by their hands."""

from __future__ import annotations

import numpy as np

import mechdae as md
from tests.shared.arms import ARMS, forward, nearby
from tests.shared.planting import Slip

BATCHES = "arms/test_arm_batches.py::"
DRAWN = f"{BATCHES}test_poses_drawn_are_among_those_found"
NEWTON = f"{BATCHES}test_certificates_hold_of_poses_alone"
LIMITS = f"{BATCHES}test_limits_are_applied_and_said"


def missed(name: str) -> float:
    """Poses drawn at random are among those that are certified; the number is proven."""
    links, n = np.array(ARMS[name]), 6
    angles = np.random.default_rng(3).uniform(-3, 3, size=(n, 6))
    found = md.arm_poses(links, np.stack([forward(links, row) for row in angles]))
    if found.counts.min() == 0 or not found.proven.any():
        return np.inf
    gaps = np.abs(np.exp(1j * found.angles) - np.exp(1j * angles)[:, None]).max(axis=2)
    return float(np.nanmin(gaps, axis=1).max()) / 1e-8


def robot() -> float:
    """A UR."""
    return missed("ur5e")


def parallels() -> float:
    """An arm with three parallel axes and none of the wrist that meet."""
    return missed("parallel, quartic")


def wrists() -> float:
    """Arms whose wrist's axes meet: with parallel axes before it, and without."""
    return max(missed("puma"), missed("wrist"), missed("wrist, second axes parallel"))


def mirrors() -> float:
    """An arm that is solved from the hand to the foot."""
    return missed("parallel from the hand")


def general() -> float:
    """Arms without a closed form."""
    return max(missed("general"), missed("sixteen"))


def newton() -> float:
    """Steps of Newton's method lead to the pose drawn, quadratically."""
    off, _ = nearby("kr6", 1e-3, 3)
    return off / 1e-9


def limits() -> float:
    """All poses are within limits that are wider than a turn, after whole turns."""
    links = np.array(ARMS["ur5e"])
    arm = md.Arm(links, limits=[[2.0, 9.0]] * 6)
    found = md.arm_poses(arm, forward(links, [0.3, -1.2, 1.5, -0.4, 0.9, 0.2]))
    inside = (found.angles >= 2) & (found.angles <= 9)
    return 0.0 if len(found.angles) and not found.outside and inside.all() else np.inf


HOME = "numerics.arms"
SLIPS = [
    Slip(f"{HOME}.wrists", "s5 * cosine[4] * s6, -c5 * s6", "s5 * cosine[4] * s6, c5 * s6",
         robot, DRAWN),
    Slip(f"{HOME}.wrists", "- both * (d[3] + cosine[3] * d[4])",
         "- both * (d[3] - cosine[3] * d[4])", parallels, DRAWN),
    Slip(f"{HOME}.wrists", "same * (d[2] + np.cos(alpha[2]) * d[3])",
         "same * (d[2] - np.cos(alpha[2]) * d[3])", wrists, DRAWN),
    Slip(f"{HOME}.wrists", "c4 * p + s4 * q, c4 * q - s4 * p", "c4 * p - s4 * q, c4 * q + s4 * p",
         wrists, DRAWN),
    Slip(f"{HOME}.wrists", "(1 - cosine) * (1 + cosine)",
         "(1 - cosine) * (1 - cosine)", robot, DRAWN),
    Slip(f"{HOME}.eliminant", "rest + cosine, 2 * sine, rest - cosine",
         "rest - cosine, 2 * sine, rest + cosine", general, DRAWN),
    Slip(f"{HOME}.eliminant", "[square, along], cross, square * z - 2 * along * p",
         "[square, along], cross, square * z - along * p", general, DRAWN),
    Slip(f"{HOME}.certified", "arms[:, j] - axes[:, j]", "arms[:, j] + axes[:, j]",
         newton, NEWTON),
    Slip(f"{HOME}.chain", "-links[4::-1, :2]", "links[4::-1, :2]", mirrors, DRAWN),
    Slip(f"{HOME}.poses", "np.ceil((low - LIMIT", "np.floor((low - LIMIT", limits, LIMITS),
]  # fmt: skip
