"""What does not close: the ends that should meet, and the gap between them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mechdae.describe.mechanism import GROUND
from mechdae.draw import style
from mechdae.draw.diagram import symbols
from mechdae.draw.diagram.loads import Mark
from mechdae.draw.diagram.scene import DrawnScene, open_of
from mechdae.draw.sheet import Sheet
from mechdae.draw.words import Words

if TYPE_CHECKING:
    from mechdae.results import SweepResult
    from mechdae.results.result import Result


def draw_gaps(sheet: Sheet, scene: DrawnScene, result: Result, words: Words) -> list[Mark]:
    """Draw the gap of each open joint as a dashed line; return what its size is written beside."""
    marks = []
    for entry in open_of(result):
        name = entry["joint"]
        ends = [sheet.at(np.array(entry[word])) for word in ("from", "to")]
        gid = f"gap-{name}"
        sheet.line(ends, color=style.ARROW, width=style.LINE, dash=style.DASHED, gid=gid)
        joint = scene.mechanism.joints[name]
        for end, side in zip(ends, (joint.first, joint.second), strict=True):
            if side.split(".")[0] == GROUND:
                symbols.support(sheet, end, f"support-{name}")
            symbols.pin(sheet, end, f"open-{name}")
        size = words("gap", name, words.amount(entry["gap"], "m"))
        marks.append(Mark(gid, size, ((ends[0], ends[1]),), style.ARROW))
    return marks


def open_text(result: Result, words: Words) -> str:
    """Return which joints stay open by how much, empty where all close."""
    gaps = [f"{own['joint']} {words.amount(own['gap'], 'm')}" for own in open_of(result)]
    return words("does not close", ", ".join(gaps)) if gaps else ""


def blame_text(result: SweepResult, words: Words) -> str:
    """Return which lengths are too short or too long."""
    summary = getattr(result, "summary", None) or {}
    parts = [
        words(word, ", ".join(own["what"] for own in summary[key]))
        for key, word in (("too_short", "too short"), ("too_long", "too long"))
        if summary.get(key)
    ]
    return "; ".join(parts)
