"""The vector equations of velocities and accelerations, group by group, with their numbers.

A point of a link follows from another one, v_B = v_A + v_BA and
a_B = a_A + a^n_BA + a^t_BA; the point of a guide under a slider's point from that point,
v_A3 = v_A2 + v_A3A2 and a_A3 = a_A2 + a^k_A3A2 + a^r_A3A2 with a^k = 2 omega x v, as in
Artobolevsky's textbook. Components are made of angular rates, slides and positions of the result,
the ends they have to meet are rates of points of the result: how far the terms miss their end is
the gap of the relation.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.draw.diagram.placed_scene import PlacedScene
from mechdae.draw.diagram.places import (
    Place,
    free_points,
    letters_of,
    numbers_of,
    places_of,
)
from mechdae.draw.diagram.scene import DrawnScene
from mechdae.draw.formulas.notations import mathtext, written_letter
from mechdae.draw.formulas.tree import Equation, Letter, Sum
from mechdae.draw.plans.board import Arrow, End, Plan
from mechdae.draw.plans.rates import Rates
from mechdae.draw.primitives import Array
from mechdae.errors import UnknownName
from mechdae.records import dataclass

if TYPE_CHECKING:
    from mechdae.results import SweepResult

SYMBOLS = {"velocity": ("v", "m/s", "p"), "acceleration": ("a", r"m/s$^2$", r"\pi")}
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


@dataclass(frozen=True)
class Term:
    """A term of a relation: its kind, its symbol, and the vector."""

    kind: str
    letter: Letter
    vector: Array


@dataclass(frozen=True)
class Relation:
    """The rate of one point by that of another: end = start + terms.

    Parameters
    ----------
    body
        The link on which both points lie, or the joint in which one slides past the other.
    gid
        Identifier of its arrows.
    start, end
        The two points; the start may be at rest.
    terms
        What is added, in the order of the field; those that vanish too.
    still
        Length below which a vector vanishes.
    """

    body: str
    gid: str
    symbol: str
    start: Spot
    end: Spot
    terms: tuple[Term, ...]
    still: float

    @property
    def moving(self) -> tuple[Term, ...]:
        """The terms that do not vanish, that of the start before them."""
        start = self.start
        first = Term("total", Letter(self.symbol, (start.letter,), vector=True), start.value)
        return tuple(
            t for t in (first, *self.terms) if float(np.linalg.norm(t.vector)) > self.still
        )

    @property
    def left(self) -> Letter:
        """The symbol of the end."""
        return Letter(self.symbol, (self.end.letter,), vector=True)

    @property
    def equation(self) -> Equation:
        """The relation in letters."""
        return Equation((self.left, Sum(tuple(term.letter for term in self.moving))))

    @property
    def gap(self) -> float:
        """How far the terms miss the end."""
        total = self.start.value + np.sum([term.vector for term in self.terms], axis=0)
        return float(np.linalg.norm(total - self.end.value))

    @property
    def steps(self) -> tuple[Arrow, ...]:
        """The terms as arrows, one after the other."""
        here, arrows = self.start.value, []
        for term in self.terms:
            there = here + term.vector
            name = mathtext(term.letter)
            arrows.append(Arrow(f"{self.gid}-{term.kind}", term.kind, here, there, name))
            here = there
        return tuple(arrows)


class Relations:
    """The vector equations of one pose.

    Parameters
    ----------
    result, scene
        A result with the rates asked for and the placements read from it.
    pose
        Index of the pose.
    word
        ``"velocity"`` or ``"acceleration"``.
    rates
        How velocities of points are made of those of the result, in the plane or in space.
    """

    symbol: str
    unit: str
    pole: str

    def __init__(
        self, result: SweepResult, scene: PlacedScene, pose: int, word: str,
        rates: type[Rates] = Rates,
    ) -> None:  # fmt: skip
        self.word: str = word
        self.scene: PlacedScene = scene
        self.pose: int = pose
        self.symbol, self.unit, self.pole = SYMBOLS[word]
        self.rates: Rates = rates(result, scene, pose)
        self.groups: list[tuple[str, tuple[str, ...]]] = groups_of(result, scene)
        self.order: dict[str, int] = {GROUND: -1} | {
            body: k for k, (_, bodies) in enumerate(self.groups) for body in bodies
        }
        self.numbers: dict[str, int] = {**numbers_of(scene.mechanism), GROUND: 0}
        self.places: list[Place] = places_of(scene, pose)
        self.letters: dict[str, str] = distinct_letters(scene, pose, self.places, self.numbers)
        self.spots: list[Spot] = list(self._spots())
        sizes = (float(np.linalg.norm(spot.value)) for spot in self.spots)
        self.size: float = max(sizes, default=0.0)

    def _spots(self) -> Iterator[Spot]:
        """Yield points of moving bodies in joints, under sliders, and free ones."""
        for place in self.places:
            for reference in place.references:
                yield from self._spot(reference)
        for reference in free_points(self.scene, self.pose):
            yield from self._spot(reference)
        for joint in self.scene.joints(self.pose):
            body, rates = joint.first_body, self.rates
            if not rates.slides(joint) or body == GROUND or not rates.has(body, self.word):
                continue
            at = self.rates.place(joint.second)
            letter = f"{self.letters[joint.second]}_{self.numbers[body]}"
            yield Spot(body, joint.name, at, letter, self.rates.at(body, at, self.word))

    def _spot(self, reference: str) -> Iterator[Spot]:
        body, rates = reference.split(".")[0], self.rates
        if rates.has(body, self.word):
            at, rate = rates.place(reference), rates.of(reference, self.word)
            yield Spot(body, reference, at, self.letters[reference], rate)

    def of(self, body: str, group: tuple[str, ...]) -> Iterator[Relation]:
        """Yield the relations of one body: to where it meets its group, and along its sliders."""
        spots = [spot for spot in self.spots if spot.body == body]
        if not spots:
            return
        base = self._base(spots, group)
        under = [spot for spot in spots if spot.reference in self.scene.mechanism.joints]
        ends = [spot for spot in under if GROUND not in self._joint(spot).bodies]
        ends += [spot for spot in spots if spot not in under and self._meets(spot, group)]
        far = [spot for spot in spots if spot is not base and self._apart(spot, base)]
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
        return float(np.linalg.norm(one.position - other.position)) > 0.0

    def _base(self, spots: list[Spot], group: tuple[str, ...]) -> Spot:
        """Return the point a body is known by: shared with the ground or an earlier group."""

        def rank(spot: Spot) -> int:
            others = self.others(spot) - set(group)
            earlier = [self.order[name] for name in others if name in self.order]
            now = self.order.get(spot.body, len(self.groups))
            earlier = [order for order in earlier if order < now]
            return min(earlier) if earlier else len(self.groups)

        return min(spots, key=rank)

    def _meets(self, spot: Spot, group: tuple[str, ...]) -> bool:
        """Whether a point is shared with another body of its group, or a bar ends there."""
        bars = (joint for joint in self.scene.mechanism.joints.values() if joint.bar)
        barred = any(spot.reference in (joint.first, joint.second) for joint in bars)
        return barred or bool(self.others(spot) & set(group))

    def others(self, spot: Spot) -> set[str]:
        """Return the other bodies at the place of a point."""
        for place in self.places:
            if spot.reference in place.references:
                return set(place.bodies) - {spot.body}
        return set()

    def _turned(self, base: Spot, spot: Spot) -> Relation:
        """Return the chain from one point of a body to another."""
        arm = spot.position - base.position
        gid = f"{self.word}-{spot.reference}-{base.reference}"
        rates = self.rates
        if self.word == "velocity":
            parts = [("relative", "", rates.turning(spot.body, arm))]
        else:
            parts = [
                ("normal", "n", rates.centripetal(spot.body, arm)),
                ("tangential", "τ", rates.tangential(spot.body, arm)),
            ]
        return self._relation(spot.body, base, spot, parts, gid)

    def _slid(self, under: Spot) -> Relation:
        """Return the chain between a slider's point and the guide's point under it."""
        joint = self._joint(under)
        letter = self.letters.get(joint.second, joint.second)
        rate = self.rates.of(joint.second, self.word)
        second = Spot(joint.second_body, joint.second, under.position, letter, rate)
        seen, turn = self.rates.sliding(joint, self.word), self.rates.coriolis(joint)
        difference = second.value - under.value
        sign = 1.0
        start, end = under, second
        if self._rank(joint.second_body) <= self._rank(joint.first_body):
            start, end, sign = second, under, -1.0
        gid = f"{self.word}-{joint.name}"
        if self.word == "velocity":
            seen = difference if seen is None else seen
            parts = [("sliding", "r", sign * seen)]
            return self._relation(joint.name, start, end, parts, gid)
        turn = self.rates.still if turn is None else turn
        if joint.on_curve:
            relative = self.rates.of(joint.second, "velocity") - self.rates.at(
                joint.first_body, under.position, "velocity"
            )
            turn = 2 * self.rates.turning(joint.first_body, relative)
        seen = difference - turn if seen is None else seen
        parts = [("coriolis", "k", sign * turn), ("sliding", "r", sign * seen)]
        return self._relation(joint.name, start, end, parts, gid)

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
            for other in self.others(spot)
        )

    def _relation(
        self, body: str, start: Spot, end: Spot, parts: list[tuple[str, str, Array]], gid: str
    ) -> Relation:
        names = (end.letter, start.letter)
        terms = tuple(
            Term(kind, Letter(self.symbol, names, mark, vector=True), vector)
            for kind, mark, vector in parts
        )
        return Relation(body, gid, self.symbol, start, end, terms, STILL * self.size)


def joints_of(mechanism: Mechanism, order: Mapping[str, int], bodies: tuple[str, ...]) -> list[str]:
    """Return the joints that a group brings: of its bodies with it or with earlier ones."""
    mine = max((order[body] for body in bodies), default=0)
    return [
        joint.name
        for joint in mechanism.joints.values()
        if {joint.first_body, joint.second_body} & set(bodies)
        and all(order.get(body, len(order)) <= mine for body in joint.bodies)
    ]


def groups_of(result: SweepResult, scene: PlacedScene) -> list[tuple[str, tuple[str, ...]]]:
    """Return the Assur groups in the order of their computation: name and bodies."""
    listed = result.summary.get("groups")
    if listed:
        return [(entry["name"], tuple(entry["bodies"])) for entry in listed]
    return [("", tuple(scene.mechanism.bodies))]


def named_group(names: list[str], wanted: str) -> str:
    """Return the name of a group, by itself or by its beginning."""
    found = [name for name in names if name == wanted] or [
        name for name in names if wanted and name.startswith(wanted)
    ]
    if len(found) != 1:
        raise UnknownName("group", wanted, names)
    return found[0]


def distinct_letters(
    scene: PlacedScene, pose: int, places: list[Place], numbers: dict[str, int]
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

        def put(arrow: Arrow) -> None:
            """Keep an arrow, of those that lie on each other the first."""
            scale = STILL * self.size or 1.0
            ends = np.round(np.concatenate([arrow.start, arrow.end]) / scale)
            if arrow.length > STILL * self.size:
                arrows.setdefault(tuple(ends.tolist()), arrow)

        for spot in spots:
            put(Arrow(f"{self.word}-{spot.reference}", "total", np.zeros(2), spot.value))
        for name, bodies in groups:
            texts = []
            for body in bodies:
                for chain in self.of(body, bodies):
                    gap = max(gap, chain.gap)
                    texts.append(mathtext(chain.equation))
                    inner += self._inner(chain)
                    for step in chain.steps:
                        put(step)
                sides += self._image(body)
            if texts:
                relations.append((name, tuple(dict.fromkeys(texts))))
        title = f"{self.word.capitalize()} plan" + (f", {group}" if group is not None else "")
        return Plan(
            self.word, title, self.symbol, self.unit, tuple(arrows.values()),
            (*self._ends(spots), *inner), tuple(sides), tuple(relations), gap,
        )  # fmt: skip

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
        spots: list[Spot] = []
        for spot in [spot for spot in self.spots if spot.body == body]:
            if all(self._apart(spot, other) for other in spots):
                spots.append(spot)
        if len(spots) > 2:
            for one, other in zip(spots, [*spots[1:], spots[0]], strict=True):
                yield one.value, other.value
