"""Loads as generalised forces: Q(q, v, t, p), with the signs and table values they need.

A resistance has the sign of its coordinate's speed as an input, a table the straight line of
the piece it is on: (abscissa, value, slope).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from copy import copy
from typing import Any

import casadi as ca

from mechdae.describe.coordinate_names import coordinate_names
from mechdae.describe.coordinates import NamedCoordinate, coordinate, split_rate
from mechdae.describe.expression import build, names_in
from mechdae.describe.loads import Force, Load, Resistance, Spring, TableLoad, Torque
from mechdae.describe.named import TIME
from mechdae.equations.forces.feedback import Slip
from mechdae.equations.forces.generalised import Wrench, add, couple, push
from mechdae.equations.forces.time_tables import Timed
from mechdae.equations.model import FUNCTIONS, Model
from mechdae.errors import InputError, MechdaeError
from mechdae.records import dataclass
from mechdae.types import Sym

SX = ca.SX
SLOW = 1e-100
"""Speeds of a motion without a speed, as a share of those at one unit of the driver's coordinate:
none but for their senses, and their squares are still numbers."""
BOUNDLESS = 1e60
"""What a load has at such speeds that grows without bound as they vanish, a power over a speed."""


@dataclass(frozen=True)
class Signal:
    """A table's value at a pose: ``piece`` = (abscissa, value, slope) of the piece it is on."""

    load: TableLoad
    at: Sym
    piece: Sym


@dataclass(frozen=True)
class Direction:
    """A spring between points needs a direction where ``pull`` does not vanish at ``length`` 0."""

    load: Spring
    length: Sym
    pull: Sym


class Loads:
    """The loads of a model in symbols.

    Parameters
    ----------
    model
        Symbols of the mechanism.
    turned
        Whether resistances push along the motion.
    gradual
        Whether resistances grow with signs between -1 and 1, as smoothed friction does; else they
        have their full size on either side.
    slow
        Whether the motion is as slow as one likes: loads see speeds that vanish.
    heavy
        The bodies that have a weight where they have a mass; None: all.

    Attributes
    ----------
    wrenches : dict of Wrench
        Generalised force by load; "gravity" too.
    slips : list of Slip
        Speeds whose signs are inputs.
    signals : list of Signal
    timed : list of Timed
        Tables over the time, those of laws too.
    varying : list of SX
        Numbers that the time is in.
    directions : list of Direction
    uses_time
        Loads that depend on the time t.
    """

    def __init__(
        self,
        model: Model,
        turned: bool = False,
        gradual: bool = False,
        slow: bool = False,
        heavy: Collection[str] | None = None,
    ) -> None:
        self.model: Model = model
        self.turned: bool = turned
        self.gradual: bool = gradual
        self.slow: bool = slow
        self._seen = SLOW * model.velocity if slow else model.velocity
        self.slips: list[Slip] = []
        self.signals: list[Signal] = []
        self.directions: list[Direction] = []
        self.time: Sym = SX.sym(TIME)
        self.uses_time: list[str] = []
        self.varying: list[Sym] = []
        self.timed: list[Timed] = []
        self.wrenches: dict[str, Wrench] = {}
        self.bodies: set[str] = set()
        self._known: dict[str, Sym] = {
            name: model.p[i]
            for i, name in enumerate(model.p_names)
            if name in model.mechanism.parameters
        }
        self._known[TIME] = self.time
        for name, load in model.mechanism.loads.items():
            try:
                self.wrenches[name] = KINDS[type(load)](self, load)
            except MechdaeError as problem:
                raise problem.inside(f"loads.{name}") from None
        gravity = self._gravity(model.mechanism.bodies if heavy is None else heavy)
        if gravity:
            self.wrenches["gravity"] = gravity

    def at(self, model: Model) -> Loads:
        """Return the same symbols for a copy of the model with other numbers."""
        other = copy(self)
        other.model, other.timed = model, [table.at(model.p_values) for table in self.timed]
        return other

    @property
    def total(self) -> Wrench:
        """The generalised force of all loads."""
        return add(*self.wrenches.values())

    # -- numbers and expressions -----------------------------------------------------------

    def _number(self, load: Load, entry: str) -> Sym:
        """Return a number of a load: a symbol, or an expression of coordinates, speeds, t."""
        name, _, axis = entry.partition(".")
        value = getattr(load, name)
        value = value["xyz".index(axis)] if axis else value
        if not isinstance(value, str):
            return self.model.numbers[f"loads.{load.name}.{entry}"]
        known = dict(self._known)
        for used in names_in(value):
            base, order = split_rate(used)
            if used in known:
                continue
            if used in self.model.mechanism.outputs:
                raise InputError(f"'{used}' is a named output, loads use coordinates", where=name)
            if base not in coordinate_names(self.model.mechanism):
                continue  # `build` names what is near
            if order > 1:
                raise InputError("loads do not depend on accelerations", where=name)
            c = coordinate(self.model.mechanism, base)
            known[used] = self._speed(c, self._seen) if order else self.model.coordinate(c)
            self._note(c)
        built = SX(build(value, known, FUNCTIONS))
        if TIME in names_in(value):
            self.uses_time.append(load.name)
            self.varying.append(built)
        return built

    def _note(self, c: NamedCoordinate) -> None:
        self.bodies |= {*c.bodies(self.model.mechanism)}

    def _speed(self, c: NamedCoordinate, velocity: Sym) -> Sym:
        return ca.jtimes(self.model.coordinate(c), self.model.q, velocity)

    def _on_coordinate(self, text: str, force: Sym) -> Wrench:
        """Return the generalised force of a force along a coordinate."""
        c = coordinate(self.model.mechanism, text)
        self._note(c)
        return {i: entry * force for i, entry in self.model.gradient(c).items()}

    # -- kinds -----------------------------------------------------------------------------

    def force(self, load: Force) -> Wrench:
        body = load.point.split(".")[0]
        self.bodies.add(body)
        value = self._turned(load, self._vector(load))
        return push(self.model, body, self.model.point(load.point), value)

    def torque(self, load: Torque) -> Wrench:
        self.bodies.add(load.body)
        if not isinstance(load.value, tuple):
            return couple(self.model, load.body, self._number(load, "value"))
        return couple(self.model, load.body, self._turned(load, self._vector(load)))

    def _vector(self, load: Load) -> Sym:
        axes = self.model.space.axes
        return ca.vertcat(*[self._number(load, f"value.{axis}") for axis in axes])

    def _turned(self, load: Force | Torque | TableLoad, value: Sym) -> Sym:
        """Return the components of a load in world axes."""
        if load.frame == "world":
            return value
        self.bodies.add(load.frame)
        return self.model.frame(load.frame).direction(value)

    def resistance(self, load: Resistance) -> Wrench:
        """Against the motion: + while the coordinate falls, - while it grows."""
        c = coordinate(self.model.mechanism, load.coordinate)
        falls, grows = self._number(load, "negative"), self._number(load, "positive")
        sign = SX.sym(f"sign_{load.name}")
        speed = self._speed(c, self.model.velocity)
        slip = Slip(load.name, speed, c.unit, sign, falls, grows)
        self.slips.append(slip)
        force = ca.if_else(slip.sign < 0, falls, 0) - ca.if_else(slip.sign > 0, grows, 0)
        force = force * ca.fabs(slip.sign) if self.gradual else force
        return self._on_coordinate(load.coordinate, -force if self.turned else force)

    def spring(self, load: Spring) -> Wrench:
        """Tension preload + k (L - L0) + c dL/dt between two points, or on a coordinate."""
        numbers = ("stiffness", "free_length", "preload", "damping")
        k, free, preload, damping = (self._number(load, name) for name in numbers)
        if load.coordinate is not None:
            c = coordinate(self.model.mechanism, load.coordinate)
            value, speed = self.model.coordinate(c), self._speed(c, self._seen)
            tension = preload + k * (value - free) + damping * speed
            return self._on_coordinate(load.coordinate, -tension)
        assert load.between is not None
        first, second = load.between
        gap = self.model.point(second) - self.model.point(first)
        length = ca.sqrt(ca.sumsqr(gap))
        unit = ca.if_else(length > 0, gap / length, 0)
        speed = ca.dot(unit, ca.jtimes(gap, self.model.q, self._seen))
        rest = preload - k * free
        along = k * gap + (rest + damping * speed) * unit
        self.directions.append(Direction(load, length, ca.fabs(rest) + ca.fabs(damping)))
        one, other = (reference.split(".")[0] for reference in load.between)
        self.bodies |= {one, other}
        on_first = push(self.model, one, self.model.point(first), along)
        return add(on_first, push(self.model, other, self.model.point(second), -along))

    def table(self, load: TableLoad) -> Wrench:
        if not load.points:
            raise InputError(
                "the file has not been read", where="file", hint="load the problem from its file"
            )
        if load.coordinate == TIME:
            return self._placed(load, self._timed(load).value)
        base, order = split_rate(load.coordinate)
        c = coordinate(self.model.mechanism, base)
        self._note(c)
        piece = SX.sym(f"piece_{load.name}", 3)
        at = self._speed(c, self._seen) if order else self.model.coordinate(c)
        self.signals.append(Signal(load, at, piece))
        start, value, slope = ca.vertsplit(piece)
        return self._placed(load, value + slope * (at - start))

    def _timed(self, load: TableLoad) -> Timed:
        """Return a table over the time."""
        shift = self._number(load, "shift")
        period = None if load.period is None else self._number(load, "period")
        p, values = self.model.p, self.model.p_values
        where = f"loads.{load.name}"
        result = Timed(f"load {load.name}", load, self.time, shift, period, p, values, where)
        self.timed.append(result)
        self.uses_time.append(load.name)
        return result

    def _placed(self, load: TableLoad, value: Sym) -> Wrench:
        """Return the force or the torque of a table's value."""
        value = self._number(load, "factor") * value
        if load.body is not None:
            self.bodies.add(load.body)
            if load.axis is not None:
                way = ca.vertcat(*[self._number(load, f"axis.{axis}") for axis in "xyz"])
                value = self._turned(load, way / ca.norm_2(way)) * value
            return couple(self.model, load.body, value)
        assert load.along is not None
        return self._on_coordinate(load.along, value)

    def _gravity(self, bodies: Collection[str]) -> Wrench:
        """Return the weights of those of some bodies that have a mass."""
        if self.model.mechanism.gravity is None:
            return {}
        g = ca.vertcat(*[self.model.numbers[f"gravity.{axis}"] for axis in self.model.space.axes])
        parts = []
        for body in bodies:
            if f"{body}.mass" in self.model.numbers:
                place = self.model.mass_center(body)
                weight = self.model.numbers[f"{body}.mass"] * g
                parts.append(push(self.model, body, place, weight))
        return add(*parts)


KINDS: Mapping[type[Load], Any] = {
    Force: Loads.force,
    Torque: Loads.torque,
    Resistance: Loads.resistance,
    Spring: Loads.spring,
    TableLoad: Loads.table,
}
