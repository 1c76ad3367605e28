"""Upper bounds of expressions for all poses at once, and of their rounding errors.

An expression graph is walked once: sin and cos of anything that moves become 1, minus
becomes plus, constants and parameters their absolute value. The result bounds the
expression for every value of its angles. Beside it runs a rounding-error bound in units
of the unit roundoff (running error analysis, Higham, Accuracy and Stability of Numerical
Algorithms, 2002, 3.3).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca

SX = ca.SX


class NoMajorant(Exception):
    """The expression holds an operation without a bound (curve joints, tables)."""


def majorant(
    expressions: Any, moving: Sequence[Any], bounds: Sequence[Any], parameters: Any
) -> tuple[Any, Any]:
    """Return bounds of the absolute values and of the rounding errors of `expressions`.

    Parameters
    ----------
    expressions : SX (k,)
    moving, bounds : lists of SX vectors
        Symbols that change with the pose, and the bounds to use for their absolute values.
    parameters : SX (np,)
        Symbols that do not change along a sweep.

    Returns
    -------
    magnitude, error : SX (k,)
        Expressions over `bounds` and `parameters`; `error` in units of the roundoff.

    Raises
    ------
    NoMajorant
    """
    function = ca.Function("f", [*moving, parameters], [ca.vec(ca.densify(expressions))])
    limits = [ca.vec(bound).elements() for bound in bounds]
    fixed = parameters.elements()
    work: dict[int, tuple[Any, Any, Any]] = {}  # register -> (magnitude, error, value or None)
    size = expressions.numel()
    magnitude, error = [SX(0)] * size, [SX(0)] * size
    for k in range(function.n_instructions()):
        code = function.instruction_id(k)
        into = function.instruction_output(k)
        out_of = function.instruction_input(k)
        if code == ca.OP_INPUT:
            source, entry = out_of
            if source < len(limits):
                work[into[0]] = (limits[source][entry], SX(0), None)
            else:
                value = fixed[entry]
                work[into[0]] = (ca.fabs(value), SX(0), value)
        elif code == ca.OP_CONST:
            constant = SX(function.instruction_constant(k))
            work[into[0]] = (ca.fabs(constant), SX(0), constant)
        elif code == ca.OP_OUTPUT:
            _, entry = into
            magnitude[entry], error[entry], _ = work[out_of[0]]
        else:
            work[into[0]] = _step(code, [work[i] for i in out_of])
    return ca.vertcat(*magnitude), ca.vertcat(*error)


_FIXED: dict[int, Callable[..., Any]] = {
    ca.OP_ADD: lambda a, b: a + b,
    ca.OP_SUB: lambda a, b: a - b,
    ca.OP_MUL: lambda a, b: a * b,
    ca.OP_DIV: lambda a, b: a / b,
    ca.OP_NEG: lambda a: -a,
    ca.OP_SIN: ca.sin,
    ca.OP_COS: ca.cos,
    ca.OP_TAN: ca.tan,
    ca.OP_SQ: lambda a: a * a,
    ca.OP_SQRT: ca.sqrt,
    ca.OP_TWICE: lambda a: 2 * a,
    ca.OP_INV: lambda a: 1 / a,
    ca.OP_POW: lambda a, b: a**b,
    ca.OP_CONSTPOW: lambda a, b: a**b,
    ca.OP_EXP: ca.exp,
    ca.OP_LOG: ca.log,
    ca.OP_ASIN: ca.asin,
    ca.OP_ACOS: ca.acos,
    ca.OP_ATAN: ca.atan,
    ca.OP_ATAN2: ca.atan2,
    ca.OP_SINH: ca.sinh,
    ca.OP_COSH: ca.cosh,
    ca.OP_TANH: ca.tanh,
    ca.OP_FABS: ca.fabs,
    ca.OP_SIGN: ca.sign,
    ca.OP_FMIN: ca.fmin,
    ca.OP_FMAX: ca.fmax,
}


def _step(code: int, inputs: list[tuple[Any, Any, Any]]) -> tuple[Any, Any, Any]:
    """Return magnitude, error and (for parameters only) value of one operation."""
    magnitudes = [m for m, _, _ in inputs]
    errors = [e for _, e, _ in inputs]
    if all(value is not None for _, _, value in inputs):
        if code not in _FIXED:
            raise NoMajorant
        value = _FIXED[code](*[value for _, _, value in inputs])
        size = ca.fabs(value)
        return size, 4 * size if code not in (ca.OP_NEG, ca.OP_TWICE) else errors[0], value
    a, ea = magnitudes[0], errors[0]
    b, eb = (magnitudes[1], errors[1]) if len(inputs) > 1 else (SX(0), SX(0))
    if code in (ca.OP_ADD, ca.OP_SUB):
        return a + b, ea + eb + a + b, None
    if code == ca.OP_MUL:
        return a * b, ea * b + eb * a + a * b, None
    if code == ca.OP_SQ:
        return a * a, 2 * ea * a + a * a, None
    if code == ca.OP_TWICE:
        return 2 * a, 2 * ea, None
    if code == ca.OP_NEG:
        return a, ea, None
    if code in (ca.OP_SIN, ca.OP_COS):
        return SX(1), ea + 1, None
    if code == ca.OP_DIV and inputs[1][2] is not None:
        return a / b, (ea + a * eb / b) / b + a / b, None
    raise NoMajorant
