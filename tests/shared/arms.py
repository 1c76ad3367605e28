"""Arms with six turning axes, and where their hands are, by elementary motions."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.arms import ARMS as MEASURED
from benchmarks.arms import places
from mechdae.numerics.arms.certified import certified

ARMS: dict[str, list[tuple[float, float, float]]] = {
    "ur5e": MEASURED["UR5e"],
    "ur10e": MEASURED["UR10e"],
    "puma": MEASURED["Puma 560"],
    "kr6": MEASURED["KUKA KR 6 R900"],
    "crx": MEASURED["FANUC CRX-10iA"],
    "sixteen": MEASURED["sixteen poses (Manseur and Doty)"],
    "general": MEASURED["general"],
    "parallel, quartic": [
        (0.1, 1.1, 0.16), (-0.42, np.pi, 0.02), (-0.39, 0, -0.03), (0.07, 0.8, 0.13),
        (0.08, -1.2, 0.1), (0.05, 0.3, 0.1),
    ],
    "parallel, last two too": [
        (0.1, 1.1, 0.16), (-0.42, np.pi, 0.02), (-0.39, np.pi, -0.03), (0.07, 0.8, 0.13),
        (0.08, 0, 0.1), (0.05, 0.3, 0.1),
    ],
    "parallel from the hand": [
        (0.08, -1.2, 0.1), (0.07, 0.8, 0.13), (-0.39, 0, -0.03), (-0.42, 0, 0.02), (0.1, 1.1, 0.16),
        (0.05, 0.3, 0.1),
    ],
    "wrist": [
        (0.1, 1.1, 0.16), (-0.42, 0.7, 0.02), (-0.39, 0.9, -0.03), (0, 0.8, 0.13), (0, -1.2, 0),
        (0.05, 0.3, 0.1),
    ],
    "wrist, second axes parallel": [
        (0.3, 1.0, 0.16), (-0.42, np.pi, 0.02), (-0.39, 0.9, -0.03), (0, 0.8, 0.13), (0, -1.2, 0),
        (0.05, 0.3, 0.1),
    ],
    "wrist, first axes parallel": [
        (0.3, np.pi, 0.16), (-0.42, 0.7, 0.02), (-0.39, 0.9, -0.03), (0, 0.8, 0.13), (0, -1.2, 0),
        (0.05, 0.3, 0.1),
    ],
    "wrist, first axes meet": [
        (0, 1.1, 0.16), (-0.42, 0.7, 0.02), (-0.39, 0.9, -0.03), (0, 0.8, 0.13), (0, -1.2, 0),
        (0.05, 0.3, 0.1),
    ],
}  # fmt: skip
"""Rows (a [m], alpha [rad], d [m]) of Denavit and Hartenberg, from data sheets or drawn."""


def forward(links: Any, angles: Any) -> Any:
    """Return where the hand is, by the four elementary motions of each joint."""
    return places(links, np.asarray(angles)[None])[0]


def product(points: Any, axes: Any, angles: Any, hand: Any) -> Any:
    """Return where the hand is, by turns about axes in the world, the last one first."""
    T = np.array(hand, float)
    for p, z, angle in zip(points[::-1], axes[::-1], angles[::-1], strict=True):
        n = z / np.linalg.norm(z)
        K = np.array([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
        M = np.eye(4)
        M[:3, :3] += np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
        M[:3, 3] = p - M[:3, :3] @ p
        T = M @ T
    return T


def nearby(name: str, off: float, steps: int) -> tuple[float, bool]:
    """Return where steps from next to a pose end, off it, and whether that is certified."""
    links, rng = np.array(ARMS[name]), np.random.default_rng(5)
    angles = rng.uniform(-1.5, 1.5, size=6)
    hand, start = forward(links, angles), angles + off * rng.choice([-1.0, 1.0], size=6)
    R, t = hand[:3, :3, None], hand[:3, 3, None]
    found = certified(links, start[:, None], R, t, 1.0, steps)
    return float(np.abs(found.theta[:, 0] - angles).max()), bool(found.holds[0])
