"""What is written around a diagram: titles, the scale bar, what is not drawn and why."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mechdae.describe.units import SI, Units
from mechdae.draw import style
from mechdae.draw.closing import blame_text, open_text
from mechdae.draw.diagram import symbols
from mechdae.draw.diagram.driver import blocked, drivers_of, held_drivers, time_text, value_text
from mechdae.draw.diagram.placed_scene import PlacedScene
from mechdae.draw.fonts import font, ink, plain, width_of
from mechdae.draw.sheet import Sheet
from mechdae.draw.words import Words

if TYPE_CHECKING:
    from mechdae.results.result import Result


LEGEND = 8.0
"""Height of the subtitle, or of the names of variants, above the axes."""
HINTED = 0.97
"""Share of the room that titles take: letters made of pixels are wider than their outlines."""
LENGTHS = ((1e3, 1e3, "km"), (0.5, 1.0, "m"), (5e-4, 1e-3, "mm"), (0.0, 1e-6, "µm"))
"""Least length, unit, name."""


def draw_frame(
    sheet: Sheet, scene: PlacedScene, result: Result, pose: int, words: Words, extra: str = ""
) -> None:
    """Draw the scale bar and the note on what is not drawn."""
    metres = getattr(result, "units", SI).of("m")
    length = nice_length(0.2 * metres.factor * float(sheet.size[0]) / sheet.metre) / metres.factor
    bar = length * sheet.metre
    chosen = font(style.NOTE, style.NOTE_FONT)
    text = length_text(length, words, getattr(result, "units", SI))
    low, high = ink(text, chosen)
    wide, note = (high - low)[0], note_text(scene, result, pose, words)
    note = "; ".join(part for part in (note, extra) if part)
    right = sheet.size[0] - 6.0
    if not note and sheet.memory is None:  # aside of what reaches down there, such as a load
        line = np.linspace((right - bar - wide - 12.0, 10.0), (right, 10.0), 9)
        ways = np.arange(0.0, right - bar - wide - 12.0, bar / 2)
        cost = [blocked(sheet, line - (way, 0.0)) for way in ways]
        right -= ways[int(np.argmin(np.round(cost, 6)))] if cost else 0.0
    start = np.array([right - bar, 10.0])
    symbols.scale_bar(sheet, start, bar, "scale-bar")
    spot = start - (5.0 + wide / 2, 0.0)
    sheet.text(spot, text, chosen, style.FAINT, "scale-text")
    sheet.box((spot[0] - wide / 2 - 3.0, 2.0), (right + 6.0, 18.0))
    if note:
        room = float(spot[0] - wide / 2 - 14.0)
        note, chosen = fitted(note, style.NOTE, room, style.NOTE_FONT)
        low, high = ink(note, chosen)
        sheet.text((4.0 + (high - low)[0] / 2, 10.0), note, chosen, style.FAINT, "note")
        sheet.box((0.0, 2.0), (4.0 + (high - low)[0], 18.0))


def outside_of(result: Result) -> set[str]:
    """Return the bodies that no output of the task depends on."""
    return set((getattr(result, "summary", None) or {}).get("not_in_scene", ()))


def note_text(scene: PlacedScene, result: Any, pose: int, words: Words) -> str:
    """Return which bodies are not drawn, and why."""
    outside = outside_of(result)
    drawn = set(scene.mechanism.bodies) - scene.helpers
    missing = [name for name in scene.mechanism.bodies if not scene.shown(name, pose)]
    missing = [name for name in missing if name in drawn]
    absent = [name for name in missing if name in outside]
    unasked = [name for name in missing if name not in scene.placed and name not in outside]
    unsolved = [name for name in missing if name not in {*absent, *unasked}]
    dashed = [name for name in scene.mechanism.bodies if name in outside - set(missing)]
    parts, status = [], words.status(scene.status[pose])
    if dashed:
        parts.append(f"{words('dashed')}: {', '.join(dashed)}")
    if absent:
        parts.append(f"{words('absent')}: {', '.join(absent)}")
    if unasked:
        parts.append(f"{words('unasked')}: {', '.join(unasked)}")
    if unsolved:
        parts.append(f"{status}, {words('undrawn')}: {', '.join(unsolved)}")
    elif scene.open:
        parts.append(blame_text(result, words))
    elif scene.status[pose] != "ok":
        parts.append(f"{words('pose')}: {status}")
    return "; ".join(parts)


def nice_length(about: float) -> float:
    """Return 1, 2 or 5 times a power of ten, at most `about`."""
    power = 10.0 ** np.floor(np.log10(about))
    return float(
        max(step * power for step in (1.0, 2.0, 5.0) if step * power <= about * (1 + 1e-9))
    )


def length_text(length: float, words: Words, units: Units = SI) -> str:
    """Return a length with its unit: that asked for, or one from µm to km."""
    if "m" in units.by_si:
        metres = units.of("m")
        return f"{words.number(length * metres.factor)} {words.status(metres.name)}"
    _, unit, name = next(row for row in LENGTHS if length >= row[0])
    return f"{words.number(length / unit)} {words(name)}"


def fitted(text: str, size: float, room: float, families: list[str]) -> tuple[str, Any]:
    """Return a text and its font so that it fits: smaller by a quarter at most, then cut."""
    width = width_of(text, font(size, families))
    size *= float(np.clip(room / width, 0.75, 1.0)) if width > 0 else 1.0
    chosen = font(size, families)
    keep = len(text)
    while keep > 3 and (width := width_of(text[:keep], chosen)) > 1.001 * room:
        keep = min(keep - 1, int(keep * room / width))
    return (text if keep == len(text) else text[: keep - 1].rstrip() + "…"), chosen


def in_lines(text: str, size: float, room: float, families: list[str]) -> list[str]:
    """Return a text as it is if it fits at that size, or as two lines of much the same length."""
    chosen = font(size, families)
    places = [k for k, letter in enumerate(text) if letter == " "]
    if not places or width_of(text, chosen) <= room:
        return [text]

    def longer(k: int) -> float:
        return max(width_of(part, chosen) for part in (text[:k], text[k + 1 :]))

    k = min(places, key=longer)
    return [text[:k], text[k + 1 :]]


def write_legend(sheet: Sheet, legend: Sequence[tuple[str, str]]) -> None:
    """Write the names of variants below the title, each in its colour."""
    x = 4.0
    for name, color in legend:
        chosen, start = font(style.SUBTITLE, style.NOTE_FONT), (x, sheet.size[1] + LEGEND)
        sheet.write(start, plain(name), chosen, color, f"variant-{name}")
        x += width_of(name, chosen) + 14.0


def write_heads(
    sheet: Sheet, scene: PlacedScene, result: Result, pose: int, words: Words, label: str = "",
    subtitle: str = "",
) -> None:  # fmt: skip
    """Write the title and, below it, the drivers' values and the pose, or what is given."""
    from mechdae.draw.figure import current_format

    if not current_format().titled:
        return
    title, count = str(getattr(result, "title", "") or result.problem), len(result.status)
    drivers = drivers_of(scene, result)
    held = held_drivers(result, drivers)
    values = [value_text(result, driver, pose, words, driver.text in held) for driver in drivers]
    parts = [time_text(result, pose, words), *values, open_text(result, words), label]
    parts.append(str(getattr(result, "task", "") or ""))
    if getattr(result, "kind", "") == "modes":
        parts.append(words("mode of", ",".join(result.labels[pose]), pose + 1, count))
    elif count > 1:
        parts.append(words("pose of", pose + 1, count))
    room = HINTED * (float(sheet.size[0]) - 8.0)
    lines = in_lines(title, 0.75 * style.TITLE, room, style.NOTE_FONT)
    subtitle = subtitle or "  ·  ".join(part for part in parts if part)
    rows = [(subtitle, style.SUBTITLE, LEGEND, style.FAINT, "subtitle")]
    if len(lines) == 1 or sheet.above < 34.0 + 0.85 * style.TITLE:
        rows.append((title, style.TITLE, 24.0, style.INK, "title"))
    else:
        rows.append((lines[0], 0.85 * style.TITLE, 34.0, style.INK, "title"))
        rows.append((lines[1], 0.85 * style.TITLE, 21.0, style.INK, "title-rest"))
    top = sheet.size[1] - max(24.0 + style.TITLE - sheet.above, 0.0)  # lower in axes of others
    for text, size, lift, color, gid in rows:
        text, chosen = fitted(text, size, room, style.NOTE_FONT)
        sheet.write((4.0, top + lift), plain(text), chosen, color, gid)
