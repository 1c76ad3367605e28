"""Joint letters and link numbers, placed and written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace

import numpy as np

from mechdae.draw import style
from mechdae.draw.diagram.loads import Mark
from mechdae.draw.diagram.placed_scene import PlacedScene
from mechdae.draw.diagram.places import (
    Piece,
    Place,
    free_points,
    inside,
    letters_of,
    numbers_of,
    within,
    written,
)
from mechdae.draw.diagram.scene import DrawnScene
from mechdae.draw.fonts import Font, font, ink, plain
from mechdae.draw.labels import layout
from mechdae.draw.labels.layout import feet_of
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import Sheet, unit
from mechdae.records import dataclass

AIR = 2.5
"""Room kept around letters,"""
DISC_AIR = 1.6
"""and around numbers: half a link's line and half that of the disc."""
STRANGE = 15.0
"""Cost of a place inside the polygon of another link or behind its bar."""
FAR = 20.0
"""A letter farther than this from its joint gets one, too."""
LEADER = 15.0
"""A number farther than this from its link gets a thin line to it."""


@dataclass
class Links:
    """What numbers are attached to, by body, on the sheet."""

    bars: dict[str, list[Piece]] = field(default_factory=dict)
    polygons: dict[str, Array] = field(default_factory=dict)
    blocks: dict[str, Array] = field(default_factory=dict)
    wheels: dict[str, tuple[Array, float]] = field(default_factory=dict)
    points: dict[str, Array] = field(default_factory=dict)


@dataclass(frozen=True)
class Writing:
    """A text with its place."""

    text: str
    kind: str
    gid: str
    font: Font
    label: layout.Label
    anchors: Sequence[Piece] = ()
    color: str = style.INK
    index: str | None = None


def writings(
    sheet: Sheet, scene: DrawnScene, pose: int, places: Sequence[Place], links: Links,
    marks: Sequence[Mark] = (), names: Mapping[str, str] | None = None,
) -> list[Writing]:  # fmt: skip
    """Return all labels of a pose with their possible places; ``names`` are letters of points."""
    letters = _letters(sheet, scene, pose, places, names or letters_of(scene, pose, places))
    return [*letters, *load_names(marks), *link_numbers(scene, pose, links)]


def write_all(
    sheet: Sheet, labels: Sequence[Writing], links: Links
) -> list[tuple[str, Array, Array]]:
    """Write labels where they cover least; return name, lower and upper corner of each."""
    labels = [_anchored(label) for label in labels]
    spots = layout.place([label.label for label in labels], *sheet.obstacles(), sheet.size)
    for label, spot in zip(labels, spots, strict=True):
        corners = links.polygons.get(label.gid.removeprefix("number-"))
        if label.kind != "number" or corners is None or not inside(spot, corners):
            _write_leader(sheet, label, spot)
        write_label(sheet, label, spot)
    rows = [(entry.gid, np.array([entry.label.width, entry.label.height]) / 2) for entry in labels]
    return [(row[0], at - row[1], at + row[1]) for row, at in zip(rows, spots, strict=True)]


def _anchored(entry: Writing) -> Writing:
    """Return a label that no other one comes between and its joint or link."""
    rows = np.array([(*a, *b) for a, b in entry.anchors], dtype=float).reshape(-1, 4)
    return replace(entry, label=replace(entry.label, anchors=rows))


def _letters(
    sheet: Sheet, scene: DrawnScene, pose: int, places: Sequence[Place], letters: Mapping[str, str]
) -> list[Writing]:
    rows = [(p.references, style.PIN if p.pinned else style.DOT) for p in places]
    rows += [((reference,), style.DOT) for reference in free_points(scene, pose)]
    result = []
    for references, radius in rows:
        first, arms = references[0], _arms(scene, references, pose)
        spot = sheet.at(scene.place(first, pose))
        result.append(letter(letters[first], first, spot, radius + 2.5, arms))
    return result


def letter(name: str, gid: str, anchor: Array, gap: float, arms: Sequence[Array]) -> Writing:
    """Return the letter of a place on the sheet, best where no bar (``arms``) leaves it.

    ``gap`` is the room between the place and the letter.
    """
    chosen = font(style.LETTER, style="italic")
    text, index = written(name)
    low, high = ink(text, chosen, index)
    width, height = high - low + 2 * AIR
    away = -unit(sum((unit(arm) for arm in arms), np.zeros(2)))
    if not away.any():
        away = np.array([-0.6, 0.8])
    label = layout.around(anchor, float(width), float(height), gap - AIR, away)
    return Writing(text, "letter", f"label-{gid}", chosen, label, [(anchor, anchor)], index=index)


def load_names(marks: Sequence[Mark]) -> list[Writing]:
    """Return the names of the loads, beside their arrows."""
    result, chosen = [], font(style.LOAD_TEXT, style.NOTE_FONT)
    for mark in marks:
        text, gid = plain(mark.text), f"label-load-{mark.name}"
        low, high = ink(text, chosen)
        width, height = (high - low + 2 * AIR).tolist()
        label = layout.along(mark.lines, width, height, 2.0)
        result.append(Writing(text, "load", gid, chosen, label, (), mark.color))
    return result


def _arms(scene: DrawnScene, references: Sequence[str], pose: int) -> list[Array]:
    """Return the directions of the links that meet at a place."""
    arms = []
    for reference in references:
        body = reference.split(".")[0]
        if body not in scene.mechanism.bodies:
            continue
        start = scene.place(reference, pose)
        for point in scene.points(body):
            arm = scene.place(point, pose) - start
            if np.hypot(*arm) > 1e-12:
                arms.append(arm)
    return arms


def link_numbers(scene: PlacedScene, pose: int, links: Links) -> list[Writing]:
    """Return the numbers of the links shown."""
    result = []
    chosen = font(style.NUMBER)
    for name, number in numbers_of(scene.mechanism).items():
        if scene.shown(name, pose):
            label, anchors = _number_label(name, links, 2 * style.DISC)
            alone = name in links.wheels and not links.bars.get(name)
            weight = style.RING if alone else style.SOLID
            segments = np.array([(*a, *b, weight) for a, b in anchors]).reshape(-1, 5)
            costs = label.costs + _strange(label, name, links, anchors)
            label = replace(label, own=segments, costs=costs, rank=1)
            result.append(Writing(str(number), "number", f"number-{name}", chosen, label, anchors))
    return result


def _strange(label: layout.Label, name: str, links: Links, anchors: Sequence[Piece]) -> Array:
    """Return what it costs to put a number in the polygon or behind the bar of another link."""
    strange = np.zeros(len(label.places))
    for other, corners in links.polygons.items():
        if other != name:
            strange = np.maximum(strange, within(label.places, corners))
    rows = [(*a, *b) for other, rows in links.bars.items() if other != name for a, b in rows]
    bars = np.array(rows, dtype=float).reshape(-1, 4)
    feet = feet_of(label.places, np.array([(*a, *b) for a, b in anchors]).reshape(-1, 4))
    both = np.vstack([label.places, feet])
    near = (np.minimum(bars[:, 0:2], bars[:, 2:4]) <= both.max(axis=0)).all(axis=1)
    near &= (np.maximum(bars[:, 0:2], bars[:, 2:4]) >= both.min(axis=0)).all(axis=1)
    behind = layout.cuts(label.places, feet, bars[near])
    return STRANGE * (strange + behind)


def _number_label(name: str, links: Links, size: float) -> tuple[layout.Label, list[Piece]]:
    """Return the places for the number of a link: in a polygon, at bars, block or wheel."""
    wide = size + 2 * DISC_AIR
    bars = links.bars.get(name, [])
    if name in links.polygons:
        corners = links.polygons[name]
        middle = corners.mean(axis=0)
        places = np.vstack([middle + share * (corners - middle) for share in (0.0, 0.2, 0.4)])
        label = layout.Label(wide, wide, places, np.repeat([0.0, 1.0, 2.0], len(corners)))
        return layout.merge(label, layout.along(bars, wide, wide, 3.0), 8.0), bars
    if bars:
        return layout.along(bars, wide, wide, 3.0), bars
    if name in links.blocks:
        corners = links.blocks[name]
        sides = list(zip(corners, np.roll(corners, -1, axis=0), strict=True))
        middle = corners.mean(axis=0)
        label = layout.around(middle, wide, wide, style.BLOCK[1] + 2.0, (0.0, 1.0))
        return label, sides
    if name in links.wheels:
        center, radius = links.wheels[name]
        label = layout.around(center, wide, wide, radius + 2.0, (0.7, 0.7))
        within = layout.inside(center, wide, radius - style.DISC - 3.0, (0.7, 0.7))
        ring = [
            center + radius * np.array([np.cos(a), np.sin(a)]) for a in np.arange(48) * np.pi / 24
        ]
        return layout.merge(within, label, 4.0), list(zip(ring, [*ring[1:], ring[0]], strict=True))
    spot = links.points[name]
    return layout.around(spot, wide, wide, style.PIN + 2.0), [(spot, spot)]


def _write_leader(sheet: Sheet, entry: Writing, spot: Array) -> None:
    """Draw a thin line from a label to its joint or link, where another could be meant."""
    rows = entry.label.anchors
    if rows is None or not len(rows):
        return
    away = feet_of(spot[None], rows)[0] - spot
    distance = float(np.hypot(*away))
    half = np.array([entry.label.width, entry.label.height]) / 2 - AIR + 1.5
    share, far = float((half / np.maximum(np.abs(away), 1e-9)).min()), FAR
    if entry.kind == "number":
        share, far = style.DISC / max(distance, 1e-9), LEADER
    if share < 1.0 and (1.0 - share) * distance > far:
        ends, gid = [spot + share * away, spot + away], f"leader-{entry.gid}"
        sheet.line(ends, color=style.FAINT, width=style.THIN, gid=gid, weight=0)


def write_label(sheet: Sheet, entry: Writing, spot: Array, text: str = "") -> None:
    """Write a label, a number in its disc; another `text` in its place."""
    number = entry.kind == "number"
    if number:
        radius, width, z = style.DISC, style.THIN, style.Z_LABEL
        sheet.circle(spot, radius, fill=style.PAPER, width=width, z=z, gid=entry.gid, weight=0)
    gid, index = (None, "") if number else (entry.gid, entry.index)
    sheet.text(spot, text or entry.text, entry.font, entry.color, gid, index)
