"""A casadi SX function evaluated with other arithmetic than its own.

The instruction list is walked once; what an operation means is up to the caller: symbols
with replaced parts, upper bounds, 80-bit floats.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np

from mechdae.types import Graph, Sym

FORMULAS: dict[int, Callable[..., Any]] = {
    ca.OP_ASSIGN: lambda a: a,
    ca.OP_ADD: lambda a, b: a + b,
    ca.OP_SUB: lambda a, b: a - b,
    ca.OP_MUL: lambda a, b: a * b,
    ca.OP_DIV: lambda a, b: a / b,
    ca.OP_NEG: lambda a: -a,
    ca.OP_SQ: lambda a: a * a,
    ca.OP_TWICE: lambda a: 2 * a,
    ca.OP_INV: lambda a: 1 / a,
    ca.OP_POW: lambda a, b: a**b,
    ca.OP_CONSTPOW: lambda a, b: a**b,
}
"""Operations that mean the same for symbols and for arrays."""
NAMES: dict[int, tuple[str, str]] = {
    ca.OP_SIN: ("sin", "sin"),
    ca.OP_COS: ("cos", "cos"),
    ca.OP_TAN: ("tan", "tan"),
    ca.OP_SQRT: ("sqrt", "sqrt"),
    ca.OP_EXP: ("exp", "exp"),
    ca.OP_LOG: ("log", "log"),
    ca.OP_ASIN: ("asin", "arcsin"),
    ca.OP_ACOS: ("acos", "arccos"),
    ca.OP_ATAN: ("atan", "arctan"),
    ca.OP_ATAN2: ("atan2", "arctan2"),
    ca.OP_SINH: ("sinh", "sinh"),
    ca.OP_COSH: ("cosh", "cosh"),
    ca.OP_TANH: ("tanh", "tanh"),
    ca.OP_FABS: ("fabs", "abs"),
    ca.OP_SIGN: ("sign", "sign"),
    ca.OP_FMIN: ("fmin", "minimum"),
    ca.OP_FMAX: ("fmax", "maximum"),
}
"""The names of the other operations in casadi and in NumPy."""
ULPS = 4
"""Rounding of one operation on exact numbers, functions included, in units of the roundoff."""
ROUNDOFF = 2.0**-53
TINY = 1e-300
KEPT = (ca.OP_NEG, ca.OP_TWICE)
"""Operations that are exact."""
LOGIC: dict[int, tuple[Callable[..., Any], Callable[..., Any]]] = {
    ca.OP_LT: (lambda a, b: a < b, lambda a, b: np.less(a, b) * 1.0),
    ca.OP_LE: (lambda a, b: a <= b, lambda a, b: np.less_equal(a, b) * 1.0),
    ca.OP_EQ: (lambda a, b: a == b, lambda a, b: np.equal(a, b) * 1.0),
    ca.OP_NE: (lambda a, b: a != b, lambda a, b: np.not_equal(a, b) * 1.0),
    ca.OP_NOT: (ca.logic_not, lambda a: np.equal(a, 0) * 1.0),
    ca.OP_IF_ELSE_ZERO: (
        lambda a, b: ca.if_else(a, b, 0),
        lambda a, b: np.where(np.not_equal(a, 0), b, 0.0),
    ),
    ca.OP_REMAINDER: (ca.remainder, lambda a, b: a - b * np.rint(a / b)),
}
"""Pieces, from derivatives of min and max and from curves of one turn: casadi, arrays."""
SYMBOLIC = {
    **FORMULAS,
    **{code: getattr(ca, names[0]) for code, names in NAMES.items()},
    **{code: pair[0] for code, pair in LOGIC.items()},
}
ARRAYS = {
    **FORMULAS,
    **{code: getattr(np, names[1]) for code, names in NAMES.items()},
    **{code: pair[1] for code, pair in LOGIC.items()},
}


_LISTS: WeakKeyDictionary[Any, list[tuple[int, list[int], list[int], float]]] = WeakKeyDictionary()
"""Instructions of functions that are still in use."""


def symbolic(code: int, *values: Sym) -> Sym:
    """Return the SX scalar of one operation; faster than operators and functions of SX."""
    return ca.SX.binary(code, *values) if len(values) == 2 else ca.SX.unary(code, *values)


def replay(
    function: Graph,
    inputs: Sequence[Sequence[Any]],
    operation: Callable[[int, list[Any]], Any],
    constant: Callable[[float], Any],
) -> list[list[Any]]:
    """Return the dense outputs, as lists of scalars, for inputs given as lists of scalars.

    Parameters
    ----------
    function
        SX function with dense inputs and outputs.
    operation
        Gets an operation code and the values of its arguments.
    constant
        Makes a value of a number.
    """
    work: dict[int, Any] = {}
    results: list[list[Any]] = [[None] * function.numel_out(i) for i in range(function.n_out())]
    for code, into, out_of, number in _instructions(function):
        if code == ca.OP_INPUT:
            work[into[0]] = inputs[out_of[0]][out_of[1]]
        elif code == ca.OP_CONST:
            work[into[0]] = constant(number)
        elif code == ca.OP_OUTPUT:
            results[into[0]][into[1]] = work[out_of[0]]
        else:
            work[into[0]] = operation(code, [work[i] for i in out_of])
    return results


def _instructions(function: Graph) -> list[tuple[int, list[int], list[int], float]]:
    """Return code, places written, places read and number of each instruction; asked for once."""
    known = _LISTS.get(function)
    if known is None:
        known = [
            (
                code,
                function.instruction_output(k),
                function.instruction_input(k),
                function.instruction_constant(k) if code == ca.OP_CONST else 0.0,
            )
            for k in range(function.n_instructions())
            for code in [function.instruction_id(k)]
        ]
        _LISTS[function] = known
    return known


def with_trig(expressions: list[Sym], angles: Sym, sines: Sym, cosines: Sym) -> list[Sym]:
    """Return the dense expressions with sin and cos of the given symbols replaced.

    Parameters
    ----------
    expressions : list of SX
    angles, sines, cosines : SX (n,)
    """
    known = {symbol.element_hash() for symbol in angles.elements()}
    others = [s for s in ca.symvar(ca.veccat(*expressions)) if s.element_hash() not in known]
    rest = ca.vertcat(*others) if others else ca.SX(0, 1)
    dense = [ca.densify(expression) for expression in expressions]
    function = ca.Function("f", [angles, rest], dense)
    symbols = angles.elements()
    place = {id(symbol): i for i, symbol in enumerate(symbols)}
    table = {ca.OP_SIN: sines.elements(), ca.OP_COS: cosines.elements()}

    def operation(code: int, values: list[Sym]) -> Sym:
        if code in table and id(values[0]) in place:
            return table[code][place[id(values[0])]]
        return symbolic(code, *values)

    results = replay(function, [symbols, rest.elements()], operation, ca.SX)
    return [
        ca.reshape(ca.vertcat(*values), *expression.shape) if values else expression
        for values, expression in zip(results, dense, strict=True)
    ]


def number_rounding(code: int, result: Sym, inputs: Sequence[tuple[Sym, Sym]]) -> Sym:
    """Return the error of an operation on numbers, in units of the roundoff, to first order.

    Parameters
    ----------
    code
        The operation, of casadi.
    result
        Its value as an expression.
    inputs
        Value and error of each operand.
    """
    (a, ea), (b, eb) = inputs[0], inputs[-1]
    size = ca.fabs(result)
    if code in KEPT:
        return 2 * ea if code == ca.OP_TWICE else ea
    if all(error.is_zero() for _, error in inputs):
        return ULPS * size
    if code in (ca.OP_ADD, ca.OP_SUB):
        return ea + eb + size
    if code == ca.OP_MUL:
        return ca.fabs(a) * eb + ca.fabs(b) * ea + size
    if code == ca.OP_SQ:
        return 2 * ca.fabs(a) * ea + size
    if code == ca.OP_DIV:
        return (ea + size * eb) / ca.fabs(b) + size
    if code in (ca.OP_SIN, ca.OP_COS, ca.OP_FABS):
        return ea + ULPS * size
    if code in (ca.OP_FMIN, ca.OP_FMAX):
        return ea + eb
    if code == ca.OP_SQRT:  # sqrt(a + e) - sqrt(a) is less than e / sqrt(a), and than sqrt(e)
        return ca.fmin(ea / ca.fmax(result, TINY), ca.sqrt(ea / ROUNDOFF)) + ULPS * size
    symbols = [ca.SX.sym(f"n{k}") for k in range(len(inputs))]
    slope = ca.gradient(symbolic(code, *symbols), ca.vertcat(*symbols))
    slope = ca.substitute(slope, ca.vertcat(*symbols), ca.vertcat(*[v for v, _ in inputs]))
    moved = ca.fabs(slope).T @ ca.vertcat(*[error for _, error in inputs])
    return moved + ULPS * size
