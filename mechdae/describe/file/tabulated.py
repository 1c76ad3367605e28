"""Tables of loads from CSV files: an indicator diagram, a measured force.

The file lies in the folder of the problem file or below it. Its first row may be a header;
``columns`` names the two columns that are used, by default the first two.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from mechdae.describe.loads import TableLoad
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.tasks.kinds import Driver, Task
from mechdae.describe.values import Table
from mechdae.errors import InputError, MechdaeError, UnknownName, shorten

MAX_BYTES = 10_000_000
Rows = tuple[tuple[float, float], ...]


def with_tables_of(mechanism: Mechanism, other: Mechanism) -> Mechanism:
    """Return the mechanism with the files that another one of the same folder has read."""
    known = {x.file: x.from_file for x in other.loads.values() if isinstance(x, TableLoad)}
    if not known:
        return mechanism
    loads = {
        name: replace(load, from_file=known.get(load.file)) if isinstance(load, TableLoad) else load
        for name, load in mechanism.loads.items()
    }
    return replace(mechanism, loads=Table(loads))


def with_tables(mechanism: Mechanism, folder: Path) -> Mechanism:
    """Return the mechanism with the files of its table loads read.

    Raises
    ------
    InputError
        With the key path of the load: no such file, not in the folder, gaps, abscissae that
        do not rise.
    """
    loads = dict(mechanism.loads)
    if not any(isinstance(load, TableLoad) and load.file for load in loads.values()):
        return mechanism
    for name, load in loads.items():
        if isinstance(load, TableLoad) and load.file is not None:
            try:
                rows = _read(_inside(folder, load.file), load.columns)
                loads[name] = replace(load, from_file=rows)
            except MechdaeError as problem:
                raise problem.inside(f"loads.{name}") from None
    return replace(mechanism, loads=Table(loads))


def with_time_tables(tasks: Table[Task], folder: Path) -> Table[Task]:
    """Return the tasks with the files of their drivers' tables read.

    Raises
    ------
    InputError
        With the key path of the driver.
    """
    result = dict(tasks)
    for name, task in tasks.items():
        drivers: tuple[Driver, ...] = getattr(task, "drivers", None) or ()
        if not any(driver.table is not None and driver.table.file for driver in drivers):
            continue
        read = []
        for i, driver in enumerate(drivers):
            table, changed = driver.table, driver
            try:
                if table is not None and table.file is not None:
                    rows = _read(_inside(folder, table.file), table.columns)
                    changed = replace(driver, table=replace(table, from_file=rows))
            except MechdaeError as problem:
                raise problem.inside(f"tasks.{name}.drivers[{i}].table") from None
            read.append(changed)
        changed_task: Any = task
        result[name] = replace(changed_task, drivers=tuple(read))
    return Table(result) if any(result[n] is not task for n, task in tasks.items()) else tasks


def _tables(mechanism: Mechanism, tasks: Mapping[str, Task]) -> Iterator[tuple[str, Any]]:
    """Yield the tables that have been read from files, with their key paths."""
    for name, load in mechanism.loads.items():
        if isinstance(load, TableLoad) and load.file is not None and load.from_file is not None:
            yield f"loads.{name}", load
    for name, task in tasks.items():
        for i, driver in enumerate(getattr(task, "drivers", None) or ()):
            if driver.table is not None and driver.table.from_file is not None:
                yield f"tasks.{name}.drivers[{i}].table", driver.table


def write_tables(mechanism: Mechanism, tasks: Mapping[str, Task], folder: Path) -> None:
    """Write the files of tables into another folder, with the columns that are used.

    Raises
    ------
    InputError
        With the key path of the load: a file of that name with other numbers is there.
    """
    files: dict[str, dict[str, Any]] = {}
    for name, load in _tables(mechanism, tasks):
        files.setdefault(load.file, {})[name] = load
    for file, loads in files.items():
        path = folder / file
        if path.exists():
            for name, load in loads.items():
                if _read(path, load.columns) != load.from_file:
                    raise InputError(
                        f"another file '{shorten(file, 60)}' is in the folder written to",
                        where=f"{name}.file",
                    )
            continue
        columns: dict[str, list[float]] = {}
        for load in sorted(loads.values(), key=lambda load: load.columns is not None):
            for place, name in enumerate(load.columns or ("abscissa", "value")):
                columns[name] = [row[place] for row in load.from_file or ()]
        path.parent.mkdir(parents=True, exist_ok=True)
        import csv  # only where there are tables
        import io

        from mechdae.describe.file.atomic_write import whole_file

        lines = [list(columns), *map(list, zip(*columns.values(), strict=True))]
        with whole_file(path) as file:
            stream = io.TextIOWrapper(file, encoding="utf-8", newline="", write_through=True)
            csv.writer(stream, lineterminator="\n").writerows(lines)
            stream.detach()


def _inside(folder: Path, file: str) -> Path:
    path = folder / file
    base = folder.resolve()
    if Path(file).is_absolute() or base not in path.resolve().parents:
        raise InputError(
            f"'{shorten(file, 60)}' is not below the folder of the problem file", where="file"
        )
    if not path.is_file():
        raise InputError(f"there is no file '{shorten(file, 60)}'", where="file")
    if path.stat().st_size > MAX_BYTES:
        raise InputError(f"more than {MAX_BYTES / 1e6:.0f} MB", where="file")
    return path


def _read(path: Path, columns: tuple[str, ...] | None) -> Rows:
    """Return the pairs of numbers of a CSV file."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError):
        raise InputError("is not a text file in UTF-8", where="file") from None
    import csv

    lines = [
        (place, row)
        for place, row in enumerate(csv.reader(_kept(text.splitlines())), start=1)
        if row
    ]
    if not lines:
        raise InputError("holds no rows", where="file")
    header = [cell.strip() for cell in lines[0][1]]
    known = [_number(cell) is not None for cell in header[:2]]
    titled = not any(known) if columns is None else not all(known)
    if columns is not None and not titled:
        raise InputError("the file has no header with names of columns", where="columns")
    chosen = [0, 1]
    if columns is not None:
        if len(columns) != 2:
            raise InputError("two columns are needed: abscissa, value", where="columns")
        for column in columns:
            if column not in header:
                raise UnknownName("column", column, header, where="columns")
        chosen = [header.index(column) for column in columns]
    rows = []
    for place, row in lines[titled:]:
        numbers = [_number(row[k]) if k < len(row) else None for k in chosen]
        if None in numbers:
            raise InputError(
                f"row {place} has a gap or no number",
                where="file",
                hint="fill it or delete the row",
            )
        rows.append((numbers[0], numbers[1]))
    if len(rows) < 2:
        raise InputError("two rows at least are needed", where="file")
    return tuple(rows)  # type: ignore[arg-type]


def _kept(lines: Iterable[str]) -> Iterable[str]:
    """Return the lines; those of comments are empty."""
    return ["" if line.lstrip().startswith("#") else line for line in lines]


def _number(cell: str) -> float | None:
    try:
        value = float(cell)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
