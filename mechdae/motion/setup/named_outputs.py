"""Named outputs at poses: expressions over coordinates and their rates in time.

The coordinates an expression uses are scalars of the scene, so their rates are exact; the
expression's own rates follow as total derivatives of its graph.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import RATES, coordinate
from mechdae.describe.expression import build, names_in
from mechdae.describe.mechanism import GROUND
from mechdae.describe.named import TIME, coordinates_of, names_of, reactions_of
from mechdae.equations.model import FUNCTIONS, Model
from mechdae.equations.structure_cache import StructureCache
from mechdae.errors import InputError, MechdaeError, UnknownName
from mechdae.kernels.run.functions import Batch, without_repeats
from mechdae.motion.setup.outputs import Request
from mechdae.results import OUTPUT_RATES, Named, Series
from mechdae.types import Booleans, Floats, Sym

SX = ca.SX


def requests(model: Model, names: Sequence[str]) -> list[Request]:
    """Return the coordinates that named outputs use."""
    found = []
    mechanism = model.mechanism
    for text in dict.fromkeys(c for name in names for c in coordinates_of(mechanism, name)):
        c = coordinate(mechanism, text)
        model.demand(c)
        joints = mechanism.joints
        bodies = joints[c.part].bodies if c.part in joints else (c.part,)
        moving = tuple(body for body in bodies if body != GROUND)
        found.append((text, model.coordinate(c), moving))
    return found


class NamedOutputs:
    """The named outputs of a task.

    Parameters
    ----------
    model
        Symbols of the mechanism.
    names
        Outputs to compute.
    derivatives
        Highest order of rates of the coordinates that is there.
    listed
        Whether the task names them: then one that cannot be computed is an error, otherwise
        it is left out and `notes` says why.
    time
        Whether the task has a time.

    Raises
    ------
    InputError
        With the output's key path.
    """

    def __init__(
        self, model: Model, names: Sequence[str], derivatives: int, listed: bool, time: bool
    ) -> None:
        self.model, self.derivatives, self.cache = model, derivatives, StructureCache()
        self.notes: list[str] = []
        self.rates: dict[str, int] = {}
        self.orders = {name: coordinates_of(model.mechanism, name) for name in names}
        for name in names:
            missing = self._missing(name, time)
            if missing and listed:
                raise InputError(missing[0], where=f"outputs.{name}", hint=missing[1])
            if missing:
                self.notes.append(f"outputs.{name} is left out: {missing[0]}")
            else:
                highest = max(self.orders[name].values(), default=0)
                self.rates[name] = derivatives - highest
        self.coordinates = list(dict.fromkeys(c for n in self.rates for c in self.orders[n]))
        count = derivatives + 1
        self._symbols = [SX.sym(f"c{k}", len(self.coordinates)) for k in range(count)]
        self._time = SX.sym(TIME)
        self._columns = [(n, k) for n, most in self.rates.items() for k in range(most + 1)]

    def at(self, model: Model) -> NamedOutputs:
        """Return the same outputs of the model with other numbers."""
        other = copy(self)
        other.model = model
        return other

    def _missing(self, name: str, time: bool) -> tuple[str, str] | None:
        """Return why an output cannot be computed and what to try."""
        order = max(self.orders[name].values(), default=0)
        if order > self.derivatives:
            word = RATES[order - 1][1:]
            need = f"it uses the {word} of a coordinate"
            return f"{need}, which this task does not compute", f"derivatives = {order} or more"
        if reactions_of(self.model.mechanism, name):
            return "it uses reactions, outputs of which are given by tasks of motion", ""
        if TIME in names_of(self.model.mechanism, name) and not time:
            return "it uses t, and this task has no time", "a driver with a constant speed or a law"
        return None

    def row(self, name: str, quantity: str, coordinates: Sym, time: Sym, p: Sym) -> Sym:
        """Return the expression of an output's value or rate over given symbols."""
        known = {f"{n}/{OUTPUT_RATES[rate]}": k for k, (n, rate) in enumerate(self._columns)}
        if f"{name}/{quantity}" not in known:
            raise UnknownName("output", f"{name}/{quantity}", known)
        rows = self._batch().function(coordinates, time, p)
        return rows[known[f"{name}/{quantity}"]]

    def _batch(self) -> Batch:
        """Return the function [coordinates and rates, t, p] -> values and rates."""
        return self.cache("named outputs", self._made)

    def _made(self) -> Batch:
        known = {name: self.model.p[i] for i, name in enumerate(self.model.p_names)}
        known = {n: s for n, s in known.items() if n in self.model.mechanism.parameters}
        known[TIME] = self._time
        for i, text in enumerate(self.coordinates):
            for rate, symbols in zip(("", *RATES), self._symbols, strict=False):
                known[text + rate] = symbols[i]
        ready: dict[str, Sym] = {}
        rows = []
        for name, most in self.rates.items():
            rows.append(self._expression(name, known, ready))
            for _ in range(most):
                rows.append(self._rate(rows[-1]))
        inputs = [ca.vertcat(*self._symbols), self._time, self.model.p]
        function = without_repeats("named", inputs, [ca.vertcat(*rows)])
        return Batch(function, shared=[2])

    def _expression(self, name: str, known: dict[str, Sym], ready: dict[str, Sym]) -> Sym:
        """Return the graph of a named output, of those it refers to first."""
        if name not in ready:
            mechanism = self.model.mechanism
            others = {n: self._expression(n, known, ready) for n in self._references(name)}
            try:
                ready[name] = SX(build(mechanism.outputs[name], {**known, **others}, FUNCTIONS))
            except (ArithmeticError, TypeError, NotImplementedError) as problem:
                raise InputError(f"has no value: {problem}", where=f"outputs.{name}") from None
            except MechdaeError as problem:
                raise problem.inside(f"outputs.{name}") from None
        return ready[name]

    def _references(self, name: str) -> list[str]:
        outputs = self.model.mechanism.outputs
        return [used for used in names_in(outputs[name]) if used in outputs]

    def _rate(self, expression: Sym) -> Sym:
        """Return the total derivative in time of an expression over coordinates and rates."""
        lower, higher = self._symbols[:-1], self._symbols[1:]
        at, along = ca.vertcat(*lower, self._time), ca.vertcat(*higher, SX(1))
        return ca.jtimes(expression, at, along)

    def evaluate(
        self, coordinates: list[Floats], time: Floats | None, certified: Booleans
    ) -> tuple[Named, list[str]]:
        """Return values and rates of all outputs, and notes on those without a finite value.

        Parameters
        ----------
        coordinates
            Coordinates and their rates in time, one (n, nc) array for each order.
        time : (n,) array or None
        certified : (n,) array of bool
            Poses that have values at all.
        """
        n = len(certified)
        t = np.zeros((n, 1)) if time is None else np.asarray(time, float).reshape(n, 1)
        (values,) = self._batch()(np.hstack(coordinates), t, self.model.p_values)
        series: dict[str, dict[str, Floats]] = {name: {} for name in self.rates}
        notes = []
        for column, (name, rate) in enumerate(self._columns):
            there = certified & self._known(name, rate, coordinates)
            found = np.where(there & np.isfinite(values[:, column]), values[:, column], np.nan)
            series[name][OUTPUT_RATES[rate]] = found
            lost = int(np.count_nonzero(there & np.isnan(found)))
            if lost and not rate:
                notes.append(f"outputs.{name} has no finite value at {lost} of {n} poses")
        return Named("output", {name: Series(arrays) for name, arrays in series.items()}), notes

    def _known(self, name: str, rate: int, coordinates: list[Floats]) -> Booleans:
        """Return at which poses everything an output's rate depends on has a value.

        Functions like min would otherwise turn nan into a number.
        """
        known = np.ones(len(coordinates[0]), bool)
        for text, order in self.orders[name].items():
            column = self.coordinates.index(text)
            for array in coordinates[: order + rate + 1]:
                known &= np.isfinite(array[:, column])
        return known
