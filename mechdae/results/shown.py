"""How a result is shown: printed, as the last line of a cell, as a table of pandas."""

from __future__ import annotations

import importlib
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from mechdae.describe.units import KNOWN, units_of
from mechdae.errors import UnavailableError
from mechdae.types import Floats


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

        A row for each pose; columns as in the CSV: status, of assembly modes their label, then
        names with units (``rod.B.velocity.x [m/s]``).

        Raises
        ------
        UnavailableError
            pandas is not installed.
        """
        try:
            pandas = importlib.import_module("pandas")
        except ImportError:
            raise UnavailableError(
                "a frame needs pandas, which is not installed",
                where="frame",
                hint="pip install pandas, or columns() without it",
            ) from None
        content: Any = self
        columns = shown_columns(content)
        table: dict[str, object] = {"status": np.asarray(content.status, str)}
        if content.labels:
            table["mode"] = [",".join(row) for row in content.labels]
        values = (np.asarray(array, float) for _, _, array in columns)
        return pandas.DataFrame(table | dict(zip(heads(columns), values, strict=True)))
