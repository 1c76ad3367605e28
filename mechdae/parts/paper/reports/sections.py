"""Sections of a report: assignment, structure, a position in full, tables of all, checks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np

from mechdae.describe import GROUND, Problem, coordinate
from mechdae.describe.dimensions import parameter_units
from mechdae.describe.units import ShownUnit
from mechdae.draw.formulas.notations import plain
from mechdae.draw.formulas.tree import (
    Facts,
    Grid,
    Letter,
    Listed,
    Note,
    Part,
    Passage,
    Section,
    UnitName,
    like,
    number,
)
from mechdae.draw.words import Words
from mechdae.parts.paper.amounts import given_text, shown, signed
from mechdae.parts.paper.explanations.explain import explain, pictures
from mechdae.parts.paper.explanations.subject import Subject
from mechdae.parts.paper.phrases import Phrases
from mechdae.records import dataclass
from mechdae.results import Result
from mechdae.tasks.show import structure
from mechdae.types import Floats

DOTS = ("\N{COMBINING DOT ABOVE}", "\N{COMBINING DIAERESIS}")
ROUNDING = 1e-11
"""Share of the largest component of a vector below which another one is 0."""
WIDEST, BETWEEN = 115.0, 1.8
"""Width of the columns of numbers that a page holds, and room between them [figures]."""


@dataclass(frozen=True)
class TableColumn:
    """A column of a table: its symbol, unit, and values at the positions (n,)."""

    letter: Letter
    unit: str
    values: Floats


def parameters(problem: Problem, say: Phrases, drawn: Sequence[tuple[str, str, str]] = ()) -> Grid:
    """Return the numbers that the file gives names to, after those `drawn`.

    `drawn`: their names, digits, and units where they are not those of the others.
    """
    values = problem.mechanism.values()
    units = parameter_units(problem.mechanism, problem.tasks.values())
    found = {name: (digits, unit) for name, digits, unit in drawn}
    for name in problem.mechanism.parameters:
        value, unit = shown(values[name], units.get(name, ""), say.units)
        digits, drawn_unit = found.get(name, (given_text(value), ""))
        found[name] = digits, drawn_unit or ("" if unit == "1" else unit)
    rows = tuple((name, signed(digits), say.unit(unit)) for name, (digits, unit) in found.items())
    return Grid((say("parameter"), say("value"), say("unit")), rows)


def side_by_side(columns: Sequence[TableColumn]) -> Iterator[Sequence[TableColumn]]:
    """Yield as many columns at a time as a page is wide."""
    first, wide = 0, 0.0
    for k, column in enumerate(columns):
        wide += width(column)
        if wide > WIDEST and k > first:
            yield columns[first:k]
            first, wide = k, width(column)
    if first < len(columns):
        yield columns[first:]


def width(column: TableColumn) -> float:
    """Return how wide a column is, in figures."""
    cells = (_head(column), *_cells(column))
    return max(len(cell if isinstance(cell, str) else plain(cell)) for cell in cells) + BETWEEN


def grids(first: Sequence[str], head: str, columns: Sequence[TableColumn]) -> Iterator[Grid]:
    """Yield tables of quantities as wide as a page, all numbers of a column alike."""
    for chosen in side_by_side(columns):
        cells = [_cells(column) for column in chosen]
        rows = tuple(
            (name, *row) for name, row in zip(first, zip(*cells, strict=True), strict=True)
        )
        yield Grid((head, *map(_head, chosen)), rows)


def _cells(column: TableColumn) -> list[str | Part]:
    values = [float(value) for value in column.values]
    alike = tuple(value for value in values if np.isfinite(value))
    return [like(v, alike, column.unit) if np.isfinite(v) else "–" for v in values]


def _head(column: TableColumn) -> Part:
    return Listed((column.letter, UnitName(column.unit))) if column.unit else column.letter


# -- what is in them ---------------------------------------------------------------------------


def driver_columns(subject: Subject, rows: Sequence[int]) -> list[TableColumn]:
    """Return the drivers' values, angles in degrees."""
    found = []
    for text, driver in subject.result.drivers.items():
        values = np.asarray(driver.position, dtype=float)[list(rows)]
        angle = subject.result.unit("drivers", text, "position") == "rad"
        name, _, rest = text.partition(".")
        symbol, index = _symbol(subject, angle, rest), _index(subject, name, rest)
        values, unit = (np.rad2deg(values), "°") if angle else (values, "m")
        found.append(TableColumn(Letter(symbol, (index,)), unit, values))
    return found


def _index(subject: Subject, name: str, rest: str) -> str:
    if name in subject.scene.mechanism.bodies and rest == "angle":
        return str(subject.numbers[name])
    return name


def position_columns(subject: Subject, rows: Sequence[int]) -> list[TableColumn]:
    """Return angles of the links that turn and slides, the drivers left out."""
    found = []
    for letter, angle, series in _moving(subject):
        values = np.asarray(series[0], dtype=float)[list(rows)]
        values, unit = (np.rad2deg(values), "°") if angle else (values, "m")
        found.append(TableColumn(letter, unit, values))
    return found


def rate_columns(subject: Subject, rows: Sequence[int], order: int) -> list[TableColumn]:
    """Return angular and sliding rates of order 1 or 2."""
    units = {True: ("rad/s", "rad/s²"), False: ("m/s", "m/s²")}
    return [
        TableColumn(
            _rate_of(letter, order),
            units[angle][order - 1],
            np.asarray(series[order], dtype=float)[list(rows)],
        )
        for letter, angle, series in _moving(subject, order)
    ]


def point_columns(subject: Subject, rows: Sequence[int], order: int) -> list[TableColumn]:
    """Return the components of velocities (order 1) or accelerations of the points that move.

    Points on one pin are one; components that are 0 in all poses but for rounding are left out.
    """
    word, mark, unit = (("velocity", "v", "m/s"), ("acceleration", "a", "m/s²"))[order - 1]
    found: dict[str, list[TableColumn]] = {}
    for reference, letter in subject.letters.items():
        series = subject.result.points.get(reference, {}).get(word)
        if series is None or reference.split(".")[0] == GROUND or letter in found:
            continue
        sizes = np.nanmax(np.abs(series), axis=0, initial=0.0)
        moves = sizes > ROUNDING * sizes.max()
        found[letter] = [
            TableColumn(Letter(mark, (letter, axis)), unit, np.asarray(values)[list(rows)])
            for axis, values, moving in zip(
                subject.scene.mechanism.axes, np.asarray(series).T, moves, strict=True
            )
            if moving
        ]
    return list(chain.from_iterable(found.values()))


def analogue_columns(subject: Subject, rows: Sequence[int], order: int) -> list[TableColumn]:
    """Return derivatives by the one driver: q' = v/w and q'' = (a - q' e)/w^2.

    Nothing where there are several drivers or one stands still in a position.
    """
    drivers = list(subject.result.drivers.values())
    if len(drivers) != 1 or "velocity" not in drivers[0]:
        return []
    speed = np.asarray(drivers[0].velocity, dtype=float)[list(rows)]
    gain = np.asarray(drivers[0].acceleration, dtype=float)[list(rows)] if order == 2 else 0.0
    if not np.all(np.abs(speed) > 0):
        return []
    lead = subject.result.unit("drivers", next(iter(subject.result.drivers)), "position")
    found = []
    for letter, angle, series in _moving(subject, order):
        first = np.asarray(series[1], dtype=float)[list(rows)] / speed
        values = first
        if order == 2:
            values = (np.asarray(series[2], dtype=float)[list(rows)] - first * gain) / speed**2
        mark = "′" * order
        unit = _analogue_unit(angle, lead, order)
        found.append(TableColumn(replace(letter, mark=mark), unit, values))
    return found


def _analogue_unit(angle: bool, lead: str, order: int) -> str:
    if lead == "rad":
        return "" if angle else "m"
    if angle:
        return "1/m" if order == 1 else "1/m²"
    return "" if order == 1 else "1/m"


def force_columns(subject: Subject, rows: Sequence[int]) -> list[TableColumn]:
    """Return the efforts of the drivers and the sizes of the reactions."""
    result = subject.result
    found = []
    for text, effort in getattr(result, "efforts", {}).items():
        unit = result.path_unit(f"efforts/{text}")
        name, _, rest = text.partition(".")
        letter = Letter("M" if unit == "N m" else "F", (_index(subject, name, rest),))
        found.append(TableColumn(letter, unit, np.asarray(effort, dtype=float)[list(rows)]))
    for name, series in result.joints.items():
        if "reaction" in series:
            wrench = np.asarray(series["reaction"], dtype=float)[list(rows)]
            axes = result.mechanism.dimension
            size = np.linalg.norm(wrench[:, :axes], axis=1)
            if np.isfinite(size).any():
                found.append(TableColumn(Letter("R", (name,)), "N", size))
            if axes == 3 and np.isfinite(wrench).all(axis=1).any():
                moment = np.linalg.norm(wrench[:, axes:], axis=1)
                found.append(TableColumn(Letter("M", (name,)), "N m", moment))
    return found


def _symbol(subject: Subject, angle: bool, word: str) -> str:
    """Return the symbol of a coordinate: of links in the plane, of joints in space."""
    if subject.result.mechanism.dimension == 3:
        from mechdae.parts.paper.explanations.space.spatial_group import SYMBOL

        return SYMBOL[word][0] if word in SYMBOL else word
    return "φ" if angle else "s"


def _rate_of(letter: Letter, order: int) -> Letter:
    """Return the symbol of the rate of a coordinate: ω and ε of a link's angle, else dots."""
    if letter.text == "φ":
        return replace(letter, text=("ω", "ε")[order - 1])
    return replace(letter, text=letter.text + DOTS[order - 1])


def _moving(subject: Subject, order: int = 0) -> Iterator[tuple[Letter, bool, list[Floats]]]:
    """Yield symbol, whether it is an angle, and series up to an order of what moves."""
    result, mechanism = subject.result, subject.scene.mechanism
    if mechanism.dimension == 3:
        yield from _coordinates(subject, order)
        return
    for body, series in result.bodies.items():
        names = ("angle", "angular_velocity", "angular_acceleration")[: order + 1]
        if f"{body}.angle" in result.drivers or any(name not in series for name in names):
            continue
        turn = np.asarray(series["angle"], dtype=float)
        if np.nanmax(turn) - np.nanmin(turn) > 1e-12:
            letter = Letter("φ", (str(subject.numbers[body]),))
            yield letter, True, [series[name] for name in names]
    for name, series in result.joints.items():
        names = ("slide", "slide_velocity", "slide_acceleration")[: order + 1]
        if f"{name}.slide" in result.drivers or any(name not in series for name in names):
            continue
        travel = np.asarray(series["slide"], dtype=float)
        if np.nanmax(travel) - np.nanmin(travel) > 1e-12 * mechanism.scale:
            yield Letter("s", (name,)), False, [series[name] for name in names]


def _coordinates(subject: Subject, order: int) -> Iterator[tuple[Letter, bool, list[Any]]]:
    """Yield the same of the coordinates of spatial joints, which the links move by."""
    from mechdae.parts.paper.explanations.space.spatial_group import coordinate_letter

    mechanism = subject.scene.mechanism
    for name, series in subject.result.joints.items():
        joint = mechanism.joints[name]
        for word in joint.coordinates:
            names = (word, f"{word}_velocity", f"{word}_acceleration")[: order + 1]
            if f"{name}.{word}" in subject.result.drivers or any(n not in series for n in names):
                continue
            angle = coordinate(mechanism, f"{name}.{word}").is_angle
            values = np.asarray(series[word], dtype=float)
            span = np.nanmax(values, initial=-np.inf) - np.nanmin(values, initial=np.inf)
            if span > 1e-12 * (1.0 if angle else mechanism.scale):
                yield coordinate_letter(name, word), angle, [series[name] for name in names]


def assignment(problem: Problem, result: Result, say: Phrases) -> Section:
    """Return source, task and the numbers of the file."""
    rows: list[tuple[str, tuple[str | Part, ...]]] = []
    if problem.source:
        rows.append((say("source"), (problem.source,)))
    rows.append((say("task"), (f"{problem.name}, {result.task}",)))
    blocks: list[Passage] = [Facts(tuple(rows))]
    table = parameters(problem, say)
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
    """Return the explanation of a position, its plans beside it."""
    explained = explain(result, pose=subject.pose, lang=lang).document
    plans = pictures(subject, subject.say, diagram=False)
    return Section(say("one position", chosen), (), explained.sections, plans)


def position_tables(subject: Subject, rows: list[int], say: Phrases) -> Section:
    """Return tables of positions and their rates; those that fit beside each other are one."""
    first, head = [str(k) for k in range(len(rows))], say("position")
    lead = driver_columns(subject, rows)
    wanted = [("positions", [*lead, *position_columns(subject, rows)])]
    for order, word in ((1, "velocities"), (2, "accelerations")):
        columns = [*rate_columns(subject, rows, order), *point_columns(subject, rows, order)]
        wanted.append((word, columns))
    analogues = ("analogues", "second analogues")
    for order, word in enumerate(analogues, 1):
        wanted.append((word, analogue_columns(subject, rows, order)))
    joined: list[tuple[list[str], list[TableColumn]]] = []
    for word, columns in wanted:
        if joined and columns and sum(map(width, (*joined[-1][1], *columns))) <= WIDEST:
            joined[-1] = ([*joined[-1][0], word], [*joined[-1][1], *columns])
        elif columns:
            joined.append(([word], columns))
    note = Note((say("about analogues", ", ".join(subject.result.drivers)),))
    parts = []
    for words, columns in joined:
        title = ", ".join(say(word) if k == 0 else low(say(word)) for k, word in enumerate(words))
        notes = [note] * (analogues[0] in words)
        parts.append(Section(title, (*notes, *grids(first, head, columns))))
    return Section(say("positions"), (), tuple(parts))


def low(text: str) -> str:
    """Return a title within a line."""
    return text[:1].lower() + text[1:]


def force_tables(subject: Subject, rows: list[int], say: Phrases) -> Iterator[Section]:
    columns = force_columns(subject, rows)
    if not columns:
        return
    first, head = [str(k) for k in range(len(rows))], say("position")
    lead = driver_columns(subject, rows)
    blocks: list[Passage] = [Note((say("about forces"),))]
    blocks += grids(first, head, [*lead, *columns])
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
            shown = subject.result.units.of(unit) if unit == "m" else ShownUnit(unit)
            name = f"{say('largest bound')}, {say.unit(shown.name)}"
            rows.append((name, (f"{largest * shown.factor:.1e}",)))
    for word, value in (getattr(result, "checks", None) or {}).items():
        if value is not None:
            rows.append((say(f"check {word}"), (f"{float(value):.1e}",)))
    for word in ("assumptions", "notes"):
        entries = result.summary.get(word)
        if entries:
            rows.append((say(word), ("; ".join(str(text) for text in entries),)))
    return Section(say("checks"), (Facts(tuple(rows)),))
