"""An NLP that is put together piece by piece: named variables, parameters, constraints."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.synthesis.ipopt import Optimum, Solver

SX = ca.SX


class Nlp:
    """min f(z; p), low <= z <= high, g_low <= g(z; p) <= g_high.

    Attributes
    ----------
    objective : SX
        Dimensionless: terms are divided by the size of what they measure.
    """

    def __init__(self) -> None:
        self._variables: dict[str, tuple[Any, Any, Any]] = {}
        self._parameters: dict[str, tuple[Any, Any]] = {}
        self._constraints: list[tuple[str, Any, Any, Any]] = []
        self.objective: Any = SX(0)
        self._rest = SX.sym("rest")

    # -- pieces ------------------------------------------------------------------------------

    def variable(self, name: str, size: int, low: Any, high: Any) -> Any:
        """Return a new variable (size,)."""
        symbol = SX.sym(name, size)
        ends = [np.broadcast_to(np.asarray(b, float), (size,)).copy() for b in (low, high)]
        self._variables[name] = (symbol, ends[0], ends[1])
        return symbol

    def parameter(self, name: str, value: Any) -> Any:
        """Return a new parameter; `value` is its default."""
        value = np.atleast_1d(np.asarray(value, float)).ravel()
        symbol = SX.sym(name, len(value))
        self._parameters[name] = (symbol, value)
        return symbol

    def constrain(self, word: str, expression: Any, low: Any = 0.0, high: Any = 0.0) -> None:
        """Add low <= expression <= high; equal to zero by default."""
        self._constraints.append((word, ca.densify(SX(expression)), low, high))

    # -- the whole ---------------------------------------------------------------------------

    @cached_property
    def z(self) -> Any:
        return ca.vertcat(*[symbol for symbol, _, _ in self._variables.values()])

    @cached_property
    def g(self) -> Any:
        return ca.vertcat(*[expression for _, expression, _, _ in self._constraints])

    @cached_property
    def p(self) -> Any:
        symbols = [symbol for symbol, _ in self._parameters.values()]
        return ca.vertcat(*symbols, self._rest)

    @cached_property
    def bounds(self) -> tuple[Any, Any, Any, Any]:
        """low, high, g_low, g_high."""
        ends = [np.concatenate([v[k] for v in self._variables.values()]) for k in (1, 2)]
        sizes = [(e.numel(), low, high) for _, e, low, high in self._constraints]
        g_low = np.concatenate([np.full(n, low) for n, low, _ in sizes])
        g_high = np.concatenate([np.full(n, high) for n, _, high in sizes])
        return ends[0], ends[1], g_low, g_high

    @cached_property
    def words(self) -> list[str]:
        """The word of each row of g."""
        return [word for word, e, _, _ in self._constraints for _ in range(e.numel())]

    def place(self, name: str) -> slice:
        """Return where a variable lies in z."""
        start = 0
        for other, (symbol, _, _) in self._variables.items():
            if other == name:
                return slice(start, start + symbol.numel())
            start += symbol.numel()
        raise KeyError(name)

    def point(self, values: Mapping[str, Any]) -> Any:
        """Return z from values by name, within the bounds."""
        low, high = self.bounds[:2]
        parts = [np.ravel(values[name]) for name in self._variables]
        z: Any = np.clip(np.concatenate(parts), low, high)
        return z

    def read(self, z: Any) -> dict[str, Any]:
        """Return the variables by name."""
        return {name: z[self.place(name)] for name in self._variables}

    def settings(self, given: Mapping[str, Any], rest: float = 1.0) -> Any:
        """Return p, with other values than the defaults by name."""
        parts = [
            np.atleast_1d(np.asarray(given.get(name, value), float)).ravel()
            for name, (_, value) in self._parameters.items()
        ]
        return np.concatenate([*parts, [rest]])

    # -- solving -----------------------------------------------------------------------------

    @cached_property
    def _solver(self) -> Solver:
        return Solver(self.z, self.p, self.objective, self.g)

    @cached_property
    def _polisher(self) -> Solver:
        return Solver(self.z, self.p, self.objective / self._rest, self.g, polish=True)

    def solve(self, z0: Any, given: Mapping[str, Any]) -> Optimum:
        """Return the local optimum from a start."""
        return self._solver.solve(z0, self.settings(given), *self.bounds)

    def polished(self, found: Optimum, given: Mapping[str, Any]) -> Optimum:
        """Return an optimum with the tolerances drawn tight; the old one if that is no better.

        The objective is divided by its value: what normal tolerances leave is taken away.
        """
        scale = max(abs(found.objective), 1e-16) * 1e-4
        new = self._polisher.solve(found.z, self.settings(given, scale), *self.bounds)
        objective = new.objective * scale
        if new.violation <= max(found.violation, 1e-9) and objective <= found.objective:
            return Optimum(
                new.z, objective, new.violation, found.status, found.iterations + new.iterations,
                found.seconds + new.seconds, new.bound_prices * scale, new.prices * scale,
            )  # fmt: skip
        return found
