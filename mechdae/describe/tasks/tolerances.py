"""Tolerances of parameters: half widths of the ranges that they lie evenly in."""

from __future__ import annotations

from collections.abc import Mapping

from mechdae.describe.expression import evaluate
from mechdae.describe.file.reading import split_known, to_si
from mechdae.describe.file.units import check_number, check_parameter
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.tasks.kinds import Task
from mechdae.describe.values import Number
from mechdae.errors import InputError, MechdaeError, UnknownName


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
    for key, number in table.items():
        try:
            name, suffix = split_known(key, values)
            if name not in values:
                raise UnknownName("parameter", key, values)
            if name in found:
                raise InputError(f"'{name}' is given twice, with and without a unit")
            check_number(mechanism, name, suffix)
            if suffix and name in mechanism.parameters:
                check_parameter(mechanism, tasks, name, suffix)
            found[name] = evaluate(to_si(number, suffix), known)
            if found[name] < 0:
                raise InputError("a half width is not negative")
        except MechdaeError as error:
            place = "tolerances" if error.where == key else f"tolerances.{key}"
            raise error.inside(place) from None
    return found
