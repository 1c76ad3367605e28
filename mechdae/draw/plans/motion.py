"""Plans of velocities and accelerations, group by group, as in Artobolevsky's textbook.

A point of a link follows from another one, v_B = v_A + v_BA and
a_B = a_A + a^n_BA + a^t_BA; the point of a guide under a slider's point from that point,
v_A3 = v_A2 + v_A3A2 and a_A3 = a_A2 + a^k_A3A2 + a^r_A3A2 with a^k = 2 omega x v. Components
are made of angular rates, slides and positions of the result, the ends they have to meet are
rates of points of the result: how far a chain misses its end is the gap of the plan.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mechdae.describe.joints import Joint
from mechdae.describe.mechanism import GROUND
from mechdae.draw.diagram.places import Place, free_points, letters_of, numbers_of, places_of
from mechdae.draw.diagram.scene import Array, DrawnScene
from mechdae.draw.plans.rates import Rates
from mechdae.draw.plans.vectors import Arrow, End, Plan

SYMBOLS = {"velocity": ("v", "m/s", "p"), "acceleration": ("a", r"m/s$^2$", r"\pi")}
MANY = 6
"""Of more letters at one end the rest is left out."""
STILL = 1e-9
"""Vectors shorter than this share of the longest are points."""


@dataclass(frozen=True)
class Spot:
    """A point of one body that the plan has an end for."""

    body: str
    reference: str
    """``body.point``, or the joint in whose slider it lies."""
    position: Array
    letter: str
    value: Array


@dataclass
class StepsBetween:
    """The steps from one end to another."""

    steps: list[Arrow] = field(default_factory=list)
    relation: str = ""
    gap: float = 0.0


def motion_plan(result: Any, scene: DrawnScene, pose: int, word: str) -> Plan:
    """Return the plan of ``"velocity"`` or ``"acceleration"`` of one pose."""
    return _Builder(result, scene, pose, word).plan()


class _Builder:
    def __init__(self, result: Any, scene: DrawnScene, pose: int, word: str) -> None:
        self.word, self.scene, self.pose = word, scene, pose
        self.symbol, self.unit, self.pole = SYMBOLS[word]
        self.rates = Rates(result, scene, pose)
        self.groups = groups_of(result, scene)
        self.order = {GROUND: -1} | {
            body: k for k, (_, bodies) in enumerate(self.groups) for body in bodies
        }
        self.numbers = {**numbers_of(scene.mechanism), GROUND: 0}
        self.places = places_of(scene, pose)
        self.letters = _letters(scene, pose, self.places, self.numbers)
        self.spots = list(self._spots())
        self.size = max((float(np.hypot(*spot.value)) for spot in self.spots), default=0.0)
        self.count = Counter[str]()

    def _spots(self) -> Iterator[Spot]:
        """Yield points of moving bodies in joints, under sliders, and free ones."""
        for place in self.places:
            for reference in place.references:
                yield from self._spot(reference)
        for reference in free_points(self.scene, self.pose):
            yield from self._spot(reference)
        for joint in self.scene.joints(self.pose):
            body = joint.first_body
            if not joint.normal_force or body == GROUND or not self.rates.has(body, self.word):
                continue
            position = self.rates.place(joint.second)
            letter = f"{self.letters[joint.second]}_{self.numbers[body]}"
            yield Spot(body, joint.name, position, letter, self.rates.at(body, position, self.word))

    def _spot(self, reference: str) -> Iterator[Spot]:
        body = reference.split(".")[0]
        if self.rates.has(body, self.word):
            yield Spot(
                body,
                reference,
                self.rates.place(reference),
                self.letters[reference],
                self.rates.of(reference, self.word),
            )

    # -- the plan --------------------------------------------------------------------------

    def plan(self) -> Plan:
        arrows: dict[tuple[float, ...], Arrow] = {}
        relations: list[tuple[str, tuple[str, ...]]] = []
        sides: list[tuple[Array, Array]] = []
        inner: list[End] = []
        gap = 0.0
        for spot in self.spots:
            if float(np.hypot(*spot.value)) > STILL * self.size:
                gid = f"{self.word}-{spot.reference}"
                arrows.setdefault(
                    self._key(np.zeros(2), spot.value),
                    Arrow(gid, "total", np.zeros(2), spot.value),
                )
        for name, bodies in self.groups:
            texts = []
            for body in bodies:
                for chain in self._chains(body, bodies):
                    gap = max(gap, chain.gap)
                    texts.append(chain.relation)
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
            titles[self.word],
            self.symbol,
            self.unit,
            tuple(arrows.values()),
            (*self._ends(), *inner),
            tuple(sides),
            tuple(relations),
            gap,
        )

    def _key(self, start: Array, end: Array) -> tuple[float, ...]:
        """Return what is the same for arrows that lie on each other."""
        scale = STILL * self.size or 1.0
        return tuple(np.round(np.concatenate([start, end]) / scale).tolist())

    def _ends(self) -> Iterator[End]:
        """Yield the lettered ends; letters of ends that coincide are written together."""
        found: list[tuple[Array, list[str], str]] = [(np.zeros(2), [], f"{self.word}-pole")]
        for spot in self.spots:
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
                taken = {small_letter(spot.letter) for spot in self.spots}
                small.insert(0, rf"{self.pole}_{self.symbol}" if self.pole in taken else self.pole)
            yield End(gid, r",\,".join(small), place)

    def _inner(self, chain: StepsBetween) -> Iterator[End]:
        """Yield the letters n and k at the ends of normal and Coriolis steps."""
        steps = [step for step in chain.steps if step.length > STILL * self.size]
        for step in steps[:-1]:
            letter = {"normal": "n", "coriolis": "k"}[step.kind]
            self.count[letter] += 1
            yield End(f"{step.gid}-end", f"{letter}_{{{self.count[letter]}}}", step.end)

    # -- chains ----------------------------------------------------------------------------

    def _chains(self, body: str, group: tuple[str, ...]) -> Iterator[StepsBetween]:
        """Yield the chains of one body: to where it meets its group, and along its sliders."""
        own = [spot for spot in self.spots if spot.body == body]
        if not own:
            return
        base = self._base(own, group)
        under = [spot for spot in own if spot.reference in self.scene.mechanism.joints]
        ends = [spot for spot in under if GROUND not in self._joint(spot).bodies]
        ends += [spot for spot in own if spot not in under and self._meets(spot, group)]
        far = [spot for spot in own if spot is not base and self._apart(spot, base)]
        done: list[Spot] = []
        turns = self.rates.turns(body)
        for spot in ([spot for spot in ends if spot in far] or far[:1]) if turns else ():
            if all(self._apart(spot, other) for other in done):
                yield self._turned(base, spot)
                done.append(spot)
        for spot in under:
            yield self._slid(spot)

    def _joint(self, spot: Spot) -> Joint:
        return self.scene.mechanism.joints[spot.reference]

    def _apart(self, one: Spot, other: Spot) -> bool:
        return float(np.hypot(*(one.position - other.position))) > 0.0

    def _base(self, own: list[Spot], group: tuple[str, ...]) -> Spot:
        """Return the point a body is known by: shared with the ground or an earlier group."""

        def rank(spot: Spot) -> int:
            others = self._others(spot) - set(group)
            earlier = [self.order[name] for name in others if name in self.order]
            now = self.order.get(spot.body, len(self.groups))
            earlier = [order for order in earlier if order < now]
            return min(earlier) if earlier else len(self.groups)

        return min(own, key=rank)

    def _meets(self, spot: Spot, group: tuple[str, ...]) -> bool:
        """Whether a point is shared with another body of its group."""
        return bool(self._others(spot) & set(group))

    def _others(self, spot: Spot) -> set[str]:
        for place in self.places:
            if spot.reference in place.references:
                return set(place.bodies) - {spot.body}
        return set()

    def _turned(self, base: Spot, spot: Spot) -> StepsBetween:
        """Return the chain from one point of a body to another."""
        arm = spot.position - base.position
        names = f"{spot.letter} {base.letter}"
        gid = f"{self.word}-{spot.reference}-{base.reference}"
        rates = self.rates
        if self.word == "velocity":
            parts = [("relative", "", rates.turning(spot.body, arm))]
        else:
            parts = [
                ("normal", "n", rates.centripetal(spot.body, arm)),
                ("tangential", r"\tau", rates.tangential(spot.body, arm)),
            ]
        return self._chain(base, spot, parts, names, gid)

    def _slid(self, under: Spot) -> StepsBetween:
        """Return the chain between a slider's point and the guide's point under it."""
        joint = self._joint(under)
        second = Spot(
            joint.second_body,
            joint.second,
            under.position,
            self.letters.get(joint.second, joint.second),
            self.rates.of(joint.second, self.word),
        )
        seen, turn = self.rates.sliding(joint, self.word), self.rates.coriolis(joint)
        difference = second.value - under.value
        sign = 1.0
        start, end = under, second
        if self._rank(joint.second_body) <= self._rank(joint.first_body):
            start, end, sign = second, under, -1.0
        names = f"{end.letter} {start.letter}"
        gid = f"{self.word}-{joint.name}"
        if self.word == "velocity":
            seen = difference if seen is None else seen
            return self._chain(start, end, [("sliding", "r", sign * seen)], names, gid)
        turn = np.zeros(2) if turn is None else turn
        if joint.on_curve:
            relative = self.rates.of(joint.second, "velocity") - self.rates.at(
                joint.first_body, under.position, "velocity"
            )
            turn = 2 * self.rates.turning(joint.first_body, relative)
        seen = difference - turn if seen is None else seen
        parts = [("coriolis", "k", sign * turn), ("sliding", "r", sign * seen)]
        return self._chain(start, end, parts, names, gid)

    def _rank(self, body: str) -> tuple[int, int]:
        """Return where a body comes in the order of the groups."""
        k = self.order.get(body, len(self.groups))
        if body == GROUND or k >= len(self.groups):
            return k, 0
        bodies = self.groups[k][1]
        return k, -1 if self._hangs(body, k) else bodies.index(body)

    def _hangs(self, body: str, group: int) -> bool:
        """Whether a body of a group is pinned to a moving body of an earlier group."""
        return any(
            0 <= self.order.get(other, -1) < group
            for spot in self.spots
            if spot.body == body
            for other in self._others(spot)
        )

    def _chain(
        self, start: Spot, end: Spot, parts: list[tuple[str, str, Array]], names: str, gid: str
    ) -> StepsBetween:
        chain, here = StepsBetween(), start.value
        symbol = self.symbol
        terms = []
        for kind, mark, vector in parts:
            label = _vector(symbol, names, mark)
            if float(np.hypot(*vector)) > STILL * self.size:
                terms.append(label)
            chain.steps.append(Arrow(f"{gid}-{kind}", kind, here, here + vector, label))
            here = here + vector
        still = float(np.hypot(*start.value)) <= STILL * self.size
        first = [] if still else [_vector(symbol, start.letter)]
        right = " + ".join([*first, *terms]) or "0"
        chain.relation = f"{_vector(symbol, end.letter)} = {right}"
        chain.gap = float(np.hypot(*(here - end.value)))
        return chain

    def _image(self, body: str) -> Iterator[tuple[Array, Array]]:
        """Yield the sides of the image of a link with three points or more."""
        own: list[Spot] = []
        for spot in [spot for spot in self.spots if spot.body == body]:
            if all(self._apart(spot, other) for other in own):
                own.append(spot)
        if len(own) > 2:
            for one, other in zip(own, [*own[1:], own[0]], strict=True):
                yield one.value, other.value


def groups_of(result: Any, scene: DrawnScene) -> list[tuple[str, tuple[str, ...]]]:
    """Return the Assur groups in the order of their computation: name and bodies."""
    listed = result.summary.get("groups")
    if listed:
        return [(entry["name"], tuple(entry["bodies"])) for entry in listed]
    return [("", tuple(scene.mechanism.bodies))]


def _letters(
    scene: DrawnScene, pose: int, places: list[Place], numbers: dict[str, int]
) -> dict[str, str]:
    """Return the capital letter of each point; different points have different ones."""
    found = letters_of(scene, pose, places)
    owners: dict[str, set[int]] = {}
    marks = {entry: k for k, place in enumerate(places) for entry in place.references}
    for k, entry in enumerate(found, start=len(places)):
        owners.setdefault(small_letter(found[entry]), set()).add(marks.get(entry, k))
    return {
        entry: letter
        if len(owners[small_letter(letter)]) == 1
        else f"{letter}_{numbers[_mover(entry, places)]}"
        for entry, letter in found.items()
    }


def _mover(reference: str, places: list[Place]) -> str:
    """Return the first moving body at the place of a point."""
    for place in places:
        if reference in place.references:
            moving = [body for body in place.bodies if body != GROUND]
            return moving[0] if moving else GROUND
    return reference.split(".")[0]


def small_letter(letter: str) -> str:
    """Return the mathtext of an end: the letter of the point in lower case."""
    return written_letter(letter[:1].lower() + letter[1:])


def written_letter(letter: str) -> str:
    """Return the mathtext of a letter: numbers at its end as an index."""
    stem = letter.rstrip("0123456789_")
    parts = [part for part in letter[len(stem) :].split("_") if part]
    stem = stem.replace("_", r"\_").replace(" ", "")
    body = stem if len(stem) < 2 else rf"\mathit{{{stem}}}"
    return body + (f"_{{{','.join(parts)}}}" if parts else "")


def _vector(symbol: str, names: str, mark: str = "") -> str:
    """Return the mathtext of a vector with its points as index."""
    index = "".join(written_letter(name) for name in names.split())
    return rf"\mathbf{{{symbol}}}_{{{index}}}" + (f"^{{{mark}}}" if mark else "")
