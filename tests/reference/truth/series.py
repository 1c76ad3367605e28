"""Truncated power series in time with complex coefficients, arrays over poses."""

from __future__ import annotations

import numpy as np

LD, CLD = np.longdouble, np.clongdouble
PI = 4 * np.arctan(LD(1))


class Series:
    """Value and derivatives / k! of a function of time: c is (order + 1, poses)."""

    __array_ufunc__ = None  # NumPy scalars on the left leave the operation to us

    def __init__(self, c):
        self.c = c

    def __add__(self, o):
        if isinstance(o, Series):
            return Series(self.c + o.c)
        c = self.c.copy()
        c[0] += o
        return Series(c)

    __radd__ = __add__

    def __neg__(self):
        return Series(-self.c)

    def __sub__(self, o):
        return self + (-o)

    def __rsub__(self, o):
        return -self + o

    def __mul__(self, o):
        if not isinstance(o, Series):
            return Series(self.c * o)
        out = self.c[0] * o.c
        for i in range(1, len(out)):
            out[i:] += self.c[i] * o.c[: len(out) - i]
        return Series(out)

    __rmul__ = __mul__

    def __truediv__(self, o):
        if not isinstance(o, Series):
            return Series(self.c / o)
        out = np.empty_like(self.c)
        for i in range(len(out)):
            rest = self.c[i].copy()
            for j in range(i):
                rest -= out[j] * o.c[i - j]
            out[i] = rest / o.c[0]
        return Series(out)

    def __rtruediv__(self, o):
        return constant(o, self) / self

    def conjugate(self):
        return Series(np.conj(self.c))

    @property
    def real(self):
        return Series(self.c.real + 0j)

    @property
    def imag(self):
        return Series(self.c.imag + 0j)

    def square(self):
        """|self|^2."""
        return (self * self.conjugate()).real

    def sqrt(self):
        """Real square root; nan where the value is negative."""
        out = np.empty_like(self.c)
        out[0] = np.sqrt(self.c[0].real)
        for i in range(1, len(out)):
            rest = self.c[i].copy()
            for j in range(1, i):
                rest -= out[j] * out[i - j]
            out[i] = rest / (2 * out[0])
        return Series(out)

    def unit(self):
        """exp(i self)."""
        out = np.zeros_like(self.c)
        out[0] = np.exp(1j * self.c[0])
        for i in range(1, len(out)):
            for j in range(1, i + 1):
                out[i] += 1j * j * self.c[j] * out[i - j] / i
        return Series(out)

    def argument(self, lift=None):
        """Argument as a series; `lift` adds whole turns to its value."""
        out = np.empty_like(self.c)
        value = np.angle(self.c[0])
        out[0] = lift(value) if lift else value
        logarithm = [None]
        for i in range(1, len(out)):
            rest = i * self.c[i]
            for j in range(1, i):
                rest = rest - j * logarithm[j] * self.c[i - j]
            logarithm.append(rest / self.c[0] / i)
            out[i] = logarithm[i].imag
        return Series(out)

    @property
    def derivatives(self):
        """Value, first and second derivative (0 above the order)."""
        c = self.c
        return c[0], c[1] if len(c) > 1 else 0 * c[0], 2 * c[2] if len(c) > 2 else 0 * c[0]


def constant(value, like):
    """Return a constant as a series like another one."""
    out = np.zeros_like(like.c)
    out[0] = value
    return Series(out)
