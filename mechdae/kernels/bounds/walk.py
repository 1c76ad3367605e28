"""A casadi SX function evaluated with other arithmetic than its own, and upper bounds by it.

The instruction list is walked once; what an operation means is up to the caller: symbols
with replaced parts, upper bounds, 80-bit floats.

Upper bounds (`majorant`) hold for all poses at once: sin and cos of anything that moves become 1,
minus becomes plus, constants and parameters their absolute value. The result bounds the
expression for every value of its angles. Beside it runs a rounding-error bound in units
of the unit roundoff (running error analysis, Higham, Accuracy and Stability of Numerical
Algorithms, 2002, 3.3).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial, reduce
from typing import Any
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np

from mechdae.types import Floats, Graph, Sym

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
SYMBOLIC: dict[int, Callable[..., Sym]] = {
    **FORMULAS,
    **{code: getattr(ca, names[0]) for code, names in NAMES.items()},
    **{code: pair[0] for code, pair in LOGIC.items()},
}
ARRAYS: dict[int, Callable[..., Floats]] = {
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
    for code, into, out_of, number in instructions(function):
        if code == ca.OP_INPUT:
            work[into[0]] = inputs[out_of[0]][out_of[1]]
        elif code == ca.OP_CONST:
            work[into[0]] = constant(number)
        elif code == ca.OP_OUTPUT:
            results[into[0]][into[1]] = work[out_of[0]]
        else:
            work[into[0]] = operation(code, [work[i] for i in out_of])
    return results


def instructions(function: Graph) -> list[tuple[int, list[int], list[int], float]]:
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


SX = ca.SX
ZERO, ONE = SX(0), SX(1)
_plus, _times, _over = (partial(symbolic, code) for code in (ca.OP_ADD, ca.OP_MUL, ca.OP_DIV))
_size = partial(symbolic, ca.OP_FABS)
_twice = partial(symbolic, ca.OP_TWICE)


class NoMajorant(Exception):
    """The expression holds an operation without a bound (curve joints, tables)."""


def majorant(
    expressions: Sym,
    moving: Sequence[Sym],
    bounds: Sequence[Sym],
    noise: Mapping[int, Any] | None = None,
) -> tuple[Sym, Sym]:
    """Return bounds of the absolute values and of the rounding errors of `expressions`.

    Parameters
    ----------
    expressions : SX (k,)
    moving, bounds : lists of SX vectors
        Symbols that change with the pose, and the bounds to use for their absolute values;
        all other symbols are parameters, the same along a sweep.
    noise
        Errors of parameters, by the hash of their symbols; 0 of others. Without it no errors are
        wanted: they are zero, and half the work is left out.

    Returns
    -------
    magnitude, error : SX (k,)
        Expressions over `bounds` and parameters; `error` in units of the roundoff.

    Raises
    ------
    NoMajorant
    """
    stacked = ca.vec(ca.densify(expressions))
    known = {symbol.element_hash() for group in moving for symbol in group.elements()}
    parameters = [s for s in ca.symvar(stacked) if s.element_hash() not in known]
    function = ca.Function("f", [*moving, ca.veccat(*parameters)], [stacked])
    inputs = [[(m, ZERO, None) for m in ca.vec(bound).elements()] for bound in bounds]
    noisy = noise or {}
    inputs.append([(_size(p), noisy.get(p.element_hash(), ZERO), p) for p in parameters])
    step = _bounded if noise is None else _bounded_with_rounding
    (found,) = replay(function, inputs, step, _bound_of_number)
    if not found:
        return SX(0, 1), SX(0, 1)
    return ca.vertcat(*[f[0] for f in found]), ca.vertcat(*[f[1] for f in found])


def _bound_of_number(number: float) -> tuple[Sym, Sym, Sym]:
    value = SX(number)
    return _size(value), ZERO, value


def _sum(*terms: Sym) -> Sym:
    return reduce(_plus, terms)


def _bounded(code: int, inputs: list[tuple[Sym, Sym, Sym | None]]) -> tuple[Sym, Sym, Sym]:
    """Return magnitude, no error and (for parameters only) value of one operation."""
    if all(value is not None for _, _, value in inputs):
        if code not in SYMBOLIC:
            raise NoMajorant
        value = symbolic(code, *[value for _, _, value in inputs])
        return _size(value), ZERO, value
    a = inputs[0][0]
    if code in (ca.OP_ADD, ca.OP_SUB):
        return _plus(a, inputs[1][0]), ZERO, None
    if code == ca.OP_MUL:
        return _times(a, inputs[1][0]), ZERO, None
    if code == ca.OP_SQ:
        return _times(a, a), ZERO, None
    if code == ca.OP_TWICE:
        return _twice(a), ZERO, None
    if code == ca.OP_NEG:
        return a, ZERO, None
    if code in (ca.OP_SIN, ca.OP_COS):
        return ONE, ZERO, None
    if code == ca.OP_DIV and inputs[1][2] is not None:
        return _over(a, inputs[1][0]), ZERO, None
    raise NoMajorant


def _bounded_with_rounding(
    code: int, inputs: list[tuple[Sym, Sym, Sym | None]]
) -> tuple[Sym, Sym, Sym]:
    """Return magnitude, error and (for parameters only) value of one operation."""
    size, _, value = _bounded(code, inputs)
    a, ea, _ = inputs[0]
    b, eb, _ = inputs[1] if len(inputs) > 1 else (ZERO, ZERO, None)
    if value is not None:
        return size, number_rounding(code, value, [(v, e) for _, e, v in inputs]), value
    if code in (ca.OP_ADD, ca.OP_SUB):
        return size, _sum(ea, eb, a, b), None
    if code == ca.OP_MUL:
        return size, _sum(_times(ea, b), _times(eb, a), size), None
    if code == ca.OP_SQ:
        return size, _plus(_times(_twice(ea), a), size), None
    if code == ca.OP_TWICE:
        return size, _twice(ea), None
    if code == ca.OP_NEG:
        return size, ea, None
    if code in (ca.OP_SIN, ca.OP_COS):
        return size, _plus(ea, ONE), None
    return size, _plus(_over(_plus(ea, _over(_times(a, eb), b)), b), size), None
