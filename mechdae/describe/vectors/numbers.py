"""Sums, products and components of numbers that may be expressions."""

from __future__ import annotations

import math

from mechdae.describe.expression import evaluate, names_in
from mechdae.describe.values import NAME, Number

RIGHT_ANGLE = math.pi / 2
CLOSE = 4e-16
"""How near to a multiple of a right angle, by itself, an angle is one: `90` in degrees."""


def plain(number: Number) -> Number:
    """Return the value of an expression without names, anything else as it is."""
    if isinstance(number, str) and not names_in(number):
        return evaluate(number, {})
    return number


def _inside(number: Number) -> str:
    """Return a number as a factor."""
    if isinstance(number, str):
        return number if NAME.match(number) else f"({number})"
    return f"({number!r})" if number < 0 else repr(number)


def add(first: Number, second: Number) -> Number:
    """Return the sum; zeros leave no trace."""
    if isinstance(first, float) and isinstance(second, float):
        return first + second
    if second == 0:
        return first
    if first == 0:
        return second
    if isinstance(second, str) and second.startswith("-") and NAME.match(second[1:]):
        return f"{_term(first)} - {second[1:]}"
    return f"{_term(first)} + {_inside(second)}"


def _term(number: Number) -> str:
    return number if isinstance(number, str) else repr(number)


def negative(number: Number) -> Number:
    if isinstance(number, float):
        return -number if number else 0.0
    return f"-{_inside(number)}"


def less(first: Number, second: Number) -> Number:
    """Return the difference; equal expressions leave zero."""
    return 0.0 if first == second else add(first, negative(second))


def times(first: Number, second: Number) -> Number:
    """Return the product; zero and one leave no trace."""
    if isinstance(first, float) and isinstance(second, float):
        return first * second
    for one, other in ((first, second), (second, first)):
        if one == 0:
            return 0.0
        if one == 1:
            return other
        if one == -1:
            return negative(other)
    return f"{_inside(first)}*{_inside(second)}"


def components(length: Number, angle: Number) -> tuple[Number, Number]:
    """Return x and y of a vector; multiples of a right angle are exact."""
    angle = plain(angle)
    if isinstance(angle, str):
        return times(length, f"cos({angle})"), times(length, f"sin({angle})")
    turns = round(angle / RIGHT_ANGLE)
    if abs(angle - turns * RIGHT_ANGLE) <= CLOSE * abs(turns):
        cos, sin = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[turns % 4]
    else:
        cos, sin = math.cos(angle), math.sin(angle)
    return times(plain(length), cos), times(plain(length), sin)
