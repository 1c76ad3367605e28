"""Arms with six turning axes, and where their hands are, by elementary motions."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.numerics.arms.certified import certified

H = np.pi / 2
ARMS: dict[str, list[tuple[float, float, float]]] = {
    "ur5e": [
        (0, H, 0.1625), (-0.425, 0, 0), (-0.3922, 0, 0), (0, H, 0.1333), (0, -H, 0.0997),
        (0, 0, 0.0996),
    ],
    "ur10e": [
        (0, H, 0.1807), (-0.6127, 0, 0), (-0.57155, 0, 0), (0, H, 0.17415), (0, -H, 0.11985),
        (0, 0, 0.11655),
    ],
    "puma": [
        (0, H, 0), (0.4318, 0, 0), (0.0203, -H, 0.15005), (0, H, 0.4318), (0, -H, 0), (0, 0, 0),
    ],
    "kr6": [
        (0.025, -H, 0.4), (0.455, 0, 0), (0.035, -H, 0), (0, H, 0.42), (0, -H, 0), (0, 0, 0.08),
    ],
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
    "sixteen": [(0.3, H, 0), (1, 1, 0), (0, H, 0.2), (1.5, 1, 0), (0, H, 0), (0, 0, 0)],
    "crx": [
        (0, -H, 0.245), (0.71, 0, 0), (0, -H, 0), (0, H, 0.54), (0, -H, 0.15), (0, 0, 0.16),
    ],
    "general": [
        (0.4, 1.3, 0.3), (-0.6, 2.1, -0.2), (0.5, 0.8, 0.4), (0.2, 1.7, 0.6), (-0.3, 2.4, 0.1),
        (0.1, 0.6, 0.2),
    ],
}  # fmt: skip
"""Rows (a [m], alpha [rad], d [m]) of Denavit and Hartenberg, from data sheets or drawn."""


def forward(links: Any, angles: Any) -> Any:
    """Return where the hand is, by the four elementary motions of each joint."""
    T = np.eye(4)
    for (a, alpha, d), theta in zip(links, angles, strict=True):
        for axis, angle, shift in ((2, theta, d), (0, alpha, a)):
            M = np.eye(4)
            i, j = ((axis + 1) % 3, (axis + 2) % 3)
            M[i, i] = M[j, j] = np.cos(angle)
            M[i, j], M[j, i] = -np.sin(angle), np.sin(angle)
            M[axis, 3] = shift
            T = T @ M
    return T


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
