"""Velocities and accelerations of points in one pose, as a result holds them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

import numpy as np

from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND
from mechdae.draw.diagram.placed_scene import PlacedScene
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import normal

if TYPE_CHECKING:
    from mechdae.draw.diagram.scene import DrawnScene
    from mechdae.results import SweepResult
    from mechdae.results.series import Series


ZERO = np.zeros(2)
NAMES = ("velocity", "acceleration")
SPINS = ("angular_velocity", "angular_acceleration")


class Rates:
    """The rates of one pose.

    Parameters
    ----------
    result, scene
        A result with poses and the placements read from it.
    pose
        Index of the pose.
    """

    still: Array = ZERO
    """The rate of a point that rests,"""
    fixed: Array = np.zeros(())
    """and of a body."""

    def __init__(self, result: SweepResult, scene: PlacedScene, pose: int) -> None:
        self.result: SweepResult = result
        self.scene: PlacedScene = scene
        self.pose: int = pose
        self.spins: dict[str, list[Any]] = {GROUND: [self.fixed, self.fixed]}
        self.spins |= {body: self.spin_of(body) for body in scene.mechanism.bodies}
        self.known: dict[str, dict[str, str]] = {name: {} for name in NAMES}
        for reference, series in result.points.items():
            body = reference.split(".")[0]
            for name in NAMES:
                if name in series and np.isfinite(series[name][pose]).all():
                    self.known[name].setdefault(body, reference)

    def spin_of(self, body: str) -> list[Array]:
        """Return angular velocity and acceleration of a body, nan where they are not known."""
        series = self.result.bodies.get(body) or {}
        return [
            series[name][self.pose] if name in series else self.fixed + np.nan for name in SPINS
        ]

    def slides(self, joint: Joint) -> bool:
        """Whether the second point of a joint moves in the first body."""
        return joint.normal_force

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
            return self.still
        series: Series = self.result.points.get(reference)
        if series is not None and name in series and np.isfinite(series[name][self.pose]).all():
            return np.array(series[name][self.pose], dtype=float)
        return self.at(body, self.place(reference), name)

    def at(self, body: str, position: Array, name: str) -> Array:
        """Return the rate of the point of a body that is at a position."""
        if body == GROUND:
            return self.still
        base = self.known[name][body]
        start = np.array(self.result.points[base][name][self.pose], dtype=float)
        arm = position - self.place(base)
        if name == "velocity":
            return start + self.turning(body, arm)
        return start + self.centripetal(body, arm) + self.tangential(body, arm)

    def turning(self, body: str, arm: Array) -> Array:
        """Return omega x arm."""
        return self.across(self.spins[body][0], arm)

    def centripetal(self, body: str, arm: Array) -> Array:
        """Return the normal acceleration, against the arm."""
        bent: Array = -(self.spins[body][0] ** 2) * arm
        return bent

    def tangential(self, body: str, arm: Array) -> Array:
        """Return epsilon x arm."""
        return self.across(self.spins[body][1], arm)

    def across(self, spin: Array, arm: Array) -> Array:
        """Return spin x arm."""
        crossed: Array = spin * normal(arm)
        return crossed

    def sliding(self, joint: Joint, name: str) -> Array | None:
        """Return the rate of the second body's point seen from the first body, if there is one."""
        series = self.result.joints.get(joint.name) or {}
        key = f"slide_{name}"
        if key not in series or not np.isfinite(series[key][self.pose]):
            return None
        axis = cast("DrawnScene", self.scene).axis(joint, self.pose)
        return float(series[key][self.pose]) * axis

    def coriolis(self, joint: Joint) -> Array | None:
        """Return 2 omega x v of the second body's point seen from the first body."""
        series = self.result.joints.get(joint.name) or {}
        if "coriolis" in series and np.isfinite(series["coriolis"][self.pose]).all():
            return np.array(series["coriolis"][self.pose], dtype=float)
        return None
