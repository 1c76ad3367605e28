"""Units of named outputs, where they follow from those of the coordinates.

Parameters have no unit inside the program, so an expression that holds one has none here.
"""

from __future__ import annotations

import ast
from fractions import Fraction

from mechdae.describe.expression import CONSTANTS, dotted, parse
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.named import TIME, is_reaction, split_rate

Powers = tuple[Fraction, Fraction, Fraction]
"""Exponents of metre, radian and second."""
NUMBER, UNKNOWN = "number", "unknown"
SAME = ("abs", "min", "max", "hypot")
TURNED = ("asin", "acos", "atan", "atan2")


def unit_of(mechanism: Mechanism, output: str, rate: int = 0) -> str:
    """Return the unit of a named output's rate of some order: ``rad``, ``m/s``, ``1``.

    Empty where the unit is not known.
    """
    found = _powers(mechanism, parse(mechanism.outputs[output]))
    if isinstance(found, str):
        return ""
    metre, radian, second = found
    return _text({"m": metre, "rad": radian, "s": second - rate})


def _text(powers: dict[str, Fraction]) -> str:
    def word(name: str, power: Fraction) -> str:
        return name if power == 1 else f"{name}{power}"

    above = [word(name, power) for name, power in powers.items() if power > 0]
    below = [word(name, -power) for name, power in powers.items() if power < 0]
    return "/".join([" ".join(above) or "1", *below])


def _powers(mechanism: Mechanism, node: ast.AST) -> Powers | str:
    """Return the exponents of an expression, `NUMBER` for plain numbers, or `UNKNOWN`."""
    name = dotted(node)
    if name:
        return _of_name(mechanism, name)
    if isinstance(node, ast.Constant):
        return NUMBER
    if isinstance(node, ast.UnaryOp):
        return _powers(mechanism, node.operand)
    if isinstance(node, ast.BinOp):
        left, right = _powers(mechanism, node.left), _powers(mechanism, node.right)
        if isinstance(node.op, ast.Add | ast.Sub):
            return _same([left, right])
        if isinstance(node.op, ast.Pow):
            return _power(left, node.right)
        return _product(left, right, -1 if isinstance(node.op, ast.Div) else 1)
    assert isinstance(node, ast.Call)
    assert isinstance(node.func, ast.Name)
    inside = [_powers(mechanism, argument) for argument in node.args]
    if node.func.id in SAME:
        return _same(inside)
    if node.func.id == "sqrt":
        return _power(inside[0], ast.Constant(0.5))
    one = Fraction(1 if node.func.id in TURNED else 0)
    return (Fraction(0), one, Fraction(0))


def _of_name(mechanism: Mechanism, name: str) -> Powers | str:
    if name in CONSTANTS:
        return NUMBER
    if name == TIME:
        return (Fraction(0), Fraction(0), Fraction(1))
    if name in mechanism.parameters or is_reaction(mechanism, name):
        return UNKNOWN
    if name in mechanism.outputs:
        return _powers(mechanism, parse(mechanism.outputs[name]))
    base, order = split_rate(name)
    turns = base.endswith(".angle")
    return (Fraction(not turns), Fraction(turns), Fraction(-order))


def _same(parts: list[Powers | str]) -> Powers | str:
    """Return the one unit of a sum's terms; plain numbers take any."""
    units = [part for part in parts if part != NUMBER]
    if not units:
        return NUMBER
    return units[0] if all(unit == units[0] for unit in units) else UNKNOWN


def _product(left: Powers | str, right: Powers | str, sign: int) -> Powers | str:
    if left == NUMBER and right == NUMBER:
        return NUMBER
    if UNKNOWN in (left, right):
        return UNKNOWN
    nothing = (Fraction(0),) * 3
    a, b = (nothing if isinstance(side, str) else side for side in (left, right))
    return (a[0] + sign * b[0], a[1] + sign * b[1], a[2] + sign * b[2])


def _power(base: Powers | str, exponent: ast.AST) -> Powers | str:
    if isinstance(base, str):
        return base
    if not isinstance(exponent, ast.Constant):
        return UNKNOWN
    times = Fraction(exponent.value).limit_denominator(100)  # type: ignore[arg-type]
    return (base[0] * times, base[1] * times, base[2] * times)
