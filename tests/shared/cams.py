"""What tests of cams compare with: an eccentric circle is a slider-crank."""

from __future__ import annotations

import math

import numpy as np

import mechdae as md
from tests.shared.mechanisms import SPEED

LONG = np.longdouble

PI = math.pi


def turn(low: float = 0.0, high: float = 2 * PI, poses: int = 25) -> md.Sweep:
    return md.Sweep(md.Driver("cam.angle", from_=low, to=high, speed=SPEED), poses=poses)


def largest(a: object, b: object) -> float:
    return float(np.max(np.abs(np.asarray(a, LONG) - np.asarray(b, LONG))))


def slider_crank(e: float, rod: float, u: object) -> list:
    """Slide along y of a crank e from the x axis with a rod, and its rates at speed SPEED."""
    u = np.asarray(u, LONG)
    e, rod = LONG(e), LONG(rod)
    x, dx, ddx = e * np.cos(u), -e * np.sin(u), -e * np.cos(u)
    root = np.sqrt(rod**2 - x**2)
    y = e * np.sin(u) + root
    first = e * np.cos(u) - x * dx / root
    slope = (dx * dx + x * ddx) / root + (x * dx) ** 2 / root**3
    return [y, first * SPEED, (-e * np.sin(u) - slope) * SPEED**2]
