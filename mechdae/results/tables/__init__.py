"""Results as text that fits a terminal."""

from __future__ import annotations

import shutil
from collections.abc import Callable

from mechdae.additions import Registry
from mechdae.results import Result
from mechdae.results.tables.derivatives import derivatives_text
from mechdae.results.tables.designs import designs_text
from mechdae.results.tables.facts import facts_text
from mechdae.results.tables.modes import modes_text, study_text
from mechdae.results.tables.motions import equilibrium_facts, motion_facts
from mechdae.results.tables.poses import pose_text, poses_columns, poses_text
from mechdae.results.tables.text import WIDE, fact, rows_of

Lines = Callable[[Result, int], list[str]]


def _poses(result: Result, width: int) -> list[str]:
    return pose_text(result) if len(result) == 1 else poses_text(result, width)


TEXTS: Registry[tuple[Lines, Lines]] = Registry("texts", {
    "modes": (modes_text, facts_text),
    "motion": (_poses, lambda result, _: motion_facts(result)),
    "equilibrium": (_poses, lambda result, _: equilibrium_facts(result)),
    "study": (lambda result, _: study_text(result), facts_text),
    "synthesis": (designs_text, lambda *_: []),
})  # fmt: skip
"""Kind of task -> its table and what to know about it, where these are not those of poses."""


def table(result: Result, terminal: bool = False) -> str:
    """Return the text of a result: a head, a table of poses, what to know about it."""
    if result.kind == "sensitivity":
        return derivatives_text(result)
    width = shutil.get_terminal_size((WIDE, 40)).columns if terminal else WIDE
    lines = [f"{result.problem} / {result.task} ({result.kind})  {result.title}".rstrip()]
    for text in _OF_POSES if result.kind in OF_POSES else TEXTS[result.kind]:
        lines += text(result, width)
    for sentence in result.summary.get("assumptions", []):
        lines += fact("assumes", sentence, width)
    return "\n".join(lines) + "\n"


OF_POSES, _OF_POSES = ("sweep", "reactions"), (_poses, facts_text)
"""Kinds of tasks whose table has a row for each pose, and its parts."""
SHORT, FEW = 7, 6
"""Rows and columns of a table in a notebook."""


def html(result: Result, picture: str = "") -> str:
    """Return a short table of a result as HTML, for notebooks.

    ``picture`` is the address of one that stands below it, "" for none.
    """
    from html import escape

    if result.kind not in OF_POSES or len(result) == 1:
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
