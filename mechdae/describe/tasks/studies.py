"""One task for many sets of numbers, and what a change of numbers does to it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from mechdae.describe.file.reading import split_unit, to_si
from mechdae.describe.tasks.kinds import Task
from mechdae.describe.values import Number, key
from mechdae.errors import InputError
from mechdae.records import dataclass


@dataclass(frozen=True)
class Study(Task):
    """A task over a grid of parameters (``vary``) or over sets of them (``samples``)."""

    vary: Mapping[str, Sequence[Number]] | None = key(
        "grid", None, doc="name -> [from, to, count]; all combinations"
    )
    samples: Mapping[str, Sequence[Number]] | None = key(
        "lists", None, doc="name -> [values], as many for each name"
    )
    of: str | None = key("text", None, doc="the sweep, motion or equilibrium repeated")
    outputs: tuple[str, ...] | None = key("names", None, doc="paths below that task in the JSON")
    certify: bool = key("flag", True, doc="false: dyads in closed form, without certificates")

    kind: ClassVar[str] = "study"
    available: ClassVar[bool] = True
    holds: ClassVar[tuple[str, ...]] = ("grid",)

    @classmethod
    def from_table(cls, table: Mapping[str, Any]) -> Mapping[str, Any]:
        if not isinstance(table.get("vary"), Mapping):
            return table
        vary: dict[str, list[float]] = {}
        for entry, items in table["vary"].items():
            base, suffix = split_unit(entry)
            if not isinstance(items, list) or len(items) != 3:
                raise InputError("[from, to, count] is needed", where=f"vary.{entry}")
            if base in vary:
                raise InputError(f"'{base}' is given twice, with and without a unit", where="vary")
            vary[base] = [*to_si(items[:2], suffix), items[2]]  # a count has no unit
        return {**table, "vary": vary}


@dataclass(frozen=True)
class Sensitivity(Task):
    """Derivatives of outputs with respect to parameters, and what tolerances do to them."""

    of: str | None = key("text", None, doc="the sweep, reactions, motion or equilibrium task")
    outputs: tuple[str, ...] | None = key("names", None, doc="paths below that task in the JSON")
    wrt: tuple[str, ...] | None = key("names", None, doc="parameters and automatic names")
    order: int = key("whole", 1, doc="1, or 2 for second derivatives too")
    tolerances: Mapping[str, Number] | None = key("coordinates", None, doc="name -> half width")

    kind: ClassVar[str] = "sensitivity"
    available: ClassVar[bool] = True
