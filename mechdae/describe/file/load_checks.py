"""Checks that need the whole mechanism: what loads refer to."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from mechdae.describe.coordinates import coordinate, split_rate
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
