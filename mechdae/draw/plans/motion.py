"""Plans of velocities and accelerations: the relations of each group as polygons from one pole."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from mechdae.draw.diagram.scene import Array, DrawnScene
from mechdae.draw.formulas.notations import mathtext
from mechdae.draw.plans.relations import (
    STILL,
    Relation,
    Relations,
    Spot,
    small_letter,
)
from mechdae.draw.plans.vectors import Arrow, End, Plan

if TYPE_CHECKING:
    from mechdae.results import SweepResult


MANY = 6
"""Of more letters at one end the rest is left out."""


def motion_plan(
    result: SweepResult, scene: DrawnScene, pose: int, word: str, group: str | None = None
) -> Plan:
    """Return the plan of ``"velocity"`` or ``"acceleration"`` of one pose, or of a group in it."""
    return _Builder(result, scene, pose, word).plan(group)


class _Builder(Relations):
    """Arrows, ends with letters and images of links from the relations of a pose."""

    def __init__(self, result: SweepResult, scene: DrawnScene, pose: int, word: str) -> None:
        super().__init__(result, scene, pose, word)
        self.count = Counter[str]()

    def plan(self, group: str | None) -> Plan:
        groups = [entry for entry in self.groups if group in (None, entry[0])]
        spots = self.spots if group is None else self._spots_of(groups[0][1])
        arrows: dict[tuple[float, ...], Arrow] = {}
        relations: list[tuple[str, tuple[str, ...]]] = []
        sides: list[tuple[Array, Array]] = []
        inner: list[End] = []
        gap = 0.0
        for spot in spots:
            if float(np.hypot(*spot.value)) > STILL * self.size:
                gid = f"{self.word}-{spot.reference}"
                arrows.setdefault(
                    self._key(np.zeros(2), spot.value),
                    Arrow(gid, "total", np.zeros(2), spot.value),
                )
        for name, bodies in groups:
            texts = []
            for body in bodies:
                for chain in self.of(body, bodies):
                    gap = max(gap, chain.gap)
                    texts.append(mathtext(chain.equation))
                    inner += self._inner(chain)
                    for step in chain.steps:
                        if step.length > STILL * self.size:
                            arrows.setdefault(self._key(step.start, step.end), step)
                sides += self._image(body)
            if texts:
                relations.append((name, tuple(dict.fromkeys(texts))))
        titles = {"velocity": "Velocity plan", "acceleration": "Acceleration plan"}
        return Plan(
            self.word,
            titles[self.word] + (f", {groups[0][0]}" if group is not None else ""),
            self.symbol,
            self.unit,
            tuple(arrows.values()),
            (*self._ends(spots), *inner),
            tuple(sides),
            tuple(relations),
            gap,
        )

    def _key(self, start: Array, end: Array) -> tuple[float, ...]:
        """Return what is the same for arrows that lie on each other."""
        scale = STILL * self.size or 1.0
        return tuple(np.round(np.concatenate([start, end]) / scale).tolist())

    def _spots_of(self, bodies: tuple[str, ...]) -> list[Spot]:
        """Return the points of a group and those that its relations begin at."""
        chains = [chain for body in bodies for chain in self.of(body, bodies)]
        letters = {spot.letter for spot in self.spots if spot.body in bodies}
        letters |= {spot.letter for chain in chains for spot in (chain.start, chain.end)}
        return [spot for spot in self.spots if spot.letter in letters]

    def _ends(self, spots: list[Spot]) -> Iterator[End]:
        """Yield the lettered ends; letters of ends that coincide are written together."""
        found: list[tuple[Array, list[str], str]] = [(np.zeros(2), [], f"{self.word}-pole")]
        for spot in spots:
            for place, letters, _ in found:
                if float(np.hypot(*(place - spot.value))) <= 1e-7 * self.size:
                    letters.append(spot.letter)
                    break
            else:
                found.append((spot.value, [spot.letter], f"{self.word}-end-{spot.reference}"))
        for place, letters, gid in found:
            small = [small_letter(letter) for letter in dict.fromkeys(letters)]
            if self.size == 0:
                small = []
            elif len(small) > MANY:
                small = [*small[: MANY - 1], r"\ldots"]
            if gid.endswith("-pole"):
                taken = {small_letter(spot.letter) for spot in spots}
                small.insert(0, rf"{self.pole}_{self.symbol}" if self.pole in taken else self.pole)
            yield End(gid, r",\,".join(small), place)

    def _inner(self, chain: Relation) -> Iterator[End]:
        """Yield the letters n and k at the ends of normal and Coriolis steps."""
        steps = [step for step in chain.steps if step.length > STILL * self.size]
        for step in steps[:-1]:
            letter = {"normal": "n", "coriolis": "k"}[step.kind]
            self.count[letter] += 1
            yield End(f"{step.gid}-end", f"{letter}_{{{self.count[letter]}}}", step.end)

    def _image(self, body: str) -> Iterator[tuple[Array, Array]]:
        """Yield the sides of the image of a link with three points or more."""
        own: list[Spot] = []
        for spot in [spot for spot in self.spots if spot.body == body]:
            if all(self._apart(spot, other) for other in own):
                own.append(spot)
        if len(own) > 2:
            for one, other in zip(own, [*own[1:], own[0]], strict=True):
                yield one.value, other.value
