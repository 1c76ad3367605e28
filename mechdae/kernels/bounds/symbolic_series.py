"""Power series with symbols for coefficients and a bound of what is left out, in casadi graphs.

A value is c_0 + c_1 t + ... + c_k t^k for -1 <= t <= 1 and a bound of its distance from the
function that it stands for. As `series`, but as a graph, which is evaluated for many steps at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import casadi as ca

from mechdae.kernels.bounds.series import OPERATIONS, BoundedSeries, NoSeries, Value
from mechdae.kernels.bounds.walk import replay

SX = ca.SX
ROUNDED = 2.0**-50
"""Share of exp that its rounding and that of its partial sum may have."""


class SymbolicSeries(BoundedSeries):
    """Coefficients ``c`` (k + 1) and a bound ``e``, all scalar SX."""

    __slots__ = ()

    def __init__(self, c: Sequence[Any], e: Any = None) -> None:
        super().__init__(list(c), SX(0) if e is None else e)

    @property
    def size(self) -> Any:
        """A bound of the polynomial's absolute value."""
        return total([ca.fabs(part) for part in self.c])

    @cached_property
    def waves(self) -> tuple[SymbolicSeries, SymbolicSeries]:
        """Sine and cosine; what is left out is bounded by that of exp of absolute coefficients."""
        rise = [k * part for k, part in enumerate(self.c)]
        steep = [ca.fabs(part) for part in rise]
        sine, cosine, most = [ca.sin(self.c[0])], [ca.cos(self.c[0])], [SX(1)]
        for k in range(1, len(self.c)):
            share = [rise[j] / k for j in range(1, k + 1)]
            sine.append(total([part * cosine[k - 1 - j] for j, part in enumerate(share)]))
            cosine.append(-total([part * sine[k - 1 - j] for j, part in enumerate(share)]))
            most.append(total([steep[j] * most[k - j] for j in range(1, k + 1)]) / k)
        whole = ca.exp(total([ca.fabs(part) for part in self.c[1:]]))
        left = ca.fmax(whole - total(most), 0) + ROUNDED * whole + self.e
        return SymbolicSeries(sine, left), SymbolicSeries(cosine, left)

    def plus(self, b: Value) -> SymbolicSeries:
        if isinstance(b, SymbolicSeries):
            return SymbolicSeries([i + j for i, j in zip(self.c, b.c, strict=True)], self.e + b.e)
        return SymbolicSeries([self.c[0] + b, *self.c[1:]], self.e)

    def times(self, b: Value) -> SymbolicSeries:
        if not isinstance(b, SymbolicSeries):
            return SymbolicSeries([part * b for part in self.c], self.e * ca.fabs(b))
        count, (p, q) = len(self.c), (self.c, b.c)
        c = [total([p[j] * q[k - j] for j in range(k + 1)]) for k in range(count)]
        left = total(
            [ca.fabs(p[j]) * ca.fabs(q[k]) for j in range(count) for k in range(count - j, count)]
        )
        return SymbolicSeries(c, left + self.size * b.e + b.size * self.e + self.e * b.e)

    def __neg__(self) -> SymbolicSeries:
        return SymbolicSeries([-part for part in self.c], self.e)


def total(parts: Sequence[Any]) -> Any:
    """Return the sum of scalars."""
    result = SX(0)
    for part in parts:
        result = result + part
    return result


def expanded(function: Any, inputs: Sequence[Sequence[Value]]) -> list[list[Value]]:
    """Return the entries of a function's outputs for such entries of its inputs.

    Raises
    ------
    NoSeries
        The function holds other operations than sums, products, sines, cosines.
    """

    def operation(code: int, values: Sequence[Value]) -> Value:
        if code not in OPERATIONS:
            raise NoSeries
        return OPERATIONS[code](*values)

    return replay(function, inputs, operation, SX)
