"""Poses as text, a row for each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdae.errors import UnknownName
from mechdae.results import Result, mixed_units
from mechdae.results.tables.moving import Quantities
from mechdae.results.tables.text import Column, cells, fitted_lines, rows_of, size_of


def poses_columns(result: Result) -> tuple[list[Column], int]:
    """Return the columns of a table with a row for each pose, and how many are needed.

    These are status, drivers, what the task asks for by name, and efforts.
    """
    status = ("status", result.status.tolist())
    moving = Quantities(result)
    columns = [status, *moving.needed()]
    if not result.forces:
        return columns + moving.columns(), len(columns)
    from mechdae.results.tables.forces import force_columns, motion_is_aside

    forces = force_columns(result)
    columns += [column for column in forces if column[0].startswith("effort")]
    forces = [column for column in forces if not column[0].startswith("effort")]
    more = [] if motion_is_aside(result) else moving.columns()
    return columns + (more + forces if result.kind == "motion" else forces + more), len(columns)


def named_columns(result: Result, names: Sequence[str]) -> list[Column]:
    """Return the columns of those names: of the table, or of the CSV, whole or the first part.

    Raises
    ------
    UnknownName
        With the nearest.
    """
    usual = poses_columns(result)[0]
    units = {name: result.units.read(unit) for name, unit, _ in result.columns()}
    known = [title.partition(" [")[0] for title, _ in usual]
    found: list[Column] = []
    for name in names:
        chosen = [column for column in usual if name in (column[0], column[0].partition(" [")[0])]
        for whole, _, values in result.columns() if not chosen else ():
            if whole == name or whole.startswith(f"{name}."):
                unit = units[whole]
                title = f"{whole} [{unit.name}]" if unit.name not in ("", "1") else whole
                shown = np.asarray(values, float) * unit.factor
                chosen.append((title, cells(shown, size_of(shown))))
        if not chosen:
            raise UnknownName("column", name, [*known, *units], where="columns")
        found += chosen
    return found


def pose_lines(result: Result, width: int, names: Sequence[str] | None = None) -> list[str]:
    """Return a row for each pose that is shown, of a single one a line for each quantity.

    `names` are those of columns in place of the usual ones.
    """
    poses = len(result)
    if poses == 1 and names is None:
        from mechdae.results.tables.one_pose import pose_text

        return pose_text(result, width)
    places = rows_of(poses)
    columns, needed = poses_columns(result)
    lead = 1 if result.time is None and not result.drivers else 2
    count = len(columns)
    if names is not None:
        first = {title for title, _ in columns[:lead]}
        chosen = [column for column in named_columns(result, names) if column[0] not in first]
        columns = columns[:lead] + chosen
        needed = count = len(columns)
    given = [([title], texts) for title, texts in columns]
    lines, shown = fitted_lines(given, places, width, needed, lead)
    notes = []
    if len(places) < poses:
        notes.append(f"{len(places)} of {poses} poses")
    if shown < count:
        notes.append(f"{shown} of {count} columns")
    if result.units.asked and (mixed := mixed_units([title for title, _ in columns[:shown]])):
        lines.append(f"  (units mixed: {mixed})")
    if notes:
        how = "--columns chooses, " if shown < count else ""
        lines.append(f"  ({', '.join(notes)} shown; {how}--out DIR writes all)")
    return lines
