"""Sections of a report: assignment, structure, a position in full, tables of all, checks."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mechdae.describe import Problem
from mechdae.draw.formulas import Facts, Grid, Note, Part, Passage, Section, number
from mechdae.draw.words import Words
from mechdae.parts.paper.explanations.explain import explain
from mechdae.parts.paper.explanations.subject import Subject
from mechdae.parts.paper.phrases import Phrases
from mechdae.parts.paper.reports import tables
from mechdae.results import Result
from mechdae.tasks.show import structure


def assignment(problem: Problem, result: Result, say: Phrases) -> Section:
    """Return source, task and the numbers of the file."""
    rows: list[tuple[str, tuple[str | Part, ...]]] = []
    if problem.source:
        rows.append((say("source"), (problem.source,)))
    rows.append((say("task"), (f"{problem.name}, {result.task}",)))
    blocks: list[Passage] = [Facts(tuple(rows))]
    table = tables.parameters(problem, say)
    return Section(say("assignment"), (*blocks, table) if table.rows else tuple(blocks))


def structure_of(problem: Problem, subject: Subject, say: Phrases) -> Section:
    """Return mobility by count and by rank, and the Assur groups."""
    found = structure(problem)
    count = found["mobility"]
    rows: list[tuple[str, tuple[str | Part, ...]]] = [(say("moving links"), (str(count["n"]),))]
    if problem.mechanism.dimension == 3:
        classes = [f"p{k} = {count[f'p{k}']}" for k in range(5, 0, -1) if count.get(f"p{k}")]
        rows.append((say("pairs by class"), (", ".join(classes),)))
        if count.get("idle"):
            rows.append((say("spins freely"), (", ".join(count["idle"]),)))
    elif "p5" in count:
        rows.append((say("lower pairs"), (str(count["p5"]),)))
        rows.append((say("higher pairs"), (str(count["p4"]),)))
    text, rank = say("by count", count["W"]), count["rank"]
    text += say("by rank", rank["mobility"]) if rank else ""
    rows.append((say("mobility"), (text,)))
    if rank and rank["superfluous"]:
        rows.append((say("superfluous"), (", ".join(rank["superfluous"]),)))
    formula = subject.result.summary.get("formula")
    rows += [(say("formula"), (formula,))] if formula else []
    blocks: list[Passage] = [Facts(tuple(rows))]
    drivers = list(subject.result.drivers)
    groups = [one.get("groups") for one in found["formulas"] if one["drivers"] == drivers]
    if groups and groups[0]:
        heads = (say("group"), say("class"), say("links"), say("joints"))
        lines = [
            (
                group["name"],
                f"{group['class']}, {group['order']}" if group["class"] else "–",
                ", ".join(group["bodies"]),
                ", ".join(group["joints"]),
            )
            for group in groups[0]
        ]
        blocks.append(Grid(heads, tuple(lines)))
    return Section(say("structure"), tuple(blocks))


def in_full(result: Result, subject: Subject, chosen: int, say: Phrases, lang: str) -> Section:
    explained = explain(result, pose=subject.pose, lang=lang).document
    return Section(say("one position", chosen), (), explained.sections)


def position_tables(subject: Subject, rows: list[int], say: Phrases) -> Section:
    first, head = [str(k) for k in range(len(rows))], say("position")
    lead = tables.driver_columns(subject, rows)
    columns = [*lead, *tables.position_columns(subject, rows)]
    parts = [Section(say("positions"), tuple(tables.grids(first, head, columns)))]
    for order, word in ((1, "velocities"), (2, "accelerations")):
        columns = tables.rate_columns(subject, rows, order)
        points = tables.point_columns(subject, rows, order)
        if columns or points:
            listed = (*tables.grids(first, head, columns), *tables.grids(first, head, points))
            parts.append(Section(say(word), listed))
    note = Note((say("about analogues", ", ".join(subject.result.drivers)),))
    for order, word in ((1, "analogues"), (2, "second analogues")):
        columns = tables.analogue_columns(subject, rows, order)
        if columns:
            blocks = (note, *tables.grids(first, head, columns))
            parts.append(Section(say(word), blocks if order == 1 else blocks[1:]))
    return Section(say("positions"), (), tuple(parts))


def force_tables(subject: Subject, rows: list[int], say: Phrases) -> Iterator[Section]:
    columns = tables.force_columns(subject, rows)
    if not columns:
        return
    first, head = [str(k) for k in range(len(rows))], say("position")
    lead = tables.driver_columns(subject, rows)
    blocks: list[Passage] = [Note((say("about forces"),))]
    blocks += tables.grids(first, head, [*lead, *columns])
    summary = subject.result.summary
    found = [
        (say(word), (number(float(summary[word])),))
        for word in ("efficiency", "useful", "loss", "input")
        if isinstance(summary.get(word), float | int)
    ]
    inner = (Section(say("cycle"), (Facts(tuple(found)),)),) if found else ()
    yield Section(say("forces"), tuple(blocks), inner)


def checks(result: Result, subject: Subject, say: Phrases) -> Section:
    rows: list[tuple[str, tuple[str | Part, ...]]] = []
    counts, words = result.summary.get("status") or {}, Words(say.lang)
    rows.append(
        (say("status"), (", ".join(f"{words.status(word)} {n}" for word, n in counts.items()),))
    )
    for word, unit in (("length", "m"), ("angle", "rad")):
        if word in result.bound:
            bound = np.asarray(result.bound[word], dtype=float)
            largest = float(np.nanmax(bound, initial=0.0, where=np.isfinite(bound)))
            rows.append((f"{say('largest bound')}, {say.unit(unit)}", (f"{largest:.1e}",)))
    for word, value in (getattr(result, "checks", None) or {}).items():
        if value is not None:
            rows.append((say(f"check {word}"), (f"{float(value):.1e}",)))
    for word in ("assumptions", "notes"):
        entries = result.summary.get(word)
        if entries:
            rows.append((say(word), ("; ".join(str(text) for text in entries),)))
    return Section(say("checks"), (Facts(tuple(rows)),))
