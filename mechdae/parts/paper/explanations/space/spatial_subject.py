"""One pose of a spatial mechanism: places, directions, rates of points and links."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.describe import GROUND, Joint
from mechdae.draw.diagram.places import numbers_of, places_of
from mechdae.draw.plans.relations import distinct_letters
from mechdae.draw.space.pose_choice import choose
from mechdae.draw.space.spatial_scene import SpatialScene, read_spatial
from mechdae.draw.space.viewpoint import Array
from mechdae.parts.paper.explanations.subject import Subject
from mechdae.records import dataclass

if TYPE_CHECKING:
    from mechdae.results.kinds import SweepResult


SPINS = {"velocity": "angular_velocity", "acceleration": "angular_acceleration"}


@dataclass(frozen=True)
class SpatialSubject(Subject):
    """One pose of a result of a spatial mechanism; vectors are (3,) in the fixed frame."""

    scene: SpatialScene  # type: ignore[assignment]

    @cached_property
    def relations(self) -> dict[str, Any]:
        return {}

    @cached_property
    def numbers(self) -> dict[str, int]:
        return {**numbers_of(self.scene.mechanism), GROUND: 0}

    @cached_property
    def letters(self) -> dict[str, str]:
        places = places_of(self.scene, self.pose)
        return distinct_letters(self.scene, self.pose, places, self.numbers)

    def named_apart(self, start: str, end: str) -> tuple[str, str]:
        """Return the letters of two points; those of one letter get the numbers of their links."""
        one, two = self.letter(start), self.letter(end)
        if one != two:
            return one, two
        bodies = (start.split(".")[0], end.split(".")[0])
        first, second = (f"{one}_{self.numbers[body]}" for body in bodies)
        return first, second

    def rate(self, reference: str, word: str) -> Array | None:
        """Return velocity or acceleration of ``body.point``, None where the result has none."""
        body = reference.split(".")[0]
        if body == GROUND:
            return np.zeros(3)
        found = self._own_rate(reference, word)
        if found is not None:
            return found
        for joint in self.scene.mechanism.joints.values():
            if joint.coincide and reference in (joint.first, joint.second):
                other = joint.second if reference == joint.first else joint.first
                if other.split(".")[0] == GROUND:
                    return np.zeros(3)
                found = self._own_rate(other, word)
                if found is not None:
                    return found
        return None

    def _own_rate(self, reference: str, word: str) -> Array | None:
        series = self.result.points.get(reference) or {}
        if word not in series or not np.isfinite(series[word][self.pose]).all():
            return None
        return np.asarray(series[word][self.pose], dtype=float)

    def spin(self, body: str, word: str = "velocity") -> Array | None:
        """Return angular velocity or acceleration, None of a link that spins freely."""
        if body == GROUND:
            return np.zeros(3)
        series = self.result.bodies.get(body) or {}
        name = SPINS[word]
        if name not in series or not np.isfinite(series[name][self.pose]).all():
            return None
        return np.asarray(series[name][self.pose], dtype=float)

    def turn(self, body: str) -> Array | None:
        """Return the rotation matrix (3, 3) of a body, None of one that spins freely."""
        found = self.scene.turns.get(body)
        if found is None or not np.isfinite(found[self.pose]).all():
            return None
        turn: Array = found[self.pose]
        return turn

    def axis(self, joint: Joint, second: bool = False) -> Array | None:
        return self.scene.axis(joint, self.pose, second)

    def rates_of_joint(self, joint: str, word: str) -> dict[str, float]:
        """Return the rates of a joint's coordinates by name, those of drivers too."""
        found = {}
        series = self.result.joints.get(joint) or {}
        for name in self.scene.mechanism.joints[joint].coordinates:
            driver = self.result.drivers.get(f"{joint}.{name}")
            if f"{name}_{word}" in series:
                found[name] = self.value(series, f"{name}_{word}")
            elif driver is not None and word in driver:
                found[name] = self.value(driver, word)
        return found

    def coordinates_of_joint(self, joint: str) -> dict[str, float]:
        """Return the values of a joint's coordinates by name, those of drivers too."""
        found = {}
        series = self.result.joints.get(joint) or {}
        for name in self.scene.mechanism.joints[joint].coordinates:
            driver = self.result.drivers.get(f"{joint}.{name}")
            if name in series:
                found[name] = self.value(series, name)
            elif driver is not None:
                found[name] = self.value(driver, "position")
        return found


def seen_in_space(result: SweepResult, pose: int | None) -> tuple[type[Subject], Any, int]:
    """Return the class of subject, the placements and the pose of a spatial result."""
    scene = read_spatial(result)
    return SpatialSubject, scene, choose(scene, result.kind, pose, None)[0]
