"""One task for many sets of numbers, and what a change of numbers does to it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from mechdae.describe.expression import evaluate
from mechdae.describe.file.reading import split_known, split_unit, to_si
from mechdae.describe.file.units import check_number
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.tasks.kinds import Task
from mechdae.describe.values import Number
from mechdae.errors import InputError, MechdaeError, UnknownName
from mechdae.records import dataclass, optional

if TYPE_CHECKING:
    from mechdae.describe.values import NamesOrNone


@dataclass(frozen=True)
class Study(Task):
    """A task over a grid of parameters (``vary``) or over sets of them (``samples``).

    Examples
    --------
    >>> grid, outputs = {"crank": (0.03, 0.05, 3)}, ["summary/swing/rocker"]
    >>> study = md.Study(vary=grid, of="turn", outputs=outputs)
    >>> result = md.solve(md.four_bar(0.1, 0.04, 0.12, 0.08).with_task("map", study), "map")
    >>> result.table["summary/swing/rocker"].round(3).tolist()
    [0.937, 1.288, 1.699]
    """

    vary: Mapping[str, Sequence[Number]] | None = optional(
        "grid", doc="name -> [from, to, count]; all combinations"
    )
    samples: Mapping[str, Sequence[Number]] | None = optional(
        "lists", doc="name -> [values], as many for each name"
    )
    of: str | None = optional("text", doc="the task that is repeated, by its name")
    outputs: NamesOrNone = optional("names", doc="paths below that task in the JSON")
    certify: bool = optional("flag", True, doc="false: dyads in closed form, without certificates")

    kind: ClassVar[str] = "study"
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
    """Derivatives of outputs with respect to parameters, and what tolerances do to them.

    Examples
    --------
    >>> task = md.Sensitivity(of="turn", outputs=["summary/swing/rocker"], wrt=["crank"])
    >>> result = md.solve(md.four_bar(0.1, 0.04, 0.12, 0.08), task)
    >>> round(result.value("derivatives")["summary/swing/rocker"]["crank"], 2)
    37.26
    """

    of: str | None = optional("text", doc="the task, by its name")
    outputs: NamesOrNone = optional("names", doc="paths below that task in the JSON")
    wrt: NamesOrNone = optional("names", doc="parameters and automatic names")
    order: int = optional("whole", 1, doc="1, or 2 for second derivatives too")
    tolerances: Mapping[str, Number] | None = optional("coordinates", doc="name -> half width")

    kind: ClassVar[str] = "sensitivity"


def half_widths(
    mechanism: Mechanism, tasks: Mapping[str, Task], table: Mapping[str, Number]
) -> dict[str, float]:
    """Return half widths [SI, rad] by name of parameters or automatic names.

    Parameters
    ----------
    tasks
        Of the problem: they tell units of parameters too.
    table
        Numbers or expressions by name, with a unit at its end where it is not metre or radian.

    Raises
    ------
    InputError, UnknownName
        With the key path: a name that is unknown, given twice, in a wrong unit, or below zero.
    """
    known, values = mechanism.parameter_values, mechanism.values()
    found: dict[str, float] = {}
    for text, number in table.items():
        try:
            name, suffix = split_known(text, values)
            if name not in values:
                raise UnknownName("parameter", text, values)
            if name in found:
                raise InputError(f"'{name}' is given twice, with and without a unit")
            check_number(mechanism, tasks, name, suffix)
            found[name] = evaluate(to_si(number, suffix), known)
            if found[name] < 0:
                raise InputError("a half width is not negative")
        except MechdaeError as error:
            place = "tolerances" if error.where == text else f"tolerances.{text}"
            raise error.inside(place) from None
    return found
