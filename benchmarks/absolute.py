"""The forces of the four-bar from absolute equations, for any type of float.

Nine equations of Newton and Euler for crank, coupler and rocker, in the four pin forces and
the driver's torque; kinematics in closed form; friction by Newton's method on all equations
at once. No code of the package is used: what it computes is compared with this.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechdae.parts.bench.runs import COUPLER, CRANK, GROUND, ROCKER, yardstick

MASSES = (0.2, 0.3, 0.25)
INERTIAS = (1e-4, 3e-4, 2e-4)
CENTERS = ((0.024, 0.0), (0.045, 0.01), (0.04, 0.0))
SPEED, LOAD = 10.0, -2.0
FRICTION, PIN = 0.1, 0.005
STEPS = 12


@dataclass
class Motion:
    """Angles, angular speeds and accelerations of crank, coupler and rocker, each (n, 3)."""

    angle: Any
    speed: Any
    acceleration: Any


def motion(crank: Any) -> Motion:
    """Return the motion at angles (n,) of a crank of constant speed."""
    t3, t4, v3, v4, a3, a4 = yardstick(crank)
    one, w = np.ones_like(crank), crank.dtype.type(SPEED)
    return Motion(
        np.stack([crank, t3, t4], axis=1),
        np.stack([one, v3, v4], axis=1) * w,
        np.stack([0 * one, a3, a4], axis=1) * w**2,
    )


@dataclass
class Equations:
    """A y = c + sum G_j |R_j| in y = (R_D, R_B, R_C, R_A, torque), R_j = y[2 j : 2 j + 2]."""

    A: Any
    c: Any
    G: Any


def equations(moving: Motion, friction: bool) -> Equations:
    """Return the equations of motion about the centres of mass, rows are poses."""
    one = moving.angle.dtype.type
    e = np.stack([np.cos(moving.angle), np.sin(moving.angle)], axis=2)
    n = np.stack([-e[:, :, 1], e[:, :, 0]], axis=2)
    w, alpha = moving.speed[:, :, None], moving.acceleration[:, :, None]
    lengths = [one(CRANK), one(COUPLER), one(ROCKER)]
    zero = np.zeros_like(e[:, 0])
    D, A = zero, zero + np.array([one(GROUND), 0])
    B, C = lengths[0] * e[:, 0], A + lengths[2] * e[:, 2]
    pull = [L * (alpha[:, k] * n[:, k] - w[:, k] ** 2 * e[:, k]) for k, L in enumerate(lengths)]
    places, pulls = (D, B, A), (zero, pull[0], zero)
    count = len(e)
    matrix, right = np.zeros((count, 9, 9), one), np.zeros((count, 9), one)
    G = np.zeros((count, 9, 4), one)
    # pin, first body, second body (its reaction acts on), place
    pins = ((None, 0, D), (0, 1, B), (1, 2, C), (None, 2, A))
    centers = []
    for k, (x, y) in enumerate(CENTERS):
        x, y, mass = one(x), one(y), one(MASSES[k])
        arm, turned = x * e[:, k] + y * n[:, k], x * n[:, k] - y * e[:, k]
        centers.append(places[k] + arm)
        a = pulls[k] + alpha[:, k] * turned - w[:, k] ** 2 * arm
        right[:, 3 * k : 3 * k + 2] = mass * a
        right[:, 3 * k + 2] = one(INERTIAS[k]) * moving.acceleration[:, k]
    right[:, 8] -= one(LOAD)
    rho = one(PIN) * one(FRICTION) / np.sqrt(1 + one(FRICTION) ** 2) if friction else one(0)
    for j, (first, second, place) in enumerate(pins):
        sign = _sense(moving, first, second)
        for body, side in ((second, 1), (first, -1)):
            if body is None:
                continue
            arm = place - centers[body]
            row = 3 * body
            matrix[:, row, 2 * j] = matrix[:, row + 1, 2 * j + 1] = side
            matrix[:, row + 2, 2 * j] = -side * arm[:, 1]
            matrix[:, row + 2, 2 * j + 1] = side * arm[:, 0]
            G[:, row + 2, j] = side * sign * rho
    matrix[:, 2, 8] = 1
    return Equations(matrix, right, G)


def _sense(moving: Motion, first: int | None, second: int) -> Any:
    """Return the sign of the relative rotation, where it vanishes that of the coming one."""
    speed, rate = (
        entry[:, second] - (entry[:, first] if first is not None else 0)
        for entry in (moving.speed, moving.acceleration)
    )
    tiny = 100 * np.finfo(speed.dtype).eps * np.abs(moving.speed).max(axis=1)
    return np.sign(np.where(np.abs(speed) <= tiny, rate, speed))


def residual(own: Equations, y: Any) -> Any:
    """Return the left-over of the equations, (n, 9)."""
    return (own.A @ y[:, :, None])[:, :, 0] - own.c - (own.G @ _lengths(y)[:, :, None])[:, :, 0]


def jacobian(own: Equations, y: Any) -> Any:
    """Return the derivative of the left-over, (n, 9, 9)."""
    J = own.A.copy()
    lengths = _lengths(y)
    for j in range(4):
        along = y[:, 2 * j : 2 * j + 2] / lengths[:, j : j + 1]
        J[:, :, 2 * j : 2 * j + 2] -= own.G[:, :, j, None] * along[:, None, :]
    return J


def _lengths(y: Any) -> Any:
    forces = y[:, :8].reshape(len(y), 4, 2)
    return np.sqrt((forces * forces).sum(axis=2))


def newton(own: Equations, solve: Callable[[Any, Any], Any]) -> Any:
    """Return the solutions (n, 9) by Newton's method from those without friction."""
    y = solve(own.A, own.c)
    if not own.G.any():
        return y
    for _ in range(STEPS):
        step = solve(jacobian(own, y), residual(own, y))
        y = y - step
        if np.abs(step).max() <= 4 * np.finfo(y.dtype).eps * np.abs(y).max():
            break
    return y


def elimination(A: Any, b: Any) -> Any:
    """Solve many systems (n, k, k), (n, k) with pivots, in any type of float."""
    A, b = A.copy(), b.copy()
    rows, size = np.arange(len(A)), A.shape[1]
    for k in range(size):
        pivot = k + np.argmax(np.abs(A[:, k:, k]), axis=1)
        A[rows, k], A[rows, pivot] = A[rows, pivot], A[rows, k]
        b[rows, k], b[rows, pivot] = b[rows, pivot], b[rows, k]
        for i in range(k + 1, size):
            factor = A[:, i, k] / A[:, k, k]
            A[:, i] -= factor[:, None] * A[:, k]
            b[:, i] -= factor * b[:, k]
    x = np.zeros_like(b)
    for k in reversed(range(size)):
        x[:, k] = (b[:, k] - (A[:, k, k + 1 :] * x[:, k + 1 :]).sum(axis=1)) / A[:, k, k]
    return x


def dense(A: Any, b: Any) -> Any:
    """Solve many systems with LAPACK."""
    return np.linalg.solve(A, b[:, :, None])[:, :, 0]
