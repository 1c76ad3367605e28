"""How fast expressions of the time change: bounds of their Taylor coefficients over cells.

A cell is an interval of the time. For each operation the coefficients of its result at any place of
the cell follow from those of its arguments, and so do bounds of them; where the last one is
small the expression is a polynomial over the whole cell, and nothing narrow hides between places
at which it is looked at. Corners (abs, sign, min, max) count as either of their sides.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.kernels.bounds.walk import ARRAYS, replay, symbolic
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Graph, Sym

ORDER = 8
"""Of the last coefficient that is bounded."""
POWERS = 16
"""Largest whole exponent that is multiplied out."""


@dataclass
class Bound:
    """An expression over cells: value in the middle, least and largest value, (n,) each.

    ``terms`` (ORDER + 1, n) are bounds of the sizes of its Taylor coefficients at any place of
    the cell, over powers of half its length; ``torn`` (n,) tells where it may jump.
    """

    middle: Floats
    low: Floats
    high: Floats
    terms: Floats
    torn: bool = False

    def __post_init__(self) -> None:
        """Narrow the range to what the first coefficient allows; what is none has no bound."""
        with np.errstate(invalid="ignore"):
            low = np.where(self.torn, self.low, np.fmax(self.low, self.middle - self.terms[1]))
            high = np.where(self.torn, self.high, np.fmin(self.high, self.middle + self.terms[1]))
        lost = ~(low <= high)
        self.low, self.high = np.where(lost, -np.inf, low), np.where(lost, np.inf, high)
        self.terms = np.where(np.isnan(self.terms), np.inf, self.terms)
        self.terms[0] = np.maximum(np.abs(self.low), np.abs(self.high))

    @property
    def least(self) -> Floats:
        """Least size of the value."""
        return np.maximum(np.maximum(self.low, -self.high), 0.0)

    @property
    def fixed(self) -> bool:
        """Whether it is a number."""
        return not self.terms[1:].any() and bool((self.low == self.high).all())


def _times(a: Floats, b: Floats) -> Floats:
    """Return the product of two rows of coefficients."""
    found = np.zeros_like(a)
    for k in range(len(a)):
        found[k:] += _product(a[k], b[: len(b) - k])
    return found


def _product(a: Floats, b: Floats) -> Floats:
    """Return a b; nothing times what has no bound is nothing."""
    found = a * b
    return np.where(np.isnan(found), 0.0, found)


def _over(a: Floats, b: Floats, first: Floats, least: Floats) -> Floats:
    """Return the coefficients of a / b."""
    found = np.zeros_like(a)
    found[0] = first
    for k in range(1, len(found)):
        whole = a[k] + sum(_product(b[j], found[k - j]) for j in range(1, k + 1))
        found[k] = whole / least
    return found


def _integrated(rate: Floats, start: Floats) -> Floats:
    """Return the coefficients of what has a rate over the half length."""
    found = np.zeros_like(rate)
    found[0] = start
    for k in range(1, len(found)):
        found[k] = rate[k - 1] / k
    return found


def _rate(terms: Floats) -> Floats:
    """Return the coefficients of the rate."""
    found = np.zeros_like(terms)
    for k in range(1, len(terms)):
        found[k - 1] = k * terms[k]
    found[-1] = np.inf if terms[-1].any() else 0.0  # not known; it is never used
    return found


class Tempo:
    """Bounds of expressions of one symbol over cells.

    Parameters
    ----------
    t
        The symbol.
    expressions
        SX (k,).
    """

    def __init__(self, t: Sym, expressions: Sym) -> None:
        self.count: int = expressions.numel()
        self.function: Graph = ca.Function("tempo", [t], [ca.densify(expressions)])

    def values(self, times: Floats) -> Floats:
        """Return the values (n, k) at times (n,)."""
        found = np.array(self.function(np.reshape(times, (1, -1)))).reshape(self.count, -1)
        return found.T

    def over(self, begin: Floats, end: Floats) -> list[Bound]:
        """Return the bounds of each expression over cells [begin, end], (n,) each."""
        middle, half = (begin + end) / 2, (end - begin) / 2
        terms = np.zeros((ORDER + 1, len(middle)))
        terms[1] = half
        time = Bound(middle, begin, end, terms)
        self._size = len(middle)
        with np.errstate(all="ignore"):
            return replay(self.function, [[time]], self._step, self._number)[0]

    def _number(self, value: float) -> Bound:
        constant = np.full(self._size, float(value))
        return Bound(constant, constant, constant, np.zeros((ORDER + 1, self._size)))

    def _step(self, code: int, values: list[Bound]) -> Bound:
        middle = ARRAYS[code](*[value.middle for value in values])
        if all(value.fixed for value in values):
            return Bound(middle, middle, middle, np.zeros((ORDER + 1, self._size)))
        if code not in self._operations:
            raise NotImplementedError(f"operation {code} of the time")
        low, high, terms = self._operations[code](*values)
        torn = np.any([np.broadcast_to(value.torn, self._size) for value in values], axis=0)
        if code == ca.OP_SIGN:
            torn = torn | (low != high)
        return Bound(middle, low, high, terms, torn)

    @cached_property
    def _operations(self) -> dict[int, Callable[..., tuple[Floats, Floats, Floats]]]:
        return {
            ca.OP_ASSIGN: lambda a: (a.low, a.high, a.terms),
            ca.OP_ADD: lambda a, b: (a.low + b.low, a.high + b.high, a.terms + b.terms),
            ca.OP_SUB: lambda a, b: (a.low - b.high, a.high - b.low, a.terms + b.terms),
            ca.OP_NEG: lambda a: (-a.high, -a.low, a.terms),
            ca.OP_TWICE: lambda a: (2 * a.low, 2 * a.high, 2 * a.terms),
            ca.OP_MUL: _multiplied,
            ca.OP_SQ: _squared,
            ca.OP_DIV: _divided,
            ca.OP_INV: lambda a: _divided(self._number(1.0), a),
            ca.OP_POW: self._power,
            ca.OP_CONSTPOW: self._power,
            ca.OP_SIN: lambda a: _waved(a, np.sin, np.cos),
            ca.OP_COS: lambda a: _waved(a, np.cos, np.sin),
            ca.OP_TAN: _tangent,
            ca.OP_SINH: lambda a: _catenary(a, np.sinh, np.cosh),
            ca.OP_COSH: lambda a: _catenary(a, np.cosh, np.sinh),
            ca.OP_TANH: _saturated,
            ca.OP_EXP: _exponential,
            ca.OP_LOG: _logarithm,
            ca.OP_SQRT: lambda a: _rooted(a, 0.5),
            ca.OP_ATAN: _arctangent,
            ca.OP_ASIN: lambda a: _arc(a, np.arcsin),
            ca.OP_ACOS: lambda a: _arc(a, np.arccos),
            ca.OP_ATAN2: _angle,
            ca.OP_FABS: lambda a: (a.least, a.terms[0], a.terms),
            ca.OP_SIGN: _signed,
            ca.OP_FMIN: lambda a, b: _chosen(a, b, a.high < b.low, b.high < a.low, np.minimum),
            ca.OP_FMAX: lambda a, b: _chosen(a, b, a.low > b.high, b.low > a.high, np.maximum),
        }

    def _power(self, a: Bound, b: Bound) -> tuple[Floats, Floats, Floats]:
        """Return a**b."""
        if not b.fixed:
            moved = Bound(np.log(a.middle), *_logarithm(a), a.torn)
            product = Bound(b.middle * moved.middle, *_multiplied(b, moved), a.torn | b.torn)
            return _exponential(product)
        exponent = b.middle[0]
        if exponent == int(exponent) and 0 < exponent <= POWERS:
            found = a
            for _ in range(int(exponent) - 1):
                found = Bound(found.middle * a.middle, *_multiplied(found, a), a.torn)
            return found.low, found.high, found.terms
        return _rooted(a, exponent)


def _multiplied(a: Bound, b: Bound) -> tuple[Floats, Floats, Floats]:
    ends = np.array([_product(one, other) for one in (a.low, a.high) for other in (b.low, b.high)])
    return ends.min(axis=0), ends.max(axis=0), _times(a.terms, b.terms)


def _squared(a: Bound) -> tuple[Floats, Floats, Floats]:
    return a.least**2, a.terms[0] ** 2, _times(a.terms, a.terms)


def _divided(a: Bound, b: Bound) -> tuple[Floats, Floats, Floats]:
    inside = b.least <= 0
    ends = np.array([one / other for one in (a.low, a.high) for other in (b.low, b.high)])
    low = np.where(inside, -np.inf, ends.min(axis=0))
    high = np.where(inside, np.inf, ends.max(axis=0))
    first = np.maximum(np.abs(low), np.abs(high))
    return low, high, _over(a.terms, b.terms, first, b.least)


def _rooted(a: Bound, exponent: float) -> tuple[Floats, Floats, Floats]:
    """Return a**exponent: f_k = sum (exponent j - (k - j)) a_j f_(k-j) / (k a_0)."""
    ends = np.array([a.low, a.high]) ** exponent
    low, high = ends.min(axis=0), ends.max(axis=0)
    bad = np.isnan(low) | (a.low <= 0)
    low, high = np.where(bad, -np.inf, low), np.where(bad, np.inf, high)
    found = np.zeros_like(a.terms)
    found[0] = np.maximum(np.abs(low), np.abs(high))
    for k in range(1, len(found)):
        whole = sum(
            abs(exponent * j - (k - j)) * _product(a.terms[j], found[k - j])
            for j in range(1, k + 1)
        )
        found[k] = np.where(bad, np.inf, whole / (k * a.least))
    return low, high, found


def _waved(a: Bound, own: Any, other: Any) -> tuple[Floats, Floats, Floats]:
    """Return the sine or the cosine."""
    radius = np.fmax(a.high - a.middle, a.middle - a.low)
    middle, beside = own(a.middle), np.abs(other(a.middle))
    low, high = np.fmax(middle - radius, -1.0), np.fmin(middle + radius, 1.0)
    mine, its = np.zeros_like(a.terms), np.zeros_like(a.terms)
    mine[0] = np.fmin(np.fmax(np.abs(low), np.abs(high)), 1.0)
    its[0] = np.fmin(beside + radius, 1.0)
    for k in range(1, len(mine)):
        mine[k] = sum(j * _product(a.terms[j], its[k - j]) for j in range(1, k + 1)) / k
        its[k] = sum(j * _product(a.terms[j], mine[k - j]) for j in range(1, k + 1)) / k
    return low, high, mine


def _tangent(a: Bound) -> tuple[Floats, Floats, Floats]:
    sine = Bound(np.sin(a.middle), *_waved(a, np.sin, np.cos), a.torn)
    cosine = Bound(np.cos(a.middle), *_waved(a, np.cos, np.sin), a.torn)
    return _divided(sine, cosine)


def _catenary(a: Bound, function: Any, other: Any) -> tuple[Floats, Floats, Floats]:
    """Return sinh or cosh."""
    mine, its = np.zeros_like(a.terms), np.zeros_like(a.terms)
    mine[0], its[0] = np.abs(function(a.terms[0])), np.abs(other(a.terms[0]))
    for k in range(1, len(mine)):
        mine[k] = sum(j * _product(a.terms[j], its[k - j]) for j in range(1, k + 1)) / k
        its[k] = sum(j * _product(a.terms[j], mine[k - j]) for j in range(1, k + 1)) / k
    if function is np.sinh:
        return function(a.low), function(a.high), mine
    return function(a.least), function(a.terms[0]), mine


def _saturated(a: Bound) -> tuple[Floats, Floats, Floats]:
    """Return tanh: f' = (1 - f^2) a'."""
    low, high = np.tanh(a.low), np.tanh(a.high)
    found, slope = np.zeros_like(a.terms), np.zeros_like(a.terms)
    found[0] = np.maximum(np.abs(low), np.abs(high))
    slope[0] = 1 / np.cosh(np.minimum(a.least, 350.0)) ** 2
    for k in range(1, len(found)):
        found[k] = sum(j * _product(a.terms[j], slope[k - j]) for j in range(1, k + 1)) / k
        slope[k] = sum(_product(found[j], found[k - j]) for j in range(k + 1))
    return low, high, found


def _exponential(a: Bound) -> tuple[Floats, Floats, Floats]:
    found = np.zeros_like(a.terms)
    found[0] = np.exp(a.high)
    for k in range(1, len(found)):
        found[k] = sum(j * _product(a.terms[j], found[k - j]) for j in range(1, k + 1)) / k
    return np.exp(a.low), found[0], found


def _logarithm(a: Bound) -> tuple[Floats, Floats, Floats]:
    bad = a.low <= 0
    low, high = np.where(bad, -np.inf, np.log(a.low)), np.where(bad, np.inf, np.log(a.high))
    first = np.maximum(np.abs(low), np.abs(high))
    rates = _over(_rate(a.terms), a.terms, _rate(a.terms)[0] / a.least, a.least)
    return low, high, np.where(bad, np.inf, _integrated(rates, first))


def _arctangent(a: Bound) -> tuple[Floats, Floats, Floats]:
    below = _times(a.terms, a.terms)
    below[0] += 1
    rates = _over(_rate(a.terms), below, a.terms[1] / (1 + a.least**2), 1 + a.least**2)
    low, high = np.arctan(a.low), np.arctan(a.high)
    return low, high, _integrated(rates, np.maximum(np.abs(low), np.abs(high)))


def _arc(a: Bound, function: Callable[[Floats], Floats]) -> tuple[Floats, Floats, Floats]:
    """Return asin or acos: the size of f' is that of a' over the root of 1 - a^2."""
    one, other = function(a.low), function(a.high)
    low, high = np.fmin(one, other), np.fmax(one, other)
    square = Bound(a.middle**2, *_squared(a), a.torn)
    rest = Bound(1 - square.middle, 1 - square.high, 1 - square.low, square.terms, a.torn)
    inverse = _rooted(rest, -0.5)[2]
    rates = _times(_rate(a.terms), inverse)
    bad = rest.low <= 0
    low, high = np.where(bad, -np.inf, low), np.where(bad, np.inf, high)
    return low, high, np.where(bad, np.inf, _integrated(rates, np.full_like(low, np.pi)))


def _angle(y: Bound, x: Bound) -> tuple[Floats, Floats, Floats]:
    """Return atan2: f' = (y' x - y x') / (x^2 + y^2)."""
    below = _times(x.terms, x.terms) + _times(y.terms, y.terms)
    least = x.least**2 + y.least**2
    above = _times(_rate(y.terms), x.terms) + _times(y.terms, _rate(x.terms))
    rates = _over(above, below, above[0] / least, least)
    turned = (x.low <= 0) & (y.low <= 0) & (y.high >= 0)  # the cut, or the origin
    terms = np.where(turned, np.inf, _integrated(rates, np.full_like(least, np.pi)))
    return np.full_like(least, -np.pi), np.full_like(least, np.pi), terms


def _signed(a: Bound) -> tuple[Floats, Floats, Floats]:
    return np.sign(a.low), np.sign(a.high), np.zeros_like(a.terms)


def _chosen(
    a: Bound, b: Bound, first: Booleans, second: Booleans, least: Callable[[Floats, Floats], Floats]
) -> tuple[Floats, Floats, Floats]:
    terms = np.where(first, a.terms, np.where(second, b.terms, np.maximum(a.terms, b.terms)))
    return least(a.low, b.low), least(a.high, b.high), terms


CORNERS = (ca.OP_FABS, ca.OP_SIGN, ca.OP_FMIN, ca.OP_FMAX)


@dataclass(frozen=True)
class _Part:
    """A part of an expression with the state held; what it depends on."""

    own: Sym
    timed: bool
    moved: bool


def signals(t: Sym, state: Sym, held: Sequence[float], expressions: Sym) -> tuple[list[Sym], Sym]:
    """Return what the time alone does in expressions of it and of a state, and gaps of corners.

    Parameters
    ----------
    t, state
        Symbols.
    held
        Values of the state that stand where it is within what the time is in.
    expressions
        SX (k,).

    Returns
    -------
    list, SX
        Expressions of `t` whose changes are those of the time: parts that the state does not
        reach, and parts with the state held. Then the expressions of `t` alone at whose zeros
        there is a corner (abs, sign, min, max).
    """
    found: dict[int, Sym] = {}
    gaps: dict[int, Sym] = {}

    def keep(part: _Part) -> None:
        if part.timed:
            found.setdefault(part.own.element_hash(), part.own)

    def operation(code: int, values: list[_Part]) -> _Part:
        middle = symbolic(code, *[part.own for part in values])
        timed = any(part.timed for part in values)
        moved = any(part.moved for part in values)
        if timed and moved:
            for part in values:
                keep(part)
        if code in CORNERS and timed:
            if moved:  # a corner of the state: not at a time known
                return _Part(ca.SX(1), False, True)
            gap = values[0].own if len(values) == 1 else values[0].own - values[1].own
            gaps.setdefault(gap.element_hash(), gap)
        return _Part(middle, timed, moved)

    function = ca.Function("timed", [t, state], [ca.densify(expressions)])
    inputs = [
        [_Part(t, True, False)],
        [_Part(ca.SX(value), False, True) for value in held],
    ]
    for part in replay(function, inputs, operation, lambda x: _Part(ca.SX(x), False, False))[0]:
        keep(part)
    corners = list(gaps.values())
    for gap in corners:
        found.setdefault(gap.element_hash(), gap)
    return list(found.values()), ca.vertcat(*corners) if corners else ca.SX(0, 1)
