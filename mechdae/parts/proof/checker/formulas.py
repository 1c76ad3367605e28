"""Formulas of a file: "s", an exact number, or an operation and its formulas."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from flint import arb

from .arithmetic import ONE, ZERO, Value, exact, inverse, need, root

OPERATIONS: dict[str, tuple[int, Callable[..., Any]]] = {
    "+": (2, lambda a, b: a + b),
    "*": (2, lambda a, b: a * b),
    "/": (2, lambda a, b: a * inverse(b)),
    "sin": (1, lambda a: a.sin()),
    "cos": (1, lambda a: a.cos()),
    "sqrt": (1, root),
}


def evaluate(formula: object, s: Value, place: str) -> Any:
    """Return the value of a formula at s; numbers in it may be read already."""
    if not isinstance(formula, list):
        return s if isinstance(formula, str) and formula == "s" else number_of(formula, place)
    count, operation = OPERATIONS[formula[0]]
    need(len(formula) == count + 1, place, f"no formula: {str(formula)[:60]}")
    return operation(*(evaluate(part, s, place) for part in formula[1:]))


def number_of(data: object, place: str) -> arb:
    """Return an exact number, which may be read already."""
    return data if isinstance(data, arb) else exact(data, place)


def parsed(data: object, place: str) -> object:
    """Return a formula with its numbers read."""
    if isinstance(data, list) and data[:1] and data[0] in OPERATIONS:
        return [data[0], *(parsed(part, place) for part in data[1:])]
    return data if data == "s" else exact(data, place)


def slope(f: object) -> object:
    """Return the derivative by s of a formula that is parsed."""
    if not isinstance(f, list):
        return ONE if isinstance(f, str) else ZERO
    (name, a, *b), d = f, [slope(part) for part in f[1:]]
    if name == "+":
        return _joined("+", *d)
    if name == "*":
        return _joined("+", _joined("*", d[0], b[0]), _joined("*", a, d[1]))
    if name == "/":  # (a' - f b') / b
        above = _joined("+", d[0], _joined("*", -ONE, _joined("*", f, d[1])))
        return _joined("*", above, ["/", ONE, b[0]])
    factor = {"sin": ["cos", a], "cos": ["*", -ONE, ["sin", a]], "sqrt": ["/", ONE / 2, f]}[name]
    return _joined("*", factor, d[0])


def _joined(sign: str, a: object, b: object) -> object:
    """Return the formula of a sum or product; those with 0 and 1 need none."""
    for one, other in ((a, b), (b, a)):
        if isinstance(one, arb) and one == 0:
            return ZERO if sign == "*" else other
    for one, other in ((a, b), (b, a)):
        if isinstance(one, arb) and one == 1 and sign == "*":
            return other
    return [sign, a, b]


def repeats(f: object) -> bool:
    """Whether a formula has the period 2 pi: s stands in whole multiples in sines and cosines."""
    if not isinstance(f, list):
        return bool(f != "s")
    if f[0] not in ("sin", "cos"):
        return all(map(repeats, f[1:]))
    rate = slope(f[1])
    return not _has_parameter(rate) and bool(evaluate(rate, ZERO, "a curve").is_integer())


def _has_parameter(f: object) -> bool:
    return any(map(_has_parameter, f[1:])) if isinstance(f, list) else isinstance(f, str)


def at_corners(values: list[object], s: Value, at: arb, place: str) -> Value:
    """Return a driver's value at s near `at`, of values at s = 0, 1, ..., straight on between."""
    k = min(max(int(float(at.lower()) + 1e-9), 0), len(values) - 2)
    if not at < k + 1 + 1e-9:
        raise ArithmeticError("a step leads past a corner")
    one, other = (number_of(values[i], place) for i in (k, k + 1))
    return (s - k) * (other - one) + one
