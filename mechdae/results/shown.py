"""How a result is shown: printed, as the last line of a cell, as a table of pandas."""

from __future__ import annotations

import importlib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, cast

import numpy as np

from mechdae.describe.units import KNOWN, units_of
from mechdae.types import Floats

FRAMES = "mechdae.results.frames"
"""It knows results: what tables of other packages have of them."""


def shown_columns(result: Any) -> list[tuple[str, str, Floats]]:
    """Return the columns of a result in the units that were asked for, else in SI."""
    if not result.units.asked:
        return list(result.columns())
    found, units = [], units_of(result.units.asked)
    for name, unit, array in result.columns():
        shown = units.of(unit)
        found.append((name, shown.name, array if shown.factor == 1 else array * shown.factor))
    return found


def heads(columns: Iterable[tuple[str, str, Floats]]) -> list[str]:
    """Return the heads of columns: names with units, as in the CSV."""
    return [f"{name} [{unit}]" if unit else name for name, unit, _ in columns]


def mixed_units(titles: Sequence[str]) -> str:
    """Return which units of one quantity stand side by side, in heads of columns."""
    seen = dict.fromkeys(title[:-1].rpartition("[")[2] for title in titles if title[-1:] == "]")
    kinds: dict[str, list[str]] = {}
    for name in seen:
        base = name.split("/")[0]
        if base in KNOWN:
            quantity, unit, _, _ = KNOWN[base]
            kinds.setdefault({"rad/s": "rad"}.get(quantity, quantity), []).append(unit)
    several = [dict.fromkeys(names) for names in kinds.values() if len(set(names)) > 1]
    return "; ".join(" and ".join(names) for names in several)


class Shown:
    """What results have in common when they are shown.

    Tables and pictures are made by rooms that know results, not the other way round: they are
    asked for by name, when something is shown.
    """

    def __str__(self) -> str:
        """Return a screen: what ``mechdae solve`` prints."""
        text: str = importlib.import_module("mechdae")._shown("text", self)
        return text.rstrip("\n")

    def __repr__(self) -> str:
        """Return one line: problem, task, number of poses of each status."""
        content: Any = self
        counts = Counter(np.asarray(content.status, str).tolist())
        found = ", ".join(f"{count} {status}" for status, count in counts.items())
        return f"<{type(self).__name__} {content.problem} / {content.task}: {found}>"

    def _repr_html_(self) -> str:
        """Return a short table and the usual picture, for notebooks."""
        html: str = importlib.import_module("mechdae")._shown("html", self)
        return html

    def frame(self) -> Any:
        """Return all scalar series as a ``pandas.DataFrame``.

        A row for each pose, its index the time or the driver that moves; columns as in the CSV:
        status, of assembly modes their label, then names with units (``rod.B.velocity.x [m/s]``).

        Raises
        ------
        UnavailableError
            pandas is not installed.
        """
        return importlib.import_module(FRAMES).frame(self)

    def to_xarray(self) -> Any:
        """Return all scalar series as an ``xarray.Dataset``.

        Its dimension is the time or the driver that moves, else ``pose``; variables are named as
        in the CSV and have their unit as the attribute ``units``.

        Raises
        ------
        UnavailableError
            xarray is not installed.
        """
        return importlib.import_module(FRAMES).dataset(self)


class StudyTable(Mapping[str, "Floats"]):
    """Values in each row of a study, by path; called it is a result's table as text."""

    def __init__(self, result: Shown, values: Mapping[str, Floats]) -> None:
        self._result, self._values = result, values

    def __getitem__(self, path: str) -> Floats:
        return self._values[path]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __repr__(self) -> str:
        return repr(dict(self._values))

    def __call__(self, columns: str | Sequence[str] | None = None, width: int = 0) -> str:
        """Return what ``mechdae solve`` prints, with these columns in place of the usual ones.

        Parameters
        ----------
        columns
            Names of columns of the table, or of the CSV or their beginnings: ``"rod.B.velocity"``.
        width
            Of the longest line of the table, 100 without it.

        Raises
        ------
        UnknownName
            No such column, with the nearest.
        """
        names = columns.split(",") if isinstance(columns, str) else columns
        names = None if names is None else [name.strip() for name in names]
        text: str = importlib.import_module("mechdae")._shown("text", self._result, names, width)
        return text.rstrip("\n")


class RowsOfResult:
    """The table of a result: what a study keeps there, and a call for all."""

    def __get__(self, result: Shown | None, kind: type | None = None) -> StudyTable:
        if result is None:  # the default of a field
            return cast("StudyTable", self)
        return StudyTable(result, result.__dict__.get("table") or {})

    def __set__(self, result: Shown, values: object) -> None:
        result.__dict__["table"] = dict(values) if isinstance(values, Mapping) else {}
