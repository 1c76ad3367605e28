"""Holding forces of loaded mechanisms by virtual work: differences of energies along own positions.

Positions come from circles and spheres that are cut, written here; an effort is the derivative of
the potential energy of weights, springs and constant loads by the driver's coordinate, by central
differences of fourth order. Nothing moves: no speed, no mass times acceleration is in it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

STEP = 2e-3
"""Step of the differences, of angles in radians and of lengths in metres."""


@dataclass
class Frame:
    """A body's pose: its origin, its axes as columns; the angle in the plane."""

    origin: np.ndarray
    axes: np.ndarray
    angle: float = 0.0

    def place(self, local: np.ndarray) -> np.ndarray:
        return self.origin + self.axes @ local


@dataclass
class Burden:
    """What loads a mechanism.

    ``masses`` body -> (mass, centre); ``pushes`` (body, point, force); ``torques`` body -> moment;
    ``springs`` (place on the ground, body, point, stiffness, free length, preload).
    """

    gravity: np.ndarray
    masses: dict[str, tuple[float, np.ndarray]] = field(default_factory=dict)
    pushes: list[tuple[str, np.ndarray, np.ndarray]] = field(default_factory=list)
    torques: dict[str, float] = field(default_factory=dict)
    springs: list[tuple[np.ndarray, str, np.ndarray, float, float, float]] = field(
        default_factory=list
    )

    def energy(self, frames: dict[str, Frame]) -> float:
        """Return the potential energy of all loads, each of its terms a function of places."""
        total = 0.0
        for body, (mass, centre) in self.masses.items():
            total -= mass * float(self.gravity @ frames[body].place(centre))
        for body, point, force in self.pushes:
            total -= float(force @ frames[body].place(point))
        for body, moment in self.torques.items():
            total -= moment * frames[body].angle
        for ground, body, point, stiffness, free, preload in self.springs:
            length = float(np.linalg.norm(frames[body].place(point) - ground))
            total += stiffness * (length - free) ** 2 / 2 + preload * length
        return total

    def size(self, frames: dict[str, Frame]) -> float:
        """Return the size of the forces, times lengths near one: what errors are small beside."""
        weights = sum(m for m, _ in self.masses.values()) * float(np.linalg.norm(self.gravity))
        pushes = sum(float(np.linalg.norm(force)) for _, _, force in self.pushes)
        pulls = sum(
            k * abs(float(np.linalg.norm(frames[body].place(point) - ground)) - free) + preload
            for ground, body, point, k, free, preload in self.springs
        )
        return weights + pushes + pulls + sum(map(abs, self.torques.values()))


def efforts(
    frames: Callable[[np.ndarray], dict[str, Frame]], burden: Burden, u: np.ndarray
) -> np.ndarray:
    """Return what holds each driver: the derivative of the energy by its coordinate."""
    found = []
    for k in range(len(u)):
        way = STEP * np.eye(len(u))[k]
        one, two = (
            (burden.energy(frames(u + s * way)) - burden.energy(frames(u - s * way)))
            / (2 * s * STEP)
            for s in (1, 2)
        )
        found.append((4 * one - two) / 3)
    return np.array(found)


# -- positions -----------------------------------------------------------------------------------


def turned(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def planar(origin: np.ndarray, angle: float) -> Frame:
    return Frame(origin, turned(angle), float(angle))


def along(start: np.ndarray, end: np.ndarray) -> Frame:
    """Return the frame of a link whose x axis goes from one point to another."""
    way = end - start
    return planar(start, float(np.arctan2(way[1], way[0])))


def dyad(A: np.ndarray, D: np.ndarray, a: float, d: float, side: int) -> np.ndarray:
    """Return the point at distances a of A and d of D, on a side of the line from A to D."""
    way = D - A
    gap = float(np.linalg.norm(way))
    x = (gap**2 + a**2 - d**2) / (2 * gap)
    high = a**2 - x**2
    if high <= 0:
        raise ValueError("the circles do not meet")
    e = way / gap
    return A + x * e + side * np.sqrt(high) * np.array([-e[1], e[0]])


def about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Return the rotation about a unit vector (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def rocker_angle(
    B: np.ndarray, D: np.ndarray, axis: np.ndarray, arm: np.ndarray, rod: float, side: int
) -> float:
    """Return the angle of an arm about an axis through D whose end is a rod away from B.

    |D + R(q) arm - B|^2 = rod^2 is P cos q + Q sin q = S.
    """
    w = D - B
    flat = arm - axis * (axis @ arm)
    P, Q = 2 * w @ flat, 2 * w @ np.cross(axis, arm)
    S = rod**2 - w @ w - arm @ arm - 2 * (w @ axis) * (axis @ arm)
    size = float(np.hypot(P, Q))
    if abs(S) >= size:
        raise ValueError("the rod does not reach")
    return float(np.arctan2(Q, P) + side * np.arccos(S / size))
