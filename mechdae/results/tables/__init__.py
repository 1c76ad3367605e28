"""Results as text that fits a terminal."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence

from mechdae.additions import Registry, TaskKind, at_home
from mechdae.results import Result
from mechdae.results.tables.facts import facts_text
from mechdae.results.tables.poses import pose_lines
from mechdae.results.tables.text import WIDE, fact

Lines = Callable[[Result, int], list[str]]


def _text(kind: TaskKind) -> tuple[Lines, Lines]:
    """Return table and facts of a kind of task: those of poses where it has none of its own."""
    return at_home(kind.text) if kind.text else OF_POSES


OF_POSES: tuple[Lines, Lines] = (pose_lines, facts_text)
"""A table with a row for each pose."""
TEXTS: Registry[tuple[Lines, Lines]] = Registry("tasks", {"sweep": OF_POSES}, made=_text)
"""Kind of task -> its table and what to know about it."""


def table(
    result: Result, terminal: bool = False, columns: Sequence[str] | None = None, width: int = 0
) -> str:
    """Return the text of a result: a head, a table of poses, what to know about it.

    `columns` are names of what the table or the CSV has, in place of the usual ones.

    Raises
    ------
    UnknownName
        No such column, with the nearest.
    """
    width = width or (shutil.get_terminal_size((WIDE, 40)).columns if terminal else WIDE)
    if result.kind == "sensitivity":
        from mechdae.results.tables.derivatives import derivatives_text

        return derivatives_text(result, width)
    lines = [f"{result.problem} / {result.task} ({result.kind})  {result.title}".rstrip()]
    rows, facts = TEXTS[result.kind]
    lines += rows(result, width) if columns is None else pose_lines(result, width, columns)
    lines += facts(result, width)
    for sentence in result.summary.get("assumptions", []):
        lines += fact("assumes", sentence, width)
    return "\n".join(lines) + "\n"
