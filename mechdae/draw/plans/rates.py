"""Velocities and accelerations of points in one pose, as a result holds them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND
from mechdae.draw.diagram.scene import Array, DrawnScene
from mechdae.draw.sheet import normal

if TYPE_CHECKING:
    from mechdae.results import SweepResult
    from mechdae.results.series import Series


ZERO = np.zeros(2)
NAMES = ("velocity", "acceleration")


class Rates:
    """The rates of one pose.

    Parameters
    ----------
    result, scene
        A result with poses and the placements read from it.
    pose
        Index of the pose.
    """

    def __init__(self, result: SweepResult, scene: DrawnScene, pose: int) -> None:
        self.result: SweepResult = result
        self.scene: DrawnScene = scene
        self.pose: int = pose
        self.spins: dict[str, tuple[float, float]] = {GROUND: (0.0, 0.0)}
        for body, series in result.bodies.items():
            rates = [
                float(series[name][pose]) if name in series else np.nan
                for name in ("angular_velocity", "angular_acceleration")
            ]
            self.spins[body] = (rates[0], rates[1])
        self.known: dict[str, dict[str, str]] = {name: {} for name in NAMES}
        for reference, series in result.points.items():
            body = reference.split(".")[0]
            for name in NAMES:
                if name in series and np.isfinite(series[name][pose]).all():
                    self.known[name].setdefault(body, reference)

    def has(self, body: str, name: str) -> bool:
        """Whether every point of the body has that rate."""
        order = NAMES.index(name)
        return body == GROUND or (
            self.scene.shown(body, self.pose)
            and body in self.known[name]
            and bool(np.isfinite(self.spins.get(body, (np.nan, np.nan))[: order + 1]).all())
        )

    def turns(self, body: str) -> bool:
        """Whether a body turns in any pose."""
        series = self.result.bodies.get(body) or {}
        rates = np.asarray(series.get("angular_velocity", 0.0), dtype=float)
        return bool(np.any(np.abs(rates) > 0)) or self.spins[body][1] != 0

    def place(self, reference: str) -> Array:
        """Return the position of ``body.point``."""
        return self.scene.place(reference, self.pose)

    def of(self, reference: str, name: str) -> Array:
        """Return the rate of ``body.point``: that of the result, else by its body."""
        body = reference.split(".")[0]
        if body == GROUND:
            return ZERO
        series: Series = self.result.points.get(reference)
        if series is not None and name in series and np.isfinite(series[name][self.pose]).all():
            return np.array(series[name][self.pose], dtype=float)
        return self.at(body, self.place(reference), name)

    def at(self, body: str, position: Array, name: str) -> Array:
        """Return the rate of the point of a body that is at a position."""
        if body == GROUND:
            return ZERO
        base = self.known[name][body]
        start = np.array(self.result.points[base][name][self.pose], dtype=float)
        arm = position - self.place(base)
        if name == "velocity":
            return start + self.turning(body, arm)
        return start + self.centripetal(body, arm) + self.tangential(body, arm)

    def turning(self, body: str, arm: Array) -> Array:
        """Return omega x arm."""
        return self.spins[body][0] * normal(arm)

    def centripetal(self, body: str, arm: Array) -> Array:
        """Return the normal acceleration, against the arm."""
        return -(self.spins[body][0] ** 2) * arm

    def tangential(self, body: str, arm: Array) -> Array:
        """Return epsilon x arm."""
        return self.spins[body][1] * normal(arm)

    def sliding(self, joint: Joint, name: str) -> Array | None:
        """Return the rate of the second body's point seen from the first body, if there is one."""
        series = self.result.joints.get(joint.name) or {}
        key = f"slide_{name}"
        if key not in series or not np.isfinite(series[key][self.pose]):
            return None
        angle = self.scene.numbers[f"{joint.name}.axis"]
        return float(series[key][self.pose]) * self.scene.direction(
            joint.first_body, angle, self.pose
        )

    def coriolis(self, joint: Joint) -> Array | None:
        """Return 2 omega x v of the second body's point seen from the first body."""
        series = self.result.joints.get(joint.name) or {}
        if "coriolis" in series and np.isfinite(series["coriolis"][self.pose]).all():
            return np.array(series["coriolis"][self.pose], dtype=float)
        return None
