"""Results as text that fits a terminal."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping

from mechdae.results import Result
from mechdae.tables.derivatives import derivatives_text
from mechdae.tables.designs import designs_text
from mechdae.tables.facts import facts_text
from mechdae.tables.modes import modes_text, study_text
from mechdae.tables.motions import equilibrium_facts, motion_facts
from mechdae.tables.poses import pose_text, poses_columns, poses_text
from mechdae.tables.schemes import schemes_text
from mechdae.tables.text import WIDE, fact, rows_of

Lines = Callable[[Result, int], list[str]]


def _poses(result: Result, width: int) -> list[str]:
    return pose_text(result) if len(result) == 1 else poses_text(result, width)


TEXTS: Mapping[str, tuple[Lines, Lines]] = {
    "modes": (modes_text, facts_text),
    "motion": (_poses, lambda result, _: motion_facts(result)),
    "equilibrium": (_poses, lambda result, _: equilibrium_facts(result)),
    "study": (lambda result, _: study_text(result), facts_text),
    "synthesis": (designs_text, lambda *_: []),
    "composition": (schemes_text, lambda *_: []),
}
"""Kind of task -> its table and what to know about it, where these are not those of poses."""


def table(result: Result, terminal: bool = False) -> str:
    """Return the text of a result: a head, a table of poses, what to know about it."""
    if result.kind == "sensitivity":
        return derivatives_text(result)
    width = shutil.get_terminal_size((WIDE, 40)).columns if terminal else WIDE
    lines = [f"{result.problem} / {result.task} ({result.kind})  {result.title}".rstrip()]
    for text in TEXTS.get(result.kind, (_poses, facts_text)):
        lines += text(result, width)
    for sentence in result.summary.get("assumptions", []):
        lines += fact("assumes", sentence, width)
    return "\n".join(lines) + "\n"


SHORT, FEW = 7, 6
"""Rows and columns of a table in a notebook."""


def html(result: Result, picture: str = "") -> str:
    """Return a short table of a result as HTML, for notebooks.

    ``picture`` is the address of one that stands below it, "" for none.
    """
    from html import escape

    if result.kind in TEXTS or result.kind == "sensitivity" or len(result) == 1:
        body = f"<pre>{escape(table(result))}</pre>"
    else:
        body = _short(result)
    if picture:
        body += f'<img alt="{escape(result.task)}" src="{picture}" style="max-width:100%">'
    return f"<div>{body}</div>"


def _short(result: Result) -> str:
    from html import escape

    columns = poses_columns(result)[:FEW]
    places = rows_of(len(result), SHORT)
    head = "".join(f"<th>{escape(title)}</th>" for title, _ in columns)
    rows = "".join(
        "<tr>" + "".join(f"<td>{escape(own[k])}</td>" for _, own in columns) + "</tr>"
        for k in places
    )
    title = f"{result.problem} / {result.task} ({result.kind}) {result.title}".rstrip()
    notes = [f"{len(places)} of {len(result)} poses"] if len(places) < len(result) else []
    notes += [result.fault] if result.fault else []
    return (
        f"<p><b>{escape(title)}</b></p><table><thead><tr>{head}</tr></thead>"
        f"<tbody>{rows}</tbody></table><p>{escape('; '.join(notes))}</p>"
    )
