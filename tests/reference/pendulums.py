"""Pendulums by an own integration: times of passage, and stiff dampers by a Radau method."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

G = 9.81
ROOT = math.sqrt(6)
RADAU = np.array(
    [
        [(88 - 7 * ROOT) / 360, (296 - 169 * ROOT) / 1800, (-2 + 3 * ROOT) / 225],
        [(296 + 169 * ROOT) / 1800, (88 + 7 * ROOT) / 360, (-2 - 3 * ROOT) / 225],
        [(16 - ROOT) / 36, (16 + ROOT) / 36, 1 / 9],
    ]
)


def passages(n: int, count: int) -> np.ndarray:
    """Return the first times at which the cranks of the ladder lie along its pivots.

    From the integral of the energy, phi'^2 = 1 + 2 w^2 (1 - cos phi), by Gauss-Legendre.
    """
    inertia, moment = (n + 1) / 3 + n, ((n + 1) / 2 + n) * 9.81
    nodes, weights = np.polynomial.legendre.leggauss(200)

    def between(a: float, b: float) -> float:
        phi = (a + b) / 2 + (b - a) / 2 * nodes
        speed = np.sqrt(1 + 2 * moment / inertia * (1 - np.cos(phi)))
        return float((b - a) / 2 * np.sum(weights / speed))

    upper, lower = between(0, np.pi / 2), between(np.pi / 2, np.pi)
    turn = 2 * (upper + lower)
    times = [k * turn + t for k in range(count) for t in (upper, upper + 2 * lower)]
    return np.array(times[:count])


def rates(y: Any, hinge: float, line: float) -> Any:
    """Lagrange's equations of two point masses on rods, by hand; y = (a, b, a', b').

    Dampers in the second hinge and along the line from the pivot to the second mass.
    """
    a, b, u, w = y
    k, s = math.cos(a - b), math.sin(a - b)
    moment = hinge * (w - u)
    x, z = math.sin(a) + math.sin(b), math.cos(a) + math.cos(b)
    length = math.hypot(x, z)
    dx, dz = math.cos(a) * u + math.cos(b) * w, -math.sin(a) * u - math.sin(b) * w
    pull = -line * (x * dx + z * dz) / length**2
    first = pull * (x * math.cos(a) - z * math.sin(a)) - s * w * w - 2 * G * math.sin(a) + moment
    second = pull * (x * math.cos(b) - z * math.sin(b)) + s * u * u - G * math.sin(b) - moment
    size = 2 - k * k
    return np.array([u, w, (first - k * second) / size, (2 * second - k * first) / size])


def radau(hinge: float, line: float, end: float, steps: int) -> Any:
    """Radau IIA of order 5 on a grid that begins fine."""
    y, grid = np.array([1.0, 0.5, 0.0, 0.0]), end * np.linspace(0, 1, steps + 1) ** 3
    for h in np.diff(grid):
        shifts = 1e-6 * np.eye(4)
        J = np.array([rates(y + e, hinge, line) - rates(y - e, hinge, line) for e in shifts]).T
        inverse = np.linalg.inv(np.eye(12) - h * np.kron(RADAU, J / 2e-6))
        Z = np.zeros((3, 4))
        for _ in range(20):
            left = h * RADAU @ np.array([rates(y + z, hinge, line) for z in Z]) - Z
            change = (inverse @ left.ravel()).reshape(3, 4)
            Z = Z + change
            if np.max(np.abs(change)) < 1e-15:
                break
        y = y + Z[2]
    return y
