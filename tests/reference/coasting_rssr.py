"""An RSSR that coasts with friction in both bearings: free bodies, closed kinematics, DOP853.

The crank turns about z at A, the rocker about x at D, a bar of length l joins B and C. The rocker's
angle follows from P cos + Q sin = R, its derivatives from |B - C|^2 = l^2. Accelerations of the
crank are those for which nothing has to drive it; friction of two bearing planes is iterated.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.reference.spatial_bodies import Contact, Pose, bar, rigid, wrenches

A, D = np.zeros(3), np.array([0.1, 0.25, 0.05])
R1, R2, HEIGHT, BAR = 0.05, 0.15, 0.02, 0.3
X, Z = np.array([1.0, 0, 0]), np.array([0, 0, 1.0])
CRANK = (2.0, np.diag([0.002, 0.003, 0.02]), np.array([0.01, 0.005, 0.01]))
ROCKER = (1.0, np.diag([0.001, 0.01, 0.01]), np.array([0.05, 0.0, 0.01]))
ROD = (0.5, 0.004)
"""Masses, inertia about the centres in body axes, centres; of the bar mass and inertia across."""
GRAVITY = np.array([0, 0, -9.81])
F, PIN, PLANES, COLLAR = 0.4, 0.03, 0.06, 0.015


def about(axis: Any, angle: float) -> Any:
    K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


TURNED = np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]])
"""The rocker at angle 0: its axis z along x, its x along y."""


def rocker_angle(theta: float, near: float) -> float:
    """Return the rocker's angle next to a given one."""
    B = about(Z, theta) @ np.array([R1, 0, 0]) - D
    # C = HEIGHT x + R2 (y cos + z sin)
    P, Q = 2 * R2 * B[1], 2 * R2 * B[2]
    R = B @ B + HEIGHT**2 + R2**2 - 2 * HEIGHT * B[0] - BAR**2
    middle, half = np.arctan2(Q, P), np.arccos(R / np.hypot(P, Q))
    both = [middle + half, middle - half]
    return float(min(both, key=lambda own: abs(np.angle(np.exp(1j * (own - near))))))


class Coasting:
    """States are (crank angle, its speed > 0); the rocker's mode is that of the start."""

    def __init__(self, rocker: float) -> None:
        self.near, self.sense = rocker, 1.0
        self.friction: dict[str, Any] = {"A": np.zeros(6), "D": np.zeros(6)}

    def pose(self, theta: float) -> tuple[Any, ...]:
        """Return orientations, arms of both balls and their velocities per unit of speed."""
        phi = self.near = rocker_angle(theta, self.near)
        R, S = about(Z, theta), about(X, phi) @ TURNED
        b, c = R @ np.array([R1, 0, 0]), S @ np.array([R2, 0, HEIGHT])
        return R, S, b, c, np.cross(Z, b), np.cross(X, c)

    def ratio(self, theta: float) -> float:
        """Return the rocker's speed per unit of the crank's."""
        _, _, b, c, u, v = self.pose(theta)
        way = A + b - D - c
        return float((way @ u) / (way @ v))

    def acceleration(self, theta: float, w: float) -> float:
        R, S, b, c, u, v = self.pose(theta)
        way = A + b - D - c
        rate = (way @ u) / (way @ v) * w
        gap = u * w - v * rate

        def second(dw: float) -> float:
            b2 = u * dw + np.cross(Z, u) * w**2
            return float((way @ (b2 - np.cross(X, v) * rate**2) + gap @ gap) / (way @ v))

        dw = 0.0
        for _ in range(40):
            (free, start), (pushed, end) = (
                self._solved(R, S, b, c, (w, own), (rate, second(own))) for own in (0.0, 1.0)
            )
            last, dw = dw, free / (free - pushed)
            own = {name: start[name] + dw * (end[name] - start[name]) for name in start}
            self.friction = {
                "A": _friction(Z, own["A"], 1.0), "D": _friction(X, own["D"], self.sense)
            }  # fmt: skip
            if abs(dw - last) < 1e-13 * (abs(dw) + w**2):
                return dw
        raise AssertionError("friction does not settle")

    def _solved(self, R: Any, S: Any, b: Any, c: Any, crank: Any, rocker: Any) -> tuple[float, Any]:
        """Return the effort at the crank and the reactions for speeds and accelerations."""
        (w, dw), (s, ds), friction = crank, rocker, self.friction

        def moved(axis: Any, arm: Any, speed: float, rate: float) -> Any:
            return np.cross(axis, arm) * rate + np.cross(axis, np.cross(axis, arm)) * speed**2

        g1, g2 = R @ CRANK[2], S @ ROCKER[2]
        ends = (A + b, D + c)
        bodies = {
            "crank": rigid(CRANK[0], CRANK[1], R, A + g1, moved(Z, g1, w, dw), Z * w, Z * dw),
            "rocker": rigid(ROCKER[0], ROCKER[1], S, D + g2, moved(X, g2, s, ds), X * s, X * ds),
            "bar": bar(ROD[0], ROD[1], 0.5, ends, (moved(Z, b, w, dw), moved(X, c, s, ds))),
        }
        zero = np.zeros(3)
        masses = (CRANK[0], ROCKER[0], ROD[0])
        pulled = zip(bodies.items(), masses, strict=True)
        loads = [(name, own.centre, m * GRAVITY, zero) for (name, own), m in pulled]
        for body, place, name in (("crank", A, "A"), ("rocker", D, "D")):
            loads.append((body, place, friction[name][:3], friction[name][3:]))
        contacts = {
            "A": Contact("ground", "crank", A, wrenches("revolute", Z)),
            "D": Contact("ground", "rocker", D, wrenches("revolute", X)),
            "B": Contact("crank", "bar", ends[0], wrenches("spherical")),
            "C": Contact("rocker", "bar", ends[1], wrenches("spherical")),
        }
        drive = ("ground", "crank", A, np.concatenate([zero, Z]))
        reactions, efforts, left, _ = Pose(bodies, contacts, loads, [drive]).solve()
        assert left < 1e-11
        return float(efforts[0]), {n: reactions[n] + friction[n] for n in ("A", "D")}

    def stop(self, theta: float, w: float, longest: float) -> tuple[float, float]:
        """Return when the crank stops for the first time, and where."""
        from scipy.integrate import solve_ivp

        def speed(t: float, y: Any) -> float:
            return float(y[1])

        def dead(t: float, y: Any) -> float:
            return self.ratio(y[0])

        speed.terminal = dead.terminal = True  # type: ignore[attr-defined]
        t, y = 0.0, [theta, w]
        while True:
            self.sense = float(np.sign(self.ratio(y[0] + 1e-6)))
            path = solve_ivp(
                lambda t, y: [y[1], self.acceleration(*y)], (t, longest), y, "DOP853",
                rtol=1e-9, atol=1e-10, events=(speed, dead),
            )  # fmt: skip
            t, y = float(path.t[-1]), path.y[:, -1]
            if len(path.t_events[0]):
                return t, float(y[0])
            assert t < longest


def _friction(a: Any, wrench: Any, sense: float) -> Any:
    Fo, M = wrench[:3], wrench[3:]
    across, tilt = Fo - (a @ Fo) * a, np.cross(a, M)
    planes = sum(float(np.linalg.norm(across / 2 + k * tilt / PLANES)) for k in (1, -1))
    size = PIN * np.sin(np.arctan(F)) * planes + F * COLLAR * abs(a @ Fo)
    return np.concatenate([np.zeros(3), -sense * size * a])
