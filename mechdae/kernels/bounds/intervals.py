"""Bounds of expressions that hold more than sums, products, sines and cosines.

Curves may divide, take roots, clamp: `majorant` refuses such expressions, this module
encloses them. An expression graph is walked with intervals [low, high], symbolic like the
bounds they start from, and with a bound of the rounding error in units of the roundoff.

A divisor (or what a root, a logarithm, a tangent may not come near) is bounded from below
by its interval; where that holds zero, by a *floor*: a symbol whose value is the size the
divisor keeps along the path. A bound that needs a floor is an estimate: the divisor is
measured at the nodes of the path, not between them. So is one with pieces (min, max, abs,
sign, a curve of one turn): it takes the pieces to join smoothly.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import casadi as ca

from mechdae.kernels.bounds.walk import SYMBOLIC, NoMajorant, replay
from mechdae.records import dataclass
from mechdae.types import Sym

SX = ca.SX
SLOTS = 64
"""Divisors of one scene at most."""
PIECES = (
    ca.OP_FMIN,
    ca.OP_FMAX,
    ca.OP_FABS,
    ca.OP_SIGN,
    ca.OP_REMAINDER,
    ca.OP_LT,
    ca.OP_LE,
    ca.OP_EQ,
    ca.OP_NE,
    ca.OP_NOT,
    ca.OP_IF_ELSE_ZERO,
)
LOGICAL = (ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_NOT)


class Floors:
    """The divisors of a scene, each with a symbol for the least size it keeps.

    Parameters
    ----------
    symbols : SX (slots,)
        Symbols to hand out.
    """

    def __init__(self, symbols: Sym) -> None:
        self.symbols = symbols
        self._free = symbols.elements()
        self.divisors: list[Any] = []
        self._known: dict[str, object] = {}
        self.pieces = False

    def of(self, divisor: Sym) -> Sym:
        """Return the floor of |divisor|, an expression over the scene's symbols."""
        text = str(divisor)
        if text not in self._known:
            if len(self.divisors) == len(self._free):
                raise NoMajorant("a curve with more divisors than can be bounded")
            self._known[text] = self._free[len(self.divisors)]
            self.divisors.append(divisor)
        return self._known[text]


Rounding = Callable[[], Any]
Bounds = tuple[Any, Any, Rounding]
"""Lower and upper bound of a value, and of its rounding error."""


def exact() -> int:
    """Return the rounding error of what has none."""
    return 0


@dataclass(frozen=True)
class Interval:
    """Where a value lies, its rounding error, the value itself in the scene's symbols.

    ``rounding`` makes the bound of the error when it is asked for; ``fixed`` tells that it
    is made of numbers and parameters only; ``choices`` counts the conditions that a sum of
    conditions is made of.
    """

    low: Sym
    high: Sym
    rounding: Rounding
    value: Sym
    fixed: bool = False
    choices: int = 0

    @cached_property
    def size(self) -> Sym:
        """The largest absolute value."""
        return ca.fabs(self.low) if self.fixed else ca.fmax(ca.fabs(self.low), ca.fabs(self.high))

    @cached_property
    def error(self) -> Sym:
        """The rounding error in units of the roundoff."""
        return SX(self.rounding())

    @cached_property
    def least(self) -> Sym:
        """The least absolute value; 0 where the interval holds zero."""
        return ca.fmax(ca.fmax(self.low, -self.high), 0)


def enclosure(
    expressions: Sym,
    moving: Sequence[Sym],
    ranges: Sequence[tuple[Sym, Sym]],
    floors: Floors,
    rounding: bool = True,
) -> tuple[Sym, Sym]:
    """Return bounds of the absolute values and of the rounding errors of `expressions`.

    Parameters
    ----------
    expressions : SX (k,)
    moving, ranges : lists of SX vectors and of pairs (low, high)
        Symbols that change with the pose, and where they lie.
    floors
        Divisors met so far.
    rounding
        Whether errors are wanted.

    Returns
    -------
    magnitude, error : SX (k,)

    Raises
    ------
    NoMajorant
        An operation that is not known here.
    """
    found = _enclosed(expressions, moving, ranges, floors)
    if not found:
        return SX(0, 1), SX(0, 1)
    magnitude = ca.vertcat(*[f.size for f in found])
    return magnitude, ca.vertcat(*[f.error for f in found]) if rounding else SX(0, 1)


def lower_bounds(expressions: Sym, moving: Sequence[Sym], ranges: Sequence[tuple[Sym, Sym]]) -> Sym:
    """Return the least absolute values of `expressions`, 0 where there is no bound."""
    count = expressions.numel()
    nothing = Floors(SX.zeros(count + SLOTS))
    found = _enclosed(expressions, moving, ranges, nothing)
    return ca.vertcat(*[f.least for f in found]) if found else SX(0, 1)


def _enclosed(
    expressions: Sym, moving: Sequence[Sym], ranges: Sequence[tuple[Sym, Sym]], floors: Floors
) -> list[Interval]:
    stacked = ca.vec(ca.densify(expressions))
    known = {symbol.element_hash() for group in moving for symbol in group.elements()}
    parameters = [s for s in ca.symvar(stacked) if s.element_hash() not in known]
    function = ca.Function("f", [*moving, ca.veccat(*parameters)], [stacked])
    inputs = [
        [
            Interval(low, high, exact, symbol)
            for symbol, low, high in zip(
                group.elements(), ca.vec(lows).elements(), ca.vec(highs).elements(), strict=True
            )
        ]
        for group, (lows, highs) in zip(moving, ranges, strict=True)
    ]
    inputs.append([Interval(p, p, exact, p, True) for p in parameters])
    walk = _Walk(floors)
    return replay(function, inputs, walk.step, walk.constant)[0]


class _Walk:
    """The operations on intervals."""

    def __init__(self, floors: Floors) -> None:
        self.floors = floors

    @staticmethod
    def constant(number: float) -> Interval:
        value = SX(number)
        return Interval(value, value, exact, value, True)

    def step(self, code: int, inputs: list[Interval]) -> Interval:
        if code not in SYMBOLIC:
            raise NoMajorant
        value = SYMBOLIC[code](*[entry.value for entry in inputs])
        if all(entry.fixed for entry in inputs):
            if code in (ca.OP_NEG, ca.OP_TWICE):
                return Interval(value, value, lambda: inputs[0].error, value, True)
            return Interval(value, value, lambda: 4 * ca.fabs(value), value, True)
        if code in PIECES:
            self.floors.pieces = True
        choices = _choices(code, inputs)
        low, high, rounding = self._bounded(code, *inputs)
        return Interval(SX(low), SX(high), rounding, value, choices=choices)

    def _bounded(self, code: int, a: Interval, b: Interval | None = None) -> Bounds:
        if b is None:
            return self._one(code, a)
        if code == ca.OP_LE:
            return a.high <= b.low, a.low <= b.high, exact
        if code == ca.OP_LT:
            return a.high < b.low, a.low < b.high, exact
        if code in LOGICAL:
            return 0, 1, exact
        if code == ca.OP_ADD:
            low, high = a.low + b.low, a.high + b.high
        elif code == ca.OP_SUB:
            low, high = a.low - b.high, a.high - b.low
        elif code == ca.OP_MUL:
            low, high = _product(a, b)
            return low, high, lambda: a.error * b.size + b.error * a.size + a.size * b.size
        elif code == ca.OP_DIV:
            return self._quotient(a, b)
        elif code in (ca.OP_POW, ca.OP_CONSTPOW):
            return self._power(a, b)
        elif code == ca.OP_FMIN:
            low, high = ca.fmin(a.low, b.low), ca.fmin(a.high, b.high)
            return low, high, lambda: ca.fmax(a.error, b.error)
        elif code == ca.OP_FMAX:
            low, high = ca.fmax(a.low, b.low), ca.fmax(a.high, b.high)
            return low, high, lambda: ca.fmax(a.error, b.error)
        elif code == ca.OP_IF_ELSE_ZERO:
            low = ca.if_else(a.low > 0, b.low, a.high * ca.fmin(b.low, 0))
            high = ca.if_else(a.low > 0, b.high, a.high * ca.fmax(b.high, 0))
            return low, high, lambda: b.error
        elif code == ca.OP_REMAINDER and b.fixed:
            half, first = b.size / 2, ca.remainder(a.low, b.value)
            last = first + (a.high - a.low)
            whole = last > half  # the interval holds a place where the remainder jumps
            low, high = ca.if_else(whole, -half, first), ca.if_else(whole, half, last)
            return low, high, lambda: a.error + a.size + b.error * a.size / b.size
        elif code == ca.OP_ATAN2:
            radius = self._above(a.value**2 + b.value**2, a.least**2 + b.least**2)
            across = (a, b)

            def turned() -> Sym:
                y, x = across
                return (y.error * x.size + x.error * y.size) / radius + math.pi

            return -math.pi, math.pi, turned
        else:
            raise NoMajorant
        size = ca.fmax(ca.fabs(low), ca.fabs(high))
        return low, high, lambda: a.error + b.error + size

    def _one(self, code: int, a: Interval) -> Bounds:
        if code in (ca.OP_SIN, ca.OP_COS):
            middle, half = (a.low + a.high) / 2, (a.high - a.low) / 2
            here = ca.sin(middle) if code == ca.OP_SIN else ca.cos(middle)
            return ca.fmax(here - half, -1), ca.fmin(here + half, 1), lambda: a.error + 1
        if code == ca.OP_SQ:
            return a.least**2, a.size**2, lambda: 2 * a.error * a.size + a.size**2
        if code == ca.OP_TWICE:
            return 2 * a.low, 2 * a.high, lambda: 2 * a.error
        if code == ca.OP_NEG:
            return -a.high, -a.low, lambda: a.error
        if code == ca.OP_INV:
            one = Interval(SX(1), SX(1), exact, SX(1), True)
            return self._quotient(one, a)
        if code == ca.OP_FABS:
            return a.least, a.size, lambda: a.error
        if code == ca.OP_SIGN:
            return ca.sign(a.low), ca.sign(a.high), exact
        if code == ca.OP_NOT:
            return 1 - a.high, 1 - a.low, exact
        return self._function(code, a)

    def _function(self, code: int, a: Interval) -> Bounds:
        """Bound a function of one argument, with the largest slope for the error."""
        inner = (ca.fmax(a.low, -1), ca.fmin(a.high, 1))
        if code == ca.OP_EXP:
            low, high = ca.exp(a.low), ca.exp(a.high)
            slope = high
        elif code == ca.OP_SINH:
            low, high, slope = ca.sinh(a.low), ca.sinh(a.high), ca.cosh(a.size)
        elif code == ca.OP_COSH:
            low, high, slope = ca.cosh(a.least), ca.cosh(a.size), ca.sinh(a.size)
        elif code == ca.OP_TANH:
            low, high, slope = ca.tanh(a.low), ca.tanh(a.high), 1
        elif code == ca.OP_ATAN:
            low, high, slope = ca.atan(a.low), ca.atan(a.high), 1
        elif code == ca.OP_SQRT:
            least = self._above(a.value, ca.fmax(a.low, 0))
            low, high = ca.sqrt(ca.fmax(a.low, 0)), ca.sqrt(ca.fmax(a.high, 0))
            slope = 1 / (2 * ca.sqrt(least))
        elif code == ca.OP_LOG:
            least = self._above(a.value, ca.fmax(a.low, 0))
            low, high, slope = ca.log(least), ca.log(ca.fmax(a.high, least)), 1 / least
        elif code == ca.OP_TAN:
            slope = 1 / self._above(ca.cos(a.value), 0) ** 2
            low, high = -ca.sqrt(slope), ca.sqrt(slope)
        elif code in (ca.OP_ASIN, ca.OP_ACOS):
            slope = 1 / ca.sqrt(self._above(1 - a.value**2, 1 - ca.fmin(a.size, 1) ** 2))
            low, high = (ca.asin(inner[0]), ca.asin(inner[1]))
            if code == ca.OP_ACOS:
                low, high = ca.acos(inner[1]), ca.acos(inner[0])
        else:
            raise NoMajorant
        return low, high, lambda: a.error * slope + 2 * ca.fmax(ca.fabs(low), ca.fabs(high))

    def _above(self, divisor: Sym, least: Sym) -> Sym:
        """Return a lower bound of |divisor|: of its interval, else its floor."""
        return ca.fmax(least, self.floors.of(divisor))

    def _quotient(self, a: Interval, b: Interval) -> Bounds:
        """Return the bounds of a / b."""
        if a.choices == 1 and b.choices == 2:
            # casadi's slope of min and max: (x <= y) / ((x <= y) + (y <= x))
            return a.low / ca.fmax(b.high, 1), a.high, lambda: 1
        least = b.size if b.fixed else self._above(b.value, b.least)
        size = a.size / least

        def rounding() -> Sym:
            return (a.error + size * b.error) / least + size

        if b.fixed:
            ends = a.low / b.low, a.high / b.low
            return ca.fmin(*ends), ca.fmax(*ends), rounding
        # one sign of the divisor where its interval tells it
        below = ca.if_else(ca.logic_and(b.low > 0, a.low >= 0), a.low / b.size, -size)
        return below, size, rounding

    def _power(self, a: Interval, b: Interval) -> Bounds:
        """Return the bounds of a ** b for a fixed whole exponent, else of exp(b log a)."""
        if b.fixed and b.value.is_constant() and float(b.value) == round(float(b.value)):
            n = int(float(b.value))
            size = a.size**n if n >= 0 else 1 / self._above(a.value, a.least) ** -n
            slope = abs(n) * (a.size ** (n - 1) if n >= 1 else size / self._above(a.value, a.least))
            return (0 if n % 2 == 0 else -size), size, lambda: a.error * slope + 4 * size
        least = a.low if a.fixed else self._above(a.value, ca.fmax(a.low, 0))
        most = ca.fmax(a.high, least)
        ends = [base**power for base in (least, most) for power in (b.low, b.high)]
        size = ca.fmax(ca.fmax(ends[0], ends[1]), ca.fmax(ends[2], ends[3]))
        logs = ca.fmax(ca.fabs(ca.log(least)), ca.fabs(ca.log(most)))
        return 0, size, lambda: size * (b.size * a.error / least + logs * b.error + 4)


def _choices(code: int, inputs: list[Interval]) -> int:
    """Return how many conditions the value adds up, 0 where it is no sum of conditions."""
    if code in LOGICAL:
        return 1
    counts = [entry.choices for entry in inputs]
    return sum(counts) if code == ca.OP_ADD and all(counts) else 0


def _product(a: Interval, b: Interval) -> tuple[Sym, Sym]:
    if a.fixed or b.fixed:
        fixed, other = (a, b) if a.fixed else (b, a)
        ends = fixed.low * other.low, fixed.low * other.high
        return ca.fmin(*ends), ca.fmax(*ends)
    corners = [x * y for x in (a.low, a.high) for y in (b.low, b.high)]
    low = ca.fmin(ca.fmin(corners[0], corners[1]), ca.fmin(corners[2], corners[3]))
    high = ca.fmax(ca.fmax(corners[0], corners[1]), ca.fmax(corners[2], corners[3]))
    return low, high
