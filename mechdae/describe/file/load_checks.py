"""What needs the whole mechanism: checks of what loads refer to, a problem as text for a screen."""

from __future__ import annotations

import html
import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import fields
from importlib import import_module
from typing import Any

from mechdae.describe.coordinates import coordinate, split_rate
from mechdae.describe.dimensions import parameter_units
from mechdae.describe.expression import unknown_name
from mechdae.describe.loads import (
    TIME,
    VECTORS,
    Force,
    Load,
    Resistance,
    Spring,
    TableLoad,
    Torque,
)
from mechdae.describe.mechanism import GROUND, Body, Ground, Mechanism
from mechdae.describe.named import check_expression
from mechdae.describe.tasks.kinds import Task
from mechdae.errors import InputError, MechdaeError, UnknownName


def check_loads(mechanism: Mechanism) -> None:
    """Raise for a load on something that does not exist.

    Raises
    ------
    UnknownName, InputError
        With the load's key path.
    """
    for name, load in mechanism.loads.items():
        try:
            _check_load(mechanism, load)
            for entry in fields(load):
                for number in _numbers(getattr(load, entry.name), entry.metadata.get("kind", "")):
                    check_expression(mechanism, number, entry.name)
        except MechdaeError as problem:
            raise problem.inside(f"loads.{name}") from None


def _check_load(mechanism: Mechanism, load: Load) -> None:
    if isinstance(load, Force):
        _point(mechanism, load.point, "point")
        if load.point.split(".")[0] == GROUND:
            raise InputError("a force on the ground does nothing", where="point")
        _components(mechanism, load.value)
        if load.frame != "world":
            _body(mechanism, load.frame, "frame")
    elif isinstance(load, Torque):
        _body(mechanism, load.body, "body")
        _moment(mechanism, load)
    elif isinstance(load, Spring):
        if (load.between is None) == (load.coordinate is None):
            word = ", not both" if load.between else ""
            raise InputError(f"a spring needs 'between' or 'coordinate'{word}")
        for reference in load.between or ():
            _point(mechanism, reference, "between")
        if load.between is not None and len(load.between) != 2:
            raise InputError("two points are needed", where="between")
    elif isinstance(load, TableLoad):
        if load.body is not None:
            _body(mechanism, load.body, "body")
        _table_axis(mechanism, load)
        if load.along is not None:
            try:
                coordinate(mechanism, load.along)
            except MechdaeError as problem:
                raise problem.inside("along") from None
    if isinstance(load, TableLoad) and load.coordinate == TIME:
        known = mechanism.parameter_values
        for word in ("shift", "period"):
            unknown_name([getattr(load, word)], known, place=word)
    elif isinstance(load, Resistance | Spring | TableLoad) and load.coordinate is not None:
        try:
            base, order = split_rate(load.coordinate)
            at_speed = isinstance(load, TableLoad) and order == 1
            coordinate(mechanism, base if at_speed else load.coordinate)
        except MechdaeError as problem:
            raise problem.inside("coordinate") from None


def _components(mechanism: Mechanism, value: tuple[float | str, ...]) -> None:
    if len(value) != mechanism.dimension:
        count = {2: "two", 3: "three"}[mechanism.dimension]
        raise InputError(f"{count} numbers are needed, not {len(value)}", where="value")


def _moment(mechanism: Mechanism, load: Torque) -> None:
    """Raise for a torque of the plane in space and the other way round."""
    if mechanism.dimension == 2:
        if isinstance(load.value, tuple):
            raise InputError("one number is needed in the plane", where="value")
        if load.frame != "world":
            raise InputError("a torque of the plane has no axes", where="frame")
        return
    if not isinstance(load.value, tuple):
        raise InputError(
            "three numbers are needed in space", where="value", hint="[Mx, My, Mz] in world axes"
        )
    if load.frame != "world":
        _body(mechanism, load.frame, "frame")


def _table_axis(mechanism: Mechanism, load: TableLoad) -> None:
    """Raise for a torque in space without an axis, and for an axis of what has none."""
    if load.body is not None and mechanism.dimension == 3:
        if load.axis is None:
            raise InputError(
                f"a torque in space needs the axis about which it turns {load.body}",
                where="axis",
                hint="axis = [0, 0, 1] in world axes, or in those of frame = 'BODY'; or "
                "along = 'JOINT.angle', which turns one body against another",
            )
        if load.frame != "world":
            _body(mechanism, load.frame, "frame")
        return
    what = "a torque of the plane" if load.body is not None else "a force along a coordinate"
    for word, given in (("axis", load.axis is not None), ("frame", load.frame != "world")):
        if given:
            raise InputError(f"{what} has no axes of its own", where=word, hint="leave it out")


def _point(mechanism: Mechanism, reference: str, place: str) -> None:
    parts: list[tuple[str, Body | Ground]] = [(GROUND, mechanism.ground), *mechanism.bodies.items()]
    known = [f"{name}.{point}" for name, body in parts for point in body.points]
    if reference not in known:
        raise UnknownName("point", reference, known, where=place)


def _body(mechanism: Mechanism, name: str, place: str) -> None:
    if name not in mechanism.bodies:
        raise UnknownName("body", name, mechanism.bodies, where=place)


def _numbers(value: Any, kind: str) -> list[float | str]:
    if kind not in ("number", "numbers", *VECTORS) or value is None:
        return []
    return list(value) if isinstance(value, tuple) else [value]


WIDE = 100
MOST = 24
"""Parts of a kind that are listed."""


def in_notebook(subject: object, text: str) -> str:
    """Return the diagram of a problem's or mechanism's sketch and a text, for notebooks."""
    url = import_module("mechdae")._sketched(subject)
    picture = f'<img src="{url}" alt="as sketched">' if url else ""
    return f"{picture}<pre>{html.escape(text)}</pre>"


def mechanism_lines(mechanism: Mechanism, tasks: Mapping[str, Task]) -> list[str]:
    """Return what a mechanism is made of, a part in each line, and its numbers with units."""
    points: Mapping[str, Body | Ground] = {GROUND: mechanism.ground, **mechanism.bodies}
    lines = ["bodies"]
    lines += _listed(
        f"{name}: {', '.join(body.points) or 'no points'}" for name, body in points.items()
    )
    lines.append("joints")
    lines += _listed(
        f"{name}: {joint.kind} {joint.first} - {joint.second}"
        for name, joint in mechanism.joints.items()
    )
    if mechanism.loads:
        lines.append("loads")
        lines += _listed(f"{name}: {load.kind}" for name, load in mechanism.loads.items())
    if mechanism.parameters:
        values, units = mechanism.parameter_values, parameter_units(mechanism, tasks.values())
        named = ((name, units.get(name, "")) for name in mechanism.parameters)
        texts = [f"{name} = {values[name]:.6g} {unit.strip('1')}".rstrip() for name, unit in named]
        more = f"; {len(texts) - MOST} more" if len(texts) > MOST else ""
        lines += ["parameters", *_wrapped(", ".join(texts[:MOST]) + more)]
    return lines


def tasks_lines(tasks: Mapping[str, Any]) -> list[str]:
    """Return the tasks of a problem with what drives them."""
    lines = ["tasks"] if tasks else []
    for name, task in tasks.items():
        drivers = getattr(task, "all_drivers", ())
        driven = (
            f", driven by {', '.join(driver.coordinate for driver in drivers)}" if drivers else ""
        )
        lines.append(f"  {name}: {task.kind}{driven}")
    return lines


def _listed(texts: Iterable[str]) -> list[str]:
    """Return the texts as lines; of many parts the first ones and how many there are."""
    every = list(texts)
    lines = [line for text in every[:MOST] for line in _wrapped(text)]
    return lines + ([f"  ... and {len(every) - MOST} more"] if len(every) > MOST else [])


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(text, WIDE, initial_indent="  ", subsequent_indent="      ")
