"""Radau IIA of order 5 with steps of its own length (Hairer and Wanner 1996, IV.8).

The three stages solve y_i = y + h sum a_ij f(t + c_j h, y_j) by Newton's method with one Jacobian
of f; the error is that of an embedded formula of order 3, filtered by (I - h gamma J)^-1. The
method is L-stable: what decays fast is damped within a step, whatever its length.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechdae.types import Floats, Matrix

S = 6.0**0.5
STAGES = np.array([(4 - S) / 10, (4 + S) / 10, 1.0])
WEIGHTS = np.array([(16 - S) / 36, (16 + S) / 36, 1 / 9])
MATRIX = np.array([
    [(88 - 7 * S) / 360, (296 - 169 * S) / 1800, (-2 + 3 * S) / 225],
    [(296 + 169 * S) / 1800, (88 + 7 * S) / 360, (-2 - 3 * S) / 225],
    WEIGHTS,
])  # fmt: skip
EMBEDDED = np.array([-13 - 7 * S, -13 + 7 * S, -1]) / 3
REAL = 3 + 3 ** (2 / 3) - 3 ** (1 / 3)
"""The real eigenvalue of the inverse of the matrix, 1 / gamma."""
DENSE = np.array([
    [13 / 3 + 7 * S / 3, -23 / 3 - 22 * S / 3, 10 / 3 + 5 * S],
    [13 / 3 - 7 * S / 3, -23 / 3 + 22 * S / 3, 10 / 3 - 5 * S],
    [1 / 3, -8 / 3, 10 / 3],
])  # fmt: skip
"""Coefficients of the polynomial through the stages, from which the next ones are guessed."""
NEWTON, SAFE, FEWEST, MOST = 7, 0.9, 0.2, 8.0
SETTLED = 1e-3
"""Share of the tolerance to which stages are solved."""
GRAIN = 1e-15
"""Share of the sizes at which corrections are rounding."""

Rates = Callable[[Any, Any], Any]


@dataclass
class RadauStep:
    """An accepted step: its end, the stages (3, n) with their times, what it took, the next one."""

    t: float
    y: Floats
    length: float
    times: Floats
    stages: Matrix
    rejected: int
    calls: int
    next_length: float


def steps(
    rates: Rates,
    slopes: Rates,
    t: float,
    y: Floats,
    end: float,
    tolerance: float,
    first: float,
    longest: float = np.inf,
    settled: Rates | None = None,
) -> Iterator[RadauStep]:
    """Yield accepted steps of y' = f(t, y) up to a time, y in natural sizes.

    Parameters
    ----------
    rates
        f for times (k,) and states (k, n).
    slopes
        Its Jacobian (n, n) at a time and a state (n,).
    tolerance
        Of the error of a step in each component.
    first, longest
        Lengths of steps.
    settled
        From a time and a state at the end of a step to the state that goes on, on constraints.

    Raises
    ------
    ArithmeticError
        The length of the step goes to nothing.
    """  # fmt: skip
    n, h, eye = len(y), first, np.eye(len(y))
    slope, rate = slopes(t, y), rates(np.array([t]), y[None])[0]
    fresh, rejected, calls = True, 0, 1
    polynomial: Any = None
    before: tuple[float, float] | None = None
    least = 1e-13 * max(abs(end), abs(end - t))
    while t < end:
        h = min(h, longest)
        last = t + h >= end - least
        h = end - t if last else h
        if h < least and not last:
            raise ArithmeticError("the step goes to nothing")
        Z = np.zeros((3, n)) if polynomial is None else polynomial(h)
        Z, done, count, ratio = _stages(rates, slope, t, y, h, Z, tolerance)
        calls += 3 * count
        if not done:
            rejected += 1
            if not fresh:
                slope, fresh = slopes(t, y), True
                continue
            h, polynomial = h / 2, None
            continue
        real = np.linalg.inv(REAL / h * eye - slope)
        weak = EMBEDDED @ Z / h
        error = real @ (rate + weak)
        size = _size(error, tolerance)
        if size > 1 and (rejected or before is None):
            error = real @ (rates(np.array([t]), (y + error)[None])[0] + weak)
            calls += 1
            size = _size(error, tolerance)
        safe = SAFE * (2 * NEWTON + 1) / (2 * NEWTON + count)
        if not size <= 1:
            grow = max(FEWEST, safe * size**-0.25) if np.isfinite(size) else FEWEST
            h, rejected = h * grow, rejected + 1
            continue
        grow = _growth(h, size, before) * safe
        before = (h, size)
        stages, times = y + Z, t + STAGES * h
        start, t, length = y, end if last else t + h, h
        y = y + Z[2] if settled is None else settled(t, y + Z[2])
        polynomial = _beyond(DENSE.T @ Z, start, y, h)
        rate = rates(np.array([t]), y[None])[0]
        calls += 1
        h = h * min(MOST, max(FEWEST, grow))
        yield RadauStep(t, y, length, times, stages, rejected, calls, h)
        rejected = calls = 0
        fresh = False
        if count > 2 and ratio > 1e-3:
            slope, fresh = slopes(t, y), True


def _stages(
    rates: Rates, slope: Floats, t: float, y: Floats, h: float, Z: Floats, tolerance: float
) -> tuple[Floats, bool, int, float]:
    """Return stages less y (3, n), whether they are solved, Newton steps, how fast these shrink."""
    n = len(y)
    inverse = np.linalg.inv(np.eye(3 * n) - h * np.kron(MATRIX, slope))
    before, ratio = np.inf, 0.0
    floor = GRAIN * float(np.abs(y).max(initial=1.0))
    for k in range(NEWTON):
        F = rates(t + STAGES * h, y + Z)
        if not np.isfinite(F).all():
            return Z, False, k + 1, ratio
        step = (inverse @ (h * MATRIX @ F - Z).ravel()).reshape(3, n)
        Z = Z + step
        size = float(np.sqrt(np.mean(step**2)))
        ratio = size / before if k else 0.0
        if size <= floor:
            return Z, True, k + 1, ratio
        if k and ratio >= 1:
            return Z, False, k + 1, ratio
        if k and ratio / (1 - ratio) * size <= SETTLED * tolerance:
            return Z, True, k + 1, ratio
        before = size
    return Z, False, NEWTON, ratio


def _size(error: Floats, tolerance: float) -> float:
    return float(np.sqrt(np.mean(error**2))) / tolerance


def _growth(h: float, size: float, before: tuple[float, float] | None) -> float:
    """Return by what the next step is longer, by the last two errors (Gustafsson)."""
    if size == 0:
        return MOST
    if before is None or before[1] == 0:
        return float(size**-0.25)
    return float(min(1.0, h / before[0] * (before[1] / size) ** 0.25) * size**-0.25)


def _beyond(Q: Floats, start: Floats, y: Floats, h: float) -> Callable[[float], Any]:
    """Return the stages less y of the next step as the polynomial of the last one has them."""

    def guess(length: float) -> Any:
        s = (1 + STAGES * length / h)[:, None]
        return start + s * (Q[0] + s * (Q[1] + s * Q[2])) - y

    return guess
