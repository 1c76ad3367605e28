"""What is explained: one pose of a result, its groups, the letters of points, numbers of links."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from mechdae.describe import GROUND
from mechdae.draw.diagram.scene import DrawnScene
from mechdae.draw.plans.relations import Relations, groups_of, joints_of, named_group
from mechdae.draw.primitives import Array
from mechdae.parts.paper.phrases import Phrases
from mechdae.records import dataclass

KINDS = ("sweep", "reactions")
ORDERS = ("velocity", "acceleration")


@dataclass(frozen=True)
class Subject:
    """One pose of a result."""

    result: Any
    scene: DrawnScene
    pose: int
    say: Phrases

    @cached_property
    def relations(self) -> dict[str, Relations]:
        """The vector equations of the rates there are, by ``velocity``, ``acceleration``."""
        return {word: Relations(self.result, self.scene, self.pose, word) for word in self.rated}

    @cached_property
    def groups(self) -> list[tuple[str, tuple[str, ...]]]:
        """Assur groups in the order of the computation: name and bodies that are placed."""
        shown = [
            (name, tuple(body for body in bodies if self.scene.shown(body, self.pose)))
            for name, bodies in groups_of(self.result, self.scene)
        ]
        return [(name, bodies) for name, bodies in shown if bodies]

    @cached_property
    def order(self) -> dict[str, int]:
        """The number of each body's group in the order of the computation, -1 of the ground."""
        return {body: k for k, (_, group) in enumerate(self.groups) for body in group} | {
            GROUND: -1
        }

    def joints_of(self, bodies: tuple[str, ...]) -> list[str]:
        """Return the joints that a group of bodies brings."""
        return joints_of(self.scene.mechanism, self.order, bodies)

    def group(self, wanted: str | None) -> list[tuple[str, tuple[str, ...]]]:
        """Return all groups, or the one of that name or beginning of a name."""
        if wanted is None:
            return self.groups
        name = named_group([name for name, _ in self.groups], wanted)
        return [group for group in self.groups if group[0] == name]

    def _rated(self, word: str) -> bool:
        series = self.result.points.values()
        return any(word in rates and np.isfinite(rates[word][self.pose]).all() for rates in series)

    @property
    def rated(self) -> tuple[str, ...]:
        """Which of velocities and accelerations the result has."""
        return tuple(word for word in ORDERS if self._rated(word))

    @cached_property
    def numbers(self) -> dict[str, int]:
        """Numbers of the links, 0 for the ground."""
        return self._letters.numbers

    @property
    def letters(self) -> dict[str, str]:
        """Capital letters of ``body.point``."""
        return self._letters.letters

    @cached_property
    def _letters(self) -> Relations:
        found = list(self.relations.values())
        return found[0] if found else Relations(self.result, self.scene, self.pose, "velocity")

    def letter(self, reference: str) -> str:
        """Return the letter of ``body.point``."""
        return self.letters.get(reference, reference.split(".")[1])

    def place(self, reference: str) -> Array:
        """Return the place of ``body.point``."""
        return self.scene.place(reference, self.pose)

    def value(self, series: Any, name: str) -> float:
        """Return an entry of a series at the pose, nan where there is none."""
        return float(series[name][self.pose]) if name in series else float("nan")

    def title(self, body: str) -> str:
        """Return number and name of a link: ``3 rod``."""
        return self.say("ground") if body == GROUND else f"{self.numbers[body]} {body}"
