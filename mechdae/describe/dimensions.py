"""Units of parameters and of named outputs, from where and how a problem uses them.

Inside the program numbers are SI without a unit. A parameter that is the length of a link
somewhere is in metres, one in ``cos(...)`` in radians, the speed of a driver in rad/s.
Where no use tells, or two uses contradict each other, the unit stays unknown.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from functools import partial
from itertools import chain, repeat
from typing import Any

from mechdae.describe.coordinates import unit_of, unit_within
from mechdae.describe.mechanism import WHOLE_UNITS, Mechanism
from mechdae.describe.tasks.kinds import Task
from mechdae.describe.units import Powers, fits, powers_of, text_of
from mechdae.describe.values import UnitOf, Value

Use = tuple[Any, Powers | None, str]
"""A number, its unit, and where it stands."""
Typed = tuple[Any, str | None, str]
"""The same with the unit as it is written."""
SPEEDS = ("speed", "acceleration", "jerk")
"""Keys of the rates of a driver."""


def parameter_units(mechanism: Mechanism, tasks: Iterable[Task] = ()) -> dict[str, str]:
    """Return name -> unit of parameters and automatic names, as far as it is known.

    ``m``, ``rad``, ``1``, ``rad/s``, ``kg m2``, ``N/m``.
    """
    known = _inferred(mechanism, _uses(mechanism, tasks))
    automatic = {name: powers_of(unit) for name, unit in automatic_units(mechanism)}
    units = {name: text_of(powers) for name, powers in automatic.items() if powers is not None}
    return units | {name: text_of(powers) for name, powers in known.items() if powers is not None}


def typed_numbers(mechanism: Mechanism, tasks: Iterable[Task], least: int) -> Counter[str]:
    """Return how many numbers that are typed, 0 aside, are in each unit of SI.

    Parameters are left out where no unit comes to `least` of them.
    """
    tasks = tuple(tasks)
    uses = [(n, powers) for n, powers, _ in _uses(mechanism, tasks) if isinstance(n, float) and n]
    found = Counter(text_of(powers) for _, powers in uses if powers)
    given = [name for name, n in mechanism.parameters.items() if isinstance(n, float) and n]
    if len(given) + max(found.values(), default=0) > least:
        units = parameter_units(mechanism, tasks)
        found.update(units.get(name, "") for name in given)
    return found


def misfit(
    mechanism: Mechanism, tasks: Mapping[str, Task], typed: Mapping[str, str]
) -> tuple[str, str, str] | None:
    """Return the first of the parameters `typed` with a suffix whose unit a use does not have.

    Name, unit of the use, and where it is. Uses that tell nothing for sure are left out: products
    with numbers that may have units of their own (``0.01*n``).
    """
    parameters = mechanism.parameters
    uses = _uses(mechanism, tasks.values(), tasks)
    uses += [(number, None, f"parameters.{name}") for name, number in parameters.items()]
    known = _inferred(mechanism, uses, exact=True)
    for number, powers, place in uses:
        if not isinstance(number, str):
            continue
        if place.startswith("parameters."):
            powers = known.get(place.removeprefix("parameters."))
        if number in typed:
            if powers is not None and not fits(typed[number], powers):
                return number, text_of(powers), place
        elif number not in parameters:
            from mechdae.describe.expression_units import misfit_in

            found = misfit_in(mechanism, known, typed, number, powers)
            if found is not None:
                alone = number.strip("- ") in typed
                return (*found, place if alone else f"used in {place}")
    return None


def _inferred(
    mechanism: Mechanism, uses: Sequence[Use], exact: bool = False
) -> dict[str, Powers | None]:
    """Return what all uses tell of parameters."""
    parameters = mechanism.parameters
    names = [(number, powers) for number, powers, _ in uses if isinstance(number, str)]
    derived = any(isinstance(number, str) for number in parameters.values())
    if derived or any(number not in parameters for number, _ in names):
        from mechdae.describe.expression_units import inferred

        return inferred(mechanism, [(number, powers) for number, powers, _ in uses], exact)
    known: dict[str, Powers | None] = {}
    for name, powers in names:
        if powers is not None:
            known[name] = powers if known.get(name, powers) == powers else None
    return known


def _uses(mechanism: Mechanism, tasks: Iterable[Task], names: Iterable[str] = ()) -> list[Use]:
    """Return the numbers of a problem with their units and their places."""
    automatic = dict(automatic_units(mechanism))
    found: list[Typed] = [
        (number, automatic[name], name)
        for name, number in mechanism.numbers()
        if name in automatic and not name.startswith("loads.")
    ]
    for name, joint in mechanism.joints.items():
        found += [(count, "1", f"{name}.teeth") for count in getattr(joint, "teeth", None) or ()]
        found += [(getattr(joint, way), "m", name) for way in "xy" if hasattr(joint, way)]
    for name, load in mechanism.loads.items():
        found += _numbers(load, partial(unit_within, mechanism, None), f"loads.{name}.")
    for name, number in mechanism.sketch.items():
        found.append((number, unit_of(mechanism, str(name)), f"sketch.{name}"))
    for task, name in zip(tasks, chain(names, repeat("")), strict=False):
        found += _numbers(task, partial(unit_within, mechanism, task), f"tasks.{name}.")
    found += [(text, None, f"outputs.{name}") for name, text in mechanism.outputs.items()]
    return [(number, powers_of(unit) if unit else None, place) for number, unit, place in found]


def automatic_units(mechanism: Mechanism) -> Iterator[tuple[str, str]]:
    """Yield the automatic names with their units."""
    for name, _ in mechanism.numbers():
        part, *rest = name.split(".")
        if part == "loads":
            load = mechanism.loads[rest[0]]
            units = load.units_by_key(partial(unit_within, mechanism, None))
            unit = units.get(rest[1]) or _by_field(load, rest[1])
            if isinstance(unit, str):
                yield name, unit
        elif part in WHOLE_UNITS:
            yield name, WHOLE_UNITS[part]
        elif part in mechanism.joints:
            unit = _by_field(mechanism.joints[part], rest[0])
            if unit:  # the ends of a curve's range are no fields, and s has no unit
                yield name, unit
        else:
            yield name, {"mass": "kg", "inertia": "kg m2"}.get(rest[0], "m")


def _by_field(value: Value, word: str) -> str | None:
    """Return the unit that a field always has."""
    return next((f.metadata.get("unit") for f in fields(value) if f.name == word), None)


def _numbers(value: Value, unit_of: UnitOf, place: str) -> Iterator[Typed]:
    """Yield the numbers of a description whose keys have a unit, with their places."""
    by_key = value.units_by_key(unit_of)
    for entry in fields(value):
        word, content = entry.name.rstrip("_"), getattr(value, entry.name)
        unit = by_key.get(word, entry.metadata.get("unit"))
        if isinstance(unit, Mapping):
            yield from (
                (content[name], each, f"{place}{word}.{name}") for name, each in unit.items()
            )
        elif unit:
            numbers = content if isinstance(content, tuple) else (content,)
            yield from ((n, unit, f"{place}{word}") for n in numbers)
        else:
            for part in content if isinstance(content, tuple) else (content,):
                if isinstance(part, Value):
                    yield from _numbers(part, unit_of, f"{place}{word}.")
