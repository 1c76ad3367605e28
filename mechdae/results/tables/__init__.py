"""Results as text that fits a terminal."""

from __future__ import annotations

import shutil
from collections.abc import Callable

from mechdae.additions import Added, Registry
from mechdae.results import Result
from mechdae.results.tables.facts import facts_text
from mechdae.results.tables.poses import pose_lines
from mechdae.results.tables.text import WIDE, fact

Lines = Callable[[Result, int], list[str]]


HOME = "mechdae.results.tables"
OF_POSES = ("sweep", "reactions")
"""Kinds of tasks whose table has a row for each pose."""
TEXTS: Registry[tuple[Lines, Lines]] = Registry("texts", {
    **dict.fromkeys(OF_POSES, (pose_lines, facts_text)),
    "modes": Added(f"{HOME}.modes:MODES"),
    "motion": Added(f"{HOME}.motions:MOTION"),
    "equilibrium": Added(f"{HOME}.motions:EQUILIBRIUM"),
    "study": Added(f"{HOME}.modes:STUDY"),
    "synthesis": Added(f"{HOME}.designs:SYNTHESIS"),
})  # fmt: skip
"""Kind of task -> its table and what to know about it."""


def table(result: Result, terminal: bool = False) -> str:
    """Return the text of a result: a head, a table of poses, what to know about it."""
    if result.kind == "sensitivity":
        from mechdae.results.tables.derivatives import derivatives_text

        return derivatives_text(result)
    width = shutil.get_terminal_size((WIDE, 40)).columns if terminal else WIDE
    lines = [f"{result.problem} / {result.task} ({result.kind})  {result.title}".rstrip()]
    for text in TEXTS[result.kind]:
        lines += text(result, width)
    for sentence in result.summary.get("assumptions", []):
        lines += fact("assumes", sentence, width)
    return "\n".join(lines) + "\n"
