"""By how much the equations of a block miss a crossing, and whether its numbers decide that."""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal
from typing import Any

import casadi as ca
import numpy as np

from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.high_precision import LONG, NoDecimals, decimals, evaluate, exactly
from mechdae.numerics.least_squares import solve

REFINEMENTS = 4
EXACT = 2.0**-90
"""Residual in 50 digits up to which the branches cross, in lengths of the mechanism."""
LESS_EXACT = 64 * float(np.spacing(LONG(1)))
"""The same in 80-bit floats, where 50 digits are not to be had."""
KNOWN, COMPUTED = 1.5, 4.0
"""Units in the last place to which a number is known that is no short binary fraction, and one
that an expression computes."""


class Residuals:
    """Residuals w . F of blocks at crossings.

    Parameters
    ----------
    graphs
        Kernels of the scene.
    p
        Its parameters.
    u
        The drivers' values (nd,) at a place.
    """

    def __init__(self, graphs: Graphs, p: Any, u: Callable[[float], Any]) -> None:
        self.graphs, self.p, self.u = graphs, p, u

    def wide(
        self, b: int, s: float, x: Any, whole: Any, earlier: list[int], w: Any, scaling: Any
    ) -> float:
        """Return |w . F| in 80-bit floats; to first order errors of x and s do not matter.

        Unknowns of earlier blocks are refined first: theirs would.
        """
        g = self.graphs
        wide, u = np.asarray(whole, LONG), self.u(s)

        def value(k: int) -> Any:
            graph = g.blocks[k]
            parts = (wide[graph.own], wide[graph.uses], u, self.p[graph.params])
            return evaluate(graph.function, [np.asarray(part, LONG)[None, :] for part in parts])[0]

        for k in earlier:
            J = g.blocks[k].value_at(np.asarray(whole, float), u, self.p)[1]
            for _ in range(2):
                wide[g.blocks[k].own] -= np.linalg.lstsq(J, value(k).astype(float))[0]
        wide[g.blocks[b].own] = x
        found = float(abs(np.asarray(w, LONG) @ scaling.equations(value(b))))
        return found if found > LESS_EXACT else 0.0

    def precise(
        self,
        b: int,
        whole: Any,
        earlier: list[int],
        y: Any,
        system: Any,
        slope: Any,
        driven: tuple[Any, ...],
        scaling: Any,
    ) -> float | None:
        """Return w . F in 50 digits at the crossing next to y, None where they cannot be had.

        Unknowns of earlier blocks are refined first, and then y itself: `driven` are z', z'' and
        u, u', u'' of the `system` of the crossing, `slope` its derivative.
        """
        g = self.graphs
        wide, u = [exactly(value) for value in whole], driven[2]
        n = g.blocks[b].size
        try:
            for k in earlier:
                graph = g.blocks[k]
                J = graph.value_at(whole, u, self.p)[1]
                for _ in range(REFINEMENTS):
                    parts = [[wide[i] for i in graph.own], [wide[i] for i in graph.uses]]
                    F = decimals(graph.function, [*parts, u, self.p[graph.params]])
                    for i, step in zip(graph.own, np.linalg.lstsq(J, floats(F))[0], strict=True):
                        wide[i] -= exactly(step)
            z = [wide[i] for i in g.blocks[b].uses]
            numbers = [z, *driven, self.p, *scaling.vectors]
            refined = [exactly(value) for value in y]
            for _ in range(REFINEMENTS):
                values = decimals(system, [refined, *numbers])
                change = np.linalg.lstsq(slope, -floats(values))[0]
                refined = [a + exactly(step) for a, step in zip(refined, change, strict=True)]
            values = decimals(system, [refined, *numbers])
        except NoDecimals:
            return None
        found = float(sum(w * F for w, F in zip(refined[n + 1 :], values[:n], strict=True)))
        return found if abs(found) > EXACT else 0.0

    def doubt(self, b: int, s: float, x: Any, earlier: list[int], w: Any, scaling: Any) -> float:
        """Return by how much w . F may move within the last place of the numbers given.

        `x` (nx,) are all unknowns there. Whole numbers and short binary fractions are taken to be
        what they say, others known to a unit in the last place, computed ones to some.
        """
        g, u = self.graphs, self.u(s)
        slope, load = np.zeros(len(self.p)), np.zeros(g.nx)
        weight = w / scaling.rows
        for k in (b, *reversed(earlier)):
            graph = g.blocks[k]
            _, J, Fz = graph.value_at(x, u, self.p)
            if k != b:  # unknowns of earlier blocks follow the numbers
                weight = -solve(J.T, load[graph.own])
            slope[graph.params] += weight @ self._by_numbers(k, x, u)
            if graph.uses:
                load[graph.uses] += Fz.T @ weight
        return float(np.abs(slope) @ self._grain)

    def _by_numbers(self, b: int, x: Any, u: Any) -> Any:
        """Return the derivative of a block's equations by its parameters."""
        g, graph = self.graphs, self.graphs.blocks[b]

        def make() -> Any:
            symbols = graph.function.sx_in()
            value = graph.function(*symbols)
            return ca.Function("by_numbers", symbols, [ca.densify(ca.jacobian(value, symbols[3]))])

        function = g.kept(("by numbers", b), make)
        return np.array(function(x[graph.own], x[graph.uses], u, self.p[graph.params]))

    @property
    def _grain(self) -> Any:
        """By how much each parameter may differ from what was meant (np,)."""
        model = self.graphs.scene.model
        given = dict(model.mechanism.parameters)
        computed = np.array([isinstance(given.get(name), str) for name in model.p_names], bool)
        short = np.array([Decimal(repr(float(value))) == Decimal(float(value)) for value in self.p])
        units = np.where(computed, COMPUTED, np.where(short, 0.0, KNOWN))
        return units * np.spacing(np.abs(self.p))


def floats(values: list[Any]) -> Any:
    return np.array([float(value) for value in values])
