"""Positions, velocities and accelerations of one group in space: vector equations with numbers.

Of two points S and E of a link r_E = r_S + r_ES, v_E = v_S + w x r_ES and
a_E = a_S + e x r_ES + w x (w x r_ES); of two links in a pair w_2 = w_1 + q' u about its axis u and
e_2 = e_1 + q'' u + w_1 x q' u; of a point that slides along an axis v_Q = v_P + w_1 x r_QP + s' u
with 2 w_1 x s' u in its acceleration; of a bar the components along it vanish (Wittenburg,
Dynamics of Multibody Systems). Arms and axes are made of orientations and joint coordinates of
the result, the ends they have to meet are points of the result: how far they miss is the gap.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mechdae.draw.formulas import (
    Equation,
    Formula,
    Letter,
    Norm,
    Note,
    Passage,
    Section,
    Sum,
    columns,
    number,
)
from mechdae.parts.paper.explanations.motion import facts_of, motion_section, solved_values
from mechdae.parts.paper.explanations.space.spatial_group import SYMBOL, SpatialGroup, in_numbers
from mechdae.parts.paper.explanations.space.spatial_rates import SpatialRates
from mechdae.parts.paper.explanations.space.spatial_subject import SpatialSubject


def spatial_group_section(subject: SpatialSubject, name: str, bodies: tuple[str, ...]) -> Section:
    """Return what there is to say of the motion of one group."""
    say, group = subject.say, SpatialGroup(subject, bodies)
    sought = ", ".join(f"{_plain(word)} ({joint})" for joint, word in group.sought())
    facts = [*facts_of(subject, bodies), (say("sought"), (sought,))]

    def rates(word: str) -> tuple[Passage, ...]:
        return tuple(SpatialRates(group, word).passages()) or (Note((say("no relation"),)),)

    return motion_section(subject, name, facts, _positions(group), rates)


def _plain(word: str) -> str:
    return "".join(SYMBOL[word])


def _positions(group: SpatialGroup) -> Iterator[Passage]:
    """Yield axes, closures of links and pairs, and the coordinates that were found."""
    subject = group.subject
    for joint in group.joints:
        for letter, axis in dict(group.directions(joint).values()).items():
            gap = abs(float(np.linalg.norm(axis)) - 1.0)
            yield Formula(Equation((letter, *columns(tuple(axis)))), gap)
    for start, end in group.arms:
        yield from _closure(subject, start, end)
        if subject.turn(start.split(".")[0]) is None:
            scene = subject.scene
            span = float(np.linalg.norm(scene.local(end) - scene.local(start)))
            yield _length(subject, start, end, span)
    for joint in group.joints:
        if joint.bar:
            length = subject.scene.numbers[f"{joint.name}.length"]
            yield _length(subject, joint.first, joint.second, length)
        elif group.slid(joint):
            yield from group.between("r", joint.first, joint.second, group.slid(joint), "m")
    yield from solved_values(subject, group.found("position"))


def _closure(subject: SpatialSubject, start: str, end: str) -> Iterator[Passage]:
    """Yield r_E = r_S + r_ES, in letters and in numbers."""
    scene = subject.scene
    one, two = (scene.place(ref, subject.pose) for ref in (start, end))
    names, turn = subject.named_apart(start, end), subject.turn(start.split(".")[0])
    arm = two - one
    if turn is not None:
        arm = turn @ (scene.local(end) - scene.local(start))
    first, second = (Letter("r", (name,), vector=True) for name in names)
    shown = columns(tuple(two), tuple(one), tuple(arm), unit="m")
    terms = (first, Letter("r", names[::-1], vector=True))
    yield Formula(Equation((second, Sum(terms))))
    yield in_numbers(second, terms, shown, float(np.linalg.norm(one + arm - two)), "m")


def _length(subject: SpatialSubject, start: str, end: str, length: float) -> Formula:
    """Return the distance of two points that stays."""
    one, two = (subject.scene.place(ref, subject.pose) for ref in (start, end))
    arm = float(np.linalg.norm(two - one))
    names = subject.named_apart(start, end)
    letter = Norm(Letter("r", names[::-1], vector=True))
    return Formula(Equation((letter, number(length, "m"))), abs(arm - length), "m")
