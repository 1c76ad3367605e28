"""A toggle clamp with a cylinder, rough pins and a rough guide: a balance of its five bodies."""

from __future__ import annotations

from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md

FILE = Path(__file__).parents[1] / "data" / "friction" / "toggle-clamp.toml"
A, B, H = 0.12, 0.14, np.array([0.06, -0.15])
RADIUS, MU, LENGTH, JAW, WORK, G = 0.008 * 0.1 / sqrt(1.01), 0.12, 0.06, 2.0, 1e4, 9.81
SPEED, STEP = 0.02, 1e-5


def place(s: float) -> tuple[Any, Any, Any]:
    """Points A and B and the angles of arm, link and barrel for a length of the cylinder."""
    far = float(np.hypot(*H))
    along = (A**2 - s**2 + far**2) / (2 * far)
    e = H / far
    pin = along * e + sqrt(A**2 - along**2) * np.array([-e[1], e[0]])
    jaw = np.array([pin[0] + sqrt(B**2 - pin[1] ** 2), 0.0])
    turns = [np.arctan2(*own[::-1]) for own in (pin, jaw - pin, pin - H)]
    return pin, jaw, np.array(turns)


def cross(a: Any, b: Any) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


def _forces(M: Any, row: int, parts: Any) -> None:
    for column, sense in parts:
        M[row : row + 2, column : column + 2] += sense * np.eye(2)


def _moments(M: Any, row: int, parts: Any) -> None:
    for column, arm in parts:
        M[row, column : column + 2] += [-arm[1], arm[0]]


def effort(s: float) -> float:
    """Force of the cylinder: fifteen equations, friction from the forces before until it stays."""
    pin, jaw, turns = place(s)
    (_, back, low), (_, ahead, high) = place(s - STEP), place(s + STEP)
    rate = (high - low) / (2 * STEP)
    arm, link, barrel = rate
    push = float(np.sign(ahead[0] - back[0]))
    a_jaw = (ahead[0] - 2 * jaw[0] + back[0]) / STEP**2 * SPEED**2
    u = np.array([np.cos(turns[2]), np.sin(turns[2])])
    n = np.array([-u[1], u[0]])
    senses = -np.sign([arm, link - arm, barrel - arm, -link, barrel])  # O, A, Ar, B, H
    moments, rub = np.zeros(5), 0.0
    for _ in range(200):
        M, f = np.zeros((15, 15)), np.zeros(15)
        # columns: O 0, A 2, Ar 4, B 6, H 8, cylinder along and across 10, 11, its moment 12,
        # guide across 13, its moment 14
        _forces(M, 0, [(0, 1), (2, -1), (4, -1)])
        _moments(M, 2, [(2, -pin), (4, -pin)])
        _forces(M, 3, [(2, 1), (6, -1)])
        _moments(M, 5, [(6, pin - jaw)])
        _forces(M, 6, [(6, 1)])
        M[7, 13] = M[8, 14] = 1.0
        _forces(M, 9, [(8, 1)])
        M[9:11, 10], M[9:11, 11] = -u, -n
        M[11, 10:13] = -cross(pin - H, u), -cross(pin - H, n), -1.0
        _forces(M, 12, [(4, 1)])
        M[12:14, 10], M[12:14, 11], M[14, 12] = u, n, 1.0
        own = moments
        f[[2, 5, 8, 11, 14]] = [
            own[1] + own[2] - own[0],
            own[3] - own[1],
            -own[3],
            -own[4],
            -own[2],
        ]
        f[6:8] = [JAW * a_jaw + WORK + push * rub, JAW * G]
        x = np.linalg.solve(M, f)
        sizes = np.hypot(x[0:10:2], x[1:10:2])
        last = np.append(moments, rub)
        moments, rub = senses * RADIUS * sizes, MU * max(abs(x[13]), 2 * abs(x[14]) / LENGTH)
        if np.abs(np.append(moments, rub) - last).max() < 1e-12 * WORK:
            break
    return float(x[10])


def test_efforts_of_the_cylinder() -> None:
    result = md.solve(md.load(FILE), "close")
    assert all(own == "ok" for own in result.status)
    slides = result.drivers["cyl.slide"].position
    for k in (0, *range(10, len(slides) - 1, 32), len(slides) - 1):
        wanted = effort(float(slides[k]))
        assert result.efforts["cyl.slide"][k] == pytest.approx(wanted, rel=1e-8), slides[k]
