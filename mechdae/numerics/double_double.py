"""Complex numbers of twice the digits, as unevaluated sums of doubles (Dekker 1971; Knuth).

For residuals at solutions whose equations cancel: sums, differences and products, errors of a few
`UNIT` squared by the sizes of what is added or multiplied.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.types import Complexes, Floats

UNIT = 2.0**-53
_SPLIT = 2.0**27 + 1

Pair = tuple[Any, Any]
"""A real number: the nearest double, and what is left."""


def _sum(a: Floats, b: Floats) -> Pair:
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


def _product(a: Floats, b: Floats) -> Pair:
    p = a * b
    c, d = _SPLIT * a, _SPLIT * b
    ah, bh = c - (c - a), d - (d - b)
    al, bl = a - ah, b - bh
    return p, ((ah * bh - p) + ah * bl + al * bh) + al * bl


def _added(a: Pair, b: Pair) -> Pair:
    s, e = _sum(a[0], b[0])
    e = e + (a[1] + b[1])
    t = s + e
    return t, e - (t - s)


def _times(a: Pair, b: Pair) -> Pair:
    p, e = _product(a[0], b[0])
    e = e + (a[0] * b[1] + a[1] * b[0])
    t = p + e
    return t, e - (t - p)


def _minus(a: Pair) -> Pair:
    return -a[0], -a[1]


class WideComplex:
    """Complex numbers with real and imaginary parts of twice the digits."""

    __slots__ = ("im", "re")

    def __init__(self, re: Pair, im: Pair) -> None:
        self.re, self.im = re, im

    @classmethod
    def of(cls, values: Complexes) -> WideComplex:
        """Return doubles, which are taken for exact."""
        values = np.asarray(values, complex)
        zero = np.zeros(values.shape)
        return cls((values.real.copy(), zero), (values.imag.copy(), zero))

    def __add__(self, other: WideComplex) -> WideComplex:
        return WideComplex(_added(self.re, other.re), _added(self.im, other.im))

    def __neg__(self) -> WideComplex:
        return WideComplex(_minus(self.re), _minus(self.im))

    def __sub__(self, other: WideComplex) -> WideComplex:
        return self + (-other)

    def __mul__(self, other: WideComplex) -> WideComplex:
        re = _added(_times(self.re, other.re), _minus(_times(self.im, other.im)))
        return WideComplex(re, _added(_times(self.re, other.im), _times(self.im, other.re)))

    def rounded(self) -> Any:
        """Return the nearest doubles."""
        return self.re[0] + 1j * self.im[0]
