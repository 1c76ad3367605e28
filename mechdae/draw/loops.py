"""The vectors of closed loops over their mechanism: numbered arrows, what is given of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from mechdae.describe.vectors.expand import slide_of
from mechdae.describe.vectors.loops_of import LoopVectors, drawn_vectors
from mechdae.draw import style
from mechdae.draw.diagram import symbols
from mechdae.draw.diagram.driver import driven_bodies, drivers_of
from mechdae.draw.diagram.places import missing_hint, within
from mechdae.draw.figure import new_axes
from mechdae.draw.fonts import font, width_of
from mechdae.draw.labels import layout
from mechdae.draw.labels.labels import DISC_AIR, Links, Writing, write_all
from mechdae.draw.poses import Eye, seen
from mechdae.draw.primitives import Array
from mechdae.draw.sheet import Sheet, arc, normal, unit
from mechdae.draw.words import Words
from mechdae.errors import InputError
from mechdae.records import dataclass

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from mechdae.results.result import Result

GREY = MappingProxyType(dict.fromkeys((*style.DRAWN, style.ARROW), "#a9b2ba"))
DIM = MappingProxyType(dict.fromkeys((*style.DRAWN, style.ARROW), "#4f5b66"))
"""What the mechanism behind is drawn in, on light and on dark paper."""
KEYS = {
    style.GROUND: "angle given", style.DRIVEN: "angle unknown", style.ARROW: "driven vector",
}  # fmt: skip
"""What the colour of a vector means."""
ROW, SWATCH = 13.0, 22.0
"""Height of a line of the legend, length of a line drawn in it."""
LANE = 4.5
"""How far vectors in one line are drawn apart."""
TURN = 9.0
"""Radius of the arrow that tells the way round a loop."""
GRID = 25
"""Places in each direction at which such an arrow is tried."""


@dataclass(frozen=True)
class Look:
    """How a vector is drawn: colour by its angle, dashes by its length."""

    color: str
    dash: tuple[float, tuple[float, ...]] | None


def draw(
    result: Result,
    ax: Axes | None = None,
    *,
    pose: int | None = None,
    scale: float | None = None,
    view: Eye = None,
    dark: bool = False,
    lang: str = "en",
) -> Axes:
    """Draw the vectors of the closed loops of a mechanism over its diagram in one pose.

    Bodies and joints are written as loops by `mechdae.loops_of`; options are the catalogue's.

    Raises
    ------
    InputError
        A mechanism without a loop, a pose that the result does not have.
    UnavailableError
        A mechanism that is not written as loops.
    """
    words, theme = Words(lang), style.DARK if dark else style.LIGHT
    faint = style.Theme(MappingProxyType({**theme.colours, **(DIM if dark else GREY)}))
    vectors = drawn_vectors(result.mechanism)
    shown = seen(result, pose, view)
    scene, index, flat = shown.scene, shown.pose, shown.view.flat
    drivers = drivers_of(scene, result)
    driven = {*driven_bodies(scene, drivers), *(entry.part for entry in drivers)}
    vectors = vectors.among({
        name for name, pair in vectors.ends.items()
        if all(scene.shown(end.split(".")[0], index) for end in pair)
    })  # fmt: skip
    if not vectors.loops:
        raise InputError(f"no loop is closed in pose {index}", hint=missing_hint(scene))
    looks = _looks(vectors, driven)
    rows = _rows(vectors, looks, words)

    def place(point: str) -> Array:
        beside = vectors.beside.get(point)
        return flat(scene.place(point, index) if beside is None else np.array(beside))

    ends = {name: (place(tail), place(head)) for name, (tail, head) in vectors.ends.items()}
    low, high, size = shown.bounds([index], False)
    places = [spot for pair in ends.values() for spot in pair]
    low, high = np.min([low, *places], axis=0), np.max([high, *places], axis=0)
    chosen = font(style.NOTE, style.NOTE_FONT)
    wide = SWATCH + 12.0 + max(width_of(text, chosen) for text, _ in rows)
    tall = ROW * len(rows) + style.STRIP + 8.0
    margins = (style.MARGIN, style.MARGIN + wide, style.MARGIN, style.MARGIN)
    larger = (1.0 + wide / style.AREA[0], max(1.0, tall / style.AREA[1]))
    framed = replace(
        shown.view, traces=False, labels=False, loads=False, bounds=(low, high, size),
        scale=scale, paper=theme, margins=margins, larger=larger,
    )  # fmt: skip
    axes = ax if ax is not None else new_axes(theme, larger, high - low, margins)
    sheet = shown.draw(axes, framed, faint, words)
    sheet.theme = theme
    _arrows(sheet, vectors, looks, {n: (sheet.at(a), sheet.at(b)) for n, (a, b) in ends.items()})
    _legend(sheet, rows, wide, chosen)
    return axes


def _looks(vectors: LoopVectors, driven: set[str]) -> Mapping[str, Look]:
    """Return how each vector is drawn; ``driven`` are links and joints that drivers move."""
    looks = {}
    for name, (tail, head) in vectors.ends.items():
        body = tail.split(".")[0]
        moved = name in driven or slide_of(name) in driven
        moved |= body == head.split(".")[0] and body in driven
        still = name in vectors.still
        color = style.ARROW if moved else style.GROUND if still else style.DRIVEN
        looks[name] = Look(color, style.DASHED if vectors.vectors[name].slides else None)
    return looks


Row = tuple[str, Look | None]


def _rows(vectors: LoopVectors, looks: Mapping[str, Look], words: Words) -> list[Row]:
    """Return the lines of the legend: what lines mean, vectors by number, loops."""
    numbers = {name: k for k, name in enumerate(vectors.ends, start=1)}
    rows: list[Row] = []
    for color, key in KEYS.items():
        if any(look.color == color for look in looks.values()):
            rows.append((words(key), Look(color, None)))
    if any(look.dash for look in looks.values()):
        rows.append((words("length unknown"), Look(style.INK, style.DASHED)))
    rows.append(("", None))
    rows += [(f"{k}  {name}", None) for name, k in numbers.items()]
    rows.append(("", None))
    for k, loop in enumerate(vectors.loops.values(), start=1):
        parts = [("− " if entry[0] == "-" else "+ ") + str(numbers[entry.lstrip("- ")])
                 for entry in loop]  # fmt: skip
        rows.append((f"{roman(k)}:  {' '.join(parts).removeprefix('+ ')} = 0", None))
    return rows


def roman(number: int) -> str:
    """Return a number in Roman numerals."""
    text = ""
    for value, sign in ((10, "X"), (9, "IX"), (5, "V"), (4, "IV"), (1, "I")):
        text, number = text + sign * (number // value), number % value
    return text


def _legend(sheet: Sheet, rows: list[Row], wide: float, chosen: object) -> None:
    left, top = float(sheet.size[0]) - wide, float(sheet.size[1]) - 4.0
    for k, (text, look) in enumerate(rows):
        y = top - ROW * (k + 1)
        if look is not None:
            ends = [(left, y + 3.0), (left + SWATCH - 6.0, y + 3.0)]
            sheet.line(ends, color=look.color, dash=look.dash, width=1.5, gid=f"legend-line-{k}")
        start = (left + SWATCH if look is not None else left, y)
        if text:
            sheet.write(start, text, chosen, style.INK, f"legend-{k}")  # type: ignore[arg-type]


def _arrows(
    sheet: Sheet,
    vectors: LoopVectors,
    looks: Mapping[str, Look],
    ends: Mapping[str, tuple[Array, Array]],
) -> None:
    """Draw vectors and the way round each loop, and write their numbers."""
    labels: list[Writing] = []
    size, note = 2 * style.DISC + 2 * DISC_AIR, font(style.NUMBER)
    for k, (name, (tail, head)) in enumerate(_apart(ends).items(), start=1):
        look, gid = looks[name], f"vector-{name}"
        sheet.line([tail, head - 5.0 * unit(head - tail)], color=look.color, dash=look.dash,
                   width=1.6 * style.LINE, z=style.Z_LABEL, gid=gid)  # fmt: skip
        symbols.tip(sheet, tail, head, look.color, style.Z_LABEL)
        label = layout.along([(tail, head)], size, size, 1.0)
        labels.append(Writing(str(k), "number", f"number-{name}", note, label, [(tail, head)]))
    segments = np.array(list(ends.values()))
    taken: list[Array] = []
    for k, loop in enumerate(vectors.loops.values(), start=1):
        pairs = [(ends[e.lstrip("- ")][::-1] if e[0] == "-" else ends[e]) for e in loop]
        corners = np.array([start for start, _ in pairs])
        middle, way = _inside(corners, segments, taken)
        taken.append(middle)
        points = arc(middle, TURN, 0.75 * np.pi, 0.75 * np.pi + way * 1.5 * np.pi)
        symbols.arrow(sheet, points, f"loop-{roman(k)}", style.FAINT)
        sheet.box(middle - TURN, middle + TURN)
        sheet.text(middle, roman(k), font(style.NUMBER), style.FAINT, f"loop-{roman(k)}-name")
    write_all(sheet, labels, Links())


def _apart(ends: Mapping[str, tuple[Array, Array]]) -> dict[str, tuple[Array, Array]]:
    """Return vectors that lie in one line side by side."""
    lanes: dict[str, int] = {}
    apart = {}
    for name, (tail, head) in ends.items():
        along = unit(head - tail)
        used = set()
        for before, lane in lanes.items():
            rest = np.array([place - tail for place in ends[before]])
            span = np.sort(rest @ along)
            gap = min(span[1], float(np.hypot(*(head - tail)))) - max(span[0], 0.0)
            if np.abs(rest @ normal(along)).max() < LANE / 2 and gap > LANE:
                used.add(lane)
        lanes[name] = next(k for k in (0, 1, -1, *range(2, len(ends) + 2)) if k not in used)
        # one normal of a line, whichever way its vectors run
        side = LANE * lanes[name] * normal(along) * (1 if tuple(along) > (0.0, 0.0) else -1)
        apart[name] = tail + side, head + side
    return apart


def _inside(corners: Array, segments: Array, taken: list[Array]) -> tuple[Array, int]:
    """Return the place in a loop that is farthest from vectors, and the sense in which it turns."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    room = 2.5 * TURN if min(high - low) < 3 * TURN else 0.0
    low, high = low - room, high + room
    axes = [np.linspace(a, b, GRID) for a, b in zip(low, high, strict=True)]
    places = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    near = np.hypot(*(places - layout.feet_of(places, segments.reshape(-1, 4))).T)
    for spot in taken:
        near = np.minimum(near, np.hypot(*(places - spot).T) - 2 * TURN)
    x, y = corners.T
    area = float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
    best = int(np.argmax(np.minimum(near, 3 * TURN) - 2 * TURN * ~within(places, corners)))
    return places[best], 1 if area >= 0 else -1
