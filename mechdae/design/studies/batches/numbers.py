"""The numbers of many sets of a study as columns: parameters, sketches, rates of the driver.

Expressions are evaluated on columns of Python's floats, operation by operation as of a single set:
a set has the same numbers to the last bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.expression import FUNCTIONS, build, evaluate, names_in
from mechdae.describe.file.problem import Problem
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.describe.tasks.kinds import Sweep
from mechdae.describe.values import Number, Table
from mechdae.equations.model import Model
from mechdae.errors import InputError, MechdaeError
from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.functions import Batch
from mechdae.motion.kinematics.prepared import Setting
from mechdae.motion.setup.drivers import sketched
from mechdae.motion.setup.scales import scale_of
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Graph, Integers, Objects

_FLOAT = {name: getattr(math, name, None) for name in FUNCTIONS} | {
    "abs": abs, "min": min, "max": max,
    "sign": lambda x: math.copysign(1.0, x) if x else 0.0,
}  # fmt: skip
_TWO = ("atan2", "hypot", "min", "max")
_COLUMNS: dict[str, Callable[..., Any]] = {
    name: np.frompyfunc(function, 2 if name in _TWO else 1, 1)
    for name, function in _FLOAT.items()
    if function is not None
}
"""Functions of expressions on columns of Python's floats."""


class Columns:
    """Values of numbers and expressions in some sets, each a float or a column (k,).

    `names`, `sets`: the numbers that differ, and their values (k, m). ``bad`` (k,): sets in which
    an expression has no value.
    """

    def __init__(self, mechanism: Mechanism, names: Sequence[str], sets: Floats) -> None:
        self.mechanism, self.count = mechanism, len(sets)
        self.bad = ~np.isfinite(sets).all(axis=1)
        given = {name: sets[:, j].astype(object) for j, name in enumerate(names)}
        self.known: dict[str, Any] = {}
        self.direct: dict[str, Floats] = {
            n: given[n] for n in given if n not in mechanism.parameters
        }
        for name in mechanism.parameters:
            self._visit(name, given)

    def _visit(self, name: str, given: Mapping[str, Any]) -> None:
        if name in self.known:
            return
        number = given.get(name, self.mechanism.parameters[name])
        if isinstance(number, str):
            for other in sorted(names_in(number)):
                self._visit(other, given)
        self.known[name] = number if name in given else self.value(number)

    def value(self, number: Number) -> Any:
        """Return the value of a number or expression: a float, or a column of floats (k,)."""
        if not isinstance(number, str):
            return float(number)
        columns = {n: self.known[n] for n in names_in(number)}
        moving = {n: column for n, column in columns.items() if isinstance(column, np.ndarray)}
        if not moving:
            return evaluate(number, columns)
        try:
            found = np.asarray(build(number, columns, _COLUMNS), object)
            if np.isfinite(found.astype(float)).all():
                return found
        except (MechdaeError, ArithmeticError, ValueError, TypeError):
            pass
        return self._one_by_one(number, columns, moving)

    def _one_by_one(
        self, number: str, columns: Mapping[str, Any], moving: Mapping[str, Objects]
    ) -> Any:
        """Return the column of an expression that has no value in some sets, nan there."""
        found = np.full(self.count, math.nan, object)
        for k in range(self.count):
            try:
                row = {n: column[k] for n, column in moving.items()}
                if all(math.isfinite(value) for value in row.values()):
                    found[k] = evaluate(number, {**columns, **row})
            except InputError:
                pass
        self.bad |= ~np.isfinite(found.astype(float))
        return found

    def number(self, name: str, number: Number) -> Any:
        """Return the value of a number with its automatic name."""
        return self.direct[name] if name in self.direct else self.value(number)


def floats(value: Objects | float, count: int) -> Floats:
    """Return a value of `Columns` as an array (count,)."""
    return np.broadcast_to(np.asarray(value, float), (count,))


@dataclass(frozen=True)
class Sketches:
    """The sketches of some sets: angles by body, values by coordinate, each (k,)."""

    angles: dict[str, float]
    places: Mapping[NamedCoordinate, Any]


@dataclass(frozen=True)
class Numbers:
    """What differs between lanes; rows are lanes.

    ``p`` (k, np). ``start`` (k,): the driver's value in the sketch, nan without. ``speed``,
    ``acceleration``, ``jerk`` (k,): of the driver. ``scale`` (k,): lengths of the mechanisms.
    ``left`` (k,): sets that are to be computed alone: values that may make no mechanism, or that
    move the poses.
    """

    p: Floats
    start: Floats
    rates: tuple[Floats, Floats, Floats]
    scale: Floats
    sketches: Sketches
    left: Booleans


def numbers_of(
    problem: Problem, task: Sweep, setting: Setting, names: Sequence[str], sets: Floats
) -> Numbers | None:
    """Return the numbers of some sets, None where the model has no symbol for what is varied."""
    mechanism, model = problem.mechanism, setting.scene.model
    columns = Columns(mechanism, names, sets)
    place = {name: i for i, name in enumerate(model.p_names)}
    if any(name not in place for name in names):
        return None
    count = len(sets)
    p = np.tile(model.p_values, (count, 1))
    for name, value in {**columns.known, **columns.direct}.items():
        if name in place and isinstance(value, np.ndarray):
            p[:, place[name]] = value.astype(float)
    driver = task.all_drivers[0]
    given = (driver.usual_speed, driver.acceleration, driver.jerk)
    rates = [floats(columns.value(0.0 if rate is None else rate), count) for rate in given]
    places = [n for n in (driver.from_, driver.to, *(driver.at or ())) if n is not None]
    moved = np.zeros(count, bool)
    for number in places:
        here = columns.value(number)
        if isinstance(here, np.ndarray):
            moved |= floats(here, count) != evaluate(number, mechanism.parameter_values)
    sketches, start = _sketches(mechanism, setting, columns)
    suspect = _suspect(mechanism, columns)
    scale = _scale(setting)(p)[0][:, 0]
    left = columns.bad | moved | suspect | ~np.isfinite(p).all(axis=1)
    left |= ~np.isfinite(np.array(rates)).all(axis=0)
    return Numbers(p, start, (rates[0], rates[1], rates[2]), scale, sketches, left)


def _sketches(mechanism: Mechanism, setting: Setting, columns: Columns) -> tuple[Sketches, Floats]:
    """Return the sketches, and the driver's value in them."""
    base, count = sketched(mechanism), columns.count
    angles: dict[str, Any] = dict(base.angles)
    places: dict[NamedCoordinate, Floats | float] = dict(base.places)
    start = setting.plan.sketch[0]
    for name, number in mechanism.sketch.items():
        value = columns.value(number)
        if not isinstance(value, np.ndarray):
            continue
        sketched_alone = sketched(replace(mechanism, sketch=Table({name: mechanism.sketch[name]})))
        (table, key), *_ = [
            (table, key)
            for table, part in ((angles, sketched_alone.angles), (places, sketched_alone.places))
            for key in part
        ]
        table[key] = value.astype(float)  # type: ignore[index]
        c = setting.plan.coordinates[0]
        if name in (c.text, c.part if c.kind != "point" else c.text):
            start = value
    return Sketches(angles, places), floats(start, count)


def _suspect(mechanism: Mechanism, columns: Columns) -> Booleans:
    """Return the sets (k,) whose values may make no mechanism: they are checked one by one."""
    found = np.zeros(columns.count, bool)
    numbers = dict(mechanism.numbers())
    for name, number in numbers.items():
        if isinstance(number, str) and name not in columns.direct:
            columns.value(number)  # tells where it has no value

    def value(name: str) -> Any:
        return columns.number(name, numbers[name])

    for joint in mechanism.joints.values():
        names = [f"{joint.name}.{entry}" for entry, _ in joint.numbers()]
        found |= _other_signs(columns, mechanism, names)
    for body in mechanism.bodies:
        names = [f"{body}.{entry}" for entry in ("mass", "inertia") if f"{body}.{entry}" in numbers]
        found |= _other_signs(columns, mechanism, names)
        pins = {
            side.split(".")[1]
            for joint in mechanism.joints.values()
            if joint.hinge
            for side in (joint.first, joint.second)
            if side.split(".")[0] == body != GROUND
        }
        places = {
            pin: [value(f"{body}.{pin}.{axis}") for axis in mechanism.axes] for pin in sorted(pins)
        }
        for first in places:
            for second in places:
                if first < second:
                    pairs = zip(places[first], places[second], strict=True)
                    same = [floats(a, columns.count) == floats(b, columns.count) for a, b in pairs]
                    found |= np.all(same, axis=0)
    return found


def _other_signs(columns: Columns, mechanism: Mechanism, names: Iterable[str]) -> Booleans:
    """Return the sets in which a number has not the sign that it has in the mechanism itself."""
    numbers, base = dict(mechanism.numbers()), mechanism.values()
    found = np.zeros(columns.count, bool)
    for name in names:
        value = columns.number(name, numbers[name])
        if isinstance(value, np.ndarray):
            found |= np.sign(floats(value, columns.count)) != np.sign(base[name])
    return found


def bounds_of(
    graphs: Graphs, numbers: Numbers, rows: Integers, size_u: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return consts (k, .), mu (k, nb) and size_x (k, nx) of lanes, as `Constants` has of one."""
    scene, p, scale = graphs.scene, numbers.p[rows], numbers.scale[rows]
    turned = np.array([c.is_angle for c in scene.drivers], bool)
    largest = float(np.max(np.abs(size_u) * turned, initial=0.0))
    unit = np.where(scene.unknowns.turns, 4 * np.pi + 2 * largest, 0.0)
    size_x = unit + np.where(scene.unknowns.turns, 0.0, 10 * scale[:, None])
    batch: Batch = graphs.cache("constants of lanes", lambda: Batch(graphs.constants))
    count = len(p)
    none = np.zeros((count, 0))
    u = np.broadcast_to(size_u, (count, graphs.nu))
    kappa, rho, mu = batch(size_x, u, p, scale[:, None], none, none, none)
    grain = 2.0**-53 * size_x
    return np.hstack([p, scale[:, None], kappa, rho, grain]), mu, size_x


def _scale(setting: Setting) -> Batch:
    """Return the function of the parameters that gives the size of the mechanism."""
    model = setting.scene.model
    return setting.graphs.cache("scale of lanes", lambda: Batch(_scale_of(model)))


def _scale_of(model: Model) -> Graph:
    return ca.Function("size", [model.p], [scale_of(model)])
