"""Zeros of one function between two places: of its sign alone, and of its value."""

from __future__ import annotations

from collections.abc import Callable

HALVINGS = 60
STEPS = 80


def halved(
    before: Callable[[float], bool], low: float, high: float, close: float = 0.0
) -> tuple[float, float]:
    """Return the places between which a change lies, nearest to each other.

    Parameters
    ----------
    before
        Whether a place is on the side of `low`, which may be the larger one.
    close
        Distance at which they are near enough.
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

    Parameters
    ----------
    at
        Values at both ends, of different signs.
    grain
        From a place to the distance from it that is rounding.
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
