"""Assembly modes and sets of parameters as text."""

from __future__ import annotations

import numpy as np

from mechdae.results import Result
from mechdae.results.tables.facts import facts_text
from mechdae.results.tables.text import Column, cells, fitted_lines, rows_of, size_of

FAULTS = 4
"""Sets with a fault that are shown."""


def modes_text(result: Result, width: int) -> list[str]:
    from mechdae.results.sketch_lines import shown_line

    summary = result.summary
    how = "proven" if summary["proven"] else "found, not proven"
    lines = [
        f"  {summary['count']} assembly mode(s), {how}; labels of {', '.join(summary['groups'])}"
    ]
    rows = zip(result.labels or (), summary["sketches"], result.status, strict=True)
    for label, sketch, status in rows:
        text = "  ".join(shown_line(result, name, value) for name, value in sketch.items())
        text = text if status == "ok" else f"{status}  {text}"
        lines.append(f"  {','.join(label):8}  {text}"[: max(width, 60) * 3])
    if "homotopy" in summary.get("basis", ""):
        lines.append(f"  basis: {summary['basis']}")
    for entry in summary.get("search", []):
        text = f"{entry['found']} found from {entry['starts']} starts"
        lines.append(f"  searched: {entry['group']}: {text}, each by {entry['least_hits']} or more")
    if "free" in summary:
        lines.append(f"  not counted: modes in which {', '.join(summary['free'])} moves by itself")
    return lines


def study_text(result: Result, width: int) -> list[str]:
    """Return a row for each set of parameters; of a path with many numbers its range."""
    columns: list[Column] = [("status", result.status.tolist())]
    given = result.summary.get("units", {})
    units = [""]
    for name, array in result.parameters.items():
        shown = result.units.of(given.get(name, ""))
        columns.append((name, cells(array * shown.factor)))
        units.append(f"[{shown.name}]" if result.units and shown.name not in ("", "1") else "")
    for whole, array in result.table.items():
        path = whole.split("/", 1)[-1]
        shown = result.units.of(result.path_unit(whole))
        array = array * shown.factor if shown.factor != 1 else array
        words = [f"[{shown.name}]" if shown.name not in ("", "1") else ""]
        units += words * (1 if array.ndim == 1 else 2)
        if array.ndim == 1:
            columns.append((path, cells(array, size_of(array))))
            continue
        flat = array.reshape(len(array), -1)
        seen = np.isfinite(flat).any(axis=1)
        low, high = (np.full(len(flat), np.nan) for _ in range(2))
        low[seen], high[seen] = np.nanmin(flat[seen], axis=1), np.nanmax(flat[seen], axis=1)
        size = size_of(flat)
        columns += [(f"least {path}", cells(low, size)), (f"largest {path}", cells(high, size))]
    rows = rows_of(len(result))
    given = [
        ([title, unit] if any(units) else [title], texts)
        for (title, texts), unit in zip(columns, units, strict=True)
    ]
    lines, _ = fitted_lines(given, rows, width, lead=1 + len(result.parameters))
    if len(rows) < len(result):
        lines.append(f"  ({len(rows)} of {len(result)} sets shown; --out DIR writes all)")
    counts = ", ".join(f"{count} {word}" for word, count in result.summary["status"].items())
    lines.append(f"  sets      {counts}")
    faults = result.summary.get("faults", [])
    for entry in faults[:FAULTS]:
        given = ", ".join(
            f"{n} = {values[entry['set']]:.6g}" for n, values in result.parameters.items()
        )
        lines.append(f"  fault     {given}: {entry['fault']}")
    if len(faults) > FAULTS:
        lines.append(f"  fault     in {len(faults) - FAULTS} more sets; --json has them")
    return lines


MODES = (modes_text, facts_text)
STUDY = (study_text, facts_text)
"""The tables of such tasks, and what to know about them."""
