"""Positions, velocities and accelerations of one group: vector equations with their numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from math import degrees

import numpy as np

from mechdae.describe import GROUND
from mechdae.draw.formulas.tree import (
    Equation,
    Facts,
    Formula,
    Grid,
    Less,
    Letter,
    Norm,
    Note,
    Number,
    Part,
    Passage,
    Product,
    Quotient,
    Section,
    Sum,
    columns,
    number,
    numbers,
    rounded,
)
from mechdae.draw.plans.relations import Relation, Relations, Term
from mechdae.parts.paper.explanations.placing import found_by
from mechdae.parts.paper.explanations.subject import Subject
from mechdae.parts.paper.explanations.systems import system_of

UNITS = {"velocity": "m/s", "acceleration": "m/s²"}
SPINS = {
    "velocity": ("ω", "rad/s", "angular_velocity"),
    "acceleration": ("ε", "rad/s²", "angular_acceleration"),
}
SLIDES = {"velocity": ("ṡ", "slide_velocity"), "acceleration": ("s̈", "slide_acceleration")}


def group_section(subject: Subject, name: str, bodies: tuple[str, ...]) -> Section:
    """Return what there is to say of the motion of one group."""
    facts, positions = _facts(subject, bodies), _positions(subject, bodies)
    return motion_section(
        subject, name, facts, positions, lambda word: _rates(subject, word, bodies)
    )


def motion_section(
    subject: Subject,
    name: str,
    facts: Iterable[tuple[str, tuple[str, ...]]],
    positions: Iterable[Passage],
    rates: Callable[[str], Iterable[Passage]],
) -> Section:
    """Return the section of a group: facts, positions, velocities and accelerations."""
    say = subject.say
    parts = [Section(say("positions"), tuple(positions))]
    for word, title in (("velocity", "velocities"), ("acceleration", "accelerations")):
        if word in subject.rated:
            parts.append(Section(say(title), tuple(rates(word))))
    head = Facts(tuple((key, texts) for key, texts in facts if any(texts)))
    return Section(say("group", name) if name else say("mechanism"), (head,), tuple(parts))


def facts_of(subject: Subject, bodies: tuple[str, ...]) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield links, joints and what is known."""
    say, mechanism = subject.say, subject.scene.mechanism
    yield say("links"), (", ".join(subject.title(body) for body in bodies),)
    met = set(bodies)
    order = subject.order
    mine = max((order[body] for body in bodies), default=0)
    inside, outer, wheels = [], [], list[str]()
    for joint in mechanism.joints.values():
        ends = {joint.first_body, joint.second_body}
        if not ends & met or any(order.get(body, len(order)) > mine for body in ends):
            continue
        between = (subject.title(body) for body in (joint.first_body, joint.second_body))
        inside.append(say("joint between", joint.name, say.kind(joint.kind), *between))
        if ends - met and joint.wheels:
            wheels += [subject.title(body) for body in sorted(ends - met - {GROUND})]
        elif ends - met:
            reference = joint.first if joint.first_body not in met else joint.second
            letter = subject.letter(reference)
            outer.append(letter if letter == joint.name else f"{letter} ({joint.name})")
    yield say("joints"), ("; ".join(inside),)
    known = [say("places of", ", ".join(dict.fromkeys(outer)))] if outer else []
    known += [say("motion of", ", ".join(dict.fromkeys(wheels)))] if wheels else []
    known += [", ".join(subject.result.drivers)] if mine == 0 else []
    yield say("known"), ("; ".join(filter(None, known)),)


def _facts(subject: Subject, bodies: tuple[str, ...]) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield links, joints, what is known and what is sought."""
    say = subject.say
    yield from facts_of(subject, bodies)
    driven = set(subject.result.drivers)
    sought = [f"φ{subject.numbers[body]}" for body in bodies if f"{body}.angle" not in driven]
    for joint in subject.joints_of(bodies):
        if "slide" in (subject.result.joints.get(joint) or {}):
            sought.append(f"s ({joint})")
    yield say("sought"), (", ".join(sought),)
    yield say("points"), ("; ".join(_under(subject, bodies)),)


def _under(subject: Subject, bodies: tuple[str, ...]) -> Iterator[str]:
    """Yield what is meant by letters of points that lie under sliders."""
    relations = next(iter(subject.relations.values()), None)
    for spot in relations.spots if relations is not None else ():
        if spot.body in bodies and spot.reference in subject.scene.mechanism.joints:
            joint = subject.scene.mechanism.joints[spot.reference]
            letter = spot.letter.replace("_", "")
            under = subject.letter(joint.second)
            yield subject.say("under", letter, subject.title(spot.body), under)


# -- positions ---------------------------------------------------------------------------------


def _positions(subject: Subject, bodies: tuple[str, ...]) -> Iterator[Passage]:
    """Yield the closure of each link, and angles and slides that were found."""
    relations = next(iter(subject.relations.values()), None)
    if relations is not None:
        for body in bodies:
            for relation in relations.of(body, group_of(subject, body)):
                if relation.body in subject.scene.mechanism.bodies:
                    yield from _closure(relation)
    yield from found_by(subject, bodies, subject.joints_of(bodies))
    yield from solved_values(subject, _placed(subject, bodies))


def _closure(relation: Relation) -> Iterator[Formula]:
    """Yield r_B = r_A + r_BA with its numbers."""
    start, end = relation.start, relation.end
    arm = end.position - start.position
    whole, first, second = (
        Letter("r", index, vector=True)
        for index in ((end.letter,), (start.letter,), (end.letter, start.letter))
    )
    shown = columns(*(tuple(v) for v in (end.position, start.position, arm)), unit="m")
    yield Formula(
        Equation((whole, Sum((first, second)), shown[0], Sum(shown[1:]))),
        float(np.hypot(*(start.position + arm - end.position))),
        "m",
    )


def _placed(subject: Subject, bodies: tuple[str, ...]) -> Iterator[tuple[Part, Part]]:
    for body in bodies:
        turn = float(subject.scene.angles[body][subject.pose])
        yield Letter("φ", (str(subject.numbers[body]),)), number(degrees(turn), "°", 8)
    for joint in subject.joints_of(bodies):
        series = subject.result.joints.get(joint) or {}
        if "slide" in series:
            value = subject.value(series, "slide")
            yield Letter("s", (joint,)), number(value, "m", 8)


def solved_values(subject: Subject, rows: Iterator[tuple[Part, Part]]) -> Iterator[Passage]:
    """Yield solved values as equations on one line."""
    found = [Equation(row) for row in rows]
    if found:
        parts: list[str | Part] = [f"{subject.say('solved')} "]
        for k, equation in enumerate(found):
            parts += [", "] if k else []
            parts.append(equation)
        yield Note(tuple(parts))


def group_of(subject: Subject, body: str) -> tuple[str, ...]:
    return next(members for _, members in subject.groups if body in members)


# -- rates -------------------------------------------------------------------------------------


def _rates(subject: Subject, word: str, bodies: tuple[str, ...]) -> Iterator[Passage]:
    relations = subject.relations[word]
    any_found = False
    for body in bodies:
        for relation in relations.of(body, group_of(subject, body)):
            any_found = True
            yield from _relation(subject, relations, relation, word)
    for joint in subject.joints_of(bodies):
        for formula in _meshed(subject, joint, word):
            any_found = True
            yield formula
    if not any_found:
        yield Note((subject.say("no relation"),))
    yield from system_of(subject, word, bodies, subject.joints_of(bodies), UNITS[word])
    yield from solved_values(subject, _rated(subject, word, bodies))


def _relation(
    subject: Subject, relations: Relations, relation: Relation, word: str
) -> Iterator[Passage]:
    """Yield one equation in letters, with numbers, its vectors, and the rate that follows."""
    yield Formula(relation.equation)
    terms = relation.moving
    if not terms:
        return
    ends = [tuple(relation.end.value), *(tuple(term.vector) for term in terms)]
    shown = columns(*ends, unit=UNITS[word])
    yield Formula(Equation((shown[0], Sum(shown[1:]))), relation.gap, UNITS[word])
    yield _vectors(subject, relation, word)
    yield from _follows(subject, relations, relation, word)


def _meshed(subject: Subject, name: str, word: str) -> Iterator[Formula]:
    """Yield the equation of Willis of two wheels: w_13 = i w_23, relative to the carrier 3."""
    joint = subject.scene.mechanism.joints[name]
    if joint.wheels < 2:
        return
    symbol, unit, _ = SPINS[word]
    relations = subject.relations[word]
    order = list(SPINS).index(word)
    carrier = getattr(joint, "carrier", None) or GROUND
    first, second, base = (
        float(relations.rates.spins[body][order])
        for body in (joint.first_body, joint.second_body, carrier)
    )
    if not (first or second or base):
        return
    ratio = joint.turn_ratio(subject.scene.numbers)
    marks = [str(subject.numbers[body]) for body in (joint.first_body, joint.second_body)]
    index = [
        (mark,) if carrier == GROUND else (f"{mark},{subject.numbers[carrier]}",) for mark in marks
    ]
    letters = [Letter(symbol, mark) for mark in index]
    if carrier != GROUND:
        for letter, mark, spin in zip(letters, marks, (first, second), strict=True):
            whole, shown = numbers(spin, -base, unit=unit), number(spin - base, unit)
            other = Letter(symbol, (str(subject.numbers[carrier]),))
            parts = Sum((Letter(symbol, (mark,)), Less(other)))
            yield Formula(Equation((letter, parts, Sum(whole), shown)))
    value = Product((number(ratio), number(second - base, of=unit)))
    yield Formula(
        Equation(
            (letters[0], Product((Letter("i"), letters[1])), value, number(first - base, unit))
        ),
        abs(first - base - ratio * (second - base)),
        unit,
    )


def _vectors(subject: Subject, relation: Relation, word: str) -> Grid:
    """Return size, direction and line of action of each vector of an equation."""
    say = subject.say
    end = Term("total", relation.left, relation.end.value)
    rows: list[tuple[str | Part, ...]] = []
    parts = columns(*(tuple(term.vector) for term in (*relation.moving, end)), unit=UNITS[word])
    for term, shown in zip((*relation.moving, end), parts, strict=True):
        size = float(np.hypot(*term.vector))
        angle = degrees(float(np.arctan2(term.vector[1], term.vector[0])))
        rows.append(
            (
                term.letter,
                number(size, UNITS[word]),
                Number(rounded(angle, 3), 0, "°"),
                *shown.components,
                _line(subject, relation, term),
            )
        )
    heads = (say("term"), say("size"), say("angle"), "x", "y", say("line"))
    return Grid(heads, tuple(rows))


def _line(subject: Subject, relation: Relation, term: Term) -> str:
    say = subject.say
    arm = f"{relation.end.letter}{relation.start.letter}".replace("_", "")
    match term.kind:
        case "relative" | "tangential":
            return say("across", arm)
        case "normal":
            start = relation.start.letter.replace("_", "")
            return say("from to", relation.end.letter.replace("_", ""), start)
        case "sliding":
            return say("along", relation.body)
        case "coriolis":
            return say("turned", say("along", relation.body))
    return say("given" if term.letter != relation.left else "sum")


def _follows(
    subject: Subject, relations: Relations, relation: Relation, word: str
) -> Iterator[Formula]:
    """Yield how sizes of vectors and angular rates follow from each other."""
    terms = {term.kind: term for term in relation.moving}
    if relation.body not in subject.scene.mechanism.bodies:
        if "coriolis" in terms:
            yield _coriolis(subject, relations, relation, terms["coriolis"])
        return
    start, end = relation.start, relation.end
    length = float(np.hypot(*(end.position - start.position)))
    arm = Letter("r", (end.letter, start.letter), vector=True)
    if "normal" in terms:
        term, spin = terms["normal"], abs(relations.rates.spins[relation.body][0])
        shown = Product((number(spin), number(spin), number(length, of="m")))
        letter = Letter("ω", (str(subject.numbers[relation.body]),))
        value = number(float(np.hypot(*term.vector)), UNITS[word])
        square = Product((letter, letter, Norm(arm)))
        yield Formula(Equation((Norm(term.letter), square, shown, value)))
    kind = {"velocity": "relative", "acceleration": "tangential"}[word]
    if kind not in terms:
        return
    symbol, unit, _ = SPINS[word]
    term = terms[kind]
    size = float(np.hypot(*term.vector))
    spin_letter = Norm(Letter(symbol, (str(subject.numbers[relation.body]),)))
    if f"{relation.body}.angle" in subject.result.drivers:
        sides: tuple[Part, ...] = (
            Norm(term.letter),
            Product((spin_letter, Norm(arm))),
            Product((number(size / length), number(length, of="m"))),
            number(size, UNITS[word]),
        )
    else:
        sides = (
            spin_letter,
            Quotient(Norm(term.letter), Norm(arm)),
            Quotient(number(size, of=UNITS[word]), number(length, of="m")),
            number(size / length, unit),
        )
    yield Formula(Equation(sides))


def _coriolis(subject: Subject, relations: Relations, relation: Relation, term: Term) -> Formula:
    """Return |a^k| = 2 |omega| |v^r| with its numbers."""
    joint = subject.scene.mechanism.joints[relation.body]
    spin = abs(relations.rates.spins[joint.first_body][0])
    size = float(np.hypot(*term.vector))
    names = (relation.end.letter, relation.start.letter)
    sliding = Letter("v", names, "r", vector=True)
    letter = Letter("ω", (str(subject.numbers.get(joint.first_body, 0)),))
    return Formula(
        Equation(
            (
                Norm(term.letter),
                Product((Number("2"), Norm(letter), Norm(sliding))),
                Product((Number("2"), number(spin), number(size / (2 * spin), of="m/s"))),
                number(size, UNITS["acceleration"]),
            )
        )
    )


def _rated(subject: Subject, word: str, bodies: tuple[str, ...]) -> Iterator[tuple[Part, Part]]:
    symbol, unit, key = SPINS[word]
    for body in bodies:
        series = subject.result.bodies.get(body) or {}
        value = subject.value(series, key)
        if np.isfinite(value):
            yield Letter(symbol, (str(subject.numbers[body]),)), number(value, unit, 8)
    letter, key = SLIDES[word]
    for joint in subject.joints_of(bodies):
        value = subject.value(subject.result.joints.get(joint) or {}, key)
        if np.isfinite(value):
            yield Letter(letter, (joint,)), number(value, UNITS[word], 8)
