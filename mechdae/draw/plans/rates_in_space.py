"""Velocities and accelerations of points in one pose of a spatial mechanism."""

from __future__ import annotations

import numpy as np

from mechdae.describe import GROUND, Joint
from mechdae.draw.plans.rates import NAMES, SPINS, Rates
from mechdae.draw.primitives import Array


class RatesInSpace(Rates):
    """The rates of one pose; vectors are (3,) in the fixed frame."""

    still, fixed = np.zeros(3), np.zeros(3)

    def has(self, body: str, name: str) -> bool:
        """Whether a point of the body has that rate."""
        return body == GROUND or (self.scene.shown(body, self.pose) and body in self.known[name])

    def turns(self, body: str) -> bool:
        """Whether a body turns in any pose, or nobody knows."""
        series = self.result.bodies.get(body) or {}
        return NAMES[0] not in series and bool(np.any(series.get(SPINS[0], 1.0)))

    def slides(self, joint: Joint) -> bool:
        return not (joint.coincide or joint.bar or joint.wheels or joint.pointer)

    def across(self, spin: Array, arm: Array) -> Array:
        return np.cross(spin, arm)

    def centripetal(self, body: str, arm: Array) -> Array:
        """Return omega x (omega x arm)."""
        return np.cross(self.spins[body][0], self.turning(body, arm))

    def sliding(self, joint: Joint, name: str) -> None:
        """Return None: what is seen from the first body follows from the points."""

    def coriolis(self, joint: Joint) -> Array:
        place = self.place(joint.second)
        seen = self.of(joint.second, NAMES[0]) - self.at(joint.first_body, place, NAMES[0])
        return 2 * self.turning(joint.first_body, seen)
