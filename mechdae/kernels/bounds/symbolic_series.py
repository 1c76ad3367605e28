"""Power series with symbols for coefficients and a bound of what is left out, in casadi graphs.

A value is c_0 + c_1 t + ... + c_k t^k for -1 <= t <= 1 and a bound of its distance from the
function that it stands for. As `series`, but as a graph, which is evaluated for many steps at once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca

from mechdae.kernels.bounds.series import NoSeries
from mechdae.kernels.bounds.walk import replay

SX = ca.SX
ROUNDED = 2.0**-50
"""Share of exp that its rounding and that of its partial sum may have."""


class SymbolicSeries:
    """Coefficients ``c`` (k + 1) and a bound ``e``, all scalar SX."""

    def __init__(self, c: Sequence[Any], e: Any = None) -> None:
        self.c, self.e = list(c), SX(0) if e is None else e
        self._waves: tuple[SymbolicSeries, SymbolicSeries] | None = None

    @property
    def size(self) -> Any:
        """A bound of the polynomial's absolute value."""
        return total([ca.fabs(part) for part in self.c])

    @property
    def waves(self) -> tuple[SymbolicSeries, SymbolicSeries]:
        """Sine and cosine; what is left out is bounded by that of exp of absolute coefficients."""
        if self._waves is None:
            self._waves = self._turned()
        return self._waves

    def _turned(self) -> tuple[SymbolicSeries, SymbolicSeries]:
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


Value = Any
"""A scalar SX, which does not move, or a series."""


def total(parts: Sequence[Any]) -> Any:
    """Return the sum of scalars."""
    result = SX(0)
    for part in parts:
        result = result + part
    return result


def plus(a: Value, b: Value) -> Value:
    """Return the sum of two values."""
    if not isinstance(a, SymbolicSeries):
        a, b = b, a
    if not isinstance(a, SymbolicSeries):
        return a + b
    if isinstance(b, SymbolicSeries):
        return SymbolicSeries([i + j for i, j in zip(a.c, b.c, strict=True)], a.e + b.e)
    return SymbolicSeries([a.c[0] + b, *a.c[1:]], a.e)


def times(a: Value, b: Value) -> Value:
    """Return the product of two values."""
    if not isinstance(a, SymbolicSeries):
        a, b = b, a
    if not isinstance(a, SymbolicSeries):
        return a * b
    if not isinstance(b, SymbolicSeries):
        return SymbolicSeries([part * b for part in a.c], a.e * ca.fabs(b))
    count, (p, q) = len(a.c), (a.c, b.c)
    c = [total([p[j] * q[k - j] for j in range(k + 1)]) for k in range(count)]
    left = total(
        [ca.fabs(p[j]) * ca.fabs(q[k]) for j in range(count) for k in range(count - j, count)]
    )
    return SymbolicSeries(c, left + a.size * b.e + b.size * a.e + a.e * b.e)


def _minus(a: Value) -> Value:
    return SymbolicSeries([-part for part in a.c], a.e) if isinstance(a, SymbolicSeries) else -a


def _over(a: Value, b: Value) -> Value:
    if isinstance(b, SymbolicSeries):
        raise NoSeries
    return times(a, 1 / b)


_OPERATIONS: dict[int, Callable[..., Value]] = {
    ca.OP_ASSIGN: lambda a: a,
    ca.OP_ADD: plus,
    ca.OP_SUB: lambda a, b: plus(a, _minus(b)),
    ca.OP_MUL: times,
    ca.OP_DIV: _over,
    ca.OP_NEG: _minus,
    ca.OP_SQ: lambda a: times(a, a),
    ca.OP_TWICE: lambda a: times(a, SX(2)),
    ca.OP_INV: lambda a: _over(SX(1), a),
    ca.OP_SIN: lambda a: a.waves[0] if isinstance(a, SymbolicSeries) else ca.sin(a),
    ca.OP_COS: lambda a: a.waves[1] if isinstance(a, SymbolicSeries) else ca.cos(a),
}


def expanded(function: Any, inputs: Sequence[Sequence[Value]]) -> list[list[Value]]:
    """Return the entries of a function's outputs for such entries of its inputs.

    Raises
    ------
    NoSeries
        The function holds other operations than sums, products, sines, cosines.
    """

    def operation(code: int, values: Sequence[Value]) -> Value:
        if code not in _OPERATIONS:
            raise NoSeries
        return _OPERATIONS[code](*values)

    return replay(function, inputs, operation, SX)
