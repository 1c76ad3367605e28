"""The answers of a variant, task by task; what an earlier task has too stands there alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import degrees

from mechdae.describe import Problem
from mechdae.draw.formulas.tree import Facts, Note, Part, Passage, Section
from mechdae.errors import InputError
from mechdae.parts.paper.assignments.choice import Chosen, RoundRange
from mechdae.parts.paper.explanations.localised import subject_of
from mechdae.parts.paper.explanations.subject import Subject
from mechdae.parts.paper.phrases import Phrases
from mechdae.parts.paper.reports import sections
from mechdae.records import dataclass
from mechdae.results import Result


@dataclass(frozen=True)
class Exercise:
    """A task of all variants: rows of its result that tables have, the one explained, a diagram."""

    name: str
    rows: list[int]
    pose: int
    diagram: str


@dataclass(frozen=True)
class Answers:
    """An exercise of one variant with its answers.

    Structure, positions and forces are empty where an earlier exercise has the same; ``like`` is
    the number of the one with the same positions, from 1.
    """

    exercise: Exercise
    subject: Subject
    structure: tuple[Section, ...]
    positions: tuple[Section, ...]
    forces: tuple[Section, ...]
    explained: tuple[Section, ...]
    like: int | None

    @property
    def sections(self) -> tuple[Section, ...]:
        return (*self.structure, *self.positions, *self.forces, *self.explained)


def answers_of(
    problem: Problem,
    exercises: Sequence[Exercise],
    results: Sequence[Result],
    say: tuple[Phrases, Phrases, Phrases],
) -> list[Answers]:
    """Return the answers to the exercises.

    Raises
    ------
    InputError
        A task that asks for nothing new.
    """
    words, report, explained = say
    found: list[Answers] = []
    motions: list[Section] = []
    before: list[object] = []
    for exercise, result in zip(exercises, results, strict=True):
        rows = exercise.rows
        subject = subject_of(result.in_units(words.units), rows[exercise.pose], explained)
        structure = sections.structure_of(problem, subject, report)
        motion = sections.position_tables(subject, rows, report)
        forces = sections.force_tables(subject, rows, report)
        chosen = rows.index(subject.pose)
        full = sections.in_full(subject.result, subject, chosen, report, words.lang)
        whole = (structure, motion, *forces)
        new = [section for section in whole if section not in before]
        if not new:
            what = f"{exercise.name} asks for nothing that the tasks before it do not ask for"
            raise InputError(what, where="task")
        steps = tuple(step for step in full.sections if step not in before)
        plans = tuple(plan for plan in full.beside if plan not in before)
        found.append(
            Answers(
                exercise,
                subject,
                tuple(section for section in new if section is structure),
                tuple(section for section in new if section is motion),
                tuple(section for section in new if section in whole[2:]),
                (
                    replace(full, sections=steps, beside=plans),
                    sections.checks(subject.result, subject, report),
                ),
                motions.index(motion) + 1 if motion in motions else None,
            )
        )
        motions.append(motion)
        before += [*whole, *full.sections, *full.beside]
    return found


def part_of(
    number: int,
    answers: Answers,
    say: Phrases,
    blocks: Sequence[Passage],
    inner: tuple[Section, ...],
) -> Section:
    """Return the part of a sheet or a key that one of several exercises has."""
    like = [Note((say("like", answers.like),))] * (answers.like is not None)
    return Section(say("part", number, answers.exercise.name), (*blocks, *like), inner)


def key_sections(
    chosen: Chosen, drawn: Sequence[RoundRange], answers: Sequence[Answers], say: Phrases
) -> tuple[Section, ...]:
    """Return the numbers of a variant and the answers to its exercises."""
    facts: list[tuple[str, tuple[str | Part, ...]]] = []
    for one in drawn:
        text = f"{chosen.texts[one.name]} {say.unit(one.unit)}".strip()
        facts.append((one.base, (text.replace("-", "−"),)))
    for joint, angle in chosen.transmission.items():
        facts.append((say("least", joint), (f"{degrees(angle):.2f}°",)))
    numbers = Section(say("answers"), (Facts(tuple(facts)),))
    if len(answers) == 1:
        return (numbers, *answers[0].sections)
    return (numbers, *(part_of(k, one, say, (), one.sections) for k, one in enumerate(answers, 1)))
