"""Results as text that fits a terminal."""

from __future__ import annotations

import shutil

from mechdae.results import Result
from mechdae.tables.derivatives import derivatives_text
from mechdae.tables.designs import designs_text
from mechdae.tables.facts import facts_text
from mechdae.tables.modes import modes_text, study_text
from mechdae.tables.poses import pose_text, poses_text
from mechdae.tables.text import WIDE


def table(result: Result, terminal: bool = False) -> str:
    """Return the text of a result: a head, a table of poses, what to know about it."""
    if result.kind == "sensitivity":
        return derivatives_text(result)
    width = shutil.get_terminal_size((WIDE, 40)).columns if terminal else WIDE
    lines = [f"{result.problem} / {result.task} ({result.kind})  {result.title}".rstrip()]
    if result.kind == "synthesis":
        return "\n".join([*lines, *designs_text(result, width)]) + "\n"
    if result.kind == "modes":
        lines += modes_text(result, width)
    elif result.kind == "study":
        lines += study_text(result)
    elif len(result) == 1:
        lines += pose_text(result)
    else:
        lines += poses_text(result, width)
    lines += facts_text(result, width)
    return "\n".join(lines) + "\n"
