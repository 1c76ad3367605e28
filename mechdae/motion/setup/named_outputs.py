"""Named outputs at poses: expressions over coordinates, their rates in time, and forces.

The coordinates an expression uses are scalars of the scene, so their rates are exact; the
expression's own rates follow as total derivatives of its graph. Of forces there are values alone.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from copy import copy

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import RATES, coordinate
from mechdae.describe.expression import build, names_in
from mechdae.describe.mechanism import GROUND
from mechdae.describe.named import TIME, coordinates_of, force_of, forces_of, names_of
from mechdae.equations.model import FUNCTIONS, Model
from mechdae.equations.structure_cache import StructureCache
from mechdae.errors import InputError, MechdaeError, UnavailableError, UnknownName
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
        Outputs to compute, and expressions.
    derivatives
        Highest order of rates of the coordinates that is there.
    listed
        Those that the task names: one of them that cannot be computed is an error, others are
        left out and `notes` says why.
    time
        Whether the task has a time.
    driven
        The coordinates whose efforts the task gives, None: it has no forces.

    Raises
    ------
    InputError
        With the output's key path.
    """

    def __init__(
        self,
        model: Model,
        names: Sequence[str],
        derivatives: int,
        listed: Collection[str],
        time: bool,
        driven: Collection[str] | None = None,
    ) -> None:
        self.model: Model = model
        self.derivatives: int = derivatives
        self.cache: StructureCache = StructureCache()
        self.notes: list[str] = []
        self.rates: dict[str, int] = {}
        self.forced: dict[str, list[str]] = {}
        """Outputs that use forces, with the names of these."""
        self.orders: dict[str, dict[str, int]] = {
            name: coordinates_of(model.mechanism, name) for name in names
        }
        for name in names:
            missing, forces = self._missing(name, time, driven), forces_of(model.mechanism, name)
            if missing and name in listed:
                place = f"outputs.{name}" if name in model.mechanism.outputs else "find"
                raise InputError(missing[0], where=place, hint=missing[1])
            if missing:
                self.notes.append(f"outputs.{name} is left out: {missing[0]}")
            elif forces:
                self.forced[name] = forces
            else:
                highest = max(self.orders[name].values(), default=0)
                self.rates[name] = derivatives - highest
        self.forces: list[str] = sorted(
            {force for forces in self.forced.values() for force in forces}
        )
        computed = [*self.rates, *self.forced]
        self.coordinates: list[str] = list(
            dict.fromkeys(c for n in computed for c in self.orders[n])
        )
        count = derivatives + 1
        self._symbols = [SX.sym(f"c{k}", len(self.coordinates)) for k in range(count)]
        self._time = SX.sym(TIME)
        self._columns = [(n, k) for n, most in self.rates.items() for k in range(most + 1)]

    def at(self, model: Model) -> NamedOutputs:
        """Return the same outputs of the model with other numbers."""
        other = copy(self)
        other.model = model
        return other

    def _missing(
        self, name: str, time: bool, driven: Collection[str] | None
    ) -> tuple[str, str] | None:
        """Return why an output cannot be computed and what to try."""
        order = max(self.orders[name].values(), default=0)
        if order > self.derivatives:
            word = RATES[order - 1][1:]
            need = f"it uses the {word} of a coordinate"
            return f"{need}, which this task does not compute", f"derivatives = {order} or more"
        for used in forces_of(self.model.mechanism, name):
            word, owner, _ = force_of(self.model.mechanism, used) or ("", "", "")
            if driven is None:
                kinds = "reactions" if word in ("normal", "loss") else "reactions and motion"
                drives = f" that drive {owner}" if word in ("effort", "power") else ""
                return f"it uses {used}, which tasks of kind {kinds}{drives} give", ""
            if word in ("effort", "power") and owner not in driven:
                known = ", ".join(f"{coordinate}.{word}" for coordinate in driven)
                return f"it uses {used}, and {owner} is not driven here", f"there is {known}"
        if TIME in names_of(self.model.mechanism, name) and not time:
            return "it uses t, and this task has no time", "a driver with a constant speed or a law"
        return None

    def row(self, name: str, quantity: str, coordinates: Sym, time: Sym, p: Sym) -> Sym:
        """Return the expression of an output's value or rate over given symbols."""
        known = {f"{n}/{OUTPUT_RATES[rate]}": k for k, (n, rate) in enumerate(self._columns)}
        if name in self.forced:
            raise UnavailableError("outputs with forces have no derivatives", where=name)
        if f"{name}/{quantity}" not in known:
            raise UnknownName("output", f"{name}/{quantity}", known)
        rows = self._batch().function(coordinates, time, p)
        return rows[known[f"{name}/{quantity}"]]

    def _batch(self) -> Batch:
        """Return the function [coordinates and rates, t, p] -> values and rates."""
        return self.cache("named outputs", self._made)

    def _known(self) -> dict[str, Sym]:
        """Return the symbols of what expressions may use, forces left out."""
        known = {name: self.model.p[i] for i, name in enumerate(self.model.p_names)}
        known = {n: s for n, s in known.items() if n in self.model.mechanism.parameters}
        known[TIME] = self._time
        for i, text in enumerate(self.coordinates):
            for rate, symbols in zip(("", *RATES), self._symbols, strict=False):
                known[text + rate] = symbols[i]
        return known

    def _made_forced(self) -> Batch:
        """Return the function [coordinates and rates, t, forces, p] -> values of forced outputs."""
        known, mechanism = self._known(), self.model.mechanism
        symbols = SX.sym("forces", len(self.forces))
        for k, name in enumerate(self.forces):
            word, owner, _ = force_of(mechanism, name) or ("", "", "")
            known[name] = symbols[k] * known[owner + RATES[0]] if word == "power" else symbols[k]
        ready: dict[str, Sym] = {}
        rows = [self._expression(name, known, ready) for name in self.forced]
        inputs = [ca.vertcat(*self._symbols), self._time, symbols, self.model.p]
        return Batch(without_repeats("forced", inputs, [ca.vertcat(*rows)]), shared=[3])

    def _made(self) -> Batch:
        known = self._known()
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
                text = mechanism.outputs.get(name, name)
                ready[name] = SX(build(text, {**known, **others}, FUNCTIONS))
            except (ArithmeticError, TypeError, NotImplementedError) as problem:
                raise InputError(f"has no value: {problem}", where=f"outputs.{name}") from None
            except MechdaeError as problem:
                raise problem.inside(f"outputs.{name}") from None
        return ready[name]

    def _references(self, name: str) -> list[str]:
        outputs = self.model.mechanism.outputs
        return [used for used in names_in(outputs.get(name, name)) if used in outputs]

    def _rate(self, expression: Sym) -> Sym:
        """Return the total derivative in time of an expression over coordinates and rates."""
        lower, higher = self._symbols[:-1], self._symbols[1:]
        at, along = ca.vertcat(*lower, self._time), ca.vertcat(*higher, SX(1))
        return ca.jtimes(expression, at, along)

    def evaluate(
        self, coordinates: list[Floats], time: Floats | None, certified: Booleans
    ) -> tuple[Named, list[str]]:
        """Return values and rates of what uses no forces, notes on outputs without a finite value.

        Parameters
        ----------
        coordinates
            Coordinates and their rates in time, one (n, nc) array for each order.
        time : (n,) array or None
        certified : (n,) array of bool
            Poses that have values at all.
        """
        (values,) = self._batch()(*self._inputs(coordinates, time), self.model.p_values)
        series: dict[str, dict[str, Floats]] = {name: {} for name in self.rates}
        notes = []
        for column, (name, rate) in enumerate(self._columns):
            there = certified & self._given(name, rate, coordinates)
            series[name][OUTPUT_RATES[rate]] = found = _finite(values[:, column], there)
            if not rate:
                notes += _lost(name, found, there)
        return Named("output", {name: Series(arrays) for name, arrays in series.items()}), notes

    def reported(self, values: Mapping[str, Series]) -> Named:
        """Return the values of named outputs without those of expressions that are looked for."""
        outputs = self.model.mechanism.outputs
        return Named("output", {name: values[name] for name in outputs if name in values})

    def with_forces(
        self,
        coordinates: list[Floats],
        time: Floats | None,
        force: Callable[[str, str, str], Floats],
        certified: Booleans,
    ) -> tuple[dict[str, Series], list[str]]:
        """Return the values of outputs that use forces; `force` gives one (n,), see `force_of`."""
        mechanism, known = self.model.mechanism, {}
        for name in self.forces:
            word, owner, axis = force_of(mechanism, name) or ("", "", "")
            known[name] = force("effort" if word == "power" else word, owner, axis)
        columns = np.column_stack([known[name] for name in self.forces])
        batch = self.cache("forced outputs", self._made_forced)
        (values,) = batch(*self._inputs(coordinates, time), columns, self.model.p_values)
        series, notes = {}, list[str]()
        for k, (name, forces) in enumerate(self.forced.items()):
            there = certified & self._given(name, 0, coordinates)
            for used in forces:
                there = there & np.isfinite(known[used])
            series[name] = Series({"value": _finite(values[:, k], there)})
            notes += _lost(name, series[name].value, there)
        return series, notes

    def _inputs(self, coordinates: list[Floats], time: Floats | None) -> list[Floats]:
        n = len(coordinates[0])
        t = np.zeros((n, 1)) if time is None else np.asarray(time, float).reshape(n, 1)
        return [np.hstack(coordinates), t]

    def _given(self, name: str, rate: int, coordinates: list[Floats]) -> Booleans:
        """Return at which poses everything an output's rate depends on has a value.

        Functions like min would otherwise turn nan into a number.
        """
        known = np.ones(len(coordinates[0]), bool)
        for text, order in self.orders[name].items():
            column = self.coordinates.index(text)
            for array in coordinates[: order + rate + 1]:
                known &= np.isfinite(array[:, column])
        return known


def _finite(values: Floats, there: Booleans) -> Floats:
    """Return values (n,), nan where there is none."""
    found: Floats = np.where(there & np.isfinite(values), values, np.nan)
    return found


def _lost(name: str, values: Floats, there: Booleans) -> list[str]:
    """Return a note on poses at which an output is not finite."""
    lost = int(np.count_nonzero(there & np.isnan(values)))
    return [f"outputs.{name} has no finite value at {lost} of {len(there)} poses"] if lost else []
