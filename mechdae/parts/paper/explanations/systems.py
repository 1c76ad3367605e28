"""The linear systems of a group: projections of its vector equations on x and y, and their sizes.

Each relation goes from one point to another. Paths along them from points that are known meet in
others: that is one vector equation, in which the points on the way do not stand. Known are the
places of earlier groups, the ground and the drivers; sought are the sizes of vectors across links
that turn and along guides.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import degrees

import numpy as np

from mechdae.describe import GROUND
from mechdae.draw.formulas.notations import signed
from mechdae.draw.formulas.tree import (
    Equation,
    Formula,
    Less,
    Letter,
    Matrix,
    Note,
    Part,
    Passage,
    Product,
    Sum,
    Wording,
    columns,
    like,
    number,
    rounded,
)
from mechdae.draw.plans.relations import Relation, Relations, Spot
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import normal
from mechdae.parts.paper.explanations.subject import Subject
from mechdae.records import dataclass

LARGEST = 6
"""Unknowns of a system that is printed at most."""
SHOWN = 2
"""And of one whose matrix is printed with its cosines and sines as well."""
REGULAR = 1e-9
"""Of a system that is solved: least singular value over the largest, and what it misses."""


@dataclass(frozen=True)
class SizedTerm:
    """A vector of an equation, its sign there; what is sought lies along ``line`` (unit).

    Links that slide in each other turn alike, ``turning``: their sizes are as their ``arm``.
    """

    letter: Letter
    vector: Array
    line: Array | None = None
    turning: str = ""
    arm: float = 1.0
    sign: float = 1.0

    @property
    def size(self) -> float:
        """How long it is along its line."""
        return float(self.vector @ self.line) if self.line is not None else np.nan

    @property
    def part(self) -> Part:
        """How it stands in the equation."""
        return self.letter if self.sign > 0 else Less(self.letter)


@dataclass(frozen=True)
class RelationEdge:
    """From a point to another one, by their letters."""

    start: str
    end: str
    addends: tuple[SizedTerm, ...]


Sides = tuple[list[SizedTerm], list[SizedTerm]]


def system_of(
    subject: Subject, word: str, bodies: tuple[str, ...], joints: list[str], unit_text: str
) -> Iterator[Passage]:
    """Yield the vector equations of a group without the points on the way, and their system."""
    relations, pairs = subject.relations[word], subject.scene.mechanism.joints
    if any(pairs[name].on_curve for name in joints):
        return
    known, edges = _edges(subject, relations, bodies, joints)
    loops = list(_loops(known, edges))
    sought = {one.letter: one for sides in loops for side in sides for one in side}
    moving = [one for one in sought.values() if one.line is not None]
    leads = {one.turning or one.letter: one for one in reversed(moving)}
    unknown = [one for one in moving if leads[one.turning or one.letter] is one]
    if not unknown or len(unknown) != 2 * len(loops) or len(unknown) > LARGEST:
        return
    matrix, right, signs = _assembled(loops, unknown, leads)
    sizes = np.array([one.size for one in unknown])
    spread = np.linalg.svd(matrix, compute_uv=False)
    miss, scale = float(np.abs(matrix @ sizes - right).max()), max(relations.size, 1e-300)
    if spread[-1] <= REGULAR * spread[0] or miss > REGULAR * scale:
        return
    yield Note((subject.say("system"),))
    for sides in loops:
        parts = [[one.part for one in side if one.line is not None or one.vector.any()]
                 for side in sides]  # fmt: skip
        yield Formula(Equation(tuple(Sum(tuple(side)) for side in parts)))
    for one in moving:
        lead = leads[one.turning or one.letter]
        if one is not lead:
            letters = (replace(side.letter, vector=False) for side in (one, lead))
            left, letter = letters
            yield Formula(Equation((left, Product((number(one.arm / lead.arm), letter)))))
    names = Matrix(tuple((replace(one.letter, vector=False),) for one in unknown))
    free = columns(tuple(right), unit=unit_text)[0]
    if len(moving) == SHOWN:
        yield Formula(Equation((Product((_angles(unknown, signs), names)), free)))
    alike = tuple(matrix.ravel().tolist())
    shown = Matrix(tuple(tuple(like(value, alike) for value in row) for row in matrix.tolist()))
    yield Formula(Equation((Product((shown, names)), free)), miss, unit_text)
    yield Formula(Equation((names, columns(tuple(sizes), unit=unit_text)[0])))


def _angles(unknown: list[SizedTerm], signs: list[float]) -> Matrix:
    """Return the matrix in cosines and sines of the directions of what is sought."""
    rows: list[tuple[Part, ...]] = []
    for name in ("cos", "sin"):
        row: list[Part] = []
        for one, sign in zip(unknown, signs, strict=True):
            assert one.line is not None
            angle = rounded(degrees(float(np.arctan2(one.line[1], one.line[0]))), 3)
            cell = Wording(f"{name} {signed(angle)}°")
            row.append(Less(cell) if sign < 0 else cell)
        rows.append(tuple(row))
    return Matrix(tuple(rows))


def _edges(
    subject: Subject, relations: Relations, bodies: tuple[str, ...], joints: list[str]
) -> tuple[dict[str, SizedTerm | None], list[RelationEdge]]:
    """Return the known points, with their vectors where they move, and what leads on."""
    rates, drivers, word = relations.rates, subject.result.drivers, relations.word
    order, mine = subject.order, max(subject.order[body] for body in bodies)
    known: dict[str, SizedTerm | None] = {"": None}

    def meet(spot: Spot) -> None:
        others = {spot.body, *relations.others(spot)}
        if spot.reference not in joints and any(order.get(body, mine) < mine for body in others):
            letter = Letter(relations.symbol, (spot.letter,), vector=True)
            known[spot.letter] = SizedTerm(letter, spot.value)

    edges: list[RelationEdge] = []
    for relation in _relations(relations, bodies, joints):
        meet(relation.start)
        meet(relation.end)
        addends = tuple(_addend(subject, relation, k) for k in range(len(relation.terms)))
        edges.append(RelationEdge(relation.start.letter, relation.end.letter, addends))
    for body in bodies:
        same = [spot.letter for spot in relations.spots if spot.body == body]
        if not relations.rates.turns(body):
            edges += [RelationEdge(same[0], letter, ()) for letter in dict.fromkeys(same[1:])]
    for name in joints:
        joint = subject.scene.mechanism.joints[name]
        if joint.guide and joint.first_body == GROUND and f"{name}.slide" not in drivers:
            axis = _axis(subject, name)
            letter = next((s.letter for s in relations.spots if s.body == joint.second_body), "")
            symbol = Letter(relations.symbol, (letter,), vector=True)
            edges.append(
                RelationEdge("", letter, (SizedTerm(symbol, rates.of(joint.second, word), axis),))
            )
    return known, edges


def _relations(
    relations: Relations, bodies: tuple[str, ...], joints: list[str]
) -> Iterator[Relation]:
    """Yield the relations of a group: of its links, and along what slides on earlier ones."""
    for members in (bodies for _, bodies in relations.groups):
        for body in members:
            for relation in relations.of(body, members):
                if relation.body in (*bodies, *joints):
                    yield relation


def _axis(subject: Subject, joint: str) -> Array:
    """Return the direction of a guide or slot."""
    scene = subject.scene
    return scene.axis(scene.mechanism.joints[joint], subject.pose)


def _addend(subject: Subject, relation: Relation, k: int) -> SizedTerm:
    """Return a term of a relation: what is sought has a line."""
    term = relation.terms[k]
    driven = {f"{relation.body}.angle", f"{relation.body}.slide"} & set(subject.result.drivers)
    if driven or term.kind in ("normal", "coriolis"):
        return SizedTerm(term.letter, term.vector)
    if term.kind == "sliding":
        return SizedTerm(term.letter, term.vector, _axis(subject, relation.body))
    arm = relation.end.position - relation.start.position
    length = float(np.hypot(*arm))
    return SizedTerm(
        term.letter, term.vector, normal(arm) / length, _turning(subject, relation.body), length
    )


def _turning(subject: Subject, body: str) -> str:
    """Return the first of the links that turn as a body does."""
    alike = {body}
    guides = [guide for guide in subject.scene.mechanism.joints.values() if guide.keeps_angle]
    for _ in guides:
        for guide in guides:
            alike |= set(guide.bodies) if alike & set(guide.bodies) else set()
    return min(alike)


def _loops(known: dict[str, SizedTerm | None], edges: list[RelationEdge]) -> Iterator[Sides]:
    """Yield what is equal: two ways to one point, without what both have in common."""
    ways: dict[str, list[SizedTerm]] = {
        letter: [] if first is None else [first] for letter, first in known.items()
    }
    left = list(edges)
    while left:
        edge = next((e for e in left if e.start in ways or e.end in ways), None)
        if edge is None:
            return
        left.remove(edge)
        if edge.start in ways and edge.end in ways:
            one, other = [*ways[edge.start], *edge.addends], ways[edge.end]
            both = {a.letter for a in one} & {a.letter for a in other}
            first, second = ([a for a in way if a.letter not in both] for way in (one, other))
            yield first, second
        elif edge.start in ways:
            ways[edge.end] = [*ways[edge.start], *edge.addends]
        else:
            back = [replace(a, sign=-a.sign) for a in edge.addends]
            ways[edge.start] = [*ways[edge.end], *back]


def _assembled(
    loops: list[Sides], unknown: list[SizedTerm], leads: dict[str | Letter, SizedTerm]
) -> tuple[Array, Array, list[float]]:
    """Return matrix (2 k, n), right side (2 k,), and the sign of each unknown in its first row."""
    matrix, right = np.zeros((2 * len(loops), len(unknown))), np.zeros(2 * len(loops))
    place = {one.letter: k for k, one in enumerate(unknown)}
    signs = [0.0] * len(unknown)
    for j, sides in enumerate(loops):
        rows = slice(2 * j, 2 * j + 2)
        for sign, side in zip((1.0, -1.0), sides, strict=True):
            for one in side:
                if one.line is None:
                    right[rows] -= sign * one.sign * one.vector
                else:
                    lead = leads[one.turning or one.letter]
                    k = place[lead.letter]
                    matrix[rows, k] += sign * one.sign * one.line * one.arm / lead.arm
                    signs[k] = signs[k] or sign * one.sign
    return matrix, right, signs
