"""What claims are made of: exact numbers of a file, balls, and values with their derivatives."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TypeAlias, TypeVar

from flint import acb, arb, arb_series, ctx, fmpq

VERSION = 2
"""Of the certificates that are checked."""
PRECISION = 128
"""Bits of the middle of a ball."""
EXACT_PRECISION = 4096
"""Bits with which sums and products of a file's numbers stay exact."""
MOST_BYTES = 256_000_000
LAST = -1
"""Index in a pose of the parameter, which the drivers are formulas of."""
ZERO, ONE = arb(0), arb(1)
Value: TypeAlias = "arb | acb | arb_series | Dual"
"""Number, ball, power series, or value with its derivatives."""
Json: TypeAlias = dict[str, Any]
K = TypeVar("K")


class FalseClaim(Exception):
    """A claim that does not hold, or something that cannot be read; says where."""

    def __init__(self, place: str, why: str) -> None:
        super().__init__(f"{place}: {why}")


def need(holds: object, place: str, why: str) -> None:
    """Refuse a claim that does not hold."""
    if not holds:
        raise FalseClaim(place, why)


def read(path: str) -> Any:
    """Return the content of a file, of at most `MOST_BYTES`; no key may stand twice."""

    def without_repeats(pairs: list[tuple[str, object]]) -> dict[str, object]:
        if len(dict(pairs)) < len(pairs):
            raise RecursionError(f"a key stands twice among {[key for key, _ in pairs][:5]}")
        return dict(pairs)

    with open(path, "rb") as file:
        text = file.read(MOST_BYTES + 1)
    need(len(text) <= MOST_BYTES, path, f"longer than {MOST_BYTES} bytes")
    try:
        return json.loads(text.decode(), object_pairs_hook=without_repeats)
    except (ValueError, RecursionError) as error:
        raise FalseClaim(path, f"cut off, or no JSON: {str(error)[:150]}") from None


def field(data: object, key: str, kind: type[K], place: str) -> K:
    """Return the value of a key, of the kind that is expected."""
    if not isinstance(data, dict) or type(data.get(key)) is not kind:
        raise FalseClaim(f"{place}/{key}", f"missing, or not a {kind.__name__}")
    value: K = data[key]
    return value


def exact(text: object, place: str) -> arb:
    """Return an exact number, the text 'p' or 'p/q'."""
    fits = isinstance(text, str) and re.fullmatch(r"-?\d{1,700}(/[1-9]\d{0,699})?", text, re.ASCII)
    need(fits, place, f"not an exact number 'p/q': {str(text)[:40]}")
    return arb(fmpq(*map(int, str(text).split("/"))))


def exacts(data: object, count: int, place: str) -> list[arb]:
    """Return a list of `count` exact numbers."""
    if not isinstance(data, list) or len(data) != count:
        raise FalseClaim(place, f"not a list of {count} numbers")
    return [exact(text, f"{place}/{k}") for k, text in enumerate(data)]


@contextmanager
def exact_precision() -> Iterator[None]:
    """Compute with so many bits that sums and products of exact numbers are exact."""
    ctx.prec = EXACT_PRECISION
    try:
        yield
    finally:
        ctx.prec = PRECISION


def ball(radius: arb, like: Value = ZERO) -> arb | acb:
    """Return a ball around 0, of real or complex numbers as `like`."""
    disc = arb(0, arb(radius).upper())
    return acb(disc, disc) if isinstance(like, acb) else disc


def coefficient(x: Value, k: int) -> arb:
    """Return the coefficient of t^k of a power series, or of a number."""
    return x[k] if isinstance(x, arb_series) else ZERO if k else x


def polynomials(coefficients: Sequence[Sequence[arb]], t: arb) -> Iterator[arb]:
    """Yield the values at t, a number, a ball or a series, of polynomials (Horner's rule)."""
    for value, *lower in map(reversed, coefficients):
        for c in lower:
            value = value * t + c
        yield value


class RingElement:
    """What follows of sums and products: differences, and either order with other numbers."""

    __add__: Callable[..., Any]
    __mul__: Callable[..., Any]

    def __radd__(self, other: object) -> Any:
        return self + other

    def __rmul__(self, other: object) -> Any:
        return self * other

    def __neg__(self) -> Any:
        return self * -1

    def __sub__(self, other: Any) -> Any:
        return self + -other

    def __rsub__(self, other: object) -> Any:
        return -self + other


class Dual(RingElement):
    """A value v with its derivatives d by the unknowns it depends on, by their indices."""

    def __init__(self, v: arb, d: dict[int, arb]) -> None:
        self.v: arb = v
        self.d: dict[int, arb] = d

    def __add__(self, other: Value) -> Dual:
        if not isinstance(other, Dual):
            return Dual(self.v + other, self.d)
        return Dual(self.v + other.v, _sum(self.d, other.d))

    def __mul__(self, other: Value) -> Dual:
        if not isinstance(other, Dual):
            return self._scaled(self.v * other, other)
        one, two = self._scaled(0, other.v), other._scaled(0, self.v)
        return Dual(self.v * other.v, _sum(one.d, two.d))

    def __neg__(self) -> Dual:
        return Dual(-self.v, {k: -slope for k, slope in self.d.items()})

    def _scaled(self, v: arb, factor: arb) -> Dual:
        return Dual(v, {k: slope * factor for k, slope in self.d.items()})

    def cos(self) -> Dual:
        return self._scaled(self.v.cos(), -self.v.sin())

    def sin(self) -> Dual:
        return self._scaled(self.v.sin(), self.v.cos())

    def inverse(self) -> Dual:
        v = inverse(self.v)
        return self._scaled(v, -(v * v))

    def sqrt(self) -> Dual:
        v = root(self.v)
        return self._scaled(v, inverse(v) / 2)


def _sum(one: dict[int, arb], other: dict[int, arb]) -> dict[int, arb]:
    """Return the sum of two gradients."""
    return one | {k: one[k] + slope if k in one else slope for k, slope in other.items()}


def inverse(x: Value) -> Any:
    """Return 1 / x."""
    if isinstance(x, arb_series) and x[0].contains(0):
        raise ZeroDivisionError("a divisor may vanish")
    return x.inverse() if isinstance(x, Dual) else ONE / x


def root(x: Value) -> Any:
    """Return the square root of x."""
    if isinstance(x, arb_series) and not x[0] > 0:
        raise ZeroDivisionError("what a root is taken of may vanish")
    return x.sqrt()
