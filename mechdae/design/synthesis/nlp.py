"""An NLP that is put together piece by piece: named variables, parameters, constraints.

A solver that goes by second derivatives finds no end at a kink. So a number of the user's that has
kinks is rounded over a share of the size that it is about: sqrt(f) becomes sqrt(f + e^2), |x|
sqrt(x^2 + e^2), and the lesser and the greater of two numbers follow from the magnitude of their
difference. The share is a parameter of the NLP, which is solved with ever smaller ones; designs
are judged by the number itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.design.synthesis.ipopt import NlpSolver, Optimum
from mechdae.kernels.bounds.walk import ARRAYS, replay, symbolic
from mechdae.kernels.run.functions import without_repeats
from mechdae.types import Floats, Graph, Sym, Unknowns

if TYPE_CHECKING:
    from mechdae.design.synthesis.outcome import Called

SOFT = "soft"
"""Parameter of an NLP: over which share of their sizes kinks are rounded."""
COARSE, FINEST = (1e-2, 1e-4), 1e-6
"""Shares that a start goes through, and the one that it ends with."""
KINKS = (ca.OP_SQRT, ca.OP_FABS, ca.OP_FMIN, ca.OP_FMAX)
SX = ca.SX
Values = Mapping[str, Any]
"""Numbers of the variables or of the parameters of an NLP, by name."""
NewValues = tuple[dict[str, Any], dict[str, Any]]
"""Variables and parameters that take new numbers."""
MET = 1e-7
"""Largest violation of a (dimensionless) constraint of what is feasible."""
LIMIT = "limit of "
"""How constraints begin that keep a path of a task between bounds."""
MISSED = 1e-5
"""Smallest (dimensionless) violation that is told."""
SPREAD = "spread"
"""Word of what states how far errors deviate by tolerances."""
STIFF = ("closure", SPREAD)
"""Words of constraints that no elastic problem lets go: without them there is no mechanism."""


def kinked(function: Graph) -> bool:
    codes = range(function.n_instructions())
    return any(function.instruction_id(k) in KINKS for k in codes)


def rounded(function: Graph, samples: Sequence[Floats], inputs: Sequence[Sym], soft: Sym) -> Sym:
    """Return the first output of an SX function with its kinks rounded."""
    sizes: list[float] = []

    def measured(code: int, values: list[Floats]) -> Any:
        if code in KINKS:
            size = np.median(np.abs(_about(code, *values)))
            sizes.append(float(size) if np.isfinite(size) and size > 0 else 1.0)
        return ARRAYS[code](*values)

    with np.errstate(all="ignore"):
        replay(function, [list(np.asarray(sample, float).T) for sample in samples], measured, float)
    each = iter(sizes)

    def operation(code: int, values: list[Sym]) -> Sym:
        if code not in KINKS:
            return symbolic(code, *values)
        e2 = (soft * next(each)) ** 2
        if code == ca.OP_SQRT:
            return ca.sqrt(values[0] + e2)
        if code == ca.OP_FABS:
            return ca.sqrt(values[0] ** 2 + e2)
        a, b = values
        apart = ca.sqrt((a - b) ** 2 + e2)
        return (a + b + (apart if code == ca.OP_FMAX else -apart)) / 2

    every = [ca.vertsplit(symbols) if symbols.numel() else [] for symbols in map(ca.SX, inputs)]
    return ca.vertcat(*replay(function, every, operation, ca.SX)[0])


def _about(code: int, *values: Floats) -> Floats:
    """Return what vanishes at a kink."""
    if code == ca.OP_SQRT:
        return np.sqrt(np.abs(values[0]))
    return values[0] if code == ca.OP_FABS else values[0] - values[1]


class Nlp:
    """min f(z; p), low <= z <= high, g_low <= g(z; p) <= g_high.

    Variables have a scale: the solver sees them divided by it, everybody else as they are.

    `rough`: whether the objective or a limit bends sharply, as forces with friction do where a
    speed changes its sign: second derivatives are approximate then. `exact`: rough or not, exact
    second derivatives are tried first. ``objective``: dimensionless: terms are divided by the size
    of what they measure.
    """

    def __init__(self, rough: bool = False, exact: bool = False) -> None:
        self.rough: bool = rough
        self.exact: bool = exact
        self._variables: dict[str, tuple[Sym, Floats, Floats, Floats]] = {}
        self._parameters: dict[str, tuple[Sym, Floats]] = {}
        self._constraints: list[tuple[str, Any, Any, Any]] = []
        self._units: dict[str, float] = {}
        self.in_si: dict[str, str] = {}
        """Units of constraints by what they are called, as far as they are known."""
        self._outside: list[tuple[Any, Any, Any]] = []
        self.objective: Sym = SX(0)
        self.terms: list[Any] = []
        self._rest = SX.sym("rest")

    # -- pieces ------------------------------------------------------------------------------

    def variable(
        self,
        name: str,
        size: int,
        low: Floats | float,
        high: Floats | float,
        scale: Floats | float = 1.0,
    ) -> Sym:
        """Return a new variable (size,)."""
        symbol = SX.sym(name, size)
        low, high, scale = (
            np.broadcast_to(np.asarray(b, float), (size,)).copy() for b in (low, high, scale)
        )
        self._variables[name] = (symbol, low, high, scale)
        return symbol * scale if size else symbol

    def parameter(self, name: str, value: object) -> Sym:
        """Return a new parameter; `value` is its default."""
        value = np.atleast_1d(np.asarray(value, float)).ravel()
        symbol = SX.sym(name, len(value))
        self._parameters[name] = (symbol, value)
        return symbol

    def known_parameter(self, name: str, value: float) -> Sym:
        """Return a parameter that several ask for."""
        if name not in self._parameters:
            return self.parameter(name, value)
        return self._parameters[name][0]

    def constrain(
        self,
        word: str,
        expression: Sym,
        low: Floats | float = 0.0,
        high: float = 0.0,
        unit: float = 1.0,
        si: str = "",
    ) -> None:
        """Add low <= expression <= high; equal to zero by default.

        ``unit`` is what a (dimensionless) one of it is in ``si``, the unit in SI.
        """
        self._units[word] = unit
        for name in {word, self.side(word, 1.0), self.side(word, -1.0)} if si else ():
            self.in_si[name] = si
        self._constraints.append((word, ca.densify(SX(expression)), low, high))

    def outside(self, name: str, function: Called, of: Sym) -> Sym:
        """Return a number that a function, called by casadi, gives for an expression."""
        symbol = SX.sym(name)
        self._outside.append((symbol, function, of))
        return symbol

    # -- the whole ---------------------------------------------------------------------------

    @cached_property
    def z(self) -> Sym:
        return ca.vertcat(*[symbol for symbol, *_ in self._variables.values()])

    @cached_property
    def g(self) -> Sym:
        return ca.vertcat(*[expression for _, expression, _, _ in self._constraints])

    @cached_property
    def p(self) -> Sym:
        symbols = [symbol for symbol, _ in self._parameters.values()]
        return ca.vertcat(*symbols, self._rest)

    @cached_property
    def scale(self) -> Floats:
        """Of the variables, (nz,)."""
        return np.concatenate([scale for *_, scale in self._variables.values()])

    @cached_property
    def bounds(self) -> tuple[Floats, Floats, Floats, Floats]:
        """low, high of the scaled variables, g_low, g_high."""
        ends = [np.concatenate([v[k] for v in self._variables.values()]) for k in (1, 2)]
        sizes = [(e.numel(), low, high) for _, e, low, high in self._constraints]
        g_low = np.concatenate([np.broadcast_to(low, n) for n, low, _ in sizes] or [np.zeros(0)])
        g_high = np.concatenate([np.broadcast_to(up, n) for n, _, up in sizes] or [np.zeros(0)])
        return ends[0] / self.scale, ends[1] / self.scale, g_low.astype(float), g_high.astype(float)

    @cached_property
    def words(self) -> list[str]:
        """The word of each row of g."""
        return [word for word, e, _, _ in self._constraints for _ in range(e.numel())]

    def unit(self, word: str) -> float:
        """Return what a one of a constraint is in SI."""
        return self._units[word]

    @staticmethod
    def side(word: str, above: float) -> str:
        """Return what a side of a constraint is called: limits of paths have an upper, a lower."""
        return f"{'upper' if above > 0 else 'lower'} {word}" if word.startswith(LIMIT) else word

    def place(self, name: str) -> slice:
        """Return where a variable lies in z."""
        start = 0
        for other, (symbol, *_) in self._variables.items():
            if other == name:
                return slice(start, start + symbol.numel())
            start += symbol.numel()
        raise KeyError(name)

    def point(self, values: Values) -> Floats:
        """Return z from values by name, within the bounds; zeros where there is no value."""
        low, high = self.bounds[:2]
        parts = [
            np.ravel(values.get(name, 0.0)) * np.ones(symbol.numel())
            if symbol.numel()
            else np.zeros(0)
            for name, (symbol, *_) in self._variables.items()
        ]
        return np.clip(np.nan_to_num(np.concatenate(parts) / self.scale), low, high)

    def read(self, z: Unknowns) -> dict[str, Floats]:
        """Return the variables by name."""
        values = z * self.scale
        return {name: values[self.place(name)] for name in self._variables}

    def settings(self, given: Values, rest: float = 1.0) -> Floats:
        """Return p, with other values than the defaults by name."""
        parts = [
            np.atleast_1d(np.asarray(given.get(name, value), float)).ravel()
            for name, (_, value) in self._parameters.items()
        ]
        return np.concatenate([*parts, [rest]])

    def _over(self, results: list[Sym], more: Sym | None = None) -> tuple[Sym, Sym, list[Sym]]:
        """Return variables (with `more`), parameters and expressions over them alone."""
        z = self.z if more is None else ca.vertcat(self.z, more)
        if not self._outside:
            return z, self.p, results
        Z, P = ca.MX.sym("z", z.numel()), ca.MX.sym("p", self.p.numel())
        symbols = [symbol for symbol, _, _ in self._outside]
        numbers = []
        for _, function, of in self._outside:
            numbers.append(function(ca.Function("of", [z, self.p], [ca.densify(of)])(Z, P)))
        whole = without_repeats("whole", [z, self.p, *symbols], results)
        found = whole(Z, P, *numbers)
        return Z, P, list(found) if isinstance(found, tuple) else [found]

    @property
    def bent(self) -> bool:
        """Whether there may be kinks: numbers of motions and equilibria have them."""
        return bool(self._outside)

    def _made(self, objective: Sym, g: Sym, more: Sym | None = None, **how: bool) -> NlpSolver:
        z, p, (f, rows) = self._over([SX(objective), SX(g)], more)
        how["approximate"] = how.get("approximate", False) or bool(self._outside)
        return NlpSolver(z, p, f, rows, bent=self.bent, **how)

    # -- solving -----------------------------------------------------------------------------

    @cached_property
    def _solver(self) -> NlpSolver:
        return self._made(self.objective, self.g)

    @cached_property
    def _polisher(self) -> NlpSolver:
        approximate = self.rough and not self.exact
        return self._made(self.objective / self._rest, self.g, polish=True, approximate=approximate)

    @cached_property
    def _approximate(self) -> NlpSolver:
        return self._made(self.objective, self.g, approximate=True)

    def solve(self, z0: Unknowns, given: Values) -> Optimum:
        """Return the local optimum from a start.

        Second derivatives are exact but for `rough` problems: a mean over poses couples them
        all, which makes these dear, and where forces bend they mislead. Kinks that are rounded
        are rounded less and less.
        """
        for soft in COARSE if SOFT in self._parameters else ():
            z0 = self._optimum(z0, {**given, SOFT: soft}).z
        return self._optimum(z0, given)

    def _optimum(self, z0: Unknowns, given: Values) -> Optimum:
        if self.exact and self.rough and not self._outside:
            found = self._solver.solve(z0, self.settings(given), *self.bounds)
            if found.solved and found.violation <= MET:
                return found
            new = self.gone_on(z0, given)
            if max(found.violation, new.violation) <= MET:
                return new if new.objective <= found.objective else found
            return new if new.violation <= found.violation else found
        if self.rough or self._outside:
            return self.gone_on(z0, given)
        return self._solver.solve(z0, self.settings(given), *self.bounds)

    def gone_on(self, z0: Unknowns, given: Values) -> Optimum:
        """Return the optimum with approximate second derivatives; at worst a feasible start."""
        found = self._approximate.solve(z0, self.settings(given), *self.bounds)
        p = self.settings(given)
        begin = self._approximate.value(z0, p)
        feasible = np.abs(self.violations(z0, given)).max(initial=0.0) <= MET
        if feasible and not (found.violation <= MET and found.objective <= begin):
            return replace(found, z=z0, objective=begin, violation=0.0)
        return found

    def polished(self, found: Optimum, given: Values) -> Optimum:
        """Return an optimum with the tolerances drawn tight; the old one if that is no better."""
        scale = max(abs(found.objective), 1e-16) * 1e-4
        new = self._polisher.solve(found.z, self.settings(given, scale), *self.bounds)
        objective = new.objective * scale
        slack = 1e-12 * abs(found.objective)
        if new.violation <= max(found.violation, 1e-9) and objective <= found.objective + slack:
            return Optimum(
                new.z, objective, new.violation, found.status, found.iterations + new.iterations,
                found.seconds + new.seconds, new.bound_prices * scale, new.prices * scale,
            )  # fmt: skip
        return found

    def again(self, z: Unknowns, given: Values, found: Optimum) -> Optimum:
        """Return the optimum near a point that is nearly one, `found` under other parameters.

        Tight, from the prices that were found; where that fails, or ends worse than a feasible
        point it began with (it leapt to another optimum), again; at worst the feasible point.
        """
        scale = max(abs(found.objective), 1e-16) * 1e-4
        p = self.settings(given, scale)
        prices = found.bound_prices / scale, found.prices / scale
        new = self._polisher.solve(z, p, *self.bounds, prices)
        feasible = np.abs(self.violations(z, given)).max(initial=0.0) <= MET
        most = self._polisher.value(z, p) * scale if feasible else np.inf
        if new.solved and new.objective * scale <= most:
            return replace(
                new, objective=new.objective * scale, bound_prices=new.bound_prices * scale,
                prices=new.prices * scale,
            )  # fmt: skip
        new = self.solve(z, given)
        if self.rough or not feasible or (new.violation <= MET and new.objective <= most):
            return new
        return self.gone_on(z, given)

    # -- what cannot be met ------------------------------------------------------------------

    @cached_property
    def _elastic(self) -> tuple[NlpSolver, list[int]]:
        loose = [i for i, word in enumerate(self.words) if word not in STIFF]
        slack = SX.sym("slack", 2 * len(loose))
        spread = SX.zeros(len(self.words), 2 * len(loose))
        for k, i in enumerate(loose):
            spread[i, 2 * k], spread[i, 2 * k + 1] = 1, -1
        rows = self.g + spread @ slack
        return self._made(ca.sum1(slack), rows, slack, approximate=self.rough), loose

    def conflicts(self, z0: Unknowns, given: Values) -> tuple[Optimum, dict[str, float]]:
        """Return the point where constraints are missed least, and by how much, by word.

        The sum of all (dimensionless) violations is minimised, the closure and the bounds are
        kept.
        """
        solver, loose = self._elastic
        low, high, g_low, g_high = self.bounds
        g = self.violations(z0, given)
        start = np.zeros(2 * len(loose))
        for k, i in enumerate(loose):
            start[2 * k], start[2 * k + 1] = max(-g[i], 0.0), max(g[i], 0.0)
        count = 2 * len(loose)
        found = solver.solve(
            np.concatenate([z0, start]), self.settings(given),
            np.concatenate([low, np.zeros(count)]), np.concatenate([high, np.full(count, np.inf)]),
            g_low, g_high,
        )  # fmt: skip
        z = found.z[: len(low)]
        missed = self.violations(z, given)
        amounts: dict[str, float] = {}
        for word, amount in zip(self.words, missed, strict=True):
            if abs(amount) > MISSED:
                name, amount = self.side(word, amount), float(abs(amount)) * self._units[word]
                amounts[name] = max(amounts.get(name, 0.0), amount)
        return replace(found, z=z), amounts

    def violations(self, z: Unknowns, given: Values) -> Any:
        """Return by how much each row of g is above (+) or below (-) its bounds."""
        g = np.array(self._rows(z, self.settings(given))).ravel()
        _, _, low, high = self.bounds
        return np.maximum(g - high, 0) - np.maximum(low - g, 0)

    def terms_at(self, z: Unknowns, given: Values) -> list[float]:
        """Return the terms of the objective at a point."""
        return [float(v) for v in np.array(self._terms(z, self.settings(given))).ravel()]

    @cached_property
    def _terms(self) -> Graph:
        z, p, terms = self._over([ca.vertcat(*self.terms)])
        return ca.Function("terms", [z, p], terms)

    @cached_property
    def _rows(self) -> Graph:
        z, p, rows = self._over([ca.densify(self.g)])
        return ca.Function("rows", [z, p], rows)
