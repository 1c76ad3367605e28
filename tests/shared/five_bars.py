"""A robot of five bars by circles: what its poses by the values of two motors have to be."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

import mechdae as md

A, B, D = 0.2, 0.25, 0.2
"""Driven links, forearms and distance of the motors of the five-bar robot."""
SHORT = {"b": B}
"""Forearms with which the robot has limit positions."""


def elbows(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the ends of the driven links at the motors' angles (n, 2)."""
    left = A * np.stack([np.cos(u[:, 0]), np.sin(u[:, 0])], axis=1)
    right = A * np.stack([np.cos(u[:, 1]), np.sin(u[:, 1])], axis=1) + [D, 0.0]
    return left, right


def tip(u: np.ndarray) -> np.ndarray:
    """Return where two circles about the elbows meet above, (n, 2); nan where they do not."""
    left, right = elbows(u)
    way = right - left
    far = np.hypot(*way.T)
    with np.errstate(invalid="ignore"):
        height = np.sqrt(B**2 - (far / 2) ** 2)
    across = np.stack([-way[:, 1], way[:, 0]], axis=1) / far[:, None]
    return (left + right) / 2 + height[:, None] * across


class Rows(NamedTuple):
    """What is off with poses at random values of the motors.

    ``off`` is the largest distance from the closed form, ``bound`` the largest bound; ``through``
    counts the proved rows with a limit position on the way, ``refused`` the others without one.
    """

    ok: np.ndarray
    off: float
    bound: float
    through: int
    refused: int


def random_rows(count: int) -> Rows:
    """Return poses straight from the sketch, some beyond limits."""
    random = np.random.default_rng(7)
    begin = np.radians([115.0, 65.0])
    u = begin + random.uniform(-2.5, 2.5, (count, 2))
    poses = md.Solver("five-bar-robot", "forward").poses(SHORT, u)
    ok, found = poses.ok, poses["points/tip.P/position"]
    off = float(np.abs(found - tip(u))[ok].max())
    ways = begin + np.linspace(0, 1, 401)[:, None, None] * (u - begin)
    left, right = elbows(ways.reshape(-1, 2))
    far = np.hypot(*(right - left).T).reshape(401, -1)
    # the forearms are stretched on the way, or one comes to lie on the other
    through = ok & (far.max(axis=0) > 2 * B)
    refused = ~ok & (far.max(axis=0) < 2 * B * (1 - 1e-3)) & (far.min(axis=0) > 2e-3)
    alone = set(poses.status[~ok]) <= {"unassembled"} and bool(np.isnan(found[~ok]).all())
    bound = float(poses.error[ok].max())
    return Rows(ok, off, bound, int(through.sum()), int(refused.sum()) + (not alone))
