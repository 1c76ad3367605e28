"""Results as HTML, for notebooks."""

from __future__ import annotations

from html import escape

from mechdae.results import Result
from mechdae.results.tables import OF_POSES, TEXTS, table
from mechdae.results.tables.poses import poses_columns
from mechdae.results.tables.text import rows_of

SHORT, FEW = 7, 6
"""Rows and columns of a table in a notebook."""


def html(result: Result, picture: str = "") -> str:
    """Return a short table of a result as HTML, for notebooks.

    ``picture`` is the address of one that stands below it, "" for none.
    """
    if TEXTS[result.kind] is not OF_POSES or len(result) == 1:
        body = f"<pre>{escape(table(result))}</pre>"
    else:
        body = _short(result)
    if picture:
        body += f'<img alt="{escape(result.task)}" src="{picture}" style="max-width:100%">'
    return f"<div>{body}</div>"


def _short(result: Result) -> str:
    columns = poses_columns(result)[0][:FEW]
    places = rows_of(len(result), SHORT)
    head = "".join(f"<th>{escape(title)}</th>" for title, _ in columns)
    rows = "".join(
        "<tr>" + "".join(f"<td>{escape(texts[k])}</td>" for _, texts in columns) + "</tr>"
        for k in places
    )
    title = f"{result.problem} / {result.task} ({result.kind}) {result.title}".rstrip()
    notes = [f"{len(places)} of {len(result)} poses"] if len(places) < len(result) else []
    notes += [result.units.in_text(result.fault)] if result.fault else []
    return (
        f"<p><b>{escape(title)}</b></p><table><thead><tr>{head}</tr></thead>"
        f"<tbody>{rows}</tbody></table><p>{escape('; '.join(notes))}</p>"
    )
