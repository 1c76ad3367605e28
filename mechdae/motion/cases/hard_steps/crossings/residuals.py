"""By how much the equations of a block miss a crossing, and whether its numbers decide that."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from decimal import Context, Decimal, localcontext
from typing import Any

import casadi as ca
import numpy as np

from mechdae.kernels.graphs.steps import Graphs
from mechdae.kernels.run.high_precision import (
    DIGITS,
    LONG,
    NoDecimals,
    decimals,
    evaluate,
    exactly,
)
from mechdae.numerics.null_space import solve
from mechdae.types import Floats, Graph, Matrix, Unknowns

REFINEMENTS = 4
EXACT = 2.0**-90
"""Residual in 50 digits up to which the branches cross, in lengths of the mechanism."""
LESS_EXACT = 64 * float(np.spacing(LONG(1)))
"""The same in 80-bit floats, where 50 digits are not to be had."""
KNOWN, COMPUTED = 1.125, 4.0
"""Units in the last place to which a number is known that is neither a short binary fraction nor a
decimal of a few digits, and one that an expression computes. A length that two sums make of the
others, rounded each time, is off by at most one unit of each of them."""
FIGURES = 15
"""Digits up to which a decimal says what was meant: different ones are different doubles."""
MEETING = 1e-6
"""Share of what rounding to double does to a residual, below which decimals are meant to meet."""


@contextmanager
def in_digits() -> Iterator[None]:
    """Compute decimals with `DIGITS` digits."""
    with localcontext(Context(prec=DIGITS)):
        yield


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

    def __init__(self, graphs: Graphs, p: Floats, u: Callable[[float], Floats]) -> None:
        self.graphs: Graphs = graphs
        self.p: Floats = p
        self.u: Callable[[float], Floats] = u

    def wide(
        self,
        b: int,
        s: float,
        x: Unknowns,
        whole: Floats,
        earlier: list[int],
        w: Floats,
        scaling: Any,
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

    @in_digits()
    def precise(
        self,
        b: int,
        whole: Floats,
        earlier: list[int],
        y: Floats,
        system: Graph,
        slope: Matrix,
        driven: tuple[Floats, ...],
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

    def decides(
        self, residual: float, b: int, s: float, x: Unknowns, earlier: list[int], w: Floats,
        scaling: object,
    ) -> bool:  # fmt: skip
        """Return whether the numbers given, as far as they are known, decide the sign of w . F.

        `x` (nx,) are all unknowns there. Whole numbers and short binary fractions are taken to be
        what they say, and so are decimals of up to `FIGURES` digits, of which the doubles are
        roundings; others are known to a unit in the last place, computed ones to some.
        """
        slope, by_u = self._slopes(b, s, x, earlier, w, scaling)
        grain, meant = self._grain
        doubt = float(np.abs(slope) @ grain)
        if not self.graphs.single:
            doubt += float(np.abs(by_u) @ self._driven(s))
        written = residual + float(slope @ meant)
        least = doubt + MEETING * float(np.abs(slope) @ np.abs(meant))
        return abs(residual) > doubt and abs(written) > least and residual * written > 0

    def _slopes(
        self, b: int, s: float, x: Unknowns, earlier: list[int], w: Floats, scaling: Any
    ) -> tuple[Floats, Floats]:
        """Return the derivatives of w . F by the parameters (np,) and the drivers' values (nd,)."""
        g, u = self.graphs, self.u(s)
        slope, load, by_u = np.zeros(len(self.p)), np.zeros(g.nx), np.zeros(g.nu)
        weight = w / scaling.rows
        for k in (b, *reversed(earlier)):
            graph = g.blocks[k]
            _, J, Fz = graph.value_at(x, u, self.p)
            if k != b:  # unknowns of earlier blocks follow the numbers
                weight = -solve(J.T, load[graph.own])
            by_numbers, by_drivers = self._by_numbers(k, x, u)
            slope[graph.params] += weight @ by_numbers
            by_u += weight @ by_drivers
            if graph.uses:
                load[graph.uses] += Fz.T @ weight
        return slope, by_u

    def _by_numbers(self, b: int, x: Unknowns, u: Floats) -> tuple[Floats, Floats]:
        """Return the derivatives of a block's equations by its parameters and by the drivers."""
        g, graph = self.graphs, self.graphs.blocks[b]

        def make() -> Graph:
            symbols = graph.function.sx_in()
            value = graph.function(*symbols)
            parts = [ca.densify(ca.jacobian(value, symbols[k])) for k in (3, 2)]
            return ca.Function("by_numbers", symbols, parts)

        function = g.cache(("by numbers", b), make)
        first, second = function(x[graph.own], x[graph.uses], u, self.p[graph.params])
        return np.array(first), np.array(second)

    def _driven(self, s: float) -> Any:
        """Return by how much each driver's value may differ from what was meant (nd,)."""
        course, u = self.graphs.course, self.u(s)
        several = course is not None and np.count_nonzero(course.jet(s)[1]) > 1
        return (COMPUTED if several else KNOWN) * np.spacing(np.abs(u))

    @property
    def _grain(self) -> tuple[Floats, Floats]:
        """By how much each parameter may differ from what was meant, and decimals from doubles."""
        model = self.graphs.scene.model
        given = dict(model.mechanism.parameters)
        computed = np.array([isinstance(given.get(name), str) for name in model.p_names], bool)
        meant = [Decimal(repr(float(value))) for value in self.p]
        few = np.array(
            [len(number.normalize().as_tuple().digits) <= FIGURES for number in meant], bool
        )
        rounded = [number - Decimal(float(v)) for number, v in zip(meant, self.p, strict=True)]
        short = np.array([gap == 0 for gap in rounded], bool) | few
        units = np.where(computed, COMPUTED, np.where(short, 0.0, KNOWN))
        shift = np.where(few & ~computed, floats(rounded), 0.0)
        return units * np.spacing(np.abs(self.p)), shift


def floats(values: list[Any]) -> Floats:
    return np.array([float(value) for value in values])
