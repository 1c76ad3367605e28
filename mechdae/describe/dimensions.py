"""Units of parameters and of named outputs, from where and how a problem uses them.

Inside the program numbers are SI without a unit. A parameter that is the length of a link
somewhere is in metres, one in ``cos(...)`` in radians, the speed of a driver in rad/s.
Where no use tells, or two uses contradict each other, the unit stays unknown.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from itertools import chain, repeat
from typing import Any

from mechdae.describe.coordinates import split_rate, unit_of
from mechdae.describe.mechanism import WHOLE_UNITS, Mechanism
from mechdae.describe.tasks.kinds import Driver, Task
from mechdae.describe.units import Powers, fits, powers_of, text_of
from mechdae.describe.values import Value

Use = tuple[Any, Powers | None, str]
"""A number, its unit, and where it stands."""
Typed = tuple[Any, str | None, str]
"""The same with the unit as it is written."""
SPEEDS = ("speed", "acceleration", "jerk")
"""Keys of the rates of a driver."""
TASK_NUMBERS = {
    "until": "s", "max_step": "s", "linearise": "s", "v_s": "m/s", "omega_s": "rad/s"
}  # fmt: skip


def parameter_units(mechanism: Mechanism, tasks: Iterable[Task] = ()) -> dict[str, str]:
    """Return name -> unit of parameters and automatic names, as far as it is known.

    ``m``, ``rad``, ``1``, ``rad/s``, ``kg m2``, ``N/m``.
    """
    known = _inferred(mechanism, _uses(mechanism, tasks))
    automatic = {name: powers_of(unit) for name, unit in _automatic(mechanism)}
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
    automatic = dict(_automatic(mechanism))
    found: list[Typed] = [
        (number, automatic[name], name) for name, number in mechanism.numbers() if name in automatic
    ]
    for name, load in mechanism.loads.items():
        numbers = load.with_units(lambda text: unit_of(mechanism, text) == "rad")
        found += [(n, unit, f"loads.{name}.{word}") for n, unit, word in numbers]
    for name, number in mechanism.sketch.items():
        found.append((number, unit_of(mechanism, str(name)), f"sketch.{name}"))
    for task, name in zip(tasks, chain(names, repeat("")), strict=False):
        found += [(n, unit, f"tasks.{name}.{word}") for n, unit, word in _of_task(mechanism, task)]
    found += [(text, None, f"outputs.{name}") for name, text in mechanism.outputs.items()]
    return [(number, powers_of(unit) if unit else None, place) for number, unit, place in found]


def _automatic(mechanism: Mechanism) -> Iterator[tuple[str, str]]:
    """Yield the automatic names with their units."""
    for name, _ in mechanism.numbers():
        part, *rest = name.split(".")
        if part == "loads":
            continue  # below, with what they act on
        if part in WHOLE_UNITS:
            yield name, WHOLE_UNITS[part]
        elif part in mechanism.joints:
            entries = {entry.name: entry.metadata for entry in fields(mechanism.joints[part])}
            # the ends of a curve's range are no fields, and s has no unit
            unit = entries[rest[0]].get("unit") if rest[0] in entries else None
            if unit:
                yield name, unit
        else:
            yield name, {"mass": "kg", "inertia": "kg m2"}.get(rest[0], "m")


def _of_task(mechanism: Mechanism, task: Task) -> Iterator[Typed]:
    """Yield the numbers of a task with their places inside of it."""
    for word, unit in TASK_NUMBERS.items():
        yield getattr(task, word, None), unit, word
    for word, rate in (("start", ""), ("start_speed", "/s")):
        for name, number in (getattr(task, word, None) or {}).items():
            base = unit_of(mechanism, str(name).removesuffix(".speed"))
            yield number, base and f"{base}{rate}", f"{word}.{name}"
    for watched in getattr(task, "events", None) or ():
        name, order = split_rate(watched.coordinate)
        base = unit_of(mechanism, name)
        if base is not None:
            yield watched.crosses, f"{base}/s" if order else base, "events"
    several = getattr(task, "drivers", None) or ()
    for driver in (*several, getattr(task, "driver", None)):
        if isinstance(driver, Driver):
            yield from _of_driver(mechanism, driver)
    yield from _nested(task)


def _of_driver(mechanism: Mechanism, driver: Driver) -> Iterator[Typed]:
    unit = unit_of(mechanism, driver.coordinate)
    if unit is None:
        return
    ends = unit if driver.law is None else "s"
    yield driver.law, unit, "driver.law"
    yield driver.from_, ends, "driver.from"
    yield driver.to, ends, "driver.to"
    yield from ((number, unit, "driver.at") for number in driver.at or ())
    yield from ((number, "s", "driver.times") for number in driver.times or ())
    for order, word in enumerate(SPEEDS, start=1):
        yield getattr(driver, word), f"{unit}/s{order if order > 1 else ''}", f"driver.{word}"


def _nested(value: Any, place: str = "") -> Iterator[Typed]:
    """Yield the numbers of goals and constraints whose keys have a unit."""
    for entry in fields(value):
        content, where = getattr(value, entry.name), f"{place}{entry.name}"
        if entry.metadata.get("unit"):
            numbers = content if isinstance(content, tuple) else (content,)
            yield from ((n, entry.metadata["unit"], where) for n in numbers)
            continue
        for part in content if isinstance(content, tuple) else (content,):
            if isinstance(part, Value) and not isinstance(part, Driver):
                yield from _nested(part, f"{where}.")
