"""Power series with a bound of what is left out, and casadi functions evaluated with them.

A value is a polynomial in 0 <= t <= 1 and a bound of its distance from the function that it
stands for. Sums, products, sines and cosines keep both; what else a function holds is refused.
Rounding is not in the bound.

With symbols for coefficients they are graphs, over -1 <= t <= 1, evaluated for many steps at once.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import cached_property
from typing import Any, Self

import casadi as ca
import numpy as np

from mechdae.kernels.bounds.walk import ARRAYS, replay
from mechdae.types import Floats, Graph, Jacobians, Matrices


class NoSeries(Exception):
    """The function holds an operation that is not known here."""


class BoundedSeries:
    """Coefficients ``c``, from that of 1 on, and a bound ``e`` of what is left out."""

    __slots__ = ("__dict__", "c", "e")

    def __init__(self, c: Any, e: Any = 0.0) -> None:
        self.c = c
        self.e = e

    def plus(self, b: Value) -> Self:
        """Return the sum with a value."""
        raise NotImplementedError

    def times(self, b: Value) -> Self:
        """Return the product with a value."""
        raise NotImplementedError

    def __neg__(self) -> Self:
        raise NotImplementedError

    @cached_property
    def waves(self) -> tuple[Self, Self]:
        """Sine and cosine."""
        raise NotImplementedError


class BoundedPolynomial(BoundedSeries):
    """A polynomial with coefficients ``c`` (k,) and a bound ``e`` of the error for 0 <= t <= 1."""

    __slots__ = ()

    def plus(self, b: Value) -> BoundedPolynomial:
        if isinstance(b, BoundedPolynomial):
            return BoundedPolynomial(self.c + b.c, self.e + b.e)
        c = self.c.copy()
        c[0] += b
        return BoundedPolynomial(c, self.e)

    def times(self, b: Value) -> BoundedPolynomial:
        if not isinstance(b, BoundedPolynomial):
            return BoundedPolynomial(self.c * b, self.e * abs(b))
        count = len(self.c)
        full = np.convolve(self.c, b.c)
        left = float(np.abs(full[count:]).sum())
        if self.e or b.e:
            left += self.size * b.e + b.size * self.e + self.e * b.e
        return BoundedPolynomial(full[:count], left)

    def __neg__(self) -> BoundedPolynomial:
        return BoundedPolynomial(-self.c, self.e)

    @cached_property
    def size(self) -> float:
        """A bound of the polynomial's absolute value."""
        return float(np.abs(self.c).sum())

    @cached_property
    def waves(self) -> tuple[BoundedPolynomial, BoundedPolynomial]:
        """Sine and cosine.

        The coefficients left out are bounded by those of exp of the absolute coefficients.
        """
        count = len(self.c)
        rise = self.c * np.arange(count)
        steep = np.abs(rise)
        sine, cosine, most = np.zeros(count), np.zeros(count), np.zeros(count)
        sine[0], cosine[0], most[0] = np.sin(self.c[0]), np.cos(self.c[0]), 1.0
        for k in range(1, count):
            last = rise[k:0:-1]
            sine[k] = last @ cosine[:k] / k
            cosine[k] = -(last @ sine[:k]) / k
            most[k] = steep[k:0:-1] @ most[:k] / k
        whole = np.exp(min(self.size - abs(self.c[0]), 700.0))
        left = max(whole - most.sum(), 0.0) + self.e
        return BoundedPolynomial(sine, left), BoundedPolynomial(cosine, left)


Value = Any
"""A number, which does not move, or a series."""


def plus(a: Value, b: Value) -> Value:
    """Return the sum of two values."""
    if not isinstance(a, BoundedSeries):
        a, b = b, a
    return a.plus(b) if isinstance(a, BoundedSeries) else a + b


def product(a: Value, b: Value) -> Value:
    """Return the product of two values."""
    if not isinstance(a, BoundedSeries):
        a, b = b, a
    return a.times(b) if isinstance(a, BoundedSeries) else a * b


def _over(a: Value, b: Value) -> Value:
    if isinstance(b, BoundedSeries):
        raise NoSeries
    return product(a, 1 / b)


def _wave(a: Value, k: int) -> Value:
    if isinstance(a, BoundedSeries):
        return a.waves[k]
    return ((ca.sin, ca.cos) if isinstance(a, ca.SX) else (np.sin, np.cos))[k](a)


OPERATIONS: dict[int, Callable[..., Value]] = {
    ca.OP_ASSIGN: lambda a: a,
    ca.OP_ADD: plus,
    ca.OP_SUB: lambda a, b: plus(a, -b),
    ca.OP_MUL: product,
    ca.OP_DIV: _over,
    ca.OP_NEG: lambda a: -a,
    ca.OP_SQ: lambda a: product(a, a),
    ca.OP_TWICE: lambda a: product(a, 2.0),
    ca.OP_INV: lambda a: _over(1.0, a),
    ca.OP_SIN: lambda a: _wave(a, 0),
    ca.OP_COS: lambda a: _wave(a, 1),
}
"""What is known of series; numbers and symbols among its values go with them."""


_GIVEN = (ca.OP_INPUT, ca.OP_CONST)


class SeriesFunction:
    """Evaluates an SX function with dense vector inputs and outputs for series.

    Parameters
    ----------
    function
    numbers
        Positions of the inputs that hold floats only: of them any function may be taken.

    Raises
    ------
    NoSeries
        The function holds other operations than sums, products, sines, cosines.
    """

    def __init__(self, function: Graph, numbers: Collection[int] = ()) -> None:
        self.sizes: list[int] = [function.numel_out(i) for i in range(function.n_out())]
        self._still: list[tuple[Any, ...]] = []
        self._line: list[tuple[Any, ...]] = []
        known: dict[int, int] = {}
        """Where registers of the function are now; those of numbers are never written again."""
        still: set[int] = set()
        for k in range(function.n_instructions()):
            code = function.instruction_id(k)
            into, out_of = function.instruction_output(k), function.instruction_input(k)
            if code == ca.OP_OUTPUT:
                self._line.append(("out", tuple(into), known[out_of[0]]))
                continue
            source: tuple[int, ...] = (
                tuple(known[i] for i in out_of) if code not in _GIVEN else tuple(out_of)
            )
            alone = code == ca.OP_CONST or (
                out_of[0] in numbers if code == ca.OP_INPUT else still.issuperset(source)
            )
            known[into[0]] = k
            if alone:
                still.add(k)
            what: Any = "in"
            if code == ca.OP_CONST:
                what, source = "number", function.instruction_constant(k)
            elif code != ca.OP_INPUT:
                table = ARRAYS if alone and code not in OPERATIONS else OPERATIONS
                if code not in table:
                    raise NoSeries
                what = table[code]
            (self._still if alone else self._line).append((what, k, source))

    def numbers(self, inputs: Sequence[Sequence[Value]]) -> dict[int, Value]:
        """Return all that follows from the inputs that hold floats only, to be kept."""
        work: dict[int, Value] = {}
        self._run(self._still, inputs, work, [])
        return work

    def __call__(
        self, inputs: Sequence[Sequence[Value]], numbers: dict[int, Value] | None = None
    ) -> list[list[Value]]:
        """Return the outputs' entries, floats or series, for such entries of the inputs.

        `numbers` are what `numbers` gives for the same floats.
        """
        work = dict(self.numbers(inputs) if numbers is None else numbers)
        results: list[list[Value]] = [[0.0] * size for size in self.sizes]
        self._run(self._line, inputs, work, results)
        return results

    @staticmethod
    def _run(
        line: list[tuple[Any, ...]], inputs: Sequence[Sequence[float | BoundedPolynomial]],
        work: dict[int, float], results: list[list[float]],
    ) -> None:  # fmt: skip
        for what, target, source in line:
            if what == "in":
                work[target] = inputs[source[0]][source[1]]
            elif what == "number":
                work[target] = source
            elif what == "out":
                results[target[0]][target[1]] = work[source]
            else:
                work[target] = what(*[work[i] for i in source])


def coefficients(values: Sequence[Value], count: int) -> tuple[Floats, Floats]:
    """Return coefficients (count, k) and errors (k,) of floats and series."""
    c, e = np.zeros((count, len(values))), np.zeros(len(values))
    for i, value in enumerate(values):
        if isinstance(value, BoundedPolynomial):
            c[:, i], e[i] = value.c, value.e
        else:
            c[0, i] = value
    return c, e


def times(a: Matrices, b: Matrices, count: int) -> Matrices:
    """Return the first `count` coefficients of a product, (k, n, m) times (l, m, r)."""
    result = np.zeros((count, a.shape[1], b.shape[2]))
    for i in range(min(len(a), count)):
        part = a[i] @ b[: count - i]
        result[i : i + len(part)] += part
    return result


def inverse(J: Jacobians, count: int) -> Jacobians:
    """Return the first `count` coefficients of the inverse of J (k, n, n)."""
    found, n = np.linalg.inv(J[0])[None], J.shape[1]
    while len(found) < count:
        longer = min(2 * len(found), count)
        rest = -times(J[:longer], found, longer)
        rest[0] += 2 * np.eye(n)
        found = times(found, rest, longer)
    return found


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
