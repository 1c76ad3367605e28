"""The sheet of a variant: what is given and to be found, with empty tables and no answers."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any

from mechdae.describe import GROUND, Driver, Mechanism, Problem
from mechdae.describe.coordinates import coordinate_unit
from mechdae.describe.expression import evaluate
from mechdae.describe.file.writing import given
from mechdae.describe.loads import Force, Load, Resistance, Spring, TableLoad, Torque
from mechdae.describe.tasks.motion import Reactions
from mechdae.describe.values import Value
from mechdae.draw.formulas.tree import Facts, Grid, Image, Note, Passage, Section
from mechdae.parts.paper.amounts import Given, amount, given_text, shown
from mechdae.parts.paper.assignments.answers import Answers, part_of
from mechdae.parts.paper.assignments.choice import Chosen, RoundRange
from mechdae.parts.paper.explanations.subject import Subject
from mechdae.parts.paper.phrases import Phrases
from mechdae.parts.paper.reports import sections

BLANK = "\N{EM SPACE}" * 4
"""A cell to write into."""


def facts(value: Value, skip: tuple[str, ...], say: Phrases) -> str:
    """Return what a link or a joint is given with, each number by its word and in its unit."""
    known: dict[str, Mapping[str, Any]] = {entry.name: entry.metadata for entry in fields(value)}
    found = given(value, skip=skip)
    found.pop("kind", None)
    if getattr(value, "straight", False):  # a guide has a direction, also that which is usual
        found = {"axis": getattr(value, "axis", 0.0)} | found
    parts = []
    for key, content in found.items():
        about = known.get(key, {})
        said = (
            say.kind(content) if about.get("choices") else amount(content, about.get("unit"), say)
        )
        name = say.kind(key).replace("_", " ")
        parts.append(name if content is True else f"{name} = {said}")
    return ", ".join(parts)


def load_text(mechanism: Mechanism, load: Load, say: Phrases) -> str:
    """Return a load in words: where it acts, in which direction, how large it is."""
    return ", ".join(_load_parts(mechanism, load, say))


def _load_parts(mechanism: Mechanism, load: Load, say: Phrases) -> Iterator[str]:
    if isinstance(load, Force | Torque):
        if isinstance(load, Force):
            yield say("force at", load.point)
        else:
            yield say("torque on", load.body)
        unit = "N" if isinstance(load, Force) else "N m"
        values = load.value if isinstance(load.value, tuple) else (load.value,)
        letter = "F" if isinstance(load, Force) else "M"
        for axis, value in zip(mechanism.axes if len(values) > 1 else [""], values, strict=False):
            yield f"{letter}{axis} = {amount(value, unit, say)}"
        if load.frame != "world":
            yield say("axes of", load.frame)
    elif isinstance(load, Resistance):
        unit = "N m" if coordinate_unit(mechanism, load.coordinate) == "rad" else "N"
        for word, value in (("grows", load.positive), ("falls", load.negative)):
            if value != 0.0:
                yield say(f"against {word}", load.coordinate, amount(value, unit, say))
    elif isinstance(load, Spring):
        yield from _spring(mechanism, load, say)
    else:
        coordinate = getattr(load, "coordinate", "")
        yield say("by table", coordinate, load.file or "") if isinstance(load, TableLoad) else ""


def _spring(mechanism: Mechanism, load: Spring, say: Phrases) -> Iterator[str]:
    of = load.coordinate or " - ".join(load.between or ())
    yield say("spring", of)
    turns = bool(load.coordinate) and coordinate_unit(mechanism, str(load.coordinate)) == "rad"
    force, length = ("N m", "rad") if turns else ("N", "m")
    units = {"stiffness": f"{force}/{length}", "damping": f"{force} s/{length}", "preload": force}
    for key, value in given(load, skip=("name", "between", "coordinate")).items():
        if key != "kind":
            yield f"{say.kind(key)} = {amount(value, units.get(key, length), say)}"


def sheet_sections(
    problem: Problem,
    chosen: Chosen,
    drawn: tuple[RoundRange, ...],
    answers: Sequence[Answers],
    say: tuple[Phrases, Phrases, Phrases],
) -> tuple[Section, ...]:
    """Return what is given and the questions, of several exercises one after the other.

    What they share stands once: numbers, names of links, and the diagram where it is the same.
    """
    words, report, explained = say
    count = itertools.count(1)
    drivers = [_driver(one.subject, words) for one in answers]
    images = [Image(one.exercise.diagram, words("caption"), 0.62) for one in answers]
    numbers = [(one.base, chosen.texts[one.name], one.unit) for one in drawn]
    shared: list[Passage] = [sections.parameters(problem, report, numbers)]
    shared += drivers[:1] * _alike(drivers)
    head = [Section(words("given"), tuple(shared))]
    head += [Section(words("diagram"), (images[0],))] * _alike(images)
    names = tuple(_parts(problem, answers[0].subject, words, explained))
    head.append(Section(words("parts"), names))
    parts: list[Section] = []
    for k, one in enumerate(answers):
        asked = (
            Section(words("to do"), tuple(_wanted(one, count, words))),
            Section(words("fill in"), (), tuple(_empty(one))),
        )
        further = [some[k] for some in (drivers, images) if not _alike(some)]
        parts += asked if len(answers) == 1 else [part_of(k + 1, one, words, further, asked)]
    return (*head, *parts)


def _alike(passages: Sequence[Passage]) -> bool:
    return all(passage == passages[0] for passage in passages)


def _driver(subject: Subject, say: Phrases) -> Facts:
    values, task = subject.scene.mechanism.values(), subject.result.definition
    texts = [_driven(subject, driver, values, say) for driver in task.all_drivers]
    if isinstance(task, Reactions) and task.quasi_static:
        texts.append(say("quasi-static"))
    return Facts(((say("driver"), ("; ".join(texts),)),))


def _driven(subject: Subject, driver: Driver, values: Mapping[str, float], say: Phrases) -> str:
    name = driver.coordinate
    angle = subject.result.unit("drivers", name, "position") == "rad"

    def given(number: float | str) -> str:
        return amount(evaluate(number, values), "rad" if angle else "m", say)

    rate = amount(evaluate(driver.usual_speed, values), "rad/s" if angle else "m/s", say)
    if driver.from_ is not None and driver.to is not None and driver.law is None:
        return say("from to", name, given(driver.from_), given(driver.to), rate)
    if driver.at is not None:
        return say("at", name, len(driver.at), rate)
    return f"{name}: {say('several')}"


def _parts(problem: Problem, subject: Subject, say: Phrases, words: Phrases) -> Iterator[Passage]:
    """Yield the tables of links, joints and loads, with the names of their numbers."""
    mechanism = problem.mechanism
    yield Note((say("frames"),))
    rows: list[tuple[str, ...]] = [(say("ground"), _points(mechanism.ground.points, say), "")]
    for name, body in mechanism.bodies.items():
        further = facts(body, ("name", "points", "number", "outline"), say)
        rows.append((subject.title(name), _points(body.points, say), further))
    heads = say("points", say.unit(say.units.of("m").name))
    yield _table((say("link"), heads, say("further")), rows)
    rows = []
    for name, joint in mechanism.joints.items():
        ends = " - ".join(
            say("ground") if end == GROUND else subject.title(end)
            for end in (joint.first_body, joint.second_body)
        )
        further = facts(joint, ("name", "first", "second"), say)
        rows.append((name, words.kind(joint.kind), ends, further))
    yield _table((say("joint"), "", say("between"), say("further")), rows)
    rows = [(name, load_text(mechanism, load, say)) for name, load in mechanism.loads.items()]
    if mechanism.gravity is not None:
        rows.append((say("gravity"), f"{given_text(mechanism.gravity)} {say.unit('m/s²')}"))
    if rows:
        yield _table((say("load"), ""), rows)


def _table(heads: tuple[str, ...], rows: list[tuple[str, ...]]) -> Grid:
    """Return a table without columns that have nothing in them."""
    full = [k for k in range(len(heads)) if any(row[k] for row in rows)]
    kept = tuple(tuple(row[k] for k in full) for row in rows)
    return Grid(tuple(heads[k] for k in full), kept)


def _points(points: Mapping[str, Given], say: Phrases) -> str:
    places = {name: shown(place, "m", say.units)[0] for name, place in points.items()}
    return ", ".join(f"{name} {given_text(place)}" for name, place in places.items())


def _wanted(answers: Answers, count: Iterator[int], say: Phrases) -> Iterator[Note]:
    """Yield the questions, numbered."""
    subject, rows = answers.subject, answers.exercise.rows
    asked = [say("structure")] * bool(answers.structure)
    if answers.positions:
        asked.append(say("positions", len(rows)))
        if subject.rated:
            plane = subject.result.mechanism.dimension == 2
            asked.append(say("rates" if plane else "rates alone", rows.index(subject.pose)))
    if answers.forces:
        rubs = any(
            getattr(joint, "friction", None) or getattr(joint, "mesh_loss", None)
            for joint in subject.result.mechanism.joints.values()
        )
        counted = getattr(subject.result.definition, "friction", "none") != "none"
        kind = "rubbing " if rubs and counted else "smooth " * rubs
        asked.append(say(f"{kind}forces"))
        asked += [say("cycle")] * ("efficiency" in subject.result.summary)
    yield from (Note((f"{next(count)}. {question}",)) for question in asked)


def _empty(answers: Answers) -> Iterator[Section]:
    """Yield the tables of the answers, empty but for positions and drivers."""
    keep = 1 + len(answers.subject.result.drivers)
    for k, part in enumerate(inner for whole in answers.positions for inner in whole.sections):
        yield _emptied(part, keep if k == 0 else 1)
    for part in answers.forces:
        yield _emptied(replace(part, sections=()), keep)


def _emptied(part: Section, keep: int) -> Section:
    """Return a section whose tables have the first columns of the first one alone."""
    blocks: list[Passage] = []
    for block in part.blocks:
        if isinstance(block, Grid):
            rows = tuple((*row[:keep], *[BLANK] * (len(row) - keep)) for row in block.rows)
            blocks.append(replace(block, rows=rows))
            keep = 1
        else:
            blocks.append(block)
    return replace(part, blocks=tuple(blocks))
