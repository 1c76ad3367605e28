"""Complex numbers as truncated Taylor series: rates of closed forms that are exact to rounding.

numpy only, nothing of the package. The real type follows the driver's values (float64 or
longdouble).
"""

from __future__ import annotations

from functools import wraps
from math import factorial

import numpy as np

# --------------------------------------------------------------------------------------
# Truncated Taylor series


class Jet:
    """A truncated Taylor series with arrays as coefficients.

    Parameters
    ----------
    coefficients : sequence of ndarray
        ``coefficients[k]`` belongs to the k-th power of the increment.
    """

    __array_ufunc__ = None  # numpy arrays leave mixed operations to this class

    def __init__(self, coefficients):
        self.c = list(coefficients)

    @classmethod
    def variable(cls, u, order):
        """Return the independent variable at ``u``: u + 1 * increment."""
        return cls([u] + [np.full_like(u, float(k == 0)) for k in range(order)])

    def _lift(self, other):
        if isinstance(other, Jet):
            return other
        zero = np.zeros_like(self.c[0])
        return Jet([zero + other] + [zero] * (len(self.c) - 1))

    def __add__(self, other):
        return Jet([a + b for a, b in zip(self.c, self._lift(other).c, strict=True)])

    def __neg__(self):
        return Jet([-a for a in self.c])

    def __sub__(self, other):
        return self + (-other)

    def __rsub__(self, other):
        return -self + other

    def __mul__(self, other):
        if not isinstance(other, Jet):
            return Jet([a * other for a in self.c])
        a, b = self.c, other.c
        return Jet([sum(a[j] * b[k - j] for j in range(k + 1)) for k in range(len(a))])

    __radd__ = __add__
    __rmul__ = __mul__

    def __truediv__(self, other):
        if not isinstance(other, Jet):
            return Jet([a / other for a in self.c])
        quotient = []
        for k, a in enumerate(self.c):
            rest = a - sum(quotient[j] * other.c[k - j] for j in range(k))
            quotient.append(rest / other.c[0])
        return Jet(quotient)

    def __rtruediv__(self, other):
        return self._lift(other) / self

    def map(self, function):
        """Apply a real-linear function (real, imag, conj) to every coefficient."""
        return Jet([function(a) for a in self.c])


def real(z):
    """Real part of an array or a jet."""
    return z.map(np.real) if isinstance(z, Jet) else np.real(z)


def imag(z):
    """Imaginary part of an array or a jet."""
    return z.map(np.imag) if isinstance(z, Jet) else np.imag(z)


def conj(z):
    """Complex conjugate of an array or a jet."""
    return z.map(np.conj) if isinstance(z, Jet) else np.conj(z)


def unit(angle):
    """Unit vector exp(i angle)."""
    if not isinstance(angle, Jet):
        return np.cos(angle) + 1j * np.sin(angle)
    result = [np.cos(angle.c[0]) + 1j * np.sin(angle.c[0])]
    for k in range(1, len(angle.c)):
        terms = (j * angle.c[j] * result[k - j] for j in range(1, k + 1))
        result.append(1j * sum(terms) / k)
    return Jet(result)


def sqrt(x):
    """Real square root; nan for negative values, without a warning."""
    with np.errstate(invalid="ignore", divide="ignore"):
        if not isinstance(x, Jet):
            return np.sqrt(x)
        result = [np.sqrt(x.c[0])]
        for k in range(1, len(x.c)):
            rest = x.c[k] - sum(result[j] * result[k - j] for j in range(1, k))
            result.append(rest / (2 * result[0]))
    return Jet(result)


def arg(z, near=0.0):
    """Angle of ``z``: the representative within half a turn of the number ``near``."""
    first = z.c[0] if isinstance(z, Jet) else z
    turned = first * np.exp(-1j * first.real.dtype.type(near))
    value = np.arctan2(turned.imag, turned.real) + near
    if not isinstance(z, Jet):
        return value
    result, order = [value], len(z.c) - 1
    if order:  # angle' = Im(z' / z)
        slope = Jet([(k + 1) * z.c[k + 1] for k in range(order)]) / Jet(z.c[:order])
        result += [np.imag(s) / (k + 1) for k, s in enumerate(slope.c)]
    return Jet(result)


def length(z):
    """Length of a complex vector."""
    return sqrt(real(z * conj(z)))


def quietly(function):
    """Let nan, the mark of a pose that does not assemble, pass without warnings."""

    @wraps(function)
    def quiet(*args, **kwargs):
        with np.errstate(invalid="ignore", divide="ignore"):
            return function(*args, **kwargs)

    return quiet


def driver_of(u):
    """Return ``u`` as a jet or a floating array."""
    if isinstance(u, Jet):
        return u
    u = np.asarray(u)
    return u if u.dtype == np.longdouble else u.astype(np.float64)


# --------------------------------------------------------------------------------------
# Rates


def derivatives(function, u, order=2, **dimensions):
    """Return the results of a mechanism and their derivatives by the driver.

    Parameters
    ----------
    function : callable
        One of the mechanisms of `closed_forms`.
    u : array_like
        Driver values.
    order : int
        Highest derivative.
    **dimensions
        Passed on.

    Returns
    -------
    list of dict
        ``result[k][name]`` is the k-th derivative, exact to rounding.
    """
    u = driver_of(u)
    jets = function(Jet.variable(u, order), **dimensions)
    return [{name: jet.c[k] * factorial(k) for name, jet in jets.items()} for k in range(order + 1)]


def motion(function, u, speed, acceleration=0.0, **dimensions):
    """Return positions, velocities and accelerations in time.

    Parameters
    ----------
    function, u, **dimensions
        As for `derivatives`.
    speed, acceleration : float or array
        First and second time derivative of the driver.

    Returns
    -------
    tuple of dict
        Positions, velocities, accelerations.
    """
    value, first, second = derivatives(function, u, 2, **dimensions)
    velocity = {name: first[name] * speed for name in value}
    rate = {name: second[name] * speed**2 + first[name] * acceleration for name in value}
    return value, velocity, rate
