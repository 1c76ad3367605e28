"""Zeros between two places: of the sign of a function alone, of its value, of many at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mechdae.types import Booleans, Floats

HALVINGS = 60
STEPS = 80
ROUGH = 1e-11
"""Share of its unit below which a step that does not shrink is rounding."""
GRAIN = 2 * float(np.finfo(float).eps)


def refined(
    evaluate: Callable[[Any, Any], tuple[Any, Any]],
    a: Floats | list[float],
    b: Floats | list[float],
    rising: Booleans,
    unit: Floats | float,
    first: Floats | None = None,
) -> tuple[Floats, Floats]:
    """Return zeros (n,) of functions in their brackets by Newton's method held in them.

    `evaluate`: from which functions (k,) and places (k,) to values and slopes there, (k,) each.
    `rising` (n,): which functions rise through their zero. `unit`: what steps are compared with, a
    number or (n,). `first`: where to begin (n,), the middles if left out.

    Returns
    -------
    s, lost : (n,) arrays
        The zeros, nan where a function has no value; the places without one, nan elsewhere.
    """
    a, b = np.array(a, float), np.array(b, float)
    s = (a + b) / 2 if first is None else np.array(first, float)
    unit = np.broadcast_to(np.asarray(unit, float), s.shape)
    lost = np.full(len(s), np.nan)
    active, moved = np.arange(len(s)), np.full(len(s), np.inf)
    for _ in range(STEPS):
        if not active.size:
            break
        f, df = evaluate(active, s[active])
        gone = ~np.isfinite(f)
        lost[active[gone]] = s[active[gone]]
        s[active[gone]] = np.nan
        active, f, df = active[~gone], f[~gone], df[~gone]
        here = s[active]
        right = (f > 0) == rising[active]  # the zero lies before
        b[active] = np.where(right, here, b[active])
        a[active] = np.where(right, a[active], here)
        with np.errstate(invalid="ignore", divide="ignore"):
            new = here - f / df
        outside = ~((new >= a[active]) & (new <= b[active]))
        new = np.where(outside, (a[active] + b[active]) / 2, new)
        new = np.where(f == 0, here, new)
        s[active] = new
        before, moved[active] = moved[active], np.abs(new - here)
        step = moved[active]
        size = np.maximum(np.abs(new), unit[active])
        done = (step <= GRAIN * size) | ((step < ROUGH * size) & (step >= before)) | (f == 0)
        active = active[~done]
    return s, lost


def halved(
    before: Callable[[float], bool], low: float, high: float, close: float = 0.0
) -> tuple[float, float]:
    """Return the places between which a change lies, nearest to each other.

    `before`: whether a place is on the side of `low`, which may be the larger one. `close`:
    distance at which they are near enough.
    """
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        if abs(high - low) <= close or middle in (low, high):
            break
        low, high = (middle, high) if before(middle) else (low, middle)
    return low, high


def root_between(
    value: Callable[[float], float],
    low: float,
    high: float,
    at: tuple[float, float],
    grain: Callable[[float], float],
) -> float:
    """Return where a function vanishes, by the method of Chandrupatla (1997).

    Inverse quadratic interpolation where it is safe, else bisection.

    `at`: values at both ends, of different signs. `grain`: from a place to the distance from it
    that is rounding.
    """
    one, two, (f2, f1) = high, low, at
    three, f3 = one, 0.0
    share = f1 / (f1 - f2) if f1 != f2 else 0.5
    for _ in range(STEPS):
        near = grain(one) / abs(two - one)
        best = one if abs(f1) < abs(f2) else two
        if min(abs(f1), abs(f2)) == 0 or near > 0.5:
            break
        place = one + min(max(share, near), 1 - near) * (two - one)
        here = value(place)
        if (here < 0) == (f1 < 0):
            three, f3 = one, f1
        else:
            three, f3, two, f2 = two, f2, one, f1
        one, f1 = place, here
        share = _share(one, two, three, f1, f2, f3)
    return best


def _share(a: float, b: float, c: float, fa: float, fb: float, fc: float) -> float:
    """Return where between a and b the parabola through three values vanishes, else the middle."""
    if fb == fc or fa in (fc, fb):
        return 0.5
    place, height = (a - b) / (c - b), (fa - fb) / (fc - fb)
    if not (height**2 < place and (1 - height) ** 2 < 1 - place):
        return 0.5
    return fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
